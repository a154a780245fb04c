"""Invariants of every registered body: its description, its URDF, its behaviour in PyBullet."""

import numpy as np
import pybullet
import pytest
import yourdfpy

from w2b_core import bodies
from w2b_core.bodies.inertia import inertia, link_inertia
from w2b_core.bodies.model import Box, Capsule, Sphere
from w2b_core.bodies.urdf import to_urdf
from w2b_sim import print_urdf
from w2b_sim.engines.interface import Start
from w2b_sim.engines.pybullet_engine import PyBulletSimulation
from w2b_sim.rollout import sensor_values
from w2b_sim.worlds import WORLDS

every_body = pytest.mark.parametrize('body', [bodies.get(name) for name in bodies.names()],
                                     ids=bodies.names())


def test_an_unknown_body_is_refused_with_the_names_there_are():
    with pytest.raises(ValueError, match="unknown body 'dog': expected one of quadruped, "):
        bodies.get('dog')


@every_body
def test_a_description_is_a_tree_with_distinct_names(body):
    links = [link.name for link in body.links]
    joints = [joint.name for joint in body.joints]
    assert len(set(links)) == len(links)
    assert len(set(joints)) == len(joints)
    seen = {links[0]}
    for joint in body.joints:
        assert joint.parent in seen, f'{joint.name} stands before its parent link'
        assert joint.child not in seen, f'{joint.child} has two joints'
        seen.add(joint.child)
        assert joint.lower_rad <= 0 <= joint.upper_rad
        assert np.linalg.norm(joint.axis) == pytest.approx(1)
    assert seen == set(links)
    assert body.world in WORLDS


@every_body
def test_the_urdf_loads_in_an_independent_library_and_means_the_same(body, tmp_path):
    path = tmp_path / 'body.urdf'
    path.write_text(to_urdf(body))
    robot = yourdfpy.URDF.load(str(path), build_scene_graph=True)
    assert robot.validate()
    assert list(robot.actuated_joint_names) == [joint.name for joint in body.joints]
    assert set(robot.link_map) == {link.name for link in body.links}
    for link in body.links:
        inertial = robot.link_map[link.name].inertial
        assert inertial.mass == link.mass_kg
        np.testing.assert_allclose(inertial.inertia, link_inertia(link))
    for joint in body.joints:
        limit = robot.joint_map[joint.name].limit
        assert (limit.lower, limit.upper) == (joint.lower_rad, joint.upper_rad)
        assert limit.effort == joint.servo.max_torque_nm


@every_body
def test_the_urdf_command_prints_what_another_library_reads(body, capsys, tmp_path):
    assert print_urdf.main([body.name]) == 0
    path = tmp_path / 'body.urdf'
    path.write_text(capsys.readouterr().out)
    robot = yourdfpy.URDF.load(str(path), build_scene_graph=False)
    assert list(robot.actuated_joint_names) == [joint.name for joint in body.joints]
    fixed = {joint.child: joint.parent for joint in robot.robot.joints if joint.type == 'fixed'}
    assert fixed == {'imu_link': body.links[0].name}, 'the frames of imu/data and of odom'


def test_the_urdf_command_names_the_bodies_there_are(capsys):
    with pytest.raises(SystemExit) as ended:
        print_urdf.main(['elephant'])
    assert ended.value.code == 2
    assert 'quadruped' in capsys.readouterr().err


@every_body
@pytest.mark.parametrize('capsule_element', [False, True])
def test_the_urdf_loads_in_pybullet(body, tmp_path, capsule_element):
    path = tmp_path / 'body.urdf'
    path.write_text(to_urdf(body, capsule_element=capsule_element))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        robot = pybullet.loadURDF(str(path), physicsClientId=client)
        names = [pybullet.getJointInfo(robot, number, physicsClientId=client)[1].decode()
                 for number in range(pybullet.getNumJoints(robot, physicsClientId=client))]
        assert set(names) == {joint.name for joint in body.joints}
    finally:
        pybullet.disconnect(client)


@pytest.mark.parametrize(('shape', 'axis', 'expected'), [
    (Box((0.1, 0.2, 0.3)), 0, 2.0 * (0.04 + 0.09) / 12),
    (Sphere(0.5), 1, 0.4 * 2.0 * 0.25),
    (Capsule(0.0, 0.5, (0, 0, 1)), 2, 0.4 * 2.0 * 0.25),
    (Capsule(1000.0, 0.1, (1, 0, 0)), 1, 2.0 * 1000.0**2 / 12),
    (Capsule(1000.0, 0.1, (1, 0, 0)), 0, 2.0 * 0.1**2 / 2),
])
def test_moments_of_inertia(shape, axis, expected):
    assert inertia(shape, 2.0)[axis, axis] == pytest.approx(expected, rel=1e-3)


