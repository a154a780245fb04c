"""What a run is: everything that decides its champion, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from training.evolution.engines import ENGINES, PRECISIONS
from training.evolution.objectives import AGGREGATES, OBJECTIVES
from training.evolution.treatments import TREATMENTS, Words
from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.vocabulary.text import folded
from w2b_sim.worlds import WORLDS


def check_each_once(words: Iterable[str], spelt: Callable[[str], str] = folded) -> None:
    """
    Raise ValueError if two of `words` are one word, by default but for case and punctuation.

    A held-out word that is trained under another spelling would not be held out.
    """
    seen: dict[str, str] = {}
    for word in words:
        one = spelt(word)
        if one in seen:
            other = 'more than once' if seen[one] == word else f'and {seen[one]!r}: one word'
            raise ValueError(f'words: expected each once, got {word!r} {other}')
        seen[one] = word


@dataclass(frozen=True)
class RunConfig:
    """
    The configuration of one evolutionary run.

    The number of threads and the checkpoint interval are no part of it: they change no result.

    Attributes
    ----------
    body
        Name of a registered body, or a file that describes one.
    seed
        Everything random follows from it.
    words, held_out
        (word, behaviour) pairs to train on, and pairs that only the champion is judged under.
    generations, population
        Length of the run and AFPO's capacity (paper: 6,000 and 50).
    treatment
        A name of `treatments.TREATMENTS`.
    objective, aggregate
        Names of `objectives.OBJECTIVES` and `objectives.AGGREGATES`.
    starts
        Over how many starts a score is averaged. 1: the body's exact start pose, as in the
        original; more: that many slightly different ones, drawn once.
    engine, precision
        See `engines.make_evaluator`.
    world
        Name of a world; empty for the body's own.
    vocabulary
        As `Vocabulary.load` takes it.

    """

    body: str
    seed: int
    words: Words
    held_out: Words = ()
    generations: int = 6000
    population: int = 50
    treatment: str = 'experimental'
    objective: str = 'program'
    aggregate: str = 'sum'
    starts: int = 1
    engine: str = 'batched'
    precision: str = 'float32'
    world: str = ''
    vocabulary: str = 'default'

    def __post_init__(self) -> None:
        """Check every field (ValueError, naming it, with what was expected and what came)."""
        known: dict[str, tuple[str, ...]] = {
            'treatment': TREATMENTS, 'objective': tuple(OBJECTIVES),
            'aggregate': AGGREGATES, 'engine': ENGINES, 'precision': PRECISIONS}
        for name, choices in known.items():
            if getattr(self, name) not in choices:
                raise ValueError(f'{name}: expected one of {", ".join(choices)}, '
                                 f'got {getattr(self, name)!r}')
        body = bodies.check(self.body)
        if self.world == '':
            object.__setattr__(self, 'world', body.world)
        if self.world not in WORLDS:
            raise ValueError(f'world: expected one of {", ".join(WORLDS)}, got {self.world!r}')
        least = {'seed': 0, 'generations': 1, 'population': 2, 'starts': 1}
        for name, smallest in least.items():
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < smallest:
                raise ValueError(f'{name}: expected an integer >= {smallest}, got {value!r}')
        self._check_words()

    def _check_words(self) -> None:
        for name in ('words', 'held_out'):
            pairs = tuple((str(word), str(behaviour)) for word, behaviour in getattr(self, name))
            object.__setattr__(self, name, pairs)
            for word, behaviour in pairs:
                if behaviour not in BEHAVIOURS:
                    raise ValueError(f'{name}: expected {word!r} to ask for one of '
                                     f'{", ".join(BEHAVIOURS)}, got {behaviour!r}')
        if not self.words:
            raise ValueError('words: expected at least one, got none')
        check_each_once(word for word, _behaviour in self.words + self.held_out)

    def spelt(self, known: Callable[[str], str]) -> RunConfig:
        """
        Return the configuration with its words as a vocabulary spells them.

        Parameters
        ----------
        known
            `Vocabulary.known`.

        Raises
        ------
        ValueError
            If the vocabulary lacks a word, or two of them are one word there.

        """
        every = [word for word, _behaviour in self.words + self.held_out]
        check_each_once(every, known)
        def spell(pairs: Words) -> Words:
            return tuple((known(word), behaviour) for word, behaviour in pairs)
        return replace(self, words=spell(self.words), held_out=spell(self.held_out))

    def to_json(self) -> dict[str, Any]:
        """Return the configuration as a JSON object."""
        value = asdict(self)
        value['words'] = [list(pair) for pair in self.words]
        value['held_out'] = [list(pair) for pair in self.held_out]
        return value

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> RunConfig:
        """Return the configuration that `to_json` gave (ValueError if it is none)."""
        names = {field.name for field in fields(cls)}
        unknown = sorted(set(value) - names)
        if unknown:
            raise ValueError(f'run configuration: unknown field {unknown[0]!r}')
        try:
            return cls(**value)
        except TypeError as error:
            raise ValueError(f'run configuration: {error}') from None
