"""Start the brain, which hears words on /command."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    'controller': ('quadruped', 'name of a controller that ships, or path of a controller file'),
    'vocabulary': ('default', 'default, name of an installed one, or path of a word2vec file'),
}


def generate_launch_description() -> LaunchDescription:
    """Return the brain with its parameter file."""
    config = PathJoinSubstitution([FindPackageShare('w2b_controller'), 'config', 'brain.yaml'])
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, (default, description) in ARGUMENTS.items()),
        Node(package='w2b_controller', executable='brain', output='screen',
             parameters=[config, {name: LaunchConfiguration(name) for name in ARGUMENTS}]),
    ])
