"""The words of the champions: no word in two roles, chosen by the rule that their file tells."""

from importlib.resources import files

import numpy as np
import pytest

from training.pipeline.recipe import load_recipe, shipped
from training.pipeline.words import Roles
from w2b_core.vocabulary import Vocabulary

QUADRUPED, TWIN = (load_recipe(shipped()[body]).words for body in ('quadruped', 'physical_twin'))
HELD_OUT_STEMS = ('halt', 'suspen')
FORMS = ('stop', 'ceas', 'cess')


def listed(heading: str) -> list[str]:
    """Return the words under a heading of the vocabulary's list."""
    text = (files('w2b_core') / 'vocabularies' / 'behaviour_words.txt').read_text()
    section = text.partition(f'# {heading}\n')[2].partition('#')[0]
    return section.split()


def words(pairs, behaviour):
    return [word for word, asked in pairs if asked == behaviour]


def test_the_stop_words_are_those_of_the_rule():
    vocabulary = Vocabulary.load()

    def unit(word):
        vector = vocabulary.vector(word)
        return vector / np.linalg.norm(vector)

    def cosine(word):
        return max(float(unit(word) @ unit(other)) for other in ('stop', 'cease'))

    pool = [word for word in listed('Like stop.') if word in vocabulary and cosine(word) >= 0.25
            and not word.startswith(HELD_OUT_STEMS)]
    near = sorted(word for word in pool if cosine(word) >= 0.35 and not word.startswith(FORMS))
    rng = np.random.default_rng(0)
    drawn = sorted(rng.choice(near, 2, replace=False).tolist())
    rest = sorted(set(pool) - set(drawn))
    validation = sorted(rng.choice(rest, 6, replace=False).tolist())
    assert words(QUADRUPED.held_out, 'stop') == ['halt', 'suspend', *drawn]
    assert words(QUADRUPED.validation, 'stop') == validation
    assert words(QUADRUPED.trained, 'stop') == ['stop', 'cease',
                                                *sorted(set(rest) - set(validation))]


def test_every_word_is_known_and_no_held_out_stem_is_heard():
    vocabulary = Vocabulary.load()
    assert all(word in vocabulary for word, _asked in QUADRUPED.every)
    heard = [word for word, _asked in QUADRUPED.trained + QUADRUPED.validation]
    stems = [word[:4] for word in words(QUADRUPED.held_out, 'stop')]
    assert not [word for word in heard if word[:4] in stems]


def test_words_are_held_out_of_every_behaviour():
    assert TWIN == QUADRUPED
    for behaviour in ('forward', 'backward', 'stop'):
        others = [word for word in words(TWIN.held_out, behaviour)
                  if word not in ('halt', 'suspend')]
        assert len(others) >= 2, behaviour


def test_a_word_in_two_roles_is_refused():
    moves = {'forward': 'forward', 'backward': 'backward'}
    with pytest.raises(ValueError, match="one role each, got two for 'halt'"):
        Roles(trained={**moves, 'stop': ['stop', 'halt']}, held_out={'stop': 'halt'})
    with pytest.raises(ValueError, match='one role'):
        Roles(trained={**moves, 'stop': ['stop', 'halt']}, held_out={'stop': 'HALT'})
    with pytest.raises(ValueError, match="got none for 'stop'"):
        Roles(trained=moves, validation={'stop': 'stop'})
    with pytest.raises(ValueError, match="expected behaviours that walk, or stop, got 'left'"):
        Roles(trained={**moves, 'stop': 'stop', 'left': 'left'})
