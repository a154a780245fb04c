"""Fixtures that several packages' tests share."""

import os
import signal
from pathlib import Path

import pytest

# As `python -m training` has it, and before numpy is imported.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
# A shell starts background jobs with SIGINT ignored, and children inherit that: without this, the
# processes under test could not be interrupted when the tests themselves run in the background.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope='session')
def shared() -> Path:
    """The folder of reference material beside a developer's checkout; skips where it is absent."""
    path = ROOT.parent / 'shared'
    if not (path / 'reference').is_dir():
        pytest.skip('no ../shared/reference: the recorded reference is not part of the repository')
    return path
