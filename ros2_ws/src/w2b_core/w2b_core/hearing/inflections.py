"""Regular English inflections: which words of a vocabulary are forms of one word."""

from __future__ import annotations

from collections.abc import Callable, Iterator

#: Ending -> what it may have replaced.
ENDINGS = (('ies', 'y'), ('ied', 'y'), ('es', ''), ('s', ''), ('ed', ''), ('ed', 'e'),
           ('ing', ''), ('ing', 'e'))
LEAST_STEM = 3


def inflections(word: str, known: Callable[[str], bool]) -> tuple[str, ...]:
    """
    Return the words that share a base form with `word`, itself first.

    Parameters
    ----------
    word
        In lower case.
    known
        Whether a word is in the vocabulary.

    """
    bases = [word, *(base for base in _bases(word) if known(base))]
    forms = (form for base in bases for form in (base, *_forms(base)))
    return tuple(dict.fromkeys((word, *(form for form in forms if known(form)))))


def _bases(word: str) -> Iterator[str]:
    for ending, instead in ENDINGS:
        stem = word.removesuffix(ending)
        if stem == word or len(stem) < LEAST_STEM:
            continue
        yield stem + instead
        if ending in ('ed', 'ing') and not instead and stem[-1] == stem[-2]:
            yield stem[:-1]


def _forms(base: str) -> Iterator[str]:
    if base.endswith('y') and base[-2:-1] not in 'aeiou':
        yield from (base[:-1] + 'ies', base[:-1] + 'ied', base + 'ing')
    elif base.endswith('e'):
        yield from (base + 's', base + 'd', base[:-1] + 'ing')
    else:
        yield from (base + 's', base + 'ed', base + 'ing', base + base[-1:] + 'ed',
                    base + base[-1:] + 'ing')
        if base.endswith(('s', 'x', 'z', 'ch', 'sh')):
            yield base + 'es'
