"""Robot description and frames of real processes: what RViz and Foxglove would draw."""

import sys
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from tests.ros.harness import EVERYTHING, LATCHED
from w2b_core import bodies
from w2b_core.bodies.urdf import describe
from w2b_core.body_status import BodyStatus
from w2b_description.frames import FrameTree, rotate
from w2b_ros.ros_messages import stamp_ns, to_diagnostic

needs_tf2 = pytest.mark.skipif(
    find_spec('tf2_msgs') is None, reason='no tf2_msgs: scripts/build_tf2_msgs needs g++')


class Frames:
    """All transforms that were seen, by their child's name and stamp."""

    def __init__(self, node):
        from tf2_msgs.msg import TFMessage
        self.seen, self.fixed = {}, {}
        node.create_subscription(TFMessage, '/tf', lambda message: self._take(
            self.seen, message), EVERYTHING)
        node.create_subscription(TFMessage, '/tf_static', lambda message: self._take(
            self.fixed, message), LATCHED)

    def _take(self, place, message):
        for one in message.transforms:
            place.setdefault(one.child_frame_id, {})[stamp_ns(one.header.stamp)] = one


def numbers(message, names):
    return [getattr(message, name) for name in names]


def test_a_late_listener_gets_the_description_of_the_body_that_is_there(system):
    system.start('sim', body='quadruped')
    system.start('description')
    system.wait_for_status('description: robot_description', 0, 'describes quadruped')
    described = []
    system.node.create_subscription(String, 'robot_description', described.append, LATCHED)
    system.wait(lambda: described, 'the description')
    assert described[0].data == describe(bodies.get('quadruped'))


@needs_tf2
def test_frames_are_those_of_the_odometry_and_of_the_joints(system):
    odometry, joints = {}, {}
    system.node.create_subscription(
        Odometry, 'odom', lambda message: odometry.update(
            {stamp_ns(message.header.stamp): message}),
        EVERYTHING)
    system.node.create_subscription(
        JointState, 'joint_states', lambda message: joints.update(
            {stamp_ns(message.header.stamp): message}), EVERYTHING)
    frames = Frames(system.node)
    system.start('sim', body='physical_twin', real_time_factor=1.0)
    system.start('brain', controller='physical_twin')
    system.start('description')
    system.wait_for_status('description: tf', 0, 'frames of odom and joints')
    assert system.say('forward').exit_code == 0
    moved = system.wait(lambda: [stamp for stamp in frames.seen.get('base_link', {})
                                 if stamp in odometry and stamp in joints
                                 and stamp in frames.seen.get('front_left_tibia', {})
                                 and odometry[stamp].pose.pose.position.x > 0.05], 'a step')
    stamp = moved[-1]
    base, pose = frames.seen['base_link'][stamp], odometry[stamp].pose.pose
    assert base.header.frame_id == 'odom'
    assert numbers(base.transform.translation, 'xyz') == numbers(pose.position, 'xyz')
    assert numbers(base.transform.rotation, 'xyzw') == numbers(pose.orientation, 'xyzw')
    tree = FrameTree(describe(bodies.get('physical_twin')))
    expected = {one.child: one for one in tree.moving(
        dict(zip(joints[stamp].name, joints[stamp].position, strict=True)))}
    assert len(expected) == 12
    for child, transform in expected.items():
        found = frames.seen[child][stamp]
        assert found.header.frame_id == transform.parent
        np.testing.assert_allclose(numbers(found.transform.rotation, 'xyzw'),
                                   transform.turn_xyzw, atol=1e-12)
    # The footprint is on the floor below the base.
    foot = frames.seen['base_footprint'][stamp]
    turn = np.array(numbers(base.transform.rotation, 'xyzw'))
    place = np.array(numbers(base.transform.translation, 'xyz')) + rotate(
        turn, np.array(numbers(foot.transform.translation, 'xyz')))
    np.testing.assert_allclose(place, [pose.position.x, pose.position.y, 0.0], atol=1e-9)
    assert list(frames.fixed) == ['imu_link']


@needs_tf2
def test_a_prefix_keeps_two_robots_apart(system):
    frames = Frames(system.node)
    for name, body in (('dog1', 'quadruped'), ('dog2', 'physical_twin')):
        words = ('--ros-args', '-r', f'__ns:=/{name}', '-p', f'frame_prefix:={name}/')
        system.start('sim', *words, '-p', f'body:={body}', '-p', 'clock_topic:=clock', '-p',
                     'real_time_factor:=1.0', body=None)
        system.start('description', *words)
    # The base comes with the odometry, the legs with the joint states: one may be first.
    system.wait(lambda: {'dog1/base_link', 'dog1/front_lower_leg',
                         'dog2/base_link', 'dog2/front_left_tibia'} <= set(frames.seen)
                and {'dog1/imu_link', 'dog2/imu_link'} <= set(frames.fixed), 'both robots')
    parents = {child: next(iter(found.values())).header.frame_id
               for child, found in {**frames.seen, **frames.fixed}.items()}
    assert all(child.startswith(('dog1/', 'dog2/')) for child in parents)
    assert all(parent.partition('/')[0] == child.partition('/')[0]
               for child, parent in parents.items())


