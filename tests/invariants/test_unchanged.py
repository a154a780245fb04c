"""
What is published stays, to the bit: hashes taken at ec0d16a, before the house was rebuilt.

Compiled code that is not kept yet makes this slow once (a quarter of a minute a body and
precision); after that it is a matter of seconds. The batched engine's bits do not depend on the
processor: these are the same with and without AVX-512, in numpy and in compiled code. What numpy
computes by itself (`tanh`, `matmul`) does depend on it, and its tests say so where they skip.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.invariants import fixed
from training.study.results import results_sha256

HASHES = json.loads(fixed.TABLE.read_text())


def test_the_table_is_the_one_of_before() -> None:
    """Every hash stands in the table; the table's own hash notices that one was replaced."""
    assert len(HASHES) >= 44


@pytest.mark.parametrize('precision', fixed.PRECISIONS)
@pytest.mark.parametrize('body', fixed.BODIES)
def test_evaluations_of_every_body(body: str, precision: str) -> None:
    assert fixed.evaluation(body, precision) == HASHES[f'evaluation {body} {precision}']


@pytest.mark.parametrize('body', ['quadruped', 'spherical_2dof_sensors'])
@pytest.mark.parametrize('stops', [(), (5,), (3, 9)])
def test_an_evolution_stopped_or_not(body: str, stops: tuple[int, ...], tmp_path: Path) -> None:
    assert fixed.evolution(body, tmp_path / 'run', stops) == HASHES[f'evolution {body}']


def test_an_evolution_taken_further(tmp_path: Path) -> None:
    assert fixed.grown_evolution('quadruped', tmp_path / 'run') == HASHES['evolution quadruped']


@pytest.mark.parametrize('treatment', ['experimental', 'control'])
def test_a_task_of_a_study(treatment: str, tmp_path: Path) -> None:
    run, rescoring = fixed.study_task(treatment, tmp_path)
    assert run == HASHES[f'study run {treatment}']
    assert rescoring == HASHES[f'study rescoring {treatment}']


@pytest.mark.parametrize('name', fixed.NAMES)
def test_shipped_controllers_under_twenty_words(name: str) -> None:
    assert fixed.shipped(name) == HASHES[f'shipped {name} in the batched engine']


@pytest.mark.parametrize('name', fixed.NAMES)
def test_shipped_controllers_as_the_robot_runs_them(name: str) -> None:
    if fixed.arithmetic() != HASHES["numpy's arithmetic"]:
        pytest.skip("numpy's tanh or matmul rounds otherwise on this processor than on the one "
                    'where the table was made')
    assert fixed.steps(name) == HASHES[f'shipped {name} in numpy']


def test_a_shipped_controller_in_pybullet() -> None:
    if fixed.arithmetic() != HASHES["numpy's arithmetic"]:
        pytest.skip("numpy's tanh or matmul rounds otherwise on this processor than on the one "
                    'where the table was made')
    assert fixed.in_pybullet() == HASHES['shipped quadruped in PyBullet']


@pytest.mark.parametrize(('body', 'objective'), fixed.STUDIED)
def test_the_results_that_identify_runs(body: str, objective: str) -> None:
    found = results_sha256('batched', 'float32', body, objective)
    assert found == HASHES[f'results {body} {objective}']
