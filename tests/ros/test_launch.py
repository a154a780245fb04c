"""The launch files, run by ROS's own launch where it is installed."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.harness import Process
from w2b_controller.say import values_of

pytest.importorskip('launch_ros', reason='launch comes with a standard Jazzy only')

SCRIPT = """
import sys
from pathlib import Path
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from ament_index_python.packages import get_package_share_directory
package, name, *arguments = sys.argv[1:]
service = LaunchService(argv=arguments)
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource(f'{get_package_share_directory(package)}/launch/{name}'),
    launch_arguments=[tuple(argument.split(':=')) for argument in arguments])]))
raise SystemExit(service.run())
"""


@pytest.fixture
def launch(system, tmp_path):
    """Return a function that runs a launch file."""
    script = tmp_path / 'run.py'
    script.write_text(SCRIPT)

    def run(package, name, *arguments):
        process = Process(Path(sys.executable), [str(script), package, name, *arguments],
                          system.environment, tmp_path / 'launch.log')
        process.name, process.may_fail = 'launch', True
        system.processes.append(process)
        return process
    return run


def pid_of(process, node):
    lines = [line for line in process.log.splitlines() if f'[{node}' in line
             and 'process started with pid' in line]
    return int(lines[-1].split('pid [')[1].rstrip(']')) if lines else None


def kill(system, process, node):
    pid = system.wait(lambda: pid_of(process, node), f'{node} started')
    subprocess.run(['kill', '-9', str(pid)], check=True)
    return pid


def test_a_body_walks_with_the_controller_of_its_name(system, launch):
    launch('w2b_sim', 'walk.launch.py', 'body:=physical_twin', 'real_time_factor:=0.0')
    system.wait_for_brain()
    said = system.say('forward')
    assert said.exit_code == 0, said.log
    assert system.statuses['brain: frames'].hardware_id == 'physical_twin'


@pytest.mark.parametrize('node', ['brain', 'sim'])
def test_when_a_node_dies_the_launch_ends(system, launch, node):
    process = launch('w2b_sim', 'walk.launch.py')
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    kill(system, process, node)
    process.wait()
    system.wait_for_no_brain()
    system.wait_for_no_sim()


def test_or_starts_it_again(system, launch):
    process = launch('w2b_sim', 'walk.launch.py', 'on_exit:=respawn')
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    before = kill(system, process, 'brain')
    system.wait(lambda: pid_of(process, 'brain') != before, 'another brain')
    system.answers.clear()
    system.wait_for_brain()
    said = system.say('forward')
    assert said.exit_code == 0, said.log
    process.send(signal.SIGINT)
    assert process.wait() == 0


def test_a_parameter_file_counts_before_the_defaults_and_an_argument_before_it(system, launch,
                                                                              tmp_path):
    file = tmp_path / 'params.yaml'
    file.write_text('/**:\n  ros__parameters:\n    body: minimal\n    real_time_factor: 2.0\n'
                    '    frame_timeout: 0.7\n    controller: physical_twin\n')
    process = launch('w2b_sim', 'walk.launch.py', f'params_file:={file}', 'body:=physical_twin')
    system.wait_for_brain()
    system.wait(lambda: 'physical_twin in the world earth' in process.log, 'the body')
    said = system.say('forward')
    assert said.exit_code == 0, said.log


def test_a_log_level_goes_to_the_nodes(system, launch):
    process = launch('w2b_sim', 'walk.launch.py', 'log_level:=error')
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    assert '[INFO] [1' not in process.log, 'a line of a node'


def test_two_robots_in_namespaces_walk_apart(system, launch):
    launch('w2b_sim', 'walk.launch.py', 'namespace:=dog1', 'frame_prefix:=dog1/')
    other = launch('w2b_sim', 'walk.launch.py', 'namespace:=dog2', 'frame_prefix:=dog2/',
                   'body:=physical_twin')
    for name in ('dog1/brain: frames', 'dog2/brain: frames'):
        system.wait_for_status(name, 0, 'sensor frames flow')
    said = system.start('say', '--timeout', '60', 'forward', '--ros-args', '-r', '__ns:=/dog1')
    system.wait(lambda: said.exit_code is not None, 'the answer')
    assert said.exit_code == 0, said.log
    system.wait_for_status('dog1/brain: command', 0, "following 'forward'")
    system.wait_for_status('dog2/brain: command', 0, 'standing: no command yet')
    assert system.node.count_publishers('/clock') == 0
    assert [system.node.count_publishers(f'/{dog}/clock') for dog in ('dog1', 'dog2')] == [1, 1]
    assert 'also publishes' not in other.log


def test_the_robot_is_disarmed_with_words_that_end(system, launch):
    launch('w2b_hw', 'robot.launch.py', 'transport:=emulated', 'command_timeout:=2', 'imu:=none')
    system.wait_for_brain()
    said = system.say('forward')
    assert said.exit_code == 3, said.log
    assert 'the body physical_twin is DISARMED' in said.log
    system.wait_for_status('brain: command', 0, 'standing: the last word was said 2 s ago')


def test_the_robot_is_armed_with_the_first_target_if_asked_to(system, launch):
    launch('w2b_hw', 'robot.launch.py', 'transport:=emulated', 'auto_arm:=true')

    def armed():
        status = system.statuses.get('hardware: safety')
        return status is not None and values_of(status).get('state') in ('ARMING', 'ACTIVE')
    system.wait(armed, 'arming')
