"""What must not move the robot does not: garbage, strangers, and processes that die."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.ros.offline import FEET, JOINTS, assert_repeats
from w2b_controller.say import values_of
from w2b_ros.ros_messages import to_stamp

PERIOD_NS = 50_000_000
NAN, INF = math.nan, math.inf
ZEROS = [0.0] * len(JOINTS)


class Stranger:
    """Publishes what it should not."""

    def __init__(self, system):
        self._system = system
        self._kinds = {'joint_states': JointState, 'contacts': JointState,
                       'joint_trajectory': JointTrajectory, 'command': String}
        self._publishers = {}

    def __enter__(self):
        node = self._system.node
        self._publishers = {topic: node.create_publisher(kind, topic, 10)
                            for topic, kind in self._kinds.items()}
        # The client itself listens to targets.
        listeners = {'joint_trajectory': 2}
        self._system.wait(
            lambda: all(publisher.get_subscription_count() >= listeners.get(topic, 1)
                        for topic, publisher in self._publishers.items()), 'listeners')
        return self

    def __exit__(self, *_):
        for publisher in self._publishers.values():
            self._system.node.destroy_publisher(publisher)

    def bad_half(self, stamp_ns, fault):
        """Publish what is wrong of a frame; a good half would pass for the body's own."""
        self.frame(stamp_ns, topics=[
            topic for topic, keys in (('contacts', {'feet', 'touching'}),
                                      ('joint_states', {'names', 'positions'}))
            if keys & set(fault)], **fault)

    def frame(self, stamp_ns, names=tuple(JOINTS), positions=tuple(ZEROS), feet=tuple(FEET),
              touching=(1.0, 1.0, 1.0, 1.0), topics=('contacts', 'joint_states')):
        for topic, keys, values in (('contacts', feet, touching),
                                    ('joint_states', names, positions)):
            if topic not in topics:
                continue
            message = JointState(name=list(keys), position=list(values))
            message.header.stamp = to_stamp(stamp_ns)
            self._publishers[topic].publish(message)

    def targets(self, stamp_ns, names=tuple(JOINTS), points=(tuple(ZEROS),)):
        message = JointTrajectory(
            joint_names=list(names),
            points=[JointTrajectoryPoint(positions=list(point)) for point in points])
        message.header.stamp = to_stamp(stamp_ns)
        self._publishers['joint_trajectory'].publish(message)

    def command(self, text):
        self._publishers['command'].publish(
            text if isinstance(text, bytes) else String(data=text))


def serialized_string(data: bytes) -> bytes:
    """Return a std_msgs/String as it stands on the wire (CDR, little endian)."""
    return b'\x00\x01\x00\x00' + (len(data) + 1).to_bytes(4, 'little') + data + b'\x00'


BAD_FRAMES = {
    'missing joint': {'names': JOINTS[:-1], 'positions': ZEROS[:-1]},
    'additional joint for a missing one': {'names': [*JOINTS[:-1], 'tail']},
    'too few positions': {'positions': ZEROS[:-1]},
    'no positions': {'positions': []},
    'nothing': {'names': [], 'positions': [], 'feet': [], 'touching': []},
    'joint twice': {'names': [*JOINTS[:-1], JOINTS[0]]},
    'NaN': {'positions': [NAN, *ZEROS[1:]]},
    'infinity': {'positions': [*ZEROS[:-1], -INF]},
    'NaN touch': {'touching': [NAN, 0.0, 0.0, 0.0]},
    'half a touch': {'touching': [0.5, 0.0, 0.0, 0.0]},
    'missing foot': {'feet': FEET[:-1], 'touching': [0.0] * 3},
}
BAD_TARGETS = {
    'missing joint': {'names': JOINTS[:-1], 'points': [ZEROS[:-1]]},
    'other joints': {'names': [f'wheel_{number}' for number in range(8)]},
    'too many positions': {'points': [[*ZEROS, 0.0]]},
    'NaN': {'points': [[NAN] * 8]},
    'infinity': {'points': [[INF] * 8]},
    'beyond the limits': {'points': [[1.5] * 8]},
    'no point': {'points': []},
    'two points': {'points': [ZEROS, ZEROS]},
}
BAD_COMMANDS = {
    'empty': '', 'space': ' \t\n', 'punctuation': '?!', 'unknown word': 'qwxzv',
    'megabyte': 'forward ' * 131_072, 'one long word': 'a' * 1_048_576, 'control': '\x1b[2J',
    'not UTF-8': serialized_string(b'\xff\xfeforward'),
}


