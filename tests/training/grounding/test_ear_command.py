"""The metric and the ear are made again, to the last digit where the machine allows."""

import json
from pathlib import Path

import numpy as np
import pytest

from training import __main__ as training
from training.grounding import ear as command
from training.grounding import learned_metric, lexicon, wordnet
from w2b_core.hearing import Ear, Understood, softmax
from w2b_core.hearing.metric import unit
from w2b_core.vocabulary import Vocabulary, metrics

SHIPPED_EAR = Path(command.__file__).with_name('ear.json')
needs_wordnet = pytest.mark.skipif(
    not (wordnet.FOLDER / 'data.noun').is_file(),
    reason='needs WordNet: `apt-get install wordnet-base`')


@pytest.fixture(scope='module')
def vocabulary():
    return Vocabulary.load()


def test_the_shipped_ear_is_what_the_command_makes(tmp_path, vocabulary):
    assert training.main(['ear', '--out', str(tmp_path / 'ear.json')]) == 0
    made, shipped = (Ear.from_json(json.loads(path.read_text()))
                     for path in (tmp_path / 'ear.json', SHIPPED_EAR))
    assert dict(made.words) == dict(shipped.words)
    assert made.metric_sha256 == shipped.metric_sha256
    np.testing.assert_allclose(made.judge.gate.weights, shipped.judge.gate.weights, atol=2e-3)
    assert made.judge.threshold == pytest.approx(shipped.judge.threshold, abs=1e-2)


def test_the_shipped_ear_never_heard_what_is_held_out():
    ear = Ear.from_json(json.loads(SHIPPED_EAR.read_text()))
    held = [word for words in lexicon.load().held_out_words().values() for word in words]
    assert {'halt', 'halted', 'suspend', 'march', 'revert'} <= set(held)
    assert not set(held) & {*ear.words, *ear.near}


def test_most_held_out_words_are_right(vocabulary):
    ear = Ear.from_json(json.loads(SHIPPED_EAR.read_text()))
    lines = command.held_out(ear, vocabulary, lexicon.load())
    wrong = [line for line in lines if line.endswith('WRONG')]
    assert len(lines) > 30
    assert len(wrong) <= 0.3 * len(lines), wrong


@pytest.fixture(scope='module')
def net():
    return wordnet.WordNet()


@needs_wordnet
def test_the_shipped_metric_is_what_the_recipe_gives(vocabulary):
    shipped = command.shipped_metric(vocabulary)
    words = lexicon.load()
    built = command.build_metric(vocabulary, words, wordnet.FOLDER)
    some = vocabulary.matrix(vocabulary.words[:500])
    cosines = [metric.project(some) @ metric.project(some).T
               for metric in (built.metric, shipped.metric)]
    np.testing.assert_allclose(*cosines, atol=1e-3)
    assert built.how['synonyms'] == shipped.how['synonyms']


@needs_wordnet
def test_no_pair_of_the_metric_touches_a_judged_stem(vocabulary, net):
    words = lexicon.load()
    every = net.relations(vocabulary.words)
    kept = net.relations(vocabulary.words, (*words.words, *words.near_miss))
    assert ('cease', 'stop') in every.synonyms
    assert ('begin', 'end') in every.antonyms
    assert ('freeze', 'froze') in every.inflections
    stems = {stem for word in (*words.words, *words.near_miss) for stem in net.stems(word)}
    for pairs in (kept.synonyms, kept.antonyms, kept.inflections):
        assert len(pairs) > 500
        paired = {word for pair in pairs for word in pair}
        assert not paired & set(words.words)
        assert not [word for word in paired if stems & net.stems(word)]


