"""What a tutorial says of a slip is what the program answers to it, in a line."""

import re
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from demo.ros_session import Domain

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / 'docs' / 'tutorials').glob('*.md'))
NO_ROS = ("python -c \"import sys; sys.modules['rclpy'] = None; sys.argv = ['w2b', 'say', 'halt']; "
          'from w2b_controller.cli.main import main; sys.exit(main())"')
#: Tutorial, what its table says, and the slip.
SLIPS = (
    ('talk', 'No rule to make target', 'make demo'),
    ('talk', 'expected the Python package rclpy, got none; source ROS 2 first',
     NO_ROS),
    ('talk', 'unknown body ...: expected one of ...', 'w2b sim --ros-args -p body:=nobody'),
    ('talk', 'controller: expected one of ..., got ...',
     'w2b brain --ros-args -p controller:=nobody'),
    ('evolve', 'body: expected one of ...', 'w2b train evolve --body nobody --out x '
     '--words go=forward,stop=stop'),
    ('evolve', "can't open file ...examples/evolve_minimal.py",
     'python examples/evolve_minimal.py'),
    ('evolve', 'controller: expected one of ..., got ...', 'w2b train judge nobody'),
    ('evolve', 'expected WORD=BEHAVIOUR',
     'w2b train evolve --body minimal --out x --words go,stop'),
    ('behaviour', '--plugin: ... expected a Python file, got nothing there',
     'w2b train --plugin nowhere.py evolve --body minimal --out x'),
    ('behaviour', '--plugin: ... ModuleNotFoundError: ...',
     'echo "import nobody_has_this" > mine.py; '
     'w2b train --plugin mine.py evolve --body minimal --out x'),
    ('body', "unknown body 'heavy': expected one of ...", 'w2b urdf heavy'),
    ('body', '... expected a Python file, got nothing there',
     'W2B_PLUGINS=$PWD/nowhere.py w2b urdf heavy'),
    ('words', 'unknown word ...: expected a word of the vocabulary default',
     'w2b teach hastenn forward --controller physical_twin --out m.json'),
    ('words', 'behaviour: expected one of stop, forward, ..., got ...',
     'w2b teach hasten forwards --controller physical_twin --out m.json'),
    ('words', '...: expected a lexicon, got No such file or directory',
     'w2b train ear --lexicon nowhere.yaml --out e.json'),
    ('robot', 'expected a YAML file, got nothing readable', 'w2b robot check nowhere.yaml'),
    ('robot', '...: is there already; delete it, or give another --out',
     'cp "$ROOT"/examples/robots/dog8.* .; w2b robot init dog8.urdf'),
    ('build', 'body: expected one of ...', 'w2b robot draw nobody --out v.svg'),
    ('build', '--out: expected a name that ends in .svg', 'w2b robot draw minimal --out v.png'),
    ('build', 'FAIL bus: no /dev/i2c-...', 'w2b preflight --transport /dev/i2c-99'),
    ('build', 'calibrate: expected a terminal', 'w2b calibrate --transport emulated </dev/null'),
    ('study', '...: no such file; ready configurations are in ...',
     'w2b train study training/configs/paper.yaml --out x'),
    ('study', '...: no study here; run ... first', 'w2b train report nowhere'),
    ('study', 'study import: ...: no such file', 'w2b train study import docs/study/paper.zip x'),
)


@pytest.fixture
def domain():
    claimed = Domain()
    yield claimed
    claimed.release()


def table(page: str) -> list[str]:
    """Return what a tutorial's last table says that the program says."""
    text = (ROOT / 'docs' / 'tutorials' / f'{page}.md').read_text(encoding='utf-8')
    return re.findall(r'^\| `([^`]*)`', text.rpartition('## When it does not work')[2],
                      re.MULTILINE)


def answered(said: str, expected: str) -> None:
    """Check that a line of what was said is what the table says, and that nothing crashed."""
    pattern = re.escape(expected).replace(r'\.\.\.', '.*')
    assert any(re.search(pattern, line) for line in said.splitlines()), said
    assert 'Traceback' not in said


@pytest.mark.parametrize('page', TUTORIALS, ids=lambda page: page.stem)
def test_every_tutorial_says_what_to_do_when_it_does_not_work(page):
    assert len(table(page.stem)) >= 3


@pytest.mark.parametrize(('page', 'expected', 'slip'), SLIPS, ids=lambda text: text[:40])
def test_a_slip_is_answered_in_the_line_that_the_tutorial_has(
        page, expected, slip, tmp_path, domain):
    assert expected in table(page)
    done = subprocess.run(
        [ROOT / 'scripts' / 'ros_env', 'bash', '-c', slip], cwd=tmp_path, text=True, timeout=200,
        capture_output=True, check=False, stdin=subprocess.DEVNULL,
        env={'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path), 'ROOT': str(ROOT),
             'ROS_DOMAIN_ID': str(domain.number)})
    assert done.returncode != 0
    answered(done.stdout + done.stderr, expected)


def test_a_workspace_that_is_not_built_is_told(tmp_path):
    (tmp_path / 'scripts').mkdir()
    shutil.copy(ROOT / 'scripts' / 'ros_env', tmp_path / 'scripts')
    done = subprocess.run([tmp_path / 'scripts' / 'ros_env', 'w2b', 'say', 'halt'], text=True,
                          capture_output=True, check=False, timeout=60)
    assert done.returncode == 1
    [expected] = [text for text in table('talk') if 'not built' in text]
    answered(done.stderr, expected)


def test_a_port_in_use_is_told(tmp_path, domain):
    with socket.create_server(('127.0.0.1', 0)) as taken:
        port = taken.getsockname()[1]
        done = subprocess.run(
            [ROOT / 'scripts' / 'ros_env', 'w2b', 'page', '--ros-args', '-p', f'port:={port}'],
            cwd=tmp_path, text=True, capture_output=True, check=False, timeout=200,
            env={'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path),
                 'ROS_DOMAIN_ID': str(domain.number)})
    assert done.returncode == 1
    [expected] = [text for text in table('talk') if 'is in use' in text]
    answered(done.stdout + done.stderr, expected)
    assert str(port) in done.stderr
