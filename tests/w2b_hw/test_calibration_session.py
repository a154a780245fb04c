"""The keys of a calibration session, on the pulses of emulated chips."""

import math

import pytest

from w2b_hw.calibration import CalibrationError, nominal
from w2b_hw.calibration_session import Session
from w2b_hw.emulation.faults import FaultyTransport, no_acknowledge
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.servo_bank import ServoBank


class Bench:
    def __init__(self):
        self.robot = EmulatedRobot()
        self.wire = FaultyTransport(self.robot.wire)
        bank = ServoBank(self.wire, range(16))
        bank.connect()
        self.session = Session(bank, nominal(calibrated=False))

    def press(self, keys):
        for key in keys:
            self.session.press(key)
        return self.session.message

    def driven(self):
        return {channel: pulse for channel, pulse
                in enumerate(self.robot.pca9685.pulses_us()) if pulse}


@pytest.fixture
def bench():
    return Bench()


def test_it_begins_relaxed_and_drives_one_servo_at_a_time(bench):
    assert bench.driven() == {}
    bench.press('e')
    assert bench.driven() == {0: pytest.approx(1500, abs=3)}
    bench.press('nn')
    assert bench.driven() == {}
    bench.press('e')
    assert list(bench.driven()) == [2]
    bench.press('e')
    assert bench.driven() == {}


def test_steps_are_small_and_only_while_driven(bench):
    assert 'energise' in bench.press('.')
    bench.press('e...>')
    assert bench.driven() == {0: pytest.approx(1535, abs=3)}
    bench.press(',<')
    assert bench.driven() == {0: pytest.approx(1510, abs=3)}


def test_no_key_leads_beyond_what_servos_take(bench):
    assert 'no servo goes beyond 500..2500' in bench.press('e' + '>' * 60)
    assert bench.driven()[0] == pytest.approx(2500, abs=3)


def test_zero_mark_and_range_make_the_servo_of_the_file(bench):
    bench.press('e' + '>' * 2 + 'z')            # zero at 1540
    bench.press('<' * 25 + 'm')                 # +30 degrees at 1040: shorter is positive
    bench.press('<' * 5 + 'l' + '>' * 50 + 'u')  # range 940..1940
    servo = bench.session.finished().servos[0]
    assert (servo.zero_us, servo.direction) == (1540, -1)
    assert servo.us_per_rad == pytest.approx(500 / math.radians(30))
    assert (servo.min_us, servo.max_us) == (940, 1940)
    assert servo.max_rad == pytest.approx(math.radians(30))  # the hip's own limit
    assert servo.min_rad == pytest.approx(-math.radians(24))  # where its pulses end
    assert not bench.session.saved


@pytest.mark.parametrize(('joint', 'degrees'), [(0, 30), (4, 45), (8, 45)])
def test_the_mark_is_within_the_limits_of_the_joint(bench, joint, degrees):
    assert f'move it to +{degrees} degrees first' in bench.press('n' * joint + 'em')
    assert bench.press('>' * 20 + 'm').startswith(f'+{degrees} degrees is here')
    servo = bench.session.finished().servos[joint]
    assert servo.us_per_rad == pytest.approx(400 / math.radians(degrees))


@pytest.mark.parametrize(('steps', 'doubted'), [(10, True), (16, False), (25, False), (40, True)])
def test_a_mark_that_no_servo_has_is_doubted(bench, steps, doubted):
    bench.press('n' * 4)
    assert ('implausible' in bench.press('e' + '>' * steps + 'm')) is doubted
    assert bool(bench.session.finished().servos[4].doubt) is doubted


#: A hip's mark, 360 us from its zero; and back to zero, ten degrees on, and that it moved right.
MARK, DIRECTION = '>' * 18 + 'm', 'tty'


def calibrated(bench):
    return [servo.joint for servo in bench.session.finished().servos if servo.calibrated]


def test_a_servo_is_calibrated_when_zero_mark_and_direction_were_found(bench):
    assert '0 of 12 done' in bench.session.show()
    assert 'lacks z and m and t' in bench.session.show()
    bench.press('e>z')
    assert calibrated(bench) == []
    assert 'lacks m and t' in bench.session.show()
    bench.press(MARK)
    assert calibrated(bench) == []
    assert 'lacks t' in bench.session.show()
    bench.press(DIRECTION)
    assert calibrated(bench) == ['front_left_hip']
    assert 'calibrated, 1 of 12 done' in bench.session.show()
    assert bench.session.finished().problem.startswith(
        '1 of 12 servos are calibrated; not back_left_hip, back_right_hip')
    bench.press('x')
    assert calibrated(bench) == []


