"""smbus2's real ioctl code, end to end, against a scripted /dev/i2c-1 (umockdev)."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [str(ROOT / 'ros2_ws' / 'src' / name) for name in ('w2b_hw', 'w2b_core', 'w2b_ros')]
SYSTEM_PYTHON = '/usr/bin/python3'
INSTALL = 'apt-get install umockdev gir1.2-umockdev-1.0 python3-gi'


class KernelBus:
    """The process that plays the kernel, and the environment in which it is the kernel."""

    def __init__(self):
        environment = {**os.environ, 'PYTHONPATH': PACKAGES[0]}
        # The system's Python must not meet the libraries of this one's.
        environment.pop('LD_LIBRARY_PATH', None)
        self._process = subprocess.Popen(
            ['umockdev-wrapper', SYSTEM_PYTHON, str(Path(__file__).with_name('kernel_bus.py'))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
        folder = self._process.stdout.readline().strip()
        assert folder, 'the kernel player did not start'
        self.environment = {**os.environ, 'LD_PRELOAD': 'libumockdev-preload.so.0',
                            'UMOCKDEV_DIR': folder,
                            'PYTHONPATH': os.pathsep.join([*PACKAGES, str(ROOT)])}

    def ask(self, line='outputs'):
        self._process.stdin.write(f'{line}\n')
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def lit(self):
        return [channel for channel, pulse in enumerate(self.ask()['pulses_us']) if pulse]

    def python(self, *arguments):
        return subprocess.run([sys.executable, *arguments], env=self.environment, text=True,
                              capture_output=True, timeout=60, cwd=ROOT)

    def run(self, code):
        """Run code in a process that sees the device; return what it printed as JSON."""
        run = self.python('-c', code)
        assert run.returncode == 0, run.stderr
        return json.loads(run.stdout)

    def close(self):
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()


@pytest.fixture(scope='module')
def bus():
    if shutil.which('umockdev-wrapper') is None:
        pytest.skip(f'no umockdev: {INSTALL}')
    code = "import gi; gi.require_version('UMockdev', '1.0')"
    if subprocess.run([SYSTEM_PYTHON, '-c', code], capture_output=True).returncode:
        pytest.skip(f'no umockdev bindings for {SYSTEM_PYTHON}: {INSTALL}')
    bus = KernelBus()
    yield bus
    bus.close()


def test_raw_smbus2_calls(bus):
    assert bus.run("""
import json, smbus2
with smbus2.SMBus(1) as bus:
    who = bus.read_byte_data(0x6A, 0x0F)
    bus.write_word_data(0x6A, 0x10, 0x4448)
    word = bus.read_word_data(0x6A, 0x10)
    block = bus.read_i2c_block_data(0x6A, 0x10, 3)
    read = smbus2.i2c_msg.read(0x40, 1)
    bus.i2c_rdwr(smbus2.i2c_msg.write(0x40, [0xFE]), read)
    print(json.dumps([who, word, block, list(read)]))
""") == [0x6C, 0x4448, [0x48, 0x44, 0x04], [0x1E]]


def test_the_transport_limits_how_long_a_held_bus_may_block(bus):
    assert bus.run("""
from w2b_hw.transport import open_transport, read_register
transport = open_transport('/dev/i2c-1')
print(list(read_register(transport, 0x40, 0xFE)))
transport.close()
""") == [0x1E]
    assert bus.ask()['timeouts'][-1] == 1  # the kernel's unit is 10 ms


@pytest.mark.parametrize(('number', 'count', 'expected', 'left'), [
    (errno.EREMOTEIO, 2, [0x1E], 0), (errno.EREMOTEIO, 5, errno.EREMOTEIO, 2),
    (errno.EIO, 1, [0x1E], 0), (errno.ETIMEDOUT, 3, errno.ETIMEDOUT, 2)])
def test_the_kernels_errors_are_retried_within_the_budget_or_raised(bus, number, count, expected,
                                                                    left):
    bus.ask(f'fail {number} {count}')
    assert bus.run("""
import json
from w2b_hw.transport import FrameBudget, open_transport, read_register
try:
    print(list(read_register(FrameBudget(open_transport()), 0x40, 0xFE)))
except OSError as error:
    print(error.errno)
""") == expected
    assert bus.ask()['failures'] == left
    bus.ask('fail 0 0')


def test_adafruits_driver_and_the_servo_bank_drive_pulses(bus):
    sent = bus.run("""
import json
from w2b_hw.servo_bank import ServoBank
from w2b_hw.transport import open_transport
bank = ServoBank(open_transport(), range(12))
bank.connect()
print(json.dumps(bank.write({channel: 1500.0 + channel for channel in range(12)})))
""")
    assert bus.ask()['pulses_us'][:12] == pytest.approx(list(sent.values()))
    relaxed = bus.python('-m', 'w2b_hw.relax')
    assert relaxed.returncode == 0, relaxed.stderr
    assert bus.lit() == []


def test_preflight_reads_the_bus(bus):
    run = bus.python('-m', 'w2b_hw.preflight')
    assert 'ok   bus: /dev/i2c-1' in run.stdout
    assert 'ok   imu: lsm6dsox' in run.stdout


def test_relax_says_when_it_could_not(bus):
    bus.ask(f'fail {errno.EREMOTEIO} 100000')
    run = bus.python('-m', 'w2b_hw.relax', '--seconds', '0.1')
    bus.ask('fail 0 0')
    assert run.returncode == 1
    assert 'CUT THE SERVO SUPPLY' in run.stderr


def test_two_programs_cannot_drive_the_same_servos(bus):
    assert 'another program drives' in bus.run("""
import json
from w2b_hw.transport import open_transport, read_register
first = open_transport(exclusive=True)
try:
    open_transport(exclusive=True)
except OSError as error:
    told = str(error)
# What only reads or turns off does not ask.
assert read_register(open_transport(), 0x6A, 0x0F) == bytes([0x6C])
first.close()
open_transport(exclusive=True).close()
print(json.dumps(told))
""")


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGKILL], ids=lambda n: n.name)
def test_a_process_that_ends_leaves_no_channel_driven(bus, number):
    driver = subprocess.Popen([sys.executable, '-m', 'tests.faults.driver', '/dev/i2c-1'],
                              env=bus.environment, cwd=ROOT, stdout=subprocess.PIPE)
    with driver.stdout:
        assert driver.stdout.readline() == b'driven\n'
        assert len(bus.lit()) == 12
        ended_s = time.monotonic()
        driver.send_signal(number)
        while bus.lit():
            assert time.monotonic() < ended_s + 5, 'still driven'
        assert time.monotonic() - ended_s <= 1.0
        driver.wait(10)
