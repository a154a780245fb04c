"""
Under how many of all words does a controller rest? What a stop word proves depends on it.

  python -m training rest quadruped_serial

Primes the controller's hidden layer, without a body, with every word of a vocabulary (of the
default one, those with the source's own vectors), and counts the words under which it comes to
rest, with silent touch sensors and with all feet on the floor. A controller that rests under most
words stands still under most held-out stop words by chance.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from numpy.typing import NDArray

from training.evolution.operators import Array
from training.robust.hidden_life import live
from training.robust.settings import Screening
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('controller', help='file or shipped name')
    parser.add_argument('--vocabulary', default='default', help='name or file of the word vectors')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        network = controller_file.load(controller_file.resolve(args.controller)).serial
        vocabulary = Vocabulary.load(args.vocabulary)
        signals = np.array([vocabulary.vector(word) for word in vocabulary.exact_words])
    except (ValueError, OSError) as error:
        print(f'rest: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{args.controller}: at rest under {rests(network, signals, 0.0).mean():.1%} of '
          f'{len(signals):,} words with silent touch sensors, under '
          f'{rests(network, signals, 1.0).mean():.1%} with all feet on the floor')
    return 0


def rests(network: Network, signals: Array, touch: float) -> NDArray[np.bool_]:
    """Return whether a network rests under signals (R, T) while every sensor reads `touch`."""
    bias = touch * network.hidden_weights[:, network.hidden_count + 1:].sum(axis=1)
    life = live(network.hidden_weights[None], signals, np.tile(bias, (len(signals), 1)))
    still: NDArray[np.bool_] = np.sqrt((life.swing[0]**2).mean(axis=-1)) < Screening.rest
    return still
