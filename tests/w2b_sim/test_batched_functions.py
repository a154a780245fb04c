"""The kernel's own functions against numpy's, in both precisions."""

import numpy as np
import pytest
from numba import njit

from w2b_sim.engines.batched import functions
from w2b_sim.engines.batched.layout import Layout
from w2b_sim.engines.batched.memory import get_lane, local1, set_lane

LANES = 8


def layout(bits):
    return Layout(bits=bits, lanes=LANES, links=1, contacts=1, hidden=1, sensors=0, touches=0,
                  dynamic=0, chain=0, coulomb=0)


def over_lanes(function, arguments):
    """Return a compiled call that applies `function` to columns of numbers, lane by lane."""
    @njit(error_model='numpy')
    def call(sizes, columns, result):
        first, second = local1(sizes, 1), local1(sizes, 1)
        for start in range(0, len(result), LANES):
            for lane in range(LANES):
                set_lane(first, 0, lane, columns[0, start + lane])
                set_lane(second, 0, lane, columns[arguments - 1, start + lane])
            first[0] = function(first, second)
            for lane in range(LANES):
                result[start + lane] = get_lane(first, 0, lane)
    return call


def applied(function, bits, *columns):
    kind = np.float32 if bits == 32 else np.float64
    stacked = np.ascontiguousarray(np.stack(columns), dtype=kind)
    result = np.zeros(stacked.shape[1], dtype=kind)
    over_lanes(function, len(columns))(layout(bits), stacked, result)
    return stacked.astype(np.float64), result.astype(np.float64)


tanh, hinge_angle, inverse_root = functions.tanh, functions.hinge_angle, functions.inverse_root


@njit
def call_tanh(first, _second):
    return tanh(first[0])


@njit
def call_hinge_angle(first, second):
    return hinge_angle(first[0], second[0])


@njit
def call_inverse_root(first, _second):
    return inverse_root(first[0])


@pytest.mark.parametrize(('bits', 'bound'), [(32, 4e-7), (64, 1e-15)])
def test_tanh(bits, bound):
    (x,), result = applied(call_tanh, bits, np.linspace(-25, 25, 8000))
    assert np.abs(result - np.tanh(x)).max() < bound


@pytest.mark.parametrize(('bits', 'bound'), [(32, 4e-7), (64, 1e-15)])
def test_hinge_angle_up_to_a_right_angle(bits, bound):
    angle = np.linspace(-np.pi / 2, np.pi / 2, 8000)
    _, result = applied(call_hinge_angle, bits, np.sin(angle / 2), np.cos(angle / 2))
    assert np.abs(result - angle).max() < bound


@pytest.mark.parametrize(('bits', 'bound'), [(32, 2e-5), (64, 4e-10)])
def test_hinge_angle_beyond_is_still_one(bits, bound):
    angle = np.linspace(np.pi / 2, 2 * np.pi / 3, 800)
    _, result = applied(call_hinge_angle, bits, np.sin(angle / 2), np.cos(angle / 2))
    assert np.abs(result / angle - 1).max() < bound
    assert (np.diff(result) > 0).all()


@pytest.mark.parametrize(('bits', 'bound'), [(32, 3e-7), (64, 6e-16)])
@pytest.mark.parametrize(('low', 'high'), [(1 - 1e-6, 1.1), (1.1, 9.0)])
def test_inverse_root(bits, bound, low, high):
    (x,), result = applied(call_inverse_root, bits, np.linspace(low, high, 8000))
    assert np.abs(result * np.sqrt(x) - 1).max() < bound
