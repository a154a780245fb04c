"""The tools refuse what they do not know, and leave to ROS what is ROS's."""

import subprocess
import sys

import pytest

TOOLS = {'calibrate': [], 'preflight': [], 'relax': [], 'emulation.server': ['{folder}/chips']}


def run(tool, folder, *arguments):
    known = [argument.format(folder=folder) for argument in TOOLS[tool]]
    return subprocess.run([sys.executable, '-m', f'w2b_hw.{tool}', *known, *arguments],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60,
                          check=False)


@pytest.mark.parametrize('tool', TOOLS)
@pytest.mark.parametrize('arguments', [['--bus', '/dev/nope'], ['--', '--bogus'],
                                       ['--ros-args', '--', '--bogus']], ids=' '.join)
def test_an_unknown_argument_is_a_usage_error(tool, arguments, tmp_path):
    done = run(tool, tmp_path, *arguments)
    assert done.returncode == 2
    assert 'unrecognized arguments' in done.stderr
    assert not done.stdout
    assert not list(tmp_path.iterdir())


def test_what_a_launch_file_adds_is_left_out(tmp_path):
    done = run('relax', tmp_path, '--transport', 'emulated', '--ros-args', '-r', '__node:=relax')
    assert done.returncode == 0, done.stderr
    assert 'all channels' in done.stdout
