"""Drivers that others wrote, unmodified, on the emulated chips."""

import math
import sys
from pathlib import Path

import adafruit_lis3mdl
import pytest
import smbus2
from adafruit_lsm6ds import AccelRange, GyroRange
from adafruit_lsm6ds.lsm6dsox import LSM6DSOX
from adafruit_pca9685 import PCA9685

from w2b_hw.circuitpython_bus import CircuitPythonBus
from w2b_hw.emulation.lis3mdl import Lis3mdl
from w2b_hw.emulation.motion import Motion
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.emulation.wire import Wire

sys.path.insert(0, str(Path(__file__).parent))
from smbus_ioctl import IoctlDoor


@pytest.fixture
def robot():
    return EmulatedRobot()


@pytest.fixture
def bus(robot):
    return CircuitPythonBus(robot.wire)


@pytest.fixture
def smbus(robot, monkeypatch):
    """smbus2's own SMBus, whose ioctls end at the emulated chips."""
    monkeypatch.setattr(smbus2.smbus2, 'ioctl', IoctlDoor(robot.wire))
    with smbus2.SMBus('/dev/null') as bus:
        yield bus


def test_scan_finds_the_chips(bus):
    assert bus.scan() == [0x1C, 0x40, 0x6A]


def test_pca9685_driver_sets_frequency_and_duty_cycles(robot, bus):
    pca = PCA9685(bus)
    pca.frequency = 50
    assert robot.pca9685.register(0xFE) == 121
    assert robot.pca9685.register(0x00) == 0x20
    assert pca.frequency == pytest.approx(50.03, abs=0.01)
    pca.channels[3].duty_cycle = 0x1333
    assert pca.channels[3].duty_cycle == 0x1330
    assert robot.pca9685.pulses_us()[3] == pytest.approx(0x133 * 4.88)


def test_pca9685_deinit_leaves_the_servos_driven(robot, bus):
    with PCA9685(bus) as pca:
        pca.frequency = 50
        pca.channels[0].duty_cycle = 0x1333
    assert robot.pca9685.pulses_us()[0] > 0


def test_pca9685_constructor_and_frequency_wake_old_pulses(robot, bus):
    pca = PCA9685(bus)
    pca.frequency = 50
    pca.channels[0].duty_cycle = 0x1333
    pca.mode1_reg = 0x30
    assert robot.pca9685.pulses_us()[0] == 0
    PCA9685(bus).frequency = 50
    assert robot.pca9685.pulses_us()[0] == pytest.approx(0x133 * 4.88)


@pytest.fixture
def no_waiting(monkeypatch):
    monkeypatch.setattr('adafruit_lsm6ds.sleep', lambda seconds: None)
    monkeypatch.setattr('adafruit_lis3mdl.sleep', lambda seconds: None)


def test_lsm6dsox_driver_measures_what_the_motion_is(robot, bus, no_waiting):
    robot.motion.acceleration_m_s2 = (1.0, -2.0, 9.5)
    robot.motion.angular_velocity_rad_s = (0.5, -1.0, 2.0)
    driver = LSM6DSOX(bus)
    driver.accelerometer_range = AccelRange.RANGE_8G
    driver.gyro_range = GyroRange.RANGE_500_DPS
    assert driver.acceleration == pytest.approx((1.0, -2.0, 9.5), abs=0.01)
    assert driver.gyro == pytest.approx((0.5, -1.0, 2.0), abs=0.002)


def test_lsm6dsox_driver_refuses_another_chip(bus):
    with pytest.raises(RuntimeError, match='Failed to find LSM6DSOX'):
        LSM6DSOX(bus, address=0x1C)


def test_lis3mdl_driver_measures_what_the_field_is(no_waiting):
    motion = Motion(field_t=(20e-6, -10e-6, 40e-6))
    chip = Lis3mdl(motion, always_increments=True)
    driver = adafruit_lis3mdl.LIS3MDL(CircuitPythonBus(Wire([chip])))
    assert driver.magnetic == pytest.approx((20, -10, 40), abs=0.2)
    assert driver.data_rate == adafruit_lis3mdl.Rate.RATE_155_HZ


def test_lis3mdl_driver_reads_without_the_increment_bit_of_the_data_sheet(bus, no_waiting):
    """By the data sheet's letter it gets OUT_X_L six times; the part is kinder than its paper."""
    x, y, z = adafruit_lis3mdl.LIS3MDL(bus).magnetic
    assert x == y == z


def test_smbus2_byte_word_and_block_calls(robot, smbus):
    assert smbus.read_byte_data(0x6A, 0x0F) == 0x6C
    smbus.write_byte_data(0x6A, 0x10, 0x48)
    smbus.write_word_data(0x6A, 0x10, 0x4448)
    assert smbus.read_word_data(0x6A, 0x10) == 0x4448
    block = smbus.read_i2c_block_data(0x6A, 0x28, 6)
    assert int.from_bytes(bytes(block[4:]), 'little') == pytest.approx(1000 / 0.122, abs=3)


def test_smbus2_i2c_rdwr_drives_a_servo(robot, smbus):
    smbus.write_byte_data(0x40, 0xFE, 121)
    smbus.write_byte_data(0x40, 0x00, 0x20)
    smbus.write_i2c_block_data(0x40, 0x06, [0, 0, 0x33, 0x01])
    read = smbus2.i2c_msg.read(0x40, 4)
    smbus.i2c_rdwr(smbus2.i2c_msg.write(0x40, [0x06]), read)
    assert list(read) == [0, 0, 0x33, 0x01]
    assert robot.pca9685.pulses_us()[0] == pytest.approx(0x133 * 4.88)


def test_smbus2_raises_the_kernels_error(smbus):
    with pytest.raises(OSError, match='0x41') as error:
        smbus.read_byte_data(0x41, 0x00)
    assert error.value.errno == 121


def test_smbus2_reads_an_icm20948_as_its_users_do(monkeypatch):
    robot = EmulatedRobot('icm20948')
    monkeypatch.setattr(smbus2.smbus2, 'ioctl', IoctlDoor(robot.wire))
    robot.motion.angular_velocity_rad_s = (math.radians(10), 0.0, 0.0)
    with smbus2.SMBus('/dev/null') as bus:
        assert bus.read_byte_data(0x68, 0x00) == 0xEA
        bus.write_byte_data(0x68, 0x06, 0x01)
        bus.write_byte_data(0x68, 0x0F, 0x02)
        assert bus.read_i2c_block_data(0x0C, 0x00, 2) == [0x48, 0x09]
        assert bus.read_byte_data(0x68, 0x1A) == 0x01
        high, low = bus.read_i2c_block_data(0x68, 0x33, 2)
    assert high << 8 | low == pytest.approx(1310, abs=3)