def test_garbage_on_every_topic_changes_no_bit_of_the_motion(walking):
    """A run amid all kinds of garbage is still the offline evaluation to 1e-9 m."""
    first = walking.reset()
    assert walking.tell('forward')[0] == 0
    with Stranger(walking) as stranger:
        walking.pause(False)
        walking.spin_for_frames(10)
        for fault in BAD_FRAMES.values():
            stranger.bad_half(max(walking.positions_m) + PERIOD_NS, fault)
            walking.spin_for_frames(3)
        for stamp_ns in (0, first - PERIOD_NS, first, 2**62):
            stranger.frame(stamp_ns % (2**31 * 10**9))
            walking.spin_for_frames(3)
        for fault in BAD_TARGETS.values():
            stranger.targets(max(walking.positions_m), **fault)
            walking.spin_for_frames(3)
        for stamp_ns in (0, first, max(walking.positions_m) + 10**12):
            stranger.targets(stamp_ns, points=[[0.7] * 8])
            walking.spin_for_frames(3)
        for text in BAD_COMMANDS.values():
            stranger.command(text)
            walking.spin_for_frames(3)
        walking.wait(lambda: walking.last_answer()[2]['received'] == str(1 + len(BAD_COMMANDS)),
                     'the last answer')
    assert_repeats(walking, first, 'forward')
    walking.wait(lambda: int(values_of(walking.statuses['sim: targets'])['refused'])
                 >= len(BAD_TARGETS) + 3, 'a count of the refused targets')
    # What the brain last said of itself may be older than the last of the bad frames.
    walking.wait(lambda: int(values_of(walking.statuses['brain: frames'])['malformed'])
                 >= len(BAD_FRAMES), 'a count of the malformed frames')
    walking.wait(lambda: int(values_of(walking.statuses['brain: frames'])['stale']) >= 2,
                 'a count of the stale frames')
    assert values_of(walking.statuses['brain: frames'])['restarts'] == '0'


@pytest.mark.parametrize('kind', BAD_COMMANDS)
def test_a_bad_command_is_answered_with_the_reason(walking, kind):
    walking.tell('stop')
    level, message, values = walking.tell(BAD_COMMANDS[kind])
    assert level == 2
    assert message
    assert len(message) + len(values['text']) < 1000
    walking.wait_for_status('brain: command', 0, "following 'stop'")


@pytest.mark.parametrize('fault', ['NaN', 'missing joint', 'too few positions'])
def test_bad_frames_alone_get_no_answer_and_a_diagnosis(walking, fault):
    with Stranger(walking) as stranger:
        def diagnosed():
            stranger.frame(10**12, **BAD_FRAMES[fault])
            status = walking.statuses.get('brain: frames')
            # A warning at first; an error when the timeout has passed without frames that count.
            return (status is not None and status.level[0] == 2
                    and 'no sensor frames; ignored: joint_states' in status.message)
        walking.wait(diagnosed, 'a diagnosis')
    assert not walking.targets_rad


def test_the_frames_of_another_body_are_diagnosed_and_move_nothing(system):
    system.start('sim', body='minimal')
    system.start('brain')
    system.wait_for_brain()
    assert system.tell('forward')[0] == 0
    status = system.wait_for_status('brain: frames', 2, 'another body?')
    assert 'start both with the same body' in status.message
    assert status.hardware_id == 'quadruped'
    system.wait_for_status('sim: targets', 1, 'no targets')
    assert not system.targets_rad
    assert len(system.positions_m) == 1, 'the same frame again and again'


