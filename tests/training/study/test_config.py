"""A study's configuration: what it expands to, and the errors of one that cannot be run."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from training.configuration import ConfigError
from training.evolution.treatments import WORD_SETS
from training.study.config import RunSpec, load_config, parse_config
from training.study.store import parse_run_id
from training.study.tasks import run_config
from w2b_core import bodies

CONFIGS = Path(__file__).resolve().parents[3] / 'training' / 'configs'
EXPERIMENT = {'words': 'paper', 'bodies': ['quadruped'], 'treatments': ['experimental', 'control'],
              'seeds': 2}


def small(**changes: object) -> dict[str, object]:
    return {'name': 'small', 'experiments': [EXPERIMENT], **changes}


def test_the_ready_file_is_the_papers_study() -> None:
    config = load_config(CONFIGS / 'paper.yaml')
    runs = config.runs()
    paper = [run for run in runs if run.word_set == 'paper']
    assert len(paper) == 1200
    assert len(runs) - len(paper) == 200
    assert len({run.run_id for run in runs}) == len(runs)
    assert (config.generations, config.population) == (6000, 50)


@pytest.mark.parametrize('path', sorted(CONFIGS.glob('*.yaml')), ids=lambda path: path.stem)
def test_every_ready_file_can_be_run(path: Path) -> None:
    config = load_config(path)
    for run in config.runs():
        assert run_config(config, run).generations == config.generations


def test_more_seeds_only_add_runs() -> None:
    few = parse_config(small()).runs()
    more = parse_config(small(experiments=[{**EXPERIMENT, 'seeds': 5}])).runs()
    assert set(few) < set(more)
    assert len(more) == 10


def test_both_treatments_of_a_seed_hold_out_the_same_word_and_share_no_random_numbers() -> None:
    for seed in range(20):
        first, second = (RunSpec('paper', 'quadruped', name, seed)
                         for name in ('experimental', 'control'))
        assert first.held_out == second.held_out
        assert first.evolution_seed != second.evolution_seed


@pytest.mark.parametrize('word_set', sorted(WORD_SETS))
def test_every_stop_word_is_held_out_now_and_then(word_set: str) -> None:
    drawn = [RunSpec(word_set, 'quadruped', 'control', seed).held_out for seed in range(300)]
    stops = [word for word, _ in WORD_SETS[word_set][1]]
    assert set(drawn) == set(stops)
    assert min(drawn.count(word) for word in stops) > 300 / len(stops) / 2


def test_the_balanced_set_trains_two_words_a_behaviour() -> None:
    trained, held_out = RunSpec('balanced', 'quadruped', 'experimental', 0).words()
    meanings = [behaviour for _, behaviour in trained]
    assert {name: meanings.count(name) for name in meanings} == {
        'forward': 2, 'backward': 2, 'stop': 2}
    assert len(held_out) == 1


@settings(deadline=None)
@given(st.sampled_from(sorted(WORD_SETS)), st.sampled_from(bodies.names()),
       st.sampled_from(['experimental', 'control']), st.integers(0, 9999))
def test_a_runs_name_says_what_it_is(word_set: str, body: str, treatment: str, seed: int) -> None:
    run = RunSpec(word_set, body, treatment, seed)
    assert parse_run_id(run.run_id) == run


@pytest.mark.parametrize(('changes', 'message'), [
    ({'generations': 0}, 'generations: expected an integer >= 1, got 0'),
    ({'generations': 10**9}, 'generations: expected an integer <= 1,000,000'),
    ({'experiments': [{**EXPERIMENT, 'seeds': 10**12}]}, 'seeds: expected an integer <= 1,000,000'),
    ({'generations': 1.5}, 'generations: expected an integer'),
    ({'generations': True}, 'generations: expected an integer'),
    ({'population': 1}, 'population: expected an integer >= 2'),
    ({'objective': 'fastest'}, 'objective: expected one of program, paper, balanced'),
    ({'engine': 'bached'}, "did you mean 'batched'"),
    ({'engine': 'pybullet', 'precision': 'float32'}, 'double precision only'),
    ({'name': 'a/b'}, 'name: expected letters'),
    ({'name': ''}, 'name: expected text'),
    ({'experiments': []}, 'at least one experiment'),
    ({'experiments': 'all'}, 'at least one experiment'),
    ({'generation': 5}, "unknown field 'generation' (did you mean 'generations'?)"),
    ({'robustness': {'lexicon': 'yes'}}, 'robustness.lexicon: expected true or false'),
    ({'robustness': {'perturbed_starts': -1}}, 'robustness.perturbed_starts'),
    ({'experiments': [{**EXPERIMENT, 'bodies': ['quadrupod']}]}, "did you mean 'quadruped'"),
    ({'experiments': [{**EXPERIMENT, 'bodies': ['quadruped'] * 2}]}, 'each name once'),
    ({'experiments': [{**EXPERIMENT, 'bodies': 'quadruped'}]}, 'expected a list'),
    ({'experiments': [{**EXPERIMENT, 'treatments': ['balanced']}]}, 'experimental, control'),
    ({'experiments': [{**EXPERIMENT, 'words': 'all'}]},
     'expected one of paper, balanced, balanced_paper'),
    ({'experiments': [{**EXPERIMENT, 'seeds': 0}]}, 'experiments[0].seeds'),
    ({'experiments': [{'words': 'paper'}]}, "the field 'bodies' is missing"),
    ({'experiments': [EXPERIMENT, EXPERIMENT]}, 'is already part of experiments[0]'),
])
def test_a_wrong_configuration_is_refused_with_the_field(
        changes: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as refused:
        parse_config(small(**changes))
    assert message in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(('content', 'message'), [
    (b'name: [', 'not valid YAML'), (b'\xff\xfe\x00', 'cannot be read as UTF-8'),
    (b'', 'expected a mapping'), (b'- 1', 'expected a mapping'),
    (b'!!python/object/apply:os.getcwd []', 'not valid YAML'),
    (b'name: 2020-13-45', 'not valid YAML: month must be in 1..12'),
    (b'seeds: ' + b'9' * 5000, 'not valid YAML'), (b'[' * 5000, 'nested too deeply'),
    (b'name: a\ngenerations: 5\ngenerations: 6\n', "the key 'generations' stands twice"),
    (b'experiments: [{seeds: 1, seeds: 2}]', "the key 'seeds' stands twice")])
def test_a_file_that_is_no_study_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / 'study.yaml'
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=message) as refused:
        load_config(path)
    assert str(path) in str(refused.value)
    with pytest.raises(ConfigError, match='no such file'):
        load_config(tmp_path / 'none.yaml')
