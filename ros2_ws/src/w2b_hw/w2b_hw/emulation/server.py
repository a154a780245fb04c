"""`emulator`: emulated chips in a process of their own, on a simulated body if one is named."""

from __future__ import annotations

import argparse
import os
import sys
import threading
from pathlib import Path

from w2b_hw import command_line
from w2b_hw.emulation.chip_server import ChipServer
from w2b_hw.emulation.robot import IMUS

__all__ = ['ChipServer', 'main']


@command_line.command
def main() -> None:
    """Serve emulated chips."""
    parser = argparse.ArgumentParser(description='Serve emulated chips on a Unix socket.')
    parser.add_argument('path', help='path of the socket')
    parser.add_argument('--imu', choices=IMUS, default='lsm6dsox')
    parser.add_argument('--body', default='', metavar='BODY',
                        help='a simulated body that the chips sit on: their pulses move it, and '
                             'it moves their IMU, in real time')
    parser.add_argument('--engine', default='mujoco', metavar='ENGINE',
                        help='what moves it (default: %(default)s)')
    parser.add_argument('--calibration', type=Path, default=None, metavar='FILE',
                        help='what its servos are like in truth (default: a nominal robot)')
    parser.add_argument('--lockstep', action='store_true',
                        help="the body's time is what the hardware node tells it "
                             '(transport:=simulated:SOCKET)')
    parser.add_argument('--end-with-stdin', action='store_true',
                        help='end when standard input does: with the process that started this')
    arguments = parser.parse_args(command_line.own())
    try:
        server = _server(arguments)
    except (ValueError, OSError) as error:
        print(f'emulator: {" ".join(str(error).split())}', file=sys.stderr)
        sys.exit(2)
    if arguments.end_with_stdin:
        threading.Thread(target=_end_with_stdin, daemon=True).start()
    print(f'emulated chips at {arguments.path}', flush=True)
    try:
        server.serve()
    except KeyboardInterrupt:
        sys.exit(0)


def _server(arguments: argparse.Namespace) -> ChipServer:
    if not arguments.body:
        return ChipServer(arguments.path, arguments.imu)
    from w2b_hw import calibration, joints
    from w2b_hw.emulation.coupled import CoupledServer

    robot = arguments.calibration
    return CoupledServer(
        arguments.path, arguments.imu, body=arguments.body, engine=arguments.engine,
        calibration=None if robot is None else calibration.load(
            robot, joints.named(arguments.body)),
        lockstep=arguments.lockstep)


def _end_with_stdin() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        continue
    os._exit(0)


if __name__ == '__main__':
    main()