def test_a_killed_sim_is_missed_and_its_successor_walks_again(system):
    sim = system.start('sim')
    system.start('brain')
    system.wait_for_brain()
    assert system.tell('forward')[0] == 0
    system.spin_for_frames(100)
    sim.kill()
    system.wait_for_status('brain: frames', 2, 'no sensor frames')
    # Every frame but the last, which the brain may not have got, was answered: all have arrived.
    system.wait(lambda: max(system.targets_rad) >= max(system.positions_m) - PERIOD_NS,
                'the last frames')
    targets = len(system.targets_rad)
    system.forget()
    system.start('sim')
    system.spin_for_frames(60)
    assert targets > 0
    system.wait_for_status('brain: command', 0, 'standing: the sensor frames started over')
    assert all(set(targets.values()) == {0.0} for targets in system.targets_rad.values())
    first_frames = [system.positions_m[stamp] for stamp in sorted(system.positions_m)[:60]]
    assert np.ptp(first_frames, axis=0).max() < 2e-3
    before = system.positions_m[max(system.positions_m)]
    assert system.tell('forward')[0] == 0
    system.spin_for_frames(200)
    assert system.positions_m[max(system.positions_m)][0] > before[0] + 0.1


def test_a_killed_brain_leaves_the_body_waiting_and_its_successor_stands(system):
    system.start('sim')
    brain = system.start('brain')
    system.wait_for_brain()
    assert system.tell('forward')[0] == 0
    system.spin_for_frames(100)
    brain.kill()
    system.statuses.clear()
    system.wait_for_status('sim: targets', 1, 'no targets: the body waits')
    frozen = system.last_frame()
    system.forget()
    system.answers.clear()
    system.start('brain')
    system.spin_for_frames(100)
    assert min(system.positions_m) == frozen
    assert all(set(targets.values()) == {0.0} for targets in system.targets_rad.values())
    system.wait_for_status('brain: command', 0, 'standing: no command yet')
    settled = max(system.positions_m)
    system.spin_for_frames(50)
    moved = np.subtract(system.positions_m[max(system.positions_m)], system.positions_m[settled])
    assert np.abs(moved).max() < 0.01


def test_a_second_brain_refuses_to_start_and_the_first_walks_on_undisturbed(walking):
    first = walking.reset()
    assert walking.tell('backward')[0] == 0
    walking.pause(False)
    # It ends as soon as it sees the first; on a busy machine discovery takes its time.
    second = walking.start('brain', claim_wait=60.0)
    second.may_fail = True
    walking.wait(lambda: second.exit_code is not None, 'the end of the second brain')
    assert second.exit_code == 1
    assert 'already publishes on /' in second.log
    assert 'stop it first' in second.log
    assert_repeats(walking, first, 'backward')


def test_two_brains_that_start_at_once_are_both_silent_until_one_leaves(walking):
    """Discovery takes time, so that each may miss the other at first; here one appears later."""
    walking.tell('forward')
    walking.pause(False)
    walking.spin_for_frames(20)
    rivals = [walking.node.create_publisher(JointTrajectory, 'joint_trajectory', 10),
              walking.node.create_publisher(DiagnosticStatus, 'command_answer', 10)]
    walking.wait_for_status('brain: command', 2, 'another brain is active')
    walking.wait_for_status('sim: targets', 1, 'no targets')
    level, message, _ = walking.tell('backward')
    assert level == 2
    assert 'another brain is active' in message
    for publisher in rivals:
        walking.node.destroy_publisher(publisher)
    walking.wait_for_status('brain: command', 0, 'standing: another brain was active')
    walking.forget()
    walking.spin_for_frames(20)
    assert all(set(targets.values()) == {0.0} for targets in walking.targets_rad.values())


def test_another_publisher_of_frames_is_pointed_out(walking):
    walking.pause(False)
    publisher = walking.node.create_publisher(JointState, 'joint_states', 10)
    walking.wait_for_status('brain: frames', 1, '2 nodes publish on /joint_states')
    walking.node.destroy_publisher(publisher)
    walking.wait_for_status('brain: frames', 0)


def test_another_publisher_of_targets_is_pointed_out(walking):
    publisher = walking.node.create_publisher(JointTrajectory, 'joint_trajectory', 10)
    walking.wait_for_status('brain: command', 1, 'another node publishes on /joint_trajectory')
    walking.node.destroy_publisher(publisher)
    walking.wait_for_status('brain: command', 0)
