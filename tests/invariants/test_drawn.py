"""Training in drawn worlds stays, to the bit: hashes taken at 2199f48, before the recipes."""

import json
from pathlib import Path

import pytest

from tests.invariants import drawn, fixed

HASHES = json.loads(fixed.TABLE.read_text())


@pytest.fixture(scope='module')
def arithmetic() -> None:
    """Skip where compiled hidden layers round otherwise: they are built with fast arithmetic."""
    if drawn.arithmetic() != HASHES["hidden layers' arithmetic"]:
        pytest.skip('compiled hidden layers, or numpy, round otherwise on this processor than on '
                    'the one where the table was made')


@pytest.mark.usefixtures('arithmetic')
@pytest.mark.parametrize(('body', 'stops'), [
    ('quadruped', ()), ('quadruped', (3, 6)), ('physical_twin', (2, 4))])
def test_a_run_in_drawn_worlds_stopped_or_not(body: str, stops: tuple[int, ...],
                                              tmp_path: Path) -> None:
    assert drawn.run(body, tmp_path / 'run', stops) == HASHES[f'drawn worlds {body}']


@pytest.mark.usefixtures('arithmetic')
def test_ears() -> None:
    assert drawn.ears() == HASHES['ears']
