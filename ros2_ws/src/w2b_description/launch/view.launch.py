"""Show a robot that runs, simulated or physical, in RViz."""

from launch import LaunchDescription
from launch_ros.actions import Node

from w2b_description import viewing
from w2b_ros import launching

ARGUMENTS = {
    'body': f'body that the robot has, {viewing.BODY} unless given',
    'clock_topic': 'where simulated time is told: /clock, or clock in a namespace',
    'sliders': 'true: joint_state_publisher_gui moves the joints, where no robot runs',
    **viewing.ARGUMENTS,
}


def nodes(given: launching.Given) -> list[Node]:
    """Return the description, RViz and, if asked for, sliders."""
    clock = given.text('clock_topic', 'clock' if given.text('namespace') else '/clock')
    found = [*viewing.description_nodes(given, given.text('body', viewing.BODY), clock),
             *viewing.rviz_nodes(given, clock)]
    if given.text('sliders') == 'true':
        found.append(Node(package='joint_state_publisher_gui', output='screen',
                          executable='joint_state_publisher_gui',
                          namespace=given.text('namespace')))
    return found


def generate_launch_description() -> LaunchDescription:
    """Return the viewers; time is the robot's own, true for a simulated one."""
    return launching.description(nodes, ARGUMENTS, use_sim_time=False, on_exit=launching.SHUTDOWN)
