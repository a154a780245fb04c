"""The robot on emulated chips as a process: it sends frames, and drives nothing until armed."""

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState

from w2b_core.body_status import TOPIC, BodyStatus
from w2b_ros.ros_messages import LATCHED
from w2b_ros.testing import listener, run_until


def test_no_pulse_before_it_is_armed():
    pulses, bodies = [], []
    with listener() as node:
        node.create_subscription(JointState, 'pulses', pulses.append, 10)
        node.create_subscription(
            DiagnosticStatus, TOPIC, lambda message: bodies.append(BodyStatus.from_values(
                {item.key: item.value for item in message.values})), LATCHED)
        run_until(lambda: len(pulses) >= 20 and bodies and bodies[-1].state == 'DISARMED', node,
                  'w2b_hw.node', 'transport:=emulated')
    assert len(pulses) >= 20
    assert not any(position for message in pulses for position in message.position)
    assert [body.follows for body in bodies].count(True) == 0
