"""Genomes and the operators that make them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from training.evolution.operators import Layout, mutate, mutate_mixed, random_genomes
from w2b_core import bodies

LAYOUT = Layout(5, 4, (0.3,) * 4 + (1.0,) * 4)


@pytest.mark.parametrize('name', bodies.names())
def test_layout_fits_every_body(name):
    body = bodies.get(name)
    layout = Layout.of(body)
    genomes = random_genomes(np.random.default_rng(0), 3, layout)
    network = layout.network(genomes)
    assert network.hidden_weights.shape == (3, body.hidden_neurons,
                                            body.hidden_neurons + 1 + len(body.sensors))
    assert network.motor_weights.shape == (3, len(body.joints), body.hidden_neurons)
    assert layout.genome(network).tobytes() == genomes.tobytes()


def test_weights_are_standard_normal():
    genomes = random_genomes(np.random.default_rng(0), 2000, LAYOUT)
    assert abs(genomes.mean()) < 0.01
    assert abs(genomes.std() - 1) < 0.01


@given(st.integers(0, 2**32 - 1))
def test_mutation_changes_exactly_one_synapse_of_each(seed):
    rng = np.random.default_rng(seed)
    genomes = random_genomes(rng, 20, LAYOUT)
    before = genomes.copy()
    assert ((mutate(rng, genomes, LAYOUT) != genomes).sum(axis=1) == 1).all()
    assert (genomes == before).all(), 'parents stay as they were'


def test_mutation_has_the_documented_distribution():
    rng = np.random.default_rng(0)
    genomes = np.tile(np.linspace(-2, 2, LAYOUT.size), (40000, 1))
    children = mutate(rng, genomes, LAYOUT)
    rows, columns = (children != genomes).nonzero()
    in_hidden = (columns < LAYOUT.hidden_size).mean()
    assert abs(in_hidden - 0.5) < 0.015, 'either matrix with even odds'
    for entries, size in ((columns[columns < LAYOUT.hidden_size], LAYOUT.hidden_size),
                          (columns[columns >= LAYOUT.hidden_size] - LAYOUT.hidden_size,
                           LAYOUT.size - LAYOUT.hidden_size)):
        share = np.bincount(entries, minlength=size) / len(entries)
        assert np.abs(share * size - 1).max() < 0.25, 'then any of its entries'
    step = (children - genomes)[rows, columns] / np.abs(genomes[rows, columns])
    assert abs(step.mean()) < 0.02
    assert abs(step.std() - 1) < 0.02


def test_a_synapse_of_zero_stays_zero():
    zeros = np.zeros((10, LAYOUT.size))
    assert not mutate(np.random.default_rng(0), zeros, LAYOUT).any()


def test_mixed_mutation_changes_one_few_or_all():
    rng = np.random.default_rng(0)
    genomes = random_genomes(rng, 5000, LAYOUT)
    changed = (mutate_mixed(rng, genomes, LAYOUT) != genomes).sum(axis=1)
    assert abs((changed == LAYOUT.size).mean() - 0.3) < 0.03
    assert abs((changed == 1).mean() - 0.5) < 0.04
    assert set(changed) == {1, 2, 3, LAYOUT.size}


def test_wrong_shapes_are_named():
    with pytest.raises(ValueError, match=r'genomes: expected \(\.\.\., 90\), got \(3,\)'):
        LAYOUT.network(np.zeros(3))
    other = Layout(5, 0, (1.0,))
    with pytest.raises(ValueError, match='network: expected weights'):
        LAYOUT.genome(other.network(np.zeros(other.size)))
