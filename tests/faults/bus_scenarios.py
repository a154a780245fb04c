"""The wire and the servo chip fail: NACKs, a held bus, brown-outs, lost setup, a crash."""

from __future__ import annotations

from tests.faults.rig import FRAME_S
from tests.faults.scenarios import (
    Outcome,
    arms_again,
    fault_and_off,
    not_disturbed,
    scenario,
    stays_off,
    until,
    walking,
)
from w2b_hw.emulation.faults import bus_held, cut_after, is_burst, no_acknowledge
from w2b_hw.safety import State

# -- the bus

@scenario('one NACK', 'walks on, no frame lost', frames=0, ms=0)
def one_nack() -> Outcome:
    with walking() as rig:
        rig.wire.once(no_acknowledge)
        return not_disturbed(rig)


@scenario('NACK at any byte of the burst', 'repeated in the frame, never half a channel',
          frames=0, ms=0)
def nack_in_burst() -> Outcome:
    lost = 0
    with walking() as rig:
        for sent in range(50):
            rig.wire.once(cut_after(sent), when=is_burst)
            lost += not_disturbed(rig, FRAME_S).frames
    return Outcome(lost, 1e3 * FRAME_S * lost)


@scenario('persistent NACK', 'FAULT; off in the frame the bus comes back', frames=4, ms=200)
def persistent_nack() -> Outcome:
    with walking() as rig:
        pose = rig.pulses()
        rig.wire.always(no_acknowledge)
        to_fault = until(rig, lambda: rig.robot.safety.state is State.FAULT)
        # No command reaches the chip: it holds its last pose, and the report says so.
        assert rig.pulses() == pose
        assert 'CUT THEIR SUPPLY' in rig.report.reason
        for _ in range(10):
            rig.frame()
        rig.wire.always(None)
        back = until(rig, rig.off)
        stays_off(rig)
        arms_again(rig)
    return Outcome(to_fault.frames + back.frames, to_fault.ms + back.ms)


@scenario('SDA stuck', 'FAULT; one try a frame; off when released', frames=4, ms=200)
def sda_stuck() -> Outcome:
    with walking() as rig:
        tries = []

        def held(transport, messages):
            tries.append(rig.frames)
            return bus_held(transport, messages)
        rig.wire.always(held)
        to_fault = until(rig, lambda: rig.robot.safety.state is State.FAULT)
        for _ in range(10):
            rig.frame()
        # Each try blocks the I/O thread for the kernel's 10 ms: one a frame leaves it time.
        assert len(tries) == len(set(tries))
        rig.wire.always(None)
        back = until(rig, rig.off)
        stays_off(rig)
    return Outcome(to_fault.frames + back.frames, to_fault.ms + back.ms)


# -- the servo chip

@scenario('brown-out mid-run', 'off at once, FAULT next frame, re-armed servo by servo',
          frames=1, ms=50)
def brown_out() -> Outcome:
    with walking() as rig:
        rig.chips.pca9685.power_on()
        assert rig.off()
        seen = until(rig, fault_and_off(rig))
        assert 'lost power' in rig.report.reason
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('brown-out between health read and burst', 'no pulse, FAULT next frame',
          frames=1, ms=50)
def brown_out_mid_frame() -> Outcome:
    worst = Outcome(0, 0)
    for number in range(8):
        with walking() as rig:
            rig.wire.before_transfer(number, rig.chips.pca9685.power_on)
            rig.frame()
            seen = until(rig, fault_and_off(rig))
            stays_off(rig, 0.5)
            # The frame with the fault in it counts.
            seen = Outcome(seen.frames + 1, seen.ms + 1e3 * FRAME_S)
            worst = max(worst, seen, key=lambda outcome: outcome.frames)
    return worst


@scenario('auto-increment lost', 'off, FAULT', frames=1, ms=50)
def auto_increment_lost() -> Outcome:
    with walking() as rig:
        rig.chips.pca9685.corrupt(0x00, 0x00)
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('prescale changed', 'wrong until the next health read, then off, FAULT',
          frames=1, ms=50)
def prescale_changed() -> Outcome:
    with walking() as rig:
        rig.excused = True
        rig.chips.pca9685.corrupt(0xFE, 0x1E)
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('start on a live chip', 'off in the first two transfers', frames=0, ms=0)
def live_chip() -> Outcome:
    with walking() as rig:
        # The same chips, set up once more, as by the next process after a crash.
        rig.wire.before_transfer(2, lambda: _assert(rig.off()))
        rig.robot.connect()
        rig.judge(confirmed=True)
        assert rig.off()
    return Outcome(0, 0)


@scenario('crash mid-update', 'each transfer whole: no torn pose', frames=0, ms=0)
def crash_mid_update() -> Outcome:
    class CrashError(BaseException):
        """The process is gone."""

    def crash() -> None:
        raise CrashError
    for number in range(9):
        with walking() as rig:
            old = rig.pulses()
            rig.wire.before_transfer(number, crash)
            new: list[tuple[float, ...]] = []
            try:
                while True:
                    rig.frame()
                    new.append(rig.pulses())
                    if len(new) > 4:
                        break
            except CrashError:
                rig.judge(confirmed=False)
                changed = sum(a != b for a, b in zip(old, rig.pulses(), strict=True))
                assert new or changed in (0, *range(9, 13)), 'a pose of which half was sent'
    return Outcome(0, 0)


def _assert(condition: bool) -> None:
    assert condition
