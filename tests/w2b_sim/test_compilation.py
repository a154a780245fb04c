"""Compiling is announced when it happens: also in another copy of the sources, and a newer one."""

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from w2b_sim.engines.batched import compilation, kernel
from w2b_sim.engines.batched.layout import Layout


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Return a function that makes a first call with a layout, and returns what it said."""
    monkeypatch.setattr(compilation, 'cache_folder', lambda: tmp_path)
    layout = SimpleNamespace(links=5, bits=32, lanes=8)

    def call(source=kernel.__file__):
        monkeypatch.setattr(compilation, '_compiled', set())
        monkeypatch.setattr(compilation, 'kernel', SimpleNamespace(__file__=str(source)))
        lines = []
        with compilation.announced(_hashable(layout), lines.append):
            assert len(lines) <= 1, 'before the call'
        return lines
    return call


def _hashable(layout) -> Layout:
    return type('Layout', (), {**vars(layout), '__repr__': lambda self: 'a layout'})()


def test_it_is_said_once_in_a_copy_of_the_sources(said):
    assert 'compiling the batched engine once for 5 links' in said()[0]
    assert said() == []


def test_another_copy_of_the_sources_and_a_newer_file_are_compiled_and_said(said, tmp_path):
    assert said()
    copy = tmp_path / 'other' / 'kernel.py'
    copy.parent.mkdir()
    shutil.copy(kernel.__file__, copy)
    assert said(copy)
    assert said(copy) == []
    os.utime(copy, (1, 1))
    assert said(copy)
    assert Path(copy).exists()


def test_without_a_listener_it_is_said_in_the_log(monkeypatch, tmp_path, caplog):
    monkeypatch.setattr(compilation, 'cache_folder', lambda: tmp_path)
    monkeypatch.setattr(compilation, '_compiled', set())
    layout = _hashable(SimpleNamespace(links=5, bits=32, lanes=8))
    with caplog.at_level('WARNING'), compilation.announced(layout, None):
        assert 'compiling' in caplog.text