@needs_wordnet
def test_the_metric_parts_opposites_that_it_never_saw(vocabulary, net):
    """Against plain cosines: opposites share contexts, so that those hardly part them."""
    synonyms = [('big', 'large'), ('purchase', 'buy'), ('mistake', 'error'), ('quick', 'rapid'),
                ('rich', 'wealthy'), ('sick', 'ill'), ('gift', 'present'), ('smart', 'clever')]
    opposites = [('big', 'small'), ('sell', 'buy'), ('hot', 'cold'), ('quick', 'slow'),
                 ('rich', 'poor'), ('sick', 'healthy'), ('increase', 'decrease'), ('win', 'lose')]
    without = {word for pair in (*synonyms, *opposites) for word in pair}
    metric = learned_metric.build(vocabulary, net, without).metric
    def gap(project):
        near, far = (np.mean([project(a) @ project(b) for a, b in pairs])
                     for pairs in (synonyms, opposites))
        return near - far
    plain = gap(lambda word: unit(unit(vocabulary.vector(word)) - metric.mean))
    learned = gap(lambda word: metric.project(vocabulary.vector(word)))
    assert learned > plain + 0.05


def test_missing_wordnet_says_what_to_do(tmp_path, capsys):
    code = training.main(['ear', '--out', str(tmp_path / 'ear.json'), '--rebuild-metric',
                          '--wordnet', str(tmp_path)])
    assert code == 2
    assert 'apt-get install wordnet-base' in capsys.readouterr().err
    (tmp_path / 'data.noun').write_text('nonsense\n')
    with pytest.raises(wordnet.WordNetError, match='damaged'):
        wordnet.WordNet(tmp_path)


@needs_wordnet
def test_an_ear_for_other_vectors_is_one_command(tmp_path, monkeypatch, vocabulary):
    """Vectors turned in space are other vectors: the old ear refuses, a new one understands."""
    monkeypatch.setenv('W2B_DATA', str(tmp_path / 'data'))
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(300, 300)))[0]
    words = [word for word in vocabulary.words[:6000] if word.isalpha() and word.islower()]
    words = list(dict.fromkeys((*words, *lexicon.load().words)))
    path = tmp_path / 'turned.txt'
    vectors = vocabulary.matrix(words) @ turn
    path.write_text(f'{len(words)} 300\n' + ''.join(
        f'{word} {" ".join(f"{value:.5f}" for value in vector)}\n'
        for word, vector in zip(words, vectors, strict=True)))
    assert training.main(['ear', '--vocabulary', str(path), '--out',
                          str(tmp_path / 'ear.json')]) == 0
    ear = Ear.from_json(json.loads((tmp_path / 'ear.json').read_text()))
    turned = Vocabulary.load(path)
    assert (metrics.user_folder() / f'{ear.metric_sha256}.npz').is_file()
    for word, behaviour in (('halt', 'stop'), ('marching', 'forward'), ('reverting', 'backward')):
        if word in turned:
            found = ear.understand(word, turned)
            assert isinstance(found, Understood)
            assert found.behaviour == behaviour


@pytest.mark.parametrize('arguments', [
    ['--vocabulary', 'nowhere'], ['--lexicon', 'nowhere.yaml'],
    ['--behaviours', 'stop', 'forward', 'fly'], ['--behaviours', 'forward', 'backward']])
def test_bad_arguments_end_with_one_line(tmp_path, capsys, arguments):
    assert training.main(['ear', '--out', str(tmp_path / 'ear.json'), *arguments]) == 2
    assert capsys.readouterr().err.count('\n') == 1
    assert not (tmp_path / 'ear.json').exists()


def test_the_classifier_is_the_one_that_scipy_finds():
    from scipy.optimize import minimize

    rng = np.random.default_rng(2)
    points, labels = unit(rng.normal(size=(60, 7))), rng.integers(0, 3, 60)
    weights = rng.uniform(0.5, 2, 60)
    def loss(flat):
        table = flat.reshape(3, 8)
        logits = points @ table[:, :7].T + table[:, 7]
        each = np.log(np.exp(logits).sum(axis=1)) - logits[np.arange(60), labels]
        return 0.5 * (table[:, :7]**2).sum() + 3.0 * weights @ each
    best = minimize(loss, np.zeros(24), tol=1e-12).x.reshape(3, 8)
    found = softmax.fit(points, labels, weights, 3, 3.0)
    np.testing.assert_allclose(found.weights, best[:, :7], atol=2e-3)
