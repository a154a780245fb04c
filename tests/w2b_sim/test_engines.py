"""Every registered body in every step-wise engine: the laws that no engine may break."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.w2b_sim.odd_bodies import TENSOR, skew
from w2b_core import bodies
from w2b_core.bodies.model import Servo
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Start
from w2b_sim.engines.registry import EngineError
from w2b_sim.worlds import EARTH, PAPER, WORLDS

ENGINES = registry.stepwise_names()
every_engine = pytest.mark.parametrize('engine', ENGINES)
every_body = pytest.mark.parametrize('name', bodies.names())
TWIN = bodies.get('physical_twin')


@pytest.fixture
def make():
    made = []

    def make_simulation(engine, body, world=None, start=None):
        body = bodies.get(body) if isinstance(body, str) else body
        made.append(registry.make_simulation(engine, body, world or WORLDS[body.world], start))
        return made[-1]
    yield make_simulation
    for simulation in made:
        simulation.close()


def middle(body):
    return np.array([(joint.lower_rad + joint.upper_rad) / 2 for joint in body.joints])


def test_both_engines_are_registered():
    assert ENGINES == ('pybullet', 'mujoco')
    assert registry.DEFAULT == 'pybullet'


@every_engine
@every_body
@pytest.mark.parametrize('world', [PAPER, EARTH], ids=['paper', 'earth'])
def test_a_body_in_the_air_falls_at_g_and_feels_nothing(make, engine, name, world):
    body = bodies.get(name)
    simulation = make(engine, body, world, Start(height_m=5.0))
    steps = 10
    for _ in range(steps):
        simulation.step(middle(body))
    frame, fallen_s = simulation.observe(), steps * world.control_period_s
    heights = 5.0 + body.height_m - frame.position_m[2]
    # A pendulum inside a sphere swings as if it were weightless: it does not disturb the fall.
    assert heights == pytest.approx(-world.gravity_m_s2 * fallen_s**2 / 2, rel=0.06)
    assert frame.velocity_m_s[2] == pytest.approx(world.gravity_m_s2 * fallen_s, rel=0.01)
    np.testing.assert_allclose(frame.imu.specific_force_m_s2, 0, atol=0.02 * abs(
        world.gravity_m_s2))


@every_engine
def test_the_gyroscope_feels_the_whole_turn_of_each_control_period(make, engine):
    """What it says of every period, put together, leads from the first attitude to the last."""
    simulation = make(engine, TWIN)
    turn, turned = Rotation.from_quat(simulation.observe().orientation_xyzw), []
    for number in range(40):
        targets = middle(TWIN)
        targets[::3] += 0.4 * np.sin(number * np.array([1.9, 2.5, 1.4, 2.9]))
        simulation.step(targets)
        rate = simulation.observe().imu.angular_velocity_rad_s
        turn = turn * Rotation.from_rotvec(rate * EARTH.control_period_s)
        turned.append(np.abs(rate).max())
    there = Rotation.from_quat(simulation.observe().orientation_xyzw)
    assert max(turned) > 0.5
    assert (there * turn.inv()).magnitude() < 1e-4


@every_engine
@every_body
def test_a_body_whose_joints_are_held_stays_and_feels_its_weight(make, engine, name):
    body = bodies.get(name)
    simulation = make(engine, name)
    for _ in range(400 if name == 'minimal' else 20):
        # The minimal robot starts on one foot and falls over first.
        simulation.step(middle(body))
    start = simulation.observe()
    for _ in range(100):
        simulation.step(middle(body))
    frame = simulation.observe()
    # A sphere starts with its bob aside and swings: by half a turn at the most.
    swings = name.startswith('spherical')
    bound_m = np.pi * 0.1 if swings else 0.05 * body.length_m
    assert np.linalg.norm((frame.position_m - start.position_m)[:2]) < bound_m
    assert abs(frame.position_m[2] - start.position_m[2]) < 1e-3
    if not swings:
        gravity = -WORLDS[body.world].gravity_m_s2
        assert np.linalg.norm(frame.imu.specific_force_m_s2) == pytest.approx(gravity, rel=0.01)
        np.testing.assert_allclose(frame.imu.angular_velocity_rad_s, 0, atol=0.02)


@every_engine
@every_body
def test_commands_at_random_keep_observations_finite_and_joints_in_their_limits(
        make, engine, name):
    body = bodies.get(name)
    simulation = make(engine, name)
    rng = np.random.default_rng(5)
    lower = np.array([joint.lower_rad for joint in body.joints])
    upper = np.array([joint.upper_rad for joint in body.joints])
    # Where PyBullet divides its steps, in `paper`, it allows the whole torque's impulse in each.
    divided = 4 if engine == 'pybullet' and body.world == 'paper' else 1
    strongest = divided * np.array([joint.servo.max_torque_nm for joint in body.joints])
    for _ in range(60):
        simulation.step(rng.uniform(lower, upper))
        frame = simulation.observe()
        for part in (frame.joint_position_rad, frame.joint_velocity_rad_s, frame.position_m,
                     frame.orientation_xyzw, frame.velocity_m_s, frame.angular_velocity_rad_s,
                     frame.imu.specific_force_m_s2, frame.imu.angular_velocity_rad_s):
            assert np.isfinite(part).all()
        assert (frame.joint_position_rad >= lower - 0.06).all()
        assert (frame.joint_position_rad <= upper + 0.06).all()
        assert (frame.joint_torque_nm <= strongest * 1.001).all()
        assert np.linalg.norm(frame.orientation_xyzw) == pytest.approx(1)


@every_engine
@every_body
def test_a_reset_repeats_a_run_to_the_bit(make, engine, name):
    body = bodies.get(name)
    simulation = make(engine, name)
    rng = np.random.default_rng(2)
    commands = rng.uniform(-0.3, 0.3, (15, len(body.joints)))
    ends = []
    for _ in range(2):
        simulation.reset(Start(0.001, roll_rad=0.01))
        for command in commands:
            simulation.step(command)
        ends.append(simulation.observe())
    np.testing.assert_array_equal(ends[0].position_m, ends[1].position_m)
    np.testing.assert_array_equal(ends[0].orientation_xyzw, ends[1].orientation_xyzw)
    np.testing.assert_array_equal(ends[0].imu.specific_force_m_s2, ends[1].imu.specific_force_m_s2)


@every_engine
def test_a_control_period_in_pieces_is_the_same_to_the_bit(make, engine):
    whole, pieces = make(engine, TWIN), make(engine, TWIN)
    target = np.full(12, 0.3)
    for _ in range(4):
        whole.step(target)
        for _ in range(5):
            pieces.advance(target, 10)
    np.testing.assert_array_equal(whole.observe().position_m, pieces.observe().position_m)
    np.testing.assert_array_equal(whole.observe().joint_position_rad,
                                  pieces.observe().joint_position_rad)


@every_engine
def test_servos_reach_their_speed_and_no_more(make, engine):
    """In the air, with nothing to carry: 5 rad/s of the twin, then slower as the target nears."""
    simulation = make(engine, TWIN, start=Start(height_m=2.0))
    simulation.advance(np.full(12, 0.5), 10)
    frame = simulation.observe()
    np.testing.assert_allclose(frame.joint_velocity_rad_s, 5.0, rtol=0.02)
    np.testing.assert_allclose(frame.joint_position_rad, 5.0 * 0.010, rtol=0.15)
    for _ in range(8):
        simulation.step(np.full(12, 0.5))
    np.testing.assert_allclose(simulation.observe().joint_position_rad, 0.5, atol=2e-3)


@every_engine
def test_a_servo_that_is_too_weak_gives_way(make, engine):
    def lowered_m(torque_nm):
        weak = replace(TWIN, joints=tuple(
            replace(joint, servo=replace(joint.servo, max_torque_nm=torque_nm))
            for joint in TWIN.joints))
        simulation = make(engine, weak)
        for _ in range(40):
            simulation.step(np.full(12, 0.0))
        frame = simulation.observe()
        assert (frame.joint_torque_nm <= torque_nm * 1.001).all()
        return TWIN.height_m - frame.position_m[2]
    assert lowered_m(0.18) < 0.003
    assert lowered_m(0.01) > 0.03


@every_engine
def test_torque_is_what_holds_a_lever(make, engine):
    """The arm of 50 g at 50 mm from its joint, level: 0.0245 N m."""
    simulation = make(engine, skew())
    for _ in range(20):
        simulation.step(np.zeros(1))
    assert simulation.observe().joint_torque_nm[0] == pytest.approx(0.05 * 9.81 * 0.05, rel=0.03)


def paths(make, body, world, commands, start=None):
    logs = []
    for engine in ENGINES:
        simulation = make(engine, body, world, start)
        log = []
        for command in commands:
            simulation.step(command)
            frame = simulation.observe()
            log.append(np.concatenate([frame.position_m, frame.joint_position_rad]))
        logs.append(np.array(log))
    return logs


@every_body
def test_the_engines_agree_on_a_slow_motion(make, name):
    """Slow commands: contact is chaotic under quick ones."""
    body = bodies.get(name)
    rng = np.random.default_rng(3)
    swing = rng.uniform(-0.25, 0.25, len(body.joints))
    phase = rng.uniform(0, 2 * np.pi, len(body.joints))
    times_s = np.arange(60)[:, None] * 0.05
    commands = np.minimum(1, 2 * times_s) * swing * np.sin(2 * np.pi * 0.4 * times_s + phase)
    first, second = paths(make, body, None, commands)
    np.testing.assert_allclose(first[:, 3:], second[:, 3:], atol=0.06)
    assert np.linalg.norm(first[:, :2] - second[:, :2], axis=1).max() < 0.18 * body.length_m
    assert np.abs(first[:, 2] - second[:, 2]).max() < 0.01
    free = [joint.lower_rad < joint.upper_rad for joint in body.joints]
    assert np.ptp(first[:, 3:], axis=0)[free].max() > 0.1


@every_engine
def test_a_skew_tensor_is_the_base_frames_not_the_principal_axes(make, engine):
    body = skew()
    assert np.linalg.norm(np.array(TENSOR)[0, 1:]) > 0
    simulation = make(engine, body, start=Start(yaw_rad=0.4))
    frame = simulation.observe()
    np.testing.assert_allclose(frame.position_m, [0, 0, body.height_m], atol=1e-6)
    np.testing.assert_allclose(frame.orientation_xyzw, [0, 0, np.sin(0.2), np.cos(0.2)], atol=1e-6)
    for _ in range(40):
        simulation.step(np.zeros(1))
    after = simulation.observe()
    assert abs(after.position_m[2] - body.height_m) < 1.5e-3
    np.testing.assert_allclose(after.orientation_xyzw, frame.orientation_xyzw, atol=0.01)
    np.testing.assert_allclose(after.imu.specific_force_m_s2, [0, 0, 9.81], atol=0.1)


def test_the_engines_agree_on_a_tumbling_skew_body(make):
    """In the air the arm swings the base; with wrong tensors or centres of mass they part."""
    turns = []
    for engine in ENGINES:
        simulation = make(engine, skew(), start=Start(height_m=3.0))
        turns.append([])
        for command in (0.7, 0.7, 0.7, 0.7, -0.7, -0.7, -0.7, -0.7, -0.7, 0.2, 0.2, 0.2):
            simulation.step(np.array([command]))
            turns[-1].append(simulation.observe().orientation_xyzw)
    np.testing.assert_allclose(turns[0], turns[1], atol=0.005)
    assert np.abs(turns[0])[:, :3].max(axis=0).min() > 0.01


def test_the_batched_engine_takes_such_a_body_and_lands_where_the_others_do():
    """The arm swings as a random network moves it; the board rocks on its feet."""
    from w2b_core.network import Network
    rng = np.random.default_rng(4)
    body, world = skew(), replace(EARTH, steps=40)
    network = Network(rng.normal(size=(3, 5, 6)), rng.normal(size=(3, 1, 5)), np.ones(1))
    signals = rng.normal(scale=0.2, size=(1, 300))
    ends = {}
    for engine in registry.names():
        evaluator = registry.make_evaluator(engine, body, world, precision='float64')
        ends[engine] = evaluator.evaluate(network, signals, [Start()]).final_position_m
    for engine in registry.stepwise_names():
        np.testing.assert_allclose(ends['batched'], ends[engine], atol=3e-3, err_msg=engine)


@every_engine
def test_a_start_raises_and_tilts_the_body(make, engine):
    simulation = make(engine, 'quadruped', start=Start(0.03, roll_rad=0.1))
    frame = simulation.observe()
    assert frame.position_m[2] == pytest.approx(0.15)
    assert frame.orientation_xyzw[0] == pytest.approx(np.sin(0.05))
    np.testing.assert_allclose(frame.imu.specific_force_m_s2, [0, np.sin(0.1), np.cos(0.1)])
    assert not any(frame.touching.values())
    simulation.reset()
    assert all(simulation.observe().touching.values())


def test_an_unknown_engine_is_refused_with_those_there_are():
    with pytest.raises(EngineError, match=r'expected one of pybullet, mujoco, got .ode.'):
        registry.make_simulation('ode', TWIN, EARTH)
    with pytest.raises(EngineError, match=r'expected one of pybullet, mujoco, got .batched.'):
        registry.make_simulation('batched', TWIN, EARTH)
    with pytest.raises(EngineError, match='expected one of batched, pybullet, mujoco'):
        registry.make_evaluator('ode', TWIN, EARTH)


@pytest.mark.parametrize(('missing', 'other'), [('mujoco', 'pybullet'), ('pybullet', 'mujoco')])
def test_a_missing_library_says_what_to_install_and_the_other_engine_works(missing, other):
    code = '\n'.join((
        f'import sys; sys.modules[{missing!r}] = None',
        'from w2b_core import bodies',
        'from w2b_sim.engines import registry',
        'from w2b_sim.worlds import PAPER',
        'body = bodies.get("minimal")',
        f'registry.make_simulation({other!r}, body, PAPER).step([0.0])',
        'try:',
        f'    registry.make_simulation({missing!r}, body, PAPER)',
        'except registry.EngineError as error:',
        '    print(error)'))
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          timeout=120, check=True)
    assert f'engine {missing}: the module {missing} is missing; install it with' in done.stdout
    assert f'pip install {missing}==' in done.stdout


def test_a_body_that_mujoco_does_not_take_is_refused_by_its_name():
    broken = replace(TWIN, name='broken', links=tuple(
        replace(link, mass_kg=-1.0) for link in TWIN.links))
    with pytest.raises(ValueError, match='broken: MuJoCo makes no model of it'):
        registry.make_simulation('mujoco', broken, EARTH)


def test_two_processes_of_mujoco_give_what_one_gives():
    rng = np.random.default_rng(0)
    from w2b_core.network import Network
    body, world = bodies.get('minimal'), replace(PAPER, steps=30)
    network = Network(rng.normal(size=(2, 5, 9)), rng.normal(size=(2, 1, 5)), np.ones(1))
    outcomes = []
    for processes in (1, 2):
        evaluator = registry.make_evaluator('mujoco', body, world, threads=processes)
        with evaluator:
            outcomes.append(evaluator.evaluate(network, rng.normal(size=(1, 300)) * 0 + 0.1,
                                               [Start(), Start(0.01)]).final_position_m)
    np.testing.assert_array_equal(*outcomes)
    assert np.isfinite(outcomes[0]).all()


def test_the_servo_law():
    from w2b_sim.engines.servo import Servos

    joint = replace(TWIN.joints[0], servo=Servo(10.0, 2.0, 3.0, 0.5))
    servos = Servos([joint] * 3)
    np.testing.assert_allclose(
        servos.speeds_rad_s(np.array([1.0, -1.0, 0.05]), np.zeros(3)), [2.0, -3.0, 0.5])
    np.testing.assert_array_equal(servos.max_torque_nm, 0.5)
