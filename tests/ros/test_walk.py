"""Words walk the robot: sim and brain as processes, over real DDS."""

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from tests.ros.harness import LATCHED
from tests.ros.offline import (
    CONTROLLER,
    JOINTS,
    assert_repeats,
    offline_positions_m,
)
from w2b_controller.say import values_of

PERIOD_NS = 50_000_000


def distance_m(system, first_stamp, last_stamp):
    return float(np.linalg.norm(np.subtract(system.positions_m[last_stamp][:2],
                                            system.positions_m[first_stamp][:2])))


def test_a_run_in_lockstep_repeats_the_offline_evaluation(walking):
    """All 500 frames of an evaluation, and the robot really goes somewhere."""
    first = walking.reset()
    assert walking.say('--understood', 'forward').exit_code == 0
    walking.pause(False)
    assert_repeats(walking, first, 'forward')
    assert offline_positions_m('forward')[-1, 0] > 0.3


@pytest.mark.parametrize('command', ['halt', 'backward', 'forward stop'])
def test_so_does_every_later_run_of_the_same_processes(walking, command):
    first = walking.reset()
    assert walking.tell(command)[0] == 0
    walking.pause(False)
    assert_repeats(walking, first, command, steps=150)


def test_it_stands_before_any_command(walking):
    walking.pause(False)
    walking.spin_for_frames(60)
    stamps = sorted(walking.positions_m)[:60]
    assert distance_m(walking, stamps[0], stamps[-1]) < 1e-3
    assert all(targets == dict.fromkeys(JOINTS, 0.0) for targets in walking.targets_rad.values())
    walking.wait_for_status('brain: command', 0, 'standing')


def test_a_new_word_in_mid_motion_takes_over(walking):
    walking.tell('forward')
    walking.pause(False)
    walking.spin_for_frames(200)
    stamps = sorted(walking.positions_m)
    walked = distance_m(walking, stamps[0], stamps[-1])
    assert walked > 0.1
    walking.tell('stop')
    heard = max(walking.positions_m)
    walking.wait_for_status('brain: command', 0, "following 'stop'")
    walking.wait(lambda: heard + 300 * PERIOD_NS in walking.positions_m, '300 frames')
    late = distance_m(walking, heard + 100 * PERIOD_NS, heard + 300 * PERIOD_NS)
    assert late < walked / 3


def test_targets_carry_the_stamp_of_their_frame_and_names(walking):
    walking.tell('forward')
    walking.pause(False)
    walking.spin_for_frames(20)
    walking.pause(True)
    walking.wait(lambda: set(walking.positions_m) == set(walking.targets_rad), 'the last answer')
    assert all(list(targets) == JOINTS for targets in walking.targets_rad.values())
    motors = {motor.joint: motor for motor in CONTROLLER.motors}
    for targets in walking.targets_rad.values():
        for joint, target in targets.items():
            assert motors[joint].lower_rad <= target <= motors[joint].upper_rad


def test_the_answer_waits_for_a_late_listener(walking):
    level, message, values = walking.tell('halt')
    assert level == 0
    assert 'halt' in message
    assert 'never heard in training' in message
    assert values['received'] == '1'
    assert values['words'] == 'halt'
    assert 'stop' in values['nearest']
    late = []
    walking.node.create_subscription(DiagnosticStatus, 'command_answer', late.append, LATCHED)
    walking.wait(lambda: late, 'the latched answer')
    assert values_of(late[-1]) == values
