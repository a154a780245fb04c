"""A mesh as one bounding capsule or box, for engines that know primitives only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.inertia import volume_m3
from w2b_core.bodies.model import Box, Capsule, Placed, Vector
from w2b_core.bodies.robot_file.findings import SHOWN, Findings
from w2b_core.bodies.robot_file.settings import inside
from w2b_core.bodies.robot_file.urdf_reader import LARGEST_M, Mesh, Piece, UrdfLink
from w2b_core.bodies.turning import to_rpy

Array = NDArray[np.float64]
#: Share of the vertices that a capsule's radius covers: horns and screws stick out.
COVERED = 0.9
#: A turned box is taken if its volume is below this share of the straight one's.
TURNED = 0.7
MAX_BYTES = 100_000_000
FORMATS = ('.stl', '.obj', '.ply', '.dae', '.off')
#: Ways to name a file whose end is a path in some folder of meshes.
_SCHEMES = ('package', 'file', 'model')


def stand_ins(link: UrdfLink, folder: Path, found: Findings) -> tuple[Placed, ...]:
    """
    Return primitives in place of a link's shapes, each mesh approximated, in the link's frame.

    `folder` holds the meshes; one that lies outside of it, or cannot be read, is an error.
    """
    made = []
    for piece in link.pieces:
        if not isinstance(piece.shape, Mesh):
            made.append(Placed(piece.shape, _vector(piece.place.at_m),
                               _vector(np.array(to_rpy(piece.place.turn)))))
            continue
        points = _vertices(link.name, piece.shape, folder, found)
        if points is not None:
            made.append(bounding(points * np.array(piece.shape.scale), piece))
    return tuple(made)


def bounding(points: Array, piece: Piece) -> Placed:
    """
    Return a capsule or a box in place of points (N, 3) of a piece's frame.

    Of those that hold all points the smaller one's kind is taken; a capsule is then drawn in to
    `COVERED` of them.
    """
    turn, at = piece.place.turn, piece.place.at_m
    box_turn, box_at, size = _box(points)
    low, high = points.min(axis=0), points.max(axis=0)
    centred = points - (low + high) / 2
    _u, _s, axes = np.linalg.svd(centred, full_matrices=False)
    along = centred @ axes[0]
    off_axis = np.linalg.norm(centred - np.outer(along, axes[0]), axis=1)
    length = float(np.ptp(along))
    if volume_m3(_capsule(length, float(off_axis.max()))) < float(np.prod(size)):
        capsule = _capsule(length, float(np.quantile(off_axis, COVERED)))
        middle = (low + high) / 2 + axes[0] * (along.max() + along.min()) / 2
        axis = turn @ axes[0]
        axis *= np.sign(axis[np.abs(axis).argmax()])
        return Placed(replace(capsule, axis=_vector(axis)), _vector(at + turn @ middle))
    return Placed(Box(_vector(size)), _vector(at + turn @ box_at),
                  _vector(np.array(to_rpy(turn @ box_turn))))


def _capsule(length_m: float, radius_m: float) -> Capsule:
    """Return a capsule along z that is so long from end to end."""
    radius = max(radius_m, 1e-4)
    return Capsule(round(max(length_m - 2 * radius, 1e-4), 5), round(radius, 5), (0.0, 0.0, 1.0))


def _box(points: Array) -> tuple[Array, Array, Array]:
    """Return turn (3, 3), centre (3,) and size (3,) of a box around points, straight if it fits."""
    from trimesh.bounds import oriented_bounds

    low, high = points.min(axis=0), points.max(axis=0)
    straight = np.eye(3), (low + high) / 2, np.maximum(high - low, 1e-4)
    try:
        with np.errstate(invalid='ignore', divide='ignore'):
            to_box, size = oriented_bounds(points)
    except Exception:  # points in a plane or a line, of which it raises several kinds
        return straight
    size = np.maximum(size, 1e-4)
    if float(np.prod(size)) > TURNED * float(np.prod(straight[2])):
        return straight
    turn = to_box[:3, :3].T
    return turn, -turn @ to_box[:3, 3], size


def _vertices(link: str, mesh: Mesh, folder: Path, found: Findings) -> Array | None:
    import trimesh

    where = f'link {link}'
    path = _find(where, mesh.file, folder, found)
    if path is None:
        return None
    try:
        loaded: Any = trimesh.load(path, force='mesh', process=False)
        points = np.asarray(loaded.vertices, dtype=np.float64)
    except Exception as error:  # whatever a loader of a foreign format raises
        found.error(where, f'mesh {path.name}: cannot be read ({" ".join(str(error).split())[:80]}'
                    ')', 'export it as STL')
        return None
    if len(points) < 4 or not np.isfinite(points).all():
        found.error(where, f'mesh {path.name}: expected 4 or more finite vertices, got '
                    f'{len(points)}', 'export it again')
        return None
    if np.abs(points * np.array(mesh.scale)).max() > LARGEST_M:
        found.error(where, f'mesh {path.name} of {np.abs(points).max():.0f} m: is it in '
                    'millimetres?', 'give scale="0.001 0.001 0.001" in the URDF')
        return None
    return points


def _find(where: str, name: str, folder: Path, found: Findings) -> Path | None:
    """
    Return a mesh's file in the folder of the meshes.

    Of a path from another machine (`package://`, `file://`, absolute, or with `..`) the longest end
    that is there counts; nothing outside the folder is looked at.
    """
    scheme, colon, rest = name.partition('://')
    if colon and scheme not in _SCHEMES:
        found.error(where, f'mesh {name[:60]}: expected a file beside the URDF', 'copy it there')
        return None
    parts = [part for part in (rest if colon else name).split('/') if part not in ('', '.')]
    plain = not colon and not name.startswith('/') and '..' not in parts
    ends = ['/'.join(parts[start:]) for start in range(len(parts)) if '..' not in parts[start:]]
    there = (folder / end for end in ends[:1 if plain else None])
    path = next((path for path in there if _is_file(path)), None)
    shown_name = name if len(name) <= SHOWN else f'...{name[-SHOWN:]}'
    if path is None and not plain and not colon:
        found.error(where, f'mesh {shown_name} leaves the folder {folder}, and no end of it is '
                    'there', 'give the folder of the meshes: --meshes DIR')
    elif not name.lower().endswith(FORMATS):
        found.error(where, f'mesh {shown_name}: expected one of {", ".join(FORMATS)}', 'convert it')
    elif path is None:
        found.error(where, f'mesh {shown_name}: no readable file of at most {MAX_BYTES:,} bytes in '
                    f'{folder}', 'give the folder of the meshes: --meshes DIR')
    else:
        return inside(folder, path.relative_to(folder).as_posix(), where, found)
    return None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file() and path.stat().st_size <= MAX_BYTES
    except (OSError, ValueError):
        return False


def _vector(values: Array) -> Vector:
    x, y, z = (round(float(value), 5) + 0.0 for value in values)
    return x, y, z
