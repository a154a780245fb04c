"""A small set of words, and a controller whose hidden layer sorts it."""

import numpy as np

from training.evolution.operators import Layout
from training.pipeline.recipe import load_recipe, shipped
from training.pipeline.words import Roles
from training.robust import screening
from training.robust.settings import Pretraining
from w2b_core import bodies
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary

RECIPE = load_recipe(shipped()['quadruped'])
LAYOUT = Layout.of(bodies.get('quadruped'))
PLAN = Pretraining(1, 100, population=30, moves=2, stops=4)
ROLES = Roles(trained={'forward': 'forward', 'backward': 'backward', 'stop': ['stop', 'cease']},
              validation={'stop': 'abort'}, held_out={'stop': 'halt'})


def known_vectors():
    vocabulary = Vocabulary.load()
    return {word: vocabulary.vector(word) for word, _asked in RECIPE.words.known}


def found_walker(directory) -> Network:
    """A controller whose hidden layer rests under stop and cease, with two rhythms."""
    words = screening.WordsToSort(ROLES.trained, ROLES.validation, known_vectors(), 0.02)
    found, screen = screening.find(directory, words, LAYOUT, 6, PLAN, print)
    assert screen.trained[0] == 1.0
    hidden = np.zeros((5, 10))
    hidden[:, :6] = found[0]
    return LAYOUT.network(np.concatenate([hidden.ravel(), np.full(40, 0.5)]))
