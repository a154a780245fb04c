"""Outcomes with every figure, and words that change: serial networks in the batched engine."""

from dataclasses import fields, replace

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.hearing.heard import Heard
from w2b_core.mind import SerialMind
from w2b_core.network import Network
from w2b_core.outcome import Outcome
from w2b_core.senses import Readings
from w2b_sim.engines import registry
from w2b_sim.engines.batched import BatchedEngine, Variations, complete
from w2b_sim.engines.interface import Start
from w2b_sim.rollout import targets_rad
from w2b_sim.worlds import WORLDS

PLAIN = ('final_position_m', 'path_length_m', 'largest_step_m', 'touch_fraction',
         'halfway_position_m', 'farthest_m')
ALL = tuple(field.name for field in fields(Outcome))
STARTS = (Start(), Start(0.001, 0.01, -0.005, 0.3))
SPHERE = bodies.get('spherical_2dof_sensors')
every_body = pytest.mark.parametrize('name', bodies.names())


def networks(body, count=3, strength=1.0, seed=7):
    rng = np.random.default_rng(seed)
    sensors, joints = len(body.sensors), len(body.joints)
    return Network(rng.normal(size=(count, 5, 6 + sensors)),
                   strength * rng.normal(size=(count, joints, 5)),
                   np.array([joint.time_constant for joint in body.joints]))


def words(count=2, seed=5):
    return np.random.default_rng(seed).normal(scale=0.17, size=(count, 300))


def world_of(body, steps):
    return replace(WORLDS[body.world], steps=steps)


def same(first: Outcome, second: Outcome, names=ALL):
    for name in names:
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=name)


@every_body
def test_the_plain_figures_keep_their_bits(name):
    """On every body, with deviations: completing an outcome changes no figure of today's."""
    body = bodies.get(name)
    world, batch = world_of(body, 41), networks(body)
    deviations = Variations(gravity_m_s2=[WORLDS[body.world].gravity_m_s2, -1.2], seed=[1, 2])
    plain, full = (BatchedEngine(body, world, 'single', complete=asked).evaluate(
        batch, words(), STARTS, deviations) for asked in (False, True))
    same(plain, full, PLAIN)
    assert plain.yaw_rad is None
    for figure in ALL:
        assert np.isfinite(getattr(full, figure)).all(), figure
    assert full.reversals.shape == (3, 2, 2, len(body.joints))
    np.testing.assert_allclose(full.start_height_m[:, :, 1] - full.start_height_m[:, :, 0], 0.001,
                               atol=1e-6)


def in_every_engine(body, start):
    """The same gentle networks under two words for 1.5 s: engine -> outcome."""
    world, batch = world_of(body, 31), networks(body, 4, strength=0.12)
    return {engine: registry.make_evaluator(engine, body, world, complete=True).evaluate(
        batch, words(), [start]) for engine in registry.names()}


@every_body
def test_in_the_air_every_figure_is_the_one_of_the_step_wise_engines(name):
    """
    Without contact all engines solve the same mechanics.

    In `paper` MuJoCo divides the step of 50 ms, and averages the torque of a jerk over it.
    """
    body = bodies.get(name)
    rtol = 0.05 if body.world == 'earth' else 0.2
    found = in_every_engine(body, Start(height_m=30.0))
    for engine in registry.stepwise_names():
        for figure in ALL:
            # PyBullet tells the torque of the last of four solver steps in `paper`.
            if figure != 'effort_nm' or engine == 'mujoco' or body.world == 'earth':
                ours, other = (getattr(found[which], figure) for which in ('batched', engine))
                tolerance = (rtol, 0.0) if figure == 'effort_nm' else (0.05, 2e-3)
                np.testing.assert_allclose(ours, other, *tolerance, err_msg=f'{engine}: {figure}')
    assert found['batched'].effort_nm.min() > 1e-5
    if not name.startswith('spherical'):
        assert np.ptp(found['batched'].reversals) >= 1


@every_body
def test_on_the_floor_every_figure_is_the_one_of_the_step_wise_engines(name):
    """
    In the middle of the evaluations: contact is chaotic.

    In `paper` friction is viscous here and Coulomb's there, where feet that stick strain the legs,
    so that effort is compared in `earth`. A sphere that rolled over has no yaw, and tilts as it
    rolls.
    """
    body = bodies.get(name)
    found = in_every_engine(body, Start())
    length = body.length_m
    atol = {'final_position_m': 0.1 * length, 'path_length_m': 0.15 * length,
            'largest_step_m': 0.02 * length, 'touch_fraction': 0.35,
            'halfway_position_m': 0.1 * length, 'farthest_m': 0.1 * length, 'yaw_rad': 0.06,
            'lowest_height_m': 0.06 * length, 'lowest_up': 0.02, 'reversals': 1.0,
            'at_speed_limit': 0.05, 'start_height_m': 1e-6, 'effort_nm': 0.05}
    if body.world == 'paper':
        del atol['effort_nm']
    if name.startswith('spherical'):
        del atol['yaw_rad']
        atol['lowest_up'] = atol['final_position_m'] / (length / 2)
    for figure, bound in atol.items():
        ours, *others = (getattr(found[engine], figure) for engine in registry.names())
        if ours.size:
            apart = np.minimum(*(np.abs(ours - other) for other in others))
            scale = np.median(ours) if figure == 'effort_nm' else 1.0
            assert np.median(apart) < bound * scale, figure
    assert found['batched'].path_length_m.max() > 1e-3, 'robots that stand prove nothing'


