"""
What other static vectors add: `python -m training.grounding.beside VOCABULARY [--lexicon FILE]`.

VOCABULARY is another one that is installed (`w2b vocabulary install FILE`), such as GloVe's. Each
goes behind a metric of its own, built without any pair that touches a judged stem; side by side
they are one vector, of which each half has the same length. Words that one of the two lacks are not
asked. Vectors know what texts say of the test words; relations of the test words are used by the
rows *retrofitted* only.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from training.grounding import accuracy, learned_metric, lexicon, retrofit, tables, wordnet
from training.grounding.accuracy import Array, Points
from training.grounding.lexicon import Lexicon
from w2b_core.hearing import places
from w2b_core.vocabulary import Vocabulary

COUNTS = (4, 8, 12)


def rows(words: Lexicon, vocabularies: Sequence[Vocabulary], net: wordnet.WordNet, splits: int
         ) -> list[tuple[str, ...]]:
    """Return a row of accuracies for each vocabulary, for both, and retrofitted."""
    forms = frozenset.intersection(*(places.spelt(each) for each in vocabularies))
    asked = words.within(forms)
    metrics = [learned_metric.build(each, net, (*words.words, *words.near_miss)).metric
               for each in vocabularies]

    def behind(place: int) -> Points:
        return lambda names: places.project(names, vocabularies[place], metrics[place],
                                            forms=False)

    drawn = [retrofit.retrofitted(each, metric, net, inflections=False)
             for each, metric in zip(vocabularies, metrics, strict=True)]
    recipes: dict[str, Points] = {
        **{each.name: behind(place) for place, each in enumerate(vocabularies)},
        'both': _both([behind(0), behind(1)]),
        f'{vocabularies[0].name}, retrofitted': drawn[0], 'both, retrofitted': _both(drawn)}
    found: list[tuple[str, ...]] = []
    for name, points in recipes.items():
        few = [accuracy.of_few_words(asked, points, count, splits, forms=forms)
               for count in COUNTS]
        left_out = accuracy.of_left_out_families(asked, points)
        found.append((name, *(tables.share(None if each is None else each.macro) for each in few),
                      f'{left_out.macro:.3f} ({left_out.low:.3f} to {left_out.high:.3f})'))
        print(*found[-1], file=sys.stderr, flush=True)
    return found


def _both(parts: Sequence[Points]) -> Points:
    """Return points side by side, at unit length together."""
    def points(names: Sequence[str]) -> Array:
        together: Array = np.concatenate([part(names) for part in parts], axis=1)
        return together / len(parts) ** 0.5
    return points


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('vocabulary')
    parser.add_argument('--lexicon', type=Path, default=lexicon.SHIPPED)
    parser.add_argument('--splits', type=int, default=50)
    args = parser.parse_args(argv)
    try:
        vocabularies = (Vocabulary.load(), Vocabulary.load(args.vocabulary))
        found = rows(lexicon.load(args.lexicon), vocabularies, wordnet.WordNet(), args.splits)
    except (ValueError, OSError) as error:
        print(f'beside: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    heads = ('vectors', *(f'k = {count}' for count in COUNTS), 'one family left out')
    print(tables.table([heads, *found]))
    return 0


if __name__ == '__main__':
    sys.exit(main())
