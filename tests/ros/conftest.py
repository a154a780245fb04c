"""Installs the packages once with colcon, and gives every test a ROS domain of its own."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[2] / 'ros2_ws' / 'src'

if importlib.util.find_spec('rclpy') is None:
    collect_ignore_glob = ['test_*.py']
else:
    from tests.ros.harness import System


def pytest_report_header() -> list[str]:
    """Say so where these tests are left out."""
    return [] if 'System' in globals() else [
        'tests/ros: left out, no ROS 2 here (make setup installs it)']


@pytest.fixture(scope='session')
def installed(tmp_path_factory) -> Path:
    """The folder into which colcon installed the packages."""
    folder = tmp_path_factory.mktemp('colcon')
    environment = {**os.environ}
    # ROS 2 from PyPI lives in the virtual environment.
    environment.setdefault('AMENT_PREFIX_PATH', sys.prefix)
    subprocess.run(
        [sys.executable, '-m', 'colcon', '--log-base', str(folder / 'log'), 'build',
         '--base-paths', str(SOURCES), '--build-base', str(folder / 'build'),
         '--install-base', str(folder / 'install'),
         '--packages-select', 'w2b_core', 'w2b_ros', 'w2b_controller', 'w2b_description',
         'w2b_sim', 'w2b_hw', 'w2b_web'],
        cwd=folder, env=environment, check=True, capture_output=True, timeout=600)
    return folder / 'install'


@pytest.fixture(scope='session')
def environment(installed) -> dict[str, str]:
    """The environment after `. install/setup.bash`, with quick discovery on this machine only."""
    base = {**os.environ}
    base.setdefault('AMENT_PREFIX_PATH', sys.prefix)
    # The packages under test are the installed ones, not the sources.
    base.pop('PYTHONPATH', None)
    output = subprocess.run(
        ['bash', '-c', '. "$0/setup.bash" && env -0', str(installed)], env=base, check=True,
        capture_output=True, timeout=600).stdout.decode()
    sourced = dict(item.split('=', 1) for item in output.split('\0') if '=' in item)
    profile = installed / 'w2b_ros' / 'share' / 'w2b_ros' / 'config' / \
        'quick_discovery.xml'
    return {**sourced, 'W2B_INSTALL': str(installed), 'PYTHONUNBUFFERED': '1',
            'PYTHONFAULTHANDLER': '1',
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(profile)}


@pytest.fixture
def system(environment, tmp_path):
    """A ROS domain with nothing in it yet but the test's client."""
    system = System(environment, tmp_path)
    yield system
    system.close()


@pytest.fixture(scope='module')
def _sim_and_brain(environment, tmp_path_factory):
    """One sim and one brain for a module's tests that leave them as they are."""
    system = System(environment, tmp_path_factory.mktemp('system'))
    system.start('sim')
    # The client is to see every frame from now on.
    system.wait(lambda: system.positions_m, 'a frame')
    system.start('brain')
    system.wait_for_brain()
    yield system
    system.close()


@pytest.fixture
def walking(_sim_and_brain):
    """A paused sim at its start, and a brain that was activated and heard nothing yet."""
    system = _sim_and_brain
    system.pause(True)
    assert system.transition('deactivate')
    system.wait_for_no_brain()
    system.forget()
    system.answers.clear()
    assert system.transition('activate')
    system.wait_for_brain()
    system.reset()
    return system
