"""A body as a JSON object, with a hash: what controller files and run directories carry."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from math import inf, isinf, pi
from pathlib import Path
from typing import Any

from w2b_core.bodies.model import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Joint,
    Link,
    Placed,
    Servo,
    Shape,
    Sphere,
    Tensor,
    Vector,
)
from w2b_core.files import write_json
from w2b_core.json_fields import Fields, JsonFileError, Text, expect, read

FORMAT, VERSION = 'w2b-body', 1
#: A file beyond it is refused before it is read; a body of 16 joints has 20 kB.
MAX_BYTES = 4_000_000


def to_json(body: Body) -> dict[str, Any]:
    """Return the body as a JSON object; equal bodies give equal objects, to the last bit."""
    return {
        'name': body.name, 'description': body.description, 'world': body.world,
        'height_m': body.height_m, 'length_m': body.length_m,
        'hidden_neurons': body.hidden_neurons, 'sensors': list(body.sensors),
        'links': [_link(link) for link in body.links],
        'joints': [_joint(joint) for joint in body.joints]}


def sha256(body: Body) -> str:
    """Return the SHA-256 of what a body is; its one line of description does not count."""
    value = to_json(body)
    del value['description']
    return hashlib.sha256(json.dumps(value, sort_keys=True, separators=(',', ':')).encode()
                          ).hexdigest()


def sealed(body: Body) -> dict[str, Any]:
    """Return the body as a JSON object, with its hash: what `unsealed` reads."""
    return {'sha256': sha256(body), **to_json(body)}


def unsealed(fields: Fields) -> Body:
    """Return the body that `sealed` wrote (JsonFileError if it is damaged or changed)."""
    stated = fields.text('sha256')
    body = _read(fields)
    expect(sha256(body) == stated, fields.name('sha256'), f'that of what is here, {sha256(body)}',
           Text(stated))
    return body


def save(body: Body, path: Path) -> None:
    """Write a body's file, whole or not at all (OSError)."""
    write_json(path, {'format': FORMAT, 'version': VERSION, 'body': sealed(body)})