@needs_tf2
def test_without_odometry_the_legs_and_the_imu_tell_where_the_floor_is(system):
    frames = Frames(system.node)
    system.start('hardware', transport='emulated')
    system.start('description')
    system.wait_for_status('description: tf', 0, 'no odometry comes')
    system.wait(lambda: frames.seen.get('base_footprint'), 'the footprint')
    foot = list(frames.seen['base_footprint'].values())[-1].transform
    body = bodies.get('physical_twin')
    assert foot.translation.z == pytest.approx(-body.height_m, abs=0.02)
    assert 'base_link' not in frames.seen


def test_who_else_describes_the_robot_is_named(system):
    system.start('sim')
    publisher = system.node.create_publisher(String, 'robot_description', LATCHED)
    system.start('description')
    system.wait_for_status('description: robot_description', 1, '/test_client publishes it too')
    system.node.destroy_publisher(publisher)
    system.wait_for_status('description: robot_description', 0, 'describes quadruped')


def test_a_body_of_another_programs_plugin_is_named(system):
    own = Path(__file__).with_name('plugin_body.py')
    system.start('description')
    system.wait_for_status('description: robot_description', 1, 'no body says its name')
    before = system.environment
    system.set_environment(W2B_PLUGINS=str(own))
    system.start('sim', body='table')
    system.set_environment(W2B_PLUGINS=before.get('W2B_PLUGINS', ''))
    system.wait_for_status('description: robot_description', 2, "unknown body 'table'")


def test_a_name_from_outside_opens_no_file(system, tmp_path):
    system.start('description')
    system.wait_for_status('description: robot_description', 1, 'no body says its name')
    publisher = system.node.create_publisher(DiagnosticStatus, 'body_status', LATCHED)
    status = BodyStatus(str(tmp_path / 'robot.yaml'), 'RUNNING', 'test', True, 'a.0', False)
    publisher.publish(to_diagnostic(status.to_status('test'), 'test'))
    system.wait_for_status('description: robot_description', 2, 'expected the name of a body')


def test_without_tf2_msgs_the_description_is_there_and_the_diagnostics_say_what_to_do(system):
    """As where no compiler is: the package is hidden from the node."""
    if find_spec('tf2_msgs') is not None:
        hidden = Path(system.install).parent / 'without_tf2'
        hidden.mkdir(exist_ok=True)
        (hidden / 'sitecustomize.py').write_text(
            'import sys\nsys.modules["tf2_msgs"] = None\n'
            'import importlib.util as u\nfind = u.find_spec\n'
            'u.find_spec = lambda name, package=None: '
            'None if name == "tf2_msgs" else find(name, package)\n')
        paths = [str(hidden), system.environment.get('PYTHONPATH', '')]
        system.set_environment(PYTHONPATH=':'.join(filter(None, paths)))
    system.start('description', body='quadruped')
    system.wait_for_status('description: robot_description', 0, 'describes quadruped')
    system.wait_for_status('description: tf', 1, 'scripts/build_tf2_msgs')


@needs_tf2
@pytest.mark.skipif('site-packages' not in str(find_spec('tf2_msgs') and
                                               find_spec('tf2_msgs').origin)
                    or Path(sys.prefix) not in Path(find_spec('tf2_msgs').origin).parents,
                    reason='tf2_msgs of a standard Jazzy')
def test_the_built_message_has_the_type_hash_of_jazzy(system):
    from tf2_msgs.msg import TFMessage
    system.node.create_publisher(TFMessage, '/tf', 1)
    info = system.wait(lambda: system.node.get_publishers_info_by_topic('/tf'), 'the publisher')
    assert str(info[0].topic_type_hash) == (
        'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087')


def test_the_description_has_the_joints_that_move(system):
    described = []
    system.node.create_subscription(String, 'robot_description', described.append, LATCHED)
    joints = []
    system.node.create_subscription(JointState, 'joint_states', joints.append, EVERYTHING)
    system.start('hardware', transport='emulated')
    system.start('description')
    system.wait(lambda: described and joints, 'description and joints')
    robot = ElementTree.fromstring(described[0].data)
    moving = [joint.get('name') for joint in robot.findall('joint')
              if joint.get('type') == 'revolute']
    assert sorted(moving) == sorted(joints[0].name)
