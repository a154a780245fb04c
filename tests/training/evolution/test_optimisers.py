"""Optimisers behind one registry: each searches, resumes to the same, and knows its layout."""

from dataclasses import replace

import numpy as np
import pytest

from tests.training.landscape import VECTORS, Landscape
from training.evolution.checkpoint import CheckpointError
from training.evolution.config import RunConfig
from training.evolution.operators import Layout, random_genomes
from training.evolution.optimisers import OPTIMISERS, PAPER, Kind, make_optimiser
from training.evolution.run import RunConflictError, run

LAYOUT = Layout(2, 1, (1.0,))
WORDS = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
CONFIG = RunConfig(body='minimal', seed=3, words=WORDS, generations=12, population=8,
                   optimiser='cma')
NAMES = OPTIMISERS.names()


class Killed(BaseException):
    """Stands for a kill: nothing may catch it."""


def sphere(genomes):
    return -((genomes - 0.3)**2).sum(axis=1)


def made(name, seed=0, capacity=10):
    return make_optimiser(name, LAYOUT, np.random.default_rng(seed), capacity=capacity)


def search(optimiser, generations):
    for _ in range(generations):
        optimiser.tell(sphere(optimiser.ask()))
    return optimiser.population


@pytest.mark.parametrize('name', NAMES)
def test_it_keeps_the_best_and_the_best_gets_better(name):
    optimiser, best = made(name), -np.inf
    for generation in range(1, 61):
        genomes = optimiser.ask()
        assert genomes.shape[1] == LAYOUT.size
        optimiser.tell(sphere(genomes))
        assert optimiser.generation == generation
        population = optimiser.population
        now = population.fitness[population.best]
        assert now >= best, 'what was found is not lost'
        assert now == sphere(population.genomes[population.best][None])[0]
        best = now
    alone = sphere(random_genomes(np.random.default_rng(0), 620, LAYOUT)).max()
    assert best > alone, 'better than as many random draws'


@pytest.mark.parametrize('name', NAMES)
def test_the_same_generator_gives_the_same_search(name):
    first, again, other = search(made(name), 9), search(made(name), 9), search(made(name, 1), 9)
    assert first.genomes.tobytes() == again.genomes.tobytes()
    assert first.genomes.tobytes() != other.genomes.tobytes()
    assert len(set(first.numbers.tolist())) == len(first)


@pytest.mark.parametrize('name', NAMES)
def test_a_state_is_taken_up_where_it_was(name):
    whole = search(made(name), 14)
    rng = np.random.default_rng(0)
    stopped = make_optimiser(name, LAYOUT, rng, capacity=10)
    search(stopped, 6)
    kept, state = stopped.arrays(), rng.bit_generator.state
    rng = np.random.default_rng(0)
    resumed = make_optimiser(name, LAYOUT, rng, capacity=10)
    resumed.restore(kept)
    rng.bit_generator.state = state
    assert search(resumed, 8).genomes.tobytes() == whole.genomes.tobytes()
    other = make_optimiser(name, Layout(3, 1, (1.0,)), rng, capacity=10)
    with pytest.raises(ValueError, match=r'genomes: expected \(N, 18\)'):
        other.restore(kept)


@pytest.mark.parametrize('name', NAMES)
def test_what_is_told_must_fit_what_was_asked_for(name):
    optimiser = made(name)
    genomes = optimiser.ask()
    for wrong in (np.zeros(len(genomes) - 1), np.full(len(genomes), np.nan)):
        with pytest.raises(ValueError, match='fitness: expected'):
            optimiser.tell(wrong)
    with pytest.raises(ValueError, match='capacity: expected at least 2, got 1'):
        made(name, capacity=1)


def test_cma_es_adapts_where_mutation_of_one_weight_does_not():
    assert search(made('cma'), 150).fitness.max() > -1e-6


def go(config, directory, **options):
    return run(config, directory, vectors=VECTORS, evaluator=Landscape(), **options)


def test_a_killed_run_of_cma_es_ends_in_the_same_champion(tmp_path):
    whole = go(CONFIG, tmp_path / 'whole')
    for stop in (3, 8):
        def kill(seen, stop=stop):
            if seen.generation == stop:
                raise Killed
        with pytest.raises(Killed):
            go(CONFIG, tmp_path / 'broken', progress=kill, checkpoint_generations=1)
    go(CONFIG, tmp_path / 'broken')
    champions = [(tmp_path / name / 'champion.json').read_bytes() for name in ('whole', 'broken')]
    assert champions[0] == champions[1]
    assert whole.evaluations == 12 * 8 * 3
    assert whole.history['survivors'].tolist() == [8, *[9] * 11], 'a generation, and the best'


def test_another_optimiser_is_another_run(tmp_path):
    go(CONFIG, tmp_path)
    with pytest.raises(RunConflictError, match="optimiser: it has 'cma', asked None"):
        go(replace(CONFIG, optimiser=PAPER), tmp_path)
    assert 'optimiser' not in replace(CONFIG, optimiser=PAPER).to_json(), 'as in earlier runs'
    assert RunConfig.from_json(CONFIG.to_json()) == CONFIG


def test_a_checkpoint_of_another_optimiser_is_refused(tmp_path):
    go(replace(CONFIG, optimiser=PAPER), tmp_path / 'paper')
    with pytest.raises(Killed):
        go(CONFIG, tmp_path / 'mine', checkpoint_generations=1,
           progress=lambda _seen: (_ for _ in ()).throw(Killed))
    (tmp_path / 'mine' / 'checkpoint.npz').write_bytes(
        (tmp_path / 'paper' / 'checkpoint.npz').read_bytes())
    with pytest.raises(CheckpointError, match='does not belong to this run'):
        go(CONFIG, tmp_path / 'mine')


def test_what_is_no_optimiser_is_refused_before_anything_is_written(monkeypatch, tmp_path):
    monkeypatch.setattr(OPTIMISERS, '_entries', {**OPTIMISERS._entries, 'broken': Kind(
        'nothing', lambda layout, rng, **options: object())})
    with pytest.raises(ValueError, match=r"optimiser 'broken': expected an object with .* got one "
                                         'without generation, population, ask'):
        go(replace(CONFIG, optimiser='broken'), tmp_path / 'run')
    assert not (tmp_path / 'run').exists()
    with pytest.raises(ValueError, match=r"optimiser: expected one of afpo, cma, .*got 'luck'"):
        replace(CONFIG, optimiser='luck')
