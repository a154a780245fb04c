"""
What must give the same bits for ever: fixed inputs, and hashes of what comes out.

`python -m tests.invariants.fixed` prints the table. `hashes.json` is what it printed at commit
ec0d16a (2026-11-28), before the house was rebuilt. Never write that file anew: a difference is a
change of published results. Entries may be added for what is new.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from training.evolution.config import RunConfig
from training.evolution.operators import Layout, random_genomes
from training.evolution.run import RunResult, run
from training.study.config import parse_config
from training.study.provenance import identity
from training.study.results import results_sha256
from training.study.tasks import Task, perform
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.network import Network, prime, step
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.interface import Evaluation, Start
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import PAPER, WORLDS

TABLE = Path(__file__).parent / 'hashes.json'
#: The controllers that shipped at ec0d16a, in version 1 of the file's format.
CONTROLLERS = Path(__file__).parent / 'controllers_v1'

BODIES = ('quadruped', 'quadruped_blind', 'minimal', 'spherical_1dof_original',
          'spherical_1dof_sensors', 'spherical_1dof_blind', 'spherical_2dof_original',
          'spherical_2dof_sensors', 'spherical_2dof_blind', 'physical_twin')
#: Bodies and objectives whose hash of results identifies runs of the study.
STUDIED = (*((body, 'program') for body in BODIES if body in (
    'quadruped', 'minimal', 'spherical_1dof_sensors', 'spherical_1dof_blind',
    'spherical_2dof_sensors', 'spherical_2dof_blind')),
    ('quadruped', 'paper'), ('quadruped', 'balanced'))
PRECISIONS = ('float32', 'float64')
NAMES = ('quadruped', 'quadruped_all_engines', 'quadruped_sensors_off', 'physical_twin')
WORDS = ('forward', 'backward', 'stop', 'halt', 'cease', 'suspend', 'go', 'ahead', 'walk', 'run',
         'back', 'retreat', 'reverse', 'pause', 'wait', 'quit', 'doctor', 'onward', 'river',
         'freeze')
STARTS = (Start(), Start(height_m=0.002), Start(0.001, 0.008, -0.004, 0.02))


def sha(arrays: Iterable[np.ndarray]) -> str:
    """Return the hash of arrays' shapes and little-endian doubles."""
    digest = sha256()
    for array in arrays:
        digest.update(f'{np.shape(array)}'.encode())
        digest.update(np.ascontiguousarray(array, dtype='<f8').tobytes())
    return digest.hexdigest()


def everything(outcome: Evaluation) -> list[np.ndarray]:
    return [outcome.final_position_m, outcome.path_length_m, outcome.largest_step_m,
            outcome.touch_fraction, outcome.halfway_position_m, outcome.farthest_m]


def evaluation(body: str, precision: str) -> str:
    """Random controllers under random words from three starts."""
    described = bodies.get(body)
    layout, rng = Layout.of(described), np.random.default_rng(7)
    genomes = random_genomes(rng, 24, layout) * rng.choice([0.3, 1.0, 2.0], (24, 1))
    words = rng.uniform(-0.2, 0.2, (4, 300))
    engine = BatchedEngine(described, WORLDS[described.world], precision)
    return sha(everything(engine.evaluate(layout.network(genomes), words, STARTS)))


def evolution_config(body: str, generations: int) -> RunConfig:
    return RunConfig(body=body, seed=11, treatment='control', generations=generations,
                     population=10, starts=2, words=(
                         ('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop')),
                     held_out=(('halt', 'stop'),))


def evolved(result: RunResult) -> str:
    return sha([result.network.hidden_weights, result.network.motor_weights,
                np.array([result.fitness, *(word.score for word in result.outcomes)]),
                np.array([word.final_position_m for word in result.outcomes]),
                np.array([word.path_length_m for word in result.outcomes]),
                *(result.history[name] for name in sorted(result.history))])


class Stopped(Exception):
    """A run was stopped on purpose."""


def evolution(body: str, directory: Path, stops: tuple[int, ...] = ()) -> str:
    """An evolution of 15 generations, killed at some of them and taken up again."""
    for stop in stops:
        def progress(now, stop=stop):
            if now.generation == stop:
                raise Stopped
        try:
            run(evolution_config(body, 15), directory, progress, checkpoint_generations=2)
        except Stopped:
            continue
        raise AssertionError(f'the run was not stopped at generation {stop}')
    return evolved(run(evolution_config(body, 15), directory))


def grown_evolution(body: str, directory: Path) -> str:
    """The same as `evolution`, taken from 8 finished generations to 15."""
    run(evolution_config(body, 8), directory)
    return evolved(run(evolution_config(body, 15), directory))


