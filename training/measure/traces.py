"""
Recorded evaluations of the original simulator: the file format, read and checked.

One .npz file holds, for each BODY in it, C controllers under W words:

======================  ==================  =====================================================
`BODY.h`, `BODY.m`      (C, H, H + 1 + S),  weights of the network
                        (C, M, H)
`BODY.state`            (C, W, H, 2)        primed hidden neurons: previous value, value
`BODY.pos`              (C, W, T, 3)        position of the main body at each step, m
`BODY.pos_nudged`       the same            of the same evaluation raised by 1e-6 m at the start
======================  ==================  =====================================================

More keys may be there and are not read.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network

Array = NDArray[np.float64]

#: Recorded body -> the registered body of the same wiring.
RECORDED = {
    'quadruped': 'quadruped', 'minimal': 'minimal',
    'spherical_1dof_sensors': 'spherical_1dof_original',
    'spherical_1dof_blind': 'spherical_1dof_blind',
    'spherical_2dof_sensors': 'spherical_2dof_original',
    'spherical_2dof_blind': 'spherical_2dof_blind'}
KEYS = ('h', 'm', 'state', 'pos', 'pos_nudged')


class TracesError(ValueError):
    """A trace file is not of the documented format; the message says where and how."""


@dataclass(frozen=True)
class Traces:
    """
    The recorded evaluations of one body.

    `hidden` (C, W, H, 2); `position_m` and `nudged_m` (C, W, T, 3).
    """

    name: str
    body: Body
    network: Network
    hidden: Array
    position_m: Array
    nudged_m: Array


def load(path: Path) -> tuple[Traces, ...]:
    """
    Return the bodies' evaluations in a file, in the order of `RECORDED`.

    Raises
    ------
    TracesError
        If the file is not there or not of the format, with one line that says why.

    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {key.split('.')[0] for key in file.files if '.' in key}
            if unknown := sorted(found - set(RECORDED)):
                raise TracesError(f'{path}: unknown body {unknown[0]!r}, expected one of '
                                  f'{", ".join(RECORDED)}')
            names = [name for name in RECORDED if name in found]
            if not names:
                raise TracesError(f'{path}: holds no body, expected keys such as quadruped.pos')
            return tuple(_read(path, file, name) for name in names)
    except FileNotFoundError:
        raise TracesError(f'{path}: no such file, expected an .npz of recorded traces') from None
    except TracesError:
        raise
    except OSError as error:
        raise TracesError(f'{path}: cannot be read ({error.strerror or error})') from None
    except (ValueError, EOFError, AttributeError, TypeError, zipfile.BadZipFile, zlib.error):
        # Numpy's own words advise to load it unsafely.
        raise TracesError(f'{path}: expected an .npz file of recorded evaluations (format: '
                          'training/measure/traces.py), got something else or a damaged one'
                          ) from None


def _read(path: Path, file: np.lib.npyio.NpzFile, name: str) -> Traces:
    arrays = {}
    for key in KEYS:
        if f'{name}.{key}' not in file.files:
            raise TracesError(f'{path}: {name}.{key} is missing, expected '
                              f'{", ".join(f"{name}.{wanted}" for wanted in KEYS)}')
        array = file[f'{name}.{key}']
        if array.dtype.kind not in 'fiu':
            raise TracesError(f'{path}: {name}.{key}: expected numbers, got {array.dtype}')
        if not np.isfinite(array).all():
            raise TracesError(f'{path}: {name}.{key}: expected finite numbers, '
                              'got NaN or infinity')
        arrays[key] = array.astype(np.float64)
    body = bodies.get(RECORDED[name])
    count, words, frames = _sizes(arrays)
    hidden, motors, sensors = body.hidden_neurons, len(body.joints), len(body.sensors)
    expected = {'h': (count, hidden, hidden + 1 + sensors), 'm': (count, motors, hidden),
                'state': (count, words, hidden, 2), 'pos': (count, words, frames, 3),
                'pos_nudged': (count, words, frames, 3)}
    for key, shape in expected.items():
        if arrays[key].shape != shape:
            raise TracesError(f'{path}: {name}.{key}: expected shape {shape}, '
                              f'got {arrays[key].shape}')
    network = Network(arrays['h'], arrays['m'],
                      np.array([joint.time_constant for joint in body.joints]))
    return Traces(name, body, network, arrays['state'], arrays['pos'], arrays['pos_nudged'])


def _sizes(arrays: dict[str, Array]) -> tuple[int, int, int]:
    """Return C, W and T, from the positions; at least one of each."""
    shape = arrays['pos'].shape
    controllers, words, frames = shape[:3] if len(shape) == 4 else (1, 1, 1)
    return max(1, controllers), max(1, words), max(1, frames)
