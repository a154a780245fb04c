"""`w2b arm`, `disarm`, `stop`, `reset`, `pause`: one service call each, and its answer."""

from __future__ import annotations

import sys
from typing import Any

from w2b_controller.cli import client
from w2b_controller.cli.client import DONE, REFUSED, Client
from w2b_core.shell import w2b_command


def _no_node(node: str) -> str:
    return f'no {node} node answers; start one with `{w2b_command(node)}`'


def arm() -> int:
    """Arm the robot; return 0, 1 with the reason if it refuses, 2 if nobody answers."""
    return _trigger('arm', 'hardware/arm',
                    'Arm the robot: the servos are energised one by one. Needs a calibration and '
                    'fresh targets (a brain that runs).', _no_node('hardware'))


def disarm() -> int:
    """Disarm the robot."""
    return _trigger('disarm', 'hardware/disarm', 'Park the robot, then turn the servos off.',
                    _no_node('hardware'))


def stop() -> int:
    """Stop the robot at once."""
    return _trigger(
        'stop', 'hardware/emergency_stop',
        f'Emergency stop: all servos off, now. Without a node, `{w2b_command("relax")}` does it '
        'over the bus.',
        f'no hardware node answers: cut the supply, or turn the servos off over the bus with '
        f'`{w2b_command("relax")}` (a simulation is stopped by `{w2b_command("pause")}`)')


def reset() -> int:
    """Put the simulated body back to its start."""
    return _trigger('reset', 'sim/reset', 'Put the simulated body back to its start.',
                    _no_node('sim'))


def pause() -> int:
    """Stop the simulation, or let it run."""
    parser = client.parser('pause', 'Stop the simulation (on), or let it run again (off).')
    parser.add_argument('state', nargs='?', choices=('on', 'off'), default='on',
                        help='default: on')
    options = parser.parse_args(client.arguments())

    def call(connection: Client) -> int:
        from std_srvs.srv import SetBool
        return _show(connection.call(SetBool, 'sim/pause',
                                     SetBool.Request(data=options.state == 'on'),
                                     options.timeout, _no_node('sim')))
    return client.run('pause', call)


def _trigger(name: str, service: str, about: str, absent: str) -> int:
    options = client.parser(name, about).parse_args(client.arguments())

    def call(connection: Client) -> int:
        from std_srvs.srv import Trigger
        return _show(connection.call(Trigger, service, Trigger.Request(), options.timeout, absent))
    return client.run(name, call)


def _show(response: Any) -> int:
    print(response.message or ('done' if response.success else 'refused without a reason'),
          file=sys.stdout if response.success else sys.stderr)
    return DONE if response.success else REFUSED
