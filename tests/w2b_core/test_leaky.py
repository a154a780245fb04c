"""The leaky network: its equations, its checks, and weights that share a body's symmetry."""

from dataclasses import replace
from math import tanh

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.behaviours import DEFAULT_BEHAVIOURS
from w2b_core.network.leaky import BLOCKS, Drive, LeakyNetwork, LeakyState, step
from w2b_core.network.sharing import Sharing, mirrored_hidden
from w2b_core.network.symmetry import (
    NotSymmetricError,
    find_mirror,
    find_mirrors,
    limbs_of,
)

SENSES = ('heading', 'steer', 'yaw_rate', 'gravity:x', 'gravity:y')


def sharing_of(name, senses=SENSES, **options):
    body = bodies.get(name)
    return Sharing(body, DEFAULT_BEHAVIOURS, senses, find_mirrors(body), **options)


def random_leaky(seed=0, hidden=3, behaviours=2, senses=1, motors=2, batch=()):
    rng = np.random.default_rng(seed)
    sizes = {'H': hidden, 'K': behaviours, 'S': senses, 'M': motors}
    arrays = {block.name: rng.normal(size=(*batch, *(sizes[axis] for axis in block.shape)))
              for block in BLOCKS}
    for name in ('hidden_leak', 'motor_leak'):
        arrays[name] = rng.uniform(0.1, 1.0, arrays[name].shape)
    arrays['rest'] = np.clip(arrays['rest'], -1, 1)
    return LeakyNetwork(**arrays)


def test_one_step_is_the_equations():
    network = LeakyNetwork(hidden=[[0.5]], command=[[2.0, 0.0]], senses=[[0.3]], hidden_leak=[0.4],
                           rest=[0.1], motor=[[1.5]], motor_command=[[0.0, 0.7]],
                           motor_senses=[[-0.2]], motor_leak=[0.25])
    drive = network.drive([1.0, 0.5])
    state = step(network, network.initial_state(), drive, [0.9])
    assert state.hidden[0] == pytest.approx(0.1 + 0.4 * (tanh(0.05 + 2.0 + 0.27) - 0.1))
    assert state.motors[0] == pytest.approx(0.25 * tanh(0.15 + 0.35 - 0.18))


def test_a_batch_steps_as_its_members():
    batch = random_leaky(batch=(4,))
    rng = np.random.default_rng(1)
    hidden, motors, senses = (rng.normal(size=(4, count)) for count in (3, 2, 1))
    whole = step(batch, LeakyState(hidden, motors), batch.drive(np.ones((4, 2))), senses)
    for i in range(4):
        one = LeakyNetwork(**{block.name: getattr(batch, block.name)[i] for block in BLOCKS})
        alone = step(one, LeakyState(hidden[i], motors[i]), one.drive([1.0, 1.0]), senses[i])
        np.testing.assert_array_equal(whole.hidden[i], alone.hidden)
        np.testing.assert_array_equal(whole.motors[i], alone.motors)


@pytest.mark.parametrize(('name', 'value'), [
    ('hidden', np.zeros((3, 2))), ('command', np.full((3, 2), np.nan)),
    ('senses', np.zeros((2, 1))),
    ('hidden_leak', np.zeros(3)), ('motor_leak', np.full(2, 1.1)), ('motor', np.full((2, 3), 21.0)),
    ('rest', np.full(3, 1.5)), ('motor_senses', np.zeros((2, 3)))])
def test_what_does_not_fit_is_refused_by_name(name, value):
    arrays = {block.name: getattr(random_leaky(), block.name) for block in BLOCKS}
    with pytest.raises(ValueError, match=f'^{name}'):
        LeakyNetwork(**{**arrays, name: value})


def test_a_command_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match='command'):
        random_leaky().drive([np.nan, 0.0])


def test_limbs_are_the_branches_of_the_base():
    twin = bodies.get('physical_twin')
    first, *others = limbs_of(twin)
    assert [twin.joints[j].name for j in first] == [
        'front_left_hip', 'front_left_knee', 'front_left_ankle']
    assert len(others) == 3


@pytest.mark.parametrize(('name', 'expected'), [
    ('physical_twin', ('left_right', 'fore_aft')), ('quadruped', ('left_right', 'fore_aft'))])
def test_the_mirrors_of_the_walkers_are_found(name, expected):
    assert tuple(mirror.name for mirror in find_mirrors(bodies.get(name))) == expected


def test_the_twins_mirror_swaps_left_and_right_and_turns_hips_the_other_way():
    twin = bodies.get('physical_twin')
    mirror = find_mirror(twin, 'left_right')
    names = [joint.name for joint in twin.joints]
    for number, name in enumerate(names):
        image = names[mirror.joints.place[number]]
        assert image == name.replace('left', 'RIGHT').replace('right', 'left').replace(
            'RIGHT', 'right')
        assert mirror.joints.sign[number] == (-1.0 if 'hip' in name else 1.0)


def changed(body, link=None, joint=None, **values):
    links = tuple(replace(one, **values) if one.name == link else one for one in body.links)
    joints = tuple(replace(one, **values) if one.name == joint else one for one in body.joints)
    return replace(body, links=links, joints=joints)


