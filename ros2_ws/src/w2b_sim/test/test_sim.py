"""The simulation as a process: one frame is one stamp on all its topics."""

from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

from w2b_ros.ros_messages import FRAMES_OUT, stamp_ns
from w2b_ros.testing import listener, run_until

PERIOD_NS = 50_000_000


def test_the_first_frame_comes_with_one_stamp_on_all_topics():
    seen = {}
    with listener() as node:
        for kind, topic in ((JointState, 'joint_states'), (JointState, 'contacts'),
                            (Imu, 'imu/data'), (Odometry, 'odom')):
            node.create_subscription(kind, topic, lambda message, topic=topic: seen.update(
                {topic: message}), FRAMES_OUT)
        run_until(lambda: len(seen) == 4, node, 'w2b_sim.sim', 'frame_prefix:=dog1/',
                  'body:=quadruped')
    assert {stamp_ns(message.header.stamp) for message in seen.values()} == {PERIOD_NS}
    assert len(seen) == 4
    odometry = seen['odom']
    assert (odometry.header.frame_id, odometry.child_frame_id) == ('dog1/odom', 'dog1/base_link')
    assert odometry.pose.pose.position.z > 0.0
    assert all(odometry.pose.covariance[[0, 7, 14, 21, 28, 35]] > 0.0)
