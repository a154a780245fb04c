"""Worlds and bodies that differ from lane to lane, dry friction, torque limits, machine code."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.engines.batched import BatchedEngine, Variations
from w2b_sim.engines.batched.compilation import cache_folder
from w2b_sim.engines.batched.tables import compile_body
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import EARTH, PAPER

SHORT = replace(PAPER, steps=60)


def random_networks(body, count, seed=1):
    rng = np.random.default_rng(seed)
    hidden, joints = body.hidden_neurons, len(body.joints)
    return Network(rng.normal(size=(count, hidden, hidden + 1 + len(body.sensors))),
                   rng.normal(size=(count, joints, hidden)),
                   np.array([joint.time_constant for joint in body.joints]))


WORDS = np.random.default_rng(2).normal(scale=0.17, size=(2, 300))


@pytest.fixture(scope='module')
def dry():
    return BatchedEngine(bodies.get('quadruped'), SHORT, 'single', friction_law='coulomb')


@pytest.fixture(scope='module')
def network(dry):
    return random_networks(dry.body, 12)


def finals(engine, network, variations=None, words=WORDS):
    return engine.evaluate(network, words, [Start()], variations).final_position_m


def test_unbounded_dry_friction_is_the_viscous_law(dry, network):
    viscous = BatchedEngine(dry.body, SHORT, 'single')
    apart = np.linalg.norm(finals(dry, network) - finals(viscous, network), axis=-1)
    assert np.median(apart) < 0.01


def test_naming_the_worlds_own_values_changes_nothing(dry, network):
    own = Variations(slip_m_per_n_s=PAPER.slip_m_per_n_s, friction=np.inf, erp=PAPER.erp,
                     gravity_m_s2=PAPER.gravity_m_s2, base_mass_scale=1.0, servo_gain_scale=1.0,
                     touch_gap_m=1.3e-7, seed=7)
    np.testing.assert_array_equal(finals(dry, network, own), finals(dry, network))


@pytest.mark.parametrize('variations', [
    Variations(slip_m_per_n_s=1e-3), Variations(friction=0.3), Variations(erp=0.4),
    Variations(gravity_m_s2=-2.0), Variations(base_mass_scale=1.5), Variations(height_m=0.01),
    Variations(roll_rad=0.05), Variations(pitch_rad=0.05), Variations(yaw_rad=0.5),
    Variations(touch_gap_m=0.005), Variations(touch_delay=True),
    Variations(touch_flip_probability=0.2), Variations(push_m_s=0.02),
    Variations(servo_gain_scale=0.7), Variations(motor_noise_rad_s=0.3)])
def test_each_variation_changes_the_walk(dry, network, variations):
    apart = np.linalg.norm(finals(dry, network, variations) - finals(dry, network), axis=-1)
    assert np.isfinite(apart).all()
    assert np.median(apart) > 1e-5


def test_a_variation_concerns_its_own_evaluations_alone(dry, network):
    friction = np.full((12, 1, 1), np.inf)
    friction[4] = 0.5
    plain, varied = finals(dry, network), finals(dry, network, Variations(friction=friction))
    others = np.arange(12) != 4
    np.testing.assert_array_equal(varied[others], plain[others])
    assert not np.array_equal(varied[4], plain[4])


def test_same_bits_in_any_batch_with_dry_friction(dry, network):
    slippery = Variations(friction=0.5, slip_m_per_n_s=1e-3)
    whole = finals(dry, network, slippery)
    for chosen in ([3], [11, 3, 7], list(range(12)) * 3):
        part = Network(network.hidden_weights[chosen], network.motor_weights[chosen],
                       network.motor_time_constants)
        np.testing.assert_array_equal(finals(dry, part, slippery), whole[chosen])


def test_same_bits_in_any_batch_with_torque_limits():
    twin = BatchedEngine(bodies.get('physical_twin'), replace(EARTH, steps=20, physics_steps=10),
                         'single')
    network = random_networks(twin.body, 6)
    whole = finals(twin, network)
    assert np.isfinite(whole).all()
    for chosen in ([3], [5, 0], list(range(6)) * 4):
        part = Network(network.hidden_weights[chosen], network.motor_weights[chosen],
                       network.motor_time_constants)
        np.testing.assert_array_equal(finals(twin, part), whole[chosen])


def test_luck_follows_the_seed_and_not_the_batch(dry, network):
    seeds = np.arange(24).reshape(12, 2, 1)
    shaken = Variations(motor_noise_rad_s=0.3, push_m_s=0.01, touch_flip_probability=0.1,
                        seed=seeds)
    whole = finals(dry, network, shaken)
    part = Network(network.hidden_weights[5:8], network.motor_weights[5:8],
                   network.motor_time_constants)
    alone = finals(dry, part, replace(shaken, seed=seeds[5:8]))
    np.testing.assert_array_equal(alone, whole[5:8])
    other = finals(dry, network, replace(shaken, seed=seeds + 100))
    assert not np.array_equal(other, whole)


def test_dry_friction_bounds_the_slide(dry):
    """A body thrown along a slippery floor slides farther than on a rough one."""
    body = dry.body
    still = Network(np.zeros((1, 5, 10)), np.zeros((1, 8, 5)),
                    np.array([joint.time_constant for joint in body.joints]))
    variations = [Variations(friction=mu, slip_m_per_n_s=1e-4, push_m_s=0.02, seed=3)
                  for mu in (0.0, 1.0)]
    moved = [np.linalg.norm(finals(dry, still, one, WORDS[:1])[0, 0, 0, :2])
             for one in variations]
    assert moved[0] > 5 * moved[1]


@pytest.mark.parametrize(('variations', 'message'), [
    (Variations(erp=1.5), 'erp: expected numbers from 0.0 to 1.0'),
    (Variations(friction=-1.0), 'friction'), (Variations(gravity_m_s2=np.nan), 'gravity_m_s2'),
    (Variations(touch_gap_m=0.5), 'touch_gap_m')])
def test_variations_out_of_range_are_named(dry, network, variations, message):
    with pytest.raises(ValueError, match=message):
        finals(dry, network, variations)


def test_torque_limited_joints_that_never_saturate_are_kinematic():
    """With strong servos the two kinds of joints are the same mechanics."""
    body = bodies.get('minimal')
    strong = replace(body, joints=(replace(body.joints[0], servo=replace(
        body.joints[0].servo, max_torque_nm=1e6)),))
    network, world = random_networks(strong, 4), replace(PAPER, steps=10)
    kinematic, dynamic = (finals(BatchedEngine(strong, world, joints=joints, sweeps=(400, 400)),
                                 network) for joints in ('kinematic', 'dynamic'))
    np.testing.assert_allclose(dynamic, kinematic, atol=2e-4)


def test_a_weak_servo_does_not_lift():
    """The twin's servos at a thousandth of their torque leave it on the floor where it stands."""
    body = bodies.get('physical_twin')
    weak = replace(body, joints=tuple(replace(joint, servo=replace(
        joint.servo, max_torque_nm=joint.servo.max_torque_nm / 1000)) for joint in body.joints))
    world = replace(EARTH, steps=20, physics_steps=10)
    network = random_networks(body, 4)
    outcomes = [BatchedEngine(one, world, 'single').record(network, WORDS[:1], [Start()])
                for one in (body, weak)]
    heights = [outcome.position_m[:, 0, 0, -1, 2] for outcome in outcomes]
    assert (heights[1] < 0.05).all()
    assert heights[0].max() > heights[1].max() + 0.01
    limits = np.array([joint.upper_rad for joint in body.joints])
    assert (np.abs(outcomes[0].joint_position_rad) < limits + 0.02).all()


