"""The brain as a process: it hears words over ROS, and claims no motion where no body is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from w2b_ros.testing import DEADLINE_S, own_domain

RUN = 'from w2b_controller.{name} import main; raise SystemExit(main())'


@pytest.fixture
def environment():
    """A ROS domain of its own on this machine."""
    return {**os.environ, **own_domain()}


def start(name, environment, *arguments):
    return subprocess.Popen([sys.executable, '-c', RUN.format(name=name), *arguments],
                            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True)


def say(environment, *arguments):
    with start('say', environment, '--timeout', '60', *arguments) as process:
        output, _ = process.communicate(timeout=DEADLINE_S)
    return process.returncode, output


def test_it_answers_words_and_says_that_no_body_follows(environment):
    brain = start('brain', environment)
    try:
        code, output = say(environment, 'forward')
        assert code == 3, output
        assert 'no body is there' in output
        assert say(environment, '--understood', 'forward')[0] == 0
        code, output = say(environment, 'qwxzv')
        assert code == 1, output
        assert "unknown word 'qwxzv'" in output
    finally:
        brain.terminate()
        output, _ = brain.communicate(timeout=DEADLINE_S)
    assert brain.returncode == 0, output


def test_the_launch_file_describes_its_arguments():
    pytest.importorskip('launch_ros', reason='launch comes with a standard ROS 2 only')
    from launch.actions import DeclareLaunchArgument
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    path = Path(__file__).parents[1] / 'launch' / 'brain.launch.py'
    description = get_launch_description_from_python_launch_file(str(path))
    arguments = {entity.name: entity.description for entity in description.entities
                 if isinstance(entity, DeclareLaunchArgument)}
    assert {'controller', 'namespace', 'params_file', 'use_sim_time', 'on_exit'} <= set(arguments)
    assert all(arguments.values())