def test_a_large_batch_is_recorded_in_pieces_of_the_same_bits(monkeypatch):
    engine = BatchedEngine(SPHERE, world_of(SPHERE, 41), 'single', complete=True)
    deviations = Variations(motor_noise_rad_s=0.3, seed=np.arange(5)[:, None, None])
    whole = engine.evaluate(networks(SPHERE, 5), words(), STARTS, deviations)
    monkeypatch.setattr(complete, 'LARGEST_LOG', 1)
    same(engine.evaluate(networks(SPHERE, 5), words(), STARTS, deviations), whole)
    assert np.ptp(whole.yaw_rad) > 0


def test_what_fails_has_no_figures_and_fails_alone():
    engine = BatchedEngine(SPHERE, world_of(SPHERE, 41), 'single', complete=True)
    batch = networks(SPHERE)
    sound = engine.evaluate(batch, words(), STARTS)
    hidden = batch.hidden_weights.copy()
    hidden[1, 2, 3] = np.nan
    broken = engine.evaluate(replace(batch, hidden_weights=hidden), words(), STARTS)
    for figure in ALL:
        assert np.isnan(getattr(broken, figure)[1]).all(), figure
    same(broken.apply(lambda values: values[[0, 2]]), sound.apply(lambda values: values[[0, 2]]))


@pytest.fixture(scope='module')
def minimal():
    body = bodies.get('minimal')
    return BatchedEngine(body, WORLDS[body.world], 'double')


def test_words_that_change_are_heard_as_the_robot_hears_them(minimal):
    """Fed with what the engine recorded, the numpy mind asks for the same angles, to 1e-6."""
    body, batch = minimal.body, networks(minimal.body)
    said = np.stack([words(3), words(3, seed=9)])
    walk = minimal.record(batch, said, STARTS[:1], seconds=[1.5, 1.5, 2.0])
    assert walk.frames == 101
    names = [joint.name for joint in body.joints]
    touching = [sense.partition(':')[2] for sense in body.sensors if sense.startswith('touch:')]
    for c in range(3):
        mind = SerialMind(Network(batch.hidden_weights[c], batch.motor_weights[c],
                                  batch.motor_time_constants), body.sensors, tuple(names))
        for w in range(2):
            one = walk.take((c, w, 0))
            for t in range(one.frames):
                if t in (0, 30, 60):
                    mind.hear(Heard(signal=said[w, t // 30]))
                np.testing.assert_allclose(one.target_rad[t], targets_rad(body, mind.motors),
                                           rtol=0, atol=1e-6)
                mind.feel(Readings(dict(zip(touching, one.touching[t], strict=True)),
                                   dict(zip(names, one.joint_position_rad[t], strict=True)), {}))
            assert np.ptp(one.target_rad) > 0.2


def test_a_later_word_changes_nothing_before_it_and_the_first_alone_is_an_evaluation(minimal):
    said = words(2)
    batch, seconds = networks(minimal.body), [1.0, 1.0]
    both = minimal.record(batch, np.stack([said, said[[0, 0]]]), STARTS, seconds=seconds)
    first, second = both.take(np.s_[:, 0]), both.take(np.s_[:, 1])
    np.testing.assert_array_equal(first.target_rad[..., :21, :], second.target_rad[..., :21, :])
    assert not np.array_equal(first.target_rad[..., 22:, :], second.target_rad[..., 22:, :])
    short = BatchedEngine(minimal.body, world_of(minimal.body, 21), 'double')
    ends = short.evaluate(batch, said[:1], STARTS).final_position_m
    np.testing.assert_array_equal(ends[:, 0], first.position_m[..., 20, :])


def test_another_number_of_words_than_of_phases_is_refused(minimal):
    with pytest.raises(ValueError, match=r'signals: expected 2 words a sequence'):
        minimal.record(networks(minimal.body), words(3)[None], STARTS, seconds=[1.0, 1.0])
    with pytest.raises(ValueError, match=r'signals: expected \(W, P, T\)'):
        minimal.record(networks(minimal.body), words(3)[0], STARTS, seconds=[1.0])
    with pytest.raises(ValueError, match='seconds: expected phases'):
        minimal.record(networks(minimal.body), words(1)[None], STARTS, seconds=[0.0])
