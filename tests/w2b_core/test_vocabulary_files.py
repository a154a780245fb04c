"""Files of word vectors: every format that is read, every damage that is named."""

import gzip
import json
import struct
from pathlib import Path

import numpy as np
import pytest

from w2b_core.vocabulary import Vocabulary, VocabularyFileError, store, word2vec
from w2b_core.vocabulary.store import About

WORDS = ['forward', 'stop', 'Mary', 'über']
VECTORS = np.random.default_rng(5).normal(size=(4, 6)).astype(np.float32)


def binary(words=WORDS, vectors=VECTORS, header=None, feed=b'') -> bytes:
    rows = b''.join(word.encode() + b' ' + row.tobytes() + feed
                    for word, row in zip(words, vectors, strict=True))
    return (header or f'{len(words)} {vectors.shape[1]}\n'.encode()) + rows


def text(words=WORDS, vectors=VECTORS, header=None) -> bytes:
    rows = ''.join(word + ' ' + ' '.join(map(repr, row.tolist())) + '\n'
                   for word, row in zip(words, vectors, strict=True))
    return (header or f'{len(words)} {vectors.shape[1]}\n'.encode()) + rows.encode()


@pytest.mark.parametrize(('name', 'data'), [
    ('a.bin', binary()), ('line_feeds.bin', binary(feed=b'\n')), ('a.txt', text()),
    ('a.bin.gz', gzip.compress(binary())), ('a.txt.gz', gzip.compress(text())),
    ('no_suffix', binary())])
