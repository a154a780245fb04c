"""
A controller and everything that it needs, in one JSON file that people keep, compare and share.

The file holds the network, the body and wiring it was evolved for, the words it was trained on with
a hash of their vectors, and a free record of the training. Reading trusts nothing: every damage is
a `ControllerFileError` of one line that names the file, the field, what was expected and what came.
"""

from __future__ import annotations

import os
import tempfile
from importlib import resources
from pathlib import Path

import numpy as np

from w2b_core.controller import fields as controller_json
from w2b_core.controller.fields import ControllerFileError, Fields, Text, expect
from w2b_core.controller.model import (
    BEHAVIOURS,
    BODIES,
    Controller,
    Motor,
    TrainedWord,
    vector_sha256,
)
from w2b_core.network import Network

__all__ = ['BEHAVIOURS', 'BODIES', 'Controller', 'ControllerFileError', 'Motor', 'TrainedWord',
           'dumps', 'load', 'loads', 'resolve', 'save', 'shipped', 'shipped_names', 'vector_sha256']

FORMAT = 'w2b-controller'
VERSION = 1
#: Hundreds of times a controller of the study; a file beyond it is refused before it is read.
MAX_BYTES = 4_000_000


def dumps(controller: Controller) -> str:
    """Return the text of the controller's file, the same for the same controller."""
    network = controller.network
    return controller_json.write({
        'format': FORMAT, 'version': VERSION, 'body': controller.body,
        'period_s': controller.period_s,
        'network': {
            'input': 'serial', 'vector_length': controller.vector_length,
            'hidden_weights': network.hidden_weights.tolist(),
            'motor_weights': network.motor_weights.tolist(),
            'sensors': list(controller.sensors),
            'motors': [vars(motor) for motor in controller.motors]},
        'words': [vars(word) for word in controller.words],
        'record': controller.record})


def loads(text: str) -> Controller:
    """Return the controller that `text` describes (ControllerFileError if it is damaged)."""
    top = controller_json.read(text)
    # A file of another format or version has other fields: these two come first.
    name, version = top.text('format'), top.integer('version')
    expect(name == FORMAT, 'format', repr(FORMAT), name)
    expect(version == VERSION, 'version', f'{VERSION}, the one that this program reads', version)
    network = top.fields('network')
    way_in = network.text('input')
    expect(way_in == 'serial', 'network.input', "'serial'", way_in)
    motors = tuple(_motor(fields) for fields in network.list_of_fields('motors'))
    hidden, motor = network.matrix('hidden_weights'), network.matrix('motor_weights')
    expect(len(motor) == len(motors), 'network.motor_weights',
           f'{len(motors)} rows, one for each of network.motors', Text(f'{len(motor)} rows'))
    try:
        net = Network(np.array(hidden), np.array(motor),
                      np.array([motor.time_constant for motor in motors]))
    except ValueError as error:
        raise ControllerFileError(f'network.{error}') from None
    controller = Controller(
        body=top.text('body'), network=net, sensors=network.texts('sensors'), motors=motors,
        period_s=top.number('period_s'),
        words=tuple(_word(fields) for fields in top.list_of_fields('words')),
        record=top.free('record'), vector_length=network.integer('vector_length'))
    network.finish()
    top.finish()
    return controller


def _motor(fields: Fields) -> Motor:
    motor = Motor(fields.text('joint'), fields.number('lower_rad'), fields.number('upper_rad'),
                  fields.number('time_constant'))
    fields.finish()
    return motor


def _word(fields: Fields) -> TrainedWord:
    word = TrainedWord(fields.text('word'), fields.text('behaviour'), fields.text('sha256'),
                       fields.number_or_none('score'))
    fields.finish()
    return word


def load(path: str | Path) -> Controller:
    """
    Read a controller file.

    Raises
    ------
    ControllerFileError
        If it is missing or damaged, in one line: the file, the field, what was expected, what
        came.

    """
    path = Path(path)
    try:
        expect(path.exists(), str(path), 'a controller file', Text('nothing: no such file'))
        expect(path.is_file(), str(path), 'a controller file',
               Text('a directory' if path.is_dir() else 'something that is not a file'))
        size = path.stat().st_size
        expect(size <= MAX_BYTES, str(path), f'a controller file of at most {MAX_BYTES:,} bytes',
               Text(f'{size:,} bytes'))
        text = path.read_bytes().decode('utf-8')
    except UnicodeDecodeError as error:
        raise ControllerFileError(f'{path}: expected UTF-8 text, got byte '
                                  f'0x{error.object[error.start]:02x} at {error.start}') from None
    except (OSError, ValueError) as error:
        if isinstance(error, ControllerFileError):
            raise
        raise ControllerFileError(f'{path}: expected a readable file, got {error}') from None
    try:
        return loads(text)
    except ControllerFileError as error:
        raise ControllerFileError(f'{path}: {error}') from None


def save(controller: Controller, path: str | Path) -> None:
    """
    Write a controller file: all of it or, if interrupted, nothing.

    Raises
    ------
    ControllerFileError
        If the file could not be loaded again, or not be written.

    """
    path = Path(path)
    text = dumps(controller)
    loads(text)
    try:
        data = text.encode('utf-8')
    except UnicodeEncodeError as error:
        raise ControllerFileError(f'{path}: expected Unicode text, got {error}') from None
    try:
        handle, aside = tempfile.mkstemp(prefix=f'.{path.name}.', dir=path.parent)
        try:
            with os.fdopen(handle, 'wb') as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            # mkstemp's files are private; this one is as readable as any new file.
            umask = os.umask(0)
            os.umask(umask)
            Path(aside).chmod(0o666 & ~umask)
            Path(aside).replace(path)
        except BaseException:
            Path(aside).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise ControllerFileError(f'{path}: expected to write a controller file there, '
                                  f'got {error.strerror or error}') from None


def shipped_names() -> tuple[str, ...]:
    """Return the names of the controllers that come with the program."""
    return tuple(sorted(path.stem for path in _shipped_folder().glob('*.json')))


def shipped(name: str) -> Path:
    """Return the file of the shipped controller `name` (ControllerFileError if there is none)."""
    expect(name in shipped_names(), 'controller', f'one of {", ".join(shipped_names())}', name)
    return _shipped_folder() / f'{name}.json'


def resolve(name_or_path: str) -> Path:
    """
    Return the file that a user means: a path if it looks like one, else a shipped controller.

    Raises
    ------
    ControllerFileError
        If no shipped controller has this name.

    """
    if '/' in name_or_path or name_or_path.endswith('.json'):
        return Path(name_or_path)
    return shipped(name_or_path)


def _shipped_folder() -> Path:
    return Path(str(resources.files('w2b_core') / 'controllers'))
