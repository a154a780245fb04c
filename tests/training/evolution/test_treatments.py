"""Word sets, held-out draws and permuted vectors."""

from collections import Counter

import numpy as np
import pytest

from training.evolution.treatments import draw_words, generator, permutation, treated, vector_hash

VECTORS = {word: np.random.default_rng(index).normal(size=300)
           for index, word in enumerate(('forward', 'stop', 'halt'))}


def test_paper_words_hold_out_every_stop_word_evenly():
    held = Counter()
    for seed in range(400):
        words, (out,) = draw_words('paper', seed)
        assert dict(words)['forward'] == 'forward'
        assert dict(words)['backward'] == 'backward'
        assert {word for word, _ in words} | {out[0]} == {
            'forward', 'backward', 'stop', 'cease', 'suspend', 'halt'}
        assert len(words) == 5
        assert out[1] == 'stop'
        held[out[0]] += 1
    assert set(held) == {'stop', 'cease', 'suspend', 'halt'}
    assert max(held.values()) < 1.5 * min(held.values())


def test_balanced_words_are_two_of_each():
    words, (out,) = draw_words('balanced', 3)
    assert Counter(behaviour for _, behaviour in words) == {'forward': 2, 'backward': 2, 'stop': 2}
    assert out[0] in ('stop', 'cease', 'suspend')
    assert 'halt' not in dict(words)


def test_draws_repeat_and_do_not_disturb_each_other():
    assert draw_words('paper', 7) == draw_words('paper', 7)
    assert generator(7, 0).random() != generator(7, 1).random()
    assert generator(7, 0).random() != generator(8, 0).random()
    assert generator(7, 2, 5).random() == generator(7, 2, 5).random()


def test_control_shuffles_each_word_by_its_own_permutation():
    heard = treated(VECTORS, VECTORS, 'control', 11)
    for row, (word, vector) in zip(heard, VECTORS.items(), strict=True):
        assert sorted(row) == sorted(vector)
        assert (row != vector).mean() > 0.9
        assert row.tobytes() == vector[permutation(11, word, 300)].tobytes()
    assert (permutation(11, 'stop', 300) != permutation(11, 'halt', 300)).any()
    assert (permutation(11, 'stop', 300) != permutation(12, 'stop', 300)).any()
    alone = treated(VECTORS, ['halt'], 'control', 11)
    assert alone[0].tobytes() == heard[2].tobytes(), "a word's permutation hangs on no other word"


def test_experimental_leaves_the_vectors_alone():
    heard = treated(VECTORS, VECTORS, 'experimental', 11)
    assert heard.tobytes() == np.array(list(VECTORS.values())).tobytes()


def test_hash_is_of_the_float32_bytes():
    vector = np.array([0.1, -2.5])
    assert vector_hash(vector) == vector_hash(vector.astype(np.float32))
    assert vector_hash(vector) != vector_hash(vector + 1e-3)
    assert len(vector_hash(vector)) == 64


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match="one of paper, balanced, balanced_paper, got 'x'"):
        draw_words('x', 0)
    with pytest.raises(ValueError, match=r"treatment: expected one of .*, got 'placebo'"):
        treated(VECTORS, VECTORS, 'placebo', 0)
