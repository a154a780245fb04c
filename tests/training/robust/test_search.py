"""Drawn worlds: their objective, situations, pretraining, and a run that is killed."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from training.evolution.operators import Layout, random_genomes
from training.evolution.optimisers import OPTIMISERS
from training.evolution.population import born
from training.robust import touch
from training.robust.config import RobustConfig
from training.robust.drawn import DrawnWorlds
from training.robust.hidden_life import LATE, SETTLED, STEPS, live, live_exactly
from training.robust.objective import WORST_STOP, fitness, values
from training.robust.pretraining import listen, newcomers, score
from training.robust.scenarios import BACKWARD, FORWARD, STOP, draw
from training.robust.search import train
from training.robust.settings import Pretraining, Randomisation, Stage, Touch
from w2b_core.network import Network, prime, step
from w2b_sim.engines.interface import Evaluation
from w2b_sim.worlds import EARTH, PAPER

VECTORS = {word: np.random.default_rng(index).normal(size=30) * 0.2
           for index, word in enumerate(('forward', 'backward', 'stop', 'cease', 'quit'))}
HEARD = {FORWARD: np.array([VECTORS['forward']]), BACKWARD: np.array([VECTORS['backward']]),
         STOP: np.array([VECTORS[word] for word in ('stop', 'cease', 'quit')])}
WAYS = np.array([1, 1, 1, -1, -1, -1, 0, 0, 0])


def seen(end, half, far=0.0, path=0.0, step_m=0.01):
    """One controller in nine situations."""
    def row(value):
        return np.broadcast_to(np.asarray(value, dtype=float), (1, 9))[..., None]
    zero = row(0.0)
    return Evaluation(np.stack([row(end), zero, zero], -1), row(path), row(step_m),
                      np.zeros((1, 9, 1, 0)), np.stack([row(half), zero], -1), row(far))


def test_a_gait_earns_and_a_lunge_does_not():
    gait = values(seen(0.6 * WAYS, 0.3 * WAYS), WAYS, 1.0)[0]
    assert gait[:6] == pytest.approx(0.6)
    lunge = values(seen(0.6 * WAYS, 0.6 * WAYS), WAYS, 1.0)[0]
    assert lunge[:6] == pytest.approx(0.0)
    late = values(seen(0.1 * WAYS, -0.4 * WAYS), WAYS, 1.0)[0]
    assert late[:6] == pytest.approx(0.15), 'no more than the whole way and LUNGE_M'
    assert values(seen(3.0 * WAYS, 1.0 * WAYS), WAYS, 0.7)[0][:6] == pytest.approx(0.7)
    assert values(seen(0.3 * WAYS, 0.15 * WAYS), WAYS, 1.0, 0.5)[0][:6] == pytest.approx(0.6)


def test_stops_pay_for_straying_and_explosions_are_nothing():
    stop = values(seen(0.0, 0.0, far=0.05, path=0.0), WAYS, 1.0)[0][6:]
    assert stop == pytest.approx(0.0)
    assert values(seen(0.0, 0.0, far=0.25, path=1.0), WAYS, 1.0)[0][6:] == pytest.approx(-0.32)
    for bad in (seen(5.0, 0.0, step_m=0.2), seen(np.nan, 0.0), seen(0.0, 0.0, far=np.inf)):
        earned = values(bad, WAYS, 1.0)[0]
        assert earned[:6] == pytest.approx(0.0)
        assert earned[6:] == pytest.approx(WORST_STOP)


@given(arrays(float, 9, elements=st.floats(-50, 50)), arrays(float, 9, elements=st.floats(-50, 50)),
       st.floats(0, 50), st.floats(0.1, 2.0))
def test_the_robust_fitness_is_bounded(end, half, far, clip):
    earned = values(seen(end, half, far=far, path=far), WAYS, clip)
    assert (np.abs(earned[:, :6]) <= clip).all()
    assert ((earned[:, 6:] >= WORST_STOP) & (earned[:, 6:] <= 0)).all()
    assert -2 * clip + WORST_STOP - 1e-9 <= fitness(earned, WAYS)[0] <= 2 * clip


def test_fitness_is_half_mean_half_worst_third():
    earned = np.array([[0.0, 0.3, 0.6, 0.5, 0.5, 0.5, 0.0, 0.0, -0.3]])
    assert fitness(earned, WAYS)[0] == pytest.approx(
        (0.15 + 0.0) + 0.5 + (-0.05 - 0.15))


def test_the_other_aggregates():
    earned = np.array([[0.0, 0.3, 0.6, 0.2, 0.2, 0.2, 0.0, 0.0, -0.3]])
    assert fitness(earned, WAYS, 'mean')[0] == pytest.approx(0.3 + 0.2 - 0.1)
    assert fitness(earned, WAYS, 'worst_word')[0] == pytest.approx(3 * (-0.05 - 0.15))
    with pytest.raises(ValueError, match=r"aggregate: expected one of .*, got 'luck'"):
        fitness(earned, WAYS, 'luck')


def test_an_engine_that_does_not_tell_is_refused():
    plain = replace(seen(0.0, 0.0), halfway_position_m=None)
    with pytest.raises(ValueError, match='needs the halfway and farthest positions'):
        values(plain, WAYS, 1.0)


@pytest.mark.parametrize('world', [PAPER, EARTH])
def test_scenarios_draw_what_was_asked_for(world):
    rng = np.random.default_rng(0)
    scenario = draw(rng, HEARD, world, Randomisation(), moves=4, stops=6)
    assert scenario.directions.tolist() == [1] * 4 + [-1] * 4 + [0] * 6
    assert scenario.signals.shape == (14, 30)
    assert {len(column) for column in scenario.variations.values()} == {14}
    assert (scenario.variations['gravity_m_s2'] < 0).all()
    part = scenario.take(np.array([0, 13]))
    assert part.directions.tolist() == [1, 0]
    assert part.variations['erp'].tolist() == scenario.variations['erp'][[0, 13]].tolist()


def test_leaving_a_means_out_changes_no_other():
    every = draw(np.random.default_rng(3), HEARD, PAPER, Randomisation(vectors=False), moves=3,
                 stops=3)
    for field in fields(Randomisation):
        if field.name == 'vectors':
            continue
        without = draw(np.random.default_rng(3), HEARD, PAPER,
                       Randomisation(**{'vectors': False, field.name: False}), moves=3, stops=3)
        assert set(without.variations) < set(every.variations)
        for name, column in without.variations.items():
            assert column.tobytes() == every.variations[name].tobytes()
    nothing = draw(np.random.default_rng(3), HEARD, PAPER, Randomisation.only(), moves=3, stops=3)
    assert set(nothing.variations) == {'seed'}
    with pytest.raises(ValueError, match=r"means: expected some of .*, got 'luck'"):
        Randomisation.only('luck')


def test_mixtures_are_between_stop_words():
    scenario = draw(np.random.default_rng(1), HEARD, PAPER, Randomisation(), moves=1, stops=40)
    known = HEARD[STOP]
    mixed = [signal for signal in scenario.signals[2:]
             if np.abs(known - signal).max(axis=1).min() > 0.3]
    assert mixed, 'none was mixed'
    norms = np.linalg.norm(mixed, axis=1) / np.linalg.norm(known, axis=1).mean()
    assert (np.abs(norms - 1) < 0.5).all()


def test_hidden_life_is_the_network_with_silent_sensors():
    rng = np.random.default_rng(2)
    weights = 0.6 * rng.normal(size=(6, 5, 6))
    signals = 0.2 * rng.normal(size=(3, 40))
    network = Network(weights[:, None], np.zeros((6, 1, 1, 5)), np.ones(1))
    state = prime(network, signals)
    course = []
    for _ in range(STEPS):
        state = step(network, state, np.zeros(0))
        course.append(state.hidden)
    late = np.array(course)[LATE:]
    life = live(weights, signals)
    error = np.abs(life.late_swing - late.std(axis=0)).max(axis=-1)
    # Chaotic networks leave any approximation; the others must not.
    assert np.quantile(error, 0.7) < 0.01
    exact = live_exactly(weights, signals)
    whole = np.array(course)
    assert exact.mean == pytest.approx(whole[SETTLED:].mean(axis=0), abs=1e-12)
    assert exact.swing == pytest.approx(whole[SETTLED:].std(axis=0), abs=1e-9)
    assert exact.late_swing == pytest.approx(late.std(axis=0), abs=1e-9)


def test_hidden_life_feels_constant_inputs_as_a_network_feels_its_feet():
    rng = np.random.default_rng(5)
    weights, signals = 0.5 * rng.normal(size=(1, 4, 5)), 0.2 * rng.normal(size=(3, 40))
    bias = 0.1 * rng.normal(size=(3, 4))
    life, silent = live(weights, signals, bias), live(weights, signals)
    for index in range(3):
        network = Network(np.concatenate([weights[0], bias[index][:, None]], axis=1),
                          np.zeros((1, 4)), np.ones(1))
        state = prime(network, signals[index])
        course = []
        for _ in range(STEPS):
            state = step(network, state, np.ones(1))
            course.append(state.hidden)
        settled = np.array(course)[SETTLED:]
        assert life.mean[0, index] == pytest.approx(settled.mean(axis=0), abs=0.01)
    assert np.abs(life.mean - silent.mean).max() > 0.05


def test_listening_tells_words_apart_better_than_chance():
    def scenario(rng, moves, stops):
        return draw(rng, HEARD, PAPER, Randomisation(), moves=moves, stops=stops)

    layout = Layout(5, 4, (0.3,) * 8)
    test = scenario(np.random.default_rng(9), 8, 12)
    listeners = listen(layout, Pretraining(2, 60), 1, scenario, keep=6)
    assert listeners.shape[1:] == (5, 6)
    chance = score(np.random.default_rng(0).normal(size=(60, 5, 6)), test)
    assert score(listeners, test).max() > np.quantile(chance, 0.9)
    assert (score(listeners, test) <= 4).all()
    again = listen(layout, Pretraining(2, 60), 1, scenario, keep=6)
    assert again.tobytes() == listeners.tobytes()
    born = newcomers(listeners)(np.random.default_rng(0), 7, layout)
    hidden = layout.network(born).hidden_weights
    for weights in hidden[:, :, :6]:
        assert any((weights == listener).all() for listener in listeners)
    plain = random_genomes(np.random.default_rng(0), 7, layout)
    assert (born[:, layout.hidden_size:] == plain[:, layout.hidden_size:]).all()


SMALL = RobustConfig(
    body='quadruped', seed=2, words=tuple((word, {'forward': 'forward', 'backward': 'backward'}.get(
        word, 'stop')) for word in VECTORS), population=6, pretraining=Pretraining(1, 5),
    stages=(Stage(3, 2, 2, 0, False, 0.5, vectors=False, length=0.1),
            Stage(4, 2, 2, 2, True, 0.5, length=0.1)))


class Killed(BaseException):
    """Stands for a kill."""


@pytest.mark.parametrize('optimiser', OPTIMISERS.names())
def test_a_killed_robust_run_ends_in_the_same_population(tmp_path, optimiser):
    config = replace(SMALL, optimiser=optimiser)
    whole, fitness_whole = train(config, tmp_path / 'whole', vectors=VECTORS)

    def kill(progress):
        if progress.generation in (2, 4, 5):
            raise Killed

    for _ in range(3):
        with pytest.raises(Killed):
            train(config, tmp_path / 'broken', kill, vectors=VECTORS, checkpoint_s=1e-9)
    resumed, fitness_resumed = train(config, tmp_path / 'broken', vectors=VECTORS)
    assert resumed.hidden_weights.tobytes() == whole.hidden_weights.tobytes()
    assert resumed.motor_weights.tobytes() == whole.motor_weights.tobytes()
    assert fitness_resumed.tolist() == fitness_whole.tolist()
    assert sorted(fitness_whole, reverse=True) == fitness_whole.tolist()


def test_without_touch_the_sensors_are_silent():
    task = DrawnWorlds(SMALL, HEARD)
    genomes = random_genomes(np.random.default_rng(0), 6, task.layout)
    assert task.gain == 0.0
    deaf = task.layout.network(touch.felt(genomes, task.layout, task.gain))
    assert not deaf.hidden_weights[..., 6:].any()
    task.gain = 1.0
    assert touch.felt(genomes, task.layout, task.gain) is genomes


def test_touch_grows_over_a_stage_that_follows_one_without():
    walk, feel = (replace(SMALL.stages[0], generations=20, touch=False, redraw=10),
                  replace(SMALL.stages[0], generations=100, touch=True, redraw=10))
    config = replace(SMALL, stages=(walk, feel))
    gains = [config.touch_gain(generation) for generation in range(120)]
    assert gains[:20] == [0.0] * 20
    assert gains[20] == gains[29] == pytest.approx(1 / 7)
    assert gains[30] == pytest.approx(2 / 7)
    assert (np.diff(gains) >= 0).all()
    assert gains[80:] == [1.0] * 40


def test_feeling_begins_with_small_synapses_of_the_best():
    layout = DrawnWorlds(SMALL, HEARD).layout
    population = born(random_genomes(np.random.default_rng(1), 6, layout),
                      np.zeros(6, dtype=np.int64), 0)
    population = replace(population, fitness=np.arange(len(population), dtype=float))
    whole, half = (layout.network(each).hidden_weights for each in
                   (population.genomes, touch.felt(population.genomes, layout, 0.5)))
    assert half[..., 6:] == pytest.approx(whole[..., 6:] / 2)
    assert half[..., :6].tobytes() == whole[..., :6].tobytes()
    feeling = touch.begin_to_feel(population, layout, np.random.default_rng(0), Touch())
    begun = touch.synapses(feeling.genomes, layout)
    assert (begun != 0).all()
    assert len(np.unique(begun)) == begun.size
    assert np.abs(begun).max() < 0.5
    worst, best = population.genomes[0], population.genomes[-1]
    assert feeling.genomes[0][-20:].tobytes() == best[-20:].tobytes()
    assert not (feeling.genomes[:, -20:] == worst[-20:]).all(axis=1).any()


def test_every_behaviour_needs_a_word():
    with pytest.raises(ValueError, match=r"words: .* got none for 'backward'"):
        replace(SMALL, words=(('forward', 'forward'), ('stop', 'stop')))
