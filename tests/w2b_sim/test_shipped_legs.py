"""The shipped legs, in MuJoCo, with a simulated IMU: what the README says of them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip('mujoco', reason='MuJoCo is the judge here: requirements/sim.txt')


@pytest.fixture(scope='module')
def nominal():
    run = subprocess.run(
        [sys.executable, '-m', 'training', 'judge', 'physical_twin_legs', '--engine', 'mujoco',
         '--json', '--starts', '2', '--imu-noise', '--gyro-bias', '0.01'],
        capture_output=True, text=True, cwd=ROOT, timeout=250)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)['behaviours']


@pytest.mark.parametrize('behaviour', ['forward', 'backward'])
def test_it_walks_straight_both_ways(nominal, behaviour):
    did = nominal[behaviour]
    assert did['body_lengths_per_s'] >= 1.2
    assert did['worst_heading_error_deg'] <= 8
    assert abs(did['across_m']) <= 0.08 * abs(did['along_m'])


@pytest.mark.parametrize(('behaviour', 'sign'), [('left', 1), ('right', -1)])
def test_it_turns_on_the_spot(nominal, behaviour, sign):
    assert 60 <= sign * nominal[behaviour]['yaw_deg'] <= 200
    assert nominal[behaviour]['drift_m'] <= 0.12


def test_it_stops_and_sits_still(nominal):
    assert nominal['stop']['drift_m'] <= 0.01
    assert nominal['sit']['drift_m'] <= 0.01
    assert nominal['sit']['height_m'] < 0.5 * nominal['stop']['height_m']
    assert nominal['sit']['mean_torque_nm'] < 0.5 * nominal['stop']['mean_torque_nm']


def test_it_is_gentle_to_its_servos_and_does_not_fall(nominal):
    for did in nominal.values():
        assert did['fastest_joint_hz'] <= 2.5
        assert did['at_speed_limit'] <= 0.1
        assert did['falls'] == 0
