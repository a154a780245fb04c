"""What hearing gives a network: the seam between ears and legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Heard:
    """
    A command as a network hears it; exactly one of the two is given.

    Attributes
    ----------
    signal: shape (T,)
        Vectors of the words, one after the other: what a serial network is primed with
        ("Word2vec to behavior", IROS 2019, section II-D).
    command: shape (K,)
        Share of each behaviour of the controller, 0 to 1: what drives a leaky network at every
        step until the next command.

    """

    signal: Array | None = None
    command: Array | None = None

    def __post_init__(self) -> None:
        """Check that it is one or the other (ValueError)."""
        if (self.signal is None) == (self.command is None):
            raise ValueError('Heard: expected a signal or a command, got '
                             f'{"neither" if self.signal is None else "both"}')
