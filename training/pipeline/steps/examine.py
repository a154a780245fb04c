"""Examine: the final table, the blind look under held-out words, and the champion's files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from training.evolution.treatments import Words
from training.pipeline import blind, record, trials
from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate
from training.pipeline.parts import Examine
from training.pipeline.table import passes, to_json, to_markdown


def run(part: Examine, bench: Bench, candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """
    Return the champion, if it obeys every trained word and every held-out stop word.

    Candidates are tried in their order. If none obeys every trained word, nothing is chosen, no
    held-out word is looked up, and only the tables of what failed are reported.
    """
    roles = bench.recipe.words
    with bench.trials(directory, part.starts, part.seed) as trial:
        for candidate in candidates:
            table = trial(candidate.controller, roles.trained, roles.validation)
            if passes(table):
                break
            bench.say(f'{candidate} fails\n{to_markdown(table)}')
        else:
            bench.say(f'no candidate of {len(candidates)} obeys every trained word; nothing was '
                      'chosen and no held-out word asked')
            return []
    network, world = candidate.controller, bench.recipe.world
    unheard, opened = blind.look(directory, network, bench.body, world, roles.held_out,
                                 bench.vocabulary, move_m=bench.recipe.move_m, starts=part.starts,
                                 seed=part.seed, processes=bench.threads)
    table += unheard
    later = trials.later(network, bench.body, world, roles.trained, bench.vectors,
                         seconds=part.later_s, starts=part.later_starts, processes=bench.threads)
    champion = record.Champion(bench.recipe, candidate, table, opened, later)
    record.write(directory, champion, bench.vocabulary, _cut(part, bench, candidate, directory))
    bench.say(f'{to_markdown(table)}\ncandidates that were asked held-out words, this one '
              f'included: {opened}')
    return [replace(candidate, table=table)] if passes(table) else []


def _cut(part: Examine, bench: Bench, candidate: Candidate, directory: Path) -> dict[str, Any]:
    """Return what the candidate does when its sensors' synapses are cut, if that is asked for."""
    if part.cut_starts is None:
        return {}
    network = candidate.controller
    hidden = network.hidden_weights.copy()
    hidden[:, network.hidden_count + 1:] = 0.0
    with bench.trials(directory, part.cut_starts, part.seed) as trial:
        table = trial(replace(network, hidden_weights=hidden), _first(bench.recipe.words.trained),
                      ())
    return {'touch_cut': to_json(table)}


def _first(words: Words) -> Words:
    """Return the first word of each behaviour."""
    first: dict[str, tuple[str, str]] = {}
    for pair in words:
        first.setdefault(pair[1], pair)
    return tuple(first.values())
