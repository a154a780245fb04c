"""
Words move the simulated robot: sim and brain as two processes, over real ROS 2.

Says words one after the other, some of which the controller never heard in training, one that is
no command and one that is spelt wrong. Prints a table and writes to --out:

    table.json       what the table says
    paths.png        the robot's path under each word
    robot.gif        the walking robot, at true speed
    brain.log, sim.log

Exit code 0 when the robot did what every word asks for. Takes about a minute. Usage: make demo
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import rclpy
from rich.console import Console
from rich.table import Table

from demo.film import COLOURS, Take, draw_gif
from demo.robot import Motion, Robot
from demo.ros_session import RosSession
from demo.script import MISSPELT, Line, Seen, heard_in_training, script_of, seen
from w2b_core.command_process import command
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller

#: How long a robot may use to come to rest after a stop word.
SETTLE_S = 1.0


@command
def main() -> int:
    """Run the demo; return the exit code."""
    parser = argparse.ArgumentParser(prog='python -m demo', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--out', type=Path, default=Path('out/demo'), help='folder for the results')
    parser.add_argument('--controller', default='physical_twin',
                        help="shipped controller, path of a controller file, or of a robot's YAML "
                        'with its controller beside it (default: %(default)s)')
    parser.add_argument('--engine', default='pybullet', help='simulator (default: %(default)s)')
    options = parser.parse_args()
    console = Console()
    try:
        return run(options.out, options.controller, options.engine, console)
    except (RuntimeError, ValueError, OSError) as error:
        console.print(f'demo: {error}', style='red', markup=False)
        return 1
    except KeyboardInterrupt:
        return 130


def run(out: Path, controller_name: str, engine: str, console: Console) -> int:
    """Say all words; RuntimeError if a process died or did not answer in time."""
    controller = controller_file.load(controller_file.resolve(controller_name))
    body = controller.described()
    shown: list[tuple[Seen, Motion]] = []
    failures: list[str] = []
    with RosSession(out) as session:
        session.start('sim', body=controller_file.body_argument(controller, controller_name),
                      world=body.world, engine=engine)
        session.start('brain', controller=controller_name)
        rclpy.init()
        try:
            robot = Robot(session)
            robot.start_over()
            for line in script_of(controller):
                if controller.ear is None:
                    # Primed networks walk in arcs: each word from the same start.
                    robot.start_over()
                found = _say(robot, line, controller, body.height_m, console)
                shown.append(found)
                failures += _contradicts(found[0], body.length_m)
            accepted, refusal = robot.say(MISSPELT)
            console.print(f'[bold]{MISSPELT}[/bold]: {refusal}')
            if accepted:
                failures.append(f'{MISSPELT} is no word, and was accepted')
        finally:
            rclpy.try_shutdown()
    _write_table(console, shown, refusal, out)
    for failure in failures:
        console.print(f'demo: {failure}', style='red', markup=False)
    console.print('Drawing the robot ...')
    from demo.pictures import plot_paths  # after `command` has seen to matplotlib's backend

    plot_paths(shown, out / 'paths.png')
    takes = [Take(motion, _caption(found), COLOURS[number % len(COLOURS)])
             for number, (found, motion) in enumerate(shown)]
    draw_gif(body, robot.joint_names, takes, controller.period_s, out / 'robot.gif')
    console.print(f'Wrote {out}/paths.png, {out}/robot.gif, {out}/table.json')
    return 1 if failures else 0


def _say(robot: Robot, line: Line, controller: Controller, stand_m: float,
         console: Console) -> tuple[Seen, Motion]:
    accepted, answer = robot.say(line.word)
    console.print(f'[bold]{line.word}[/bold]: {answer}', highlight=False)
    if accepted != bool(line.behaviour):
        raise RuntimeError(f'{line.word} was {"" if accepted else "not "}accepted: {answer}')
    motion = robot.watch(round(line.seconds / controller.period_s))
    return seen(line, answer, heard_in_training(controller, line.word), motion, stand_m, SETTLE_S,
                controller.period_s), motion


def _contradicts(found: Seen, length_m: float) -> list[str]:
    """Return what contradicts the word's meaning."""
    if not found.line.behaviour or found.obeyed(length_m):
        return []
    return [f'{found.line.word}: the robot went {found.along_m:+.2f} m along, is '
            f'{found.away_m:.2f} m away and turned {found.turned_deg:+.0f} degrees']


def _caption(found: Seen) -> str:
    if not found.line.behaviour:
        return f'“{found.line.word}”: no command, refused; it goes on'
    new = '' if found.trained else ' (never heard in training)'
    return f'“{found.line.word}”{new}'


def _write_table(console: Console, shown: list[tuple[Seen, Motion]], refusal: str,
                 out: Path) -> None:
    """Print the table and write it."""
    table = Table(title='What the robot did')
    for heading in ('word', 'heard in training', 'asks for', 'along (m)', 'away (m)',
                    'turned (deg)'):
        table.add_column(heading, justify='left' if heading in ('word', 'asks for') else 'right')
    rows = []
    for found, motion in shown:
        trained = 'yes' if found.trained else 'no'
        table.add_row(found.line.word, trained, found.line.behaviour or 'nothing: refused',
                      f'{found.along_m:+.3f}', f'{found.away_m:.3f}', f'{found.turned_deg:+.0f}')
        rows.append({'word': found.line.word, 'heard_in_training': found.trained,
                     'behaviour': found.line.behaviour, 'seconds': found.line.seconds,
                     'along_m': round(found.along_m, 4), 'distance_m': round(found.away_m, 4),
                     'turned_deg': round(found.turned_deg, 1),
                     'path_length_m': round(motion.path_length_m, 4), 'answer': found.answer})
    table.add_row(MISSPELT, 'no such word', 'refused', '', '', '')
    rows.append({'word': MISSPELT, 'answer': refusal})
    console.print(table)
    (out / 'table.json').write_text(json.dumps(rows, indent=2) + '\n', encoding='utf-8')


if __name__ == '__main__':
    sys.exit(main())
