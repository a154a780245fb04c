"""
Run a recipe: its steps one after the other, each from what the one before returned.

The directory holds what each step returned (`steps/`), the seeds' evolutions, the trials, and the
champion's files. It is safe to kill at any moment, and goes on where it was. Held-out words are not
even looked up before the last step, and no controller enters from outside the directory.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from training import carried_body
from training.evolution.rundir import RunDirectory
from training.evolution.treatments import vector_hash
from training.pipeline import candidates as kept
from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate
from training.pipeline.recipe import Recipe
from training.pipeline.steps import choose, evolve, examine, gate, pretrain
from w2b_core import __version__
from w2b_core.vocabulary import Vocabulary

Run = Callable[[Any, Bench, Sequence[Candidate], Path], list[Candidate]]
#: Kind of step -> what runs it.
STEPS: dict[str, Run] = {'pretrain': pretrain.run, 'evolve': evolve.run, 'gate': gate.run,
                         'choose': choose.run, 'examine': examine.run}


def run(recipe: Recipe, directory: Path, *, threads: int = 1,
        say: Callable[[str], None] = print) -> list[Candidate]:
    """
    Run a recipe in `directory`, or go on with it there; return the champion, or nothing.

    More seeds, and other gates, may be asked for in the same directory; other words or another
    training may not.

    Raises
    ------
    RunConflictError, CheckpointError
        If the directory belongs to another recipe, or a file in it is damaged.
    ValueError
        If a word is not in the vocabulary, or pretraining finds nothing.

    """
    vocabulary = Vocabulary.load(recipe.vocabulary)
    vectors = {word: vocabulary.vector(word) for word, _behaviour in recipe.words.known}
    said = recipe.model_dump(mode='json')
    identity = {'config': {name: said[name] for name in ('body', 'words', 'move_m', 'training')},
                **carried_body.identity(recipe.body),
                'program_version': __version__,
                'vectors': {word: vector_hash(vector) for word, vector in vectors.items()}}
    candidates: list[Candidate] = []
    with RunDirectory(directory, identity, may_grow=()) as place:
        # What is trained stays the same though its file be edited.
        kept_body = carried_body.keep(recipe.body, place.path)
        bench = Bench(recipe.model_copy(update={'body': kept_body}), vocabulary, vectors, threads,
                      say)
        for number, part in enumerate(recipe.steps):
            path = place.path / 'steps' / f'{number}_{part.name}.npz'
            key = _key(said, number)
            found = kept.load(path, key)
            if found is None:
                found = STEPS[part.step](part, bench, candidates, place.path)
                kept.save(path, found, key)
            if not found:
                say(f'{part.name}: nothing goes on')
                return []
            candidates = found
    return candidates


def _key(recipe: dict[str, Any], number: int) -> str:
    """Return the hash of all that decides what a step returns."""
    text = json.dumps({**recipe, 'steps': recipe['steps'][:number + 1]}, sort_keys=True)
    return sha256(text.encode()).hexdigest()
