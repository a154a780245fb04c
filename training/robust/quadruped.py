"""The quadruped's champion: chosen by its lineage, looked at blind, and written with its tables."""

from __future__ import annotations

from pathlib import Path

from training.robust import blind, gate, lineage, record
from training.robust.lineage import Lineage
from training.robust.word_roles import QUADRUPED
from w2b_core.vocabulary import Vocabulary

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
    config = lineage.config_of(BODY, candidate.seed, QUADRUPED, vocabulary, effort)
    made = record.Champion(config, candidate.network, candidate.fitness, table, opened,
                           line.later(candidate))
    record.write(directory, made, QUADRUPED, words,
                 {'touch_cut': gate.to_json(line.numb(candidate))})
    print(f'{gate.to_markdown(table)}\ncandidates that were asked held-out words, this one '
          f'included: {opened}')
    return gate.passes(table)
