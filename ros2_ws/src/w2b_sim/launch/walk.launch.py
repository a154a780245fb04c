"""Start a simulated body and the brain that walks it."""

from launch import LaunchDescription
from launch_ros.actions import Node

from w2b_ros import launching

ARGUMENTS = {
    'body': 'body to simulate; the controller of this name walks it unless another is given',
    'world': 'world to simulate it in; the one the body is meant for unless given',
    'real_time_factor': 'speed of the simulated clock, 1.0 unless given; 0.0: lockstep',
    'seed': 'of the starts, which differ a little then; all are the nominal one unless given',
    'clock_topic': 'where the simulated time is told: /clock, or clock in a namespace',
    **launching.CONTROLLER,
}


def nodes(given: launching.Given) -> list[Node]:
    """Return sim and brain."""
    clock = given.text('clock_topic', 'clock' if given.text('namespace') else '/clock')
    sim = launching.node(
        given, 'w2b_sim', 'sim', own_clock=True,
        defaults={'real_time_factor': 1.0, 'clock_topic': clock},
        body=str, world=str, real_time_factor=float, seed=int, frame_prefix=str)
    body = given.text('body')
    brain = launching.brain(given, clock_topic=clock,
                            defaults={'controller': body} if body else {})
    return [sim, brain]


def generate_launch_description() -> LaunchDescription:
    """Return sim and brain with their parameter files."""
    return launching.description(nodes, ARGUMENTS, use_sim_time=True, on_exit=launching.SHUTDOWN)
