"""
Nodes that show a robot, for launch files: robot_state_publisher, `description` and RViz.

Needs `launch_ros`, which comes with a standard ROS 2.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import NamedTemporaryFile

from ament_index_python.packages import get_package_share_directory
from launch.actions import Shutdown
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from w2b_core import bodies
from w2b_core.bodies.urdf import describe
from w2b_description.footprint import FOOTPRINT
from w2b_ros import launching

PACKAGE = 'w2b_description'
#: Body that is shown unless another is named, as of `sim` and `hardware`.
BODY = 'physical_twin'
ARGUMENTS = {
    'rviz': 'true or false: whether RViz shows the robot, true unless given',
    'fixed_frame': 'that RViz holds still: odom unless given; base_footprint for a physical robot, '
                   'which has no odometry',
}


def description_nodes(given: launching.Given, body: str, clock_topic: str) -> list[Node]:
    """
    Return what publishes the robot description and all frames.

    Parameters
    ----------
    given
        Arguments of the launch file.
    body
        Name of a registered body, or the file of one.
    clock_topic
        Where simulated time is told.

    """
    time = given.parameters(use_sim_time=bool)
    state = Node(
        package='robot_state_publisher', executable='robot_state_publisher', output='screen',
        namespace=given.text('namespace'), remappings=[('/clock', clock_topic)],
        parameters=[{
            'robot_description': ParameterValue(describe(bodies.get(body)), value_type=str),
            'frame_prefix': given.text('frame_prefix'), **time}])
    own = launching.node(
        given, PACKAGE, 'description', clock_topic=clock_topic,
        defaults={'body': body, 'robot_description': False, 'joint_transforms': False},
        frame_prefix=str)
    return [state, own]


def view_file(prefix: str) -> str:
    """Return the path of RViz's view; with a frame prefix that of a copy that looks there."""
    path = Path(get_package_share_directory(PACKAGE)) / 'rviz' / 'w2b.rviz'
    if not prefix:
        return str(path)
    text = path.read_text(encoding='utf-8').replace(FOOTPRINT, prefix + FOOTPRINT)
    # RViz itself puts the slash behind it.
    text = text.replace('TF Prefix: ""', f'TF Prefix: "{prefix.rstrip("/")}"')
    with NamedTemporaryFile('w', prefix='w2b-', suffix='.rviz', delete=False,
                            encoding='utf-8') as copy:
        copy.write(text)
    return copy.name


def rviz_nodes(given: launching.Given, clock_topic: str) -> list[Node]:
    """Return RViz with the view of this package; nothing with `rviz:=false`."""
    if given.text('rviz', 'true') == 'false':
        return []
    prefix = given.text('frame_prefix')
    frame = prefix + given.text('fixed_frame', 'odom')
    time = given.parameters(use_sim_time=bool)
    return [Node(
        package='rviz2', executable='rviz2', output='screen', namespace=given.text('namespace'),
        arguments=['-d', view_file(prefix), '-f', frame], remappings=[('/clock', clock_topic)],
        parameters=[time] if time else [],
        on_exit=[Shutdown(reason='RViz was closed')])]
