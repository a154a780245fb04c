"""
Train an ear: a lexicon in, an ear out, as JSON for a controller file. Deterministic, seconds.

  python -m training ear --out out/ear.json
  python -m training ear --lexicon mine.yaml --vocabulary glove --out out/ear.json

Families that the lexicon holds out are not heard; the last lines tell each of their words, right or
wrong. With the default vocabulary the metric that ships is used; with another one it is built from
WordNet (Debian: wordnet-base) and kept in the user's data folder. `--metric-folder` writes it
elsewhere, together with how it was built.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from training.grounding import learned_metric, lexicon, wordnet
from training.grounding.learned_metric import Built
from training.grounding.lexicon import Lexicon
from w2b_core import json_fields
from w2b_core.behaviours import DEFAULT_BEHAVIOURS
from w2b_core.files import write_atomically
from w2b_core.hearing import Ear, EarError, Understood, learning, places
from w2b_core.hearing.learning import Lesson
from w2b_core.hearing.metric import Metric
from w2b_core.hearing.metric import load as load_metric
from w2b_core.vocabulary import Vocabulary, metrics


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('--out', type=Path, required=True, help='file to write the ear to')
    parser.add_argument('--lexicon', type=Path, default=lexicon.SHIPPED, help='YAML or JSON file')
    parser.add_argument('--vocabulary', default='default', help='name or file of the word vectors')
    parser.add_argument('--behaviours', nargs='+', default=list(DEFAULT_BEHAVIOURS), metavar='NAME',
                        help='of the controller, in the order of its command')
    parser.add_argument('--all-words', action='store_true', help='hear the held-out families too')
    parser.add_argument('--rebuild-metric', action='store_true',
                        help='build the metric although one ships for the vocabulary')
    parser.add_argument('--metric-folder', type=Path, help='where to write a metric that is built')
    parser.add_argument('--wordnet', type=Path, default=wordnet.FOLDER, help="WordNet's folder")


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        vocabulary = Vocabulary.load(args.vocabulary)
        words = lexicon.load(args.lexicon).within(places.spelt(vocabulary))
        built = None if args.rebuild_metric else shipped_metric(vocabulary)
        if built is None:
            built = build_metric(vocabulary, words, args.wordnet)
            keep(built, args.metric_folder)
        ear = train(words, vocabulary, built.metric, args.behaviours, all_words=args.all_words)
        args.out.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(args.out, json_fields.write(ear.to_json()).encode())
    except (ValueError, OSError) as error:
        print(f'ear: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{args.out}: {len(ear.words)} words of {", ".join(ear.judge.classes)} and literal words;'
          f' metric {ear.metric_sha256[:12]}, {args.out.stat().st_size:,} bytes')
    if not args.all_words:
        for line in held_out(ear, vocabulary, words):
            print(line)
    return 0


def lesson_of(words: Lexicon, behaviours: Sequence[str], without: Sequence[str] = ()) -> Lesson:
    """Return the lesson of a lexicon's words but those of `without`, for a controller."""
    chosen = {word: entry for word, entry in words.words.items()
              if entry.behaviour in behaviours and word not in without}
    near = tuple(word for word in words.near_miss if word not in without)
    # What is judged must not be heard as background, nor what nothing is claimed about.
    unclaimed = tuple(dict.fromkeys((
        *words.excluded, *(word for word in (*words.words, *words.near_miss)
                           if word not in chosen and word not in near))))
    return Lesson(tuple(behaviours), {word: entry.behaviour for word, entry in chosen.items()},
                  {word: entry.family for word, entry in chosen.items()}, near, unclaimed)


def train(words: Lexicon, vocabulary: Vocabulary, metric: Metric, behaviours: Sequence[str], *,
          all_words: bool = False) -> Ear:
    """Return an ear of a lexicon, without its held-out families unless `all_words`."""
    for behaviour in behaviours:
        if not words.of(behaviour):
            raise EarError(f'behaviour {behaviour!r}: expected words for it in the lexicon, got '
                           'none; add some')
    held = {} if all_words else words.held_out_words()
    lesson = lesson_of(words, behaviours, [word for found in held.values() for word in found])
    how = {'made_by': 'python -m training ear', 'words': len(lesson.words),
           'held_out': {} if all_words else {name: list(families)
                                             for name, families in words.held_out.items()}}
    return learning.train(learning.with_inflections(lesson, vocabulary), vocabulary, metric,
                          how=how)


def held_out(ear: Ear, vocabulary: Vocabulary, words: Lexicon) -> list[str]:
    """Return a line for each held-out word: what it asks for, and what the ear answers."""
    lines = []
    for behaviour, found in words.held_out_words().items():
        for word in found:
            answer = ear.understand(word, vocabulary)
            right = isinstance(answer, Understood) and answer.behaviour == behaviour
            said = (f'{answer.behaviour} {answer.probability:.2f}'
                    if isinstance(answer, Understood) else 'refused')
            lines.append(f'held out: {word} ({behaviour}) -> {said}{"" if right else "  WRONG"}')
    return lines


def shipped_metric(vocabulary: Vocabulary) -> Built | None:
    """Return the metric that ships for a vocabulary's vectors, None if none does."""
    about = vocabulary.about
    for path in sorted(metrics.shipped_folder().glob('*.json')):
        how: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        if about is not None and how.get('source_sha256') == about.source_sha256:
            return Built(load_metric(path.stem, vocabulary), how)
    return None


def build_metric(vocabulary: Vocabulary, words: Lexicon, folder: Path) -> Built:
    """Return a metric built without any pair that touches a word or near miss of a lexicon."""
    return learned_metric.build(vocabulary, wordnet.WordNet(folder),
                                (*words.words, *words.near_miss))


def keep(built: Built, folder: Path | None) -> None:
    """Write a metric where `vocabulary.metric` finds it, and how it was built beside it."""
    digest = metrics.write(built.metric.arrays(), folder)
    path = (folder or metrics.user_folder()) / f'{digest}.json'
    write_atomically(path, (json.dumps(built.how, indent=1) + '\n').encode())
