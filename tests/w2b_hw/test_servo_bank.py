"""The servo bank on the emulated chip: what the pins do."""

import pytest

from w2b_hw.emulation.faults import FaultyTransport, cut_after, is_burst
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.servo_bank import ChipStateError, ServoBank
from w2b_hw.transport import write_register

OLD, NEW = 1000.0, 2000.0


@pytest.fixture
def robot():
    return EmulatedRobot()


@pytest.fixture
def bank(robot):
    bank = ServoBank(robot.wire, range(12))
    bank.connect()
    return bank


def test_connect_sets_50_hz_with_all_channels_off(robot, bank):
    assert robot.pca9685.register(0xFE) == 121
    assert not any(robot.pca9685.pulses_us())
    bank.check()


def test_connect_to_a_live_chip_turns_it_off_before_anything_else(robot, bank):
    bank.write(dict.fromkeys(range(12), NEW))
    again = ServoBank(robot.wire, range(12))
    transfers = robot.wire.transfers
    states = len(robot.pca9685.history)
    again.connect()
    # One state change: off. Never back to the old pulses, though Adafruit's driver would.
    assert [any(state.pulses_us) for state in list(robot.pca9685.history)[states:]] == [False]
    assert robot.wire.transfers > transfers


@pytest.mark.parametrize(('oscillator_hz', 'prescale'), [(25e6, 121), (24e6, 116), (27e6, 131)])
def test_a_measured_oscillator_makes_true_pulses(oscillator_hz, prescale):
    robot = EmulatedRobot(oscillator_hz=oscillator_hz)
    bank = ServoBank(robot.wire, range(12), oscillator_hz=oscillator_hz)
    bank.connect()
    bank.write({0: 1500.0})
    assert robot.pca9685.register(0xFE) == prescale
    assert robot.pca9685.pulses_us()[0] == pytest.approx(1500, abs=bank.tick_us / 2 + 0.01)


@pytest.mark.parametrize(('oscillator_hz', 'pulse_us'), [(24e6, 1561), (27e6, 1387)])
def test_an_oscillator_that_was_not_measured_makes_wrong_pulses(oscillator_hz, pulse_us):
    robot = EmulatedRobot(oscillator_hz=oscillator_hz)
    bank = ServoBank(robot.wire, range(12))
    bank.connect()
    bank.write({0: 1500.0})
    assert robot.pca9685.pulses_us()[0] == pytest.approx(pulse_us, abs=1)


def test_write_returns_what_the_pins_do(robot, bank):
    sent = bank.write({0: 1500.0, 5: 1234.5, 7: None})
    pins = robot.pca9685.pulses_us()
    assert sent == {0: pytest.approx(pins[0]), 5: pytest.approx(pins[5]), 7: 0.0}
    assert sent[5] == pytest.approx(1234.5, abs=2.44)
    assert [channel for channel, pulse in enumerate(pins) if pulse] == [0, 5]


def test_a_pose_of_twelve_is_one_burst_of_452_bits(robot, bank):
    bits, transfers = robot.wire.bits, robot.wire.transfers
    bank.write(dict.fromkeys(range(12), 1500.0))
    assert (robot.wire.bits - bits, robot.wire.transfers - transfers) == (452, 1)


@pytest.mark.parametrize('pulse_us', [0.0, -5.0, 20_000.0])
def test_a_pulse_that_is_none_is_refused_and_nothing_is_sent(robot, bank, pulse_us):
    transfers = robot.wire.transfers
    with pytest.raises(ValueError, match='expected a pulse'):
        bank.write({0: pulse_us})
    assert robot.wire.transfers == transfers


@pytest.mark.parametrize('sent', range(50))
def test_a_burst_cut_anywhere_leaves_each_channel_old_or_new(robot, sent):
    faulty = FaultyTransport(robot.wire)
    bank = ServoBank(faulty, range(12))
    bank.connect()
    bank.write(dict.fromkeys(range(12), OLD))
    faulty.once(cut_after(sent), when=is_burst)
    with pytest.raises(OSError, match='injected'):
        bank.write(dict.fromkeys(range(12), NEW))
    pins = robot.pca9685.pulses_us()[:12]
    new = (sent - 1) // 4 if sent else 0
    assert all(pulse == pytest.approx(NEW, abs=3) for pulse in pins[:new])
    assert all(pulse == pytest.approx(OLD, abs=3) for pulse in pins[new:])


@pytest.mark.parametrize(('register', 'value'), [(0x00, 0x00), (0x00, 0x30), (0x00, 0x21),
                                                 (0x01, 0x04), (0x01, 0x1C), (0xFE, 30)])
def test_a_changed_register_is_noticed(robot, bank, register, value):
    robot.pca9685.corrupt(register, value)
    with pytest.raises(ChipStateError, match='not as it was set up'):
        bank.check()


def test_a_brown_out_is_named(robot, bank):
    robot.pca9685.power_on()
    with pytest.raises(ChipStateError, match='lost power'):
        bank.check()


@pytest.mark.parametrize('mode1', [0x00, 0x20, 0x30, 0x11])
def test_relax_works_in_any_mode_of_the_chip(robot, bank, mode1):
    bank.write(dict.fromkeys(range(12), NEW))
    write_register(robot.wire, 0x40, 0x00, mode1)
    bank.relax()
    write_register(robot.wire, 0x40, 0x00, 0x20)
    write_register(robot.wire, 0x40, 0x00, 0xA0)
    assert not any(robot.pca9685.pulses_us())
