"""
What the *body* does under words: `python -m training closed-loop physical_twin`.

Every word of the lexicons is said to the controller from several starts, in each engine, and it is
right if the body then does what the word asks for. Beside it stands the ear's own share of right
answers: the difference is the legs'. A word that is refused is wrong in both. Words are counted
apart by whether the ear was trained on them. A command moves the body the same whatever word it
came from, so each behaviour is simulated once a start, and all its words are judged by it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution.starts import slightly_different
from training.grounding import lexicon
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller
from w2b_core.hearing import Ear, Understood
from w2b_core.hearing.heard import Heard
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Start
from w2b_sim.recording import phase_outcome
from w2b_sim.walking import Phase, walk
from w2b_sim.worlds import WORLDS

#: A move is obeyed from so many body lengths on, standing still within so many.
MOVED_LENGTHS, STILL_LENGTHS = 2.0, 1.0
NONE = 'none'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('controller', help='a controller with an ear: a file, or the name of one that ships')
    add('--lexicon', type=Path, nargs='+', default=[lexicon.SHIPPED], metavar='FILE',
        help='YAML or JSON files; a word that two of them put into two classes is left out')
    add('--vocabulary', default='default', help='default: %(default)s')
    add('--engine', nargs='+', choices=registry.stepwise_names(),
        default=list(registry.stepwise_names()), help='default: all')
    add('--starts', type=int, default=3, metavar='N', help='default: %(default)s')
    add('--seconds', type=float, default=6.0, metavar='S', help='default: %(default)s')
    add('--seed', type=int, default=0, metavar='N', help='of the starts (default: 0)')
    add('--json', action='store_true', help='print JSON')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 2 for an error."""
    try:
        if args.starts < 1 or not 2.0 <= args.seconds <= 600.0:
            raise ValueError('--starts, --seconds: expected at least 1, and 2 to 600, got '
                             f'{args.starts} and {args.seconds}')
        controller = controller_file.load(controller_file.resolve(args.controller))
        if not isinstance(controller.ear, Ear):
            raise ValueError(f'{args.controller}: expected a controller with an ear, got one that '
                             'is primed with words; `python -m training study` scores those')
        vocabulary = Vocabulary.load(args.vocabulary)
        words = asked_words(args.lexicon, controller, vocabulary)
        starts = slightly_different(np.random.default_rng(args.seed), args.starts)
        bodies_do = {engine: shown(controller, engine, starts, args.seconds)
                     for engine in args.engine}
        found = judged(controller.ear, vocabulary, words, bodies_do)
    except (ValueError, OSError) as error:
        print(f'closed-loop: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(json.dumps(found, indent=1) if args.json else to_markdown(found))
    return 0


def asked_words(paths: Sequence[Path], controller: Controller, vocabulary: Vocabulary
                ) -> dict[str, str]:
    """Return word -> behaviour of all lexicons, as far as controller and vocabulary know them."""
    claims: dict[str, set[str]] = {}
    for path in paths:
        for word, entry in lexicon.load(path).words.items():
            if word in vocabulary and entry.behaviour in controller.behaviours:
                claims.setdefault(vocabulary.known(word), set()).add(entry.behaviour)
    return {word: claim.pop() for word, claim in claims.items() if len(claim) == 1}


def shown(controller: Controller, engine: str, starts: Sequence[Start], seconds: float
          ) -> dict[str, list[set[str]]]:
    """Return command -> for each start the behaviours that the body then shows."""
    body = controller.described()
    world = WORLDS[body.world]
    bounds = Bounds(MOVED_LENGTHS * body.length_m, STILL_LENGTHS * body.length_m)
    frames = round(seconds / world.control_period_s)
    simulation = registry.make_simulation(engine, body, world)
    result: dict[str, list[set[str]]] = {}
    try:
        for index, name in enumerate(controller.behaviours):
            command = np.eye(len(controller.behaviours))[index]
            for start in starts:
                simulation.reset(start)
                recording = walk(simulation, body, controller, [Phase(Heard(command=command),
                                 frames)], period_s=world.control_period_s)
                motion = phase_outcome(recording).motion
                seen = {other for other in controller.behaviours
                        if bool(BEHAVIOURS.get(other).obeyed(motion, bounds))}
                # Who turns on the spot, or sits, keeps its place, too: that is no stop.
                result.setdefault(name, []).append(seen - {'stop'} or seen)
    finally:
        close = getattr(simulation, 'close', None)
        if close is not None:
            close()
    return result


def judged(ear: Ear, vocabulary: Vocabulary, words: Mapping[str, str],
           engines: Mapping[str, Mapping[str, list[set[str]]]]) -> dict[str, Any]:
    """Return the shares of right answers, of words trained and never heard; see the module."""
    answers = {}
    for word in words:
        answer = ear.understand(word, vocabulary)
        answers[word] = answer.behaviour if isinstance(answer, Understood) else NONE
    result: dict[str, Any] = {}
    for name, trained in (('trained', True), ('never_heard', False)):
        chosen = [word for word in words if (word in ear.words) == trained]
        if not chosen:
            continue
        right = [answers[word] == words[word] for word in chosen]
        result[name] = {'words': len(chosen), 'ear': float(np.mean(right)),
                        'refused': float(np.mean([answers[word] == NONE for word in chosen]))}
        for engine, does in engines.items():
            # A refused word moves nothing, from any start.
            result[name][engine] = float(np.mean([
                np.mean([words[word] in seen for seen in does.get(answers[word], [set()])])
                for word in chosen]))
    result['wrong'] = {word: answers[word] for word in words if answers[word] != words[word]}
    return result


def to_markdown(found: Mapping[str, Any]) -> str:
    """Return the shares as a table."""
    names = [name for name in ('trained', 'never_heard') if name in found]
    engines = [key for key in found[names[0]] if key not in ('words', 'ear', 'refused')]
    lines = ['| words | number | the ear is right | refused | right of the rest | '
             + ' | '.join(f'the body does it in {engine}' for engine in engines) + ' |',
             '|---' * (5 + len(engines)) + '|']
    for name in names:
        row = found[name]
        lines.append(f'| {name.replace("_", " ")} | {row["words"]} | {row["ear"]:.3f} | '
                     f'{row["refused"]:.3f} | '
                     f'{row["ear"] / max(1e-9, 1 - row["refused"]):.3f} | '
                     + ' | '.join(f'{row[engine]:.3f}' for engine in engines) + ' |')
    return '\n'.join(lines)
