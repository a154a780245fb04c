"""Commands mind their streams, and nothing else that they inherit."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAD = """
import sys
from w2b_core.command_process import command
@command
def main():
    {body}
sys.exit(main())
"""


def run(body: str, *, program: str | None = None, arguments=(), **options):
    """Run a command in a process of its own; None in `environment` takes a variable away."""
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path),
                   **options.pop('environment', {})}
    code = program or HEAD.format(body=body.replace('\n', '\n    '))
    return subprocess.run([sys.executable, '-c', code, *arguments], timeout=120, check=False,
                          env={key: value for key, value in environment.items()
                               if value is not None},
                          stderr=options.pop('stderr', subprocess.PIPE), **options)


@pytest.fixture
def unread():
    """A pipe whose reader has gone."""
    read, write = os.pipe()
    os.close(read)
    yield write
    os.close(write)


@pytest.mark.parametrize('body', [
    'print("x")\nreturn 0', 'print("x" * 1_000_000)', 'print("x", flush=True)\nreturn 3',
    'print("x")\nsys.exit(0)', 'import argparse\nprint("x")\nargparse.ArgumentParser().exit(0)'])
@pytest.mark.parametrize('buffered', ['', '1'])
def test_a_reader_that_has_gone_ends_a_command_in_silence(unread, body, buffered):
    done = run(body, stdout=unread, environment={'PYTHONUNBUFFERED': buffered or None})
    assert done.returncode == 141
    assert done.stderr == b''


def test_both_outputs_may_have_lost_their_reader(unread):
    done = run('print("x", file=sys.stderr, flush=True)\nreturn 0', stdout=unread, stderr=unread)
    assert done.returncode == 141


def test_what_the_command_does_at_its_end_is_done(unread, tmp_path):
    """A robot relaxes whoever reads what is printed."""
    done = run(f'try:\n    print("x", flush=True)\nfinally:\n    open({str(tmp_path / "end")!r}, '
               '"w").close()', stdout=unread)
    assert done.returncode == 141
    assert (tmp_path / 'end').exists()


def test_a_broken_pipe_of_another_kind_is_the_commands_own(tmp_path):
    done = run('import os\nread, write = os.pipe()\nos.close(read)\nos.write(write, b"x")',
               stdout=subprocess.PIPE)
    assert done.returncode == 1
    assert b'BrokenPipeError' in done.stderr


def test_a_full_disk_is_told_in_one_line():
    with open('/dev/full', 'wb') as full:
        done = run('print("x")\nreturn 0', stdout=full)
    assert done.returncode == 1
    assert done.stderr.count(b'\n') == 1
    assert b'expected to write the output, got No space left' in done.stderr


def test_closed_outputs_do_not_matter():
    done = subprocess.run(['sh', '-c', f'exec "{sys.executable}" -c "$0" >&- 2>&- <&-',
                           HEAD.format(body='print("x")\n    return 5')], timeout=120, check=False,
                          env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.returncode == 5


@pytest.mark.parametrize('encoding', ['ascii', 'latin-1', 'cp1252', 'utf-8'])
def test_any_encoding_writes_any_character(encoding):
    body = r'print("ruled ─ стой \udcff"); print("error: ─", file=sys.stderr)'
    done = run(body, stdout=subprocess.PIPE, environment={'PYTHONIOENCODING': encoding})
    assert done.returncode == 0
    assert done.stdout.startswith(b'ruled ')
    assert b'\\udcff' in done.stdout
    assert done.stderr.startswith(b'error: ')


def test_input_is_utf_8_whatever_the_environment_says():
    done = run('print([ascii(line.strip()) for line in sys.stdin])', stdout=subprocess.PIPE,
               input='стой\n'.encode() + b'\xff\n', environment={'PYTHONIOENCODING': 'ascii'})
    assert done.stdout.decode().strip() == str([ascii('стой'), ascii('\udcff')])


def test_what_a_notebook_leaves_behind_does_not_matter():
    body = ('import os\nfrom matplotlib.figure import Figure\n'
            'from w2b_sim.engines.jit import njit\n'
            'print(njit(lambda x: x + 1)(1), hasattr(njit(lambda x: x), "signatures"))')
    done = run(body, stdout=subprocess.PIPE, environment={
        'MPLBACKEND': 'module://matplotlib_inline.backend_of_no_such_notebook',
        'NUMBA_DISABLE_JIT': '1'})
    assert done.stdout == b'2 True\n', done.stderr.decode()


UNWRITABLE = dict.fromkeys((
    'HOME', 'XDG_CACHE_HOME', 'XDG_DATA_HOME', 'XDG_CONFIG_HOME', 'W2B_CACHE_DIR', 'W2B_DATA',
    'MPLCONFIGDIR', 'ROS_HOME', 'NUMBA_CACHE_DIR', 'TMPDIR'), '/proc/nowhere')
ENVIRONMENTS = {
    'of a notebook, nowhere to write': {
        'MPLBACKEND': 'module://matplotlib_inline.backend_of_no_such_notebook',
        'PYTHONIOENCODING': 'ascii', 'NUMBA_DISABLE_JIT': '1', **UNWRITABLE},
    'of a bare service': {'HOME': None, 'LC_ALL': 'C', 'PYTHONUTF8': '0',
                          'PYTHONCOERCECLOCALE': '0'},
}
#: Commands that need neither ROS nor a robot.
COMMANDS = {
    'neighbours': ('w2b_core.vocabulary', 'neighbours', 'halt'),
    'vocabularies': ('w2b_core.vocabulary', 'list'),
    'urdf': ('w2b_sim.print_urdf', 'quadruped'),
    'relax': ('w2b_hw.relax', '--transport', 'emulated'),
    'preflight': ('w2b_hw.preflight', '--transport', 'emulated'),
    'training': ('training', '--help'), 'report': ('training', 'report', '--help'),
    'fidelity': ('training', 'fidelity', '--help'),
}
MAIN = ('import sys, importlib\n'
        'module = importlib.import_module(sys.argv.pop(1))\n'
        'sys.exit(module.main())')


def call(name: str, **options):
    module, *arguments = COMMANDS[name]
    module += '.__main__' if module in ('training', 'w2b_core.vocabulary') else ''
    return run('', program=MAIN, arguments=(module, *arguments), **options)


@pytest.mark.parametrize('environment', ENVIRONMENTS)
@pytest.mark.parametrize('name', COMMANDS)
def test_the_environment_does_not_matter(name, environment):
    done = call(name, stdout=subprocess.PIPE, environment=ENVIRONMENTS[environment])
    assert done.returncode == 0, done.stderr.decode() + done.stdout.decode()
    assert b'Traceback' not in done.stderr
    assert done.stdout


@pytest.mark.parametrize('name', COMMANDS)
def test_every_commands_reader_may_go(unread, name):
    done = call(name, stdout=unread, environment={'PYTHONUNBUFFERED': '1'})
    # argparse prints help to a reader that has gone without a word, and ends with 0.
    assert done.returncode in ((0, 141) if COMMANDS[name][-1] == '--help' else (141,))
    assert done.stderr == b''


#: What a robot that rosdep alone set up may lack.
OPTIONAL = ('gensim', 'rich', 'smart_open', 'scipy', 'pandas', 'matplotlib', 'numba',
            'pybullet', 'mujoco', 'pydantic', 'smbus2', 'imufusion', 'adafruit_pca9685', 'board')


@pytest.mark.parametrize('packages', [('rich',), OPTIONAL], ids=str)
def test_hearing_needs_no_optional_package(packages, tmp_path):
    """What a brain does with words, with packages that a robot may lack taken away."""
    words = tmp_path / 'words.txt'
    words.write_text('stop 1 2\nhalt 2 1\n', encoding='utf-8')
    body = f"""sys.modules.update(dict.fromkeys({packages!r}))
