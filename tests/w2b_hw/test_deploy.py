"""What is installed on the robot: units that systemd accepts, a script that fills them in."""

import configparser
import shutil
import subprocess
from pathlib import Path

import pytest

DEPLOY = Path(__file__).resolve().parents[2] / 'deploy'
UNITS = ('w2b-hardware.service', 'w2b-brain.service')


class Unit(configparser.ConfigParser):
    """A unit file: names keep their case."""

    optionxform = staticmethod(str)

    def __init__(self, path):
        super().__init__(strict=False, interpolation=None)
        self.read(path)


@pytest.fixture(scope='module')
def units(tmp_path_factory):
    folder = tmp_path_factory.mktemp('units')
    subprocess.run([DEPLOY / 'install.sh', '--units', folder], check=True)
    assert sorted(path.name for path in folder.iterdir()) == sorted(UNITS)
    return folder


@pytest.mark.parametrize('name', UNITS)
def test_units_are_filled_in_and_start_what_exists(units, name):
    text = (units / name).read_text()
    assert '@' not in text
    program = Path(Unit(units / name)['Service']['ExecStart'].split()[0])
    assert program == DEPLOY / 'run'
    assert program.stat().st_mode & 0o111


def test_the_hardware_unit_turns_off_however_the_node_ends(units):
    service = Unit(units / 'w2b-hardware.service')['Service']
    assert service['Type'] == 'notify'
    assert float(service['WatchdogSec']) <= 1
    assert service['ExecStopPost'].endswith('/.venv/bin/python -m w2b_hw.relax')
    assert service['ExecStopPost'] == service['ExecStartPre']
    parameters = Path(service['ExecStart'].split()[-1])
    assert 'auto_arm: false' in parameters.read_text()


def test_systemd_accepts_the_units(units):
    if shutil.which('systemd-analyze') is None:
        pytest.skip('no systemd-analyze on this machine')
    run = subprocess.run(['systemd-analyze', 'verify', *(str(units / name) for name in UNITS)],
                         capture_output=True, text=True, timeout=60)
    about_ours = [line for line in run.stderr.splitlines()
                  if any(name in line for name in UNITS)]
    # A checkout that was not set up has no .venv yet; everything else must be in order.
    assert [line for line in about_ours if 'is not executable' not in line] == []


@pytest.mark.parametrize('script', ['install.sh', 'run'])
def test_the_scripts_are_well_formed(script):
    subprocess.run(['bash', '-n', DEPLOY / script], check=True)


def test_run_names_an_executable_that_is_not_there(tmp_path):
    (tmp_path / 'deploy').mkdir()
    (tmp_path / 'ros2_ws' / 'install').mkdir(parents=True)
    (tmp_path / 'ros2_ws' / 'install' / 'setup.bash').write_text('')
    script = (DEPLOY / 'run').read_text().replace('/opt/ros/jazzy/setup.bash', '/dev/null')
    (tmp_path / 'deploy' / 'run').write_text(script)
    run = subprocess.run(['bash', tmp_path / 'deploy' / 'run', 'walk'], capture_output=True,
                         text=True)
    assert run.returncode == 1
    assert 'no executable walk' in run.stderr
