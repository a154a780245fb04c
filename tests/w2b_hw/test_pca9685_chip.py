"""
The emulated PCA9685 against its data sheet (NXP PCA9685 Rev. 4), byte by byte.

Nothing of the drivers is used here, so that driver and emulator cannot share a mistake.
"""

import pytest

from w2b_hw.emulation.pca9685 import Pca9685
from w2b_hw.emulation.wire import Wire
from w2b_hw.transport import Read, Write

ADDRESS = 0x40


class Bench:
    """A chip on a wire, and short words for what goes over it."""

    def __init__(self):
        self.chip = Pca9685(ADDRESS)
        self.wire = Wire([self.chip])

    def send(self, *data, to=ADDRESS):
        self.wire.transfer([Write(to, bytes(data))])

    def get(self, register, count=1):
        return list(self.wire.transfer([Write(ADDRESS, bytes([register])),
                                        Read(ADDRESS, count)])[0])

    def awake_at_50_hz(self, mode2=0x04):
        self.send(0xFE, 121)
        self.send(0x00, 0x20)
        self.send(0x01, mode2)


@pytest.fixture
def bench():
    return Bench()


def test_power_on_state_is_that_of_tables_4_to_10(bench):
    assert bench.get(0x00) == [0x11]  # asleep, all-call on
    assert bench.get(0x01) == [0x04]  # totem pole
    assert [bench.get(r)[0] for r in range(2, 6)] == [0xE2, 0xE4, 0xE8, 0xE0]
    assert bench.get(0xFE) == [0x1E]  # 200 Hz
    for channel in range(16):
        assert [bench.get(6 + 4 * channel + n)[0] for n in range(4)] == [0, 0, 0, 0x10]
    assert bench.chip.pulses_us() == (0.0,) * 16


def test_prescale_121_gives_50_03_hz_and_ticks_of_4_88_us(bench):
    bench.awake_at_50_hz()
    assert bench.chip.tick_us == pytest.approx(4.88)
    assert 1e6 / (4096 * bench.chip.tick_us) == pytest.approx(50.03, abs=0.01)


def test_prescale_is_written_only_in_sleep_and_is_at_least_3(bench):
    bench.send(0xFE, 1)
    assert bench.get(0xFE) == [3]
    bench.send(0x00, 0x01)
    bench.send(0xFE, 121)
    assert bench.get(0xFE) == [3]


def test_auto_increment_follows_the_register_table(bench):
    bench.send(0x00, 0x21)
    assert bench.get(0x44, 3) == [0x00, 0x10, 0x21]  # past 69 it goes on at MODE1
    assert bench.get(0xFD, 3) == [0x00, 0x1E, 0x21]  # from 250 to 254, then 0
    bench.send(0x00, 0x01)
    assert bench.get(0x00, 3) == [0x01, 0x01, 0x01]


def test_without_auto_increment_a_burst_corrupts_led0_on_l_only(bench):
    bench.send(0x06, *range(1, 49))
    assert bench.get(0x06) == [48]
    assert [bench.get(r)[0] for r in range(7, 10)] == [0, 0, 0x10]


def test_pulse_is_off_minus_on_in_ticks(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0x99, 0x01, 0xCC, 0x04)  # example 1 of section 7.3.3: 10% delay, 20% duty
    assert bench.chip.pulses_us()[0] == pytest.approx((1228 - 409) * 4.88)


@pytest.mark.parametrize(('registers', 'counts'), [
    ((0, 0x10, 0, 0), 4096), ((0, 0, 0, 0x10), 0), ((0, 0x10, 0, 0x10), 0)])
def test_full_on_full_off_and_off_takes_precedence(bench, registers, counts):
    bench.awake_at_50_hz()
    bench.send(0x06, *registers)
    assert bench.chip.pulses_us()[0] == pytest.approx(counts * 4.88)


def test_all_led_registers_reach_every_channel_and_read_zero(bench):
    bench.awake_at_50_hz()
    bench.send(0xFA, 0, 0, 0x33, 0x01)
    assert bench.chip.pulses_us() == pytest.approx([0x133 * 4.88] * 16)
    assert bench.get(0xFA, 4) == [0, 0, 0, 0]
    bench.send(0xFD, 0x10)
    assert bench.chip.pulses_us() == (0.0,) * 16


