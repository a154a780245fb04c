"""
A robot's champion: legs by a recipe, an ear, the gate in both engines; a controller that ships.

The directory then has `legs/` (the training), `gate.json` (what both engines saw) and, if nothing
refuses it, `champion.json`, a controller file that carries its body, and `champion.md`. It is safe
to kill at any moment, and goes on where it was.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from training.evolution.checkpoint import write_atomically, write_json
from training.legs import gate
from training.legs.assemble import assemble, load_legs
from training.legs.recipe import Recipe
from training.legs.run import train
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller
from w2b_core.hearing.ear import Ear

#: What any four-legged body is trained by, and the ear for its behaviours.
OWN_ROBOT = Path(__file__).parents[1] / 'recipes' / 'own_robot.yaml'
EAR = Path(__file__).parents[1] / 'grounding' / 'ear.json'


def shortened(recipe: Recipe, effort: float) -> Recipe:
    """Return the recipe with all generations times `effort`, at least one each."""
    return recipe.model_copy(update={'stages': tuple(
        stage.model_copy(update={'generations': max(1, round(stage.generations * effort))})
        for stage in recipe.stages)})


def make(recipe: Recipe, directory: Path, *, workers: int = 1, starts: int = gate.STARTS,
         seconds: float = gate.SECONDS, say: Callable[[str], None] = print) -> bool:
    """
    Train a recipe's legs, judge them, and write the controller; return whether it ships.

    Raises
    ------
    RunConflictError, CheckpointError, NoChampionError
        As `run.train` raises them.
    AssemblyError
        If the ear is not one for the recipe's behaviours.

    """
    train(recipe, directory / 'legs', workers=workers, report=say)
    controller = assemble(directory / 'legs',
                          Ear.from_json(json.loads(EAR.read_text(encoding='utf-8'))))
    _network, record = load_legs(directory / 'legs')
    judged = _judged(controller, directory, starts, seconds, workers, say)
    refused = gate.refusals(record['examination']['behaviours'], judged, seconds=seconds)
    missed = gate.misses(judged)
    write_json(directory / 'gate.json', {'key': _key(controller, starts, seconds),
                                         'judged': judged, 'refused': refused, 'misses': missed})
    say(gate.table(judged))
    for line in missed:
        say(f'misses: {line}')
    champion, page = directory / 'champion.json', directory / 'champion.md'
    if refused:
        champion.unlink(missing_ok=True)
        page.unlink(missing_ok=True)
        for line in refused:
            say(f'refused: {line}')
        say(f'{directory}: does not ship; look at the description (`w2b robot check`), then try '
            'more seeds')
        return False
    write_atomically(page, f'{gate.table(judged)}\n'.encode())
    controller_file.save(controller, champion)
    say(str(champion))
    return True


def _judged(controller: Controller, directory: Path, starts: int, seconds: float, workers: int,
            say: Callable[[str], None]) -> dict[str, dict[str, Any]]:
    """Return what the engines see, kept from an earlier call if it is of this controller."""
    path = directory / 'gate.json'
    if path.exists():
        kept: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        if kept.get('key') == _key(controller, starts, seconds):
            judged: dict[str, dict[str, Any]] = kept['judged']
            return judged
    say(f'gate: {starts} starts of {seconds:g} s in both engines')
    return gate.seen(controller, starts=starts, seconds=seconds, processes=workers)


def _key(controller: Controller, starts: int, seconds: float) -> str:
    """Return the hash of all that decides what the engines see."""
    text = controller_file.dumps(controller) + f' {starts} {seconds}'
    return sha256(text.encode()).hexdigest()
