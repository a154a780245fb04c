"""Calibrating: the session's keys, and the command itself in a scripted terminal."""

import math
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

import pytest

from w2b_core.shell import w2b_command
from w2b_hw import calibration
from w2b_hw.calibration import CalibrationError, nominal
from w2b_hw.calibration_session import Session
from w2b_hw.emulation.client import SocketTransport
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


class ScriptedTerminal:
    """The command in a pseudo-terminal, as over SSH."""

    def __init__(self, *arguments):
        self.master, slave = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'w2b_hw.calibrate', *arguments],
            stdin=slave, stdout=slave, stderr=slave)
        os.close(slave)
        self.screen = ''

    def expect(self, text, deadline_s=15.0):
        """Read until the text shows after what was expected before."""
        end_s = time.monotonic() + deadline_s
        while text not in self.screen:
            ready, _, _ = select.select([self.master], [], [], max(0, end_s - time.monotonic()))
            assert ready, f'no {text!r} on the screen: {self.screen}'
            try:
                self.screen += os.read(self.master, 4096).decode()
            except OSError:
                raise AssertionError(f'it ended without {text!r}: {self.screen}') from None
        self.screen = self.screen.split(text, 1)[1]

    def type(self, keys):
        os.write(self.master, keys.encode())


@pytest.fixture
def chips(tmp_path):
    path = str(tmp_path / 'chips')
    server = subprocess.Popen([sys.executable, '-m', 'w2b_hw.emulation.server', path],
                              stdout=subprocess.PIPE)
    assert b'emulated chips' in server.stdout.readline()
    client = SocketTransport(path)
    client.path = path
    yield client
    client.close()
    server.terminate()
    server.wait()
    server.stdout.close()


def lit(chips):
    return [channel for channel, pulse in enumerate(chips.outputs()[-1].pulses_us) if pulse]


def wait_until_off(chips, deadline_s):
    end_s = time.monotonic() + deadline_s
    while lit(chips):
        assert time.monotonic() < end_s, 'still driven'


def test_the_command_calibrates_undoes_and_saves(chips, tmp_path):
    path = tmp_path / 'calibration.yaml'
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}', '--file', str(path))
    terminal.expect('nominal values')
    terminal.expect('front_left_hip')
    terminal.type('e')
    terminal.expect('DRIVEN')
    assert lit(chips) == [0]
    for _ in range(3):
        terminal.type('.')
        terminal.expect(' us')
    terminal.type('z')
    terminal.expect('zero is here')
    terminal.type('d')
    terminal.expect('turned round')
    terminal.type('x')
    terminal.expect('undone')
    terminal.type('q')
    terminal.expect('NOT SAVED: s saves')
    assert lit(chips) == []
    terminal.type('s')
    terminal.expect(f'saved {path}')
    terminal.type('q')
    assert terminal.process.wait(10) == 0
    servo = calibration.load(path).servos[0]
    assert (servo.zero_us, servo.direction) == (1515, 1)
    assert lit(chips) == []


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL],
                         ids=lambda number: number.name)
def test_the_command_leaves_no_servo_driven_however_it_ends(chips, tmp_path, number):
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}',
                                '--file', str(tmp_path / 'c.yaml'))
    terminal.expect('front_left_hip')
    terminal.type('e')
    terminal.expect('DRIVEN')
    assert lit(chips) == [0]
    terminal.process.send_signal(number)
    wait_until_off(chips, 1.0)
    terminal.process.wait(10)


