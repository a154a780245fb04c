"""Compiling is announced when it happens, and happens once for all copies of the sources."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from w2b_sim.engines.batched import compilation
from w2b_sim.engines.batched.layout import Layout


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Return a function that makes a first call with a layout, and returns what it said."""
    monkeypatch.setattr(compilation, 'cache_folder', lambda: tmp_path)
    layout = SimpleNamespace(links=5, bits=32, lanes=8)

    def call():
        monkeypatch.setattr(compilation, '_compiled', set())
        lines = []
        with compilation.announced(_hashable(layout), lines.append):
            assert len(lines) <= 1, 'before the call'
        return lines
    return call


def _hashable(layout) -> Layout:
    return type('Layout', (), {**vars(layout), '__repr__': lambda self: 'a layout'})()


def test_it_is_said_once(said):
    assert 'compiling the batched engine once for 5 links' in said()[0]
    assert said() == []


SCRIPT = """
import sys
from w2b_sim.engines.batched import compilation
sys.path.insert(0, sys.argv[1])
import small
dispatcher = compilation._compiled_call(small.double)
assert dispatcher(2) == 4
print(*dispatcher.stats.cache_hits or ['compiled'])
"""


def test_another_copy_of_the_sources_takes_the_code_that_is_kept(tmp_path):
    """The same file in another folder and of another date: not compiled again; a changed one is."""
    def first_call(folder, text):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / 'small.py').write_text(text)
        done = subprocess.run([sys.executable, '-c', SCRIPT, str(tmp_path / folder)], text=True,
                              env={**os.environ, 'W2B_CACHE_DIR': str(tmp_path / 'cache')},
                              capture_output=True, check=True)
        return done.stdout.strip()
    text = 'def double(x):\n    return 2 * x\n'
    assert first_call('here', text) == 'compiled'
    assert first_call('there', text) == '(int64,)'
    assert first_call('changed', text.replace('2 * x', 'x + x')) == 'compiled'


def test_without_a_listener_it_is_said_in_the_log(monkeypatch, tmp_path, caplog):
    monkeypatch.setattr(compilation, 'cache_folder', lambda: tmp_path)
    monkeypatch.setattr(compilation, '_compiled', set())
    layout = _hashable(SimpleNamespace(links=5, bits=32, lanes=8))
    with caplog.at_level('WARNING'), compilation.announced(layout, None):
        assert 'compiling' in caplog.text
