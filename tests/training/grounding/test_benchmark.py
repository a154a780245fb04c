"""The benchmark on the shipped lexicon holds its bounds; damaged inputs are named."""

import json

import numpy as np
import pytest

from training import __main__ as training
from training.grounding import accuracy, benchmark, lexicon, tables, wordnet
from training.grounding.lexicon import Entry, Lexicon
from w2b_core.hearing.metric import unit
from w2b_core.vocabulary import Vocabulary

needs_wordnet = pytest.mark.skipif(
    not (wordnet.FOLDER / 'data.noun').is_file(),
    reason='needs WordNet: `apt-get install wordnet-base`')


@pytest.fixture(scope='module')
def judged(tmp_path_factory):
    """The shipped lexicon, judged with its shipped metric: it touches none of its words."""
    folder = tmp_path_factory.mktemp('grounding')
    assert training.main(['grounding', '--splits', '12', '--out', str(folder),
                          '--wordnet', str(folder / 'none')]) == 0
    return json.loads((folder / 'grounding.json').read_text()), folder


@pytest.mark.timeout(900)
def test_the_bounds_hold(judged):
    found, _folder = judged
    for heard, least in (('4', 0.70), ('8', 0.79), ('12', 0.83), ('leave_one_family_out', 0.88)):
        row = found['accuracy'][heard]
        assert row['macro'] >= least, heard
        assert row['low'] <= row['macro'] <= row['high']
        assert np.mean(list(row['per_behaviour'].values())) == pytest.approx(row['macro'])
    gate = found['refusal']
    assert found['refusal_all_behaviours']['random_auroc'] >= 0.94
    assert gate['random_auroc'] >= 0.94
    assert gate['common_auroc'] >= 0.86
    assert gate['near_auroc'] >= 0.85
    assert gate['synonyms_refused'] <= 0.15
    assert gate['accuracy_of_accepted'] >= 0.87
    assert found['common_words_that_move'] <= 0.08
    assert found['phrases']['plain'] >= 0.90
    assert found['phrases']['negated'] >= 0.95
    assert found['phrases']['irrelevant_refused'] >= 0.90


def test_controls_are_at_chance_and_rivals_behind(judged):
    found, _folder = judged
    for name in ('permuted vectors', 'shuffled labels'):
        macros = [row['macro'] for row in found['rivals'][name].values()]
        assert np.mean(macros) == pytest.approx(1 / 3, abs=0.05)
    for count in ('4', '8', '12'):
        ours = found['accuracy'][count]['macro']
        assert found['rivals']['logistic regression'][count]['macro'] < ours - 0.03


def test_the_metric_has_seen_no_judged_word(judged):
    assert judged[0]['metric']['seen_words'] == []


def test_figures_and_tables_are_made_of_it(judged):
    found, folder = judged
    for name in ('map', 'confusion', 'coverage', 'accuracy'):
        assert (folder / f'{name}.png').stat().st_size > 5_000
    text = tables.text(found)
    assert f'{found["accuracy"]["12"]["macro"]:.3f}' in text
    assert 'near misses' in text


@pytest.mark.timeout(900)
def test_another_lexicon_is_judged_and_told_what_the_metric_has_seen(tmp_path, capsys):
    words = {'leap': 'jump', 'jump': 'jump', 'hop': 'hop', 'bounce': 'bounce', 'vault': 'vault'}
    other = {'sleep': 'sleep', 'doze': 'doze', 'slumber': 'slumber', 'nap': 'nap', 'rest': 'rest'}
    path = tmp_path / 'mine.json'
    known = lexicon.load().words
    path.write_text(json.dumps({
        'scored': ['up', 'down'],
        'words': {word: {'class': kind, 'family': family} for kind, found in
                  (('up', words), ('down', other)) for word, family in found.items()}}))
    assert not known.keys() & {'leap', 'nap'}
    assert training.main(['grounding', '--lexicon', str(path), '--words', '2', '9', '--splits', '3',
                          '--json', '--wordnet', str(tmp_path)]) == 0
    output = capsys.readouterr()
    found = json.loads(output.out)
    assert found['accuracy']['2']['macro'] > 0.6
    assert found['accuracy']['9'] is None  # too few families
    assert found['refusal']['random_auroc'] is None
    assert found['phrases']['plain'] is None
    assert 'leap' in found['metric']['seen_words']
    assert 'has seen' in output.err
    assert tables.text(found)


