"""The transcendental functions the kernel needs, on SIMD values of either precision."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.simd import (
    any_lane,
    fma,
    is_single,
    like,
    power_of_two,
    vmax,
    vmin,
    vround,
    vsqrt,
    where,
)

#: ln 2 in two parts: whole multiples of the high one are exact.
LN2_HIGH = 6.93147180369123816490e-01
LN2_LOW = 1.90821492927058770002e-10
#: Up to here `inverse_root` takes its polynomial; below 1 there is only rounding.
NEARLY_ONE = 1.1
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
def hinge_angle(sine, cosine):
    """
    Return the angle whose half has this sine and cosine, in rad: 2 arccos(cosine) / sin * sine.

    The quotient is an even and smooth function of the angle; a polynomial in 1 - cosine, fitted to
    angles of up to 90 degrees, is exact to the last places there without a division. At 120 degrees
    it is off by 2e-5 of the angle (in double precision by 4e-10).
    """
    d = 1.0 - cosine
    if is_single(d):
        p = fma(d, 0.0358565357, like(d, 0.04609841945))
        p = fma(d, p, 0.115045894)
        p = fma(d, p, 0.2666120831)
        p = fma(d, p, 0.6666680845)
        return sine * fma(d, p, 1.999999994)
    p = fma(d, 6.3115743009982965e-4, like(d, 1.79317194268977635e-4))
    p = fma(d, p, 1.27865528915629197e-3)
    p = fma(d, p, 2.28906714661641862e-3)
    p = fma(d, p, 4.98277347468046811e-3)
    p = fma(d, p, 1.06547246986799484e-2)
    p = fma(d, p, 2.30881316378142545e-2)
    p = fma(d, p, 5.07936450096164172e-2)
    p = fma(d, p, 1.14285714466971041e-1)
    p = fma(d, p, 2.66666666663739822e-1)
    p = fma(d, p, 6.66666666666685134e-1)
    return sine * fma(d, p, 2.0)


@inlined
def inverse_root(x):
    """
    Return 1 / sqrt(x), to the last places, fast where x is between 1 and `NEARLY_ONE`.

    That is the squared length of a unit quaternion after a step of up to 0.6 rad. The polynomial
    has no division and no root, which keep one of the processor's two arithmetic units busy.
    """
    e = x - 1.0
    if is_single(x):
        p = fma(e, 0.2200988709, like(x, -0.3080536753))
        p = fma(e, p, 0.3748449569)
        p = fma(e, p, -0.4999980931)
        p = fma(e, p, 0.9999999963)
    else:
        p = fma(e, -1.17330864246343537e-1, like(x, 1.83177077586523559e-1))
        p = fma(e, p, -2.07990054552015593e-1)
        p = fma(e, p, 2.25483463761666971e-1)
        p = fma(e, p, -2.46089327459253952e-1)
        p = fma(e, p, 2.73437383296456541e-1)
        p = fma(e, p, -3.12499998228795398e-1)
        p = fma(e, p, 3.74999999986383165e-1)
        p = fma(e, p, -4.99999999999959943e-1)
        p = fma(e, p, 1.0)
    far = x > NEARLY_ONE
    if any_lane(far):
        p = where(far, 1.0 / vsqrt(x), p)
    return p
