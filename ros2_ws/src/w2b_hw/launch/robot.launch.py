"""Start the robot's hardware node and the brain that walks it."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return hardware node and brain with their parameter files."""
    config = PathJoinSubstitution([FindPackageShare('w2b_hw'), 'config', 'hardware.yaml'])
    brain = PathJoinSubstitution(
        [FindPackageShare('w2b_controller'), 'launch', 'brain.launch.py'])
    return LaunchDescription([
        DeclareLaunchArgument('transport', default_value='/dev/i2c-1',
                              description='I2C device, or emulated'),
        DeclareLaunchArgument('controller', default_value='physical_twin',
                              description='name of a controller that ships, or path of one'),
        Node(package='w2b_hw', executable='hardware', output='screen',
             parameters=[config, {'transport': LaunchConfiguration('transport')}]),
        IncludeLaunchDescription(
            brain, launch_arguments={'controller': LaunchConfiguration('controller')}.items()),
    ])
