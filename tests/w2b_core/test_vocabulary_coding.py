"""Coded vectors and learned metrics: what is decoded, and what is refused."""

import json
from statistics import NormalDist

import numpy as np
import pytest

from w2b_core.vocabulary import Vocabulary, VocabularyError, VocabularyFileError, metrics, store
from w2b_core.vocabulary.coding import LEVELS, PartlyCoded, decode, encode, row_bytes

RNG = np.random.default_rng(3)
VECTORS = (RNG.normal(size=(700, 30)) * RNG.uniform(0.01, 3, size=(700, 1))).astype(np.float32)


def test_levels_are_quantiles_of_a_wide_normal_distribution():
    exact = [1.9 * NormalDist().inv_cdf((index + 0.5) / 64) for index in range(64)]
    np.testing.assert_allclose(LEVELS, exact, atol=0.5 / 1024)


@pytest.mark.parametrize('dimensions', [1, 2, 3, 4, 5, 30, 300])
def test_decoded_vectors_are_near_the_originals(dimensions):
    vectors = RNG.normal(size=(50, dimensions)).astype(np.float32)
    rows = encode(vectors)
    assert rows.shape == (50, row_bytes(dimensions))
    decoded = decode(rows, dimensions)
    assert decoded.dtype == np.float32
    width = np.sqrt((vectors ** 2).mean(axis=1, keepdims=True))
    assert np.median(np.abs(decoded - vectors) / width) < 0.03
    np.testing.assert_allclose(np.linalg.norm(decoded, axis=1), np.linalg.norm(vectors, axis=1),
                               rtol=0.001)


def test_coding_again_changes_nothing():
    """A decoded vector's own levels are the nearest ones: copies of copies do not wander."""
    once = decode(encode(VECTORS), 30)
    twice = decode(encode(once), 30)
    np.testing.assert_allclose(twice, once, rtol=0.06, atol=0.01)


@pytest.mark.parametrize('bad', [0.0, np.nan, np.inf, 1e30])
def test_vectors_that_have_no_code_are_refused(bad):
    with pytest.raises(ValueError, match='expected'), np.errstate(over='ignore'):
        encode(np.full((1, 4), bad))


def test_rows_are_read_like_those_of_an_array():
    coded = encode(VECTORS[300:])
    vectors = PartlyCoded(VECTORS[:300].astype(np.float16), coded)
    whole = np.concatenate([VECTORS[:300].astype(np.float16).astype(np.float32),
                            decode(coded, 30)])
    assert vectors.shape == whole.shape
    for index in (0, 299, 300, 699, -1, slice(290, 310), [5, 699, 5], np.array([301, 2])):
        np.testing.assert_array_equal(vectors[index], whole[index])
    np.testing.assert_array_equal(np.asarray(vectors), whole)
    for outside in (700, -701, [700]):
        with pytest.raises(IndexError):
            vectors[outside]


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / 'small'
    path.mkdir()
    store.write_folder(
        path, store.About('small', 6, 30, 'a test', '0' * 64, 'as they are', coded_words=4,
                          coding='normal-6-bit'),
        ['a', 'b', 'c', 'd', 'e', 'f'], VECTORS[:2], encode(VECTORS[2:6]))
    return path


def test_vocabulary_gives_exact_and_coded_words(folder):
    vocabulary = Vocabulary.load(folder)
    assert vocabulary.exact_words == ['a', 'b']
    np.testing.assert_array_equal(vocabulary.vector('b'), VECTORS[1])
    np.testing.assert_array_equal(vocabulary.vector('F'), decode(encode(VECTORS[5:6]), 30)[0])
    np.testing.assert_array_equal(vocabulary.matrix()[[1, 5]], vocabulary.matrix(['b', 'f']))
    np.testing.assert_array_equal(vocabulary.keyed_vectors.vectors, vocabulary.matrix())
    twice = Vocabulary.load(folder, scale=2.0)
    np.testing.assert_array_equal(twice.matrix(), 2 * vocabulary.matrix())
    with pytest.raises(VocabularyError, match="unknown word 'g'"):
        vocabulary.matrix(['a', 'g'])


def change_about(folder, **changes) -> None:
    about = json.loads((folder / 'about.json').read_text())
    (folder / 'about.json').write_text(json.dumps({**about, **changes}))


