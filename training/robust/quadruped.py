"""The quadruped's champion: chosen by its lineage, looked at blind, and written with its tables."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution import checkpoint
from training.evolution.champion import WordOutcome, write_champion
from training.robust import blind, gate, lineage
from training.robust.lineage import Candidate, Lineage
from training.robust.word_roles import QUADRUPED
from w2b_controller import __version__
from w2b_controller.vocabulary import Vocabulary

BODY, MOVE_M = 'quadruped', 0.5


def champion(directory: Path, *, ear_seeds: int, seeds: list[int], keep: int, vocabulary: str,
             threads: int, effort: float) -> bool:
    """
    Make the champion in `directory` (champion.json, champion.md, table.json, blind.json).

    Returns whether it obeys every trained word and every held-out stop word. If no candidate obeys
    every trained word from `gate.STARTS` starts, nothing is chosen, no held-out word is looked up,
    and only the tables of what failed are printed.
    """
    words = Vocabulary.load(vocabulary)
    vectors = {word: words.vector(word) for word, _asked in QUADRUPED.trained
               + QUADRUPED.validation}
    line = Lineage(directory, BODY, QUADRUPED, vocabulary, vectors, MOVE_M, threads=threads,
                   effort=effort, say=lambda text: print(text, flush=True))
    candidates = line.evolve(ear_seeds, seeds, keep)
    for candidate in candidates:
        if not gate.passes(candidate.table):
            continue
        table = line.final(candidate)
        if gate.passes(table):
            break
        print(f'touch {candidate.seed}, candidate {candidate.rank}: fails\n'
              f'{gate.to_markdown(table)}', flush=True)
    else:
        print(f'no candidate of {len(candidates)} obeys every trained word; nothing was chosen '
              'and no held-out word asked')
        return False
    unheard, opened = blind.look(directory, candidate.network, line.body, line.world,
                                 QUADRUPED.held_out, words, move_m=MOVE_M,
                                 seed=lineage.FINAL_GATE, processes=threads)
    table += unheard
    _write(directory, line, candidate, table, opened, words)
    print(f'{gate.to_markdown(table)}\ncandidates that were asked held-out words, this one '
          f'included: {opened}')
    return gate.passes(table)


def _write(directory: Path, line: Lineage, candidate: Candidate, table: tuple[gate.Row, ...],
           opened: int, words: Vocabulary) -> None:
    """Write the champion's controller file and tables."""
    config = lineage.config_of(BODY, candidate.seed, QUADRUPED, line.vocabulary, line.effort)
    judged = [WordOutcome(row.word, row.behaviour, row.trained, gate.score(row), (), (), ())
              for row in table]
    record: dict[str, Any] = {
        'mode': 'robust', 'engine': 'batched', 'precision': 'float32', 'world': line.world.name,
        'objective': 'robust', 'seed': candidate.seed, 'fitness': candidate.fitness,
        'program_version': __version__,
        'words': {role: [list(pair) for pair in pairs]
                  for role, pairs in asdict(QUADRUPED).items()},
        'opened': opened, 'weights_sha256': blind.weights_sha256(candidate.network),
        'config': config.to_json(),
        'gate': {'engine': 'pybullet', 'starts': gate.STARTS, 'rows': gate.to_json(table)}}
    heard = np.array([words.vector(row.word) for row in table])
    write_champion(directory / 'champion.json', line.body, line.world, candidate.network, judged,
                   heard, record)
    checkpoint.write_json(directory / 'table.json', {
        'body': BODY, 'world': line.world.name, 'seed': candidate.seed, 'starts': gate.STARTS,
        'opened': opened, 'passed': gate.passes(table), 'rows': gate.to_json(table),
        'touch_cut': gate.to_json(line.numb(candidate))})
    checkpoint.write_atomically(directory / 'champion.md', gate.to_markdown(table).encode())
