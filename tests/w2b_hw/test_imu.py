"""The IMU drivers, their registry and orientation, on emulated chips."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from w2b_hw.emulation.faults import FaultyTransport, flipped_bit, is_read_of
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.imu.orientation import (
    HEADING_VARIANCE,
    NO_HEADING_VARIANCE,
    TILT_VARIANCE,
    Orientation,
)
from w2b_hw.imu.part import FROZEN_AFTER, ImuError, Sample, mean_rate_rad_s

KINDS = ['lsm6dsox', 'icm20948']
FIFO = 0x78
GYROSCOPE_AT_REST, ACCELEROMETER_AT_REST = b'\x08' + bytes(6), b'\x10' + bytes(6)


class Bench:
    def __init__(self, kind, name=registry.AUTO):
        self.now_s = 1.0
        self.robot = EmulatedRobot(kind, clock=lambda: self.now_s)
        self.faulty = FaultyTransport(self.robot.wire)
        self.part = registry.find(self.faulty, name)

    def read(self):
        self.now_s += 0.05
        return self.part.read()


@pytest.fixture(params=KINDS)
def bench(request):
    return Bench(request.param)


def test_a_sample_is_what_the_motion_is(bench):
    bench.read()
    motion = bench.robot.motion
    motion.acceleration_m_s2 = (1.5, -3.0, 9.0)
    motion.angular_velocity_rad_s = (0.5, -1.0, 3.0)
    motion.field_t = (20e-6, -30e-6, 40e-6)
    sample = bench.read()
    assert sample.acceleration_m_s2 == pytest.approx(motion.acceleration_m_s2, abs=0.005)
    assert sample.angular_velocity_rad_s == pytest.approx(motion.angular_velocity_rad_s, abs=2e-3)
    assert sample.field_t == pytest.approx(motion.field_t, abs=0.5e-6)


@pytest.mark.parametrize('kind', KINDS)
def test_each_part_is_found_by_its_identity_and_by_name(kind):
    assert Bench(kind).part.name == kind
    assert Bench(kind, name=kind).part.name == kind


def test_none_is_none_and_an_unknown_choice_is_refused():
    wire = EmulatedRobot('none').wire
    assert registry.find(wire, 'none') is None
    with pytest.raises(ValueError, match='imu: expected one of auto, none'):
        registry.find(wire, 'mpu6050')


def test_an_absent_imu_is_an_error_that_names_every_address():
    with pytest.raises(ImuError, match=r'0x6a: no answer .error 121.*0x69.*imu:=none'):
        registry.find(EmulatedRobot('none').wire)


def test_an_unknown_part_is_an_error_that_names_what_answered():
    robot = EmulatedRobot('lsm6dsox')
    robot.imu_chips[0].registers[0x0F] = 0x6B  # an LSM6DSR
    with pytest.raises(ImuError, match='0x6a: 0x6b in register 0x0f, not the 0x6c of lsm6dsox'):
        registry.find(robot.wire)


def test_a_part_without_a_magnetometer_gives_no_field():
    robot = EmulatedRobot('lsm6dsox', clock=lambda: 5.0)
    robot.wire.chips.remove(robot.imu_chips[1])
    assert registry.find(robot.wire).read().field_t is None


def test_a_frozen_part_is_an_error(bench):
    bench.read()
    bench.robot.imu_chips[0].frozen = True
    with pytest.raises(ImuError, match='no new sample'):
        bench.read()


def test_a_part_that_repeats_itself_is_an_error():
    bench = Bench('lsm6dsox')

    def same(transport, messages):
        words = transport.transfer(messages)[0]
        return [(GYROSCOPE_AT_REST + ACCELEROMETER_AT_REST) * (len(words) // 14)]
    bench.faulty.once(same, FROZEN_AFTER, when=is_read_of(FIFO))
    for _ in range(FROZEN_AFTER - 1):
        bench.read()
    with pytest.raises(ImuError, match='frozen: 3 samples with the same bits'):
        bench.read()


def test_a_sample_is_the_mean_over_the_frame():
    """At 20 Hz, one sample a frame sees every swing at the same point: a turn that is none."""
    bench = Bench('lsm6dsox')
    chip, motion = bench.robot.imu_chips[0], bench.robot.motion
    bench.read()
    rates, forces = [], []
    began_s, now_s = bench.now_s, bench.now_s
    while now_s < began_s + 1.0:
        now_s += 1e-3
        swing = 2.0 * math.cos(2 * math.pi * 20 * (now_s - began_s))
        motion.angular_velocity_rad_s = (0.0, 0.0, 0.3 + swing)
        motion.acceleration_m_s2 = (swing, 0.0, 9.8)
        bench.now_s = now_s
        chip.take_samples()
        if round((now_s - began_s) / 1e-3) % 50 == 0:
            sample = bench.part.read()
            rates.append(sample.angular_velocity_rad_s[2])
            forces.append(sample.acceleration_m_s2[0])
    assert len(rates) == 20
    # Five or six samples of 104 Hz do not fill a swing of 50 ms evenly, but on average.
    assert np.mean(rates) == pytest.approx(0.3, abs=0.05)
    assert np.mean(forces) == pytest.approx(0.0, abs=0.05)


def test_turns_about_different_axes_do_not_just_add_up():
    rates = np.array([[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [-3.0, 0.0, 0.0], [0.0, -3.0, 0.0],
                      [0.0, 0.0, 1.0]])
    turn = Rotation.identity()
    for rate in rates:
        turn = turn * Rotation.from_rotvec(rate * 0.01)
    exact = turn.as_rotvec() / 0.05
    mean = mean_rate_rad_s(rates, 0.01)
    np.testing.assert_allclose(mean, exact, atol=3e-3)
    assert np.abs(rates.mean(axis=0) - exact).max() > 0.015


def test_what_was_not_read_for_long_is_thrown_away():
    bench = Bench('lsm6dsox')
    chip, motion = bench.robot.imu_chips[0], bench.robot.motion
    bench.read()
    motion.angular_velocity_rad_s = (0.0, 0.0, 2.0)
    bench.now_s += 3.0
    chip.take_samples()
    motion.angular_velocity_rad_s = (0.0, 0.0, 0.0)
    assert bench.read().angular_velocity_rad_s[2] == pytest.approx(0.0, abs=2e-3)
    assert bench.read().angular_velocity_rad_s[2] == pytest.approx(0.0, abs=2e-3)


def test_words_of_one_sensor_only_are_an_error():
    bench = Bench('lsm6dsox')

    def no_accelerometer(transport, messages):
        return [GYROSCOPE_AT_REST * (len(transport.transfer(messages)[0]) // 7)]
    bench.faulty.once(no_accelerometer, when=is_read_of(FIFO))
    with pytest.raises(ImuError, match='expected words of both sensors in its FIFO, got the tags'):
        bench.read()
    assert bench.read().acceleration_m_s2[2] == pytest.approx(9.81, abs=0.02)


@pytest.mark.parametrize('bit', [*range(32), *range(72, 96)])
def test_every_flipped_bit_of_the_lsm6dsox_setup_is_noticed(bit):
    """Of the FIFO's and the sensors' control registers; an unused one does no harm either way."""
    bench = Bench('lsm6dsox')
    bench.robot.imu_chips[0].registers[0x07 + bit // 8] ^= 1 << bit % 8
    with pytest.raises(ImuError, match='lost its setup'):
        bench.read()
    bench.part.configure()
    assert bench.read().acceleration_m_s2[2] == pytest.approx(9.81, abs=0.02)


@pytest.mark.parametrize(('bank', 'register'), [(0, 0x06), (2, 0x01), (2, 0x14)])
def test_a_changed_setup_of_the_icm20948_is_noticed_within_a_second(bank, register):
    bench = Bench('icm20948')
    bench.read()
    bench.robot.imu_chips[0].banks[bank][register] ^= 0x02

    def read_for_a_second():
        for _ in range(20):
            bench.read()
    with pytest.raises(ImuError, match='lost its setup'):
        read_for_a_second()


def yaw_pitch_roll(quaternion):
    x, y, z, w = quaternion
    return (math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
            math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)))


def settled(use_magnetometer=False, force=(0.0, 0.0, 9.80665), seconds=6.0,
            field=(0.0, 22e-6, -43e-6)):
    orientation = Orientation(20.0, 500.0, use_magnetometer)
    sample = Sample(force, (0.0, 0.0, 0.0), field)
    for _ in range(int(seconds / 0.05)):
        quaternion = orientation.update(sample, 0.05)
    return orientation, quaternion


def test_at_rest_it_is_level():
    assert yaw_pitch_roll(settled()[1])[1:] == pytest.approx((0, 0), abs=1e-3)


@pytest.mark.parametrize('tilt_deg', [-40, -10, 25])
def test_gravity_gives_roll_and_pitch(tilt_deg):
    tilt = math.radians(tilt_deg)
    rolled = settled(force=(0.0, 9.80665 * math.sin(tilt), 9.80665 * math.cos(tilt)))[1]
    assert yaw_pitch_roll(rolled)[2] == pytest.approx(tilt, abs=0.01)
    pitched = settled(force=(-9.80665 * math.sin(tilt), 0.0, 9.80665 * math.cos(tilt)))[1]
    assert yaw_pitch_roll(pitched)[1] == pytest.approx(tilt, abs=0.01)


def test_the_gyroscope_turns_it_about_the_vertical():
    orientation, _ = settled()
    for _ in range(20):
        quaternion = orientation.update(
            Sample((0.0, 0.0, 9.80665), (0.0, 0.0, math.radians(90)), None), 0.05)
    assert yaw_pitch_roll(quaternion)[0] == pytest.approx(math.radians(90), abs=0.02)


def test_the_magnetometer_gives_heading_from_east():
    """Field along y: the robot's y axis points north, so it faces east, yaw 0 (REP-103)."""
    assert yaw_pitch_roll(settled(use_magnetometer=True)[1])[0] == pytest.approx(0, abs=0.02)
    assert settled(use_magnetometer=True)[0].yaw_variance < settled()[0].yaw_variance


