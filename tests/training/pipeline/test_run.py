"""A pipeline from its first step to its last: resumed, and held-out words last and once."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.training.pipeline.walker import RECIPE
from training.evolution.checkpoint import CheckpointError
from training.evolution.rundir import RunConflictError
from training.pipeline import blind, trials
from training.pipeline import candidates as kept
from training.pipeline import run as pipeline
from training.pipeline.candidates import Candidate
from training.pipeline.parts import Evolve, Pretrain
from training.pipeline.recipe import load_recipe, shipped
from training.pipeline.steps import choose, evolve, gate, pretrain
from training.pipeline.table import Row
from training.robust import screening
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary

ROLES = RECIPE.words
HELD_OUT = {word for word, _asked in ROLES.held_out}
WAYS = {'forward': 0.6, 'backward': -0.6}


def small(name, **changes):
    """A shipped recipe that takes seconds: short stages, no bounds."""
    recipe = load_recipe(shipped()[name])
    steps = []
    for part in recipe.steps:
        if isinstance(part, Pretrain):
            part = part.model_copy(update={'runs': 1})
        if isinstance(part, Evolve):
            part = part.model_copy(update={'discard_below': (), 'stages': tuple(
                replace(stage, generations=2, moves=1, stops=1, redraw=1, length=0.02)
                for stage in part.stages)})
        steps.append(part)
    training = recipe.training.model_copy(update={'population': 3, 'physics_steps': 2})
    return recipe.model_copy(update={'steps': tuple(steps), 'seeds': (0, 1), 'training': training,
                                     **changes})


def row(word, asked, x=None, far=0.05, trained=True, validation=False):
    x = WAYS.get(asked, 0.0) if x is None else x
    return Row(word, asked, trained, x, x, x, far, 0.0, 0, far <= 0.1 or asked != 'stop',
               trained or (asked == 'stop' and not validation), validation)


class Trials:
    """In place of PyBullet: everybody obeys, but for words in `disobeyed`; remembers what came."""

    def __init__(self, disobeyed=()):
        self.disobeyed, self.calls = disobeyed, []

    def __call__(self, network, body, world, words, held_out, vectors, *, starts, seed,
                 validation=(), **_options):
        self.calls.append((words + validation + held_out, starts, seed, set(vectors)))
        return tuple(row(word, asked, far=0.3 if word in self.disobeyed else 0.05,
                         trained=(word, asked) in words, validation=(word, asked) in validation)
                     for word, asked in words + validation + held_out)


class Spy:
    """A vocabulary that remembers which words were looked up."""

    def __init__(self):
        self.words = Vocabulary.load()
        self.asked = set()

    def vector(self, word):
        self.asked.add(word)
        return self.words.vector(word)


@pytest.fixture
def spied(monkeypatch):
    spy = Spy()
    monkeypatch.setattr(pipeline.Vocabulary, 'load', lambda name: spy)
    monkeypatch.setattr(screening, 'find', lambda *_args: (
        0.1 * np.random.default_rng(1).normal(size=(7, 5, 6)), None))
    monkeypatch.setattr(trials, 'later', lambda *_args, **_options: (
        trials.Later('forward', 60.0, 2.5, -0.3),))
    return spy


def go(recipe, directory, judge, monkeypatch):
    monkeypatch.setattr(trials, 'trial', judge)
    said = []
    return pipeline.run(recipe, directory, say=said.append), said


@pytest.mark.parametrize('name', sorted(shipped()))
def test_a_recipe_makes_a_champion_and_goes_on_where_it_was(monkeypatch, tmp_path, spied, name):
    recipe, judge = small(name), Trials()
    [champion], said = go(recipe, tmp_path, judge, monkeypatch)
    *before, last = judge.calls if name == 'physical_twin' else judge.calls[:-3]
    assert last[0] == ROLES.held_out
    assert last[3] == HELD_OUT
    assert not any(HELD_OUT & asked for _words, _starts, _seed, asked in before)
    assert {starts for _words, starts, seed, _asked in judge.calls if seed == 0} <= {2, 20}
    written = controller_file.load(tmp_path / 'champion.json')
    assert written.body == recipe.body
    assert written.record['opened'] == 1
    assert written.record['recipe'] == recipe.name
    assert {word.word for word in written.words} == {word for word, _asked in ROLES.trained}
    assert np.array_equal(written.serial.hidden_weights, champion.controller.hidden_weights)
    told = json.loads((tmp_path / 'table.json').read_text())
    assert [line['word'] for line in told['rows']] == [word for word, _asked in ROLES.every]
    assert told['later'] == [{'word': 'forward', 'seconds': 60.0, 'median_x_m': 2.5,
                              'median_y_m': -0.3}]
    assert ('touch_cut' in told) == (name == 'quadruped')
    text = (tmp_path / 'champion.md').read_text()
    assert text.endswith('60 s after *forward*: x +2.50 m, y -0.30 m (medians of 5 starts).\n')
    assert any('included: 1' in line for line in said)
    again = Trials()
    [same], _said = go(recipe, tmp_path, again, monkeypatch)
    assert not again.calls, 'all of it was kept'
    assert same.controller.motor_weights.tobytes() == champion.controller.motor_weights.tobytes()
    (tmp_path / 'steps').rename(tmp_path / 'gone')
    [same], _said = go(recipe, tmp_path, again, monkeypatch)
    assert not again.calls, 'trials, and the blind look, are kept one by one'


def test_no_held_out_word_is_looked_up_unless_a_candidate_is_chosen(monkeypatch, tmp_path, spied):
    judge = Trials(disobeyed=('cease',))
    found, said = go(small('physical_twin'), tmp_path, judge, monkeypatch)
    assert found == []
    assert any('nothing was chosen and no held-out word asked' in line for line in said)
    assert not spied.asked & HELD_OUT
    assert not any(HELD_OUT & asked for _words, _starts, _seed, asked in judge.calls)
    assert not (tmp_path / blind.FILE).exists()
    assert not (tmp_path / 'champion.json').exists()


def test_a_champion_that_does_not_stop_under_a_held_out_word_does_not_pass(monkeypatch, tmp_path,
                                                                           spied):
    found, _said = go(small('physical_twin'), tmp_path, Trials(disobeyed=('halt',)), monkeypatch)
    assert found == []
    assert json.loads((tmp_path / 'table.json').read_text())['passed'] is False


def test_a_broken_pipeline_goes_on_with_the_next_word(monkeypatch, tmp_path, spied):
    class Stopped(Trials):
        def __call__(self, *args, **options):
            if len(self.calls) == 30:
                raise KeyboardInterrupt
            return super().__call__(*args, **options)

    recipe = small('physical_twin')
    with pytest.raises(KeyboardInterrupt):
        go(recipe, tmp_path, Stopped(), monkeypatch)
    rest, whole = Trials(), Trials()
    [resumed], _said = go(recipe, tmp_path, rest, monkeypatch)
    [straight], _said = go(recipe, tmp_path / 'whole', whole, monkeypatch)
    assert len(rest.calls) == len(whole.calls) - 30
    for part in ('hidden_weights', 'motor_weights'):
        assert np.array_equal(getattr(resumed.controller, part), getattr(straight.controller, part))


def test_other_hidden_weights_are_taken_before_the_evolution_and_refused_after(
        monkeypatch, tmp_path):
    recipe, said = small('physical_twin'), []
    first, other = (0.1 * np.random.default_rng(seed).normal(size=(7, 5, 6)) for seed in (1, 2))

    def pretrained(weights):
        monkeypatch.setattr(screening, 'find', lambda *_args: (weights, None))
        pretrain.run(recipe.pretrain, bench(recipe, tmp_path, said), [], tmp_path)
        return [np.load(path) for path in sorted(tmp_path.glob('seed_*/listeners.npy'))]

    before = pretrained(first)
    assert len(before) == len(recipe.seeds)
    # Other words, runs or screening give other weights; nothing was evolved from the old ones.
    changed = pretrained(other)
    assert not any(np.array_equal(old, new) for old, new in zip(before, changed, strict=True))
    begun = next(tmp_path.glob('seed_*'))
    (begun / 'config.json').write_text('{}')
    assert all(np.array_equal(old, new) for old, new in
               zip(changed, pretrained(other), strict=True)), 'the same ones may go on'
    with pytest.raises(RunConflictError, match=r'began from \d+ other hidden layers than the \d+ '
                       r'that pretraining .* gives; repeat what it was begun with'):
        pretrained(first)
    assert np.array_equal(np.load(begun / 'listeners.npy'), changed[0]), 'kept as it was'


def test_more_seeds_may_follow_and_other_words_may_not(monkeypatch, tmp_path, spied):
    go(small('physical_twin', seeds=(0,)), tmp_path, Trials(), monkeypatch)
    before = (tmp_path / 'seed_0000' / 'walk.npz').stat().st_mtime_ns
    go(small('physical_twin', seeds=(0, 3)), tmp_path, Trials(), monkeypatch)
    assert (tmp_path / 'seed_0000' / 'walk.npz').stat().st_mtime_ns == before
    assert (tmp_path / 'seed_0003' / 'walk.npz').exists()
    other = small('physical_twin', words=ROLES.model_copy(
        update={'trained': (*ROLES.trained, ('rest', 'stop'))}))
    with pytest.raises(ValueError, match='holds another run: '):
        go(other, tmp_path, Trials(), monkeypatch)


def test_other_stages_of_evolution_may_not_follow(monkeypatch, tmp_path, spied):
    recipe = small('physical_twin')
    go(recipe, tmp_path, Trials(), monkeypatch)
    walk = recipe.steps[1]
    longer = walk.model_copy(update={'stages': tuple(
        replace(stage, generations=stage.generations + 1) for stage in walk.stages)})
    with pytest.raises(ValueError, match='seed_0000: holds another run: '):
        go(recipe.model_copy(update={'steps': (recipe.steps[0], longer, *recipe.steps[2:])}),
           tmp_path, Trials(), monkeypatch)


def test_a_damaged_file_of_candidates_is_named(monkeypatch, tmp_path, spied):
    go(small('physical_twin'), tmp_path, Trials(), monkeypatch)
    (tmp_path / 'steps' / '1_walk.npz').write_bytes(b'half')
    with pytest.raises(CheckpointError, match=r'1_walk\.npz: not readable candidates .* delete it'):
        go(small('physical_twin'), tmp_path, Trials(), monkeypatch)


def bench(recipe, directory, said):
    words = Vocabulary.load()
    return pipeline.Bench(recipe, words, {word: words.vector(word) for word, _ in ROLES.known},
                          say=said.append)


def test_a_walk_below_the_bound_is_discarded_and_kept_as_such(tmp_path):
    said, recipe = [], small('quadruped')
    walk = recipe.steps[1].model_copy(update={'discard_below': (-9.0, 9.0)})
    recipe = recipe.model_copy(update={'steps': (recipe.steps[0], walk, *recipe.steps[2:])})
    for _ in range(2):
        assert evolve.run(walk, bench(recipe, tmp_path, said), [Candidate(4)], tmp_path) == []
    earned = json.loads((tmp_path / 'seed_0004' / 'walk.json').read_text())['fitness']
    assert len(earned) == 2
    assert len(said) == 1, 'it is not evolved again'
    assert said[0].endswith('after stage 2, discarded')


def candidates(*ways):
    return [Candidate(seed, rank, Network(np.zeros((5, 10)), np.full((8, 5), way), np.ones(8)))
            for seed, rank, way in ways]


def judged_by_motor_weight(network, body, world, words, held_out, vectors, **_options):
    way = float(network.motor_weights[0, 0])
    return tuple(row(word, asked, x={'forward': 2.0, 'backward': -way}.get(asked))
                 for word, asked in words)


def test_the_best_of_each_seed_go_on(monkeypatch, tmp_path):
    monkeypatch.setattr(trials, 'trial', judged_by_motor_weight)
    scout = next(part for part in RECIPE.steps if part.name == 'scout')
    some = candidates((1, 0, 0.1), (1, 1, 0.9), (1, 2, 0.4), (1, 3, 0.8), (2, 0, 0.2), (2, 1, 0.3))
    chosen = gate.run(scout, bench(RECIPE, tmp_path, []), some, tmp_path)
    assert [(one.seed, one.rank) for one in chosen] == [(1, 1), (1, 3), (2, 1), (2, 0)]
    walks = next(part for part in RECIPE.steps if part.name == 'walks')
    chosen = gate.run(walks, bench(RECIPE, tmp_path, []), some, tmp_path)
    assert [(one.seed, one.rank) for one in chosen] == [(2, 0), (1, 0)], 'the best of each alone'


def table(forward, backward, *stops):
    return (row('forward', 'forward', forward, 1.0), row('backward', 'backward', backward, 1.0),
            *(row(f'stop{number}', 'stop', 0.0, far) for number, far in enumerate(stops)))


def test_candidates_that_obey_more_words_come_first_then_those_that_get_farther():
    far, near, restless = (Candidate(seed, table=rows) for seed, rows in enumerate((
        table(1.0, -0.9, 0.05, 0.05), table(0.6, -2.0, 0.05, 0.05), table(2.0, -2.0, 0.05, 0.3))))
    assert sorted([restless, near, far], key=choose.order) == [far, near, restless]


def test_candidates_are_kept_as_they_are(tmp_path):
    some = candidates((1, 0, 0.1), (2, 3, 0.9))
    some[0] = replace(some[0], table=table(0.3, -0.2, np.inf), fitness=0.25)
    kept.save(tmp_path / 'some.npz', some, 'key')
    again = kept.load(tmp_path / 'some.npz', 'key')
    assert [(one.seed, one.rank, one.table) for one in again] == [
        (one.seed, one.rank, one.table) for one in some]
    assert again[0].fitness == 0.25
    assert again[1].controller.motor_weights.tobytes() == some[1].controller.motor_weights.tobytes()
    assert kept.load(tmp_path / 'some.npz', 'another') is None
    kept.save(tmp_path / 'none.npz', [], 'key')
    assert kept.load(tmp_path / 'none.npz', 'key') == []
    with pytest.raises(ValueError, match='expected a network'):
        _ = Candidate(3).controller
