"""The batched engine: same bits whatever the batch, failures that stay alone, refusals, faults."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.w2b_sim.odd_bodies import bent
from w2b_core import bodies
from w2b_core.bodies.model import Body, Box, Capsule, Joint, Link, Servo
from w2b_core.network import Network, prime
from w2b_sim.engines.batched import BatchedEngine, UnsupportedBodyError, Variations
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import EARTH, PAPER

SHORT = replace(PAPER, steps=60)
STARTS = (Start(), Start(height_m=0.001, pitch_rad=0.01))


def random_networks(body: Body, count: int, seed: int = 1) -> Network:
    rng = np.random.default_rng(seed)
    hidden, joints = body.hidden_neurons, len(body.joints)
    return Network(rng.normal(size=(count, hidden, hidden + 1 + len(body.sensors))),
                   rng.normal(size=(count, joints, hidden)),
                   np.array([joint.time_constant for joint in body.joints]))


def random_words(count: int, seed: int = 2) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=0.17, size=(count, 300))


def part(network: Network, chosen: slice | list[int]) -> Network:
    return Network(network.hidden_weights[chosen], network.motor_weights[chosen],
                   network.motor_time_constants)


def everything(evaluation) -> np.ndarray:
    return np.concatenate([evaluation.final_position_m, evaluation.path_length_m[..., None],
                           evaluation.largest_step_m[..., None], evaluation.touch_fraction], -1)


@pytest.fixture(scope='module')
def single() -> BatchedEngine:
    return BatchedEngine(bodies.get('quadruped'), SHORT, 'single')


@pytest.fixture(scope='module')
def batch(single):
    """Eleven controllers under two words from two starts: 44 evaluations, a partial last block."""
    network = random_networks(single.body, 11)
    words = random_words(2)
    return network, words, everything(single.evaluate(network, words, STARTS))


def test_outcomes_are_finite_and_plausible(batch):
    _network, _words, outcome = batch
    assert np.isfinite(outcome).all()
    assert (outcome[..., 2] > 0.02).all()
    assert (outcome[..., 2] < 0.3).all()
    assert (outcome[..., 3] > 0).all()
    assert (outcome[..., 5:] >= 0).all()
    assert (outcome[..., 5:] <= 1).all()
    assert 0.1 < outcome[..., 5:].mean() < 0.99


@settings(max_examples=20, deadline=None)
@given(order=st.lists(st.integers(0, 10), min_size=1, max_size=23))
def test_same_bits_in_any_batch(single, batch, order):
    network, words, outcome = batch
    again = everything(single.evaluate(part(network, order), words, STARTS))
    np.testing.assert_array_equal(again, outcome[order])


def test_same_bits_alone(single, batch):
    network, words, outcome = batch
    one = everything(single.evaluate(part(network, [4]), words[1:], STARTS[1:]))
    np.testing.assert_array_equal(one, outcome[4:5, 1:, 1:])


def test_same_bits_with_other_lanes_and_threads(single, batch):
    network, words, outcome = batch
    lanes = 8
    assert lanes != single.layout.lanes
    other = BatchedEngine(single.body, SHORT, 'single', threads=3, lanes=lanes)
    np.testing.assert_array_equal(everything(other.evaluate(network, words, STARTS)), outcome)


@pytest.mark.parametrize(('body', 'world', 'lanes'), [
    (bodies.get('minimal'), SHORT, 8), (bent(), replace(EARTH, steps=15, physics_steps=10), 16)],
    ids=['viscous', 'dry'])
def test_same_bits_with_torque_limited_joints(body, world, lanes):
    """Modes and slots of the solve with saturating servos do not depend on the neighbours."""
    network, words = random_networks(body, 11), random_words(2)
    usual = BatchedEngine(body, world, 'single')
    assert lanes != usual.layout.lanes
    together = everything(usual.evaluate(network, words, STARTS))
    other = BatchedEngine(body, world, 'single', threads=2, lanes=lanes)
    np.testing.assert_array_equal(everything(other.evaluate(network, words, STARTS)), together)
    order = [7, 2, 2, 10]
    few = everything(usual.evaluate(part(network, order), words[1:], STARTS[1:]))
    np.testing.assert_array_equal(few, together[order][:, 1:, 1:])


def test_same_bits_with_own_words(single, batch):
    network, words, outcome = batch
    own = np.broadcast_to(words, (11, *words.shape))
    np.testing.assert_array_equal(everything(single.evaluate(network, own, STARTS)), outcome)


def test_recording_changes_nothing_and_agrees(single, batch):
    network, words, outcome = batch
    log = single.record(network, words, STARTS)
    assert log.position_m.shape == (11, 2, 2, 60, 3)
    np.testing.assert_array_equal(log.position_m[..., -1, :], outcome[..., :3])
    np.testing.assert_allclose(log.touching.mean(axis=-2), outcome[..., 5:], atol=1e-6)
    steps = np.linalg.norm(np.diff(log.position_m[..., :2], axis=-2), axis=-1)
    np.testing.assert_allclose(steps.sum(-1), outcome[..., 3], rtol=1e-4)
    limits = [joint.upper_rad for joint in single.body.joints]
    assert (np.abs(log.joint_position_rad) <= np.array(limits) + 1e-3).all()


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize('where', ['hidden', 'motor'])
def test_bad_weights_fail_alone(single, batch, bad, where):
    network, words, outcome = batch
    hidden, motor = network.hidden_weights.copy(), network.motor_weights.copy()
    (hidden if where == 'hidden' else motor)[5, 1, 2] = bad
    again = everything(single.evaluate(
        Network(hidden, motor, network.motor_time_constants), words, STARTS))
    assert np.isnan(again[5]).all()
    others = [c for c in range(11) if c != 5]
    np.testing.assert_array_equal(again[others], outcome[others])


def test_bad_word_fails_alone(single, batch):
    network, words, outcome = batch
    broken = words.copy()
    broken[0, 17] = np.nan
    again = everything(single.evaluate(network, broken, STARTS))
    assert np.isnan(again[:, 0]).all()
    np.testing.assert_array_equal(again[:, 1], outcome[:, 1])


def test_diverging_robot_fails_alone(single, batch):
    """A start far below the floor is thrown out of all bounds; its neighbours are not touched."""
    network, words, outcome = batch
    again = everything(single.evaluate(
        network, words, STARTS,
        Variations(height_m=np.where(np.arange(11) == 3, -900.0, 0.0)[:, None, None])))
    others = [c for c in range(11) if c != 3]
    np.testing.assert_array_equal(again[others], outcome[others])
    assert not np.array_equal(again[3], outcome[3])


def test_priming_is_the_networks(single):
    """Priming inside the compiled call gives what w2b_core.network gives."""
    network, words = random_networks(single.body, 3), random_words(2)
    primed = prime(Network(network.hidden_weights[:, None], network.motor_weights[:, None],
                           network.motor_time_constants), words).hidden
    outside = single.evaluate_primed(network, primed, [Start()])
    inside = single.evaluate(network, words, [Start()])
    np.testing.assert_allclose(inside.final_position_m, outside.final_position_m, atol=1e-3)


def test_nothing_moves_without_weights(single):
    body = single.body
    still = Network(np.zeros((1, 5, 10)), np.zeros((1, 8, 5)),
                    np.array([joint.time_constant for joint in body.joints]))
    outcome = single.evaluate(still, random_words(1), [Start()])
    assert np.abs(outcome.final_position_m[0, 0, 0, :2]).max() < 1e-4
    assert outcome.final_position_m[0, 0, 0, 2] == pytest.approx(0.12, abs=0.003)


def test_single_follows_double(single):
    network, words = random_networks(single.body, 8, 5), random_words(2)
    short = replace(PAPER, steps=15)
    outcomes = [BatchedEngine(single.body, short, precision, sweeps=(8, 12), lanes=16).evaluate(
        network, words, STARTS).final_position_m for precision in ('single', 'double')]
    assert np.median(np.abs(outcomes[0] - outcomes[1])) < 1e-5


def test_yaw_turns_the_path_about_the_vertical(single):
    network, words = random_networks(single.body, 6, 3), random_words(1)
    short = BatchedEngine(single.body, replace(PAPER, steps=12), 'double')
    plain, turned = (short.evaluate(network, words, [Start(yaw_rad=yaw)]).final_position_m[:, 0, 0]
                     for yaw in (0.0, np.pi / 2))
    np.testing.assert_allclose(turned[:, 0], -plain[:, 1], atol=1e-6)
    np.testing.assert_allclose(turned[:, 1], plain[:, 0], atol=1e-6)


@pytest.mark.parametrize(('change', 'reason'), [
    (lambda body: replace(body, joints=(*body.joints, replace(
        body.joints[0], name='loop', child='front_lower_leg'))), 'closed loops'),
    (lambda body: replace(body, links=(replace(body.links[0], shape='mesh.stl'),
                                       *body.links[1:])), 'shape str of link base_link'),
    (lambda body: replace(body, joints=(replace(body.joints[0], servo=SpringServo()),
                                        *body.joints[1:])), 'servo law SpringServo'),
    (lambda body: replace(body, sensors=('lidar:base_link',)), "sensor 'lidar:base_link'"),
    (lambda body: replace(body, sensors=('touch:nose',)), "sensor 'touch:nose'"),
    (lambda body: replace(body, links=(*body.links, Link('loose', body.links[0].shape))),
     'no joint holds: loose'),
    (lambda body: replace(body, joints=body.joints[::-1]), 'before the joint of its parent'),
    (lambda body: replace(body, links=(replace(body.links[0], mass_kg=0.0),
                                       *body.links[1:])), 'without mass')])
def test_what_is_not_modelled_is_refused_with_the_reason(change, reason):
    with pytest.raises(UnsupportedBodyError, match=reason):
        BatchedEngine(change(bodies.get('quadruped')), PAPER)


def link_with(**changes):
    return lambda body: replace(body, links=(body.links[0], replace(body.links[1], **changes),
                                             *body.links[2:]))


def joint_with(**changes):
    return lambda body: replace(body, joints=(replace(body.joints[0], **changes),
                                              *body.joints[1:]))


@pytest.mark.parametrize(('change', 'reason'), [
    (link_with(mass_kg=np.inf), 'a mass of link front_upper_leg of inf'),
    (link_with(centre_m=(0.0, np.nan, 0.0)), 'a centre or axis of link front_upper_leg of nan'),
    (link_with(shape=Capsule(0.1, -0.02, (1.0, 0.0, 0.0))), 'a size of link .* of -0.02'),
    (link_with(shape=Capsule(np.nan, 0.02, (1.0, 0.0, 0.0))), 'a size of link .* of nan'),
    (link_with(shape=Capsule(0.1, 0.02, (0.0, 0.0, 0.0))), 'a size of link .* of 0.0'),
    (link_with(shape=Box((0.1, 0.0, 0.1))), 'a size of link .* of 0.0'),
    (joint_with(origin_m=(np.nan, 0.0, 0.0)), 'a place or axis of joint front_hip of nan'),
    (joint_with(upper_rad=np.inf), 'a limit of joint front_hip of inf'),
    (joint_with(time_constant=0.0), 'a time constant of joint front_hip of 0.0'),
    (joint_with(servo=Servo(gain_per_s=np.nan)), 'a servo gain of joint front_hip of nan'),
    (joint_with(servo=Servo(max_speed_up_rad_s=-1.0)), 'a servo speed of joint front_hip of -1.0'),
    (joint_with(servo=Servo(max_torque_nm=np.nan)), 'a servo torque of joint front_hip of nan'),
    (joint_with(name='front_knee'), 'joints of the same name'),
    (lambda body: replace(body, height_m=np.nan), 'a start height of nan'),
    (lambda body: replace(body, hidden_neurons=0), '0 hidden neurons'),
    (lambda body: replace(body, sensors=body.sensors[:1] * 2), 'the same sensor twice'),
    (lambda body: replace(body, links=(), joints=()), 'without links or without joints'),
    (lambda body: replace(body, links=body.links[:1], joints=()), 'without links or without')])
def test_numbers_that_no_body_has_are_refused(change, reason):
    with pytest.raises(UnsupportedBodyError, match=reason):
        BatchedEngine(change(bodies.get('quadruped')), PAPER)


def test_no_limit_of_speed_and_torque_is_modelled():
    servo = Servo(max_speed_up_rad_s=np.inf, max_torque_nm=np.inf)
    BatchedEngine(joint_with(servo=servo)(bodies.get('quadruped')), PAPER)


class SpringServo(Servo):
    """A servo law the engine does not have."""


def test_a_hinge_without_an_axis_is_refused():
    body = bodies.get('minimal')
    joint = replace(body.joints[0], axis=(0.0, 0.0, 0.0))
    assert isinstance(joint, Joint)
    with pytest.raises(UnsupportedBodyError, match='without an axis'):
        BatchedEngine(replace(body, joints=(joint,)), PAPER)


def test_wrong_shapes_are_named(single):
    words = random_words(1)
    with pytest.raises(ValueError, match=r'hidden weights of shape \(C, 5, 10\), got \(2, 5, 9\)'):
        single.evaluate(random_networks(bodies.get('minimal'), 2), words, STARTS)
    with pytest.raises(ValueError, match='signals'):
        single.evaluate(random_networks(single.body, 2), words[0], STARTS)
    with pytest.raises(ValueError, match='at least one'):
        single.evaluate(random_networks(single.body, 2), words, [])
    with pytest.raises(ValueError, match='precision'):
        BatchedEngine(single.body, PAPER, 'half')
    with pytest.raises(ValueError, match='coulomb'):
        single.evaluate(random_networks(single.body, 2), words, STARTS, Variations(friction=1.0))
    with pytest.raises(ValueError, match='friction of shape'):
        single.evaluate(random_networks(single.body, 2), words, STARTS,
                        Variations(friction=np.ones(7)))


@pytest.mark.parametrize('name', bodies.names())
def test_every_body_has_tables(name):
    body = bodies.get(name)
    engine = BatchedEngine(body, EARTH if body.world == 'earth' else PAPER)
    assert engine.layout.links == len(body.links)
    assert engine.layout.sensors == len(body.sensors)
    limited = {'minimal': 1, 'physical_twin': 12}
    assert engine.layout.dynamic == limited.get(name, 0)
