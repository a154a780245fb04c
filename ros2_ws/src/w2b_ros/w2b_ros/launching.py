"""
What the launch files share: their arguments, and nodes made from those that were given.

An argument that is not given changes nothing, so that a parameter file counts. Needs `launch_ros`,
which comes with a standard ROS 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

#: Seconds until a node that ended is started again.
RESPAWN_S = 2.0
SHUTDOWN, RESPAWN = 'shutdown', 'respawn'
Value = str | float | int | bool

COMMON = {
    'namespace': 'of nodes and topics, such as dog1: of several robots each has its own',
    'frame_prefix': 'before the names of frames, such as dog1/',
    'params_file': 'YAML file with parameters of the nodes, which count before the defaults',
    'log_level': 'debug, info, warn, error or fatal',
}
CONTROLLER = {
    'controller': 'name of a controller that ships, or path of a controller file',
    'vocabulary': 'default, name of an installed one, or path of a word2vec file',
    'command_timeout': 'seconds that a word lasts; 0: as long as nothing else ends it',
}


class Given:
    """The arguments of a launch file that were given, as values of their parameters' types."""

    def __init__(self, context: LaunchContext) -> None:
        self._values: Mapping[str, str] = context.launch_configurations

    def text(self, name: str, default: str = '') -> str:
        """Return an argument as text, `default` if it was not given."""
        return self._values.get(name, '') or default

    def parameters(self, **types: type) -> dict[str, ParameterValue]:
        """Return those of some parameters that were given."""
        return {name: ParameterValue(LaunchConfiguration(name), value_type=kind)
                for name, kind in types.items() if self.text(name)}


def description(make: Callable[[Given], Sequence[Node]], arguments: Mapping[str, str], *,
                use_sim_time: bool, on_exit: str) -> LaunchDescription:
    """
    Return a launch description.

    Parameters
    ----------
    make
        Returns the nodes.
    arguments
        Descriptions of the arguments by name; they are empty unless given.
    use_sim_time
        Whether nodes take their time from the simulation by default.
    on_exit
        What happens when a node ends by default: SHUTDOWN or RESPAWN.

    """
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value='', description=text)
          for name, text in {**arguments, **COMMON}.items()),
        DeclareLaunchArgument('use_sim_time', default_value=str(use_sim_time).lower(),
                              choices=['true', 'false'],
                              description='whether time comes from the simulation'),
        DeclareLaunchArgument('on_exit', default_value=on_exit, choices=[SHUTDOWN, RESPAWN],
                              description='what happens when a node ends: all others are ended, '
                              'or it is started again'),
        OpaqueFunction(function=lambda context: list(make(Given(context))))])


def node(given: Given, package: str, executable: str, *,
         defaults: Mapping[str, Value] | None = None, clock_topic: str = '/clock',
         own_clock: bool = False, **types: type) -> Node:
    """
    Return a node: its parameter file, the defaults of the launch file, then what was given.

    Parameters
    ----------
    given
        The launch file's arguments.
    package, executable
        What to start; its parameter file is `config/EXECUTABLE.yaml` of the package.
    defaults
        Parameters that the launch file sets unless an argument does.
    clock_topic
        Where simulated time is told.
    own_clock
        Whether the node is the clock, and takes its time from nowhere.
    types
        Types of the parameters that are arguments of the launch file, by name.

    """
    config = PathJoinSubstitution([FindPackageShare(package), 'config', f'{executable}.yaml'])
    values = {name: ParameterValue(value, value_type=type(value))
              for name, value in (defaults or {}).items()}
    time = {} if own_clock else given.parameters(use_sim_time=bool)
    # launch takes no empty dictionary for parameters.
    sets = [config, values, given.text('params_file'), {**given.parameters(**types), **time}]
    level = given.text('log_level')
    respawn = given.text('on_exit') == RESPAWN
    return Node(
        package=package, executable=executable, output='screen',
        namespace=given.text('namespace'), parameters=[one for one in sets if one],
        remappings=[] if own_clock else [('/clock', clock_topic)],
        ros_arguments=['--log-level', level] if level else [],
        respawn=respawn, respawn_delay=RESPAWN_S,
        on_exit=None if respawn else [Shutdown(reason=f'{executable} ended')])


def brain(given: Given, *, defaults: Mapping[str, Value] | None = None,
          clock_topic: str = '/clock') -> Node:
    """Return the brain, with the arguments `CONTROLLER`."""
    return node(given, 'w2b_controller', 'brain', defaults=defaults, clock_topic=clock_topic,
                controller=str, vocabulary=str, command_timeout=float)
