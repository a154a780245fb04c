"""
The compiled call: a range of evaluations from the words' elements to the final positions.

Each evaluation is one controller under one word from one start, in one lane. Within a control
period, as in the original program: collide, read the sensors, set the servos' targets from the
motor neurons as they were, update the network, then step the world.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.borrowed import borrow, integers
from w2b_sim.engines.batched.contacts import find
from w2b_sim.engines.batched.friction import solve_contacts
from w2b_sim.engines.batched.inertia import COMPOSITE, compose
from w2b_sim.engines.batched.integration import integrate
from w2b_sim.engines.batched.kinematics import drives, hinge_angles, rotations
from w2b_sim.engines.batched.memory import allocate, get_lane, local1, local2, noise, set_lane
from w2b_sim.engines.batched.neurons import prime_range, update
from w2b_sim.engines.batched.parameters import (
    BASE_MASS,
    DELAY,
    ERP_PER_H,
    FLIP,
    FRICTION,
    GAIN,
    GRAVITY,
    MOTOR_NOISE,
    MOTOR_STREAM,
    PARAMETERS,
    PUSH,
    PUSH_STREAM,
    SLIP,
    STREAMS,
    TOUCH_GAP,
    TOUCH_STREAM,
)
from w2b_sim.engines.batched.rigid import Contacts
from w2b_sim.engines.batched.rows import Solve
from w2b_sim.engines.batched.simd import splat, vmax, vmin, vsqrt, where
from w2b_sim.engines.batched.state import Frame, State, rest
from w2b_sim.engines.batched.supported import POSITION, TOUCH


class Clock(NamedTuple):
    """
    Times and effort: `h` s a physics step, `physics_steps` of them in each of `steps` periods.

    A contact begins at a gap of `reach` m, and within it a link approaches the floor at no more
    than the gap times `per_gap` 1/s.
    """

    h: float
    physics_steps: int
    steps: int
    first_sweeps: int
    second_sweeps: int
    reach: float
    per_gap: float


class Batch(NamedTuple):
    """
    Inputs of E = C * W * K evaluations, in the order of controllers, words, starts.

    `hidden_weights` (C, H, H + 1 + S), `motor_weights` (C, J, H), `signals` (C or 1, W, T) and
    `primed` (C, W, H): the compiled call primes it, unless the signals are empty. `start` (E, 5):
    height, quaternion w, x, y, z; `parameters` (E, PARAMETERS); `seeds` (E, padded to whole blocks
    of lanes) uint32; `noisy` whether a parameter asks for random numbers.
    """

    hidden_weights: NDArray[Any]
    motor_weights: NDArray[Any]
    signals: NDArray[Any]
    primed: NDArray[Any]
    start: NDArray[Any]
    parameters: NDArray[Any]
    seeds: NDArray[Any]
    noisy: bool


class Log(NamedTuple):
    """
    Outputs. `outcome` (E, 8 + touches): final x, y, z, path length, longest step, touch fractions,
    then x, y half-way in time and the farthest x-y distance from the start.
    """

    outcome: NDArray[Any]


def evaluate(layout, double_layout, arrays, clock, inputs, outputs, first_block, last_block):
    """
    Run the evaluations of the blocks `first_block` to `last_block` - 1 of `layout.lanes` lanes.

    `arrays` are a body's Tables, `inputs` a Batch, `outputs` a Log. Blocks are independent, so that
    threads can share a batch. `double_layout` is the layout's
    like in double precision, in which words are always primed.
    """
    tables, batch, log = borrow(arrays), borrow(inputs), borrow(outputs)
    count = batch.start.shape[0]
    starts = count // (batch.primed.shape[0] * batch.primed.shape[1])
    first = first_block * layout.lanes
    last = min(last_block * layout.lanes, count)
    if batch.signals.shape[2] > 0 and first < last:
        prime_range(double_layout, batch.hidden_weights, batch.signals, batch.primed,
                    first // starts, (last - 1) // starts + 1)
    for block in range(first_block, last_block):
        _run_block(layout, tables, clock, batch, log, block * layout.lanes, count, starts)


def prime(layout, hidden_weights, signals, primed):
    """
    Prime C controllers with their W words, as `evaluate` does: see `neurons.prime_range`.

    `layout` is one in double precision, `primed` (C, W, H) the result.
    """
    prime_range(layout, hidden_weights, signals, primed, 0, primed.shape[0] * primed.shape[1])


@inlined
def _run_block(layout, tables, clock, batch, log, first, count, starts):
    """Run the evaluations `first`...; lanes beyond the batch repeat the last one, unrecorded."""
    joints = layout.joints
    inputs = layout.inputs
    weights = local1(layout, layout.hidden_synapses)
    motor_weights = local1(layout, layout.motor_synapses)
    start, parameters = local1(layout, 5), local1(layout, PARAMETERS)
    state, frame = allocate(layout, State), allocate(layout, Frame)
    words = batch.primed.shape[1]
    for lane in range(layout.lanes):
        evaluation = min(first + lane, count - 1)
        pair = evaluation // starts
        controller = pair // words
        for i in range(layout.hidden):
            for source in range(layout.hidden):
                set_lane(weights, i * inputs + source, lane,
                         batch.hidden_weights[controller, i, source])
            for sensor in range(layout.sensors):
                set_lane(weights, i * inputs + layout.hidden + sensor, lane,
                         batch.hidden_weights[controller, i, layout.hidden + 1 + sensor])
            set_lane(state.hidden, i, lane, batch.primed[controller, pair % words, i])
        for j in range(joints):
            for source in range(layout.hidden):
                set_lane(motor_weights, j * layout.hidden + source, lane,
                         batch.motor_weights[controller, j, source])
        for i in range(5):
            set_lane(start, i, lane, batch.start[evaluation, i])
        for i in range(PARAMETERS):
            set_lane(parameters, i, lane, batch.parameters[evaluation, i])
    rest(layout, tables, state, frame, start)
    outcome = local1(layout, layout.outcomes)
    _walk(layout, tables, clock, batch, first, weights, motor_weights, parameters, state, frame,
          outcome)
    for lane in range(min(layout.lanes, count - first)):
        for i in range(layout.outcomes):
            log.outcome[first + lane, i] = get_lane(outcome, i, lane)


@inlined
def _walk(layout, tables, clock, batch, first, weights, motor_weights, parameters, state, frame,
          outcome):
    """Let one block of robots walk for all control periods; fill `outcome`."""
    joints = layout.joints
    motion, composite = local2(layout, layout.links, 6), local2(layout, layout.links, COMPOSITE)
    contacts, solve = allocate(layout, Contacts), allocate(layout, Solve)
    touch, felt = local1(layout, layout.touches), local1(layout, layout.touches)
    senses, new = local1(layout, layout.sensors), local1(layout, layout.hidden)
    shove = local1(layout, 2)
    shake = local1(layout, layout.joints)
    near, held = integers(layout, layout.contacts), integers(layout, layout.contacts)
    for c in range(layout.contacts):
        held[c] = 0
    for i in range(3, layout.outcomes):
        outcome[i] = splat(layout, 0.0)
    for sensor in range(layout.touches):
        felt[sensor] = splat(layout, 0.0)
    for j in range(joints):
        shake[j] = splat(layout, 0.0)
    shove[0] = splat(layout, 0.0)
    shove[1] = splat(layout, 0.0)
    x, y = state.place[0], state.place[1]
    far = 5 + layout.touches + 2
    for t in range(clock.steps):
        for substep in range(clock.physics_steps):
            rotations(layout, state, frame)
            hinge_angles(layout, tables, state)
            if substep == 0:
                dx, dy = state.place[0] - x, state.place[1] - y
                step = vsqrt(dx * dx + dy * dy)
                outcome[3] = outcome[3] + step
                outcome[4] = vmax(step, outcome[4])
                x, y = state.place[0], state.place[1]
                outcome[far] = vmax(x * x + y * y, outcome[far])
                if t == clock.steps // 2:
                    outcome[far - 2], outcome[far - 1] = x, y
                for j in range(joints):
                    middle = 0.5 * (tables.upper[j] + tables.lower[j])
                    half = 0.5 * (tables.upper[j] - tables.lower[j])
                    state.target[j] = middle + state.motors[j] * half
                if batch.noisy:
                    shake_and_push(layout, batch.seeds, first, t, parameters, shake, shove)
            for j in range(joints):
                _servo(layout, tables, clock, state, frame, parameters, shake, j)
            drives(layout, tables, state, frame, parameters[ERP_PER_H])
            found = find(layout, tables, state, frame, touch, near, held, clock.reach)
            if substep == 0:
                _sense(layout, tables, batch.noisy, batch.seeds, first, t, parameters, state,
                       touch, felt, senses, outcome)
                update(layout, tables, weights, motor_weights, state.hidden, new, state.motors,
                       senses, t == 0)
                if t == clock.steps - 1:
                    break
            impulse = (shove[0], shove[1], parameters[GRAVITY])
            compose(layout, tables, state, frame, composite, parameters[BASE_MASS], impulse,
                    clock.h)
            solve_contacts(layout, tables, state, frame, composite, contacts, solve, near, found,
                           clock, parameters[ERP_PER_H], parameters[SLIP], parameters[FRICTION])
            integrate(layout, tables, state, frame, motion, solve.y, clock.h)
            shove[0] = splat(layout, 0.0)
            shove[1] = splat(layout, 0.0)
    for i in range(3):
        outcome[i] = state.place[i]
    for sensor in range(layout.touches):
        outcome[5 + sensor] = outcome[5 + sensor] / clock.steps
    outcome[far] = vsqrt(outcome[far])


@inlined
def _servo(layout, tables, clock, state, frame, parameters, shake, j):
    """Work out the rate that joint j's servo asks for; a locked joint corrects its angle."""
    angle = state.angle[j]
    if tables.lower[j] == tables.upper[j]:
        frame.rate[j] = (tables.lower[j] - angle) * parameters[ERP_PER_H]
    else:
        rate = (state.target[j] - angle) * (tables.gain[j] * parameters[GAIN])
        rate = vmin(vmax(rate, -tables.speed_down[j]), tables.speed_up[j]) + shake[j]
        # A kinematic joint has no stops to run into: it is never driven past its limits.
        per_h = 1.0 / clock.h
        rate = vmin(rate, vmax((tables.upper[j] - angle) * per_h, 0.0))
        frame.rate[j] = vmax(rate, vmin((tables.lower[j] - angle) * per_h, 0.0))


