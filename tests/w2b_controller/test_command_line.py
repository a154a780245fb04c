"""An argument that an executable does not know ends it, with one line that says what to write."""

import subprocess
import sys

import pytest

from w2b_ros import node_help
from w2b_ros.ros_process import own

NODES = {'brain': 'w2b_controller.brain', 'sim': 'w2b_sim.sim', 'hardware': 'w2b_hw.node'}


@pytest.mark.parametrize(('arguments', 'left'), [
    ([], []),
    (['--bogus', 'x'], ['--bogus', 'x']),
    (['a', '--ros-args', '-p', 'b:=1', '-r', '__node:=c'], ['a']),
    (['--ros-args', '-p', 'b:=1', '--', 'x', '--ros-args', '-p', 'c:=1'], ['x']),
    (['--ros-args', '--ros-args', '-p', 'b:=1'], [])])
def test_what_is_not_for_ros_is_the_programs_own(arguments, left):
    assert own(['program', *arguments]) == left


@pytest.mark.parametrize(('arguments', 'line'), [
    (['--transport', 'emulated'],
     "expected --ros-args -p transport:=emulated, got '--transport emulated'"),
    (['--transport=emulated'],
     "expected --ros-args -p transport:=emulated, got '--transport=emulated'"),
    (['transport:=emulated'],
     "expected --ros-args -p transport:=emulated, got 'transport:=emulated'"),
    (['-p', 'auto_arm:=true'], "expected --ros-args -p auto_arm:=true, got 'auto_arm:=true'"),
    (['--auto-arm'], "expected --ros-args -p auto_arm:=VALUE, got '--auto-arm'"),
    (['--bogus', 'x'], "expected ROS arguments only, --ros-args -p NAME:=VALUE (see --help), "
                       "got '--bogus x'")])
def test_the_refusal_says_how_to_write_it(arguments, line):
    assert node_help.refusal(arguments, ['transport', 'auto_arm']) == line


@pytest.mark.parametrize(('executable', 'arguments', 'expected'), [
    ('hardware', ['--transport', 'emulated'], '--ros-args -p transport:=emulated'),
    ('brain', ['--controller', 'physical_twin'], '--ros-args -p controller:=physical_twin'),
    ('sim', ['--bogus'], "got '--bogus'"),
    ('sim', ['--ros-args', '-p', 'paused:=true', '--', 'x'], "got 'x'"),
    ('sim', ['--ros-args', '--bogus'], '--bogus'),
    ('hardware', ['--ros-args', '--transport', 'emulated'], '--transport')])
def test_a_node_does_not_start_with_arguments_that_it_would_ignore(executable, arguments,
                                                                   expected):
    pytest.importorskip('rclpy')
    done = subprocess.run(
        [sys.executable, '-c', f'from {NODES[executable]} import main; raise SystemExit(main())',
         *arguments], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    errors = [line for line in done.stderr.splitlines() if line.startswith('error: ')]
    assert len(errors) == 1, done.stderr
    assert expected in errors[0]
    assert 'Traceback' not in done.stderr
