"""AFPO against its definition: dominance, tournaments, ages, numbers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from training.evolution.afpo import Afpo, dominance, survivors
from training.evolution.operators import Layout

LAYOUT = Layout(2, 1, (1.0,))


def tournaments(rng, ages, fitness, numbers, capacity):
    """The original's loop, word for word: draw two, delete the second if the first dominates it."""
    alive = list(range(len(ages)))

    def beats(i, j):
        if i == j or ages[i] > ages[j] or fitness[i] < fitness[j]:
            return False
        return ages[i] < ages[j] or fitness[i] > fitness[j] or numbers[i] < numbers[j]

    front = sum(not any(beats(i, j) for i in alive) for j in alive)
    while len(alive) > max(capacity, front):
        first, second = rng.choice(alive, 2)
        if beats(first, second):
            alive.remove(second)
    return alive


individuals = st.lists(st.tuples(st.integers(0, 5), st.integers(-3, 3)), min_size=2, max_size=30)


@given(individuals)
def test_dominance_is_a_strict_partial_order(drawn):
    ages, fitness = np.array(drawn).T
    numbers = np.arange(len(ages))
    dominates = dominance(ages, fitness, numbers)
    assert not dominates.diagonal().any()
    assert not (dominates & dominates.T).any()
    # Transitive: whoever is reached in two steps is reached in one.
    reached = (dominates.astype(int) @ dominates.astype(int)) > 0
    assert not (reached & ~dominates).any()


def test_dominance_of_one_pair_at_a_time():
    ages, fitness, numbers = [3, 3, 2, 3, 4], [1.0, 1.0, 1.0, 2.0, 3.0], [7, 8, 9, 10, 11]
    dominates = dominance(ages, fitness, numbers)
    pairs = {(int(i), int(j)) for i, j in zip(*dominates.nonzero(), strict=True)}
    # Equals: the smaller number. Younger at equal fitness. Fitter at equal age. The fitter but
    # older one dominates nobody.
    assert pairs == {(0, 1), (2, 0), (2, 1), (3, 0), (3, 1)}


@given(individuals, st.integers(1, 20), st.integers(0, 2**32 - 1))
def test_survivors_keep_the_front_and_reach_the_capacity(drawn, capacity, seed):
    ages, fitness = np.array(drawn).T
    dominates = dominance(ages, fitness, np.arange(len(ages)))
    kept = survivors(np.random.default_rng(seed), dominates, capacity)
    front = np.flatnonzero(~dominates.any(axis=0))
    assert len(kept) == min(len(ages), max(capacity, len(front)))
    assert set(front) <= set(kept)
    assert list(kept) == sorted(set(kept))


def test_survivors_have_the_distribution_of_the_original_tournaments():
    ages = np.array([0, 1, 1, 2, 2, 3, 3, 4])
    fitness = np.array([0.0, 2.0, 1.0, 2.0, 1.0, 3.0, 3.0, 0.5])
    numbers = np.arange(8)
    rng = np.random.default_rng(5)
    dominates = dominance(ages, fitness, numbers)
    count = 4000
    ours, theirs = np.zeros(8), np.zeros(8)
    for _ in range(count):
        ours[survivors(rng, dominates, 5)] += 1
        theirs[tournaments(rng, ages, fitness, numbers, 5)] += 1
    # Each is a mean of Bernoulli draws: four standard errors of their difference.
    assert np.abs(ours - theirs).max() / count < 4 * np.sqrt(0.5 / count)
    assert ((theirs > 0.05 * count) & (theirs < 0.95 * count)).sum() >= 4, 'the case decides little'


def evolve(seed, generations, capacity=10):
    afpo = Afpo(LAYOUT, np.random.default_rng(seed), capacity=capacity)
    asked = []
    for _ in range(generations):
        genomes = afpo.ask()
        asked.append(genomes)
        afpo.tell(-np.abs(genomes - 0.7).sum(axis=1))
    return afpo, asked


def test_one_generation_ages_and_numbers():
    afpo = Afpo(LAYOUT, np.random.default_rng(0), capacity=10)
    assert len(afpo.ask()) == 20, 'the first generation evaluates the first population as well'
    population = afpo.population
    assert population.ages[:10].tolist() == [1] * 10
    assert population.ages[10] == 0, 'the newcomer'
    assert population.ages[11:].tolist() == [1] * 9, "copies keep their parents' age"
    assert population.numbers.tolist() == list(range(20))
    assert population.parents[:11].tolist() == [-1] * 11
    for child, parent in zip(population.genomes[11:], population.parents[11:], strict=True):
        assert (child != population.genomes[parent]).sum() == 1, 'one synapse differs'
    afpo.tell(np.arange(20.0))
    assert len(afpo.ask()) == 20 - len(afpo.population.fitness[~np.isnan(afpo.population.fitness)])


def test_the_best_is_never_lost_and_fitness_rises():
    afpo = Afpo(LAYOUT, np.random.default_rng(3), capacity=10)
    best = []
    for _ in range(200):
        genomes = afpo.ask()
        afpo.tell(-np.abs(genomes - 0.7).sum(axis=1))
        best.append(afpo.population.fitness[afpo.population.best])
    assert best == sorted(best)
    assert best[-1] > 0.3 * best[0]


def test_the_best_of_equals_is_the_oldest_number():
    afpo = Afpo(LAYOUT, np.random.default_rng(0), capacity=4)
    afpo.ask()
    afpo.tell(np.zeros(8))
    assert afpo.population.numbers[afpo.population.best] == afpo.population.numbers.min()


def test_same_seed_same_course_and_another_seed_another():
    (first, _), (again, _), (other, _) = evolve(1, 30), evolve(1, 30), evolve(2, 30)
    assert first.population.genomes.tobytes() == again.population.genomes.tobytes()
    assert first.population.genomes.tobytes() != other.population.genomes.tobytes()


def test_restored_state_goes_on_bit_for_bit():
    whole, _ = evolve(4, 40)
    half, _ = evolve(4, 20)
    rng = np.random.default_rng(999)
    rng.bit_generator.state = half.rng.bit_generator.state
    taken_up = Afpo(LAYOUT, np.random.default_rng(0), capacity=10)
    taken_up.restore(half.arrays())
    taken_up.rng = rng
    for _ in range(20):
        taken_up.tell(-np.abs(taken_up.ask() - 0.7).sum(axis=1))
    for name, array in whole.arrays().items():
        assert array.tobytes() == taken_up.arrays()[name].tobytes(), name


def test_a_front_larger_than_the_capacity_stays_whole():
    afpo = Afpo(LAYOUT, np.random.default_rng(0), capacity=3)
    afpo.ask()
    # The older, the fitter: nobody dominates anybody.
    afpo.population = replace(afpo.population, ages=np.arange(6))
    afpo.tell(np.arange(6.0))
    assert len(afpo.population) == 6


@pytest.mark.parametrize('fitness', [np.zeros(3), np.full(20, np.nan)])
def test_told_fitness_must_fit(fitness):
    afpo = Afpo(LAYOUT, np.random.default_rng(0), capacity=10)
    afpo.ask()
    with pytest.raises(ValueError, match='fitness: expected'):
        afpo.tell(fitness)
