"""Start the robot's hardware node and the brain that walks it."""

from launch import LaunchDescription
from launch_ros.actions import Node

from w2b_ros import launching

ARGUMENTS = {
    'transport': 'I2C bus: /dev/i2c-1 unless given, or another device, or emulated',
    'calibration': 'calibration file',
    'imu': 'auto, none, or the name of a part',
    'auto_arm': 'true: arm with the first target, once, without a call of ~/arm',
    **launching.CONTROLLER,
}
#: A word that nobody renews ends: nobody may be there any more.
COMMAND_TIMEOUT_S = 30.0


def nodes(given: launching.Given) -> list[Node]:
    """Return hardware node and brain."""
    frame = {'imu_frame_id': f'{given.text("frame_prefix")}imu_link'}
    hardware = launching.node(
        given, 'w2b_hw', 'hardware', defaults=frame if given.text('frame_prefix') else {},
        transport=str, calibration=str, imu=str, auto_arm=bool)
    brain = launching.brain(given, defaults={'controller': 'physical_twin',
                                             'command_timeout': COMMAND_TIMEOUT_S})
    return [hardware, brain]


def generate_launch_description() -> LaunchDescription:
    """Return hardware node and brain with their parameter files."""
    return launching.description(nodes, ARGUMENTS, use_sim_time=False, on_exit=launching.RESPAWN)
