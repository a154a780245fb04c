"""
What a controller does in an independent engine: `python -m training judge CONTROLLER`.

Every behaviour is asked for from slightly different starts, and figures are medians over them
unless they say *worst*. `body_lengths_per_s` counts in the direction that was asked for,
`heading_error_deg` is the size of the change of heading since the word. With `--imu-noise`,
`--gyro-bias` or `--hard` the attitude comes from a simulated LSM6DSOX, averaged over each frame, by
the filter that the hardware node runs, and the robot stands for 6 s before the word, in which the
filter learns the gyroscope's bias. `--switch S` also says a new word every S seconds, all ordered
pairs from up to three starts: each must be obeyed within 2 s and still at its end.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import Any

import numpy as np

from training.judge.conditions import Conditions, Trial, trials
from training.judge.table import HEAD, line, summary
from training.judge.trial import Plan, Seen, run
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller
from w2b_core.hearing.heard import Heard
from w2b_core.network import LeakyNetwork
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines import registry
from w2b_sim.worlds import WORLDS

#: Every pair of words takes minutes in PyBullet.
SWITCH_STARTS = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('controller', help='a controller file, or the name of one that ships')
    add('--body', default=None, metavar='NAME_OR_FILE',
        help='refuse unless this is the body that the controller was made on')
    add('--engine', choices=registry.stepwise_names(), default=registry.DEFAULT,
        help='default: %(default)s')
    add('--starts', type=int, default=20, metavar='N', help='default: %(default)s')
    add('--seconds', type=float, default=10.0, metavar='S',
        help='of each behaviour (default: %(default)s)')
    add('--friction', type=float, default=None, metavar='F', help="instead of the world's")
    add('--latency', action='store_true', help='targets act one control period late')
    add('--zeros-off', type=float, default=0.0, metavar='RAD',
        help='each servo is off by up to so much')
    add('--mass', type=float, default=1.0, metavar='SCALE', help='of all links')
    add('--servo', type=float, default=1.0, metavar='SCALE', help='of speed and torque')
    add('--imu-noise', action='store_true', help="a simulated IMU and the robot's own filter")
    add('--gyro-bias', type=float, default=0.0, metavar='RAD_S', help='of each axis, either way')
    add('--no-imu', action='store_true', help='senses of the attitude feel nothing')
    add('--hard', action='store_true',
        help='all disturbances together; what is not given is drawn for each start')
    add('--switch', type=float, default=0.0, metavar='S', help='a new word every S seconds, too')
    add('--seed', type=int, default=0, metavar='N', help='of starts and draws (default: 0)')
    add('--processes', type=int, default=1, metavar='N', help='changes no result (default: 1)')
    add('--json', action='store_true', help='print JSON')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 2 for an error, 130 if interrupted."""
    try:
        return _judge(args)
    except (ValueError, OSError) as error:
        print(f'judge: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('judge: interrupted; nothing was kept', file=sys.stderr)
        return 130


def _judge(args: argparse.Namespace) -> int:
    for name, value, least in (('starts', args.starts, 1), ('processes', args.processes, 1),
                               ('seed', args.seed, 0)):
        if value < least:
            raise ValueError(f'--{name}: expected at least {least}, got {value}')
    if not 1.0 <= args.seconds <= 3600:
        raise ValueError(f'--seconds: expected 1 to 3600, got {args.seconds}')
    if args.switch and not 1.0 <= args.switch <= 60:
        raise ValueError(f'--switch: expected 1 to 60 seconds, got {args.switch}')
    conditions = Conditions(
        args.friction, args.latency, args.zeros_off, args.mass, args.servo, args.imu_noise,
        args.gyro_bias, args.no_imu, args.hard, args.seed)
    controller = controller_file.load(controller_file.resolve(args.controller))
    if args.body is not None:
        controller.refuse_another_body(bodies.check(args.body))
    plan = Plan(args.engine, args.seconds, args.switch, conditions)
    result = judge(controller, plan, args.starts, args.processes)
    if args.json:
        print(json.dumps(result))
        return 0
    print(f'{args.controller}: {controller.body} in {args.engine}, {args.starts} starts, '
          f'{args.seconds:g} s')
    print(HEAD)
    for name, row in result['behaviours'].items():
        print(line(name, row))
    if args.switch:
        switches = result['switches']
        print(f'words switched every {args.switch:g} s: {switches["obeyed"]} of {switches["of"]} '
              'obeyed' + (f'; not {", ".join(switches["missed"])}' if switches['missed'] else ''))
    return 0


def judge(controller: Controller, plan: Plan, starts: int, processes: int = 1, *,
          only: Collection[str] = ()) -> dict[str, Any]:
    """
    Return what `--json` prints; with `only`, of these behaviours.

    Raises
    ------
    ValueError
        If the body is not registered, the controller is not of its joints, or the engine does not
        model it.

    """
    body = controller.described()
    commands = {name: heard for name, heard in commands_of(controller).items()
                if not only or name in only}
    every = trials(body, WORLDS[body.world], plan.conditions, starts)
    seen = list(_run(controller, commands, every, plan, processes))
    return summary(seen, body.length_m)


def commands_of(controller: Controller) -> dict[str, Heard]:
    """
    Return how each behaviour is asked for.

    An ear's legs get the pure command; a serial network hears a word that it was trained on, the
    behaviour's own name where that is one. (ValueError if the words' vectors are others by now.)
    """
    if isinstance(controller.network, LeakyNetwork):
        return {name: Heard(command=row) for name, row in
                zip(controller.behaviours, np.eye(len(controller.behaviours)), strict=True)}
    vocabulary = Vocabulary.load()
    words: dict[str, str] = {}
    for word in controller.words:
        if word.word == word.behaviour:
            words[word.behaviour] = word.word
        words.setdefault(word.behaviour, word.word)
    if not words:
        raise ValueError('controller: expected one with its trained words, got none')
    changed = set(controller.changed_words(vocabulary)) & set(words.values())
    if changed:
        raise ValueError(f'controller: expected one trained on the vectors of the default '
                         f'vocabulary, got another vector of {sorted(changed)[0]!r}')
    return {behaviour: Heard(signal=vocabulary.phrase(word).signal)
            for behaviour, word in words.items()}


def _run(controller: Controller, commands: dict[str, Heard], every: Sequence[Trial], plan: Plan,
         processes: int) -> Iterator[Seen]:
    without = replace(plan, switch_s=0.0)
    plans = [plan if number < SWITCH_STARTS else without for number in range(len(every))]
    tasks = [(controller, commands, trial, one) for trial, one in zip(every, plans, strict=True)]
    if processes == 1:
        yield from (run(*task) for task in tasks)
        return
    with ProcessPoolExecutor(processes, get_context('spawn')) as pool:
        yield from pool.map(run, *zip(*tasks, strict=True))
