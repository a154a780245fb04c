"""The brain's lifecycle, its parameters, and how it ends."""

import contextlib
import signal
import subprocess
import time
from pathlib import Path

import pytest
import yaml
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
)
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from tests.ros.harness import DEADLINE_S
from w2b_core.controller import file as controller_file


def test_walking_through_the_lifecycle(system):
    system.start('sim')
    brain = system.start('brain', autostart=False)
    assert system.brain_state() == 'unconfigured'
    assert not system.transition('activate'), 'not configured yet'
    assert system.transition('configure')
    assert system.brain_state() == 'inactive'
    system.wait_for_status('brain: frames', 1, 'inactive')
    assert system.node.count_publishers('joint_trajectory') == 0
    assert not system.targets_rad

    assert system.transition('activate')
    assert system.brain_state() == 'active'
    system.spin_for_frames(10)
    assert system.tell('forward')[0] == 0
    assert not system.transition('configure'), 'already active'

    assert system.transition('deactivate')
    system.wait(lambda: system.node.count_publishers('joint_trajectory') == 0, 'silence')
    # The last target may still be under way: the sim stands once it says that it waits.
    system.statuses.clear()
    system.wait_for_status('sim: targets', 1, 'no targets')
    frozen = system.last_frame()
    system.statuses.clear()
    system.wait_for_status('sim: targets', 1, 'no targets')
    assert system.last_frame() == frozen

    system.answers.clear()
    assert system.transition('activate')
    system.wait_for_brain()
    system.wait_for_status('brain: command', 0, 'standing: no command yet')
    system.spin_for_frames(10)
    assert system.transition('deactivate')
    assert system.transition('cleanup')
    assert system.brain_state() == 'unconfigured'
    assert system.transition('configure')
    assert system.transition('shutdown')
    assert brain.wait() == 0


def test_requests_for_impossible_transitions_are_refused_and_survived(walking):
    for label in ('configure', 'activate', 'cleanup', 'no such transition'):
        assert not walking.transition(label)
    assert walking.brain_state() == 'active'


@pytest.mark.parametrize('signals', [
    [signal.SIGTERM], [signal.SIGINT, signal.SIGINT], [signal.SIGTERM, signal.SIGINT]],
    ids=lambda signals: '+'.join(s.name for s in signals))
def test_brain_and_sim_end_cleanly(system, signals):
    """One SIGINT is how every other test here ends them."""
    sim, brain = system.start('sim'), system.start('brain')
    system.spin_for_frames(10)
    for process in (brain, sim):
        for number in signals:
            process.send(number)
    assert brain.wait() == 0
    assert sim.wait() == 0
    assert 'Traceback' not in system.logs()


