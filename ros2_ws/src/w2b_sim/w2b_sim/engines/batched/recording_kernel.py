"""
The compiled call that records every frame: the physics of `kernel`, either network.

Each evaluation is one controller under one sequence of commands in one situation, in one lane.
Commands change at given frames (*phases*). `Layout.leaky` says, to the compiler, what a command
does: it drives a leaky network with one number a neuron until the next command, or it sets a serial
network's hidden neurons to what its words primed them to, and its motor neurons to 0. Within a
control period the order is the original's: collide, read the senses, set the servos' targets from
the motor neurons as they were, update the network, step the world.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.borrowed import borrow, integers
from w2b_sim.engines.batched.contacts import find
from w2b_sim.engines.batched.effort import add_effort, keep_motion
from w2b_sim.engines.batched.friction import solve_contacts
from w2b_sim.engines.batched.inertia import COMPOSITE, compose
from w2b_sim.engines.batched.integration import integrate
from w2b_sim.engines.batched.kernel import shake_and_push
from w2b_sim.engines.batched.kinematics import drives, hinge_angles, rotations
from w2b_sim.engines.batched.leaky_senses import NEVER, sense, set_reference, yaw_rate
from w2b_sim.engines.batched.memory import allocate, get_lane, local1, local2, set_lane
from w2b_sim.engines.batched.neurons import update, update_leaky
from w2b_sim.engines.batched.parameters import (
    BASE_MASS,
    ERP_PER_H,
    FRICTION,
    GAIN,
    GRAVITY,
    LATE,
    LEAKY_PARAMETERS,
    SLIP,
    SPEED,
    TORQUE,
)
from w2b_sim.engines.batched.rigid import Contacts
from w2b_sim.engines.batched.rows import Solve
from w2b_sim.engines.batched.simd import splat, vmax, vmin, where
from w2b_sim.engines.batched.state import Frame, State, rest


class RecordedBatch(NamedTuple):
    """
    Inputs of E = C * W * K evaluations, in the order of controllers, sequences, situations.

    `hidden_weights` (C, H, H + S): synapses from the hidden neurons, then from the senses;
    `motor_weights` (C, J, H + S), of serial networks (C, J, H). Of leaky networks `hidden_leak`,
    `rest` (C, H) and `motor_leak` (C, J); of serial ones they are not read.
    `heard_hidden` (C * W * P, H) is the drive, or what the hidden neurons are primed to, of each of
    P phases; `heard_motor` (C * W * P, J) the motors' drive, not read of serial networks; `holds`
    (C * W * P, 2), see `w2b_core.courses.holds`; `phase` (T,) is the phase of each frame.
    `start` (E, 5): height, quaternion w, x, y, z; `parameters` (E, LEAKY_PARAMETERS); `zeros`
    (E, J): errors of the joints' zeros, rad; `seeds` (E, padded to whole blocks of lanes) uint32;
    `noisy` whether a parameter asks for random numbers.
    """

    hidden_weights: NDArray[Any]
    hidden_leak: NDArray[Any]
    rest: NDArray[Any]
    motor_weights: NDArray[Any]
    motor_leak: NDArray[Any]
    heard_hidden: NDArray[Any]
    heard_motor: NDArray[Any]
    holds: NDArray[Any]
    phase: NDArray[Any]
    phases: int
    start: NDArray[Any]
    parameters: NDArray[Any]
    zeros: NDArray[Any]
    seeds: NDArray[Any]
    noisy: bool


class FrameLog(NamedTuple):
    """
    Outputs at each of T frames of each evaluation.

    `place` (E, T, 3) and `turn` (E, T, 4) (w, x, y, z) of the base, `yaw_rate` (E, T, 1) about its
    z axis, the mean since the last frame, `angle` and `target` (E, T, J), rad, `touch`
    (E, T, touches). Of the period that ends with the frame: `effort` (E, T, J) is the mean
    magnitude of the torque, N m, `limited` (E, T, J) the share of it for which the servo asked for
    more than its speed.
    """

    place: NDArray[Any]
    turn: NDArray[Any]
    yaw_rate: NDArray[Any]
    angle: NDArray[Any]
    target: NDArray[Any]
    touch: NDArray[Any]
    effort: NDArray[Any]
    limited: NDArray[Any]


def evaluate_recorded(layout, arrays, clock, inputs, outputs, first_block, last_block):
    """
    Run the evaluations of the blocks `first_block` to `last_block` - 1 of `layout.lanes` lanes.

    `arrays` are a body's Tables, `clock` a `kernel.Clock`, `inputs` a RecordedBatch, `outputs` a
    FrameLog. Blocks are independent, so that threads can share a batch.
    """
    tables, batch, log = borrow(arrays), borrow(inputs), borrow(outputs)
    for block in range(first_block, last_block):
        _run_block(layout, tables, clock, batch, log, block * layout.lanes)


@inlined
def _run_block(layout, tables, clock, batch, log, first):
    """Run the evaluations `first`...; lanes beyond the batch repeat the last one, unrecorded."""
    joints, inputs = layout.joints, layout.inputs
    count = batch.start.shape[0]
    each = count // batch.hidden_weights.shape[0]
    hidden_weights = local1(layout, layout.hidden_synapses)
    motor_weights = local1(layout, layout.motor_synapses)
    motor_inputs = layout.motor_inputs
    hidden_leak, motor_leak = local1(layout, layout.hidden), local1(layout, joints)
    start, parameters = local1(layout, 5), local1(layout, LEAKY_PARAMETERS)
    zeros = local1(layout, joints)
    state, frame = allocate(layout, State), allocate(layout, Frame)
    for lane in range(layout.lanes):
        evaluation = min(first + lane, count - 1)
        controller = evaluation // each
        for i in range(layout.hidden):
            for source in range(inputs):
                set_lane(hidden_weights, i * inputs + source, lane,
                         batch.hidden_weights[controller, i, source])
            if layout.leaky:
                set_lane(hidden_leak, i, lane, batch.hidden_leak[controller, i])
                set_lane(state.hidden, i, lane, batch.rest[controller, i])
        for j in range(joints):
            for source in range(motor_inputs):
                set_lane(motor_weights, j * motor_inputs + source, lane,
                         batch.motor_weights[controller, j, source])
            if layout.leaky:
                set_lane(motor_leak, j, lane, batch.motor_leak[controller, j])
            set_lane(zeros, j, lane, batch.zeros[evaluation, j])
        for i in range(5):
            set_lane(start, i, lane, batch.start[evaluation, i])
        for i in range(LEAKY_PARAMETERS):
            set_lane(parameters, i, lane, batch.parameters[evaluation, i])
    rest(layout, tables, state, frame, start)
    state.strength[0] = parameters[TORQUE]
    _walk(layout, tables, clock, batch, log, first, hidden_weights, motor_weights, hidden_leak,
          motor_leak, zeros, parameters, state, frame)


@inlined
def _walk(layout, tables, clock, batch, log, first, hidden_weights, motor_weights, hidden_leak,
          motor_leak, zeros, parameters, state, frame):
    """Let one block of robots walk for all control periods."""
    joints = layout.joints
    motion, composite = local2(layout, layout.links, 6), local2(layout, layout.links, COMPOSITE)
    earlier, wrench = local2(layout, layout.links, 6), local2(layout, layout.links, 6)
    contacts, solve = allocate(layout, Contacts), allocate(layout, Solve)
    touch, felt = local1(layout, layout.touches), local1(layout, layout.touches)
    senses, new = local1(layout, layout.sensors), local1(layout, layout.hidden)
    hidden_drive, motor_drive = local1(layout, layout.hidden), local1(layout, joints)
    holds, reference, axes = local1(layout, 2), local1(layout, 2), local1(layout, 6)
    shove, shake = local1(layout, 2), local1(layout, joints)
    effort, limited, before = (local1(layout, joints), local1(layout, joints),
                               local1(layout, joints))
    near, held = integers(layout, layout.contacts), integers(layout, layout.contacts)
    zero = splat(layout, 0.0)
    for c in range(layout.contacts):
        held[c] = 0
    for sensor in range(layout.touches):
        felt[sensor] = zero
    for j in range(joints):
        shake[j], effort[j], limited[j], before[j] = zero, zero, zero, zero
    shove[0], shove[1] = zero, zero
    phase, primed = NEVER, False
    for t in range(clock.steps):
        for substep in range(clock.physics_steps):
            rotations(layout, state, frame)
            hinge_angles(layout, tables, state)
            if substep == 0:
                if batch.phase[t] != phase:
                    phase = batch.phase[t]
                    _hear(layout, batch, first, phase, hidden_drive, motor_drive, holds, state)
                    primed = True
                    set_reference(frame, parameters, reference)
                _aim(layout, tables, parameters, zeros, state, before)
                if batch.noisy:
                    shake_and_push(layout, batch.seeds, first, t, parameters, shake, shove)
                _record_period(layout, log, first, batch.start.shape[0], t, clock, effort,
                               limited)
            for j in range(joints):
                _servo(layout, tables, clock, state, frame, parameters, shake, limited, j)
            drives(layout, tables, state, frame, parameters[ERP_PER_H])
            found = find(layout, tables, state, frame, touch, near, held, clock.reach)
            if substep == 0:
                turning = yaw_rate(layout, frame, axes, t, clock.h * clock.physics_steps)
                sense(layout, tables, batch.noisy, batch.seeds, first, t, parameters, state, frame,
                      touch, felt, holds, reference, turning, senses)
                _record(layout, log, first, batch.start.shape[0], t, state, turning, touch)
                if layout.leaky:
                    update_leaky(layout, hidden_weights, motor_weights, hidden_drive, motor_drive,
                                 hidden_leak, motor_leak, state.hidden, new, state.motors, senses)
                else:
                    update(layout, tables, hidden_weights, motor_weights, state.hidden, new,
                           state.motors, senses, primed)
                primed = False
                if t == clock.steps - 1:
                    break
            compose(layout, tables, state, frame, composite, parameters[BASE_MASS],
                    (shove[0], shove[1], parameters[GRAVITY]), clock.h)
            solve_contacts(layout, tables, state, frame, composite, contacts, solve, near, found,
                           clock, parameters[ERP_PER_H], parameters[SLIP], parameters[FRICTION])
            keep_motion(layout, state, earlier)
            integrate(layout, tables, state, frame, motion, solve.y, clock.h)
            add_effort(layout, tables, state, frame, solve, earlier, wrench, near, found,
                       (shove[0], shove[1], parameters[GRAVITY]), parameters[SLIP], clock.h, effort)
            shove[0], shove[1] = zero, zero


@inlined
def _hear(layout, batch, first, phase, hidden_drive, motor_drive, holds, state):
    """Load what the command of a phase makes of the network."""
    count = batch.start.shape[0]
    situations = count // (batch.heard_hidden.shape[0] // batch.phases)
    for lane in range(layout.lanes):
        said = min(first + lane, count - 1) // situations * batch.phases + phase
        for i in range(layout.hidden):
            if layout.leaky:
                set_lane(hidden_drive, i, lane, batch.heard_hidden[said, i])
            else:
                set_lane(state.hidden, i, lane, batch.heard_hidden[said, i])
        for j in range(layout.joints):
            if layout.leaky:
                set_lane(motor_drive, j, lane, batch.heard_motor[said, j])
            else:
                set_lane(state.motors, j, lane, 0.0)
        set_lane(holds, 0, lane, batch.holds[said, 0])
        set_lane(holds, 1, lane, batch.holds[said, 1])


@inlined
def _aim(layout, tables, parameters, zeros, state, before):
    """Set the servos' targets; a late command is that of one control period ago."""
    for j in range(layout.joints):
        middle = 0.5 * (tables.upper[j] + tables.lower[j])
        half = 0.5 * (tables.upper[j] - tables.lower[j])
        now = state.motors[j]
        asked = where(parameters[LATE] > 0.5, before[j], now)
        state.target[j] = middle + asked * half + zeros[j]
        before[j] = now


