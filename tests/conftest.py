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


#: Folders and files of tests that measure how soon something happens, or how long it takes.
REALTIME = ('faults', 'ros/test_footprint.py', 'ros/test_hardware.py', 'ros/test_listen.py',
            'ros/test_page.py', 'ros/test_page_robot.py', 'w2b_hw/test_io_thread.py',
            'w2b_hw/test_kernel_path.py', 'w2b_web/test_lost_page.py', 'w2b_web/test_talk.py')


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of `REALTIME`: beside others on the same processors they would be late."""
    places = [ROOT / 'tests' / name for name in REALTIME]
    for item in items:
        if any(item.path.is_relative_to(place) for place in places):
            item.add_marker('realtime')


@pytest.fixture(scope='session')
def shared() -> Path:
    """The folder of reference material beside a developer's checkout; skips where it is absent."""
    path = ROOT.parent / 'shared'
    if not (path / 'reference').is_dir():
        pytest.skip('no ../shared/reference: the recorded reference is not part of the repository')
    return path
