"""Bodies stand still: creep below 1 mm in 5 s, with as few sweeps as that takes."""

from dataclasses import replace

import numpy as np
import pytest

from tests.w2b_sim.odd_bodies import bent
from training import __main__ as training
from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.engines import registry
from w2b_sim.engines.batched import BatchedEngine, standing
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import EARTH, PAPER


@pytest.fixture(scope='module')
def biped():
    said = []
    engine = BatchedEngine(bent(), EARTH, 'single', say=said.append)
    assert engine.sweeps[1] > engine.usual_sweeps[1]
    return engine, said


def test_a_body_on_bent_legs_gets_the_sweeps_that_it_stands_with(biped):
    engine, said = biped
    chosen = engine.sweeps[1]
    fewer = max(few for few in (engine.usual_sweeps[1], *standing.LADDER) if few < chosen)
    assert engine.standing_creep_m(chosen) < standing.STILL_M <= engine.standing_creep_m(fewer)
    assert f'bent: {chosen} sweeps' in said[-1]


def test_it_stands_where_pybullet_and_mujoco_leave_it(biped):
    """After 6 s; MuJoCo's soft floor gives way by 3 mm under the feet."""
    engine, _said = biped
    ends = []
    for name in registry.stepwise_names():
        simulation = registry.make_simulation(name, engine.body, EARTH)
        for _ in range(120):
            simulation.step(np.zeros(4))
        ends.append(simulation.observe().position_m)
        simulation.close()
    clock = engine._clock._replace(steps=121)
    np.testing.assert_allclose(engine._stand(clock), ends[0], atol=1.5e-3)
    np.testing.assert_allclose(ends[0], ends[1], atol=4e-3)


def test_the_twin_keeps_its_sweeps_and_stands():
    twin = bodies.get('physical_twin')
    for steps in (10, 50):
        engine = BatchedEngine(twin, EARTH, 'single', physics_steps=steps)
        assert engine.sweeps == engine.usual_sweeps
        assert engine.standing_creep_m(engine.sweeps[1]) < standing.STILL_M


@pytest.mark.parametrize('world', [PAPER, replace(EARTH, friction=None, slip_m_per_n_s=0.01)])
def test_where_friction_is_viscous_nothing_is_chosen(world):
    engine = BatchedEngine(bodies.get('minimal'), world, 'single', friction_law='coulomb')
    assert engine.sweeps == engine.usual_sweeps


def test_sweeps_that_are_given_are_kept(biped):
    assert BatchedEngine(biped[0].body, EARTH, 'single', sweeps=(0, 5)).sweeps == (0, 5)


def test_a_body_that_never_stands_still_gets_the_usual_sweeps():
    tried = []

    def creep_m(sweeps):
        tried.append(sweeps)
        return 0.3
    assert standing.enough_sweeps('a ball that rolls', 12, creep_m) == (12, 0.3)
    assert tried == [12, *standing.LADDER]


def test_an_evaluation_is_the_one_with_the_sweeps_that_were_chosen(biped):
    engine, _said = biped
    rng = np.random.default_rng(3)
    network = Network(rng.normal(size=(2, 5, 6)), rng.normal(size=(2, 4, 5)), np.ones(4))
    words = rng.normal(scale=0.17, size=(1, 300))
    short = replace(EARTH, steps=10)
    one, other, usual = (BatchedEngine(engine.body, short, 'single', sweeps=sweeps).evaluate(
        network, words, [Start()]).final_position_m
        for sweeps in (None, engine.sweeps, engine.usual_sweeps))
    np.testing.assert_array_equal(one, other)
    assert not np.array_equal(one, usual)


def test_the_command_tells_the_creep_and_the_cost(capsys):
    assert training.main(['standing', 'physical_twin', '--physics-steps', '10']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum('<- chosen' in line for line in lines) == 1
    rows = [line.split() for line in lines[2:]]
    assert [int(row[0]) for row in rows] == sorted({12, *standing.LADDER})
    times = [float(row[3].rstrip('x')) for row in rows]
    assert times[0] == 1.0
    assert times[-1] > 2.0


@pytest.mark.parametrize(('arguments', 'message'), [
    (['nobody'], "unknown body 'nobody'"),
    (['physical_twin', '--physics-steps', '0'], '--physics-steps: expected at least 1, got 0')])
def test_what_the_command_cannot_do_is_one_line(capsys, arguments, message):
    assert training.main(['standing', *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1
