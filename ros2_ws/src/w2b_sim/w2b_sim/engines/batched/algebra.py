"""Vector algebra on SIMD values: 3-vectors are tuples, symmetric matrices packed triangles."""

from __future__ import annotations

from typing import Any

from w2b_sim.engines.batched.simd import fma
from w2b_sim.engines.jit import njit

#: For every function that becomes a part of the one compiled call, and so needs no way in from
#: Python. Division by zero gives infinity, as IEEE says, instead of an exception.
INLINED: Any = {'forceinline': True, 'error_model': 'numpy', 'no_cpython_wrapper': True,
           'no_cfunc_wrapper': True}
inlined = njit(**INLINED)


@inlined
def add(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def sub(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scale(a, factor):
    """Return a * factor."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@inlined
def add_scaled(a, b, factor):
    """Return a + b * factor."""
    return fma(b[0], factor, a[0]), fma(b[1], factor, a[1]), fma(b[2], factor, a[2])


@inlined
def dot(a, b):
    """Return the scalar product."""
    return fma(a[2], b[2], fma(a[1], b[1], a[0] * b[0]))


@inlined
def cross(a, b):
    """Return the vector product."""
    return (fma(a[1], b[2], -(a[2] * b[1])), fma(a[2], b[0], -(a[0] * b[2])),
            fma(a[0], b[1], -(a[1] * b[0])))


@inlined
def get3(array, k):
    """Return row k of an (N, 3) stack array as a tuple."""
    return array[k, 0], array[k, 1], array[k, 2]


@inlined
def set3(array, k, value):
    """Write a tuple into row k of an (N, 3) stack array."""
    array[k, 0] = value[0]
    array[k, 1] = value[1]
    array[k, 2] = value[2]


@inlined
def rotate(rotation, k, x):
    """Return R x, R the row-major rotation matrix in row k of an (N, 9) stack array."""
    return (fma(rotation[k, 2], x[2], fma(rotation[k, 1], x[1], rotation[k, 0] * x[0])),
            fma(rotation[k, 5], x[2], fma(rotation[k, 4], x[1], rotation[k, 3] * x[0])),
            fma(rotation[k, 8], x[2], fma(rotation[k, 7], x[1], rotation[k, 6] * x[0])))


@inlined
def rotate_row(rotation, k, table, i):
    """
    Return R x for row i of an (N, 4) table: x, and the number of its only element that is not zero.

    Most vectors of a body lie along an axis of their link: then R x is a multiple of one column of
    R. The number is -1 where they do not.
    """
    column = int(table[i, 3])
    if column == 0:
        x = table[i, 0]
        return rotation[k, 0] * x, rotation[k, 3] * x, rotation[k, 6] * x
    if column == 1:
        x = table[i, 1]
        return rotation[k, 1] * x, rotation[k, 4] * x, rotation[k, 7] * x
    if column == 2:
        x = table[i, 2]
        return rotation[k, 2] * x, rotation[k, 5] * x, rotation[k, 8] * x
    return rotate(rotation, k, row3(table, i))


@inlined
def row3(table, k):
    """Return the first three of row k of a table as a tuple of numbers."""
    return table[k, 0], table[k, 1], table[k, 2]


@inlined
def tri(i, j):
    """Return the place of element (i, j), i >= j, in a packed lower triangle."""
    return i * (i + 1) // 2 + j
