"""The stream of frames: stamps have to grow; a stream that was lost may go on or start over."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from w2b_core.frame_stream import (
    FIRST_FRAME_S,
    LARGEST_LEAP_PERIODS,
    FrameStream,
    Verdict,
)

PERIOD_NS = 50_000_000
TIMEOUT_S = 0.5


class HandClock:
    """A clock that moves when told to."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def stream(clock):
    return FrameStream(0.05, TIMEOUT_S, clock)


def test_without_a_first_frame_it_is_lost_after_the_timeout(stream, clock):
    clock.now_s += TIMEOUT_S + FIRST_FRAME_S - 0.01
    assert not stream.lost
    clock.now_s += 0.02
    assert stream.lost
    assert stream.judge(7 * PERIOD_NS) is Verdict.NEXT
    assert not stream.lost


def test_growing_stamps_are_next_frames_even_with_gaps(stream):
    verdicts = [stream.judge(number * PERIOD_NS) for number in (1, 2, 5, 6)]
    assert verdicts == [Verdict.NEXT] * 4


def test_the_same_stamp_is_a_repetition(stream):
    stream.judge(PERIOD_NS)
    assert stream.judge(PERIOD_NS) is Verdict.REPEATED


def test_an_older_stamp_is_stale_while_frames_flow(stream, clock):
    stream.judge(10 * PERIOD_NS)
    clock.now_s += TIMEOUT_S - 0.01
    assert stream.judge(9 * PERIOD_NS) is Verdict.STALE
    assert stream.last_stamp_ns == 10 * PERIOD_NS


def test_a_leap_is_refused_while_frames_flow_so_that_one_cannot_lock_the_stream(stream):
    stream.judge(PERIOD_NS)
    assert stream.judge((LARGEST_LEAP_PERIODS + 2) * PERIOD_NS) is Verdict.LEAP
    assert stream.judge(2 * PERIOD_NS) is Verdict.NEXT


def test_a_lost_stream_goes_on_with_later_stamps(stream, clock):
    stream.judge(PERIOD_NS)
    clock.now_s += TIMEOUT_S + 0.01
    assert stream.lost
    assert stream.judge(1000 * PERIOD_NS) is Verdict.NEXT
    assert not stream.lost


def test_a_lost_stream_that_starts_over_is_told(stream, clock):
    stream.judge(1000 * PERIOD_NS)
    clock.now_s += TIMEOUT_S + 0.01
    assert stream.judge(PERIOD_NS) is Verdict.RESTARTED
    assert stream.judge(2 * PERIOD_NS) is Verdict.NEXT


def test_stale_frames_do_not_keep_a_stream_alive(stream, clock):
    stream.judge(1000 * PERIOD_NS)
    for number in range(1, 7):
        clock.now_s += 0.1
        verdict = stream.judge(number * PERIOD_NS)
    assert verdict is Verdict.RESTARTED


@given(st.lists(st.tuples(st.integers(1, 10**12), st.floats(0.0, 0.02)), max_size=20))
def test_while_frames_flow_accepted_stamps_never_go_back(frames):
    clock = HandClock()
    stream = FrameStream(0.05, TIMEOUT_S, clock)
    accepted = []
    for stamp_ns, pause_s in frames:
        clock.now_s += pause_s
        if stream.judge(stamp_ns) in (Verdict.NEXT, Verdict.REPEATED):
            accepted.append(stamp_ns)
    assert accepted == sorted(accepted)
    assert stream.last_stamp_ns == (accepted[-1] if accepted else None)