@pytest.mark.parametrize(('part', 'values'), [
    ({'link': 'front_left_tibia'}, {'mass_kg': 0.1}),
    ({'joint': 'front_left_hip'}, {'lower_rad': -0.1}),
    ({'joint': 'front_left_hip'}, {'origin_m': (0.06, 0.07, 0.0)}),
    ({'joint': 'front_left_knee'}, {'axis': (0.0, 0.0, 1.0)})])
def test_a_body_that_is_not_symmetric_is_refused_with_the_part(part, values):
    body = changed(bodies.get('physical_twin'), **part, **values)
    with pytest.raises(NotSymmetricError, match=r'front_(left|right)'):
        find_mirror(body, 'left_right')
    assert find_mirrors(body) == ()


def test_a_lighter_leg_within_the_randomised_masses_is_still_a_mirror():
    body = changed(bodies.get('physical_twin'), link='front_left_tibia', mass_kg=0.0135)
    assert len(find_mirrors(body)) == 2


def test_legs_that_mirror_each_other_as_drawings_do_are_a_mirror_farther_off_they_are_not():
    twin = bodies.get('physical_twin')
    origin = np.asarray(twin.joint('front_left_knee').origin_m)
    for off, mirrors in ((0.005, 2), (0.03, 0)):
        moved = tuple(map(float, origin + np.array([0, off * twin.length_m, 0])))
        assert len(find_mirrors(changed(twin, joint='front_left_knee', origin_m=moved))) == mirrors


def test_a_base_whose_centre_of_mass_is_beside_the_middle_still_mirrors_left_and_right():
    twin = bodies.get('physical_twin')
    off = 0.03 * twin.length_m
    aside = replace(twin, joints=tuple(
        replace(joint, origin_m=(joint.origin_m[0], joint.origin_m[1] - off, joint.origin_m[2]))
        if joint.parent == twin.links[0].name else joint for joint in twin.joints))
    assert 'left_right' in [mirror.name for mirror in find_mirrors(aside)]


def test_a_behaviour_without_its_mirror_image_is_refused():
    twin = bodies.get('physical_twin')
    with pytest.raises(NotSymmetricError, match="'left'"):
        Sharing(twin, ('stop', 'left'), (), find_mirrors(twin))


@pytest.mark.parametrize('name', ['physical_twin', 'quadruped'])
def test_the_network_of_any_genome_commutes_with_the_bodys_mirrors(name):
    """A mirrored state, command and sense give the mirrored next state: to the last bit or so."""
    body = bodies.get(name)
    joints = tuple(f'position:{joint.name}' for joint in body.joints)
    senses = (*SENSES, *body.sensors, *joints)
    sharing = Sharing(body, DEFAULT_BEHAVIOURS, senses, find_mirrors(body), direct=True)
    rng = np.random.default_rng(3)
    network = sharing.network(rng.normal(size=sharing.size))
    hidden, motors = rng.normal(size=sharing.hidden.count), rng.normal(size=len(body.joints))
    u, s = rng.uniform(size=len(DEFAULT_BEHAVIOURS)), rng.normal(size=len(senses))
    after = step(network, LeakyState(hidden, motors), network.drive(u), s)
    for mirror in find_mirrors(body):
        of_hidden = mirrored_hidden(mirror, sharing.hidden)
        image = step(network, LeakyState(of_hidden.apply(hidden), mirror.joints.apply(motors)),
                     network.drive(mirror.behaviours(DEFAULT_BEHAVIOURS).apply(u)),
                     mirror.senses(senses, body).apply(s))
        np.testing.assert_allclose(image.hidden, of_hidden.apply(after.hidden), atol=1e-12)
        np.testing.assert_allclose(image.motors, mirror.joints.apply(after.motors), atol=1e-12)


def test_symmetry_leaves_the_twin_a_quarter_of_the_numbers():
    twin = bodies.get('physical_twin')
    free = Sharing(twin, DEFAULT_BEHAVIOURS, SENSES, (), direct=True)
    shared = Sharing(twin, DEFAULT_BEHAVIOURS, SENSES, find_mirrors(twin), direct=True)
    assert free.size == sum(np.prod([free.sizes[axis] for axis in block.shape])
                            for block in BLOCKS if block.name != 'rest')
    assert 0.2 * free.size < shared.size < 0.3 * free.size


def test_put_sets_an_entry_and_its_images_and_refuses_a_forced_zero():
    sharing = sharing_of('physical_twin')
    genome = np.zeros(sharing.size)
    sharing.put(genome, 'motor', 0, sharing.hidden.of(0, 0), 0.7)
    motor = sharing.network(genome).motor
    assert motor[0, sharing.hidden.of(0, 0)] == 0.7
    assert np.count_nonzero(motor) == 4
    assert sorted(motor[motor != 0].tolist()) == [-0.7, -0.7, 0.7, 0.7]
    with pytest.raises(ValueError, match='forces'):
        sharing.put(genome, 'command', 0, DEFAULT_BEHAVIOURS.index('stop'), 1.0)


def test_a_rest_state_and_zero_drive_stand_for_nothing_said():
    network = sharing_of('physical_twin').network(np.zeros(sharing_of('physical_twin').size))
    state = network.initial_state()
    assert (state.motors == 0).all()
    still = step(network, state, Drive(np.zeros_like(state.hidden), np.zeros(12)), np.zeros(5))
    assert (still.motors == 0).all()
