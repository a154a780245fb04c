"""Let a paused study go on: `python -m training study resume DIR`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from training.study import pausing
from training.study.directory import StudyDirectory, StudyError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    study = StudyDirectory(args.study)
    try:
        study.about()
        was_paused = pausing.resume(study.path)
    except (StudyError, OSError) as error:
        print(f'study resume: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{args.study} goes on' if was_paused else f'{args.study} was not paused')
    return 0
