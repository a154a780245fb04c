"""What the senses of `w2b_core.senses` read inside the compiled call for leaky networks."""

from __future__ import annotations

from w2b_core.senses import FULL_YAW_RATE_RAD_S, HEADING_GAIN
from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.memory import noise
from w2b_sim.engines.batched.parameters import (
    DELAY,
    DRIFT,
    DRIFT_NOISE,
    FLIP,
    GRAVITY_NOISE,
    IMU_STREAM,
    OFFSET_COS,
    OFFSET_SIN,
    RATE_BIAS,
    RATE_NOISE,
    STREAMS,
    TOUCH_GAP,
    TOUCH_STREAM,
)
from w2b_sim.engines.batched.simd import fma, splat, vmax, vmin, vsqrt, where
from w2b_sim.engines.batched.supported import (
    GRAVITY,
    HEADING,
    MOTOR,
    POSITION,
    STEER,
    TOUCH,
    YAW_RATE,
)

#: The number of no phase.
NEVER = -1


@inlined
def set_reference(frame, parameters, reference):
    """Take the present heading, turned by the offset, as the one to hold: its x and y."""
    x, y = _ahead(frame)
    reference[0] = x * parameters[OFFSET_COS] - y * parameters[OFFSET_SIN]
    reference[1] = y * parameters[OFFSET_COS] + x * parameters[OFFSET_SIN]


@inlined
def _ahead(frame):
    """Return the unit vector of the base's x axis in the horizontal plane."""
    x, y = frame.rotation[0, 0], frame.rotation[0, 3]
    length = vsqrt(fma(x, x, fma(y, y, 1e-30)))
    return x / length, y / length


@inlined
def sense(layout, tables, noisy, seeds, first, t, parameters, state, frame, touch, felt, holds,
          reference, turning, senses):
    """
    Turn depths into touch (1 or 0), with the sensors' faults, and gather the senses.

    The heading is the gyro's, which drifts: the reference turns by as much the other way. `turning`
    is the mean rate about the base's z axis since the last frame.
    """
    _touch(layout, noisy, seeds, first, t, parameters, touch, felt)
    x, y = _ahead(frame)
    error = y * reference[0] - x * reference[1]
    error = vmin(vmax(HEADING_GAIN * error, -1.0), 1.0)
    gyro = splat(layout, 0.0)
    if noisy:
        gyro = noise(layout, seeds, first, t * STREAMS + IMU_STREAM)
    for sensor in range(layout.sensors):
        kind, source = tables.sensor_kind[sensor], tables.sensor_source[sensor]
        if kind == TOUCH:
            senses[sensor] = touch[source]
        elif kind == POSITION:
            senses[sensor] = state.angle[source]
        elif kind == MOTOR:
            senses[sensor] = state.motors[source]
        elif kind == YAW_RATE:
            rate = turning + parameters[RATE_BIAS] + gyro * parameters[RATE_NOISE]
            senses[sensor] = vmin(vmax(rate * (1.0 / FULL_YAW_RATE_RAD_S), -1.0), 1.0)
        elif kind == GRAVITY:
            down = -frame.rotation[0, 6 + source]
            if noisy:
                draw = noise(layout, seeds, first, t * STREAMS + IMU_STREAM + 1 + source)
                down = down + draw * parameters[GRAVITY_NOISE]
            senses[sensor] = vmin(vmax(down, -1.0), 1.0)
        elif kind == HEADING:
            senses[sensor] = holds[0] * error
        elif kind == STEER:
            senses[sensor] = holds[1] * error
    drift = fma(gyro, parameters[DRIFT_NOISE], parameters[DRIFT])
    cosine = fma(drift * drift, -0.5, 1.0)
    x, y = reference[0], reference[1]
    reference[0] = fma(drift, y, cosine * x)
    reference[1] = fma(-drift, x, cosine * y)


@inlined
def _touch(layout, noisy, seeds, first, t, parameters, touch, felt):
    """Turn depths into touch, with the sensors' delay and faults."""
    for i in range(layout.touches):
        touches = where(touch[i] >= -parameters[TOUCH_GAP], 1.0, touch[i] * 0.0)
        if noisy:
            late = where(parameters[DELAY] > 0.5, felt[i], touches)
            felt[i] = touches
            draw = noise(layout, seeds, first, t * STREAMS + TOUCH_STREAM + i)
            touches = where(draw * 0.5 + 0.5 < parameters[FLIP], 1.0 - late, late)
        touch[i] = touches


@inlined
def yaw_rate(layout, frame, axes, t, period_s):
    """
    Return the mean rate about the base's z axis since the last frame; 0 in the first one.

    `axes` (6) are the base's x and y axes of that frame, and become those of this one. The sine of
    the angle stands for the angle.
    """
    turned = splat(layout, 0.0)
    for i in range(3):
        x, y = frame.rotation[0, 3 * i], frame.rotation[0, 3 * i + 1]
        if t > 0:
            turned = turned + axes[3 + i] * x - axes[i] * y
        axes[i], axes[3 + i] = x, y
    return turned * (0.5 / period_s)