def test_all_twelve_make_a_calibration_without_a_problem(bench):
    for _ in range(12):
        bench.press(f'e>z{MARK}{DIRECTION}n')
    assert '12 of 12 done' in bench.session.show()
    assert bench.session.finished().problem == ''


@pytest.mark.parametrize(('key', 'left'), [('+', 0), ('-', 0), (']', 10), ('d', 11), ('u', 12)])
def test_what_was_found_of_another_servo_or_with_another_clock_counts_no_more(bench, key, left):
    for _ in range(12):
        bench.press(f'e>z{MARK}{DIRECTION}n')
    bench.press(key)
    assert len(calibrated(bench)) == left


def test_a_joint_moves_by_ten_degrees_and_what_is_asked_is_what_the_body_does(bench):
    bench.press(f'e>z{MARK}')
    zero_us, slope = 1520.0, 360 / math.radians(30)
    assert 'at zero' in bench.press('t')
    assert bench.driven() == {0: pytest.approx(zero_us, abs=3)}
    # A hip of the twin turns about the vertical: its front left foot goes back and to the left.
    asked = bench.press('t')
    assert bench.driven() == {0: pytest.approx(zero_us + slope * math.radians(10), abs=3)}
    assert '+10 degrees' in asked
    assert 'backward' in asked
    assert 'to the left' in asked
    assert 'direction confirmed' in bench.press('y')
    assert calibrated(bench) == ['front_left_hip']


def test_a_direction_that_was_wrong_is_turned_round_and_has_to_be_tried_again(bench):
    bench.press(f'e>z{MARK}')
    bench.press('ttd')
    assert calibrated(bench) == []
    assert bench.session.finished().servos[0].direction == -1
    bench.press('tt')
    assert bench.driven() == {0: pytest.approx(1520 - 120, abs=3)}
    bench.press('y')
    assert calibrated(bench) == ['front_left_hip']
    bench.press('d')
    assert calibrated(bench) == []


def test_nothing_is_confirmed_that_was_not_tried(bench):
    assert 'energise it first' in bench.press('t')
    assert 'find its zero first' in bench.press('et')
    bench.press(f'>z{MARK}')
    assert 'try it first' in bench.press('y')
    # Something else in between: the question is forgotten.
    assert 'try it first' in bench.press('tt.y')
    assert calibrated(bench) == []


def test_saved_is_only_what_is_in_the_file(bench):
    assert bench.session.show().splitlines()[0].endswith('not in a file')
    bench.press('e>z')
    assert bench.session.show().splitlines()[0].endswith('NOT SAVED')


def test_undo_takes_back_change_after_change_and_relaxes(bench):
    before = bench.session.finished()
    bench.press('e>z>z+d')
    bench.press('e')
    bench.press('x')
    assert bench.driven() == {}
    bench.press('xxx')
    assert bench.session.finished() == before
    assert bench.press('x') == 'nothing to undo'


def test_a_joint_on_another_channel_swaps_with_the_one_that_had_it(bench):
    bench.press('e]')
    assert bench.driven() == {}
    bench.press('e')
    assert list(bench.driven()) == [1]
    assert [servo.channel for servo in bench.session.finished().servos[:3]] == [1, 0, 2]
    bench.press('[[')
    assert [servo.channel for servo in bench.session.finished().servos[:3]] == [15, 1, 2]


def test_the_clock_sets_the_prescale(bench):
    bench.press('+' * 40)
    assert bench.session.finished().board.oscillator_hz == 27e6
    assert bench.robot.pca9685.register(0xFE) == 131
    assert 'oscillator_hz: expected' in bench.press('+' * 100)


def test_values_that_do_not_belong_together_are_not_finished(bench):
    bench.press('e' + '>' * 10 + 'u' + '>' * 10 + 'z')  # zero beyond the range
    with pytest.raises(CalibrationError, match='zero_us'):
        bench.session.finished()


def test_a_spike_on_the_wire_relaxes_and_loses_nothing(bench):
    bench.press('e>z')
    bench.wire.once(no_acknowledge)
    assert 'relaxed' in bench.press('>')
    assert bench.driven() == {}
    assert bench.session.finished().servos[0].zero_us == 1520
    bench.wire.always(no_acknowledge)
    assert 'CUT THEIR SUPPLY' in bench.press('e')


def test_a_brown_out_is_told_and_the_chip_set_up_again(bench):
    bench.press('e')
    bench.robot.pca9685.power_on()
    assert 'lost power' in bench.press('>')
    bench.press('e')
    assert list(bench.driven()) == [0]
