"""`w2b teach WORD BEHAVIOUR`: adds a word to a controller's ear; its legs stay as they are."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from w2b_core.controller import file as controller_file
from w2b_core.hearing import Ear, teach
from w2b_core.vocabulary import Vocabulary

#: Of the words that are answered otherwise now.
CHANGES_SHOWN = 20


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='w2b teach', description="Add a word to a controller's ear, without touching its "
        'legs, and tell which other words are answered otherwise now.',
        epilog='Exit code: 0 taught and written, 2 refused (the message says why).')
    parser.add_argument('word', help='a word of the vocabulary, such as scram')
    parser.add_argument('behaviour', help='one of the behaviours of the controller')
    parser.add_argument('--controller', required=True, metavar='NAME_OR_FILE',
                        help='controller that ships, or a controller file')
    parser.add_argument('--out', type=Path, default=None, metavar='FILE',
                        help='where to write the new one (default: over the file that was given)')
    parser.add_argument('--vocabulary', default='default', help='default: %(default)s')
    return parser.parse_args()


def main() -> int:
    """Run the command; return the exit code."""
    options = _arguments()
    try:
        source = controller_file.resolve(options.controller)
        if options.out is None and str(source) != options.controller:
            raise ValueError(f'{options.controller} ships with the program and is not overwritten; '
                             'give --out FILE.json')
        controller = controller_file.load(source)
        if not isinstance(controller.ear, Ear):
            raise ValueError(f'{options.controller}: expected a controller with an ear, got one '
                             'that is primed with words: evolve it on the new word instead')
        taught = teach(controller.ear, Vocabulary.load(options.vocabulary), options.word,
                       options.behaviour)
        target = options.out or source
        controller_file.save(replace(controller, ear=taught.ear), target)
    except (ValueError, OSError) as error:
        print(f'w2b teach: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{", ".join(taught.words)}: {options.behaviour}; written to {target}')
    print(f'{len(taught.changes)} other words are answered otherwise now'
          + (':' if taught.changes else ''))
    for change in taught.changes[:CHANGES_SHOWN]:
        print(f'  {change.word}: {change.before or "refused"} -> {change.after or "refused"}')
    if len(taught.changes) > CHANGES_SHOWN:
        print(f'  and {len(taught.changes) - CHANGES_SHOWN} more')
    return 0
