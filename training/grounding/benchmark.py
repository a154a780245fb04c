"""
Judge hearing on a lexicon: words of unseen stem families, refusal, phrases, and the rivals.

  python -m training grounding                               # the shipped lexicon, a few minutes
  python -m training grounding --lexicon mine.json --json    # another person's
  python -m training grounding --evolved 1000                # and the evolved rivals, under an hour

The metric is built anew for the lexicon, without any WordNet pair that touches a stem of its words
or near misses. Where WordNet (Debian: wordnet-base) is absent the metric that ships serves, and the
output says which of the judged words it has seen.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from training.grounding import (
    accuracy,
    learned_metric,
    lexicon,
    refusal,
    retrofit,
    rivals,
    sentences,
    tables,
    wordnet,
)
from training.grounding.accuracy import Accuracy
from training.grounding.ear import shipped_metric
from training.grounding.folds import Folds
from training.grounding.learned_metric import Built
from training.grounding.lexicon import Lexicon
from w2b_core.hearing import places
from w2b_core.vocabulary import Vocabulary

LEFT_OUT = 'leave_one_family_out'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('--lexicon', type=Path, default=lexicon.SHIPPED, help='YAML or JSON file')
    parser.add_argument('--vocabulary', default='default', help='name or file of the word vectors')
    parser.add_argument('--words', type=int, nargs='+', default=[4, 8, 12], metavar='K',
                        help='words a behaviour that are heard')
    parser.add_argument('--splits', type=int, default=50, help='draws of these words')
    parser.add_argument('--evolved', type=int, default=0, metavar='GENERATIONS',
                        help='evolve the closed-loop rivals too, for so many generations (1000: '
                             'under an hour of one core)')
    parser.add_argument('--evolved-seeds', type=int, default=3, metavar='N', help='and so often')
    parser.add_argument('--json', action='store_true', help='print JSON instead of tables')
    parser.add_argument('--out', type=Path, metavar='FOLDER',
                        help='write grounding.json and the figures there')
    parser.add_argument('--wordnet', type=Path, default=wordnet.FOLDER, help="WordNet's folder")


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        if min(args.words) < 1 or args.splits < 1 or args.evolved < 0 or args.evolved_seeds < 1:
            raise ValueError('words, splits, evolved: expected numbers above 0, got '
                             f'{min(args.words)}, {args.splits} and {args.evolved}')
        vocabulary = Vocabulary.load(args.vocabulary)
        every, known = lexicon.load(args.lexicon), places.spelt(vocabulary)
        if unknown := every.unknown(known):
            print(f'grounding: the vocabulary {vocabulary.source} lacks {len(unknown)} of the '
                  f'words, which are not judged: {", ".join(unknown[:10])}', file=sys.stderr)
        words = every.within(known)
        built, seen, net = metric_for(vocabulary, words, args.wordnet)
        judged = judge(words, vocabulary, built, args.words, args.splits)
        judged['unknown_words'] = list(unknown)
        judged['metric'] = {**built.how, 'seen_words': seen}
        judged['ceiling'] = {} if net is None else {retrofit.TITLE: retrofit.measure(
            words, vocabulary, built.metric, net, args.words, args.splits)}
        keep(args.out, judged, words, vocabulary, built)
        if args.evolved:
            from training.grounding import evolved

            judged['rivals'].update(evolved.measure(
                words, vocabulary, count=min(args.words), generations=args.evolved,
                seeds=args.evolved_seeds, say=lambda text: print(text, file=sys.stderr)))
            keep(args.out, judged, words, vocabulary, built)
    except (ValueError, OSError) as error:
        print(f'grounding: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    if args.json:
        print(json.dumps(judged, indent=1))
    else:
        print(tables.text(judged))
    return 0


def keep(folder: Path | None, judged: dict[str, Any], words: Lexicon, vocabulary: Vocabulary,
         built: Built) -> None:
    """Write what was measured so far, and the figures, into a folder, if one was given."""
    if folder is not None:
        from training.grounding import figures

        figures.write(folder, judged, words, vocabulary, built.metric)


def judge(words: Lexicon, vocabulary: Vocabulary, built: Built, counts: Sequence[int],
          splits: int) -> dict[str, Any]:
    """Return everything that is measured of a lexicon but the evolved rivals, as JSON values."""
    def points(names: Sequence[str]) -> accuracy.Array:
        return places.project(names, vocabulary, built.metric)

    forms = places.spelt(vocabulary)
    few = {str(count): accuracy.of_few_words(words, points, count, splits, forms=forms)
           for count in counts}
    left_out = accuracy.of_left_out_families(words, points)
    folds = Folds(words, vocabulary, built.metric)
    phrases = sentences.measure(folds)
    every = asdict(refusal.measure(folds))
    # Bounds are over the scored behaviours; what a lexicon adds to them is told beside.
    gate = every if words.behaviours == words.scored else asdict(
        refusal.measure(Folds(words.only_scored(), vocabulary, built.metric)))
    moving = gate['common_words_that_move']
    return {
        'lexicon': {behaviour: {'families': len(words.of(behaviour)),
                                'words': sum(map(len, words.of(behaviour).values()))}
                    for behaviour in words.behaviours},
        'scored': list(words.scored), 'splits': splits,
        'accuracy': {**{count: _json(found) for count, found in few.items()},
                     LEFT_OUT: _json(left_out)},
        'refusal': gate, 'refusal_all_behaviours': every,
        'phrases': {**_phrases(phrases.shares),
                    'one_family_left_out': _phrases(phrases.one_left_out),
                    'all_families_left_out': _phrases(phrases.all_left_out),
                    'wrong': [{'text': one.phrase.text, 'label': one.phrase.label,
                               'answer': one.answer} for one in phrases.wrong]},
        'common_words_that_move': moving,
        'shared': shared(words, left_out),
        'wrong': {word: found for word, found in (left_out.answers or {}).items()
                  if found != words.words[word].behaviour},
        'rivals': rivals.measure(words, vocabulary, built.metric, counts, splits, few)}


def shared(words: Lexicon, left_out: Accuracy) -> dict[str, dict[str, float]]:
    """
    Return how many words of another lexicon are right that the shipped one has too, and that not.

    Of left-out families. Empty for the shipped lexicon itself: it shares all of its words.
    """
    ours, answers = lexicon.load().words, left_out.answers or {}
    right = {word: float(found == words.words[word].behaviour) for word, found in answers.items()}
    parts = {'both': [right[word] for word in right if word in ours],
             'others': [right[word] for word in right if word not in ours]}
    if not parts['others']:
        return {}
    return {name: {'words': len(part), 'right': sum(part) / len(part)}
            for name, part in parts.items() if part}


def metric_for(vocabulary: Vocabulary, words: Lexicon, folder: Path
               ) -> tuple[Built, list[str], wordnet.WordNet | None]:
    """Return the metric that a lexicon is judged behind, the words it has seen, and WordNet."""
    try:
        net = wordnet.WordNet(folder)
    except wordnet.WordNetError as error:
        shipped = shipped_metric(vocabulary)
        if shipped is None:
            raise
        stem = wordnet.stemmer()
        unseen = set(shipped.how['without_stems'])
        seen = [word for word in (*words.words, *words.near_miss) if stem(word) not in unseen]
        print(f'grounding: {error}. The metric that ships serves; it has seen the relations of '
              f'{len(seen)} of the judged words', file=sys.stderr)
        return shipped, seen, None
    return learned_metric.build(vocabulary, net, (*words.words, *words.near_miss)), [], net


def _phrases(shares: Mapping[str, float | None]) -> dict[str, float | None]:
    return {'plain': shares['plain'], 'negated': shares['negated'],
            'irrelevant_refused': shares['irrelevant']}


def _json(found: Accuracy | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {'macro': found.macro, 'per_behaviour': dict(found.per_behaviour), 'low': found.low,
            'high': found.high}


