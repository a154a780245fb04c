"""The emulated IMU chips against their data sheets, byte by byte, without any driver."""

import math
from itertools import pairwise

import pytest

from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.transport import Read, Write

GRAVITY = 9.80665


class Bench:
    def __init__(self, imu):
        self.now_s = 1.0
        self.robot = EmulatedRobot(imu, clock=lambda: self.now_s)

    def send(self, address, *data):
        self.robot.wire.transfer([Write(address, bytes(data))])

    def get(self, address, register, count=1):
        return self.robot.wire.transfer([Write(address, bytes([register])),
                                         Read(address, count)])[0]


@pytest.fixture
def st():
    return Bench('lsm6dsox')


@pytest.fixture
def tdk():
    return Bench('icm20948')


def words(data, order='little'):
    return [int.from_bytes(data[n:n + 2], order, signed=True) for n in range(0, len(data), 2)]


def test_lsm6dsox_identity_and_reset_values(st):
    assert st.get(0x6A, 0x0F) == b'\x6c'
    assert st.get(0x6A, 0x10, 3) == b'\x00\x00\x04'  # powered down; IF_INC
    st.send(0x6A, 0x0F, 0x00)
    assert st.get(0x6A, 0x0F) == b'\x6c'  # read-only


@pytest.mark.parametrize(('bits', 'mg'), [(0b00, 0.061), (0b01, 0.488), (0b10, 0.122),
                                          (0b11, 0.244)])
def test_lsm6dsox_acceleration_sensitivity_is_that_of_table_2(st, bits, mg):
    st.send(0x6A, 0x10, 0x40 | bits << 2)
    assert words(st.get(0x6A, 0x28, 6)) == pytest.approx([0, 0, 1000 / mg], abs=3)


@pytest.mark.parametrize(('control', 'mdps'), [(0x40, 8.75), (0x44, 17.5), (0x48, 35.0),
                                               (0x4C, 70.0), (0x42, 4.375)])
def test_lsm6dsox_rate_sensitivity_is_that_of_table_2(st, control, mdps):
    st.robot.motion.angular_velocity_rad_s = (0.0, math.radians(100), 0.0)
    st.send(0x6A, 0x11, control)
    assert words(st.get(0x6A, 0x22, 6)) == pytest.approx([0, 100e3 / mdps, 0], abs=3)


def test_lsm6dsox_data_ready_comes_with_the_rate_and_goes_with_the_reading(st):
    st.send(0x6A, 0x10, 0x40)  # 104 Hz
    assert st.get(0x6A, 0x1E) == b'\x01'
    st.get(0x6A, 0x28, 6)
    assert st.get(0x6A, 0x1E) == b'\x00'
    st.now_s += 1 / 104 + 1e-6
    assert st.get(0x6A, 0x1E) == b'\x01'


def test_lsm6dsox_without_if_inc_repeats_a_register(st):
    st.send(0x6A, 0x12, 0x00)
    assert st.get(0x6A, 0x0F, 3) == b'\x6c\x6c\x6c'


def test_lsm6dsox_software_reset_clears_itself(st):
    st.send(0x6A, 0x10, 0x48)
    st.send(0x6A, 0x12, 0x01)
    assert st.get(0x6A, 0x10, 3) == b'\x00\x00\x04'


def test_lsm6dsox_saturates_at_its_full_scale(st):
    st.robot.motion.acceleration_m_s2 = (9 * GRAVITY, -9 * GRAVITY, 0.0)
    st.send(0x6A, 0x10, 0x48)  # 4 g
    assert words(st.get(0x6A, 0x28, 6))[:2] == [32767, -32768]


def fifo(bench):
    low, high = bench.get(0x6A, 0x3A, 2)
    count = low | (high & 3) << 8
    data = bench.get(0x6A, 0x78, 7 * count) if count else b''
    return [(data[n] >> 3, words(data[n + 1:n + 7])) for n in range(0, len(data), 7)]


def both_into_the_fifo(bench):
    for register, value in ((0x10, 0x48), (0x11, 0x44), (0x12, 0x44), (0x09, 0x44), (0x0A, 0x06)):
        bench.send(0x6A, register, value)


def test_lsm6dsox_fifo_keeps_every_sample_of_both_sensors(st):
    both_into_the_fifo(st)
    fifo(st)
    assert fifo(st) == []
    st.robot.motion.angular_velocity_rad_s = (0.0, math.radians(100), 0.0)
    st.now_s += 10 / 104 + 1e-6
    got = fifo(st)
    assert [tag for tag, _ in got] == [1, 2] * 10
    for tag, values in got:
        assert values == pytest.approx([0, 100e3 / 17.5, 0] if tag == 1
                                       else [0, 0, 1000 / 0.122], abs=3)
    # No two are the same: each has its own noise.
    assert len({tuple(values) for _tag, values in got}) > 10


