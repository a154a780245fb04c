"""
Put an ear and legs together: a controller file for `brain` and `sim`.

    python -m training assemble out/legs_twin --ear out/ear.json --out out/twin.json
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from training import carried_body
from w2b_core import bodies
from w2b_core.behaviours import course_of
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller, Motor
from w2b_core.hearing.ear import Ear
from w2b_core.json_fields import JsonFileError
from w2b_core.network.leaky import BLOCKS, LeakyNetwork
from w2b_sim.worlds import WORLDS


class AssemblyError(ValueError):
    """Legs and ear cannot be put together; the message says why and what to do."""


def load_legs(directory: Path) -> tuple[LeakyNetwork, dict[str, Any]]:
    """Return the champion's network and record of a run's directory (AssemblyError)."""
    try:
        record = json.loads((directory / 'champion.json').read_text(encoding='utf-8'))
        with np.load(directory / 'champion.npz', allow_pickle=False) as file:
            network = LeakyNetwork(**{block.name: file[block.name] for block in BLOCKS})
    except (OSError, ValueError, KeyError) as error:
        raise AssemblyError(f'{directory}: no finished legs ({error}); run '
                            f'`python -m training legs RECIPE --out {directory}` to the end'
                            ) from None
    return network, record


def assemble(directory: Path, ear: Ear) -> Controller:
    """Return the controller of a run's champion with an ear (AssemblyError)."""
    network, record = load_legs(directory)
    behaviours = tuple(record['behaviours'])
    if ear.behaviours != behaviours:
        raise AssemblyError(f'ear: expected one for the legs\' behaviours {", ".join(behaviours)}, '
                            f'got {", ".join(ear.behaviours)}; train it with --behaviours')
    carried = directory / carried_body.BODY
    body = bodies.get(str(carried) if carried.is_file() else record['body'])
    return Controller(
        body=body.name, network=network, sensors=tuple(record['senses']),
        motors=tuple(Motor(joint.name, joint.lower_rad, joint.upper_rad, 1.0)
                     for joint in body.joints),
        period_s=WORLDS[body.world].control_period_s, words=(), record={'legs': record},
        vector_length=ear.vector_length, behaviours=behaviours,
        courses=tuple(course_of(behaviour) for behaviour in behaviours), ear=ear,
        carried=bodies.to_carry(body))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add this command's options."""
    parser.add_argument('legs', type=Path, help='directory of `python -m training legs`')
    parser.add_argument('--ear', type=Path, required=True, help='file of `python -m training ear`')
    parser.add_argument('--out', type=Path, required=True, help='controller file to write')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    try:
        ear = Ear.from_json(json.loads(args.ear.read_text(encoding='utf-8')))
        controller_file.save(assemble(args.legs, ear), args.out)
    except (AssemblyError, JsonFileError, OSError, ValueError) as error:
        print(f'assemble: {error}', file=sys.stderr)
        return 1
    print(args.out)
    return 0
