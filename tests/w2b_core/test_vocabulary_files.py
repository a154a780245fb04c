"""Files of word vectors: every format that is read, every damage that is named."""

import bz2
import gzip
import io
import json
import lzma
import os
import struct
import tarfile
import zipfile
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


def members(data: bytes, size: int) -> bytes:
    """Return gzip's members of `size` bytes each, as bgzip makes them, an empty one at the end."""
    return b''.join(gzip.compress(data[start:start + size])
                    for start in range(0, len(data) + size, size))


def tabs(data: bytes) -> bytes:
    return data.replace(b' ', b'\t')


GLOVE = text().split(b'\n', 1)[1]
MORE_FORMATS = {
    'members.bin.gz': members(binary(), 17), 'members.txt.gz': members(text(), 100),
    'header_alone.bin.gz': gzip.compress(b'4 6\n') + gzip.compress(binary()[4:]),
    'byte_members.txt.gz': members(text(), 1),
    'zeros.bin.gz': gzip.compress(binary()) + bytes(512),
    'zeros.txt.gz': members(text(), 64) + bytes(3),
    'last_feed.bin': binary() + b'\n', 'tabs.txt': tabs(text()),
    'tab_after_word.txt': b'4\t6\n' + b'\n'.join(
        row.replace(b' ', b'\t', 1) for row in GLOVE.splitlines()) + b'\n',
    'crlf.txt': text().replace(b'\n', b'\r\n'), 'no_last_feed.txt': text()[:-1],
    'blanks.txt': text().replace(b'\n', b' \n') + b'\n \n', 'mark.txt': b'\xef\xbb\xbf' + text(),
    'glove.txt': GLOVE, 'glove_tabs.txt': tabs(GLOVE), 'glove.txt.gz': gzip.compress(GLOVE),
    'glove_crlf.txt': GLOVE.replace(b'\n', b'\r\n'), 'glove_mark.txt': b'\xef\xbb\xbf' + GLOVE,
    'glove_members.vec.gz': members(GLOVE, 30),
}


@pytest.mark.parametrize(('name', 'data'), [
    ('a.bin', binary()), ('line_feeds.bin', binary(feed=b'\n')), ('a.txt', text()),
    ('a.bin.gz', gzip.compress(binary())), ('a.txt.gz', gzip.compress(text())),
    ('no_suffix', binary()), *MORE_FORMATS.items()])