def test_every_word2vec_format_is_read(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    seen = []
    table = word2vec.read(tmp_path / name, lambda done, total: seen.append((done, total)))
    assert table.words == WORDS
    np.testing.assert_array_equal(table.vectors, VECTORS)
    assert seen == [(0, 4)]
    vocabulary = Vocabulary.load(tmp_path / name)
    assert vocabulary.scale == 1.0
    np.testing.assert_array_equal(vocabulary.vector('Stop!'), VECTORS[1])
    assert vocabulary.known('mary') == 'Mary'


def test_unit_vectors_are_scaled_unless_told_otherwise(tmp_path):
    unit = VECTORS / np.linalg.norm(VECTORS, axis=1, keepdims=True)
    (tmp_path / 'unit.bin').write_bytes(binary(vectors=unit))
    assert np.linalg.norm(Vocabulary.load(tmp_path / 'unit.bin').vector('stop')) \
        == pytest.approx(word2vec.DEFAULT_NORM)
    assert np.linalg.norm(Vocabulary.load(tmp_path / 'unit.bin', scale=1.0).vector('stop')) \
        == pytest.approx(1.0)


def with_value(value: float) -> np.ndarray:
    damaged = VECTORS.copy()
    damaged[2, 3] = value
    return damaged


DAMAGE = {
    'truncated.bin': (binary()[:-5], 'truncated'),
    'truncated_header_true.bin': (binary()[:40], 'too small'),
    'truncated.txt': (text()[:-80], 'truncated|damaged'),
    'truncated.bin.gz': (gzip.compress(binary())[:-12], 'truncated'),
    'broken.bin.gz': (gzip.compress(binary())[:20] + b'\xff' * 60, 'damaged'),
    'empty.bin': (b'', 'no first line'),
    'no_header.txt': (text().split(b'\n', 1)[1], 'no first line'),
    'negative.bin': (binary(header=b'-4 6\n'), 'no first line'),
    'huge.bin': (binary(header=b'3000000 300\n'), 'too small for the 3,000,000'),
    'gigantic.bin': (binary(header=b'9' * 30 + b' 9\n'), 'too small'),
    'fewer_dimensions.bin': (binary(header=b'4 5\n'), 'dimensions|damaged'),
    'more_dimensions.bin': (binary(header=b'3 8\n'), 'dimensions|damaged'),
    'fewer_words.bin': (binary(header=b'3 6\n'), 'bytes instead of'),
    'fewer_words.txt': (text(header=b'3 6\n'), 'more than the 3'),
    'fewer_words.bin.gz': (gzip.compress(binary(header=b'3 6\n')), 'bytes instead of'),
    'wrong_dimensions.txt': (text(header=b'4 5\n'), 'damaged'),
    'not_a_number.txt': (text()[:-40] + b'x' * 40, 'damaged'),
    'nan.bin': (binary(vectors=with_value(np.nan)), "NaN or infinity in the vector of 'Mary'"),
    'infinity.bin': (binary(vectors=with_value(np.inf)), 'NaN or infinity'),
    'nan.txt': (text(vectors=with_value(np.nan)), 'NaN or infinity'),
    'latin1.bin': (binary().replace('über'.encode(), 'übeer'.encode('latin-1')), '0xfc.*UTF-8'),
    'latin1.txt': (text().replace('über'.encode(), 'über'.encode('latin-1')), '0xfc.*UTF-8'),
    'empty_word.bin': (binary(words=['forward', '', 'x', 'y']), 'impossible word'),
    'packed.bin': (gzip.compress(binary()), 'called .gz'),
    'pickle.kv': (b'\x80\x04.', 'pickle'),
    'picture.png': (b'\x89PNG\r\n\x1a\n' + bytes(4000), 'no first line'),
}


@pytest.mark.parametrize('name', DAMAGE)
def test_damage_is_named_in_one_line(tmp_path, name):
    data, reason = DAMAGE[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(VocabularyFileError, match=reason) as caught:
        Vocabulary.load(tmp_path / name)
    assert '\n' not in str(caught.value)
    assert name in str(caught.value)
    assert 'expected' in str(caught.value)


def test_repeated_word_counts_once(tmp_path):
    (tmp_path / 'twice.bin').write_bytes(binary(words=['forward', 'stop', 'stop', 'halt']))
    table = word2vec.read(tmp_path / 'twice.bin')
    assert table.words == ['forward', 'stop', 'halt']
    np.testing.assert_array_equal(table.vectors, VECTORS[[0, 1, 3]])


@pytest.fixture
def folder(tmp_path) -> Path:
    path = tmp_path / 'small'
    path.mkdir()
    store.write_folder(path, About('small', 4, 6, 'a test', '0' * 64, 'as they are'), WORDS,
                       VECTORS)
    return path


def test_folder_is_opened_without_reading_its_vectors(folder):
    vocabulary = Vocabulary.load(folder)
    assert vocabulary.words == WORDS
    assert isinstance(vocabulary._vectors, np.memmap)
    assert vocabulary.keyed_vectors.vectors is vocabulary._vectors
    np.testing.assert_array_equal(vocabulary.vector('über'), VECTORS[3])


def set_about(folder: Path, **changes) -> None:
    about = json.loads((folder / 'about.json').read_text())
    (folder / 'about.json').write_text(json.dumps({**about, **changes}))


def save_vectors(folder: Path, vectors) -> None:
    np.save(folder / 'vectors.npy', vectors)


FOLDER_DAMAGE = {
    'no about': lambda folder: (folder / 'about.json').unlink(),
    'about not JSON': lambda folder: (folder / 'about.json').write_text('{"words":'),
    'about a list': lambda folder: (folder / 'about.json').write_text('[]'),
    'about not UTF-8': lambda folder: (folder / 'about.json').write_bytes(b'{"a": "\xff"}'),
    'another format': lambda folder: set_about(folder, format='other'),
    'another version': lambda folder: set_about(folder, version=2),
    'unknown field': lambda folder: set_about(folder, colour='red'),
    'words a string': lambda folder: set_about(folder, words='4'),
    'other count': lambda folder: set_about(folder, words=5),
    'other dimensions': lambda folder: set_about(folder, dimensions=5),
    'no words': lambda folder: (folder / 'words.txt').unlink(),
    'words not UTF-8': lambda folder: (folder / 'words.txt').write_bytes(b'a\nb\xff\nc\nd\n'),
    'a word fewer': lambda folder: (folder / 'words.txt').write_text('a\nb\nc\n'),
    'a word twice': lambda folder: (folder / 'words.txt').write_text('a\nb\nc\na\n'),
    'no vectors': lambda folder: (folder / 'vectors.npy').unlink(),
    'vectors cut': lambda folder: (folder / 'vectors.npy').write_bytes(
        (folder / 'vectors.npy').read_bytes()[:-8]),
    'vectors empty': lambda folder: (folder / 'vectors.npy').write_bytes(b''),
    'vectors text': lambda folder: (folder / 'vectors.npy').write_text('hello'),
    'vectors 1-D': lambda folder: save_vectors(folder, VECTORS[0]),
    'vectors integers': lambda folder: save_vectors(folder, VECTORS.astype(int)),
}


@pytest.mark.parametrize('damage', FOLDER_DAMAGE)
def test_damaged_folder_is_named_in_one_line(folder, damage):
    FOLDER_DAMAGE[damage](folder)
    with pytest.raises(VocabularyFileError, match=r'expected .* got') as caught:
        Vocabulary.load(folder)
    assert '\n' not in str(caught.value)


def test_pickled_vectors_are_not_run(folder):
    np.save(folder / 'vectors.npy', np.array([Trap()], dtype=object), allow_pickle=True)
    with pytest.raises(VocabularyFileError):
        Vocabulary.load(folder)
    assert not Trap.sprung


class Trap:
    """Springs when it is unpickled."""

    sprung = False

    def __reduce__(self):
        return setattr, (Trap, 'sprung', True)


def test_nan_on_the_disk_is_refused_when_the_word_is_heard(folder):
    save_vectors(folder, with_value(np.nan))
    vocabulary = Vocabulary.load(folder)
    vocabulary.vector('stop')
    with pytest.raises(VocabularyFileError, match="finite numbers for 'Mary'"):
        vocabulary.phrase('stop mary')


def test_binary_numbers_are_little_endian(tmp_path):
    (tmp_path / 'one.bin').write_bytes(b'1 2\nstop ' + struct.pack('<2f', 1.5, -2.0))
    np.testing.assert_array_equal(word2vec.read(tmp_path / 'one.bin').vectors, [[1.5, -2.0]])
