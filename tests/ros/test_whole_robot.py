"""Words move a simulated body through brain, DDS, hardware node, wire and chips, and back."""

import signal
from pathlib import Path

import numpy as np
import pytest

from tests.ros.whole_robot import WholeRobot
from training.judge.command import judge
from training.judge.conditions import Conditions
from training.judge.trial import Plan
from w2b_core.controller import file as controller_file

#: A synonym of *stop* that the ear was not taught.
UNHEARD = 'halt'
SPEED_SHARE, HEADING_DEG = 0.15, 10.0
FORWARD_S = 20.0
STANDING_WITHIN_S = 0.5


@pytest.fixture(scope='module')
def legs():
    """The champion that ships: legs with an ear, which feel their heading."""
    return controller_file.load(controller_file.shipped('physical_twin'))


@pytest.fixture
def robot(system, tmp_path, legs):
    path = tmp_path / 'legs.json'
    controller_file.save(legs, path)
    robot = WholeRobot(system, tmp_path, path)
    robot.arm()
    # The filter learns the gyroscope's bias while it stands.
    robot.go_on(6.0)
    yield robot
    robot.close()


@pytest.mark.timeout(600)
def test_words_walk_turn_still_and_lower_it_as_the_judge_says(robot, legs):
    way = robot.follow('forward', FORWARD_S)
    print('forward', way)
    expected = judge(legs, Plan('mujoco', FORWARD_S, 0.0, Conditions(imu_noise=True)), 1)
    forward = expected['behaviours']['forward']
    assert way.along_m / way.seconds == pytest.approx(
        forward['along_m'] / FORWARD_S, rel=SPEED_SHARE)
    assert abs(way.turned_deg) < forward['heading_error_deg'] + HEADING_DEG
    for word in ('stop', UNHEARD):
        robot.follow('forward', 1.0)
        robot.follow(word, 2.0)
        still = robot.follow(word, 3.0)
        print(word, still)
        assert still.away_m < 0.01
        assert still.swing_rad.max() < 0.03
    turned = robot.follow('left', 6.0)
    print('left', turned)
    assert turned.turned_deg > 45
    assert turned.away_m < 0.12
    standing_m = robot.height_m()
    robot.follow('sit', 3.0)
    assert robot.height_m() < 0.6 * standing_m


def test_an_unplugged_imu_ends_with_the_robot_standing_and_an_error(robot):
    robot.follow('forward', 2.0)
    robot.chips.request({'imu': False})
    unplugged_s = robot.chips.outputs()[-1].since_s
    robot.system.wait_for_status('hardware: imu', 2)

    def at_park_pose():
        return [output.since_s for output in robot.chips.outputs() if output.since_s > unplugged_s
                and np.abs(np.array(output.pulses_us[:12]) - 1500.0).max() < 10.0]
    parked_s = robot.system.wait(at_park_pose, 'the park pose')[0] - unplugged_s
    print(f'unplugged: all servos at the park pose after {parked_s:.2f} s')
    assert parked_s <= STANDING_WITHIN_S
    assert robot.go_on(1.0).away_m < 0.03


def test_simulated_is_one_parameter_and_leaves_no_process_behind(system, tmp_path):
    hardware = system.start('hardware', transport='simulated')
    system.wait_for_status('hardware: safety', 0, 'not armed yet')
    children = [int(path.parent.name) for path in Path('/proc').glob('[0-9]*/cmdline')
                if b'w2b_hw.emulation.server' in path.read_bytes()
                and str(hardware.pid).encode() in parents(int(path.parent.name))]
    assert len(children) == 1
    hardware.send(signal.SIGKILL)
    hardware.killed = True
    system.wait(lambda: not Path(f'/proc/{children[0]}').exists(), 'the end of the chips')


def parents(process: int) -> list[bytes]:
    """Return the process ids above one, as bytes."""
    found = []
    while process > 1:
        status = Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()
        process = int(status[1])
        found.append(str(process).encode())
    return found
