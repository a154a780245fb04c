"""The ablation: rows add one means each, no held-out word takes part, runs are judged once."""

import argparse
import json
from dataclasses import replace
from itertools import pairwise

import numpy as np

from training.evolution.operators import Layout, random_genomes
from training.pipeline import ablation, trials
from training.pipeline.ablation import ALL, ROWS, config_of
from training.pipeline.ablation_table import to_markdown
from training.pipeline.recipe import load_recipe, shipped
from training.pipeline.table import Row, to_json
from training.robust import screening
from training.robust.settings import Randomisation
from w2b_core import bodies


def test_each_row_adds_to_the_row_above_until_every_means_is_in_use():
    names = [row.name for row in ROWS]
    growing = [set(row.means) for row in ROWS[:names.index(ALL) + 1]]
    assert growing[0] == set()
    assert all(len(after - before) == 1 and before < after for before, after in pairwise(growing))
    assert all(growing[-1] <= set(row.means) for row in ROWS[names.index(ALL):])
    config = config_of(ROWS[-1], 0, 9)
    assert config.randomisation == Randomisation()
    assert [stage.touch for stage in config.stages] == [False, True]
    assert {config_of(row, 0, 9).aggregate for row in ROWS} == {'balanced', 'mean', 'worst_word'}
    assert not config_of(ROWS[0], 0, 9).stages[0].vectors


QUADRUPED = load_recipe(shipped()['quadruped']).words
HELD_OUT = {word for word, _asked in QUADRUPED.held_out}


def fake_rows(network, words, validation, forward):
    far = {'forward': forward, 'backward': -0.6}
    return tuple(Row(word, asked, index < len(words), far.get(word, 0.0), 0.0, 0.0,
                     0.02 if asked == 'stop' else abs(far[word]), 0.0, 0,
                     asked == 'stop' or abs(far[word]) >= 0.5,
                     validation=index >= len(words))
                 for index, (word, asked) in enumerate(words + validation))


def test_the_table_is_of_every_run_and_goes_on_where_it_stopped(monkeypatch, tmp_path, capsys):
    trained, asked, judged = [], set(), []

    def train(config, directory, *, threads, vectors):
        trained.append(directory.name)
        asked.update(vectors)
        weights = np.full((1, 5, 10), float(config.seed))
        from w2b_core.network import Network
        return Network(weights, np.zeros((1, 8, 5)), np.ones(8)), np.array([1.5])

    def judge(network, body, world, words, held_out, vectors, *, seed, validation, **options):
        assert held_out == ()
        judged.append(seed)
        assert not {word for word, _asked in words + validation} & HELD_OUT
        # Seed 1 walks far from the gate's starts and less far from the judge's.
        run = float(network.hidden_weights[0, 0])
        return fake_rows(network, words, validation, 0.4 + 0.2 * run + 0.1 * seed)

    monkeypatch.setattr(ablation, 'train', train)
    monkeypatch.setattr(trials, 'trial', judge)
    monkeypatch.setattr(screening, 'find', lambda *_args, **_options: (np.zeros((2, 5, 6)), None))
    # Every controller is the same but for its seed, and so gets the same from the drawn worlds.
    monkeypatch.setattr(ablation, '_examined', lambda *_given: 0.25)
    args = argparse.Namespace(out=tmp_path, seeds='0-1', generations=9, starts=2, threads=1,
                              ears=1)
    assert ablation.main(args) == 0
    assert ablation.main(args) == 0
    assert len(trained) == len(set(trained)) == 2 * len(ROWS)
    assert not asked & HELD_OUT
    assert judged.count(ablation.CHOICE) == 2
    table = json.loads((tmp_path / 'ablation.json').read_text())['table']
    assert [run['seed'] for run in table[-1]['runs']] == [1], 'chosen by the gate'
    printed = capsys.readouterr().out
    assert printed.count('| no randomisation | 2 | 1.50 | 0.25 | +0.50 | -0.60 | '
                         '+0.50 (+0.45 to +0.55) | 0.02 | 1 | 1 |') == 2


def test_drawn_worlds_are_the_same_for_every_row():
    """A controller gets the same from them whatever its row; a loud one gets another fitness."""
    layout = Layout.of(bodies.get('quadruped'))
    vectors = {word: np.random.default_rng(index).normal(size=20) * 0.2
               for index, (word, _asked) in enumerate(QUADRUPED.trained)}

    def examined(network, row):
        config = config_of(row, 3, 3)
        short = replace(config, stages=tuple(replace(stage, length=0.05)
                                             for stage in config.stages))
        return ablation._examined(short, network, vectors, 1)

    still = layout.network(np.zeros(layout.size))
    loud = layout.network(random_genomes(np.random.default_rng(0), 1, layout)[0])
    quiet = {examined(still, row) for row in ROWS if not row.touch}
    assert len(quiet) == 1
    assert quiet != {examined(loud, ROWS[0])}


def test_of_every_three_runs_the_gate_prefers_one():
    runs = [{'seed': seed, 'choice': to_json(fake_rows(
        None, QUADRUPED.trained, (), 0.1 * (seed % 5)))} for seed in range(7)]
    assert [run['seed'] for run in ablation._gated(runs)] == [2, 4, 6]


def test_rows_are_tested_against_the_first():
    words = tuple(pair for pair in QUADRUPED.trained if pair[0] in ('forward', 'backward', 'stop'))

    def row(name, forward):
        return {'row': name, 'runs': [
            {'fitness': 0.0, 'drawn_fitness': way,
             'rows': to_json(fake_rows(None, words, (), way))} for way in forward]}
    first, second = to_markdown([row('few', (0.1, 0.11, 0.12, 0.13)),
                                 row('many', (0.51, 0.52, 0.53, 0.54))]).splitlines()[-2:]
    assert first.endswith('| 0.02 | 0 | 0 |')
    # All four runs of one above all four of the other: 1 of 70 orders, or of 70 tables.
    assert second.startswith('| many | 4 | 0.00 | 0.53 (0.014) |')
    assert second.endswith('+0.53 (+0.52 to +0.53; 0.014) | 0.02 | 4 (0.014) | 4 |')


def test_bad_options_are_errors(tmp_path, capsys):
    args = argparse.Namespace(out=tmp_path, seeds='0', generations=9, starts=0, threads=1, ears=1)
    assert ablation.main(args) == 2
    assert 'expected at least 3 generations, 1 start' in capsys.readouterr().err
