"""Start a simulated body and the brain that walks it."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return sim and brain with their parameter files."""
    config = PathJoinSubstitution([FindPackageShare('w2b_sim'), 'config', 'sim.yaml'])
    brain = PathJoinSubstitution(
        [FindPackageShare('w2b_controller'), 'launch', 'brain.launch.py'])
    real_time_factor = ParameterValue(LaunchConfiguration('real_time_factor'), value_type=float)
    return LaunchDescription([
        DeclareLaunchArgument('body', default_value='quadruped', description='body to simulate'),
        DeclareLaunchArgument('controller', default_value='quadruped',
                              description='name of a controller that ships, or path of one'),
        DeclareLaunchArgument('real_time_factor', default_value='1.0',
                              description='speed of the simulated clock; 0.0: lockstep'),
        Node(package='w2b_sim', executable='sim', output='screen',
             parameters=[config, {'body': LaunchConfiguration('body'),
                                  'real_time_factor': real_time_factor}]),
        IncludeLaunchDescription(
            brain, launch_arguments={'controller': LaunchConfiguration('controller')}.items()),
    ])
