"""Start a simulated robot, the brain that walks it, its description and RViz."""

from launch import LaunchDescription
from launch_ros.actions import Node

from w2b_description import viewing
from w2b_ros import launching

ARGUMENTS = {
    'body': f'body to simulate, {viewing.BODY} unless given; the controller of this name walks it '
            'unless another is given',
    'engine': 'what moves it: pybullet or mujoco',
    'world': 'world to simulate it in; the one the body is meant for unless given',
    'real_time_factor': 'speed of the simulated clock, 1.0 unless given; 0.0: lockstep',
    'clock_topic': 'where the simulated time is told: /clock, or clock in a namespace',
    **viewing.ARGUMENTS,
    **launching.CONTROLLER,
}


def nodes(given: launching.Given) -> list[Node]:
    """Return sim, brain and viewers."""
    clock = given.text('clock_topic', 'clock' if given.text('namespace') else '/clock')
    body = given.text('body', viewing.BODY)
    sim = launching.node(
        given, 'w2b_sim', 'sim', own_clock=True,
        defaults={'body': body, 'real_time_factor': 1.0, 'clock_topic': clock},
        engine=str, world=str, real_time_factor=float, frame_prefix=str)
    brain = launching.brain(given, clock_topic=clock, defaults={'controller': body})
    return [sim, brain, *viewing.description_nodes(given, body, clock),
            *viewing.rviz_nodes(given, clock)]


def generate_launch_description() -> LaunchDescription:
    """Return all nodes with their parameter files."""
    return launching.description(nodes, ARGUMENTS, use_sim_time=True, on_exit=launching.SHUTDOWN)
