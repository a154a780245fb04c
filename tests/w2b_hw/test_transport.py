"""The transport's retries, and what a name opens."""

import errno
import importlib.util
import subprocess
import sys

import pytest

from w2b_hw.emulation.faults import FaultyTransport, bus_held, flipped_bit, no_acknowledge
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.transport import FrameBudget, open_transport, read_register


@pytest.fixture
def faulty():
    return FaultyTransport(EmulatedRobot().wire)


@pytest.mark.parametrize('times', [1, 2])
def test_up_to_two_missing_acknowledges_in_a_frame_are_borne(faulty, times):
    bus = FrameBudget(faulty)
    faulty.once(no_acknowledge, times)
    assert read_register(bus, 0x40, 0x00) == b'\x11'
    assert bus.retried == times


def test_the_budget_is_the_frames_and_not_the_transfers(faulty):
    bus = FrameBudget(faulty)
    faulty.once(no_acknowledge, 2)
    read_register(bus, 0x40, 0x00)
    faulty.once(no_acknowledge)
    with pytest.raises(OSError, match='injected') as error:
        read_register(bus, 0x40, 0x00)
    assert error.value.errno == errno.EREMOTEIO
    bus.begin_frame()
    faulty.once(no_acknowledge, 2)
    assert read_register(bus, 0x40, 0x00) == b'\x11'


def test_a_held_bus_is_tried_once_a_frame(faulty):
    bus = FrameBudget(faulty)
    tried = []

    def held(transport, messages):
        tried.append(messages)
        return bus_held(transport, messages)
    faulty.always(held)
    for _ in range(5):
        with pytest.raises(OSError, match='held') as error:
            read_register(bus, 0x40, 0x00)
        assert error.value.errno == errno.ETIMEDOUT
    assert len(tried) == 1
    bus.begin_frame()
    with pytest.raises(OSError, match='held'):
        read_register(bus, 0x40, 0x00)
    assert len(tried) == 2


def test_faults_can_be_aimed_at_one_chip():
    faulty = FaultyTransport(EmulatedRobot().wire, address=0x6A)
    faulty.always(no_acknowledge)
    assert read_register(faulty, 0x40, 0x00) == b'\x11'
    with pytest.raises(OSError, match='injected'):
        read_register(faulty, 0x6A, 0x0F)
    faulty.always(None)
    faulty.once(flipped_bit(0))
    assert read_register(faulty, 0x6A, 0x0F) == b'\x6d'


@pytest.mark.parametrize('name', ['i2c-1', '', 'emulate', 'mock:1'])
def test_a_name_of_no_transport_is_refused(name):
    with pytest.raises(ValueError, match='transport: expected a device such as /dev/i2c-1'):
        open_transport(name)


def test_no_emulator_at_a_socket_says_how_to_start_one(tmp_path):
    with pytest.raises(OSError, match='start `emulator'):
        open_transport(f'emulated:{tmp_path}/none')


def test_a_device_that_is_not_there_is_the_kernels_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        open_transport(f'{tmp_path}/i2c-9')


def test_nothing_emulated_is_imported_unless_asked_for():
    # The node itself where there is ROS.
    node = ', w2b_hw.hardware_node' if importlib.util.find_spec('rclpy') else ''
    code = (f'import sys, w2b_hw.relax, w2b_hw.calibrate, w2b_hw.preflight, w2b_hw.guard{node}; '
            'bad = [m for m in sys.modules if m.startswith(("w2b_hw.emulation", "w2b_sim", '
            '"pybullet", "numba"))]; sys.exit(str(bad) if bad else 0)')
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
