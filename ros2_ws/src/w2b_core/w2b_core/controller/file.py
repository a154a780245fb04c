"""
A controller and everything that it needs, in one JSON file that people keep, compare and share.

The file holds the network, the body and senses it was evolved for, the words it was trained on
with a hash of their vectors, and a free record of the training. A body that does not come with the
program is described in the file, with a hash: nothing else is needed to use it. Reading trusts
nothing: every damage is a `JsonFileError` of one line that names the file, the field, what
was expected and what came.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from w2b_core import bodies
from w2b_core.bodies import description
from w2b_core.controller import legs_format, serial_format
from w2b_core.controller.model import (
    Controller,
    Motor,
    TrainedWord,
    vector_sha256,
)
from w2b_core.files import write_atomically
from w2b_core.json_fields import Fields, JsonFileError, Text, expect, read, write
from w2b_core.network import LeakyNetwork

__all__ = ['Controller', 'JsonFileError', 'Motor', 'TrainedWord', 'beside', 'body_argument',
           'dumps',
           'load', 'loads', 'resolve', 'save', 'shipped', 'shipped_names', 'vector_sha256']

FORMAT = 'w2b-controller'
#: Version -> what reads the parts in which its files differ from those of the others.
VERSIONS = {1: serial_format.load, 2: legs_format.load}
#: Hundreds of times a controller of the study; a file beyond it is refused before it is read.
MAX_BYTES = 4_000_000
#: Endings of a robot's file, see `bodies.robot_file`.
ROBOT_SUFFIXES = ('.yaml', '.yml')


def dumps(controller: Controller) -> str:
    """Return the text of the controller's file, the same for the same controller."""
    network = controller.network
    if isinstance(network, LeakyNetwork):
        version, middle = 2, legs_format.dump(controller, network)
    else:
        version, middle = 1, serial_format.dump(controller, network)
    return write({
        'format': FORMAT, 'version': version, 'body': controller.body,
        'period_s': controller.period_s, **middle,
        'words': [vars(word) for word in controller.words],
        **({} if controller.carried is None else {
            'body_description': description.sealed(controller.carried)}),
        'record': controller.record})


def loads(text: str) -> Controller:
    """Return the controller that `text` describes (JsonFileError if it is damaged)."""
    top = read(text)
    # A file of another format or version has other fields: these two come first.
    name, version = top.text('format'), top.integer('version')
    expect(name == FORMAT, 'format', repr(FORMAT), name)
    expect(version in VERSIONS, 'version',
           f'{" or ".join(map(str, VERSIONS))}, which this program reads', version)
    parts = VERSIONS[version](top)
    if top.has('body_description'):
        parts['carried'] = description.unsealed(top.fields('body_description'))
    controller = Controller(
        body=top.text('body'), period_s=top.number('period_s'),
        words=tuple(_word(fields) for fields in top.list_of_fields('words')),
        record=top.free('record'), **parts)
    top.finish()
    return controller


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
    JsonFileError
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
        raise JsonFileError(f'{path}: expected UTF-8 text, got byte '
                            f'0x{error.object[error.start]:02x} at {error.start}') from None
    except (OSError, ValueError) as error:
        if isinstance(error, JsonFileError):
            raise
        raise JsonFileError(f'{path}: expected a readable file, got {error}') from None
    try:
        return loads(text)
    except JsonFileError as error:
        raise JsonFileError(f'{path}: {error}') from None


def save(controller: Controller, path: str | Path) -> None:
    """
    Write a controller file: all of it or, if interrupted, nothing.

    Raises
    ------
    JsonFileError
        If the file could not be loaded again, or not be written.

    """
    path = Path(path)
    text = dumps(controller)
    loads(text)
    try:
        data = text.encode('utf-8')
    except UnicodeEncodeError as error:
        raise JsonFileError(f'{path}: expected Unicode text, got {error}') from None
    try:
        write_atomically(path, data)
    except OSError as error:
        raise JsonFileError(f'{path}: expected to write a controller file there, '
                            f'got {error.strerror or error}') from None


def shipped_names() -> tuple[str, ...]:
    """Return the names of the controllers that come with the program."""
    return tuple(sorted(path.stem for path in _shipped_folder().glob('*.json')))


def shipped(name: str) -> Path:
    """Return the file of the shipped controller `name` (JsonFileError if there is none)."""
    expect(name in shipped_names(), 'controller', f'one of {", ".join(shipped_names())}', name)
    return _shipped_folder() / f'{name}.json'


def resolve(name_or_path: str) -> Path:
    """
    Return the file that a user means: a path if it looks like one, else a shipped controller.

    A robot's YAML means the controller that was made for it, see `beside`.

    Raises
    ------
    JsonFileError
        If no shipped controller has this name.
    ValueError
        If a robot's YAML cannot be used, or no controller was made for it.

    """
    if name_or_path.endswith(ROBOT_SUFFIXES):
        return beside(Path(name_or_path))
    if '/' in name_or_path or name_or_path.endswith('.json'):
        return Path(name_or_path)
    return shipped(name_or_path)


def beside(robot: Path) -> Path:
    """
    Return the controller of a robot's YAML: the file in its folder that carries its very body.

    Of several the one called as the robot counts, then those whose names begin so. For a robot
    that is a registered body, the shipped controller of that name.

    Raises
    ------
    ValueError
        If the robot's file cannot be used, or there is no such controller: the line says which
        ones were made for the body as it was before.

    """
    body = bodies.get(str(robot))
    if bodies.to_carry(body) is None and body.name in shipped_names():
        return shipped(body.name)
    others = []
    for path in sorted(robot.parent.glob('*.json'), key=lambda path: (
            path.stem != robot.stem, not path.stem.startswith(robot.stem), path.name)):
        try:
            controller = load(path)
        except JsonFileError:
            continue  # a file of something else
        if controller.body == body.name:
            try:
                controller.refuse_another_body(body)
            except JsonFileError as error:
                others.append(f'{path.name}: {error}')
            else:
                return path
    raise JsonFileError(
        f'{robot}: expected the controller of this robot in its folder, got '
        + ('; '.join(others[:3]) or 'none') + '; train one (docs/tutorials/robot.md), or give its '
        'file')


def body_argument(controller: Controller, name_or_path: str) -> str:
    """Return what names its body to a node: the body's name, or the file if that describes it."""
    # A robot's YAML has its wiring too, also where the body is a registered one.
    is_robot = name_or_path.endswith(ROBOT_SUFFIXES)
    return name_or_path if is_robot or controller.carried is not None else controller.body


def _shipped_folder() -> Path:
    return Path(str(resources.files('w2b_core') / 'controllers'))