def test_lsm6dsox_fifo_holds_the_newest_512_words_and_bypass_empties_it(st):
    both_into_the_fifo(st)
    st.now_s += 60.0
    assert len(fifo(st)) == 512
    st.now_s += 1.0
    st.send(0x6A, 0x0A, 0x00)
    assert fifo(st) == []
    st.now_s += 1.0
    assert fifo(st) == []


def test_lsm6dsox_fifo_keeps_only_what_is_batched_and_its_status_is_read_only(st):
    both_into_the_fifo(st)
    st.send(0x6A, 0x09, 0x40)
    fifo(st)
    st.now_s += 5 / 104 + 1e-6
    st.send(0x6A, 0x3A, 0x7F)
    assert [tag for tag, _ in fifo(st)] == [1] * 5


def test_lsm6dsox_tags_have_even_parity_and_count_the_samples(st):
    both_into_the_fifo(st)
    st.now_s += 8 / 104
    st.get(0x6A, 0x3A, 2)
    tags = st.get(0x6A, 0x78, 7 * 8)[::7]
    assert all(tag.bit_count() % 2 == 0 for tag in tags)
    counts = [tag >> 1 & 3 for tag in tags]
    assert counts[::2] == counts[1::2]
    assert [(b - a) % 4 for a, b in pairwise(counts[::2])] == [1] * 3


def test_lis3mdl_identity_and_reset_values(st):
    assert st.get(0x1C, 0x0F) == b'\x3d'
    assert st.get(0x1C, 0xA0, 5) == b'\x10\x00\x03\x00\x00'  # power-down


@pytest.mark.parametrize(('bits', 'per_gauss'), [(0, 6842), (1, 3421), (2, 2281), (3, 1711)])
def test_lis3mdl_sensitivity_is_that_of_table_3(st, bits, per_gauss):
    st.robot.motion.field_t = (1e-4, -1e-4, 0.0)  # a gauss
    st.send(0x1C, 0x21, bits << 5)
    st.send(0x1C, 0x22, 0x00)
    st.now_s += 2
    assert words(st.get(0x1C, 0xA8, 6)) == pytest.approx([per_gauss, -per_gauss, 0], abs=3)


def test_lis3mdl_increments_only_with_bit_7_and_goes_round_its_outputs(st):
    st.send(0x1C, 0x22, 0x00)
    st.now_s += 2
    block = st.get(0x1C, 0xA8, 8)
    assert block[6:] == block[:2]
    assert len(set(st.get(0x1C, 0x28, 6))) == 1


def test_icm20948_identity_banks_and_reset_values(tdk):
    assert tdk.get(0x68, 0x00) == b'\xea'
    assert tdk.get(0x68, 0x06) == b'\x41'  # asleep, best clock
    tdk.send(0x68, 0x7F, 0x20)
    assert tdk.get(0x68, 0x01) == b'\x01'
    assert tdk.get(0x68, 0x14) == b'\x01'
    assert tdk.get(0x68, 0x7F) == b'\x20'


@pytest.mark.parametrize(('bits', 'per_g', 'per_dps'), [
    (0, 16384, 131), (1, 8192, 65.5), (2, 4096, 32.8), (3, 2048, 16.4)])
def test_icm20948_sensitivities_are_those_of_tables_1_and_2(tdk, bits, per_g, per_dps):
    tdk.robot.motion.angular_velocity_rad_s = (math.radians(-100), 0.0, 0.0)
    tdk.send(0x68, 0x06, 0x01)
    tdk.send(0x68, 0x7F, 0x20)
    tdk.send(0x68, 0x01, bits << 1)
    tdk.send(0x68, 0x14, bits << 1)
    tdk.send(0x68, 0x7F, 0x00)
    assert tdk.get(0x68, 0x1A) == b'\x01'
    assert tdk.get(0x68, 0x1A) == b'\x00'  # cleared by reading
    expected = [0, 0, per_g, -100 * per_dps, 0, 0]
    assert words(tdk.get(0x68, 0x2D, 12), 'big') == pytest.approx(expected, abs=3)


def test_icm20948_gives_nothing_asleep(tdk):
    assert tdk.get(0x68, 0x1A) == b'\x00'
    assert tdk.get(0x68, 0x2D, 12) == bytes(12)


def test_ak09916_is_on_the_bus_only_through_the_bypass(tdk):
    with pytest.raises(OSError, match='0x0c'):
        tdk.get(0x0C, 0x00)
    tdk.send(0x68, 0x0F, 0x02)
    assert tdk.get(0x0C, 0x00, 2) == b'\x48\x09'


def test_ak09916_sensitivity_axes_and_data_ready(tdk):
    tdk.robot.motion.field_t = (15e-6, 30e-6, -45e-6)
    tdk.send(0x68, 0x0F, 0x02)
    tdk.send(0x0C, 0x31, 0x08)
    status, *raw = tdk.get(0x0C, 0x10, 9)
    assert status == 0x01
    # 0.15 uT for each LSB; y and z point the other way.
    assert words(bytes(raw[:6])) == pytest.approx([100, -200, 300], abs=2)
    assert tdk.get(0x0C, 0x10) == b'\x00'  # ST2 was read
