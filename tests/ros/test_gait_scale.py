"""`gait_scale`, on the pulses that the emulated chip puts out."""

import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from tests.ros.hardware import STILL_US, HardwareSystem

#: The test's brain swings every joint by 0.4 rad; a servo turns 180 degrees in 2000 us.
WHOLE_US = 2 * 0.4 * 2000 / np.pi


def set_gait_scale(system, scale):
    """Set it as `ros2 param set` does; return whether it was taken."""
    request = SetParameters.Request(parameters=[Parameter('gait_scale', value=scale)
                                                .to_parameter_msg()])
    return system.call(SetParameters, 'hardware/set_parameters', request).results[0].successful


@pytest.fixture
def robot(system, tmp_path):
    robot = HardwareSystem(system, tmp_path, gait_scale=0.0)
    yield robot
    robot.close()


def test_a_gait_grows_from_nothing_to_the_whole_about_the_standing_pose(robot):
    robot.walk()
    assert robot.swing_us(1.5).max() < STILL_US
    middle = np.array(robot.chips.outputs()[-1].pulses_us[:12])
    np.testing.assert_allclose(middle, 1500.0, atol=STILL_US)
    for scale in (0.5, 1.0):
        assert set_gait_scale(robot.system, scale)
        robot.spin(2.0)
        np.testing.assert_allclose(robot.swing_us(3.0), scale * WHOLE_US, rtol=0.1)
    assert set_gait_scale(robot.system, 0.0)
    robot.spin(0.5)
    assert robot.swing_us(1.0).max() < STILL_US


def test_more_than_the_whole_gait_and_less_than_none_are_refused(robot):
    robot.wait_for_frames()
    for scale in (1.1, -0.1):
        assert not set_gait_scale(robot.system, scale)
    assert set_gait_scale(robot.system, 0.3)