@inlined
def shake_and_push(layout, seeds, first, t, parameters, shake, shove):
    """Draw this period's motor noise and push."""
    for j in range(layout.joints):
        draw = noise(layout, seeds, first, t * STREAMS + MOTOR_STREAM + j)
        shake[j] = draw * parameters[MOTOR_NOISE]
    for i in range(2):
        shove[i] = noise(layout, seeds, first, t * STREAMS + PUSH_STREAM + i) * parameters[PUSH]


@inlined
def _sense(layout, tables, noisy, seeds, first, t, parameters, state, touch, felt, senses,
           outcome):
    """Turn depths into touch (1 or 0), with the sensors' faults, and gather the sensor neurons."""
    for i in range(layout.touches):
        touches = where(touch[i] >= -parameters[TOUCH_GAP], 1.0, touch[i] * 0.0)
        outcome[5 + i] = outcome[5 + i] + touches
        if noisy:
            late = where(parameters[DELAY] > 0.5, felt[i], touches)
            felt[i] = touches
            draw = noise(layout, seeds, first, t * STREAMS + TOUCH_STREAM + i)
            touches = where(draw * 0.5 + 0.5 < parameters[FLIP], 1.0 - late, late)
        touch[i] = touches
    for sensor in range(layout.sensors):
        source = tables.sensor_source[sensor]
        if tables.sensor_kind[sensor] == TOUCH:
            senses[sensor] = touch[source]
        elif tables.sensor_kind[sensor] == POSITION:
            senses[sensor] = state.angle[source]
        else:
            senses[sensor] = state.motors[source]
