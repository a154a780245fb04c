"""
Who may hear which word: the roles of the words behind a champion.

- *trained*: heard in evolution; gates may ask for them;
- *validation*: never heard, but may choose among candidates;
- *held out*: never heard and never asked before the one candidate is chosen that ships. What a
  champion does under them is told once (`blind`); the record counts the candidates told.

`QUADRUPED` was fixed, and committed, before the first controller of its champion was evolved, by a
rule that looks at words and never at what a controller does under them:

1. The pool of stop words is the vocabulary's list of words like *stop* (behaviour_words.txt), of
   which those stay that have a cosine of at least 0.25 with *stop* or *cease*. Words that share a
   stem with *halt* or *suspend* leave the pool: who has heard *halting* has nearly heard *halt*.
2. Held out are *halt* and *suspend*, the paper's, and two that are drawn from the near synonyms:
   those of the pool with a cosine of at least 0.35 that are no form of *stop* or *cease*.
3. Validation are six words drawn from the rest of the pool; the others are trained.
4. The moves are trained on *forward* and *backward* alone. Three synonyms of each are held out.

A test repeats the rule and its draw (seed 0). The claim is about near synonyms: what a champion
does under words farther away, such as *sleep*, no bound says.
"""

from __future__ import annotations

from dataclasses import dataclass

from training.evolution.treatments import Words
from w2b_core.vocabulary.text import folded


@dataclass(frozen=True)
class WordRoles:
    """
    Words with the behaviours they ask for, in three roles.

    Raises ValueError if a word has two roles, or no word is trained for a behaviour.
    """

    trained: Words
    validation: Words
    held_out: Words

    def __post_init__(self) -> None:
        """Check that no word has two roles and that every behaviour is trained."""
        seen: set[str] = set()
        for word, _behaviour in self.every:
            if folded(word) in seen:
                raise ValueError(f'words: expected one role each, got two for {word!r}')
            seen.add(folded(word))
        missing = {'forward', 'backward', 'stop'} - {asked for _word, asked in self.trained}
        if missing:
            raise ValueError(f'words: expected a trained word for each behaviour, got none for '
                             f'{min(missing)!r}')

    @property
    def every(self) -> Words:
        """All words: trained, then validation, then held out."""
        return self.trained + self.validation + self.held_out


def asking(behaviour: str, words: str) -> Words:
    """Return the words of a text, each with the behaviour it asks for."""
    return tuple((word, behaviour) for word in words.split())


QUADRUPED = WordRoles(
    trained=(*asking('forward', 'forward'), *asking('backward', 'backward'),
             *asking('stop', 'stop cease ceased conclude desist discontinue end freeze interrupt '
                             'pause stall standstill stay stopping stops wait')),
    validation=asking('stop', 'abort brake ceases cessation stopped terminate'),
    held_out=(*asking('stop', 'halt suspend quit refrain'),
              *asking('forward', 'forwards ahead onward'),
              *asking('backward', 'backwards reverse rear')))
