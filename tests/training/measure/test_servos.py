"""What a controller asks of its servos; and that the robot's limits fit the gaits that ship."""

import json
from pathlib import Path

import numpy as np
import pytest

from training.judge.command import commands_of
from training.measure import servos
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_hw.joints import JOINTS, named
from w2b_hw.safety import Limits, Safety, State
from w2b_sim.engines import registry
from w2b_sim.recording import Recording
from w2b_sim.walking import Phase, walk
from w2b_sim.worlds import EARTH

TWIN = bodies.get('physical_twin')
PERIOD_S = EARTH.control_period_s


def recording(torque_nm, frames=101):
    still = np.zeros((frames, 2))
    return Recording(PERIOD_S, np.zeros((frames, 3)), np.tile([1.0, 0, 0, 0], (frames, 1)),
                     np.zeros(frames), still, still, np.zeros((frames, 0)),
                     np.tile(torque_nm, (frames, 1)), still)


def test_a_stalled_servo_takes_its_stall_current_and_all_of_it_is_heat():
    motor = servos.Motor(supply_v=5.0, idle_a=0.02, stall_a=1.0)
    found = servos.facts(recording([0.0, 0.2]), ['a', 'b'], np.array([0.2, 0.2]), motor)
    assert found.current_a == pytest.approx(1.02)
    assert found.hottest_w == pytest.approx(5.0)
    assert found.hottest_joint == 'b'
    assert found.mean_torque_nm == pytest.approx(0.1)


def test_heat_grows_with_the_square_of_the_torque_and_comes_to_an_end():
    motor = servos.Motor(idle_a=0.0)
    half, whole = (float(motor.heat_w(np.array(share))) for share in (0.5, 1.0))
    assert whole == pytest.approx(4 * half)
    assert motor.warmer_k(1.0, 1e5) == pytest.approx(motor.kelvin_per_w)
    assert motor.warmer_k(1.0, motor.time_constant_s) == pytest.approx(0.632 * motor.kelvin_per_w,
                                                                       rel=1e-3)


@pytest.fixture(scope='module')
def legs():
    return controller_file.load(controller_file.shipped('physical_twin'))


@pytest.fixture(scope='module')
def walks(legs):
    simulation = registry.make_simulation('mujoco', TWIN, EARTH)
    found = {}
    for name, heard in commands_of(legs).items():
        simulation.reset()
        found[name] = walk(simulation, TWIN, legs, [Phase(heard, 100)], period_s=PERIOD_S)
    simulation.close()
    return found


def limits():
    joints = named('physical_twin')
    return Limits(joints.lower_rad, joints.upper_rad, joints.park_rad)


def followed(safety, targets_rad, from_s):
    """Return what a machine sends of targets, one a frame, and the time after the last."""
    sent = []
    for number, target in enumerate(targets_rad):
        now_s = from_s + PERIOD_S * number
        safety.take_target(target, now_s)
        sent.append(safety.step(now_s).position_rad)
        safety.confirm()
    return np.array(sent), from_s + PERIOD_S * len(targets_rad)


def armed():
    safety = Safety(limits())
    safety.take_target(limits().park_rad, 0.0)
    safety.step(0.0)
    assert safety.arm(0.0) is None
    _, now_s = followed(safety, [limits().park_rad] * 40, 0.0)
    assert safety.state is State.ACTIVE
    return safety, now_s


@pytest.mark.parametrize('word', ['stop', 'forward', 'backward', 'left', 'right', 'sit'])
def test_the_slew_limit_hardly_touches_a_gait(walks, word):
    safety, now_s = armed()
    order = [[joint.name for joint in TWIN.joints].index(name) for name in JOINTS]
    asked = walks[word].target_rad[:, order]
    sent, _ = followed(safety, asked, now_s)
    off = np.abs(sent - np.clip(asked, limits().lower_rad, limits().upper_rad))[20:]
    assert np.ptp(asked, axis=0).max() > 0.1
    assert off.mean() < 0.02
    assert (off > 0.05).mean() < 0.05


def test_the_duty_budget_ends_before_any_servo_is_hot(legs):
    """Estimated, over air of 25 degrees; plastic and grease of a micro servo bear 85."""
    found = servos.measured(legs, 'mujoco', 5.0)
    motor, budget_s = servos.Motor(), limits().duty_budget_s
    assert max(motor.warmer_k(one.hottest_w, budget_s) for one in found.values()) < 60.0


@pytest.mark.parametrize('word', ['forward', 'left', 'sit'])
def test_from_any_phase_of_a_gait_the_park_pose_is_reached_in_time_and_stands(legs, word):
    heard = commands_of(legs)[word]
    order = [JOINTS.index(joint.name) for joint in TWIN.joints]
    for frames in (60, 64, 68):
        simulation = registry.make_simulation('mujoco', TWIN, EARTH)
        log = walk(simulation, TWIN, legs, [Phase(heard, frames)], period_s=PERIOD_S)
        safety, now_s = armed()
        back = [[joint.name for joint in TWIN.joints].index(name) for name in JOINTS]
        _, now_s = followed(safety, log.target_rad[-20:, back], now_s)
        began_m = simulation.observe().position_m
        safety.park('asked to disarm', now_s)
        began_s = now_s
        while safety.state is State.PARK:
            now_s += PERIOD_S
            command = safety.step(now_s)
            safety.confirm()
            if any(command.energised):
                simulation.step(np.array(command.position_rad)[order])
        assert now_s - began_s < limits().park_at_most_s
        frame = simulation.observe()
        assert frame.position_m[2] > 0.9 * TWIN.height_m
        x, y = frame.orientation_xyzw[:2]
        assert 1 - 2 * (x * x + y * y) > 0.97
        assert np.hypot(*(frame.position_m - began_m)[:2]) < 0.05
        simulation.close()


def test_the_command_prints_a_table(capsys):
    from training.__main__ import main

    assert main(['servos', 'physical_twin', '--seconds', '2']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split('|')[1].strip() for line in lines[2:]] == [
        'stop', 'forward', 'backward', 'left', 'right', 'sit']
    assert main(['servos', 'physical_twin', '--seconds', '1']) == 2
    assert 'expected 2 to 3600' in capsys.readouterr().err


def test_the_servos_of_a_body_that_the_controller_carries_are_meant(capsys):
    from training.__main__ import main

    own = Path(__file__).resolve().parents[3] / 'examples' / 'robots' / 'dog12_legs.json'
    assert main(['servos', str(own), '--seconds', '2', '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    joints = {joint.name for joint in controller_file.load(own).described().joints}
    assert {one['hottest_joint'] for one in found.values()} <= joints
