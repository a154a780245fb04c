"""Evolve: stages of each seed's evolution in drawn worlds; what earns too little is dropped."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

from training.evolution import checkpoint
from training.pipeline import candidates as kept
from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate, by_seed, population
from training.pipeline.parts import Evolve
from training.robust.search import train


def run(part: Evolve, bench: Bench, candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """Return the populations of the seeds of `candidates`, each best first."""
    return [one for seed in by_seed(candidates)
            for one in _evolved(part, bench, seed, directory_of(directory, seed))]


def directory_of(directory: Path, seed: int) -> Path:
    """Return where the evolution of a seed is kept."""
    return directory / f'seed_{seed:04d}'


def _evolved(part: Evolve, bench: Bench, seed: int, directory: Path) -> list[Candidate]:
    """Return a seed's population after the step; none if it was discarded."""
    from training.evolution.progress import progress_bar

    # Both are kept, as a run that has gone on cannot tell any more how it did before.
    path, earned_path = directory / f'{part.name}.npz', directory / f'{part.name}.json'
    key = _key(part, bench)
    found = kept.load(path, key)
    if found is not None:
        return found
    config, last = bench.recipe.config(seed), len(bench.recipe.stages(part))
    earned: list[float] = (json.loads(earned_path.read_text(encoding='utf-8'))['fitness']
                           if earned_path.exists() else [])
    found = []
    for number in range(len(part.stages)):
        until = last - len(part.stages) + number + 1
        if number >= len(earned) or until == last:
            total = sum(stage.generations for stage in config.stages[:until])
            with progress_bar(total, f'{config.body} seed {seed}') as shown:
                networks, fitness = train(config, directory, shown, threads=bench.threads,
                                          vectors=bench.vectors, stages=until)
            found = population(seed, networks, fitness)
            earned = [*earned[:number], found[0].fitness]
            checkpoint.write_json(earned_path, {'fitness': earned})
        if number < len(part.discard_below) and earned[number] < part.discard_below[number]:
            bench.say(f'{part.name}, seed {seed}: fitness {earned[number]:.2f} after stage '
                      f'{number + 1}, discarded')
            found = []
            break
    else:
        bench.say(f'{part.name}, seed {seed}: fitness {found[0].fitness:.2f}')
    kept.save(path, found, key)
    return found


def _key(part: Evolve, bench: Bench) -> str:
    """Return the hash of the stages up to the end of the step: other ones are another evolution."""
    stages = [asdict(stage) for stage in bench.recipe.stages(part)]
    return sha256(json.dumps(stages, sort_keys=True).encode()).hexdigest()
