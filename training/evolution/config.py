"""What a run is: everything that decides its champion, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from typing import Annotated, Any

from pydantic.dataclasses import dataclass

from training.configuration import (
    STRICT,
    BodyName,
    ConfigError,
    Text,
    one_line,
    one_of,
    whole,
    world_of,
)
from training.evolution.engines import ENGINES, PRECISIONS
from training.evolution.objectives import AGGREGATES, OBJECTIVES
from training.evolution.optimisers import OPTIMISERS, PAPER
from training.evolution.treatments import TREATMENTS, Words
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.vocabulary.text import folded


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


@one_line('run configuration')
@dataclass(frozen=True, config=STRICT)
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
    optimiser
        A name of `optimisers.OPTIMISERS`.
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

    body: BodyName
    seed: Annotated[int, whole(0, 2**63)]
    words: Words
    held_out: Words = ()
    generations: Annotated[int, whole(1, 2**63)] = 6000
    population: Annotated[int, whole(2)] = 50
    treatment: Annotated[str, one_of(lambda: TREATMENTS)] = 'experimental'
    optimiser: Annotated[str, one_of(OPTIMISERS.names)] = PAPER
    objective: Annotated[str, one_of(lambda: tuple(OBJECTIVES))] = 'program'
    aggregate: Annotated[str, one_of(lambda: AGGREGATES)] = 'sum'
    starts: Annotated[int, whole()] = 1
    engine: Annotated[str, one_of(lambda: ENGINES)] = 'batched'
    precision: Annotated[str, one_of(lambda: PRECISIONS)] = 'float32'
    world: str = ''
    vocabulary: Text = 'default'

    def __post_init__(self) -> None:
        """Check what hangs together (ValueError: what was expected and what came)."""
        object.__setattr__(self, 'world', world_of(self.world, self.body))
        self._check_words()

    def _check_words(self) -> None:
        for name in ('words', 'held_out'):
            for word, behaviour in getattr(self, name):
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
        """Return the configuration as a JSON object; the paper's optimiser goes without saying."""
        value = asdict(self)
        if self.optimiser == PAPER:  # as in all runs from before there was another
            del value['optimiser']
        value['words'] = [list(pair) for pair in self.words]
        value['held_out'] = [list(pair) for pair in self.held_out]
        return value

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> RunConfig:
        """Return the configuration that `to_json` gave (ValueError if it is none)."""
        try:
            return cls(**value)
        except TypeError as error:
            raise ConfigError(f'run configuration: {error}') from None