@pytest.mark.parametrize('bit', range(2 * 7 * 8))
def test_a_flipped_bit_in_one_frame_turns_the_orientation_by_less_than_two_degrees(bit):
    """A gyroscope word's top bit is 573 degrees/s for one sample: that much is not hidden."""
    bench = Bench('lsm6dsox')
    orientation = Orientation(20.0, bench.part.gyroscope_range_dps)
    for _ in range(120):
        before = orientation.update(bench.read(), 0.05)
    bench.faulty.once(flipped_bit(bit), when=is_read_of(FIFO))
    after = orientation.update(bench.read(), 0.05)
    turned = 2 * math.degrees(math.acos(min(1.0, abs(float(np.dot(before, after))))))
    word = bit - 8
    step = 17.5e-3 * 2 ** (word % 16) * 0.05 / 5 if 0 <= word < 48 else 0.0
    assert turned < max(2.0, 1.05 * step + 0.5)


LEVEL = Sample((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), (0.0, 22e-6, -43e-6))
TILTED = Sample((0.0, 9.80665 * math.sin(0.5), 9.80665 * math.cos(0.5)), (0.0, 0.0, 0.0), None)


def first(orientation, sample, elapsed_s, at_most_s=10.0):
    """Return the first orientation that is given, and after how long."""
    quaternion, waited_s = orientation.update(sample, elapsed_s), 0.0
    while quaternion is None:
        assert waited_s < at_most_s
        quaternion, waited_s = orientation.update(sample, 0.05), waited_s + 0.05
    return quaternion, waited_s


