"""`w2b` without a ROS graph: help, usage errors, and what it says where something is missing."""

import importlib
import os
import subprocess
import sys

import pytest

from w2b_controller.cli.commands import COMMANDS
from w2b_core import __version__
from w2b_core.shell import w2b_command

#: Runs a command as where a module is not installed.
WITHOUT = """
import sys
absent = sys.argv.pop(1)
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] == absent:
            raise ModuleNotFoundError(f'No module named {name!r}', name=name)
sys.meta_path.insert(0, Absent())
from w2b_controller.cli.main import main
raise SystemExit(main())
"""


def without(module, *arguments):
    return subprocess.run([sys.executable, '-c', WITHOUT, module, *arguments],
                          capture_output=True, text=True, timeout=120, check=False,
                          env={**os.environ, 'W2B_RUN': ''})


def w2b(*arguments):
    return without('no_such_module', *arguments)


def test_help_lists_every_command():
    done = w2b('--help')
    assert done.returncode == 0
    for name in COMMANDS:
        assert f'  {name} ' in done.stdout
        assert COMMANDS.get(name).about in done.stdout


def test_the_version_is_printed():
    assert w2b('--version').stdout == f'w2b {__version__}\n'


def test_no_command_is_a_usage_error():
    assert w2b().returncode == 2


def test_an_unknown_command_is_answered_with_the_nearest():
    done = w2b('stpo')
    assert done.returncode == 2
    assert "unknown command 'stpo': expected one of say, " in done.stderr
    assert done.stderr.endswith("did you mean 'stop'?\n")


@pytest.mark.parametrize('name', list(COMMANDS))
def test_each_command_is_there(name):
    module, _, function = COMMANDS.get(name).target.partition(':')
    assert callable(getattr(importlib.import_module(module), function))


@pytest.mark.parametrize('name', ['arm', 'disarm', 'stop', 'reset', 'pause', 'status', 'say',
                                  'echo', 'console', 'vocabulary', 'urdf', 'train', 'relax'])
def test_each_command_explains_itself_without_ros(name):
    done = without('rclpy', name, '--help')
    assert done.returncode == 0, done.stderr
    assert 'usage:' in done.stdout


@pytest.mark.parametrize('name', ['arm', 'stop', 'status'])
def test_a_command_that_needs_ros_says_what_to_install(name):
    done = without('rclpy', name)
    assert done.returncode == 2
    assert done.stderr == (
        f'w2b {name}: cannot start, the module rclpy is missing; in the checkout run `python -m '
        "pip install '.[ros]'` (a standard Jazzy has ROS: source it and the workspace)\n")


def test_say_without_ros_is_one_line_that_names_what_is_missing():
    done = without('rclpy', 'say', 'forward')
    assert done.returncode == 2
    assert done.stderr.startswith('w2b say: expected the Python package rclpy, got none; ')
    assert done.stderr.count('\n') == 1


def test_a_node_of_a_package_that_was_not_built_is_named():
    done = without('w2b_sim', 'sim')
    assert done.returncode == 2
    assert done.stderr.startswith('w2b sim: cannot start, the module w2b_sim is missing; build it')


@pytest.mark.parametrize(('arguments', 'expected'), [
    (['echo'], 'required: topic'),
    (['echo', 'odom', '--count', '0'], 'expected a whole number above 0, got 0'),
    (['arm', '--timeout', 'nan'], 'expected seconds above 0, got nan'),
    (['arm', 'now'], 'unrecognized arguments: now')])
def test_usage_errors_exit_with_2(arguments, expected):
    done = w2b(*arguments)
    assert done.returncode == 2
    assert expected in done.stderr


def test_messages_name_the_command_as_it_has_to_be_typed(monkeypatch):
    monkeypatch.delenv('W2B_RUN', raising=False)
    assert w2b_command('brain') == 'w2b brain'
    monkeypatch.setenv('W2B_RUN', 'scripts/ros_env')
    assert w2b_command('brain') == 'scripts/ros_env w2b brain'
