"""The bench command: its JSON, with the smallest workload that has one."""

import argparse
import json

import numpy as np
import pytest

from training.measure import bench, bench_leaky
from w2b_core import bodies
from w2b_sim.worlds import WORLDS


def test_the_json_has_every_figure(monkeypatch, capsys):
    for name, small in (('CONTROLLERS', 4), ('LARGE_BATCH', 8), ('ROUNDS', 1),
                        ('PYBULLET_EVALUATIONS', 1), ('EVOLUTION_GENERATIONS', 2)):
        monkeypatch.setattr(bench, name, small)
    parser = argparse.ArgumentParser()
    bench.add_arguments(parser)
    assert bench.main(parser.parse_args(['--json', '--body', 'quadruped'])) == 0
    result = json.loads(capsys.readouterr().out)
    rates = result['bodies']['quadruped']
    assert set(rates) == {'batched_f32', 'batched_f64', 'pybullet', 'ratio_f32'}
    assert rates['ratio_f32'] == pytest.approx(rates['batched_f32'] / rates['pybullet'])
    assert rates['batched_f32'] > 20 * rates['pybullet']
    assert result['two_core_scaling'] > 0
    assert result['two_core_scaling_generation'] > 0
    shares = result['evolve_shares']
    assert shares['engine'] == pytest.approx(shares['physics'] + shares['priming'])
    assert 0 < sum(shares[name] for name in ('engine', 'evolution', 'checkpoint')) <= 1.001


def test_a_prototype_that_is_not_one_is_a_one_line_error(tmp_path, capsys, monkeypatch):
    for name in ('measure', 'two_core_scaling', 'evolve_shares'):
        monkeypatch.setattr(bench, name, lambda *_given: pytest.fail('measured before looking'))
    library = tmp_path / 'prototype.so'
    library.write_text('not a library')
    parser = argparse.ArgumentParser()
    bench.add_arguments(parser)
    args = parser.parse_args(['--json', '--body', 'quadruped', '--prototype', str(library)])
    assert bench.main(args) == 2
    assert 'expected a built prototype' in capsys.readouterr().err


def test_commanded_networks_and_mujocos_loop_are_raced_on_the_same_evaluations():
    pytest.importorskip('mujoco', reason='MuJoCo is what is raced: requirements/sim.txt')
    body = bodies.get('quadruped')
    tasks = bench_leaky.tasks(body)
    assert {name: count for name, (count, _task) in tasks.items()} == {
        'serial': 96, 'leaky': 96, 'mujoco': bench_leaky.MUJOCO_EVALUATIONS}
    world = WORLDS[body.world]
    assert tasks['leaky'][1]().frames == world.steps
    from w2b_sim.engines.mujoco_model import substeps

    states, _sensors = tasks['mujoco'][1]()
    assert states.shape[:2] == (2, (world.steps - 1) * world.physics_steps * substeps(world))
    assert np.isfinite(states).all()
    assert 'times' in bench_leaky.line({'serial': 100.0, 'leaky': 90.0, 'mujoco': 2.0})
