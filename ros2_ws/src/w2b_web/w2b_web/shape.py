"""A robot description (URDF) as the page draws it: links, joints, primitives, colours."""

from __future__ import annotations

import math
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

#: Characters of a description, and what it may have of links and of what is drawn.
LONGEST, MOST_LINKS, MOST_VISUALS = 2_000_000, 500, 2_000
GREY = [0.6, 0.62, 0.66, 1.0]
#: Edge of the box that stands for a mesh, in metres.
MESH_BOX_M = 0.03
TURNS, SLIDES = ('revolute', 'continuous'), ('prismatic',)

Shape = dict[str, Any]


class ShapeError(ValueError):
    """A description that cannot be drawn; one line says why."""


def read(urdf: str) -> Shape:
    """
    Return what the page draws of a robot description.

    Returns
    -------
    Shape
        `name`; `links`: for each its `name` and `visuals`; `joints`: `name`, `kind` (turn, slide
        or fixed), `parent`, `child`, `xyz` (m), `rpy` (rad), `axis`; `notes`: what is not drawn.

    Raises
    ------
    ShapeError
        If it is no URDF, or too large to draw.

    """
    if len(urdf) > LONGEST:
        raise ShapeError(f'robot description: expected {LONGEST:,} characters at most, '
                         f'got {len(urdf):,}')
    try:
        robot = fromstring(urdf, forbid_dtd=True)
    except DefusedXmlException as error:
        raise ShapeError('robot description: expected a URDF without a document type') from error
    except ParseError as error:
        raise ShapeError(f'robot description: expected XML, got {error}') from error
    if robot.tag != 'robot':
        raise ShapeError(f'robot description: expected <robot>, got <{robot.tag[:40]}>')
    colours = {material.get('name', ''): _colour(material) for material in
               robot.findall('material')}
    links: list[Shape] = [{'name': link.get('name', ''), 'visuals': [
        _visual(visual, colours) for visual in link.findall('visual')]}
        for link in robot.findall('link')]
    names = {link['name'] for link in links}
    joints = [_joint(joint, names) for joint in robot.findall('joint')]
    visuals = sum(len(link['visuals']) for link in links)
    if not links or len(links) > MOST_LINKS or visuals > MOST_VISUALS:
        raise ShapeError(f'robot description: expected 1 to {MOST_LINKS} links and at most '
                         f'{MOST_VISUALS:,} visuals, got {len(links)} and {visuals:,}')
    _check_tree(joints)
    meshes = sum(visual['kind'] == 'mesh' for link in links for visual in link['visuals'])
    notes = [f'{meshes} meshes of the robot description are drawn as small boxes'] if meshes else []
    if not visuals:
        notes.append('the robot description has no visuals: only its joints are shown')
    return {'name': robot.get('name', ''), 'links': links, 'joints': joints, 'notes': notes}


def _check_tree(joints: list[Shape]) -> None:
    """Raise ShapeError unless every link has one parent and none is above itself."""
    parents: dict[str, str] = {}
    for joint in joints:
        if joint['child'] in parents:
            raise ShapeError(f'robot description: link {joint["child"]!r}: expected one parent, '
                             'got two')
        parents[joint['child']] = joint['parent']
    for link in parents:
        seen = {link}
        while link in parents:
            link = parents[link]
            if link in seen:
                raise ShapeError(f'robot description: expected a tree, got a circle at {link!r}')
            seen.add(link)


def _joint(joint: Element, links: set[str]) -> Shape:
    name, kind = joint.get('name', ''), joint.get('type', 'fixed')
    ends = {end: element.get('link', '') if (element := joint.find(end)) is not None else ''
            for end in ('parent', 'child')}
    for end, link in ends.items():
        if link not in links:
            raise ShapeError(f'robot description: joint {name!r}: expected a link as {end}, '
                             f'got {link!r}')
    axis = joint.find('axis')
    return {'name': name, 'parent': ends['parent'], 'child': ends['child'],
            'kind': 'turn' if kind in TURNS else 'slide' if kind in SLIDES else 'fixed',
            'axis': _numbers('1 0 0' if axis is None else axis.get('xyz', '1 0 0'), 3),
            **_origin(joint)}


def _visual(visual: Element, colours: dict[str, list[float]]) -> Shape:
    geometry = visual.find('geometry')
    element = None if geometry is None else next(iter(geometry), None)
    if element is None:
        raise ShapeError('robot description: visual: expected a geometry, got none')
    material = visual.find('material')
    colour = GREY
    if material is not None:
        colour = _colour(material) if material.find('color') is not None else colours.get(
            material.get('name', ''), GREY)
    drawn: Shape = {'kind': element.tag, 'colour': colour, **_origin(visual)}
    if element.tag == 'box':
        drawn['size'] = _numbers(element.get('size', ''), 3)
    elif element.tag in ('cylinder', 'capsule'):
        drawn['size'] = _numbers(f'{element.get("radius", "")} {element.get("length", "")}', 2)
    elif element.tag == 'sphere':
        drawn['size'] = _numbers(element.get('radius', ''), 1)
    elif element.tag == 'mesh':
        drawn['size'] = [MESH_BOX_M] * 3
    else:
        raise ShapeError('robot description: geometry: expected box, cylinder, sphere or mesh, '
                         f'got <{element.tag[:40]}>')
    return drawn


def _origin(element: Element) -> Shape:
    origin = element.find('origin')
    xyz, rpy = ('0 0 0', '0 0 0') if origin is None else (
        origin.get('xyz', '0 0 0'), origin.get('rpy', '0 0 0'))
    return {'xyz': _numbers(xyz, 3), 'rpy': _numbers(rpy, 3)}


def _colour(material: Element) -> list[float]:
    colour = material.find('color')
    return GREY if colour is None else _numbers(colour.get('rgba', ''), 4)


def _numbers(text: str, count: int) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ShapeError(f'robot description: expected {count} numbers, got {text[:60]!r}')
    return [round(value, 6) for value in values]
