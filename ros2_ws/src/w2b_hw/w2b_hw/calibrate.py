"""
`w2b calibrate`: find each servo's zero, range and direction from the keyboard.

Works in any terminal, over SSH too. It starts and ends with all servos off, drives one servo at a
time, and saves atomically. No ROS is needed.
"""

from __future__ import annotations

import argparse
import os
import select
import shutil
import signal
import sys
import termios
import tty
from pathlib import Path
from types import FrameType

from w2b_hw import calibration, command_line
from w2b_hw.calibration import DEFAULT_PATH, Calibration, CalibrationError
from w2b_hw.calibration_session import HELP, Session
from w2b_hw.guard import Guard
from w2b_hw.joints import BODY, TWIN, JointList, named
from w2b_hw.servo_bank import ChipStateError, ServoBank
from w2b_hw.transport import DEFAULT_DEVICE, EMULATED, open_transport

_SIGN_OF_LIFE_EVERY_S = 0.1
_CTRL_C, _CTRL_D = '\x03', '\x04'


class Terminal:
    """Keys one by one, without echo; the terminal is as it was afterwards."""

    def __init__(self) -> None:
        self._descriptor = sys.stdin.fileno()

    def __enter__(self) -> Terminal:
        self._before = termios.tcgetattr(self._descriptor)
        tty.setraw(self._descriptor)
        return self

    def __exit__(self, *_: object) -> None:
        termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)

    def key(self, timeout_s: float) -> str | None:
        """Return the next key; None if there was none; Ctrl-D if the line was cut."""
        ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
        if not ready:
            return None
        return os.read(self._descriptor, 1).decode(errors='replace') or _CTRL_D

    def print(self, text: str) -> None:
        """Print lines; in raw mode a line feed alone does not return."""
        sys.stdout.write(text.replace('\n', '\r\n') + '\r\n')
        sys.stdout.flush()


class _Ended(BaseException):
    """A signal ends the program: SIGTERM, or SIGHUP when the SSH connection is lost."""


def run(session: Session, terminal: Terminal, path: Path, guard: Guard | None) -> None:
    """Turn keys into calibration until the user leaves."""
    terminal.print(HELP)
    terminal.print(session.show())
    leaving = False
    while True:
        if guard is not None:
            guard.sign_of_life(session.driven)
        key = terminal.key(_SIGN_OF_LIFE_EVERY_S)
        if key is None:
            continue
        if key in ('q', _CTRL_C, _CTRL_D):
            session.relax()
            if not session.saved and key == _CTRL_D:
                terminal.print('NOT SAVED: what was found is lost')
            if session.saved or leaving or key == _CTRL_D:
                return
            session.message = 'NOT SAVED: s saves, q again leaves without'
            leaving = True
        elif key == 's':
            try:
                finished = session.finished()
                aside = '' if session.in_file else keep_aside(path)
                calibration.save(finished, path)
                session.saved = session.in_file = True
                session.message = f'saved {path}'
                session.message += ''.join(
                    f'; {note}' for note in (aside, finished.problem) if note)
            except (CalibrationError, OSError) as error:
                session.saved = False
                session.message = f'not saved: {error}'
        else:
            leaving = False
            session.press(key)
        terminal.print(session.show())


def keep_aside(path: Path) -> str:
    """Keep a file that could not be read under another name; return a note, empty if none is."""
    if not path.is_file():
        return ''
    number = 1
    while (kept := path.with_name(f'{path.name}.before.{number}')).exists():
        number += 1
    # A copy: if the save then fails, the file is still where it was.
    shutil.copy2(path, kept)
    return f'what was there before is {kept.name}'


def start_from(path: Path, joints: JointList = TWIN) -> tuple[Calibration, str, bool]:
    """Return the calibration to begin with, where it came from, and whether that is the file."""
    try:
        return calibration.load(path, joints), f'beginning from {path}', True
    except CalibrationError as error:
        return (calibration.nominal(calibrated=False, joints=joints),
                f'beginning from nominal values ({error})', False)


@command_line.command
def main() -> None:
    """Calibrate; exit code 1 with one line if that cannot be done."""
    parser = argparse.ArgumentParser(description='Calibrate the servos from the keyboard.')
    parser.add_argument('--transport', default=DEFAULT_DEVICE,
                        help='bus device, or emulated[:SOCKET] (default: %(default)s)')
    parser.add_argument('--file', type=Path, default=DEFAULT_PATH, help='(default: %(default)s)')
    parser.add_argument('--body', default=BODY,
                        help='body that the robot is built as (default: %(default)s)')
    parser.add_argument('--seal', action='store_true',
                        help='only check a file that was edited by hand and renew its checksum')
    arguments = parser.parse_args(command_line.own())
    path = arguments.file.expanduser()
    try:
        if arguments.seal:
            sealed = calibration.seal(path, named(arguments.body))
            print(f'calibrate: {path} is in order; its checksum is new')
            for note in filter(None, (sealed.problem, *(servo.doubt for servo in sealed.servos))):
                print(f'calibrate: but {note}')
        else:
            _calibrate(path, arguments.transport, named(arguments.body))
    except (OSError, ValueError, ChipStateError, RuntimeError) as error:
        sys.exit(f'calibrate: {error}')


def _calibrate(path: Path, transport_name: str, joints: JointList) -> None:
    if not sys.stdin.isatty():
        raise ValueError('expected a terminal; over SSH use `ssh -t`')
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _end)
    start, origin, in_file = start_from(path, joints)
    transport = open_transport(transport_name, exclusive=True)
    bank = ServoBank(transport, range(16), address=start.board.address,
                     oscillator_hz=start.board.oscillator_hz,
                     frequency_hz=start.board.frequency_hz)
    bank.connect()
    guard = None if transport_name == EMULATED else Guard(transport_name, start.board.address)
    try:
        with Terminal() as terminal:
            terminal.print(origin)
            run(Session(bank, start, in_file), terminal, path, guard)
    except _Ended:
        return
    finally:
        try:
            bank.relax()
        finally:
            transport.close()
            if guard is not None:
                guard.close()


def _end(number: int, frame: FrameType | None) -> None:
    raise _Ended


if __name__ == '__main__':
    main()