@pytest.mark.parametrize(('arguments', 'names'), [
    (['--words', '0'], 'words, splits'), (['--splits', '-1'], 'words, splits'),
    (['--lexicon', 'none.yaml'], 'No such file'), (['--vocabulary', 'nowhere'], 'vocabulary')])
def test_bad_arguments_end_with_one_line(capsys, arguments, names):
    assert training.main(['grounding', *arguments]) == 2
    error = capsys.readouterr().err
    assert names in error
    assert error.count('\n') == 1


@pytest.mark.timeout(900)
def test_the_evolved_rivals_close_the_loop():
    """Both learn to part three words that they heard; more is not claimed of so short a run."""
    from training.grounding import evolved

    words = {word: Entry(kind, f'{kind}{index}') for kind, found in
             (('stop', ('stop', 'halt')), ('forward', ('forward', 'onward')),
              ('backward', ('backward', 'retreat'))) for index, word in enumerate(found)}
    found = evolved.measure(Lexicon(words), Vocabulary.load(), count=1, generations=60, seeds=1)
    assert len(found) == 2
    for row in found.values():
        assert 0 <= row['1']['macro'] <= 1
        assert row['1']['trained'] > 1 / 3
    with pytest.raises(ValueError, match='more than 2 families'):
        evolved.measure(Lexicon(words), Vocabulary.load(), count=2, generations=1, seeds=1)


def test_accuracy_never_asks_a_family_that_was_heard():
    """Families are points of their own: nothing is right but by the family itself."""
    draw = np.random.default_rng(1)
    places = {}
    words = {}
    for index in range(60):
        centre = unit(draw.normal(size=40))
        for form in 'abc':
            places[f'{form}{index}x'] = unit(centre + 0.01 * draw.normal(size=40))
            words[f'{form}{index}x'] = Entry(('stop', 'forward', 'backward')[index % 3],
                                             f'f{index}')
    judged = Lexicon(words)
    def points(names):
        return np.array([places[name] for name in names])
    few = accuracy.of_few_words(judged, points, 10, 40)
    left = accuracy.of_left_out_families(judged, points)
    assert few.macro == pytest.approx(1 / 3, abs=0.06)
    assert left.macro < 0.55
    assert left.low < left.macro < left.high


def test_accuracy_of_what_can_be_told_is_1():
    centres = np.eye(3)
    draw = np.random.default_rng(1)
    words = {f'w{index}': Entry(('stop', 'forward', 'backward')[index % 3], f'f{index}')
             for index in range(30)}
    places = {word: unit(centres[index % 3] + 0.1 * draw.normal(size=3))
              for index, word in enumerate(words)}
    def points(names):
        return np.array([places[name] for name in names])
    for learner in (accuracy.logistic, accuracy.nearest_mean):
        assert accuracy.of_few_words(Lexicon(words), points, 4, 5, learner=learner).macro == 1
        assert accuracy.of_left_out_families(Lexicon(words), points, learner=learner).macro == 1
    assert accuracy.of_few_words(Lexicon(words), points, 10, 5) is None


def test_words_of_another_lexicon_are_told_by_whether_the_shipped_one_has_them(judged):
    assert judged[0]['shared'] == {}
    words = Lexicon({'halt': Entry('stop', 'halt'), 'march': Entry('forward', 'march'),
                     'prevent': Entry('stop', 'prevent'), 'lead': Entry('forward', 'lead'),
                     'resume': Entry('forward', 'resume')})
    answers = {'halt': 'stop', 'march': 'stop', 'prevent': 'stop', 'lead': 'forward',
               'resume': 'stop'}
    found = benchmark.shared(words, accuracy.Accuracy(0.0, 0.0, 0.0, {}, (), answers))
    assert found == {'both': {'words': 2, 'right': 0.5},
                     'others': {'words': 3, 'right': pytest.approx(2 / 3)}}
    assert tables.shared({'shared': found}) == (
        'One family left out, right: 0.500 of the 2 words that the shipped lexicon has too; 0.667 '
        'of the 3 other words.')
    assert tables.shared({}) == tables.shared({'shared': {}}) == ''
