"""
Streams, signals and locales, handled for every command in any environment.

Needs the standard library only, so that the robot's tools run without other packages.
"""

from __future__ import annotations

import errno
import os
import select
import signal
import sys
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

P = ParamSpec('P')

#: Exit code of a command whose reader has seen enough, as a shell gives it for SIGPIPE.
READER_GONE = 128 + signal.SIGPIPE
#: Exit code of a command whose output could not be written.
UNWRITTEN = 1
#: Exit code of a command that lacks a package.
MISSING = 2
#: Module -> what pip calls it, where that is another name.
PACKAGES = {'yaml': 'PyYAML', 'board': 'adafruit-blinka', 'busio': 'adafruit-blinka',
            'adafruit_pca9685': 'adafruit-circuitpython-pca9685 adafruit-blinka'}


def command(main: Callable[P, int | None]) -> Callable[P, int | None]:
    """
    Return a command's `main` that handles closed streams, interrupts and odd locales.

    - Characters that an output cannot encode (PYTHONIOENCODING=ascii) are written by their code;
      input is UTF-8, and bytes that are not reach `main` as lone surrogates.
    - A reader that has gone, such as `head`, ends the command in silence, with `READER_GONE`; a
      full disk with one line and `UNWRITTEN`.
    - What a notebook or a debugging session left in the environment does not matter: matplotlib
      draws into files (MPLBACKEND), numba compiles (NUMBA_DISABLE_JIT).
    - Of a package that is not installed one line says how to install it.
    """
    @wraps(main)
    def run(*args: P.args, **kwargs: P.kwargs) -> int | None:
        _prepare()
        try:
            try:
                code = main(*args, **kwargs)
            except SystemExit:
                _flush()
                raise
            _flush()
        except BrokenPipeError:
            # A pipe or socket of another kind is the command's own affair.
            if not any(map(_reader_is_gone, (sys.stdout, sys.stderr))):
                raise
            _silence()
            return READER_GONE
        except ModuleNotFoundError as error:
            print(f'{_name()}: {missing(error)}', file=sys.stderr)
            return MISSING
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT) or error.filename is not None:
                raise
            _silence()
            print(f'{_name()}: expected to write the output, got {error.strerror}',
                  file=sys.stderr)
            return UNWRITTEN
        return code
    return run


def missing(error: ModuleNotFoundError) -> str:
    """Return in one line which package is missing and how to install it."""
    module = (error.name or str(error)).partition('.')[0]
    if module.startswith('w2b_'):
        remedy = 'build the workspace and source its setup.bash'
    elif module == 'rclpy' or module.endswith('_msgs') or module.endswith('_srvs'):
        remedy = 'source ROS 2 first (. /opt/ros/jazzy/setup.bash), or use scripts/ros_env'
    else:
        remedy = f'install it with `python -m pip install {PACKAGES.get(module, module)}`'
    return f'expected the Python package {module}, got none; {remedy}'


def _name() -> str:
    return os.path.basename(sys.argv[0]) or 'w2b'


def _prepare() -> None:
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, 'reconfigure'):
            stream.reconfigure(errors='backslashreplace')
    if hasattr(sys.stdin, 'reconfigure'):
        sys.stdin.reconfigure(encoding='utf-8', errors='surrogateescape')
    if 'MPLBACKEND' in os.environ:
        os.environ['MPLBACKEND'] = 'agg'
    os.environ.pop('NUMBA_DISABLE_JIT', None)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not stream.closed:
            stream.flush()


def _reader_is_gone(stream: object) -> bool:
    """Return whether an output stream is a pipe without a reader."""
    try:
        descriptor = stream.fileno()  # type: ignore[attr-defined]
    except (AttributeError, OSError, ValueError):  # none, closed, or no file
        return False
    poll = select.poll()
    poll.register(descriptor, select.POLLOUT)
    return any(event & select.POLLERR for _descriptor, event in poll.poll(0))


def _silence() -> None:
    """Send what is left to say nowhere: the flush at the exit must not find the reader gone."""
    for stream in (sys.stdout, sys.stderr):
        try:
            descriptor = stream.fileno()
        except (AttributeError, OSError, ValueError):
            continue
        if stream is sys.stdout or _reader_is_gone(stream):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
