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

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from training.evolution.engines import ENGINES, PRECISIONS
from training.evolution.objectives import OBJECTIVES
from training.evolution.treatments import TREATMENTS, WORD_SETS, Words, draw_words
from training.study.fields import (
    ConfigError,
    choice,
    choices,
    count,
    mapping,
    read_yaml,
    require,
    text,
)
from w2b_core import bodies


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Experiment:
    """Runs that differ in body, treatment and seed only."""

    words: str
    bodies: tuple[str, ...]
    treatments: tuple[str, ...]
    seeds: int
    first_seed: int = 0

    def runs(self) -> list[RunSpec]:
        """Return the runs, seed by seed, so that an early look at a study is a balanced one."""
        return [RunSpec(self.words, body, treatment, seed)
                for seed in range(self.first_seed, self.first_seed + self.seeds)
                for body in self.bodies for treatment in self.treatments]


@dataclass(frozen=True)
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

    perturbed_starts: int = 10
    pybullet_starts: int = 1
    pybullet_champions: int | None = None
    lexicon: bool = True


@dataclass(frozen=True)
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

    name: str
    experiments: tuple[Experiment, ...]
    generations: int = 6000
    population: int = 50
    objective: str = 'program'
    engine: str = 'batched'
    precision: str = 'float32'
    vocabulary: str = 'default'
    history_points: int = 200
    robustness: Robustness = field(default_factory=Robustness)

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
    top = mapping(data, 'the study', StudyConfig)
    require(top, 'the study', 'name', 'experiments')
    name = text(top['name'], 'name')
    if not name.replace('-', '').replace('_', '').isalnum():
        raise ConfigError(f'name: expected letters, digits, - and _, got {name!r}')
    if not isinstance(top['experiments'], list) or not top['experiments']:
        raise ConfigError('experiments: expected a list with at least one experiment, '
                          f'got {top["experiments"]!r}')
    experiments = tuple(_experiment(entry, f'experiments[{index}]')
                        for index, entry in enumerate(top['experiments']))
    config = StudyConfig(
        name=name, experiments=experiments,
        generations=count(top.get('generations', 6000), 'generations'),
        population=count(top.get('population', 50), 'population', least=2),
        objective=choice(top.get('objective', 'program'), 'objective', tuple(OBJECTIVES)),
        engine=choice(top.get('engine', 'batched'), 'engine', ENGINES),
        precision=choice(top.get('precision', 'float32'), 'precision', PRECISIONS),
        vocabulary=text(top.get('vocabulary', 'default'), 'vocabulary'),
        history_points=count(top.get('history_points', 200), 'history_points', least=2),
        robustness=_robustness(top.get('robustness', {})))
    if config.engine == 'pybullet' and 'precision' in top and config.precision == 'float32':
        raise ConfigError('precision: PyBullet computes in double precision only; '
                          'leave `precision` out or choose engine: batched')
    if config.engine == 'pybullet':
        config = StudyConfig(**{**vars(config), 'precision': 'float64'})
    seen: dict[str, int] = {}
    for index, experiment in enumerate(experiments):
        for run in experiment.runs():
            if run.run_id in seen:
                raise ConfigError(f'experiments[{index}]: run {run.run_id} is already part of '
                                  f'experiments[{seen[run.run_id]}]; each run belongs to one')
            seen[run.run_id] = index
    return config


def _experiment(data: object, where: str) -> Experiment:
    entry = mapping(data, where, Experiment)
    require(entry, where, 'words', 'bodies', 'treatments', 'seeds')
    return Experiment(
        words=choice(entry['words'], f'{where}.words', tuple(WORD_SETS)),
        bodies=choices(entry['bodies'], f'{where}.bodies', bodies.names()),
        treatments=choices(entry['treatments'], f'{where}.treatments', TREATMENTS),
        seeds=count(entry['seeds'], f'{where}.seeds'),
        first_seed=count(entry.get('first_seed', 0), f'{where}.first_seed', least=0))


def _robustness(data: object) -> Robustness:
    entry = mapping(data, 'robustness', Robustness)
    champions = entry.get('pybullet_champions')
    lexicon = entry.get('lexicon', True)
    if not isinstance(lexicon, bool):
        raise ConfigError(f'robustness.lexicon: expected true or false, got {lexicon!r}')
    where = 'robustness.'
    return Robustness(
        perturbed_starts=count(entry.get('perturbed_starts', 10), where + 'perturbed_starts', 0),
        pybullet_starts=count(entry.get('pybullet_starts', 1), where + 'pybullet_starts', 0),
        pybullet_champions=None if champions is None else count(
            champions, where + 'pybullet_champions'),
        lexicon=lexicon)
