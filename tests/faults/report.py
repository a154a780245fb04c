"""
`make faults`: every fault, and how soon the robot is safe, next to the stated bounds.

    python -m tests.faults.report [--json]

Frames are of 50 ms. Exit code 1 if a bound is not kept.
"""

from __future__ import annotations

import argparse
import json
import sys

from tests.faults.catalogue import FAULTS


def main() -> None:
    """Run all scenarios and print the table."""
    parser = argparse.ArgumentParser(description='Table of faults and times to the safe outcome.')
    parser.add_argument('--json', action='store_true')
    arguments = parser.parse_args()
    rows, kept = [], True
    for fault in FAULTS:
        try:
            outcome = fault.run()
        except AssertionError as error:
            row = {'seen_frames': None, 'seen_ms': None, 'kept': False, 'error': str(error)}
        else:
            row = {'seen_frames': outcome.frames, 'seen_ms': round(outcome.ms, 1),
                   'kept': (outcome.frames <= fault.most_frames
                            and outcome.ms <= fault.most_ms + 1e-6)}
        rows.append({'fault': fault.name, 'safe': fault.safe, 'bound_frames': fault.most_frames,
                     'bound_ms': fault.most_ms, **row})
        kept &= bool(row['kept'])
    if arguments.json:
        print(json.dumps(rows, indent=1))
    else:
        print(f'{"fault":<42} {"frames":>6} {"ms":>8} | {"bound":>6} {"ms":>6} | safe outcome')
        for row in rows:
            seen = f'{row["seen_frames"]:>6} {row["seen_ms"]:>8.1f}' if 'error' not in row \
                else f'{"failed":>15}'
            print(f'{row["fault"]:<42} {seen} | {row["bound_frames"]:>6} {row["bound_ms"]:>6.0f} '
                  f'| {row["safe"]}{"" if row["kept"] else "   NOT KEPT"}')
    sys.exit(0 if kept else 1)


if __name__ == '__main__':
    main()