def test_saturation_is_decided_by_torque():
    body = bodies.get('quadruped')
    assert (compile_body(body, PAPER).tables.dynamic == -1).all()
    assert (compile_body(body, PAPER, 'dynamic').tables.dynamic >= 0).all()
    weak = replace(body, joints=tuple(replace(joint, servo=replace(
        joint.servo, max_torque_nm=0.5)) for joint in body.joints))
    assert (compile_body(weak, PAPER).tables.dynamic >= 0).any()


def test_a_locked_joint_stays_kinematic():
    assert (compile_body(bodies.get('spherical_1dof_blind'), PAPER, 'dynamic').tables.dynamic
            == [0, -1]).all()


def test_machine_code_is_kept_where_asked_and_nowhere_if_it_cannot_be(tmp_path):
    script = 'from w2b_sim.engines.batched.compilation import cache_folder; print(cache_folder())'
    paths = os.pathsep.join(path for path in sys.path if path)

    def folder(cache: str) -> str:
        environment = {**os.environ, 'W2B_CACHE_DIR': cache, 'PYTHONPATH': paths}
        return subprocess.run([sys.executable, '-c', script], env=environment, check=True,
                              capture_output=True, text=True).stdout.strip()
    assert folder(str(tmp_path / 'cache')).startswith(str(tmp_path / 'cache'))
    (tmp_path / 'file').write_text('in the way')
    assert folder(str(tmp_path / 'file')) == 'None'
    assert cache_folder() is None or cache_folder().is_dir()
