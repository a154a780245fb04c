"""The transcendental functions the kernel needs, on SIMD values of either precision."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.simd import fma, is_single, like, power_of_two, vmax, vmin, vround

#: ln 2 in two parts: whole multiples of the high one are exact.
LN2_HIGH = 6.93147180369123816490e-01
LN2_LOW = 1.90821492927058770002e-10
SERIES_TERMS = 20
PER_LN2 = 1.4426950408889634


@inlined
def tanh(x):
    """Return the hyperbolic tangent, to a few units in the last place of 1."""
    if is_single(x):
        return _tanh_rational(x)
    return _tanh_exponential(x)


@inlined
def _tanh_rational(x):
    """
    Return the rational minimax approximation of degree 13 / 6 that the Eigen library publishes.

    Beyond +-7.9 tanh is 1 in single precision.
    """
    x = vmin(vmax(x, -7.9), 7.9)
    z = x * x
    p = fma(z, -2.76076847742355e-16, like(x, 2.00018790482477e-13))
    p = fma(z, p, -8.60467152213735e-11)
    p = fma(z, p, 5.12229709037114e-08)
    p = fma(z, p, 1.48572235717979e-05)
    p = fma(z, p, 6.37261928875436e-04)
    p = fma(z, p, 4.89352455891786e-03)
    q = fma(z, 1.19825839466702e-06, like(x, 1.18534705686654e-04))
    q = fma(z, q, 2.26843463243900e-03)
    q = fma(z, q, 4.89352518554385e-03)
    return x * p / q


@inlined
def _tanh_exponential(x):
    """Return (e - 1) / (e + 1), e = exp(2 x) = 2^n exp(r) with r within +-ln(2) / 2."""
    x = vmin(vmax(x, -19.0), 19.0)
    x = x + x
    n = vround(x * PER_LN2)
    r = fma(n, -LN2_LOW, fma(n, -LN2_HIGH, x))
    p = like(x, 1.0 / 6227020800.0)
    p = fma(p, r, 1.0 / 479001600.0)
    p = fma(p, r, 1.0 / 39916800.0)
    p = fma(p, r, 1.0 / 3628800.0)
    p = fma(p, r, 1.0 / 362880.0)
    p = fma(p, r, 1.0 / 40320.0)
    p = fma(p, r, 1.0 / 5040.0)
    p = fma(p, r, 1.0 / 720.0)
    p = fma(p, r, 1.0 / 120.0)
    p = fma(p, r, 1.0 / 24.0)
    p = fma(p, r, 1.0 / 6.0)
    p = fma(p, r, 0.5)
    p = fma(p, r, 1.0)
    p = fma(p, r, 1.0)
    e = p * power_of_two(n)
    return (e - 1.0) / (e + 1.0)


@inlined
def arctan(x):
    """
    Return the inverse tangent, to the last places for |x| up to tan(22.5 degrees).

    In single precision by a polynomial fitted there (error 1e-9), in double by the series.
    """
    z = x * x
    if is_single(x):
        p = fma(z, -0.0641791229, like(x, 0.107337242))
        p = fma(z, p, -0.142630652)
        p = fma(z, p, 0.199995164)
        p = fma(z, p, -0.333333317)
        return fma(x * z, p, x)
    p = like(x, 0.0)
    for i in range(SERIES_TERMS):
        p = fma(z, -p, 1.0 / (2 * (SERIES_TERMS - i) + 1))
    return x * fma(z, -p, 1.0)
