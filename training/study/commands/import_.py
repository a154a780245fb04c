"""
Take up finished runs from a file: `python -m training study import FILE DIR`.

DIR is a study of the same configuration, engine results and vocabulary, or is made. The file is
checked as a whole before anything is written. Refused, with the reason: a damaged file, half a
run, runs of another configuration or of other engine results, and runs that DIR has already.

Others can add seeds so: they run CONFIG.yaml with another `first_seed`, export, and send the file.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from training.study.directory import StudyDirectory, StudyError
from training.study.record import RecordError
from training.study.transfer import import_record


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('file', type=Path, metavar='FILE', help='as `study export` wrote it')
    add('study', type=Path, metavar='DIR', help='the study that takes the runs up, or is made')
    add('--new-only', action='store_true',
        help='leave out runs that DIR has already, after checking that they are the same')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        runs = import_record(args.file, StudyDirectory(args.study), new_only=args.new_only)
    except (StudyError, RecordError, OSError, ValueError) as error:
        print(f'study import: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{len(runs)} runs taken up in {args.study}')
    print(f'next: python -m training report {shlex.quote(str(args.study))}')
    return 0
