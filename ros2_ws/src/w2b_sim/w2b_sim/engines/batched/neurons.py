"""The recurrent network inside the compiled call: w2b_core.network, on SIMD values."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.borrowed import integers
from w2b_sim.engines.batched.functions import tanh
from w2b_sim.engines.batched.memory import get_lane, local1, set_lane
from w2b_sim.engines.batched.simd import fma, splat


@inlined
def prime_range(layout, hidden_weights, signals, primed, first, last):
    """
    Prime the (controller, word) pairs `first` to `last` - 1, in double precision whatever follows.

    `hidden_weights` (C, H, K), `signals` (C or 1, W, T); the result goes to `primed` (C, W, H).
    """
    count = layout.hidden
    words = signals.shape[1]
    recurrent = local1(layout, layout.priming_synapses)
    hidden, new = local1(layout, layout.hidden), local1(layout, layout.hidden)
    element = local1(layout, 1)
    # Which signal each lane hears.
    voice, word = integers(layout, layout.lanes), integers(layout, layout.lanes)
    for start in range(first, last, layout.lanes):
        for lane in range(layout.lanes):
            pair = min(start + lane, last - 1)
            controller, word[lane] = pair // words, pair % words
            voice[lane] = controller if signals.shape[0] > 1 else 0
            for i in range(count):
                for source in range(count + 1):
                    set_lane(recurrent, i * (count + 1) + source, lane,
                             hidden_weights[controller, i, source])
        for i in range(count):
            hidden[i] = splat(layout, 0.0)
        for t in range(signals.shape[2]):
            for lane in range(layout.lanes):
                set_lane(element, 0, lane, signals[voice[lane], word[lane], t])
            for i in range(count):
                total = hidden[i]
                for source in range(count):
                    total = fma(recurrent[i * (count + 1) + source], hidden[source], total)
                new[i] = tanh(fma(recurrent[i * (count + 1) + count], element[0], total))
            for i in range(count):
                hidden[i] = new[i]
        for lane in range(min(layout.lanes, last - start)):
            pair = start + lane
            for i in range(count):
                primed[pair // words, pair % words, i] = get_lane(hidden, i, lane)


@inlined
def update(layout, tables, weights, motor_weights, hidden, new, motors, senses, primed):
    """
    Advance hidden and motor neurons by one control period.

    Both hear the hidden neurons' previous values. In the first step after priming (`primed`) the
    hidden neurons' own values count twice, as in the original program.
    """
    inputs = layout.inputs
    own = 2.0 if primed else 1.0
    for i in range(layout.hidden):
        total = hidden[i] * own
        for source in range(layout.hidden):
            total = fma(weights[i * inputs + source], hidden[source], total)
        for sensor in range(layout.sensors):
            total = fma(weights[i * inputs + layout.hidden + sensor], senses[sensor], total)
        new[i] = total
    for j in range(layout.joints):
        total = motor_weights[j * layout.hidden] * hidden[0]
        for source in range(1, layout.hidden):
            total = fma(motor_weights[j * layout.hidden + source], hidden[source], total)
        motors[j] = tanh(fma(total, tables.time_constant[j], motors[j]))
    for i in range(layout.hidden):
        hidden[i] = tanh(new[i])


@inlined
def update_leaky(layout, hidden_weights, motor_weights, hidden_drive, motor_drive, hidden_leak,
                 motor_leak, hidden, new, motors, senses):
    """
    Advance the neurons of a leaky network by one control period: `w2b_core.network.leaky.step`.

    Weights (H, H + S) and (J, H + S), row by row.
    """
    inputs = layout.inputs
    for i in range(layout.hidden):
        total = hidden_drive[i]
        for source in range(layout.hidden):
            total = fma(hidden_weights[i * inputs + source], hidden[source], total)
        for sensor in range(layout.sensors):
            total = fma(hidden_weights[i * inputs + layout.hidden + sensor], senses[sensor], total)
        new[i] = fma(hidden_leak[i], tanh(total) - hidden[i], hidden[i])
    for j in range(layout.joints):
        total = motor_drive[j]
        for source in range(layout.hidden):
            total = fma(motor_weights[j * inputs + source], hidden[source], total)
        for sensor in range(layout.sensors):
            total = fma(motor_weights[j * inputs + layout.hidden + sensor], senses[sensor], total)
        motors[j] = fma(motor_leak[j], tanh(total) - motors[j], motors[j])
    for i in range(layout.hidden):
        hidden[i] = new[i]
