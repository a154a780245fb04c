"""
The benchmark's numbers as Markdown tables: `python -m training.grounding.tables FILE [--short]`.

FILE is the grounding.json that `python -m training grounding --out FOLDER` wrote.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def text(judged: Mapping[str, Any]) -> str:
    """Return all tables of what `benchmark.judge` measured."""
    parts = (accuracy(judged), shared(judged), gate(judged), phrases(judged), rivals(judged),
             wrong(judged))
    return '\n\n'.join(part for part in parts if part)


def short(judged: Mapping[str, Any]) -> str:
    """Return the README's table: the ear beside a plain classifier and chance."""
    gate_, left_out = judged['refusal'], judged['accuracy']['leave_one_family_out']
    rows = [('words of stem families that were never heard', 'right')]
    for count in (name for name in judged['accuracy'] if name.isdigit()):
        row, plain = judged['accuracy'][count], judged['rivals']['logistic regression'].get(count)
        if row is not None and plain is not None:
            rows.append((f'{count} words a behaviour heard', f'{row["macro"]:.2f} (without the '
                         f'learned metric {plain["macro"]:.2f}; chance 0.33)'))
    rows += [('all words but one family heard', f'{left_out["macro"]:.2f} '
              f'({left_out["low"]:.2f} to {left_out["high"]:.2f})'),
             ('of 400 common words, move the robot', f'{judged["common_words_that_move"]:.0%}'),
             ('synonyms refused where 90 % of random words are',
              f'{gate_["synonyms_refused"]:.0%}'),
             ('phrases: plain; negated; irrelevant ones refused', '; '.join(
                 f'{judged["phrases"][name]:.2f}'
                 for name in ('plain', 'negated', 'irrelevant_refused')))]
    return table(rows)


def accuracy(judged: Mapping[str, Any]) -> str:
    """Return the accuracy on words of unseen stem families, with intervals."""
    behaviours = list(next(row['per_behaviour'] for row in judged['accuracy'].values() if row))
    rows = [('heard', 'macro', '95 %', *behaviours)]
    for name, row in judged['accuracy'].items():
        heard = 'all but one family' if name.startswith('leave') else f'{name} words a behaviour'
        if row is None:
            rows.append((heard, 'too few families', '', *[''] * len(behaviours)))
            continue
        rows.append((heard, share(row['macro']), f'{share(row["low"])} to {share(row["high"])}',
                     *(share(row['per_behaviour'][name]) for name in behaviours)))
    return table(rows)


def shared(judged: Mapping[str, Any]) -> str:
    """Return in a line how words that the shipped lexicon has too compare with others."""
    names = {'both': 'words that the shipped lexicon has too', 'others': 'other words'}
    parts = '; '.join(f'{share(found["right"])} of the {found["words"]} {names[name]}'
                      for name, found in judged.get('shared', {}).items())
    return parts and f'One family left out, right: {parts}.'


def gate(judged: Mapping[str, Any]) -> str:
    """Return how well commands are told from other words."""
    scored, every = judged['refusal'], judged['refusal_all_behaviours']
    names = {'random_auroc': 'AUROC against random words',
             'common_auroc': 'AUROC against common words',
             'near_auroc': 'AUROC against near misses',
             'synonyms_refused': 'synonyms refused where 90 % of random words are',
             'accuracy_of_accepted': 'accuracy of the accepted ones',
             'common_accepted': 'common words accepted', 'near_accepted': 'near misses accepted',
             'common_words_that_move': 'common words that move the robot'}
    rows = [('is it a command at all?', ', '.join(judged['scored']), 'all behaviours'),
            *((title, share(scored[name]), share(every[name])) for name, title in names.items())]
    return table(rows)


def phrases(judged: Mapping[str, Any]) -> str:
    """Return how many phrases are right."""
    found = judged['phrases']
    rows = [('phrases', 'all words heard', 'one family of the phrase left out',
             'all its families left out')]
    for name, title in (('plain', 'plain'), ('negated', 'negated'),
                        ('irrelevant_refused', 'irrelevant, refused')):
        rows.append((title, share(found[name]), share(found['one_family_left_out'][name]),
                     share(found['all_families_left_out'][name])))
    return table(rows)


def rivals(judged: Mapping[str, Any]) -> str:
    """Return the rivals' accuracy by number of words, and how much less it is than the ear's."""
    counts = [name for name in judged['accuracy'] if name.isdigit()]
    rows = [('ear', *(f'k = {count}' for count in counts))]
    rows.append(('**learned metric, inflections, logistic regression**',
                 *(f'**{share((judged["accuracy"][count] or {}).get("macro"))}**'
                   for count in counts)))
    for name, found in {**judged['rivals'], **judged['ceiling']}.items():
        cells = []
        for count in counts:
            row = found.get(count)
            cells.append('' if row is None else share(row['macro']) + (
                f' ({-row["less"]["mean"]:+.3f} ± {row["less"]["half_interval"]:.3f})'
                if 'less' in row else ''))
        rows.append((name, *cells))
    return table(rows)


def wrong(judged: Mapping[str, Any]) -> str:
    """Return the words that a family left out gets wrong, by what they are taken for."""
    taken: dict[str, list[str]] = {}
    for word, answer in judged['wrong'].items():
        taken.setdefault(answer, []).append(word)
    return '\n'.join(f'Taken for {answer}: {", ".join(words)}.' for answer, words in taken.items())


def share(value: float | None) -> str:
    """Return a share with three digits, as it stands in tables."""
    return 'none' if value is None else f'{value:.3f}'


def table(rows: Sequence[tuple[str, ...]]) -> str:
    """Return rows, the first of them headings, as a Markdown table."""
    first, *rest = ('| ' + ' | '.join(row) + ' |' for row in rows)
    return '\n'.join([first, '|' + '---|' * len(rows[0]), *rest])


if __name__ == '__main__':
    read = json.loads(Path(sys.argv[1]).read_text(encoding='utf-8'))
    print(short(read) if '--short' in sys.argv else text(read))