from w2b_core.vocabulary import Vocabulary, UnknownWordError
from w2b_core.vocabulary.command import main as vocabulary_command
vocabulary = Vocabulary.load()
assert vocabulary.phrase('Stop!').words == ('stop',)
try:
    vocabulary.phrase('forwrad')
except UnknownWordError as error:
    assert 'forward' in error.suggestions, error
assert vocabulary.neighbours('halt', count=1)[0][0] == 'halted'
assert vocabulary_command(['install', {str(words)!r}, '--name', 'two']) == 0
assert vocabulary_command(['list']) == 0"""
    done = run(body, stdout=subprocess.PIPE, environment={'W2B_DATA': str(tmp_path)})
    assert done.returncode == 0, done.stderr.decode()
    assert (Path(tmp_path) / 'vocabularies' / 'two').is_dir()


@pytest.mark.parametrize(('package', 'install'), [
    ('imufusion', 'pip install imufusion'), ('yaml', 'pip install PyYAML'),
    ('adafruit_pca9685', 'pip install adafruit-circuitpython-pca9685')])
@pytest.mark.parametrize('name', ['preflight', 'calibrate', 'relax'])
def test_the_robots_tools_work_with_less_or_say_what_to_install(tmp_path, name, package, install):
    body = (f'sys.modules[{package!r}] = None\nsys.argv = [{name!r}, "--transport", "emulated"]\n'
            + ('from w2b_hw.relax import main as tool' if name == 'relax'
               else f'from w2b_hw.entry import {name} as tool') + '\nreturn tool()')
    done = run(body, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL)
    said = (done.stdout + done.stderr).decode()
    assert 'Traceback' not in said
    if name == 'relax':  # the last thing between a dead node and warm servos
        assert done.returncode == 0
    else:
        assert install in said or 'expected a terminal' in said
        assert done.returncode in (1, 2)


def test_a_missing_package_is_told_in_one_line():
    for module, remedy in (('nonesuch.part', 'pip install nonesuch'), ('w2b_none', 'workspace'),
                           ('rclpy_none_msgs', 'source ROS')):
        done = run(f'import {module}')
        assert (done.returncode, done.stderr.count(b'\n')) == (2, 1)
        assert remedy in done.stderr.decode()


def test_gensims_view_says_what_to_install():
    body = ('sys.modules["gensim"] = None\nfrom w2b_core.vocabulary import Vocabulary\n'
            'try:\n    Vocabulary.load().keyed_vectors\n'
            'except ValueError as error:\n    print(error)')
    done = run(body, stdout=subprocess.PIPE)
    assert b'pip install gensim' in done.stdout
