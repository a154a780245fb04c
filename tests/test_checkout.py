"""`make clean` and `scripts/setup`, in a checkout of their own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.skipif(shutil.which('make') is None, reason='no make')
def test_clean_removes_what_make_built_and_no_run(tmp_path):
    shutil.copy(ROOT / 'Makefile', tmp_path)
    built = ['ros2_ws/build/a', 'ros2_ws/install/a', 'ros2_ws/log/a', 'out/demo/robot.gif',
             '.ruff_cache/a', '.mypy_cache/a', '.pytest_cache/a', '.hypothesis/a',
             'training/__pycache__/a.pyc']
    kept = ['out/run/champion.json', 'out/studies/a', 'out/champions/__pycache__/a', '.venv/a',
            '.venv/__pycache__/a.pyc', 'ros2_ws/src/a.py', 'training/a.py']
    for name in built + kept:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('')
    subprocess.run(['make', '--silent', 'clean'], cwd=tmp_path, check=True)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob('*') if path.is_file()}
    assert left == {'Makefile', *kept}
    assert not (tmp_path / 'out' / 'demo').exists()


@pytest.fixture
def setup(tmp_path):
    """Return a function that runs scripts/setup with a Python that says its version is this."""
    (tmp_path / 'scripts').mkdir()
    shutil.copytree(ROOT / 'requirements', tmp_path / 'requirements')
    shutil.copy(ROOT / 'scripts' / 'setup', tmp_path / 'scripts')
    shutil.copy(ROOT / 'pyproject.toml', tmp_path)
    tools = tmp_path / 'tools'
    tools.mkdir()
    # No g++ and no apt-get among them.
    for name in ('bash', 'cat', 'dirname', 'grep', 'id', 'pwd', 'sha256sum'):
        (tools / name).symlink_to(shutil.which(name))

    def run(minor, group='all'):
        python = tmp_path / 'python'
        python.write_text(f"""#!{sys.executable}
import sys
if '-m' in sys.argv:
    sys.exit('venv is reached')
if '-c' in sys.argv:
    import sysconfig
    sys.version_info = (3, {minor}, 0, 'final', 0)
    sysconfig.get_path = lambda name: '/nowhere'
    exec(sys.argv[2])
""")
        python.chmod(0o755)
        return subprocess.run(
            ['bash', 'scripts/setup', group], cwd=tmp_path, text=True, capture_output=True,
            check=False,
            env={**os.environ, 'PATH': str(tools), 'PYTHON': str(python)})
    return run


def test_setup_names_what_building_pybullet_needs_before_it_builds(setup):
    tried = setup(12)
    assert tried.returncode == 1
    assert tried.stderr.count('\n') == 1
    assert 'run: sudo apt-get install g++ python3.12-dev (PyBullet has no wheel' in tried.stderr


def test_setup_needs_no_compiler_where_pybullet_has_a_wheel(setup):
    tried = setup(11)
    assert tried.returncode == 1
    assert 'venv is reached' in tried.stderr
    assert tried.stdout == 'setup: making .venv\n', 'said before it is done'
    assert 'g++' not in tried.stderr


def test_setup_knows_what_it_can_set_up(setup):
    tried = setup(11, 'everything')
    assert (tried.returncode, tried.stdout) == (2, '')
    assert tried.stderr == "setup: expected demo, play, all or docs, got 'everything'\n"


@pytest.fixture
def ros_env(tmp_path):
    """Return a function that runs scripts/ros_env with some variables, and what it passes on."""
    for name in ('scripts/ros_env', 'ros2_ws/install/setup.bash', '.venv/bin/activate'):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / 'scripts' / 'ros_env', tmp_path / 'scripts')
    (tmp_path / 'ros2_ws/install/setup.bash').write_text('')
    (tmp_path / '.venv/bin/activate').write_text(f'VIRTUAL_ENV={tmp_path}/.venv\n')

    def run(**variables):
        kept = {name: value for name, value in os.environ.items() if not name.startswith('ROS_')}
        done = subprocess.run(['bash', tmp_path / 'scripts/ros_env', 'env'], text=True, check=True,
                              capture_output=True, env={**kept, **variables})
        return dict(line.split('=', 1) for line in done.stdout.splitlines() if '=' in line)
    return run


def test_what_ros_env_starts_stays_on_this_machine_as_what_make_starts_does(ros_env):
    found = ros_env(ROS_STATIC_PEERS='robot.local')
    assert found['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert 'ROS_STATIC_PEERS' not in found
    makefile = (ROOT / 'Makefile').read_text()
    assert 'export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST' in makefile


def test_ros_env_reaches_another_machine_when_told_to(ros_env):
    found = ros_env(ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET', ROS_STATIC_PEERS='robot.local',
                    ROS_DOMAIN_ID='42')
    assert (found['ROS_AUTOMATIC_DISCOVERY_RANGE'], found['ROS_STATIC_PEERS'],
            found['ROS_DOMAIN_ID']) == ('SUBNET', 'robot.local', '42')
