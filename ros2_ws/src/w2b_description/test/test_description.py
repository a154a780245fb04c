"""The node as a process: the description of a body, and its frames where tf2_msgs is there."""

from importlib.util import find_spec
from xml.etree import ElementTree

from std_msgs.msg import String

from w2b_ros.ros_messages import LATCHED
from w2b_ros.testing import listener, run_until


def test_a_late_listener_gets_the_description_and_the_fixed_frames():
    described, fixed = [], []
    frames = find_spec('tf2_msgs') is not None
    with listener() as node:
        node.create_subscription(String, 'robot_description', described.append, LATCHED)
        if frames:
            from tf2_msgs.msg import TFMessage
            node.create_subscription(TFMessage, '/tf_static', fixed.append, LATCHED)
        run_until(lambda: described and (fixed or not frames), node,
                  'w2b_description.description', 'body:=quadruped')
    assert ElementTree.fromstring(described[0].data).get('name') == 'quadruped'
    if frames:
        assert [one.child_frame_id for one in fixed[0].transforms] == ['imu_link']
