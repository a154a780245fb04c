"""Start the brain, which hears words on `command`."""

from launch import LaunchDescription

from w2b_ros import launching


def generate_launch_description() -> LaunchDescription:
    """Return the brain with its parameter file."""
    return launching.description(lambda given: [launching.brain(given)], launching.CONTROLLER,
                                 use_sim_time=False, on_exit=launching.SHUTDOWN)