DAMAGE = {
    'no coded vectors': (lambda folder: (folder / 'coded.npy').unlink(), 'No such file'),
    'cut': (lambda folder: (folder / 'coded.npy').write_bytes(
        (folder / 'coded.npy').read_bytes()[:-9]), 'damaged'),
    'of another kind': (lambda folder: np.save(folder / 'coded.npy', VECTORS), 'uint8'),
    'of another length': (lambda folder: np.save(
        folder / 'coded.npy', encode(VECTORS[2:6, :20])), 'shape'),
    'too few': (lambda folder: np.save(folder / 'coded.npy', encode(VECTORS[2:5])), 'shape'),
    'another code': (lambda folder: change_about(folder, coding='opus'), "got 'opus'"),
    'other count': (lambda folder: change_about(folder, coded_words=3), 'shape'),
}


@pytest.mark.parametrize('damage', DAMAGE)
def test_damaged_coded_vectors_are_named_in_one_line(folder, damage):
    spoil, reason = DAMAGE[damage]
    spoil(folder)
    with pytest.raises(VocabularyFileError, match=r'expected .* got') as caught:
        Vocabulary.load(folder)
    assert reason in str(caught.value)
    assert '\n' not in str(caught.value)


METRIC = {'projection': RNG.normal(size=(30, 7)), 'mean': RNG.normal(size=30)}


@pytest.fixture
def data(tmp_path, monkeypatch):
    monkeypatch.setenv('W2B_DATA', str(tmp_path / 'data'))
    return tmp_path / 'data' / 'metrics'


def test_metric_is_kept_and_found_by_its_hash(data, folder):
    digest = metrics.write(METRIC)
    assert [path.name for path in data.iterdir()] == [f'{digest}.npz']
    metric = Vocabulary.load(folder).metric(digest)
    assert set(metric) == set(METRIC)
    for name, array in metric.items():
        assert array.dtype == np.float32
        np.testing.assert_array_equal(array, METRIC[name].astype(np.float32))
    # Same arrays, same file: nothing depends on when or in which order they were written.
    before = (data / f'{digest}.npz').read_bytes()
    assert metrics.write(dict(reversed(METRIC.items()))) == digest
    assert (data / f'{digest}.npz').read_bytes() == before
    assert metrics.write({**METRIC, 'mean': METRIC['mean'] + 1e-3}) != digest


@pytest.mark.parametrize(('metric', 'reason'), [
    ({}, '0 arrays'), ({'Mean': np.ones(3)}, "'Mean'"), ({'mean': np.array([1, np.nan])}, 'finite'),
    ({'mean': np.zeros((3000, 4000))}, 'at most 40 MiB'), ({'../up': np.ones(3)}, 'names')])
def test_what_is_no_metric_is_not_written(data, metric, reason):
    with pytest.raises(VocabularyError, match=reason):
        metrics.write(metric)
    assert not data.exists()


@pytest.mark.parametrize('digest', ['', 'ab', '../../etc/passwd', 'A' * 64, None, 7])
def test_what_is_no_hash_is_refused(data, folder, digest):
    with pytest.raises(VocabularyError, match='64 digits'):
        Vocabulary.load(folder).metric(digest)


def test_missing_metric_says_where_it_was_looked_for_and_what_to_do(data, folder):
    with pytest.raises(VocabularyFileError, match='train the ear again') as caught:
        Vocabulary.load(folder).metric('0' * 64)
    assert str(data) in str(caught.value)


@pytest.mark.parametrize('spoil', [
    lambda content: b'', lambda content: content[:-40], lambda content: b'\x80\x04.',
    lambda content: content[:300] + bytes([content[300] ^ 1]) + content[301:]])
def test_damaged_metric_is_refused(data, folder, spoil):
    path = data / f'{metrics.write(METRIC)}.npz'
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(VocabularyFileError, match=r'expected .* got.*train the ear again'):
        Vocabulary.load(folder).metric(path.stem)


def test_metric_under_anothers_name_is_refused(data, folder):
    path = data / f'{metrics.write(METRIC)}.npz'
    path.rename(data / f'{"0" * 64}.npz')
    with pytest.raises(VocabularyFileError, match='damaged'):
        Vocabulary.load(folder).metric('0' * 64)


def test_metric_of_longer_vectors_is_refused(data):
    digest = metrics.write(METRIC)
    with pytest.raises(VocabularyFileError, match='vectors of 300 elements'):
        Vocabulary.load().metric(digest)


def test_place_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('W2B_DATA', str(tmp_path / 'file'))
    with pytest.raises(VocabularyError, match='W2B_DATA names another place'):
        metrics.write(METRIC)
