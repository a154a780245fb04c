"""The benchmark's numbers as Markdown tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def text(judged: Mapping[str, Any]) -> str:
    """Return all tables of what `benchmark.judge` measured."""
    return '\n\n'.join((accuracy(judged), gate(judged), phrases(judged), rivals(judged),
                        wrong(judged)))


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


def gate(judged: Mapping[str, Any]) -> str:
    """Return how well commands are told from other words."""
    found = judged['refusal']
    names = {'random_auroc': 'AUROC against random words',
             'common_auroc': 'AUROC against common words',
             'near_auroc': 'AUROC against near misses',
             'synonyms_refused': 'synonyms refused where 90 % of random words are',
             'accuracy_of_accepted': 'accuracy of the accepted ones',
             'common_accepted': 'common words accepted', 'near_accepted': 'near misses accepted'}
    rows = [('is it a command at all?', 'all words, one family left out'),
            *((title, share(found[name])) for name, title in names.items()),
            ('common words that move the robot', share(judged['common_words_that_move']))]
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
    for name, found in judged['rivals'].items():
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
