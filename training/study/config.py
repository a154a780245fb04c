"""
What a study consists of: bodies x treatments x seeds, read from YAML and checked before a run.

A study is a list of *experiments*; each names a word set (`paper` or `balanced`), bodies,
treatments and seeds. Its *runs* are the product of these. All values have defaults except the
experiments, so a file says only what matters:

    name: small
    generations: 2000
    experiments:
      - {words: paper, bodies: [quadruped], treatments: [experimental, control], seeds: 30}
      - {words: balanced, bodies: [quadruped], treatments: [experimental, control], seeds: 30}

`seeds: 30` means seeds 0 to 29; a larger number later only adds runs.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from training.configuration import (
    STRICT,
    ConfigError,
    Text,
    Truth,
    explain,
    one_line,
    one_of,
    read_yaml,
    some_of,
    whole,
)
from training.evolution.engines import ENGINES, PRECISIONS
from training.evolution.objectives import OBJECTIVES
from training.evolution.treatments import TREATMENTS, WORD_SETS, Words, draw_words
from w2b_core import bodies


@dataclasses.dataclass(frozen=True)
class RunSpec:
    """One run of a study. `evolution_seed` is drawn from everything that names the run."""

    word_set: str
    body: str
    treatment: str
    seed: int

    @property
    def run_id(self) -> str:
        """Name of the run and of its directory."""
        return f'{self.word_set}-{self.body}-{self.treatment}-{self.seed:04d}'

    @property
    def evolution_seed(self) -> int:
        """
        Seed of the run's random numbers, 32 bits.

        Not the study's seed itself: runs of two treatments that shared random numbers would not
        be the independent samples that the Mann-Whitney U test asks for.
        """
        return int.from_bytes(hashlib.sha256(self.run_id.encode()).digest()[:4], 'little')

    def words(self) -> tuple[Words, Words]:
        """
        Return (trained, held out): words with the behaviours they stand for.

        The held-out stop word is drawn from the word set and the study's seed alone, as in the
        original program, where both treatments of one seed hold out the same word.
        """
        return draw_words(self.word_set, self.seed)

    @property
    def held_out(self) -> str:
        """The stop word that this run never hears while it evolves."""
        return self.words()[1][0][0]


@one_line('experiment')
@dataclass(frozen=True, config=STRICT)
class Experiment:
    """Runs that differ in body, treatment and seed only."""

    words: Annotated[str, one_of(lambda: tuple(WORD_SETS))]
    bodies: Annotated[tuple[str, ...], some_of(bodies.names)]
    treatments: Annotated[tuple[str, ...], some_of(lambda: TREATMENTS)]
    seeds: Annotated[int, whole()]
    first_seed: Annotated[int, whole(0)] = 0

    def runs(self) -> list[RunSpec]:
        """Return the runs, seed by seed, so that an early look at a study is a balanced one."""
        return [RunSpec(self.words, body, treatment, seed)
                for seed in range(self.first_seed, self.first_seed + self.seeds)
                for body in self.bodies for treatment in self.treatments]


@one_line('robustness')
@dataclass(frozen=True, config=STRICT)
class Robustness:
    """
    How run champions are scored again.

    Attributes
    ----------
    perturbed_starts
        Slightly different starts in the engine of the evolution, under the run's words.
    pybullet_starts
        Starts in PyBullet, under the run's words.
    pybullet_champions
        Champions an arm that PyBullet scores (the lowest seeds); None: all of them.
    lexicon
        Whether every word of `lexicon.yaml` is tried.

    """

    perturbed_starts: Annotated[int, whole(0)] = 10
    pybullet_starts: Annotated[int, whole(0)] = 1
    pybullet_champions: Annotated[int | None, whole()] = None
    lexicon: Truth = True


def _name(value: object) -> object:
    if isinstance(value, str) and value and not value.replace('-', '').replace('_', '').isalnum():
        raise ValueError(f'expected letters, digits, - and _, got {value!r}')
    return value


def _experiments(value: object) -> object:
    if not isinstance(value, list | tuple) or not value:
        raise ValueError(f'expected a list with at least one experiment, got {value!r}')
    return value


@one_line('the study')
@dataclass(frozen=True, config=STRICT)
class StudyConfig:
    """
    A checked study.

    Attributes
    ----------
    objective
        How a run is scored: `program` (the original's code: path length for stop words), `paper`
        (final distance) or `balanced` (total movement, the paper's text on its balanced set).
    vocabulary
        As `Vocabulary.load` takes it.
    history_points
        Generations an evolutionary run that the store keeps of its fitness history.

    """

    name: Annotated[Text, BeforeValidator(_name)]
    experiments: Annotated[tuple[Experiment, ...], BeforeValidator(_experiments)]
    generations: Annotated[int, whole()] = 6000
    population: Annotated[int, whole(2)] = 50
    objective: Annotated[str, one_of(lambda: tuple(OBJECTIVES))] = 'program'
    engine: Annotated[str, one_of(lambda: ENGINES)] = 'batched'
    precision: Annotated[str, one_of(lambda: PRECISIONS)] = 'float32'
    vocabulary: Text = 'default'
    history_points: Annotated[int, whole(2)] = 200
    robustness: Robustness = Robustness()

    def __post_init__(self) -> None:
        """Check that each run belongs to one experiment (ValueError)."""
        seen: dict[str, int] = {}
        for index, experiment in enumerate(self.experiments):
            for run in experiment.runs():
                if run.run_id in seen:
                    raise ValueError(f'experiments[{index}]: run {run.run_id} is already part of '
                                     f'experiments[{seen[run.run_id]}]; each run belongs to one')
                seen[run.run_id] = index

    def runs(self) -> list[RunSpec]:
        """Return all runs of the study, lowest seeds first."""
        runs = [run for experiment in self.experiments for run in experiment.runs()]
        return sorted(runs, key=lambda run: run.seed)


def load_config(path: Path) -> StudyConfig:
    """
    Return the study in a YAML file.

    Raises
    ------
    ConfigError
        One line with the file, the field, what was expected and what came.

    """
    try:
        content = path.read_text(encoding='utf-8')
    except FileNotFoundError:
        raise ConfigError(f'{path}: no such file; ready configurations are in '
                          f'{Path(__file__).parent.parent / "configs"}') from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: cannot be read as UTF-8 text ({error})') from None
    try:
        return parse_config(read_yaml(content))
    except ConfigError as error:
        raise ConfigError(f'{path}: {error}') from None


def parse_config(data: object) -> StudyConfig:
    """Return the study described by plain data, as from YAML (ConfigError if it is none)."""
    try:
        config: StudyConfig = TypeAdapter[Any](StudyConfig).validate_python(data)
    except ValidationError as error:
        raise ConfigError(explain(error, StudyConfig, 'the study')) from None
    if config.engine != 'pybullet':
        return config
    if isinstance(data, Mapping) and data.get('precision') == 'float32':
        raise ConfigError('precision: PyBullet computes in double precision only; '
                          'leave `precision` out or choose engine: batched')
    return replace(config, precision='float64')