def test_without_a_terminal_it_says_so(tmp_path):
    run = subprocess.run([sys.executable, '-m', 'w2b_hw.calibrate', '--transport', 'emulated'],
                         stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert run.returncode == 1
    assert re.fullmatch(r'calibrate: expected a terminal; over SSH use `ssh -t`\n', run.stderr)


def test_sealing_from_the_command_line(tmp_path):
    path = tmp_path / 'c.yaml'
    calibration.save(nominal(), path)
    path.write_text(path.read_text().replace('25000000.0', '26000000.0'))
    command = [sys.executable, '-m', 'w2b_hw.calibrate', '--seal', '--file', str(path)]
    assert subprocess.run(command, capture_output=True, timeout=60).returncode == 0
    assert calibration.load(path).board.oscillator_hz == 26e6


def test_sealing_without_a_file_says_how_to_make_one(tmp_path):
    command = [sys.executable, '-m', 'w2b_hw.calibrate', '--seal', '--file', f'{tmp_path}/c.yaml']
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 1
    assert run.stderr == (f'calibrate: no calibration file at {tmp_path}/c.yaml: make one with '
                          f'`{w2b_command("calibrate")}`\n')


def test_a_save_that_fails_is_no_save(chips, tmp_path):
    folder = tmp_path / 'file'
    folder.write_text('in the way')
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}',
                                '--file', str(folder / 'c.yaml'))
    terminal.expect('not in a file')
    terminal.type('s')
    terminal.expect('NOT SAVED')
    terminal.expect('not saved: ')
    terminal.type('q')
    terminal.expect('NOT SAVED: s saves')
    terminal.type('q')
    assert terminal.process.wait(10) == 0


def test_what_is_lost_with_the_line_is_said(chips, tmp_path):
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}',
                                '--file', str(tmp_path / 'c.yaml'))
    terminal.expect('not in a file')
    terminal.type('e>z')
    terminal.expect('zero is here')
    terminal.type('\x04')
    terminal.expect('NOT SAVED: what was found is lost')
    assert terminal.process.wait(10) == 0


def test_one_of_twelve_is_saved_as_one_of_twelve_and_goes_on_later(chips, tmp_path):
    path = tmp_path / 'c.yaml'
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}', '--file', str(path))
    terminal.expect('front_left_hip')
    terminal.type('e>z' + MARK + DIRECTION)
    terminal.expect('1 of 12 done')
    terminal.type('s')
    terminal.expect('1 of 12 servos are calibrated; not back_left_hip')
    terminal.type('q')
    assert terminal.process.wait(10) == 0
    assert [servo.calibrated for servo in calibration.load(path).servos] == [True] + [False] * 11
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}', '--file', str(path))
    terminal.expect('calibrated, 1 of 12 done | saved')
    terminal.type('q')
    assert terminal.process.wait(10) == 0


def test_sealing_says_what_is_not_calibrated(tmp_path):
    path = tmp_path / 'c.yaml'
    calibration.save(nominal(calibrated=False), path)
    path.write_text(path.read_text().replace('calibrated: false', 'calibrated: true', 1)
                    .replace('us_per_rad: 636.6197723675814', 'us_per_rad: 1200.0', 1))
    command = [sys.executable, '-m', 'w2b_hw.calibrate', '--seal', '--file', str(path)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert 'but 1 of 12 servos are calibrated' in run.stdout
    assert 'but front_left_hip: 1200 us/rad' in run.stdout


def test_a_file_that_could_not_be_read_is_not_lost_when_another_is_saved(chips, tmp_path):
    path = tmp_path / 'c.yaml'
    calibration.save(nominal(), path)
    edited = path.read_text().replace('25000000.0', '26000000.0')
    path.write_text(edited)
    terminal = ScriptedTerminal('--transport', f'emulated:{chips.path}', '--file', str(path))
    terminal.expect('checksum does not fit')
    terminal.expect('not in a file')
    terminal.type('s')
    terminal.expect('what was there before is c.yaml.before.1')
    terminal.type('s')
    terminal.expect('saved')
    terminal.type('q')
    assert terminal.process.wait(10) == 0
    assert sorted(one.name for one in tmp_path.glob('c.yaml*')) == ['c.yaml', 'c.yaml.before.1']
    assert (tmp_path / 'c.yaml.before.1').read_text() == edited
