"""What the steps of a pipeline work with: the recipe, the words' vectors, trials that are kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from training.evolution.operators import Array
from training.evolution.treatments import Words
from training.pipeline import trials
from training.pipeline.recipe import Recipe
from training.pipeline.table import Row
from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary

Trial = Callable[[Network, Words, Words], tuple[Row, ...]]


@dataclass(frozen=True)
class Bench:
    """
    What every step works with.

    Attributes
    ----------
    recipe
        What is made.
    vocabulary
        For the held-out words, which only the blind look may ask it for.
    vectors
        Word -> vector (T,) of the trained and validation words.
    threads
        Of the engines; changes no result.
    say
        Is told what happens.

    """

    recipe: Recipe
    vocabulary: Vocabulary
    vectors: Mapping[str, Array]
    threads: int = 1
    say: Callable[[str], None] = print

    @property
    def body(self) -> Body:
        """The body that is trained."""
        return bodies.get(self.recipe.body)

    @contextmanager
    def trials(self, directory: Path, starts: int, seed: int) -> Iterator[Trial]:
        """Yield what tries a controller under (trained words, validation words)."""
        from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator

        world = self.recipe.world
        with PyBulletEvaluator(self.body, world, self.threads) as evaluator:
            def trial(network: Network, words: Words, validation: Words = ()) -> tuple[Row, ...]:
                return trials.kept_trial(
                    directory / 'trials', network, self.body, world, words, self.vectors,
                    validation=validation, starts=starts, seed=seed, evaluator=evaluator,
                    move_m=self.recipe.move_m)
            yield trial
