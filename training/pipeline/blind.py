"""
The blind look: a chosen controller meets the held-out words once, and every look is counted.

What a controller does under words that it has never heard means something only if those words did
not choose it. So they are looked up here and nowhere else, after the choice, and `blind.json`
in the champion's directory keeps each controller that was ever looked at: its weights' hash, its
rows, and thereby how many were opened. A second look at the same weights returns what the first
one saw.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from training.evolution import checkpoint
from training.evolution.treatments import Words
from training.pipeline import trials
from training.pipeline.table import Row, from_json, to_json
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.worlds import World

FILE = 'blind.json'


def look(directory: Path, network: Network, body: Body, world: World, held_out: Words,
         vocabulary: Vocabulary, *, move_m: float, starts: int, seed: int = 0,
         processes: int = 1) -> tuple[tuple[Row, ...], int]:
    """
    Return the held-out words' rows of one controller, and how many were opened up to it.

    Parameters
    ----------
    directory
        Of the champion; the openings are counted there.
    network, body, world
        What is looked at, and where.
    held_out
        (word, behaviour) pairs; stop words are required, moves are reported.
    vocabulary
        Has their vectors.
    move_m, starts, seed, processes
        As `trials.trial`.

    Raises
    ------
    ValueError
        If the record of openings cannot be read: then nothing says whether this look is the first.

    """
    path = directory / FILE
    openings = _openings(path)
    asked = [list(pair) for pair in held_out]
    key = {'weights_sha256': trials.weights_sha256(network), 'words': asked, 'starts': starts,
           'seed': seed}
    for number, opening in enumerate(openings, 1):
        if {name: opening[name] for name in key} == key:
            return from_json(opening['rows']), number
    vectors = {word: vocabulary.vector(word) for word, _asked in held_out}
    rows = trials.trial(network, body, world, (), held_out, vectors, move_m=move_m, starts=starts,
                        seed=seed, processes=processes)
    openings.append({**key, 'rows': to_json(rows)})
    checkpoint.write_json(path, {'openings': openings})
    return rows, len(openings)


def _openings(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    try:
        openings: list[dict[str, Any]] = json.loads(path.read_text(encoding='utf-8'))['openings']
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f'{path}: not a readable record of openings ({error}); restore it, or '
                         'begin in another directory') from None
    return openings
