"""`w2b play`: a robot, a brain and the page, until Ctrl-C."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
import webbrowser
from collections.abc import Mapping
from pathlib import Path

from w2b_core import bodies
from w2b_core.command_process import command
from w2b_core.controller import file as controller_file
from w2b_ros.ros_process import StopFlag
from w2b_web.children import Child, end_all

ABOUT = """\
Start a robot, a brain and the page that shows them; end them all with Ctrl-C.

  w2b play                                   a simulated robot in PyBullet
  w2b play --engine mujoco --robot quadruped
  w2b play --robot my_robot.yaml             one of your own, with the controller beside it
  w2b play --hardware simulated              the robot's own drivers, on chips of a simulated body
  w2b play --hardware emulated               the same on chips without a body: nothing walks
"""
PORT = 8096
START_S = 60.0
POLL_S = 0.1
FAILED = 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='w2b play', description=ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='In another shell, w2b say and the others talk to this robot too.')
    parser.add_argument('--robot', default='physical_twin', metavar='CONTROLLER',
                        help="controller that ships, a controller file, or a robot's YAML with "
                        'its controller beside it; the body follows from '
                        f'it (default: %(default)s; {", ".join(controller_file.shipped_names())})')
    parser.add_argument('--engine', default='pybullet',
                        help='that simulates the body: pybullet or mujoco (default: %(default)s)')
    parser.add_argument('--hardware', choices=['simulated', 'emulated'], default=None,
                        help='the hardware node instead of the simulation; arm it on the page')
    parser.add_argument('--speed', type=float, default=1.0, metavar='X',
                        help='simulated seconds a second (default: %(default)s)')
    parser.add_argument('--port', type=int, default=PORT, help='of the page (default: %(default)s)')
    parser.add_argument('--namespace', '--ns', default='', metavar='/NAME', help='of the robot')
    parser.add_argument('--no-browser', action='store_true', help='print the address only')
    return parser.parse_args()


def processes(options: argparse.Namespace) -> dict[str, list[str]]:
    """
    Return what is started: subcommand of `w2b` -> its arguments.

    Raises
    ------
    ValueError, OSError
        If the controller cannot be read.

    """
    body = controller_file.body_argument(
        controller_file.load(controller_file.resolve(options.robot)), options.robot)
    if options.hardware is None:
        node, moved_by = 'sim', {'engine': options.engine}
    else:
        node, moved_by = 'hardware', {'transport': options.hardware}
    started: dict[str, dict[str, object]] = {
        node: {'body': body, **moved_by, 'real_time_factor': options.speed},
        'brain': {'controller': options.robot}}
    if bodies.is_file(body):
        # The name that a body says of itself opens no file: the page is told how it looks.
        started['description'] = {'body': body}
    started['page'] = {'port': options.port}
    name = ['-r', f'__ns:=/{options.namespace.strip("/")}'] if options.namespace else []
    return {node: ['--ros-args', *name, *(
        word for key, value in given.items() for word in ('-p', f'{key}:={value}'))]
        for node, given in started.items()}


@command
def main() -> int:
    """Run until a signal, or until one of the processes ends; return the exit code."""
    stop = StopFlag()
    stop.install()
    signal.signal(signal.SIGHUP, lambda _number, _frame: setattr(stop, 'requested', True))
    options = _arguments()
    try:
        wanted = processes(options)
    except (ValueError, OSError) as error:
        print(f'w2b play: {" ".join(str(error).split())}', file=sys.stderr)
        return FAILED
    with tempfile.TemporaryDirectory(prefix='w2b-play-') as folder:
        print(f'play: starting {", ".join(wanted)} ...', flush=True)
        children = [Child(name, arguments, Path(folder) / f'{name}.log')
                    for name, arguments in wanted.items()]
        try:
            return _watch(children, stop, options)
        finally:
            end_all(children)
            print('play: all ended', flush=True)


def _watch(children: list[Child], stop: StopFlag, options: argparse.Namespace) -> int:
    page, until_s, told = children[-1], time.monotonic() + START_S, False
    while not stop.requested:
        for child in children:
            if child.exit_code is not None:
                print(f'play: {child.name} ended with {child.exit_code}:\n{child.tail()}',
                      file=sys.stderr)
                return FAILED
        if not told and (address := page.found(r'open (https?://\S+) in a browser')):
            told = True
            _tell(address, options)
        if not told and time.monotonic() > until_s:
            print(f'play: the page did not start within {START_S:g} s:\n{page.tail()}',
                  file=sys.stderr)
            return FAILED
        time.sleep(POLL_S)
    return 0


def _tell(address: str, options: argparse.Namespace) -> None:
    arm = '' if options.hardware is None else '; press Arm there, then say a word'
    print(f'play: open {address} in a browser{arm} (Ctrl-C here ends all)', flush=True)
    if not options.no_browser and has_display(os.environ):
        webbrowser.open(address)


def has_display(environment: Mapping[str, str]) -> bool:
    """Return whether there is a screen to open a browser on."""
    return any(environment.get(name) for name in ('DISPLAY', 'WAYLAND_DISPLAY'))


if __name__ == '__main__':
    raise SystemExit(main())
