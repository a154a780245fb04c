"""Words walk the robot: sim and brain as processes, over real DDS."""

import numpy as np
import pytest

from tests.ros.offline import (
    CONTROLLER,
    JOINTS,
    STEPS,
    assert_repeats,
    offline_positions_m,
)
from w2b_controller.say import values_of


def distance_m(system, first_stamp, last_stamp):
    return float(np.linalg.norm(np.subtract(system.positions_m[last_stamp][:2],
                                            system.positions_m[first_stamp][:2])))


@pytest.mark.parametrize('command', ['forward', 'backward', 'halt'])
def test_a_run_in_lockstep_repeats_the_offline_evaluation(walking, command):
    first = walking.reset()
    said = walking.say(command)
    assert said.exit_code == 0
    walking.pause(False)
    assert_repeats(walking, first, command)


def test_a_second_run_of_the_same_processes_repeats_it_too(walking):
    for command in ('stop', 'forward stop'):
        walking.pause(True)
        first = walking.reset()
        assert walking.say(*command.split()).exit_code == 0
        walking.pause(False)
        assert_repeats(walking, first, command)


def test_moves_go_their_way_and_stops_stay():
    """What the runs above repeat is what the words mean."""
    assert offline_positions_m('forward')[-1, 0] > 0.3
    assert offline_positions_m('backward')[-1, 0] < -0.3
    assert np.linalg.norm(offline_positions_m('halt')[-1, :2]) < 0.1


def test_it_stands_before_any_command(walking):
    walking.pause(False)
    walking.spin_for_frames(100)
    stamps = sorted(walking.positions_m)
    assert distance_m(walking, stamps[0], stamps[-1]) < 1e-3
    assert all(targets == dict.fromkeys(JOINTS, 0.0) for targets in walking.targets_rad.values())
    walking.wait_for_status('brain: command', 0, 'standing')


def test_a_new_word_in_mid_motion_takes_over(walking):
    walking.pause(False)
    assert walking.say('forward').exit_code == 0
    walking.spin_for_frames(STEPS)
    stamps = sorted(walking.positions_m)
    assert distance_m(walking, stamps[0], stamps[-1]) > 0.2
    assert walking.say('stop').exit_code == 0
    walking.wait_for_status('brain: command', 0, "following 'stop'")
    walking.spin_for_frames(50)
    settled = max(walking.positions_m)
    walking.spin_for_frames(STEPS)
    assert distance_m(walking, settled, max(walking.positions_m)) < 0.1


def test_targets_carry_the_stamp_of_their_frame_and_names(walking):
    walking.say('forward')
    walking.pause(False)
    walking.spin_for_frames(20)
    walking.pause(True)
    walking.wait(lambda: max(walking.positions_m) in walking.targets_rad, 'the last answer')
    assert set(walking.positions_m) == set(walking.targets_rad)
    assert all(list(targets) == JOINTS for targets in walking.targets_rad.values())
    motors = {motor.joint: motor for motor in CONTROLLER.motors}
    for targets in walking.targets_rad.values():
        for joint, target in targets.items():
            assert motors[joint].lower_rad <= target <= motors[joint].upper_rad


def test_the_answer_waits_for_a_late_listener(walking):
    assert walking.say('halt').exit_code == 0
    level, message, values = walking.last_answer()
    assert level == 0
    assert 'halt' in message
    assert 'never heard in training' in message
    assert values['received'] == '1'
    assert values['words'] == 'halt'
    assert 'stop' in values['nearest']
    late = []
    from diagnostic_msgs.msg import DiagnosticStatus

    from tests.ros.harness import LATCHED
    walking.node.create_subscription(DiagnosticStatus, 'command_answer', late.append, LATCHED)
    walking.wait(lambda: late, 'the latched answer')
    assert values_of(late[-1]) == values
