"""
Is it a command at all? All words are heard but those of one family; each family in turn.

Near misses are part of what an ear learns, so that those are left out in turn too, by stem. All
numbers are of a threshold that accepts 10 % of the lexicon's random words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.grounding.folds import Folds
from w2b_core.hearing import english
from w2b_core.hearing.judge import ACCEPTED_AT_RANDOM, Judge

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Refusal:
    """
    How well commands are told from other words; None where the lexicon lists no such words.

    Attributes
    ----------
    random_auroc, common_auroc, near_auroc
        Chance that a left-out synonym looks more like a command than a word of the list.
    synonyms_refused, accuracy_of_accepted
        Of left-out synonyms, and macro accuracy of the others.
    common_words_that_move
        Share of common words that are accepted and ask for anything but stop.
    common_accepted, near_accepted
        Shares.
    curve
        (share of synonyms accepted, accuracy of those) from strict to lax: risk and coverage.

    """

    random_auroc: float | None
    common_auroc: float | None
    near_auroc: float | None
    synonyms_refused: float | None
    accuracy_of_accepted: float | None
    common_words_that_move: float | None
    common_accepted: float | None
    near_accepted: float | None
    curve: tuple[tuple[float, float], ...] = ()


def measure(folds: Folds) -> Refusal:
    """Return how well commands are told from the lexicon's other words."""
    words = folds.words
    random, common = folds.project(words.random), folds.project(words.common)
    random_rule, common_rule = (np.array([word in english.FUNCTION_WORDS for word in listed], bool)
                                for listed in (words.random, words.common))
    near_folds = folds.near_folds()
    ranks: list[float] = []
    commons: list[float] = []
    near_ranks: list[float] = []
    right: list[bool] = []
    kinds: list[str] = []
    moving: list[float] = []
    passing: list[float] = []
    for place, family in enumerate(folds.families):
        left_out = near_folds == place
        judged = folds.judge([family], ~left_out)
        names, points = folds.points(family)
        drawn = _scores(judged, random, random_rule)
        frequent = _scores(judged, common, common_rule)
        own = judged.score(points)
        ranks += _above(own, drawn)
        near_ranks += _above(judged.score(folds.near[left_out]), drawn)
        commons += _above(own, frequent)
        best = judged.classifier.logits(points).argmax(axis=1)
        kinds += [words.words[word].behaviour for word in names]
        right += [folds.classes[index] == words.words[word].behaviour
                  for word, index in zip(names, best, strict=True)]
        if len(random) and len(common):
            accepted = frequent > np.quantile(drawn, 1 - ACCEPTED_AT_RANDOM)
            asked = judged.classifier.logits(common).argmax(axis=1)
            passing.append(float(accepted.mean()))
            moving.append(float((accepted & (asked != _stop(folds.classes))).mean()))
    rank, hit, kind = np.array(ranks), np.array(right), np.array(kinds)
    if not len(random):
        return Refusal(None, None, None, None, None, None, None, None)
    accepted = rank < ACCEPTED_AT_RANDOM
    near = np.array(near_ranks)
    return Refusal(
        float(1 - rank.mean()), float(1 - np.mean(commons)) if len(common) else None,
        float((near[None] > rank[:, None]).mean() + 0.5 * (near[None] == rank[:, None]).mean())
        if len(near) else None,
        float(1 - accepted.mean()), _macro(hit[accepted], kind[accepted]),
        float(np.mean(moving)) if moving else None, float(np.mean(passing)) if passing else None,
        float((near < ACCEPTED_AT_RANDOM).mean()) if len(near) else None,
        _curve(rank, hit))


def _scores(judged: Judge, points: Array, by_rule: NDArray[np.bool_]) -> Array:
    """Return scores (n,); function words are refused by rule."""
    scores = judged.score(points)
    return np.where(by_rule, -np.inf, scores)


def _above(own: Array, others: Array) -> list[float]:
    """Return the share of the other scores that are above each own one; ties count half."""
    if not len(others):
        return [0.0] * len(own)
    return [float((others > score).mean() + 0.5 * (others == score).mean()) for score in own]


def _stop(classes: Sequence[str]) -> int:
    return classes.index(english.STOP) if english.STOP in classes else -1


def _macro(right: NDArray[np.bool_], kinds: NDArray[np.str_]) -> float:
    return float(np.mean([right[kinds == kind].mean() for kind in np.unique(kinds)]))


def _curve(rank: Array, right: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return (coverage, accuracy) as more and more synonyms are accepted."""
    order = np.argsort(rank, kind='stable')
    counts = np.arange(1, len(order) + 1)
    shares = np.cumsum(right[order]) / counts
    step = max(1, len(order) // 50)
    return tuple((float(count / len(order)), float(share)) for count, share
                 in zip(counts[step - 1::step], shares[step - 1::step], strict=True))
