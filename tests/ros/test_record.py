"""`w2b record` and `w2b replay` as processes, over DDS, on real robots that walk and stop."""

import signal
import sys
import time
from pathlib import Path

import pytest
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from tests.ros.harness import EVERYTHING, LATCHED, Process
from w2b_controller.recording import reader


@pytest.fixture
def w2b(system, tmp_path):
    """Return a function that starts `w2b` with arguments."""
    program = Path(system.install) / 'w2b_controller' / 'lib' / 'w2b_controller' / 'w2b'

    def run(*arguments):
        process = Process(program, list(map(str, arguments)), system.environment,
                          tmp_path / f'w2b{len(system.processes)}.log')
        system.processes.append(process)
        return process
    return run


def recorded(folder):
    """Return the messages by topic; empty while there are none."""
    found = {}
    try:
        for message in reader.messages(folder):
            found.setdefault(message.topic, []).append(message)
    except OSError:
        pass
    return found


def hears(system, word):
    """
    Say a word to the brain and the recorder, by this client, which both are connected to.

    `say` speaks as soon as the brain is, so that *stop* is never late; a recorder may miss it.
    """
    system.wait(lambda: system.connected_listeners() >= 2, 'a recorder of commands')
    assert system.tell(word)[0] == 0
    system.wait(lambda: system.last_answer()[2]['body_follows'] == 'true', 'the body following')


@pytest.fixture
def walk(system, w2b, tmp_path):
    """A recording of a simulated robot that heard forward and stop, and what was seen of it."""
    folder, seen = tmp_path / 'walk', {}
    system.node.create_subscription(
        JointState, 'joint_states', lambda message: seen.setdefault(
            (message.header.stamp.sec, message.header.stamp.nanosec), message), EVERYTHING)
    recorder = w2b('record', '--out', folder)
    system.wait(lambda: 'recording to' in recorder.log, 'the recorder')
    system.start('sim', real_time_factor=1.0)
    system.start('brain')
    system.start('description')
    hears(system, 'forward')
    system.wait(lambda: len(recorded(folder).get('/odom', ())) > 40
                and '/robot_description' in recorded(folder), 'a recording', 60)
    hears(system, 'stop')
    system.wait(lambda: len(recorded(folder).get('/command', ())) == 2, 'both words')
    return folder, recorder, seen


def end_robot(system):
    """End all nodes but the test's client, and wait until it has seen that."""
    for process in system.processes:
        process.stop()
    system.wait_for_no_brain()
    system.wait_for_no_sim()
    system.wait(lambda: not system.node.count_publishers('robot_description')
                and not system.node.count_publishers('joint_states'), 'the end of the robot')


def test_a_recording_has_all_topics_of_the_robot_bit_by_bit(system, walk):
    folder, recorder, seen = walk
    assert recorder.stop() == 0
    found = recorded(folder)
    assert {'/joint_states', '/joint_trajectory', '/imu/data', '/odom', '/contacts', '/clock',
            '/command', '/command_answer', '/body_status', '/diagnostics', '/robot_description',
            '/rosout'} <= set(found)
    assert [deserialize_message(message.data, String).data for message in found['/command']] == [
        'forward', 'stop']
    same = 0
    for message in found['/joint_states']:
        joints = deserialize_message(message.data, JointState)
        stamp = joints.header.stamp.sec, joints.header.stamp.nanosec
        if stamp in seen:
            assert joints == seen[stamp]
            same += 1
    assert same > 40
    # Another program, which has no ROS, reads the same numbers.
    decoder = reader.Decoder()
    for message in found['/odom']:
        pose = deserialize_message(message.data, Odometry).pose.pose
        assert decoder.decode(message).pose.pose.position.x == pose.position.x


def test_a_killed_recorder_leaves_what_it_wrote(walk):
    folder, recorder, _seen = walk
    before = {topic: len(found) for topic, found in recorded(folder).items()}
    recorder.kill()
    after = recorded(folder)
    assert all(len(after[topic]) >= count for topic, count in before.items())
    assert [deserialize_message(message.data, String).data for message in after['/command']] == [
        'forward', 'stop']


def test_a_replay_shows_the_robot_again_and_moves_none(system, w2b, walk):
    folder, recorder, _seen = walk
    assert recorder.stop() == 0
    end_robot(system)
    again = {'odom': [], 'command': []}
    system.node.create_subscription(Odometry, 'odom', again['odom'].append, EVERYTHING)
    system.node.create_subscription(String, 'command', again['command'].append, EVERYTHING)
    moving = set()

    def ended():
        moving.update(topic for topic in ('command', 'joint_trajectory', 'cmd_vel')
                      for end in system.node.get_publishers_info_by_topic(f'/{topic}')
                      if end.node_name != 'test_client')
        return replay.exit_code is not None
    replay = w2b('replay', folder, '--rate', '4')
    system.wait(ended, 'the end of the replay')
    assert replay.exit_code == 0, replay.log
    expected = [deserialize_message(message.data, Odometry)
                for message in recorded(folder)['/odom']]
    assert len(again['odom']) >= 0.95 * len(expected)
    assert all(message in expected for message in again['odom'])
    assert not again['command']
    assert not moving, 'who publishes nothing there moves nobody'


