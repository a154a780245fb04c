"""Where words lie: a word's inflections count, its meaning told by nothing but vectors."""


import numpy as np
import pytest

from w2b_core.hearing import Ear, places, teach
from w2b_core.hearing.metric import Metric, load, unit
from w2b_core.json_fields import JsonFileError
from w2b_core.vocabulary import Vocabulary

WORDS = ('walk', 'walks', 'walked', 'walking', 'back', 'xylem')
VECTORS = np.random.default_rng(0).normal(size=(len(WORDS), 8))


@pytest.fixture
def small():
    """A vocabulary of four forms of one word and two others, and a metric that only centres."""
    return Vocabulary('small', list(WORDS), VECTORS.astype(np.float32)), \
        Metric(np.full(8, 0.01), np.eye(8))


def test_a_word_lies_between_its_vector_and_the_mean_of_its_other_forms(small):
    vocabulary, metric = small
    alone = metric.project(vocabulary.matrix(WORDS))
    where = places.project(WORDS, vocabulary, metric)
    assert np.allclose(where[1], unit(alone[1] + alone[[0, 2, 3]].mean(axis=0)))
    assert np.allclose(where[4:], alone[4:])
    assert np.allclose(np.linalg.norm(where, axis=1), 1)
    assert places.project([], vocabulary, metric).shape == (0, 8)


def test_it_lies_there_whatever_else_is_asked(small):
    vocabulary, metric = small
    every = places.project(WORDS, vocabulary, metric)
    for word, point in zip(WORDS, every, strict=True):
        assert np.allclose(places.project([word], vocabulary, metric)[0], point)


def test_forms_are_looked_for_among_the_words_that_are_given(small):
    vocabulary, metric = small
    alone = metric.project(vocabulary.matrix(WORDS))
    found = places.project(['walk'], vocabulary, metric, among={'walk', 'walked'})
    assert np.allclose(found[0], unit(alone[0] + alone[2]))
    assert np.allclose(places.project(WORDS, vocabulary, metric, forms=False), alone)


def test_forms_of_a_word_lie_nearer_than_their_vectors(ear, vocabulary):
    metric = load(ear.metric_sha256, vocabulary)
    for pair in (['halt', 'halting'], ['march', 'marched'], ['withdraws', 'withdraw']):
        alone, counted = (places.project(pair, vocabulary, metric, forms=forms)
                          for forms in (False, True))
        assert counted[0] @ counted[1] > alone[0] @ alone[1] + 0.1


def test_an_ear_of_version_1_hears_every_word_by_its_own_vector(ear, vocabulary):
    """Its threshold was set so; it stays so when it is taught and written again."""
    old = Ear.from_json({**ear.to_json(), 'version': 1})
    assert ear.forms
    assert not old.forms
    listener = old.bind(vocabulary)
    names = ['halting', 'marched', 'banana']
    assert np.array_equal(listener.points(names),
                          listener.metric.project(vocabulary.matrix(names)))
    assert not np.allclose(ear.bind(vocabulary).points(names[:2]), listener.points(names[:2]))
    taught = teach(old, vocabulary, 'banana', 'sit').ear
    assert (taught.forms, taught.to_json()['version']) == (False, 1)
    assert old.to_json()['version'] == 1
    assert ear.to_json()['version'] == 2


def test_a_version_that_is_not_known_is_named(ear):
    with pytest.raises(JsonFileError, match=r'ear\.format.*1 or 2.*3'):
        Ear.from_json({**ear.to_json(), 'version': 3})
