"""Leaky networks in the batched engine: equal to numpy, phases, senses, situations."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from w2b_core import bodies
from w2b_core.behaviours import DEFAULT_BEHAVIOURS, holds
from w2b_core.network.leaky import BLOCKS, LeakyNetwork, LeakyState, step
from w2b_core.network.sharing import Sharing, mirrored_hidden
from w2b_core.network.symmetry import find_mirrors
from w2b_core.senses import Readings, Reference, gravity_in, read
from w2b_sim.engines.batched import UnsupportedBodyError
from w2b_sim.engines.batched.leaky_engine import LeakyEngine
from w2b_sim.engines.batched.leaky_variations import LeakyVariations
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import EARTH, PAPER

COMMANDS = np.eye(len(DEFAULT_BEHAVIOURS))
FORWARD, LEFT, STOP = (COMMANDS[DEFAULT_BEHAVIOURS.index(name)]
                       for name in ('forward', 'left', 'stop'))
#: Of every kind, on either body.
SENSES = {'physical_twin': ('heading', 'yaw_rate', 'steer', 'gravity:x', 'gravity:y', 'gravity:z',
                            'position:front_left_knee', 'motor:back_right_hip',
                            'touch:front_left_tibia'),
          'quadruped': ('touch:left_lower_leg', 'steer', 'heading', 'position:front_hip')}
WORLDS = {'physical_twin': replace(EARTH, physics_steps=10), 'quadruped': PAPER}


def networks(body, senses, count, seed=0):
    """Networks that keep moving: an oscillator, random synapses elsewhere."""
    sharing = Sharing(body, DEFAULT_BEHAVIOURS, senses, ())
    rng = np.random.default_rng(seed)
    genomes = rng.normal(scale=0.5, size=(count, sharing.size))
    for (row, column), value in np.ndenumerate(1.3 * np.array([[0.88, -0.48], [0.48, 0.88]])):
        sharing.put(genomes, 'hidden', row, column, value)
    return sharing.network(genomes)


def one(network, index):
    return LeakyNetwork(**{block.name: getattr(network, block.name)[index] for block in BLOCKS})


@pytest.fixture(scope='module')
def twin():
    body = bodies.get('physical_twin')
    return LeakyEngine(body, WORLDS[body.name], hidden=14, senses=SENSES[body.name])


@pytest.fixture(scope='module')
def walkers(twin):
    return networks(bodies.get('physical_twin'), SENSES['physical_twin'], 6)


@pytest.mark.parametrize('name', ['physical_twin', 'quadruped'])
def test_it_is_the_numpy_network_to_a_millionth_over_100_frames(name):
    """Fed with what the engine recorded, the numpy network asks for the same angles."""
    body, senses = bodies.get(name), SENSES[name]
    hidden = 2 + 3 * 4
    engine = LeakyEngine(body, WORLDS[name], hidden=hidden, senses=senses, precision='double')
    batch = networks(body, senses, 3, seed=4)
    commands = np.array([[FORWARD, 0.6 * LEFT + 0.3 * STOP, 0.5 * COMMANDS[2]]])
    recording = engine.record(batch, commands, [1.5, 1.5, 2.0], [Start(0.002, 0.02, -0.01, 0.4)])
    assert recording.frames == 101
    names = [joint.name for joint in body.joints]
    touching = [sense.partition(':')[2] for sense in senses if sense.startswith('touch:')]
    lower = np.array([joint.lower_rad for joint in body.joints])
    upper = np.array([joint.upper_rad for joint in body.joints])
    for c in range(3):
        network, walk = one(batch, c), recording.take((c, 0, 0))
        state, phase = network.initial_state(), -1
        for t in range(recording.frames):
            now = min(t // 30, 2)
            if now != phase:
                phase = now
                drive = network.drive(commands[0, phase])
                hold = holds(DEFAULT_BEHAVIOURS, commands[0, phase])
                reference = Reference(walk.yaw_rad[t], *hold)
            asked = lower + (state.motors + 1) / 2 * (upper - lower)
            np.testing.assert_allclose(walk.target_rad[t], asked, rtol=0, atol=1e-6)
            w, x, y, z = walk.orientation_wxyz[t]
            readings = Readings(
                dict(zip(touching, walk.touching[t], strict=True)),
                dict(zip(names, walk.joint_position_rad[t], strict=True)),
                dict(zip(names, state.motors, strict=True)), walk.yaw_rad[t],
                walk.yaw_rate_rad_s[t], gravity_in((x, y, z, w)))
            state = step(network, state, drive, read(senses, readings, reference))
        turns = Rotation.from_quat(walk.orientation_wxyz[:, [1, 2, 3, 0]])
        rates = (turns[:-1].inv() * turns[1:]).as_rotvec()[:, 2] / recording.period_s
        np.testing.assert_allclose(walk.yaw_rate_rad_s, [0.0, *rates], atol=0.02)
        moved = np.ptp(walk.target_rad, axis=0)
        assert moved.max() > 0.2, 'a network that stands proves nothing'


def test_a_later_phase_changes_nothing_before_it(twin, walkers):
    long = twin.record(walkers, [[FORWARD, FORWARD], [FORWARD, STOP]], [1.0, 1.0])
    first, second = long.take(np.s_[:, 0]), long.take(np.s_[:, 1])
    np.testing.assert_array_equal(first.target_rad[..., :21, :], second.target_rad[..., :21, :])
    assert not np.array_equal(first.target_rad[..., 22:, :], second.target_rad[..., 22:, :])


def test_same_bits_in_any_batch_and_any_threads(twin, walkers):
    situations = LeakyVariations(friction=[0.5, 0.9], seed=[3, 4], motor_noise_rad_s=0.3,
                                 gyro_noise_rad_s=0.05)
    whole = twin.record(walkers, [[FORWARD], [LEFT]], [1.0], variations=situations)
    some = LeakyNetwork(**{block.name: getattr(walkers, block.name)[[4, 1]] for block in BLOCKS})
    part = twin.record(some, [[FORWARD], [LEFT]], [1.0], variations=situations)
    np.testing.assert_array_equal(part.position_m, whole.position_m[[4, 1]])
    twin.threads = 2
    try:
        again = twin.record(walkers, [[FORWARD], [LEFT]], [1.0], variations=situations)
    finally:
        twin.threads = 1
    np.testing.assert_array_equal(again.position_m, whole.position_m)


@pytest.mark.parametrize('variations', [
    LeakyVariations(servo_speed_scale=0.5), LeakyVariations(servo_torque_scale=0.3),
    LeakyVariations(command_late=True), LeakyVariations(heading_offset_rad=0.2),
    LeakyVariations(gyro_bias_rad_s=0.1), LeakyVariations(gyro_noise_rad_s=0.2),
    LeakyVariations(gravity_noise=0.1), LeakyVariations(friction=0.3),
    LeakyVariations(base_mass_scale=1.5), LeakyVariations(push_m_s=0.05),
    LeakyVariations(motor_noise_rad_s=0.5), LeakyVariations(joint_zero_rad=np.full(12, 0.1))])
def test_each_variation_changes_the_walk(twin, walkers, variations):
    plain = twin.record(walkers, [[FORWARD]], [1.5])
    varied = twin.record(walkers, [[FORWARD]], [1.5], variations=variations)
    apart = np.linalg.norm(varied.position_m[..., -1, :] - plain.position_m[..., -1, :], axis=-1)
    assert np.isfinite(apart).all()
    assert np.median(apart) > 1e-5


def test_naming_the_nominal_values_changes_nothing(twin, walkers):
    plain = twin.record(walkers, [[FORWARD]], [1.0])
    named = twin.record(walkers, [[FORWARD]], [1.0], variations=LeakyVariations(
        servo_speed_scale=1.0, servo_torque_scale=1.0, command_late=False, heading_offset_rad=0.0,
        gyro_bias_rad_s=0.0, joint_zero_rad=np.zeros(12), seed=5))
    np.testing.assert_array_equal(named.position_m, plain.position_m)


def test_a_joint_zero_shifts_its_own_target(twin, walkers):
    zero = np.zeros(12)
    zero[3] = 0.1
    plain = twin.record(walkers, [[STOP]], [0.2])
    shifted = twin.record(walkers, [[STOP]], [0.2], variations=LeakyVariations(joint_zero_rad=zero))
    apart = shifted.target_rad[..., 0, :] - plain.target_rad[..., 0, :]
    np.testing.assert_allclose(apart, np.broadcast_to(zero, apart.shape), atol=1e-6)


def test_servos_at_their_limit_and_their_torque_are_recorded(twin, walkers):
    slow = twin.record(walkers, [[FORWARD]], [1.5],
                       variations=LeakyVariations(servo_speed_scale=[1.0, 0.1]))
    share = slow.limited[..., 1:, :].mean((0, 1, 3, 4))
    assert share[0] < 0.3 < share[1]
    assert (slow.limited >= 0).all()
    assert (slow.limited <= 1).all()
    torque = slow.torque_nm[..., 1:, :]
    assert 0.005 < torque.mean() < 0.18
    assert torque.max() <= 0.18 * 1.001


def test_a_mirrored_command_gives_the_mirrored_walk(twin):
    """The symmetry that is found from the geometry holds in the simulation: right is left's."""
    body = bodies.get('physical_twin')
    senses = tuple(sense for sense in SENSES['physical_twin'] if ':' not in sense)
    sharing = Sharing(body, DEFAULT_BEHAVIOURS, senses, find_mirrors(body))
    engine = LeakyEngine(body, WORLDS[body.name], hidden=14, senses=senses, precision='double')
    rng = np.random.default_rng(8)
    genome = rng.normal(scale=0.4, size=(4, sharing.size))
    for (row, column), value in np.ndenumerate(1.3 * np.array([[0.88, -0.48], [0.48, 0.88]])):
        sharing.put(genome, 'hidden', row, column, value)
    network = sharing.network(genome)
    for mirror in find_mirrors(body):
        image = mirrored_hidden(mirror, sharing.hidden)
        other = replace(network, rest=image.apply(network.rest))
        x, y = (-1, 1) if mirror.name == 'fore_aft' else (1, -1)
        u = mirror.behaviours(DEFAULT_BEHAVIOURS).apply(COMMANDS)
        chosen = [DEFAULT_BEHAVIOURS.index(name) for name in ('forward', 'left')]
        here = engine.record(network, COMMANDS[chosen, None], [0.5])
        there = engine.record(other, u[chosen, None], [0.5])
        way, image_way = (walk.position_m[:, 0, 0, -1, :2] for walk in (here, there))
        turn, image_turn = (walk.yaw_rad[:, 1, 0, -1] for walk in (here, there))
        # The contact solve visits legs in their order, so that images agree to a few per cent.
        moved = np.median(np.linalg.norm(way, axis=-1))
        assert moved > 0.005
        assert np.median(np.linalg.norm(image_way * (x, y) - way, axis=-1)) < 0.1 * moved
        assert np.median(np.abs(turn)) > 0.02
        assert np.median(np.abs(image_turn + turn)) < 0.1 * np.median(np.abs(turn))


def test_a_command_of_another_length_and_a_sense_that_the_body_lacks_are_refused(twin, walkers):
    with pytest.raises(ValueError, match='commands'):
        twin.record(walkers, [[[1.0, 0.0]]], [1.0])
    with pytest.raises(ValueError, match='seconds'):
        twin.record(walkers, [[STOP]], [0.01])
    with pytest.raises(ValueError, match='network'):
        twin.record(networks(twin.body, SENSES['physical_twin'][:3], 2), [[STOP]], [1.0])
    for sense in ('touch:tail', 'smell', 'gravity:w', 'position:tail'):
        with pytest.raises(UnsupportedBodyError, match=sense):
            LeakyEngine(bodies.get('physical_twin'), EARTH, hidden=14, senses=(sense,))


def test_a_state_is_not_changed_by_a_step(walkers):
    network = one(walkers, 0)
    before = network.initial_state()
    step(network, LeakyState(*before), network.drive(FORWARD), np.zeros(9))
    np.testing.assert_array_equal(before.hidden, network.rest)
