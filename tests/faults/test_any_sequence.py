"""No sequence of targets, requests and faults makes a pulse that must not be, at the pins."""

from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.faults.rig import Rig
from w2b_hw.emulation.faults import bus_held, cut_after, is_burst, no_acknowledge
from w2b_hw.joints import JOINTS
from w2b_hw.safety import State

angles = st.lists(st.one_of(st.floats(-10, 10), st.just(float('nan'))), min_size=12, max_size=12)
events = st.one_of(
    st.tuples(st.just('walk'), st.integers(1, 8)),
    st.tuples(st.just('target'), angles, st.integers(1, 8)),
    st.tuples(st.just('silence'), st.integers(1, 20)),
    st.tuples(st.just('arm')), st.tuples(st.just('arm')), st.tuples(st.just('disarm')),
    st.tuples(st.just('stop')), st.tuples(st.just('brown-out')),
    st.tuples(st.just('nack'), st.integers(1, 12)),
    st.tuples(st.just('cut'), st.integers(0, 49), st.integers(1, 4)),
    st.tuples(st.just('held'), st.integers(1, 8)),
    st.tuples(st.just('mode1'), st.integers(0, 255)),
    st.tuples(st.just('supply'), st.booleans()),
    st.tuples(st.just('imu'), st.booleans()),
    st.tuples(st.just('feel'), st.tuples(*[st.floats(-20, 20)] * 3), st.integers(1, 30)),
    st.tuples(st.just('word'), st.sampled_from(['', 'standing', 'word@', 'word@old.1', 'word@now']),
              st.integers(1, 8)),
    st.tuples(st.just('stall'), st.floats(0, 1)))


def happen(rig, name, *values):
    """Let one event happen; the rig judges every pulse."""
    robot, chips, frames = rig.robot, rig.chips, 1
    rig.answer = rig.walk
    if name == 'walk':
        frames = values[0]
    elif name == 'target':
        frames = values[1]
        rig.answer = lambda stamp_ns: (JOINTS, [values[0]], stamp_ns)
    elif name == 'silence':
        frames, rig.answer = values[0], rig.silence
    elif name == 'arm':
        if robot.arm(rig.now_s) is None:
            rig.armed = True
    elif name == 'disarm':
        robot.disarm(rig.now_s)
    elif name == 'stop':
        robot.stop(rig.now_s)
    elif name == 'brown-out':
        chips.pca9685.power_on()
    elif name == 'nack':
        rig.wire.once(no_acknowledge, values[0])
    elif name == 'cut':
        rig.wire.once(cut_after(values[0]), values[1], when=is_burst)
    elif name == 'held':
        frames = values[0]
        rig.wire.always(bus_held)
    elif name == 'mode1':
        chips.pca9685.corrupt(0x00, values[0])
    elif name == 'supply':
        rig.supply.write_text(f'{int(values[0])}\n')
    elif name == 'feel':
        chips.motion.acceleration_m_s2, frames = values[0], values[1]
    elif name == 'word':
        rig.mark = values[0].replace('now', robot.safety.epoch)
        frames = values[1]
    elif name == 'imu':
        chips.imu_chips[0].frozen = values[0]
    else:
        rig.now_s += values[0]
    for _ in range(frames):
        rig.frame()
    rig.wire.always(None)


@settings(max_examples=80, deadline=None)
@given(st.lists(events, max_size=40), st.booleans())
def test_no_sequence_of_events_makes_a_wrong_pulse(sequence, walking):
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        if walking:
            rig.arm()
        for event in sequence:
            happen(rig, *event)
        # Whatever came before: silence ends in off, and stays so.
        rig.wire.clear()
        rig.answer = rig.silence
        for _ in range(70):
            rig.frame()
        assert rig.off()
        assert rig.robot.safety.state in (State.DISARMED, State.FAULT)
