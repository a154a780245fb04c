"""
Words move the simulated robot: sim and brain as two processes, over real ROS 2.

Says five words, each from the same start: three that the controller heard in training, one that it
never heard, one that no vocabulary holds. Prints a table and writes to --out:

    table.json       what the table says
    paths.png        the robot's path under each word
    robot.gif        the walking robot
    brain.log, sim.log

Exit code 0 when every step succeeded. Takes about a minute. Usage: make demo
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import rclpy
from rich.console import Console
from rich.table import Table

from demo.robot import Motion as Watched
from demo.robot import Robot
from demo.ros_session import RosSession
from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.command_process import command
from w2b_core.controller import file as controller_file
from w2b_core.outcome import Motion
from w2b_sim.worlds import WORLDS

#: What is said, and the behaviour that it asks for.
MEANING = {'forward': 'forward', 'stop': 'stop', 'backward': 'backward', 'halt': 'stop'}
BOUNDS = Bounds(move_m=0.3, still_m=0.1)
UNKNOWN_WORD = 'forwrad'


@command
def main() -> int:
    """Run the demo; return the exit code."""
    parser = argparse.ArgumentParser(prog='python -m demo', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--out', type=Path, default=Path('out/demo'), help='folder for the results')
    parser.add_argument('--controller', default='quadruped',
                        help='shipped controller or path of a controller file')
    options = parser.parse_args()
    console = Console()
    try:
        return run(options.out, options.controller, console)
    except (RuntimeError, ValueError, OSError) as error:
        console.print(f'demo: {error}', style='red', markup=False)
        return 1
    except KeyboardInterrupt:
        return 130


def run(out: Path, controller_name: str, console: Console) -> int:
    """Run all words; RuntimeError if a process died or did not answer in time."""
    controller = controller_file.load(controller_file.resolve(controller_name))
    body = bodies.get(controller.body)
    heard = {trained.word for trained in controller.words}
    motions: dict[str, Watched] = {}
    failures: list[str] = []
    with RosSession(out) as session:
        session.start('sim', body=body.name, world=body.world)
        session.start('brain', controller=controller_name)
        rclpy.init()
        try:
            robot = Robot(session)
            for word in MEANING:
                console.print(f'[bold]say {word}[/bold]')
                robot.start_over()
                accepted, answer = robot.say(word)
                console.print(f'  {answer}', markup=False, highlight=False)
                if not accepted:
                    failures.append(f'{word} was not accepted: {answer}')
                    continue
                motions[word] = robot.watch(WORLDS[body.world].steps)
            console.print(f'[bold]say {UNKNOWN_WORD}[/bold]')
            accepted, answer = robot.say(UNKNOWN_WORD)
            console.print(f'  {answer}', markup=False, highlight=False)
            if accepted:
                failures.append(f'{UNKNOWN_WORD} is no word, and was accepted')
        finally:
            rclpy.try_shutdown()
    failures += _show(console, motions, heard, answer, out)
    for failure in failures:
        console.print(f'demo: {failure}', style='red', markup=False)
    if not motions:
        return 1
    console.print('Drawing the robot ...')
    from demo.pictures import draw_gif, plot_paths
    captions = {word: f'{word}: {"heard in training" if word in heard else "never heard before"}'
                for word in motions}
    plot_paths(motions, heard, out / 'paths.png')
    draw_gif(body, robot.joint_names, motions, captions, out / 'robot.gif')
    console.print(f'Wrote {out}/paths.png, {out}/robot.gif, {out}/table.json')
    return 1 if failures else 0


def _show(console: Console, motions: dict[str, Watched], heard: set[str], refusal: str,
          out: Path) -> list[str]:
    """Print and write the table; return what contradicts the words' meaning."""
    table = Table(title='What the robot did in 25 s of simulated time')
    for heading in ('word', 'heard in training', 'x (m)', 'distance (m)', 'path (m)'):
        table.add_column(heading, justify='left' if heading == 'word' else 'right')
    rows, failures = [], []
    for word, motion in motions.items():
        x, distance = motion.displacement_m[0], float(np.linalg.norm(motion.displacement_m))
        table.add_row(word, 'yes' if word in heard else 'no', f'{x:+.3f}', f'{distance:.3f}',
                      f'{motion.path_length_m:.2f}')
        rows.append({'word': word, 'heard_in_training': word in heard, 'x_m': round(float(x), 4),
                     'distance_m': round(distance, 4),
                     'path_length_m': round(motion.path_length_m, 4)})
        asked = MEANING[word]
        right = BEHAVIOURS.get(asked).obeyed(
            Motion(np.asarray(x), np.asarray(distance)), BOUNDS)
        if not right:
            failures.append(f'{word}: the robot ended {x:+.2f} m in x, {distance:.2f} m away')
    table.add_row(UNKNOWN_WORD, 'no such word', '', '', '')
    rows.append({'word': UNKNOWN_WORD, 'answer': refusal})
    console.print(table)
    (out / 'table.json').write_text(json.dumps(rows, indent=2) + '\n', encoding='utf-8')
    return failures


if __name__ == '__main__':
    sys.exit(main())
