"""`calibrate` in a scripted terminal, as over SSH: what it saves, and what it leaves driven."""

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
from w2b_hw.calibration import nominal
from w2b_hw.emulation.client import SocketTransport


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
    # Energised, its zero, its mark 360 us on; back to zero, ten degrees on, and that was right.
    terminal.type('e>z' + '>' * 18 + 'm' + 'tty')
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
