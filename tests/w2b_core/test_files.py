"""A file is whole or absent, whatever ends the writer."""

import os
import signal
import subprocess
import sys

import pytest

from w2b_core.files import write_atomically, write_json

#: Writes two contents in turn until it is killed.
WRITER = """
import sys
from pathlib import Path
from w2b_core.files import write_atomically
path = Path(sys.argv[1])
while True:
    for letter in (b'a', b'b'):
        write_atomically(path, letter * 200_000)
        print('.', end='', flush=True)
"""


def test_a_killed_writer_leaves_one_whole_content(tmp_path):
    path = tmp_path / 'file'
    for written in (1, 4, 9):
        writer = subprocess.Popen([sys.executable, '-c', WRITER, str(path)],
                                  stdout=subprocess.PIPE)
        assert len(writer.stdout.read(written)) == written
        writer.send_signal(signal.SIGKILL)
        writer.wait()
        writer.stdout.close()
        content = path.read_bytes()
        assert len(content) == 200_000
        assert len(set(content)) == 1


def test_a_failed_write_leaves_the_old_file_alone(tmp_path, monkeypatch):
    path = tmp_path / 'file'
    write_atomically(path, b'old')

    def fail(*_):
        raise OSError('full')
    monkeypatch.setattr('os.fsync', fail)
    with pytest.raises(OSError, match='full'):
        write_atomically(path, b'new')
    assert [entry.name for entry in tmp_path.iterdir()] == ['file']
    assert path.read_bytes() == b'old'


def test_the_permissions_are_those_of_a_new_file(tmp_path):
    umask = os.umask(0o027)
    try:
        write_atomically(tmp_path / 'file', b'')
    finally:
        os.umask(umask)
    assert (tmp_path / 'file').stat().st_mode & 0o777 == 0o640


def test_the_same_value_gives_the_same_bytes(tmp_path):
    write_json(tmp_path / 'a', {'x': 1, 'a': [2.5]})
    write_json(tmp_path / 'b', {'a': [2.5], 'x': 1})
    assert (tmp_path / 'a').read_bytes() == (tmp_path / 'b').read_bytes()
