"""
Pause a study: `python -m training study pause DIR`.

Returns when every worker has stopped between two generations (or two trials of a champion), so
that the processors are free; nothing is lost. `python -m training study resume DIR` lets it go on.
A study that is not running stays paused when it is started.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from training.study import pausing
from training.study.directory import StudyDirectory, StudyError
from training.study.provenance import utc_now


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study')
    parser.add_argument('--wait', type=float, default=120.0, metavar='S',
                        help='how long to wait for the workers (default: %(default)g)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 1 if workers still work, 2 for an error."""
    study = StudyDirectory(args.study)
    try:
        study.about()
        pausing.pause(study.path, utc_now())
    except (StudyError, OSError) as error:
        print(f'study pause: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    end = time.monotonic() + args.wait
    while working := pausing.at_work(study.path):
        if time.monotonic() >= end:
            print(f'study pause: the switch is thrown, but after {args.wait:g} s these runs are '
                  f'still at work: {", ".join(working)}; wait and look with `study status`',
                  file=sys.stderr)
            return 1
        time.sleep(pausing.LOOK_S)
    print(f'paused: {args.study}; `python -m training study resume {args.study}` lets it go on')
    return 0