def test_a_late_viewer_of_a_replay_gets_what_is_latched(system, w2b, walk):
    folder, recorder, _seen = walk
    assert recorder.stop() == 0
    end_robot(system)
    replay = w2b('replay', folder, '--loop')
    system.wait(lambda: 'replaying' in replay.log, 'the replay')
    described = []
    system.wait(lambda: system.node.count_publishers('odom'), 'the replay')
    system.node.create_subscription(String, 'robot_description', described.append, LATCHED)
    system.wait(lambda: described, 'the description')
    assert '<robot name="quadruped">' in described[0].data
    replay.send(signal.SIGINT)
    assert replay.wait() == 0


def test_nothing_is_replayed_onto_a_robot_that_is_there(system, w2b, walk):
    folder, recorder, _seen = walk
    assert recorder.stop() == 0
    replay = w2b('replay', folder)
    system.wait(lambda: replay.exit_code is not None, 'the refusal')
    assert replay.exit_code == 2
    assert 'stop the robot' in replay.log
    assert replay.log.count('\n') == 1


def test_a_robot_that_starts_ends_a_replay(system, w2b, walk):
    folder, recorder, _seen = walk
    assert recorder.stop() == 0
    end_robot(system)
    replay = w2b('replay', folder, '--loop')
    system.wait(lambda: 'replaying' in replay.log, 'the replay')
    system.start('sim')
    system.wait(lambda: replay.exit_code is not None, 'the end of the replay')
    assert replay.exit_code == 2
    assert 'stop the robot' in replay.log


def test_a_recording_of_an_emergency_stop_tells_why_it_came(system, w2b, tmp_path):
    folder = tmp_path / 'stop'
    recorder = w2b('record', '--out', folder)
    system.start('hardware', transport='emulated')
    system.start('brain', controller='physical_twin')
    system.wait(lambda: {'/body_status', '/diagnostics', '/command_answer'} <= set(
        recorded(folder)), 'a recording')
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    assert system.call(Trigger, 'hardware/arm', Trigger.Request()).success
    hears(system, 'forward')
    assert system.call(Trigger, 'hardware/emergency_stop', Trigger.Request()).success
    def told():
        events = w2b('replay', folder, '--events')
        events.wait()
        return events.log if 'FAULT' in events.log else ''
    log = system.wait(told, 'the fault in the recording')
    assert recorder.stop() == 0
    lines = log.splitlines()
    word = next(number for number, line in enumerate(lines) if "said: 'forward'" in line)
    fault = next(number for number, line in enumerate(lines)
                 if '/body_status' in line and 'FAULT' in line)
    assert word < fault
    assert 'emergency stop' in lines[fault], lines[fault]
    assert any('/command_answer' in line and 'the body is FAULT' in line
               for line in lines[fault:]), log


def test_only_the_robot_of_a_namespace_is_recorded(system, w2b, tmp_path):
    folder = tmp_path / 'dog1'
    recorder = w2b('record', '--out', folder, '--namespace', '/dog1', '--exclude', '/dog1/imu/data',
                   '--seconds', '12')
    for name in ('dog1', 'dog2'):
        system.start('sim', '--ros-args', '-r', f'__ns:=/{name}', '-p', 'clock_topic:=clock', '-p',
                     'real_time_factor:=1.0', body=None)
    began_s = time.monotonic()
    assert recorder.wait() == 0, recorder.log
    assert time.monotonic() - began_s < 40
    found = set(recorded(folder))
    assert {'/dog1/joint_states', '/dog1/odom', '/diagnostics'} <= found
    assert not [topic for topic in found if topic.startswith('/dog2')]
    assert '/dog1/imu/data' not in found


@pytest.mark.parametrize(('arguments', 'said'), [
    (('replay', 'nowhere'), 'expected a recording'),
    (('replay', 'x', '--rate', '0'), '0.01 to 100'),
    (('record', '--max-mb', '0'), 'above 0')])
def test_what_cannot_be_is_refused_in_a_line(system, w2b, arguments, said):
    process = w2b(*arguments)
    assert process.wait() in (1, 2)
    assert said in process.log


def test_events_are_told_without_ros(walk, tmp_path):
    """On a laptop that has only the recording and the libraries that read it."""
    import subprocess
    folder, recorder, _seen = walk
    assert recorder.stop() == 0
    hidden = tmp_path / 'no_ros'
    hidden.mkdir()
    (hidden / 'sitecustomize.py').write_text(
        'import sys\nfor name in ("rclpy", "std_msgs", "rosidl_parser"):\n'
        '    sys.modules[name] = None\n')
    done = subprocess.run(
        [sys.executable, '-m', 'w2b_controller.cli.main', 'replay', str(folder), '--events'],
        env={'PATH': '/usr/bin:/bin', 'PYTHONPATH': str(hidden),
             '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1'},
        capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "said: 'forward'" in done.stdout
