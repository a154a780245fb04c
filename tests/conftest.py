"""Fixtures that several packages' tests share."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope='session')
def shared() -> Path:
    """The folder of reference material beside a developer's checkout; skips where it is absent."""
    path = ROOT.parent / 'shared'
    if not (path / 'reference').is_dir():
        pytest.skip('no ../shared/reference: the recorded reference is not part of the repository')
    return path
