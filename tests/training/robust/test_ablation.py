"""The ablation: rows add one means each, no held-out word takes part, runs are judged once."""

import argparse
import json
from itertools import pairwise

import numpy as np

from training.robust import ablation, ears, gate
from training.robust.ablation import GATED, ROWS, config_of, to_markdown
from training.robust.scenarios import Randomisation
from training.robust.word_roles import QUADRUPED


def test_each_row_adds_to_the_row_above_until_every_means_is_in_use():
    growing = [set(row.means) for row in ROWS if row.aggregate == 'balanced' and not row.touch]
    assert growing[0] == set()
    assert all(before < after for before, after in pairwise(growing))
    config = config_of(ROWS[-1], 0, 9)
    assert config.randomisation == Randomisation()
    assert [stage.touch for stage in config.stages] == [False, True]
    assert {config_of(row, 0, 9).aggregate for row in ROWS} == {'balanced', 'mean', 'worst_word'}
    assert GATED in {row.name for row in ROWS}
    assert not config_of(ROWS[0], 0, 9).stages[0].vectors


def fake_rows(network, words, validation, forward):
    far = {'forward': forward, 'backward': -0.6}
    return tuple(gate.Row(word, asked, index < len(words), far.get(word, 0.0), 0.0, 0.0,
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
        from w2b_controller.network import Network
        return Network(weights, np.zeros((1, 8, 5)), np.ones(8)), np.array([1.5])

    def judge(network, body, world, words, held_out, vectors, *, seed, validation, **options):
        assert held_out == ()
        judged.append(seed)
        # Seed 1 walks far from the gate's starts and less far from the judge's.
        run = float(network.hidden_weights[0, 0])
        return fake_rows(network, words, validation, 0.4 + 0.2 * run + 0.1 * seed)

    monkeypatch.setattr(ablation, 'train', train)
    monkeypatch.setattr(gate, 'gate', judge)
    monkeypatch.setattr(ears, 'find', lambda *_args, **_options: (np.zeros((2, 5, 6)), None))
    args = argparse.Namespace(out=tmp_path, seeds='0-1', generations=9, starts=2, threads=1,
                              ears=1)
    assert ablation.main(args) == 0
    assert ablation.main(args) == 0
    assert len(trained) == len(set(trained)) == 2 * len(ROWS)
    assert not asked & {word for word, _asked in QUADRUPED.held_out}
    assert judged.count(ablation.CHOICE) == 2
    table = json.loads((tmp_path / 'ablation.json').read_text())['table']
    assert [run['seed'] for run in table[-1]['runs']] == [1], 'chosen by the gate'
    printed = capsys.readouterr().out
    assert printed.count('| no randomisation | 2 | 1.50 | +0.50 | -0.60 | +0.50 | 0.02 | 1 | 1 |')


def test_bad_options_are_errors(tmp_path, capsys):
    args = argparse.Namespace(out=tmp_path, seeds='0', generations=9, starts=0, threads=1, ears=1)
    assert ablation.main(args) == 2
    assert 'expected at least 3 generations, 1 start' in capsys.readouterr().err


def test_a_table_without_runs_that_walk_both_ways_counts_none():
    words = tuple(pair for pair in QUADRUPED.trained if pair[0] in ('forward', 'backward', 'stop'))
    rows = gate.to_json(fake_rows(None, words, (), 0.1))
    line = to_markdown([{'row': 'x', 'runs': [{'fitness': 0.2, 'rows': rows}]}]).splitlines()[-1]
    assert line.endswith('| 0 | 0 |')