def test_every_further_signal_changes_nothing(system):
    """Ctrl-C in a launched system arrives twice, the second time perhaps when all is done."""
    for name in ('sim', 'brain'):
        process = system.start(name)
        system.wait(lambda name=name: f'{name}: ' in ' '.join(system.statuses), 'the node')
        end_s = time.monotonic() + DEADLINE_S
        while process.exit_code is None and time.monotonic() < end_s:
            process.send(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(0.005)
        assert process.exit_code == 0


def test_a_brain_that_is_stopped_while_it_starts_ends_cleanly(system):
    brain = system.start('brain')
    system.wait(lambda: system.node.count_publishers('/diagnostics'), 'the node')
    brain.send(signal.SIGINT)
    assert brain.wait() == 0


@pytest.mark.parametrize(('executable', 'faults'), [
    ('brain', [({'controller': '/no/such/file.json'}, 'no such file'),
               ({'controller': 'elephant'}, 'quadruped'),
               ({'vocabulary': '/no/such/words.bin'}, 'vocabulary install'),
               ({'frame_timeout': -1.0}, 'frame_timeout'),
               ({'frame_timeout': '"soon"'}, 'frame_timeout'),
               ({'command_topic': '"not a topic"'}, 'command_topic'),
               ({'joint_states_topic': '""'}, 'joint_states_topic'),
               ({'diagnostics_topic': '"?"'}, 'diagnostics_topic')]),
    ('sim', [({'body': 'elephant'}, 'quadruped'),
             ({'world': 'moon'}, 'paper'),
             ({'pause_after': -1}, 'pause_after'),
             ({'real_time_factor': -1.0}, 'real_time_factor')])])
def test_a_bad_parameter_ends_a_node_with_one_line(system, executable, faults):
    processes = [system.start(executable, **parameters) for parameters, _ in faults]
    for process, (parameters, reason) in zip(processes, faults, strict=True):
        process.may_fail = True
        assert process.wait() == 1, parameters
        errors = [line for line in process.log.splitlines() if 'error' in line.lower()]
        assert len(errors) == 1, process.log
        assert reason in errors[0]


def test_a_damaged_controller_refuses_to_configure_and_a_good_one_then_does(system, tmp_path):
    damaged = tmp_path / 'damaged.json'
    damaged.write_bytes(b'\xff\xfe not a controller')
    brain = system.start('brain', autostart=False, controller=damaged)
    assert not system.transition('configure')
    assert system.brain_state() == 'unconfigured'
    assert 'UTF-8' in brain.log
    damaged.write_bytes(controller_file.shipped('quadruped_serial').read_bytes())
    assert system.transition('configure')


@pytest.mark.parametrize(('node', 'package'), [('brain', 'w2b_controller'), ('sim', 'w2b_sim')])
def test_the_parameter_file_holds_every_parameter_with_its_default(system, installed, node,
                                                                   package):
    system.start(node, **({'claim_wait': 1.0, 'controller': None} if node == 'brain'
                          else {'body': None}))
    names = [name for name in system.call(
        ListParameters, f'{node}/list_parameters', ListParameters.Request()).result.names
        if name != 'use_sim_time' and not name.startswith('start_type_description')]
    file = installed / package / 'share' / package / 'config' / f'{node}.yaml'
    written = yaml.safe_load(Path(file).read_text())['/**']['ros__parameters']
    assert set(written) == set(names)
    described = system.call(DescribeParameters, f'{node}/describe_parameters',
                            DescribeParameters.Request(names=names)).descriptors
    assert all(descriptor.description for descriptor in described)
    values = system.call(GetParameters, f'{node}/get_parameters',
                         GetParameters.Request(names=names)).values
    assert {name: parameter_value_to_python(value)
            for name, value in zip(names, values, strict=True)} == written
    request = SetParameters.Request(parameters=[
        RosParameter('diagnostics_topic', value='elsewhere').to_parameter_msg()])
    result = system.call(SetParameters, f'{node}/set_parameters', request).results[0]
    assert not result.successful, 'fixed while the node runs'
    assert 'read-only' in result.reason


def test_a_whole_number_will_do_for_a_number(system):
    sim = system.start('sim', real_time_factor=1, start_height=0)
    system.wait(lambda: len(system.positions_m) > 2, 'frames')
    assert 'paced' in sim.log
    names = ['real_time_factor', 'start_height']
    described = system.call(DescribeParameters, 'sim/describe_parameters',
                            DescribeParameters.Request(names=names)).descriptors
    assert [(one.floating_point_range[0].to_value, one.read_only) for one in described] == [
        (100.0, False), (1.0, False)]
    request = SetParameters.Request(parameters=[
        RosParameter('start_height', value=value).to_parameter_msg() for value in (1, 2, 'high')])
    taken, beyond, text = system.call(SetParameters, 'sim/set_parameters', request).results
    assert taken.successful
    assert not beyond.successful
    assert 'start_height' in beyond.reason
    assert not text.successful
    values = system.call(GetParameters, 'sim/get_parameters',
                         GetParameters.Request(names=names)).values
    assert [value.double_value for value in values] == [1.0, 1.0]


def test_a_brain_beside_a_running_sim_starts_without_an_error(system):
    system.start('sim', real_time_factor=1)
    system.wait(lambda: system.positions_m, 'a frame')
    brain = system.start('brain', claim_wait=1.0)
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    assert 'waiting for the first sensor frame' in brain.log
    assert '[ERROR]' not in brain.log


def test_topics_can_be_renamed_and_simulated_time_used(system):
    """The brain's own timers go on while simulated time stands still."""
    sim = system.start('sim', '--ros-args', '-r', 'joint_states:=measured', '-r',
                       'contacts:=feet')
    system.start('brain', joint_states_topic='measured', contacts_topic='feet', use_sim_time=True)
    system.spin_for_frames(50)
    system.pause(True)
    system.wait_for_status('brain: frames', 0, 'the body is paused')
    sim.kill()
    system.wait_for_status('brain: frames', 2, 'no sensor frames')