def test_capsules_of_the_study_have_the_moments_that_the_original_simulated():
    """A lying capsule's smallest moment is about another axis than its own: turned twice."""
    base = link_inertia(bodies.get('minimal').links[0])
    assert base[1, 1] < base[0, 0] == pytest.approx(base[2, 2])
    twin = bodies.get('physical_twin')
    femur = next(link for link in twin.links if link.name.endswith('femur'))
    along = np.asarray(femur.shape.axis)
    moments = np.linalg.eigvalsh(link_inertia(femur))
    assert along @ link_inertia(femur) @ along == pytest.approx(moments[0])


@every_body
def test_commands_at_random_keep_observations_finite_and_joints_in_their_limits(body):
    world = WORLDS[body.world]
    simulation = PyBulletSimulation(body, world)
    rng = np.random.default_rng(5)
    lower = np.array([joint.lower_rad for joint in body.joints])
    upper = np.array([joint.upper_rad for joint in body.joints])
    try:
        for _ in range(60):
            frame = simulation.observe()
            values = sensor_values(body, frame, np.zeros(len(body.joints)))
            assert values.shape == (len(body.sensors),)
            for part in (values, frame.joint_position_rad, frame.joint_velocity_rad_s,
                         frame.position_m, frame.orientation_xyzw, frame.velocity_m_s):
                assert np.isfinite(part).all()
            assert (frame.joint_position_rad >= lower - 0.06).all()
            assert (frame.joint_position_rad <= upper + 0.06).all()
            simulation.step(rng.uniform(lower, upper))
    finally:
        simulation.close()


@every_body
def test_a_body_whose_joints_are_held_stays_where_it_is(body):
    simulation = PyBulletSimulation(body, WORLDS[body.world])
    middle = np.array([(joint.lower_rad + joint.upper_rad) / 2 for joint in body.joints])
    try:
        if body.name == 'minimal':  # it starts on one foot and falls over first
            for _ in range(400):
                simulation.step(middle)
        start = simulation.observe().position_m
        for _ in range(100):
            simulation.step(middle)
        moved = np.linalg.norm((simulation.observe().position_m - start)[:2])
        # A sphere starts with its bob aside and swings: by half a turn at the most.
        bound_m = np.pi * 0.1 if body.name.startswith('spherical') else 0.05 * body.length_m
        assert moved < bound_m
    finally:
        simulation.close()


MIRRORS = {'front': 'front', 'back': 'back', 'left': 'right', 'right': 'left',
           'front_left': 'front_right', 'front_right': 'front_left',
           'back_left': 'back_right', 'back_right': 'back_left'}


@pytest.mark.parametrize('name', ['quadruped', 'physical_twin'])
def test_a_mirrored_command_gives_a_mirrored_path(name):
    """Left and right swapped: y changes its sign. For a short while: contact is chaotic."""
    body = bodies.get(name)
    joints = [joint.name for joint in body.joints]
    rng = np.random.default_rng(11)
    targets = np.array([rng.uniform(joint.lower_rad, joint.upper_rad) * 0.5
                        for joint in body.joints])
    mirrored = np.empty_like(targets)
    for index, joint in enumerate(joints):
        leg, part = joint.rsplit('_', 1)
        # A hip that turns about the vertical turns the other way in a mirror.
        sign = -1 if name == 'physical_twin' and part == 'hip' else 1
        mirrored[joints.index(f'{MIRRORS[leg]}_{part}')] = sign * targets[index]
    ends = []
    for commands in (targets, mirrored):
        simulation = PyBulletSimulation(body, WORLDS[body.world])
        for _ in range(20):
            simulation.step(commands)
        ends.append(simulation.observe().position_m)
        simulation.close()
    np.testing.assert_allclose(ends[0] * [1, -1, 1], ends[1], atol=2e-3)
    assert np.linalg.norm(ends[0] - [0, 0, body.height_m]) > 1e-3


def test_a_start_raises_and_tilts_the_body():
    body = bodies.get('quadruped')
    simulation = PyBulletSimulation(body, WORLDS['paper'], Start(0.03, roll_rad=0.1))
    frame = simulation.observe()
    assert frame.position_m[2] == pytest.approx(0.15)
    assert frame.orientation_xyzw[0] == pytest.approx(np.sin(0.05))
    assert not any(frame.touching.values())
    simulation.reset()
    assert all(simulation.observe().touching.values())
    simulation.close()