def test_every_word2vec_format_is_read(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    seen = []
    table = word2vec.read(tmp_path / name, lambda done, total: seen.append((done, total)))
    assert table.words == WORDS
    np.testing.assert_array_equal(table.vectors, VECTORS)
    assert seen == [(0, 4 if 'glove' not in name else 0)]
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


def rows(*lines: str, header: str = '') -> bytes:
    return (header + '\n'.join(lines) + '\n').encode()


def archive(name: str, data: bytes) -> bytes:
    buffer = io.BytesIO()
    if name == 'zip':
        with zipfile.ZipFile(buffer, 'w') as packed:
            packed.writestr('glove.txt', data)
    else:
        with tarfile.open(fileobj=buffer, mode='w') as packed:
            item = tarfile.TarInfo('glove.txt')
            item.size = len(data)
            packed.addfile(item, io.BytesIO(data))
    return buffer.getvalue()


#: The words of `twice.*` come twice: how many there are is told by the rows, not by the words.
TWICE = ['forward', 'stop', 'stop', 'halt']


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
    'no_header.bin': (binary().split(b'\n', 1)[1], 'no first line'),
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
    'fewer_words.txt.gz': (gzip.compress(text(header=b'2 6\n')), 'more than the 2'),
    'fewer_words_members.txt.gz': (members(text(header=b'2 6\n'), 40), 'more than the 2'),
    'fewer_words_members.bin.gz': (members(binary(header=b'2 6\n'), 40), 'bytes instead of'),
    'more_words.txt': (text(header=b'5 6\n'), 'truncated'),
    'more_words.txt.gz': (gzip.compress(text(header=b'5 6\n')), 'truncated'),
    'more_words.bin.gz': (gzip.compress(binary(header=b'5 6\n')), 'truncated'),
    'twice_fewer.txt': (text(TWICE, header=b'3 6\n'), 'more than the 3'),
    'twice_fewer.txt.gz': (gzip.compress(text(TWICE, header=b'3 6\n')), 'more than the 3'),
    'twice_fewer.bin': (binary(TWICE, header=b'3 6\n'), 'bytes instead of'),
    'twice_fewer.bin.gz': (gzip.compress(binary(TWICE, header=b'3 6\n')), 'bytes instead of'),
    'twice_more.txt': (text(TWICE, header=b'5 6\n'), 'truncated'),
    'twice_more.bin': (binary(TWICE, header=b'5 6\n'), 'truncated'),
    'cut_member.bin.gz': (members(binary(), 17)[:-40], 'truncated'),
    'garbage_after.bin.gz': (gzip.compress(binary()) + b'garbage', 'damaged'),
    'zeros.bin': (binary(vectors=0 * VECTORS), 'all zeros'),
    'zeros.txt': (text(vectors=0 * VECTORS), 'all zeros'),
    'tiny.bin': (binary(vectors=1e-30 * VECTORS), 'median length.*another scale'),
    'denormal.txt': (rows('a 1e-44 0', 'b 0 1e-44'), 'median length'),
    'vanishing.txt': (rows('a 1e-60 0', 'b 0 1e-60'), 'all zeros'),
    'largest.bin': (binary(vectors=with_value(3e38)), r"3e\+38 in the vector of 'Mary'"),
    'largest.txt': (text(vectors=with_value(-3e38)), r"-3e\+38 in the vector of 'Mary'"),
    'beyond_float32.txt': (rows('a 1 2', 'b 3e39 1'), 'NaN or infinity'),
    'thunder.bin': (binary(vectors=1e5 * VECTORS), 'median length'),
    'commas.txt': (rows('stop,1.5,2', 'go,1,1', header='2,2\n'), 'commas.*spaces'),
    'commas_below.txt': (rows('stop,1.5,2', 'go,1,1', header='2 2\n'), 'commas.*spaces'),
    'semicolons.csv': (rows('stop;1.5;2', 'go;1;1'), 'semicolons.*spaces'),
    'decimal_commas.txt': (rows('stop 1,5 2,5', 'go 1,5 1,5', header='2 2\n'), 'expected'),
    'glove_short_row.txt': (rows('stop 1 2 3', 'go 1 2', 'on 1 2 3'), '2 numbers instead of 3'),
    'glove_long_row.txt': (rows('stop 1 2 3', 'go 1 2 3 4'), '4 numbers instead of 3'),
    'glove_no_word.txt': (rows('stop 1 2 3', ' 1 2 3'), 'impossible word'),
    'glove_words.txt': (rows('stop 1 2 3', 'go one two three'), '0 numbers instead of 3'),
    'digits.txt': (rows('stop 1_0 2', 'go 1 2', header='2 2\n'), 'expected'),
    'one_line.txt': (b'2 2\nstop 1.5 2 ' + b'7' * 100_000, 'numbers instead of|damaged'),
    'glove.zip': (archive('zip', GLOVE), 'zip archive.*unzip'),
    'glove.tar': (archive('tar', GLOVE), 'tar archive.*tar xf'),
    'glove.tar.gz': (gzip.compress(archive('tar', GLOVE)), 'tar archive.*tar xf'),
    'glove.txt.bz2': (bz2.compress(GLOVE), 'bzip2 file.*bzip2 -d'),
    'glove.txt.xz': (lzma.compress(GLOVE), 'xz file.*xz -d'),
    'utf_16.txt': (GLOVE.decode().encode('utf-16'), 'UTF-16.*UTF-8'),
    'fasttext.bin': (b'\xba\x16\x4f\x2f' + bytes(200), 'fastText.*vec'),
    'array.npy': (b'\x93NUMPY\x01\0' + bytes(200), 'array without words'),
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


@pytest.mark.parametrize('data', [text(TWICE), binary(TWICE), text(TWICE).split(b'\n', 1)[1]])
def test_repeated_word_counts_once_in_every_format(tmp_path, data):
    (tmp_path / 'twice').write_bytes(data)
    table = word2vec.read(tmp_path / 'twice')
    assert table.words == ['forward', 'stop', 'halt']
    np.testing.assert_array_equal(table.vectors, VECTORS[[0, 1, 3]])


def test_words_without_a_direction_are_left_out(tmp_path):
    vectors = VECTORS.copy()
    vectors[[0, 2]] = 0
    (tmp_path / 'some.bin').write_bytes(binary(vectors=vectors))
    table = word2vec.read(tmp_path / 'some.bin')
    assert (table.words, table.zeros) == (['stop', 'über'], 2)
    np.testing.assert_array_equal(table.vectors, VECTORS[[1, 3]])
    assert 'forward' not in Vocabulary.load(tmp_path / 'some.bin')


def test_spaces_within_gloves_words_become_underscores(tmp_path):
    (tmp_path / 'glove.txt').write_bytes(rows('stop 1 2', '. . 3 4', 'at name@domain.com 5 6',
                                              '2010 7 8', 'new york\t9 10'))
    table = word2vec.read(tmp_path / 'glove.txt')
    assert table.words == ['stop', '._.', 'at_name@domain.com', '2010', 'new_york']
    np.testing.assert_array_equal(table.vectors, np.arange(1, 11).reshape(5, 2))
    assert Vocabulary.load(tmp_path / 'glove.txt').known('New-York') == 'new_york'


def test_many_words_are_read_in_chunks(tmp_path):
    """More than are looked at together, with an impossible vector among the last."""
    words = [f'w{index}' for index in range(10_000)]
    vectors = np.random.default_rng(1).normal(size=(10_000, 3)).astype(np.float32)
    vectors[[5, 4095, 4096, 9000]] = 0
    (tmp_path / 'many.bin').write_bytes(binary(words, vectors))
    for onto in (None, tmp_path / 'raw'):
        table = word2vec.read(tmp_path / 'many.bin', onto=onto)
        assert table.words == [word for word in words
                               if word not in ('w5', 'w4095', 'w4096', 'w9000')]
        np.testing.assert_array_equal(table.vectors, vectors[vectors.any(axis=1)])
    vectors[9_999, 1] = np.inf
    (tmp_path / 'many.bin').write_bytes(binary(words, vectors))
    with pytest.raises(VocabularyFileError, match="'w9999'"):
        word2vec.read(tmp_path / 'many.bin')


def test_pipe_is_refused_with_what_to_do(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(VocabularyFileError, match='vocabulary install'):
        Vocabulary.load(tmp_path / 'pipe')


@pytest.mark.parametrize(('spec', 'reason'), [
    ('/dev/null', 'device'), ('/dev/zero', 'device'), ('x' * 5000, 'no such name'),
    ('a\0b', 'no such name'), ('/root/\udcff', 'no such name')])
def test_what_is_no_file_is_refused(spec, reason):
    with pytest.raises(VocabularyFileError, match=reason) as caught:
        Vocabulary.load(spec)
    assert len(str(caught.value)) < 500


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


def test_pickled_vectors_are_not_run(folder, monkeypatch):
    """Reading a pickle runs what is in it: the file is one on purpose, and must be refused."""
    monkeypatch.setattr(Trap, 'sprung', False)
    np.save(folder / 'vectors.npy', np.array([Trap()], dtype=object), allow_pickle=True)
    with pytest.raises(VocabularyFileError):
        Vocabulary.load(folder)
    assert not Trap.sprung
    np.load(folder / 'vectors.npy', allow_pickle=True)
    assert Trap.sprung, 'what the refusal spares the robot'


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


def test_zeros_on_the_disk_are_refused_when_the_word_is_heard(folder):
    save_vectors(folder, VECTORS * np.array([[1], [0], [1], [0]], dtype=np.float32))
    vocabulary = Vocabulary.load(folder)
    with pytest.raises(VocabularyFileError, match="direction for 'stop'"):
        vocabulary.phrase('forward stop')
    assert [word for word, _cosine in vocabulary.neighbours('forward')][:1] == ['Mary']
    assert np.isfinite([cosine for _word, cosine in vocabulary.neighbours('forward')]).all()


@pytest.mark.parametrize('scale', [1e-9, 1e-300, 1e9, 1e300])
def test_scale_that_leaves_nothing_to_hear_is_refused(folder, scale):
    for spec in (folder, 'default'):
        with pytest.raises(VocabularyFileError, match='another scale'):
            Vocabulary.load(spec, scale=scale)


def test_binary_numbers_are_little_endian(tmp_path):
    (tmp_path / 'one.bin').write_bytes(b'1 2\nstop ' + struct.pack('<2f', 1.5, -2.0))
    np.testing.assert_array_equal(word2vec.read(tmp_path / 'one.bin').vectors, [[1.5, -2.0]])
