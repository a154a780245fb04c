"""Suggestions for words that are not there are the nearest spellings, and come at once."""

import random
import time

import numpy as np
import pytest

from w2b_core.vocabulary import Vocabulary
from w2b_core.vocabulary.spelling import LEAST_SIMILARITY, LONGEST, Spellings

LETTERS = 'abcdefghijklmnopqrstuvwxyz'


def distance(first, second):
    """Return the optimal string alignment distance, from its definition."""
    rows = [list(range(len(second) + 1))]
    for i, letter in enumerate(first, 1):
        row = [i]
        for j, other in enumerate(second, 1):
            least = min(rows[-1][j] + 1, row[-1] + 1, rows[-1][j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == second[j - 2] and first[i - 2] == other:
                least = min(least, rows[-2][j - 2] + 1)
            row.append(least)
        rows.append(row)
    return rows[-1][-1]


def nearest(word, words, count):
    """Return what `Spellings.like` shall return."""
    found = sorted((distance(word, other) / max(len(word), len(other)), place)
                   for place, other in enumerate(words))
    return tuple(words[place] for share, place in found[:count] if 1 - share >= LEAST_SIMILARITY)


def misspelt(word, draw):
    letters = list(word)
    for _ in range(draw.choice((1, 1, 2, 3))):
        place = draw.randrange(len(letters))
        kind = draw.randrange(4)
        if kind == 0:
            letters.insert(place, draw.choice(LETTERS))
        elif kind == 1 and len(letters) > 1:
            del letters[place]
        elif kind == 2:
            letters[place] = draw.choice(LETTERS)
        elif place + 1 < len(letters):
            letters[place:place + 2] = reversed(letters[place:place + 2])
    return ''.join(letters)


@pytest.fixture(scope='module')
def words():
    return Vocabulary.load().words


def test_suggestions_are_the_nearest_spellings(words):
    draw = random.Random(2)
    some = draw.sample(words, 700)
    spellings = Spellings(some)
    for word in draw.sample(some, 60):
        typed = misspelt(word, draw)
        assert spellings.like(typed, 3) == nearest(typed, some, 3), typed


@pytest.mark.parametrize('word', ['', 'x' * LONGEST, 'x' * (LONGEST + 1), 'y' * 100_000,
                                  '\U0001f916', '\u0432\u043f\u0435\u0440\u0451\u0434', '\0'])
def test_words_that_are_like_none(words, word):
    assert Spellings(words).like(word, 3) == ()


def test_letters_of_other_scripts_count_as_themselves():
    spellings = Spellings(['\u0432\u043f\u0435\u0440\u0451\u0434', '\u0441\u0442\u043e\u043f'])
    assert spellings.like('\u0432\u043f\u0435\u0440\u0435\u0434', 3) == (spellings.words[0],)
    assert Spellings([]).like('stop', 3) == ()


def test_a_longest_word_is_aligned_to_its_last_letter():
    word = 'ab' * (LONGEST // 2)
    others = [word[:-2] + 'xy', word[:-1] + 'x', word + 'xyz', word[1:] + word[0]]
    assert Spellings(others).like(word, 4) == nearest(word, others, 4)


def test_misspelt_words_take_2_ms_of_one_core(words):
    """The median; 5 ms at the slowest twentieth."""
    draw = random.Random(3)
    spellings = Spellings(words)
    took = []
    for word in draw.sample(words, 200):
        typed = misspelt(word, draw)
        start = time.thread_time()
        spellings.like(typed, 3)
        took.append(time.thread_time() - start)
    assert np.median(took) < 2.5e-3
    assert np.quantile(took, 0.95) < 6e-3