def load(path: Path) -> Body:
    """
    Return the body in a file of `save`, or the one that a controller file carries.

    Raises
    ------
    JsonFileError
        If it is missing or damaged, or carries no body; one line with the file and the field.

    """
    try:
        size = path.stat().st_size
        expect(size <= MAX_BYTES, 'the file', f'at most {MAX_BYTES:,} bytes',
               Text(f'{size:,} bytes'))
        top = read(path.read_text(encoding='utf-8'))
        kind = top.text('format')
        if kind == FORMAT:
            version = top.integer('version')
            expect(version == VERSION, 'version', str(VERSION), version)
            return unsealed(top.fields('body'))
        expect(kind == 'w2b-controller' and top.has('body_description'), 'format',
               f'{FORMAT!r}, or a controller file that carries its body', kind)
        return unsealed(top.fields('body_description'))
    except JsonFileError as error:
        raise JsonFileError(f'{path}: {error}') from None
    except (OSError, UnicodeDecodeError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise JsonFileError(f'{path}: expected a readable file, got {reason}') from None


def _link(link: Link) -> dict[str, Any]:
    one = not isinstance(link.shape, tuple)
    shapes = (Placed(link.shape),) if not isinstance(link.shape, tuple) else link.shape
    return {'name': link.name, 'mass_kg': link.mass_kg, 'centre_m': list(link.centre_m),
            'inertia_axis': None if link.inertia_axis is None else list(link.inertia_axis),
            'inertia_kg_m2': None if link.inertia_kg_m2 is None else [
                list(row) for row in link.inertia_kg_m2],
            # One shape is centred at the centre of mass, others are placed.
            'centred': one, 'shapes': [
                {'kind': type(placed.shape).__name__.lower(), **_plain(vars(placed.shape)),
                 **({} if one else {'centre_m': list(placed.centre_m),
                                    'rpy_rad': list(placed.rpy_rad)})}
                for placed in shapes]}


def _joint(joint: Joint) -> dict[str, Any]:
    value = {name: part for name, part in vars(joint).items() if name != 'servo'}
    return {**_plain(value), 'servo': {
        name: None if isinf(number) else number for name, number in vars(joint.servo).items()}}


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {name: list(part) if isinstance(part, tuple) else part for name, part in values.items()}


def _read(top: Fields) -> Body:
    body = Body(
        name=top.text('name'), description=top.text('description'), world=top.text('world'),
        height_m=top.number('height_m'), length_m=top.number('length_m'),
        hidden_neurons=top.integer('hidden_neurons'), sensors=top.texts('sensors'),
        links=tuple(_read_link(fields) for fields in top.list_of_fields('links')),
        joints=tuple(_read_joint(fields) for fields in top.list_of_fields('joints')))
    top.finish()
    expect(bool(body.links) and bool(body.joints), top.name('joints'), 'links and joints',
           Text('none'))
    expect(body.length_m > 0, top.name('length_m'), 'more than 0 m', body.length_m)
    _check_tree(body, top.name('joints'))
    return body


def _check_tree(body: Body, name: str) -> None:
    links = [link.name for link in body.links]
    expect(len(set(links)) == len(links), name, 'links of different names', links)
    placed = {links[0]}
    for joint in body.joints:
        expect(joint.parent in placed, f'{name}: {joint.name}', 'a parent that was placed before',
               joint.parent)
        expect(joint.child in links and joint.child not in placed, f'{name}: {joint.name}',
               'a child link with one parent', joint.child)
        placed.add(joint.child)
    expect(len(placed) == len(links), name, 'a joint for each link but the first',
           Text(f'none for {", ".join(sorted(set(links) - placed))}'))


def _read_link(fields: Fields) -> Link:
    name, mass_kg, centre_m = fields.text('name'), fields.number('mass_kg'), _vector(
        fields, 'centre_m')
    expect(mass_kg > 0, fields.name('mass_kg'), 'more than 0 kg', mass_kg)
    axis = fields.numbers_or_none('inertia_axis')
    rows = fields.matrix_or_none('inertia_kg_m2')
    if rows is not None:
        expect(len(rows) == 3 and len(rows[0]) == 3, fields.name('inertia_kg_m2'), '3 x 3 numbers',
               Text(f'{len(rows)} x {len(rows[0])}'))
    tensor: Tensor | None = None if rows is None else (
        _three(rows[0]), _three(rows[1]), _three(rows[2]))
    centred = fields.flag('centred')
    shapes = []
    for part in fields.list_of_fields('shapes'):
        shape = _shape(part)
        shapes.append(Placed(shape) if centred else Placed(
            shape, _vector(part, 'centre_m'), _vector(part, 'rpy_rad')))
        part.finish()
    fields.finish()
    expect(len(shapes) == 1 or not centred, fields.name('shapes'), 'one shape', len(shapes))
    if axis is not None:
        expect(len(axis) == 3, fields.name('inertia_axis'), '3 numbers', len(axis))
    return Link(name, shapes[0].shape if centred else tuple(shapes), mass_kg, centre_m,
                None if axis is None else _three(axis), tensor)


def _shape(part: Fields) -> Shape:
    kind = part.text('kind')
    made: dict[str, Callable[[], Shape]] = {
        'box': lambda: Box(_vector(part, 'size_m')),
        'sphere': lambda: Sphere(part.number('radius_m')),
        'capsule': lambda: Capsule(part.number('length_m'), part.number('radius_m'),
                                   _vector(part, 'axis')),
        'cylinder': lambda: Cylinder(part.number('length_m'), part.number('radius_m'),
                                     _vector(part, 'axis'))}
    expect(kind in made, part.name('kind'), f'one of {", ".join(made)}', kind)
    return made[kind]()


def _read_joint(fields: Fields) -> Joint:
    servo = fields.fields('servo')
    speeds = [servo.number_or_none(name) for name in (
        'gain_per_s', 'max_speed_up_rad_s', 'max_speed_down_rad_s', 'max_torque_nm')]
    servo.finish()
    joint = Joint(
        fields.text('name'), fields.text('parent'), fields.text('child'),
        _vector(fields, 'origin_m'), _vector(fields, 'axis'), fields.number('lower_rad'),
        fields.number('upper_rad'), Servo(*(inf if value is None else value for value in speeds)),
        fields.number('time_constant'))
    fields.finish()
    expect(-2 * pi <= joint.lower_rad <= joint.upper_rad <= 2 * pi, fields.name('upper_rad'),
           'limits within a turn, the lower one first', (joint.lower_rad, joint.upper_rad))
    return joint


def _vector(fields: Fields, key: str) -> Vector:
    values = fields.numbers(key)
    expect(len(values) == 3, fields.name(key), '3 numbers', len(values))
    return _three(values)


def _three(values: list[float]) -> Vector:
    x, y, z = values
    return x, y, z
