"""
The tutorials' commands run as they stand there.

A tutorial is one shell session: its `sh` blocks run from top to bottom, in an empty directory that
has the checkout's `training` and `examples`. A block with a title that is a file name is written
to that file. Blocks titled `AT_THE_KEYBOARD` run in a terminal of their own, and q leaves them.
Blocks with one of the titles of `NOT_HERE` are not run.
"""

import os
import pty
import re
import select
import signal
import subprocess
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

from demo.ros_session import Domain
from w2b_sim.own_robot.command import main as robot

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / 'docs' / 'tutorials').glob('*.md'))
AT_THE_KEYBOARD = 'at the keyboard'
NOT_HERE = ('on the robot', 'on a standard Jazzy', 'takes long')
MKDOCS = ROOT / '.venv' / 'docs' / 'bin' / 'mkdocs'
BLOCK = re.compile(r'^```(\w*)(?: title="([^"]*)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)


def session(page: Path) -> tuple[dict[str, str], list[str]]:
    """Return a tutorial's files and its commands."""
    files, commands = {}, []
    for language, title, text in BLOCK.findall(page.read_text(encoding='utf-8')):
        assert language, f'{page.name}: a block without a language: {text[:60]!r}'
        if language == 'sh' and not title:
            commands.append(text)
        elif language == 'sh':
            assert title in (AT_THE_KEYBOARD, *NOT_HERE), f'{page.name}: {title!r}'
        elif title:
            files[title] = text
        else:
            assert language == 'text', f'{page.name}: {language} that nothing runs: {text[:60]!r}'
    return files, commands


@pytest.fixture
def domain():
    claimed = Domain()
    yield claimed
    claimed.release()


@pytest.mark.parametrize('page', TUTORIALS, ids=lambda page: page.stem)
def test_its_commands_run(page, tmp_path, domain):
    files, commands = session(page)
    assert commands, 'a tutorial has something to do'
    for name in ('training', 'examples'):
        (tmp_path / name).symlink_to(ROOT / name)
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    script = '\n'.join(['set -euo pipefail', 'trap "kill 0" EXIT', *commands, 'echo "the end"'])
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain.number),
                   'W2B_DATA': str(tmp_path / 'data')}
    with subprocess.Popen([ROOT / 'scripts' / 'ros_env', 'bash', '-c', script], cwd=tmp_path,
                          text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          start_new_session=True, env=environment) as running:
        try:
            said, _ = running.communicate(timeout=280)
        finally:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGKILL)
    # Then `kill 0` ends what it left in the background, and bash with it.
    assert 'the end' in said.splitlines(), said
    assert 'Traceback' not in said, said
    for expected in re.findall(r'^```text\n(.*?)^```$', page.read_text(), re.MULTILINE | re.DOTALL):
        for line in expected.splitlines():
            pattern = re.escape(line.strip()).replace(r'\.\.\.', '.*')
            assert re.search(pattern, said), f'not said: {line!r}\n{said}'


KEYBOARD = [(page.stem, line) for page in TUTORIALS
            for _, title, text in BLOCK.findall(page.read_text(encoding='utf-8'))
            if title == AT_THE_KEYBOARD for line in text.splitlines()]


@pytest.mark.parametrize(('page', 'line'), KEYBOARD)
def test_what_is_typed_at_the_keyboard_starts_and_is_left_with_q(page, line, tmp_path):
    [quoted] = re.findall(r'It says `([^`]*)`; `q` leaves', (
        ROOT / 'docs' / 'tutorials' / f'{page}.md').read_text(encoding='utf-8'))
    terminal, other = pty.openpty()
    with subprocess.Popen([ROOT / 'scripts' / 'ros_env', 'bash', '-c', line], cwd=tmp_path,
                          stdin=other, stdout=other, stderr=other) as running:
        os.close(other)
        said, deadline_s = '', time.monotonic() + 60
        try:
            while quoted not in said:
                assert select.select([terminal], [], [], deadline_s - time.monotonic())[0], said
                said += os.read(terminal, 4096).decode(errors='replace')
            os.write(terminal, b'q')
            assert running.wait(timeout=30) == 0, said
        finally:
            running.kill()
            os.close(terminal)


def test_the_drawings_of_the_site_are_what_the_command_draws(tmp_path):
    for sheet in ('views', 'wiring', 'horns'):
        assert robot(['draw', 'physical_twin', '--sheet', sheet,
                      '--out', str(tmp_path / f'{sheet}.svg')]) == 0
        made, shown = (ElementTree.parse(folder / f'{sheet}.svg')
                       for folder in (tmp_path, ROOT / 'docs' / 'images' / 'build'))
        assert [(part.get('id'), part.text) for part in made.iter()] == [
            (part.get('id'), part.text) for part in shown.iter()], (
                f'w2b robot draw physical_twin --sheet {sheet} --out docs/images/build/{sheet}.svg')


@pytest.mark.skipif(not MKDOCS.exists(), reason='mkdocs: make docs')
def test_the_site_is_built_strictly_and_asks_no_other_machine(tmp_path):
    done = subprocess.run(
        [MKDOCS, 'build', '--quiet', '--strict', '--site-dir', tmp_path], cwd=ROOT, text=True,
        capture_output=True, check=False, timeout=250)
    assert done.returncode == 0, done.stdout + done.stderr
    for page in tmp_path.rglob('*.html'):
        asked = re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//[^"]*"',
                           page.read_text(encoding='utf-8'))
        assert not asked, f'{page.name}: {asked}'
