"""A word walks the robot: brain and hardware node, unchanged, on emulated chips over DDS."""

import time

import numpy as np
import pytest

from tests.ros.hardware import STILL_US, HardwareSystem
from w2b_controller import controller_file
from w2b_controller.controller_file import Controller, Motor, TrainedWord, vector_sha256
from w2b_controller.network import Network
from w2b_controller.vocabulary import Vocabulary
from w2b_hw.joints import JOINTS, limit_rad

SHIPPED = 'physical_twin'
#: Words like `stop`; the first that the controller was not trained on is said.
SYNONYMS = ('halt', 'cease', 'pause', 'quit')


def stand_in():
    """
    Return a controller that goes round for `forward` and settles for `stop` and its like.

    Until a champion of this body ships: a random network that a search over seeds found. It was
    not trained on `halt`.
    """
    generator = np.random.default_rng(547)
    hidden, motors = generator.normal(0, 0.3, (5, 6)), generator.uniform(-1, 1, (12, 5))
    vocabulary = Vocabulary.load()
    words = tuple(TrainedWord(word, word, vector_sha256(vocabulary.vector(word)), None)
                  for word in ('forward', 'stop'))
    return Controller(
        body=SHIPPED, network=Network(hidden, motors, np.full(12, 0.3)), sensors=(),
        motors=tuple(Motor(joint, -limit_rad(joint), limit_rad(joint), 0.3) for joint in JOINTS),
        period_s=0.05, words=words, record={'made': 'by a test'})


@pytest.fixture(scope='session')
def controller(tmp_path_factory):
    """The file of the shipped champion, or of the stand-in while there is none."""
    if SHIPPED in controller_file.shipped_names():
        path = controller_file.resolve(SHIPPED)
    else:
        path = tmp_path_factory.mktemp('controller') / 'twin.json'
        controller_file.save(stand_in(), path)
    loaded = controller_file.load(path)
    assert [motor.joint for motor in loaded.motors] == list(JOINTS)
    return path


#: A robot that was told to stop is still by then, also on a busy machine.
COMES_TO_REST_S = 10.0


@pytest.fixture
def robot(system, tmp_path, controller):
    robot = HardwareSystem(system, tmp_path)
    robot.brain = system.start('brain', controller=controller)
    system.wait_for_brain()
    robot.arm()
    yield robot
    robot.close()


def test_forward_walks_stop_and_an_unheard_synonym_still(robot, controller):
    level, message, _ = robot.system.tell('forward')
    assert level == 0, message
    robot.spin(3.5)
    walking = robot.swing_us(2.5)
    assert np.count_nonzero(walking > 10 * STILL_US) >= 4, walking
    trained = [word.word for word in controller_file.load(controller).words]
    unheard = next(word for word in SYNONYMS if word not in trained)
    for word in ('stop', unheard):
        robot.system.tell('forward')
        robot.spin(1.0)
        robot.system.tell(word)
        # The network swings out: the robot has to come to rest, and soon.
        end_s = time.monotonic() + COMES_TO_REST_S
        robot.spin(1.5)
        while (still := robot.swing_us(1.5)).mean() >= 0.1 * walking.mean():
            assert time.monotonic() < end_s, (word, still, walking)
            robot.spin(0.5)
        print(f'{word}: mean swing {still.mean():.1f} us, walking {walking.mean():.1f} us')
    assert robot.state() == 'ACTIVE'


def test_the_brain_killed_holds_parks_and_relaxes_on_time(robot):
    robot.system.tell('forward')
    robot.spin(2.0)
    robot.brain.kill()
    killed_s = time.monotonic()
    robot.wait_until_off()
    history = robot.pin_history(killed_s - 0.2)
    times = np.array([since_s for since_s, _ in history]) - killed_s
    off_at_s = times[[not pins.any() for _, pins in history]][-1]
    moved = times[(times > 0.15) & (times < off_at_s)]
    # A servo may still be on its way to the last target for 150 ms after it; then it is held, for
    # no pulse changes, until 500 ms after that target, which came some frames before the kill.
    held = moved[(moved > 0.2) & (moved < 0.35)]
    assert held.size == 0, held
    parking = moved[moved >= 0.35]
    assert parking.size > 0
    assert parking[0] <= 0.7, parking
    assert off_at_s <= 0.7 + 2.0
    robot.wait_for_state('DISARMED')
    print(f'brain killed: parking began after {1e3 * parking[0]:.0f} ms, '
          f'all channels off after {1e3 * off_at_s:.0f} ms')
