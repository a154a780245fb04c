"""Champions scored again: the right words and starts, each word under its own permutation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.training.landscape import Landscape
from tests.training.study_files import config
from training.configuration import ConfigError
from training.evolution.operators import Layout, random_genomes
from training.evolution.treatments import permutation
from training.evolution.vectors import known, vector, vectors
from training.study.config import RunSpec
from training.study.lexicon import CLASSES, load_lexicon
from training.study.provenance import commands
from training.study.rescoring import COLUMNS, Trial, Word, rescore, trials
from training.study.store_columns import TABLES
from w2b_core import bodies
from w2b_core.network import Network
from w2b_core.vocabulary import UnknownWordError
from w2b_sim.engines.interface import Evaluation, Start

RUN = RunSpec('paper', 'quadruped', 'control', 3)


class Ears(Landscape):
    """The landscape, keeping what it heard."""

    heard: np.ndarray

    def evaluate(self, network: Network, signals: np.ndarray, starts: list[Start]) -> Evaluation:
        self.heard = np.array(signals)
        return super().evaluate(network, signals, starts)


def network() -> Network:
    layout = Layout.of(bodies.get('quadruped'))
    return layout.network(random_genomes(np.random.default_rng(0), 1, layout)[0])


def test_trials_cover_own_words_and_the_lexicon() -> None:
    found = {trial.condition: trial for trial in trials(
        config(robustness={'perturbed_starts': 3, 'pybullet_starts': 2}), RUN, load_lexicon(),
        in_pybullet=True)}
    assert set(found) == {'perturbed', 'pybullet', 'lexicon'}
    assert len(found['perturbed'].starts) == 3
    assert Start() not in found['perturbed'].starts
    assert found['pybullet'].starts == (Start(), found['perturbed'].starts[0])
    assert found['pybullet'].engine == 'pybullet'
    own = found['perturbed'].words
    assert [word.word for word in own if word.role == 'held_out'] == [RUN.held_out]
    assert {word.word for word in own} == {'forward', 'backward', 'stop', 'cease', 'suspend',
                                           'halt'}
    assert not {word.word for word in found['lexicon'].words} & {word.word for word in own}
    without = trials(config(robustness={'perturbed_starts': 0, 'lexicon': False}), RUN,
                     load_lexicon(), in_pybullet=False)
    assert without == []


@pytest.mark.parametrize('treatment', ['control', 'experimental'])
def test_each_word_is_heard_as_the_treatment_says(treatment: str) -> None:
    run = RunSpec('paper', 'quadruped', treatment, 3)
    words = ('ahead', 'pause', 'doctor')
    trial = Trial('lexicon', 'batched', tuple(Word(word, 'stop', 'lexicon') for word in words),
                  (Start(), Start(height_m=0.001)))
    ears = Ears()
    heard = vectors('default', words)
    columns = rescore(network(), run, trial, ears, heard)
    for row, word in enumerate(words):
        expected = heard[word]
        if treatment == 'control':
            expected = expected[permutation(run.evolution_seed, word, len(expected))]
        assert np.array_equal(ears.heard[row], expected)
    assert tuple(columns) == COLUMNS
    assert {len(values) for values in columns.values()} == {6}
    assert columns['word'] == ['ahead', 'ahead', 'pause', 'pause', 'doctor', 'doctor']
    assert columns['start_height_m'] == [0.0, 0.001] * 3
    # The landscape answers with the vector's first element, a tenth of a percent more a 0.1 mm.
    assert columns['final_x_m'][1] == pytest.approx(columns['final_x_m'][0] * 1.01)
    assert columns['path_m'][2] == pytest.approx(abs(columns['final_x_m'][2]))


def test_an_outcome_that_is_not_finite_is_kept_as_missing() -> None:
    class Exploding(Landscape):
        def evaluate(self, network: Network, signals: np.ndarray,
                     starts: list[Start]) -> Evaluation:
            outcome = super().evaluate(network, signals, starts)
            outcome.final_position_m[:] = np.nan
            return outcome

    trial = Trial('pybullet', 'pybullet', (Word('stop', 'stop', 'trained'),), (Start(),))
    columns = rescore(network(), RUN, trial, Exploding(), vectors('default', ['stop']))
    assert columns['final_x_m'] == [None]


def test_the_store_has_a_column_for_everything() -> None:
    names = [column.name for column in TABLES['robustness']]
    assert set(COLUMNS) <= set(names)


def test_the_lexicon_is_large_enough_and_in_the_default_vocabulary() -> None:
    lexicon = load_lexicon()
    assert tuple(lexicon) == CLASSES
    assert sum(len(lexicon[name]) for name in CLASSES[:3]) >= 60
    assert len(lexicon['unrelated']) >= 100
    heard = vectors('default', [word for words in lexicon.values() for word in words])
    directions = {word: value / np.linalg.norm(value) for word, value in heard.items()}
    asked = [value / np.linalg.norm(value) for value in vectors(
        'default', [word for word in commands() if known('default', word)]).values()]
    for word in lexicon['unrelated']:
        assert max(float(directions[word] @ one) for one in asked) < 0.25, word


@pytest.mark.parametrize(('text', 'message'), [
    ('words: [', 'cannot be read'), ('words: {stop: [a]}', 'expected the classes'),
    ('words: {forward: [a], backward: [a], stop: [b], unrelated: [c]}', 'stands twice'),
    ('words: {forward: [a], backward: [halt], stop: [b], unrelated: [c]}', 'command of the study'),
    ('words: {forward: [on], backward: [d], stop: [b], unrelated: [c]}', 'quote them')])
def test_a_damaged_lexicon_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / 'lexicon.yaml'
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_lexicon(path)


def test_the_balanced_sets_pairs_are_about_as_near_as_the_stop_words() -> None:
    for first, second in (('forward', 'forwards'), ('backward', 'backwards')):
        one, other = vector('default', first), vector('default', second)
        cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
        assert 0.38 < cosine < 0.8  # the stop words: 0.38 to 0.63


def test_the_papers_own_balanced_set_asks_for_a_vocabulary_that_knows_it() -> None:
    assert not known('default', 'foward')
    with pytest.raises(UnknownWordError):
        vector('default', 'foward')