def test_outputs_change_on_stop(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0, 0, 0xFF)  # three of the four registers, then a stop
    assert bench.get(0x08) == [0xFF]
    bench.send(0x09, 0x01)
    assert bench.chip.pulses_us()[0] == pytest.approx(0x1FF * 4.88)


def test_outputs_on_ack_change_when_all_four_registers_came(bench):
    bench.awake_at_50_hz(mode2=0x0C)
    bench.send(0x06, 0, 0, 0xFF, 0x01)
    bench.send(0x06, 0, 0, 0x00)
    assert bench.chip.pulses_us()[0] == pytest.approx(0x1FF * 4.88)
    bench.send(0x06, 0, 0, 0x00, 0x02, 0, 0, 0x55)
    assert bench.chip.pulses_us()[:2] == pytest.approx([0x200 * 4.88, 0])


def test_sleep_stops_the_outputs_and_restart_brings_them_back(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0, 0, 0x33, 0x01)
    bench.send(0x00, 0x30)
    assert bench.get(0x00) == [0xB0]  # RESTART reads 1
    assert bench.chip.pulses_us()[0] == 0
    bench.send(0x00, 0x20)
    assert bench.chip.pulses_us()[0] == 0  # awake, not restarted
    bench.send(0x00, 0xA0)
    assert bench.get(0x00) == [0x20]
    assert bench.chip.pulses_us()[0] == pytest.approx(0x133 * 4.88)


def test_orderly_shutdown_leaves_nothing_to_restart(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0, 0, 0x33, 0x01)
    bench.send(0xFD, 0x10)
    bench.send(0x00, 0x30)
    assert bench.get(0x00) == [0x30]


def test_a_write_to_a_pwm_register_clears_restart(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0, 0, 0x33, 0x01)
    bench.send(0x00, 0x30)
    bench.send(0x00, 0x20)
    bench.send(0x0A, 0, 0, 0x44, 0x01)
    assert bench.get(0x00) == [0x20]
    assert bench.chip.pulses_us()[:2] == pytest.approx([0x133 * 4.88, 0x144 * 4.88])


def test_software_reset_is_general_call_06(bench):
    bench.awake_at_50_hz()
    bench.send(0x06, 0, 0, 0x33, 0x01)
    with pytest.raises(OSError, match='acknowledge') as error:
        bench.send(0x05, to=0x00)
    assert error.value.errno == 121
    assert bench.chip.pulses_us()[0] > 0
    bench.send(0x06, to=0x00)
    assert bench.get(0x00) == [0x11]
    assert bench.get(0xFE) == [0x1E]
    assert bench.chip.pulses_us() == (0.0,) * 16


def test_all_call_address_is_on_after_power_on_and_can_be_turned_off(bench):
    bench.send(0x01, 0x0C, to=0x70)
    assert bench.get(0x01) == [0x0C]
    bench.send(0x00, 0x20)
    with pytest.raises(OSError, match='0x70'):
        bench.send(0x01, 0x04, to=0x70)


def test_reserved_registers_are_not_acknowledged(bench):
    with pytest.raises(OSError, match='acknowledge') as error:
        bench.send(0x46, 0x00)
    assert error.value.errno == 121


def test_a_wrong_address_is_not_acknowledged(bench):
    with pytest.raises(OSError, match='0x41') as error:
        bench.send(0x00, to=0x41)
    assert error.value.errno == 121


def test_extclk_stays_until_a_reset(bench):
    bench.send(0x00, 0x50)
    bench.send(0x00, 0x20)
    assert bench.get(0x00)[0] & 0x40
    bench.send(0x06, to=0x00)
    assert not bench.get(0x00)[0] & 0x40


def test_the_wire_counts_bits_as_an_analyser_does(bench):
    before = bench.wire.bits
    bench.send(0x06, *bytes(48))
    assert bench.wire.bits - before == 1 + 9 + 9 + 48 * 9 + 1
    before = bench.wire.bits
    bench.get(0x00)
    assert bench.wire.bits - before == (1 + 9 + 9) + (1 + 9 + 9) + 1
