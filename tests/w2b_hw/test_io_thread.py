"""The I/O thread in real time, the guard beside it, and systemd's socket."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

from w2b_hw.calibration import nominal
from w2b_hw.emulation.client import SocketTransport
from w2b_hw.emulation.faults import FaultyTransport
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.emulation.server import ChipServer
from w2b_hw.guard import Guard
from w2b_hw.io_thread import IoThread
from w2b_hw.joints import JOINTS
from w2b_hw.power import Power
from w2b_hw.robot import Robot
from w2b_hw.safety import State
from w2b_hw.transport import FrameBudget, Write
from w2b_hw.watchdog import Systemd

PERIOD_S = 0.02
REST = (0.0,) * len(JOINTS)


def wait(condition, what, deadline_s=10.0):
    end_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end_s, f'no {what}'


class Bench:
    """A robot in its thread, with a brain that answers every frame."""

    def __init__(self):
        self.chips = EmulatedRobot()
        self.wire = FaultyTransport(self.chips.wire)
        self.robot = Robot(FrameBudget(self.wire), nominal(), Power())
        self.robot.connect()
        self.frames = []
        self.poses = []
        self.answering = True
        self.raising = None
        self.io = IoThread(self.robot, period_s=PERIOD_S, on_frame=self._on_frame,
                           on_pose=self.poses.append)
        self.io.start()

    def _on_frame(self, report):
        self.frames.append(report)
        if self.raising is not None:
            raise self.raising
        if self.answering:
            # As the executor does, from another thread.
            threading.Thread(target=self.io.target, args=(REST,)).start()

    def drive(self):
        def following():
            # On a busy machine arming may rightly be given up.
            if self.frames and self.frames[-1].state in (State.DISARMED, State.FAULT):
                self.io.ask(self.robot.arm)
            return self.frames and self.frames[-1].state is State.ACTIVE
        wait(following, 'following', 30.0)

    def off(self):
        return not any(self.chips.pca9685.pulses_us())


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    bench.io.stop()
    assert bench.off()


def test_stopping_turns_everything_off(bench):
    bench.drive()
    assert not bench.off()
    bench.io.stop()
    assert bench.off()
    assert bench.io.error is None


@pytest.mark.parametrize('error', [RuntimeError('broken'), SystemExit(1), MemoryError()],
                         ids=lambda error: type(error).__name__)
def test_an_exception_turns_everything_off_and_is_kept(bench, error):
    bench.drive()
    bench.raising = error
    wait(lambda: not bench.io.alive(), 'end')
    assert bench.off()
    assert bench.io.error is error


def test_a_target_is_sent_at_once_and_not_with_the_next_frame(bench):
    bench.drive()
    bench.answering = False
    seen = len(bench.frames)
    wait(lambda: len(bench.frames) > seen, 'frame')
    poses = len(bench.poses)
    bench.io.target(REST)
    wait(lambda: len(bench.poses) > poses, 'pose')
    # The I/O thread runs it between frames: the pose's time is not that of a frame.
    assert bench.poses[-1].time_s not in [report.time_s for report in bench.frames]


def test_command_loss_is_noticed_on_time_and_not_with_the_next_frame(bench):
    bench.drive()
    bench.answering = False
    wait(lambda: bench.frames[-1].state is State.DISARMED, 'end')
    reports = sorted([*bench.frames, *bench.poses], key=lambda report: report.time_s)
    last = max(r.time_s for r in bench.poses if r.state is State.ACTIVE)
    held = next(r.time_s for r in reports if r.state is State.HOLD)
    parked = next(r.time_s for r in reports if r.state in (State.PARK, State.DISARMED)
                  and r.time_s > held)
    # Never early; late by no more than a busy machine is.
    assert 0.149 <= held - last <= 0.25
    assert 0.499 <= parked - last <= 0.6


def test_a_thread_that_hangs_is_told_to_who_asks(bench):
    bench.drive()
    going_on = threading.Event()

    def hang(transport, messages):
        going_on.wait(5.0)
        return transport.transfer(messages)
    bench.wire.once(hang)
    wait(lambda: not bench.wire.planned, 'hang')
    assert 'does not answer' in bench.io.ask(bench.robot.stop)
    going_on.set()
    # The request was not lost.
    wait(lambda: bench.off() and bench.frames[-1].state is State.FAULT, 'stop')


@pytest.fixture
def chips(tmp_path):
    path = str(tmp_path / 'chips')
    server = subprocess.Popen([sys.executable, '-m', 'w2b_hw.emulation.server', path],
                              stdout=subprocess.PIPE)
    server.stdout.readline()
    client = SocketTransport(path)
    client.transfer([Write(0x40, bytes([0x00, 0x20]))])
    client.transfer([Write(0x40, bytes([0x06, 0, 0, 0x33, 1]))])
    client.name = f'emulated:{path}'
    yield client
    client.close()
    server.terminate()
    server.wait()
    server.stdout.close()


def lit(chips):
    return any(chips.outputs()[-1].pulses_us)


def test_the_guard_does_nothing_while_its_ward_lives(chips):
    guard = Guard(chips.name)
    end_s = time.monotonic() + 1.0
    while time.monotonic() < end_s:
        guard.sign_of_life(driven=True)
        assert lit(chips)
    guard.close()
    assert not lit(chips)
    assert not guard.alive()


def test_the_guard_turns_off_after_half_a_second_of_silence_and_goes_on_guarding(chips):
    guard = Guard(chips.name)
    guard.sign_of_life(driven=True)
    silent_s = time.monotonic()
    wait(lambda: not lit(chips), 'off')
    assert 0.4 < time.monotonic() - silent_s < 1.0
    assert guard.alive()
    chips.transfer([Write(0x40, bytes([0x06, 0, 0, 0x33, 1]))])
    guard.close()
    assert not lit(chips)


def test_silence_is_nothing_while_servos_are_off(chips):
    guard = Guard(chips.name)
    guard.sign_of_life(driven=False)
    end_s = time.monotonic() + 0.8
    while time.monotonic() < end_s:
        assert lit(chips)
    guard.close()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_the_guard_outlives_what_ends_its_ward(chips, number):
    guard = Guard(chips.name)
    os.kill(guard.pid, number)
    guard.sign_of_life(driven=True)
    wait(lambda: not lit(chips), 'off')
    assert guard.alive()
    guard.close()


def test_a_guard_that_cannot_start_is_an_error(monkeypatch):
    monkeypatch.setattr(sys, 'executable', '/bin/false')
    with pytest.raises(RuntimeError, match='no servo will be driven'):
        Guard('emulated:/nowhere')


@pytest.mark.parametrize('abstract', [False, True])
def test_systemd_hears_ready_alive_and_stopping(tmp_path, monkeypatch, abstract):
    path = f'@w2b-{os.getpid()}' if abstract else str(tmp_path / 'notify')
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind('\0' + path[1:] if abstract else path)
        manager.settimeout(5)
        monkeypatch.setenv('NOTIFY_SOCKET', path)
        systemd = Systemd()
        systemd.ready()
        systemd.alive()
        systemd.stopping()
        assert [manager.recv(100) for _ in range(3)] == [b'READY=1', b'WATCHDOG=1', b'STOPPING=1']


def test_without_systemd_messages_go_nowhere(monkeypatch):
    monkeypatch.delenv('NOTIFY_SOCKET', raising=False)
    Systemd().alive()
    monkeypatch.setenv('NOTIFY_SOCKET', '/nowhere/at/all')
    Systemd().alive()


def test_the_socket_is_seen_only_when_it_listens(tmp_path, monkeypatch):
    path = tmp_path / 'chips'
    path.write_text('left by another')
    listening = socket.socket.listen
    seen = []

    def listen(self):
        seen.append(path.is_socket())
        listening(self)
    monkeypatch.setattr(socket.socket, 'listen', listen)
    server = ChipServer(str(path))
    try:
        assert seen == [False]
        client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        client.connect(str(path))
        client.close()
        assert [file.name for file in tmp_path.iterdir()] == ['chips']
    finally:
        server._socket.close()
