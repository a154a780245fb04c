"""Parameters while nodes run: applied whole, or refused with when they can be set."""

import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python


def put(system, node, name, value):
    request = SetParameters.Request(parameters=[
        RosParameter(name, value=value).to_parameter_msg()])
    result = system.call(SetParameters, f'{node}/set_parameters', request).results[0]
    return result.successful, result.reason


def get(system, node, name):
    values = system.call(GetParameters, f'{node}/get_parameters',
                         GetParameters.Request(names=[name])).values
    return parameter_value_to_python(values[0])


@pytest.mark.parametrize(('name', 'value'), [
    ('joint_states_topic', ''), ('joint_states_topic', 'a//b'), ('joint_states_topic', 'other'),
    ('body_status_topic', 'not a topic'), ('command_topic', 'words'), ('claim_wait', 2.0)])
def test_what_a_brain_reads_when_activated_is_refused_while_it_is_active(walking, name, value):
    before = get(walking, 'brain', name)
    taken, reason = put(walking, 'brain', name, value)
    assert not taken
    assert f'{name}: can be set in the states unconfigured and inactive' in reason
    assert 'the node is active: deactivate it first (ros2 lifecycle set /brain deactivate)' in \
        reason
    assert get(walking, 'brain', name) == before
    walking.pause(False)
    walking.spin_for_frames(10)


@pytest.mark.parametrize(('name', 'value'), [
    ('controller', 'nonsense'), ('controller', 'physical_twin'), ('vocabulary', 'nonsense')])
def test_what_a_brain_loads_is_refused_while_it_is_configured(walking, name, value):
    taken, reason = put(walking, 'brain', name, value)
    assert not taken
    assert f'{name}: can be set in the state unconfigured' in reason
    assert 'cleanup' in reason
    assert walking.brain_state() == 'active'


def test_a_brain_that_is_inactive_takes_a_topic_that_is_one_and_uses_it(system):
    system.start('sim', '--ros-args', '-r', 'joint_states:=measured')
    system.start('brain')
    system.wait_for_brain()
    assert system.transition('deactivate')
    taken, reason = put(system, 'brain', 'joint_states_topic', 'a//b')
    assert not taken
    assert "joint_states_topic: expected the name of a topic, got 'a//b'" in reason
    assert put(system, 'brain', 'joint_states_topic', 'measured')[0]
    system.wait_for_no_brain()
    system.answers.clear()
    assert system.transition('activate')
    system.spin_for_frames(20)


def test_an_unconfigured_brain_checks_what_it_will_load(system):
    system.start('brain', autostart=False)
    for name, value, expected in (('controller', 'nonsense', 'quadruped'),
                                  ('vocabulary', '/no/such.bin', 'vocabulary install'),
                                  ('frame_timeout', float('nan'), 'frame_timeout'),
                                  ('frame_timeout', 0.0, 'frame_timeout')):
        taken, reason = put(system, 'brain', name, value)
        assert not taken, name
        assert expected in reason
    assert put(system, 'brain', 'controller', 'physical_twin')[0]
    assert system.transition('configure')
    system.wait(lambda: 'brain: frames' in system.statuses, 'a status')
    system.wait(lambda: system.statuses['brain: frames'].hardware_id == 'physical_twin',
                'the other controller')


def test_a_timeout_of_words_applies_to_the_word_that_is_followed(walking):
    walking.pause(False)
    assert walking.tell('forward')[0] == 0
    assert put(walking, 'brain', 'command_timeout', 0.5)[0]
    walking.wait_for_status('brain: command', 0, 'standing: the last word was said 0.5 s ago')
    assert put(walking, 'brain', 'command_timeout', 0)[0], 'a whole number will do'


def test_the_same_value_again_is_no_change_and_a_fixed_one_says_when_it_can_be_set(walking):
    assert put(walking, 'brain', 'joint_states_topic', 'joint_states')[0]
    assert put(walking, 'brain', 'controller', 'quadruped_serial')[0]
    for node, name, value in (('brain', 'autostart', False), ('sim', 'body', 'minimal')):
        taken, reason = put(walking, node, name, value)
        assert not taken
        assert f'{name}: read-only while the node runs: start it again with --ros-args -p' in reason
    taken, reason = put(walking, 'sim', 'real_time_factor', 2.0)
    assert not taken
    assert 'lockstep (0) and paced (above 0) cannot take turns: start the node again' in reason
    described = walking.call(DescribeParameters, 'brain/describe_parameters',
                             DescribeParameters.Request(names=['controller'])).descriptors[0]
    assert 'in the state unconfigured' in described.additional_constraints


def test_a_start_that_is_no_number_is_refused_while_the_sim_runs(walking):
    taken, reason = put(walking, 'sim', 'start_height', float('nan'))
    assert not taken
    assert 'start_height' in reason
    assert 'nan' in reason


@pytest.mark.parametrize(('executable', 'parameters', 'reason'), [
    ('sim', {'real_time_factor': '1e-12'}, 'expected 0 for lockstep or at least 0.01'),
    ('sim', {'real_time_factor': '.nan'}, 'real_time_factor'),
    ('sim', {'start_height': '.nan'}, 'start_height'),
    ('sim', {'seed': -7}, 'seed'),
    ('sim', {'diagnostics_topic': '"a//b"'}, 'diagnostics_topic: expected the name of a topic'),
    ('brain', {'frame_timeout': '.inf'}, 'frame_timeout'),
    ('brain', {'command_timeout': '.nan'}, 'command_timeout'),
    ('brain', {'controller': 'physical_twin', 'hearing_priority': 'forward, stop'},
     'expected stop and then'),
    ('brain', {'controller': 'quadruped_serial', 'hearing_strictness': 1.0},
     'controller with an ear'),
    ('brain', {'body_status_topic': '""'}, 'body_status_topic: expected the name of a topic'),
    ('hardware', {'imu_frame_id': '"/imu"', 'transport': 'emulated'}, 'imu_frame_id: expected')])
def test_what_makes_no_sense_at_the_start_ends_a_node_with_one_line(system, executable, parameters,
                                                                    reason):
    process = system.start(executable, **parameters)
    process.may_fail = True
    assert process.wait() == 1
    errors = [line for line in process.log.splitlines() if 'error' in line.lower()]
    assert len(errors) == 1, process.log
    assert reason in errors[0]


def test_what_the_hardware_loads_is_refused_while_it_runs(system):
    process = system.start('hardware', transport='emulated')
    system.wait(lambda: system.node.count_publishers('joint_states'), 'the node')
    for name, value in (('transport', '/dev/i2c-7'), ('use_magnetometer', True),
                        ('calibration', '/no/such.yaml'), ('imu', 'icm20948')):
        taken, reason = put(system, 'hardware', name, value)
        assert not taken, name
        assert f'{name}: can be set in the state unconfigured' in reason
    assert not put(system, 'hardware', 'auto_arm', True)[0]
    assert not put(system, 'hardware', 'imu_frame_id', 'a b')[0]
    assert put(system, 'hardware', 'imu_frame_id', 'dog1/imu_link')[0]
    assert process.exit_code is None