@inlined
def _servo(layout, tables, clock, state, frame, parameters, shake, limited, j):
    """Work out the rate that joint j's servo asks for, and count the steps at its limit."""
    angle = state.angle[j]
    if tables.lower[j] == tables.upper[j]:
        frame.rate[j] = (tables.lower[j] - angle) * parameters[ERP_PER_H]
    else:
        asked = (state.target[j] - angle) * (tables.gain[j] * parameters[GAIN])
        down, up = parameters[SPEED] * -tables.speed_down[j], parameters[SPEED] * tables.speed_up[j]
        rate = vmin(vmax(asked, down), up)
        limited[j] = limited[j] + where(rate == asked, 0.0, splat(layout, 1.0))
        rate = rate + shake[j]
        # A kinematic joint has no stops to run into: it is never driven past its limits.
        per_h = 1.0 / clock.h
        rate = vmin(rate, vmax((tables.upper[j] - angle) * per_h, 0.0))
        frame.rate[j] = vmax(rate, vmin((tables.lower[j] - angle) * per_h, 0.0))


@inlined
def _record_period(layout, log, first, count, t, clock, effort, limited):
    """Write what was summed up in the period that ends, and start anew."""
    for lane in range(min(layout.lanes, count - first)):
        for j in range(layout.joints):
            log.effort[first + lane, t, j] = get_lane(effort, j, lane) / (
                clock.h * clock.physics_steps)
            log.limited[first + lane, t, j] = get_lane(limited, j, lane) / clock.physics_steps
    for j in range(layout.joints):
        effort[j], limited[j] = splat(layout, 0.0), splat(layout, 0.0)


@inlined
def _record(layout, log, first, count, t, state, turning, touch):
    """Write one frame of every lane into the logs."""
    rate = local1(layout, 1)
    rate[0] = turning
    for lane in range(min(layout.lanes, count - first)):
        evaluation = first + lane
        for i in range(3):
            log.place[evaluation, t, i] = get_lane(state.place, i, lane)
        log.yaw_rate[evaluation, t, 0] = get_lane(rate, 0, lane)
        for i in range(4):
            log.turn[evaluation, t, i] = get_lane(state.turn, i, lane)
        for j in range(layout.joints):
            log.angle[evaluation, t, j] = get_lane(state.angle, j, lane)
            log.target[evaluation, t, j] = get_lane(state.target, j, lane)
        for i in range(layout.touches):
            log.touch[evaluation, t, i] = get_lane(touch, i, lane)