def study_task(treatment: str, directory: Path) -> tuple[str, str]:
    """Return the hashes of a study's run and of its champion's rescoring (without PyBullet)."""
    config = parse_config({
        'name': 'unchanged', 'generations': 10, 'population': 10,
        'experiments': [{'words': 'paper', 'bodies': ['quadruped'], 'treatments': [treatment],
                         'seeds': 1, 'first_seed': 3}],
        'robustness': {'perturbed_starts': 3, 'pybullet_starts': 0}})
    [wanted] = config.runs()
    made = identity(config)
    if isinstance(made.get('results_sha256'), dict):
        made = {**made, 'results_sha256': made['results_sha256']['quadruped']}
    for kind in ('evolve', 'rescore'):
        result = perform(Task(kind, str(directory), config, made, wanted))
        assert result.error is None, result.error
    place = directory / 'runs' / wanted.run_id
    champion = controller_file.load(place / 'champion.json').network
    summary = json.loads((place / 'summary.json').read_text())
    columns = json.loads((place / 'rescored.json').read_text())['columns']
    texts = '|'.join(f'{value}' for name in ('condition', 'engine', 'word', 'word_class', 'role')
                     for value in columns[name])
    return (sha([champion.hidden_weights, champion.motor_weights, np.array(summary['fitness']),
                 *(np.array(word[name]) for word in summary['outcomes']
                   for name in ('score', 'final_position_m', 'path_length_m', 'largest_step_m'))]),
            sha([np.frombuffer(texts.encode(), dtype=np.uint8),
                 *(np.array(columns[name], dtype=np.float64) for name in (
                     'start', 'start_height_m', 'start_roll_rad', 'start_pitch_rad', 'final_x_m',
                     'final_y_m', 'final_z_m', 'path_m', 'largest_step_m'))]))


def network(name: str) -> Network:
    return controller_file.load(CONTROLLERS / f'{name}.json').network


def heard() -> np.ndarray:
    vocabulary = Vocabulary.load()
    return np.array([vocabulary.vector(word) for word in WORDS])


def batch(one: Network) -> Network:
    return Network(one.hidden_weights[None], one.motor_weights[None], one.motor_time_constants)


def shipped(name: str) -> str:
    """A controller that shipped, under twenty words in the batched engine, double precision."""
    body = bodies.get(controller_file.load(CONTROLLERS / f'{name}.json').body)
    engine = BatchedEngine(body, WORLDS[body.world], 'float64')
    return sha(everything(engine.evaluate(batch(network(name)), heard(), STARTS[:2])))


def steps(name: str) -> str:
    """The same controller as the robot runs it: primed, then 50 steps, in numpy."""
    one, values = network(name), []
    for vector in heard():
        state = prime(one, vector)
        values.append(state.hidden)
        for index in range(50):
            state = step(one, state, np.sin(np.arange(one.sensor_count) + index))
            values += [state.hidden, state.motors]
    return sha(values)


def arithmetic() -> str:
    """What numpy's tanh and matmul round to here: `steps` can be the same only where this is."""
    rng = np.random.default_rng(3)
    values = rng.uniform(-6, 6, 4096)
    weights = rng.standard_normal((200, 5, 12))
    return sha([np.tanh(values), np.tanh(values[:5]), np.matmul(
        weights[..., :6], values[:1200].reshape(200, 6)[..., None]),
        np.matmul(weights, values[:2400].reshape(200, 12)[..., None]), np.sin(values)])


def in_pybullet() -> str:
    """A controller that shipped, under three words in PyBullet for five seconds."""
    body = bodies.get('quadruped')
    with PyBulletEvaluator(body, replace(PAPER, steps=100)) as evaluator:
        outcome = evaluator.evaluate(batch(network('quadruped')), heard()[:3], STARTS[:2])
    return sha([outcome.final_position_m, outcome.path_length_m, outcome.largest_step_m,
                outcome.touch_fraction])


def table() -> dict[str, str]:
    """Return every hash, by name."""
    found = {f'evaluation {body} {precision}': evaluation(body, precision)
             for precision in PRECISIONS for body in BODIES}
    with TemporaryDirectory() as folder:
        for body in ('quadruped', 'spherical_2dof_sensors'):
            found[f'evolution {body}'] = evolution(body, Path(folder) / body)
        for treatment in ('experimental', 'control'):
            done, again = study_task(treatment, Path(folder) / treatment)
            found[f'study run {treatment}'], found[f'study rescoring {treatment}'] = done, again
    found.update({f'shipped {name} in the batched engine': shipped(name) for name in NAMES})
    found.update({f'shipped {name} in numpy': steps(name) for name in NAMES})
    found.update({f'results {body} {objective}':
                  results_sha256('batched', 'float32', body, objective)
                  for body, objective in STUDIED})
    return {**found, 'shipped quadruped in PyBullet': in_pybullet(),
            "numpy's arithmetic": arithmetic()}


if __name__ == '__main__':
    print(json.dumps(table(), indent=1))
