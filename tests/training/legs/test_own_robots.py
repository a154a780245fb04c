"""The controllers of the examples' robots are of the bodies beside them and reach the bounds."""

from pathlib import Path

import pytest

from training.judge.command import judge
from training.judge.conditions import Conditions
from training.judge.trial import Plan
from training.legs import gate
from w2b_core import bodies
from w2b_core.controller import file as controller_file

ROBOTS = Path(__file__).resolve().parents[3] / 'examples' / 'robots'
NAMES = ('dog12', 'dog8', 'spider12')


@pytest.mark.parametrize('name', NAMES)
def test_the_controller_is_of_the_body_beside_it(name):
    controller = controller_file.load(ROBOTS / f'{name}_legs.json')
    controller.refuse_another_body(bodies.check(str(ROBOTS / f'{name}.yaml')))


@pytest.mark.parametrize('imu', [{}, {'imu_noise': True, 'gyro_bias_rad_s': 0.01}],
                         ids=['exact', 'imu'])
@pytest.mark.parametrize('name', NAMES)
def test_it_reaches_every_bound(name, imu):
    controller = controller_file.load(ROBOTS / f'{name}_legs.json')
    rows = judge(controller, Plan('mujoco', gate.SECONDS, 0.0, Conditions(**imu)), 1)['behaviours']
    assert gate.misses({'mujoco': rows}) == []
    evolved = controller.record['legs']['examination']['behaviours']
    assert gate.refusals(evolved, {'mujoco': rows}) == []