@pytest.mark.parametrize('gap_s', [0.2, 0.3, 1.0, 10.0, 3600.0, -1.0, 0.0])
def test_after_a_gap_no_orientation_is_given_until_it_is_right(gap_s):
    """The robot was turned meanwhile; a filter that goes on is off by 22 degrees, then by 116."""
    orientation, _ = settled()
    quaternion, waited_s = first(orientation, TILTED, gap_s)
    assert yaw_pitch_roll(quaternion)[1:] == pytest.approx((0.0, 0.5), abs=math.radians(2))
    assert 2.0 < waited_s < 5.0


def test_at_the_start_no_orientation_is_given_until_it_is_right():
    quaternion, waited_s = first(Orientation(20.0, 500.0), TILTED, 0.05)
    assert yaw_pitch_roll(quaternion)[2] == pytest.approx(0.5, abs=math.radians(2))
    assert 2.0 < waited_s < 5.0


def test_a_robot_that_is_shaken_does_not_settle():
    orientation = Orientation(20.0, 500.0)
    for number in range(400):
        force = (0.0, 8.0 if number % 2 else -8.0, 9.8)
        assert orientation.update(Sample(force, (0.0, 0.0, 0.0), None), 0.05) is None
    assert first(orientation, LEVEL, 0.05)[1] < 5.0


def test_two_lost_samples_are_borne():
    orientation, _ = settled()
    assert orientation.update(LEVEL, 0.15) is not None


def test_heading_is_unknown_without_a_magnetometer_and_without_a_fresh_field():
    assert settled(use_magnetometer=True)[0].yaw_variance == HEADING_VARIANCE
    assert settled(use_magnetometer=False)[0].yaw_variance == NO_HEADING_VARIANCE
    # A board that has none.
    assert settled(use_magnetometer=True, field=None)[0].yaw_variance == NO_HEADING_VARIANCE
    orientation, _ = settled(use_magnetometer=True)
    nothing = Sample(LEVEL.acceleration_m_s2, (0.0, 0.0, 0.0), None)
    for _ in range(19):
        orientation.update(nothing, 0.05)
    assert orientation.yaw_variance == HEADING_VARIANCE
    for _ in range(3):
        orientation.update(nothing, 0.05)
    assert orientation.yaw_variance == NO_HEADING_VARIANCE
    orientation.update(LEVEL, 0.05)
    assert orientation.yaw_variance == HEADING_VARIANCE


def test_a_field_that_disagrees_with_the_heading_gives_none():
    orientation, _ = settled(use_magnetometer=True)
    bent = Sample(LEVEL.acceleration_m_s2, (0.0, 0.0, 0.0), (22e-6, 0.0, -43e-6))
    for _ in range(30):
        orientation.update(bent, 0.05)
    assert orientation.yaw_variance == NO_HEADING_VARIANCE


def test_tilt_is_the_less_certain_the_longer_gravity_cannot_be_seen():
    orientation, _ = settled()
    assert orientation.tilt_variance == TILT_VARIANCE
    falling = Sample((0.0, 0.0, 0.1), (0.0, 0.0, 0.0), None)
    for _ in range(40):
        orientation.update(falling, 0.05)
    assert orientation.tilt_variance > 1.9 * TILT_VARIANCE
    orientation.update(LEVEL, 0.05)
    assert orientation.tilt_variance == TILT_VARIANCE
