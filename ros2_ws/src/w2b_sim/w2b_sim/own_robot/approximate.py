"""A mesh as one bounding capsule or box, for engines that know primitives only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.inertia import volume_m3
from w2b_core.bodies.model import Box, Capsule, Placed, Vector
from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.settings import inside
from w2b_core.bodies.robot_file.urdf_reader import LARGEST_M, Mesh, Piece, UrdfLink
from w2b_core.bodies.turning import to_rpy

Array = NDArray[np.float64]
#: Share of the vertices that a capsule's radius covers: horns and screws stick out.
COVERED = 0.9
MAX_BYTES = 100_000_000
FORMATS = ('.stl', '.obj', '.ply', '.dae', '.off')


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
    """Return the smaller of a capsule and a box around points (N, 3) of a piece's frame."""
    turn, at = piece.place.turn, piece.place.at_m
    low, high = points.min(axis=0), points.max(axis=0)
    centred = points - (low + high) / 2
    _u, _s, axes = np.linalg.svd(centred, full_matrices=False)
    along, across = centred @ axes[0], centred - np.outer(centred @ axes[0], axes[0])
    length = float(np.ptp(along))
    radius = float(np.quantile(np.linalg.norm(across, axis=1), COVERED))
    radius = max(radius, 1e-4)
    capsule = Capsule(round(length - 2 * radius, 5), round(radius, 5), (0.0, 0.0, 1.0))
    if length > 2 * radius and volume_m3(capsule) < float(np.prod(high - low)):
        middle = (low + high) / 2 + axes[0] * (along.max() + along.min()) / 2
        axis = turn @ axes[0]
        axis *= np.sign(axis[np.abs(axis).argmax()])
        return Placed(replace(capsule, axis=_vector(axis)), _vector(at + turn @ middle))
    size = np.maximum(high - low, 1e-4)
    return Placed(Box(_vector(size)), _vector(at + turn @ ((low + high) / 2)),
                  _vector(np.array(to_rpy(turn))))


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
    if name.startswith('package://'):
        _package, _slash, name = name.removeprefix('package://').partition('/')
    elif '://' in name:
        found.error(where, f'mesh {name[:60]}: expected a file beside the URDF',
                    'copy it there')
        return None
    path = inside(folder, name, where, found)
    if path.suffix.lower() not in FORMATS:
        found.error(where, f'mesh {path.name}: expected one of {", ".join(FORMATS)}',
                    'convert it')
        return None
    if not path.is_file() or path.stat().st_size > MAX_BYTES:
        found.error(where, f'mesh {name}: no readable file of at most {MAX_BYTES:,} bytes in '
                    f'{folder}', 'give the folder of the meshes: --meshes DIR')
        return None
    return path


def _vector(values: Array) -> Vector:
    x, y, z = (round(float(value), 5) + 0.0 for value in values)
    return x, y, z
