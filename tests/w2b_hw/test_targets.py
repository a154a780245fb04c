"""Which targets are refused, and why."""

import math

import pytest

from w2b_hw.joints import JOINTS
from w2b_hw.targets import TargetGate, TargetRefusedError

NOW_NS = 1_000_000_000_000
MS = 1_000_000
POSE = [0.01 * n for n in range(12)]


@pytest.fixture
def gate():
    return TargetGate()


def test_a_good_target_comes_out_in_the_order_of_the_joints(gate):
    assert gate.check(JOINTS[::-1], [POSE[::-1]], NOW_NS - 5 * MS, NOW_NS) == tuple(POSE)
    assert (gate.accepted, gate.refused) == (1, 0)


@pytest.mark.parametrize(('names', 'points', 'message'), [
    (JOINTS, [], 'expected 1 point, got 0'),
    (JOINTS, [POSE, POSE], 'expected 1 point, got 2'),
    (JOINTS, [POSE[:11]], '12 names and 11 positions'),
    (JOINTS[:11], [POSE[:11]], 'front_right_ankle missing'),
    ((*JOINTS[:11], 'tail'), [POSE], 'another body'),
    ((*JOINTS, 'tail'), [[*POSE, 0.0]], 'unexpected tail'),
    ((*JOINTS[:11], JOINTS[0]), [POSE], 'more than once'),
    (JOINTS, [[*POSE[:11], math.nan]], 'finite'),
    (JOINTS, [[*POSE[:11], math.inf]], 'finite'),
    (JOINTS, [[*POSE[:11], -math.inf]], 'finite')])
def test_targets_that_are_not_whole_are_refused(gate, names, points, message):
    with pytest.raises(TargetRefusedError, match=message):
        gate.check(names, points, NOW_NS, NOW_NS)
    assert (gate.accepted, gate.refused) == (0, 1)


@pytest.mark.parametrize(('stamp_ns', 'message'), [
    (NOW_NS - 151 * MS, '0.151 s old'), (0, 'old'), (NOW_NS + 1 * MS, 'in the future')])
def test_targets_that_are_not_fresh_are_refused(gate, stamp_ns, message):
    with pytest.raises(TargetRefusedError, match=message):
        gate.check(JOINTS, [POSE], stamp_ns, NOW_NS)


def test_a_target_that_comes_twice_or_out_of_order_is_refused(gate):
    gate.check(JOINTS, [POSE], NOW_NS - 10 * MS, NOW_NS)
    for stamp_ns in (NOW_NS - 10 * MS, NOW_NS - 60 * MS):
        with pytest.raises(TargetRefusedError, match='not later'):
            gate.check(JOINTS, [POSE], stamp_ns, NOW_NS)


def test_a_refused_target_does_not_count_as_the_last(gate):
    with pytest.raises(TargetRefusedError):
        gate.check(JOINTS, [[math.nan] * 12], NOW_NS, NOW_NS)
    assert gate.check(JOINTS, [POSE], NOW_NS - 10 * MS, NOW_NS)


def test_a_clock_that_was_set_back_does_not_end_the_walk_for_ever(gate):
    gate.check(JOINTS, [POSE], NOW_NS, NOW_NS)
    earlier_ns = NOW_NS - 500_000 * MS
    assert gate.check(JOINTS, [POSE], earlier_ns - 5 * MS, earlier_ns)
    with pytest.raises(TargetRefusedError, match='not later'):
        gate.check(JOINTS, [POSE], earlier_ns - 5 * MS, earlier_ns)
