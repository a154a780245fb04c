"""Readers of the recorded reference, for tests of several packages."""

from pathlib import Path

import numpy as np

BODIES = ('quadruped', 'minimal', 'spherical_1dof_sensors', 'spherical_1dof_blind',
          'spherical_2dof_sensors', 'spherical_2dof_blind')


def word_vectors(shared: Path) -> dict[str, np.ndarray]:
    """Return the reference's vectors (300,), not normalised, by word."""
    lines = (shared / 'reference' / 'google_news_word_vectors.txt').read_text().splitlines()[1:]
    return {word: np.array(rest.split(), dtype=float)
            for word, rest in (line.split(' ', 1) for line in lines)}


def traces(shared: Path) -> dict[str, np.ndarray]:
    """Return the recorded evaluations by key."""
    with np.load(shared / 'reference' / 'pyrosim_traces.npz') as file:
        return dict(file)
