"""
What might make the ear better, tried on words that nobody judges.

  python -m training.grounding.development                  # on the lines of development.txt
  python -m training.grounding.development LEXICON ...      # on lexicons that are judged

Each line of development.txt has three classes of words with opposites (praise | criticize | ask),
written by hand, each with its inflections; words that share a stem with one of the shipped lexicon
or of the two in tests/training/grounding/lexicons are left out. Each line is judged as a lexicon
is: without a metric; behind one of its own, each word by its own vector alone; that with the cosine
to each class's mean, by several weights, added to the logits of the logistic regression; and as the
ear does, where a word's other inflections count too.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from training.grounding import accuracy, learned_metric, lexicon, tables, wordnet
from training.grounding.accuracy import Array, Labels, Learner, Points
from training.grounding.lexicon import Entry, Lexicon
from w2b_core.hearing import judge, places
from w2b_core.hearing.inflections import inflections
from w2b_core.hearing.metric import unit
from w2b_core.vocabulary import Vocabulary

FILE = Path(__file__).with_suffix('.txt')
TESTS = Path(__file__).parents[2] / 'tests/training/grounding/lexicons'
CLASSES = ('first', 'second', 'third')
#: Least families of a class.
LEAST_FAMILIES = 7
COUNTS, SPLITS = (4, 6), 8
WEIGHTS = (0.0, 3.0, 6.0, 12.0)


def lexicons(vocabulary: Vocabulary, net: wordnet.WordNet, without: Sequence[str]
             ) -> Iterator[Lexicon]:
    """Yield a lexicon for each line, without words that share a stem with `without`."""
    known = places.spelt(vocabulary)
    judged = {stem for word in without for stem in net.stems(word)}
    for line in FILE.read_text(encoding='utf-8').splitlines():
        words: dict[str, Entry] = {}
        classes: dict[str, set[str]] = {}
        for name, part in zip(CLASSES, line.split('|'), strict=True):
            for base in part.split():
                family = min(net.stems(base))
                for form in inflections(base, known.__contains__):
                    if form in known and form not in words and not judged & net.stems(form):
                        words[form] = Entry(name, family)
                        classes.setdefault(family, set()).add(name)
        found = Lexicon({word: entry for word, entry in words.items()
                         if len(classes[entry.family]) == 1}, CLASSES)
        if min(len(found.of(name)) for name in CLASSES) >= LEAST_FAMILIES:
            yield found


def learner(weight: float, points: Array, labels: Labels, classes: int
            ) -> Callable[[Array], Labels]:
    """Learn as the ear does, with a weight of the cosine to each class's mean beside the logits."""
    classifier = judge.classify(points, labels, classes)
    means = unit(np.array([points[labels == label].mean(axis=0) for label in range(classes)]))
    return lambda others: (classifier.logits(others) + weight * others @ means.T).argmax(axis=-1)


def measure(vocabulary: Vocabulary, net: wordnet.WordNet, words: Lexicon) -> list[list[float]]:
    """Return a row of macro accuracies for each recipe: of `COUNTS`, and of left-out families."""
    metric = learned_metric.build(vocabulary, net, tuple(words.words)).metric
    known = places.spelt(vocabulary)
    index = {word: place for place, word in enumerate(known)}
    vectors = vocabulary.matrix(index).astype(np.float64)
    plain, alone = unit(unit(vectors) - metric.mean), metric.project(vectors)
    where = places.project(list(index), vocabulary, metric, among=known)
    return [_row(words, partial(_at, points, index), partial(learner, weight), known)
            for points, weight in ((plain, 0.0), *((alone, weight) for weight in WEIGHTS),
                                   (where, 0.0))]


def _at(where: Array, index: Mapping[str, int], names: Sequence[str]) -> Array:
    return where[[index[name] for name in names]]


def _row(words: Lexicon, points: Points, learn: Learner, known: frozenset[str]) -> list[float]:
    few = [accuracy.of_few_words(words, points, count, SPLITS, learner=learn, forms=known)
           for count in COUNTS]
    return [*(np.nan if found is None else found.macro for found in few),
            accuracy.of_left_out_families(words, points, learner=learn).macro]


def main(paths: Sequence[str]) -> int:
    """Print the mean accuracy over the lexicons by recipe, and its difference from the base."""
    vocabulary, net = Vocabulary.load(), wordnet.WordNet()
    judged = [word for path in (lexicon.SHIPPED, *sorted(TESTS.glob('*.json')))
              for word in lexicon.load(path).words]
    words = [lexicon.load(Path(path)).within(places.spelt(vocabulary)).only_scored()
             for path in paths] or lexicons(vocabulary, net, judged)
    found = np.array([measure(vocabulary, net, each) for each in words])
    rows: list[tuple[str, ...]] = [('recipe', *(f'k = {count}' for count in COUNTS),
                                    'one family left out')]
    base = 'each word by its own vector alone'
    names = ('no metric', base, *(f'and the cosine to the mean, weight {weight:g}'
                                  for weight in WEIGHTS[1:]), 'the ear: inflections count too')
    for index, name in enumerate(names):
        gains = found[:, index] - found[:, names.index(base)]
        errors = gains.std(axis=0, ddof=min(1, len(found) - 1)) / np.sqrt(len(found))
        rows.append((name, *(
            f'{mean:.3f} ({gain:+.3f} ± {1.96 * error:.3f})' for mean, gain, error in
            zip(found[:, index].mean(axis=0), gains.mean(axis=0), errors, strict=True))))
    print(f'{len(found)} lexicons\n\n{tables.table(rows)}')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
