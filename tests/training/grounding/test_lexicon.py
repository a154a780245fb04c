"""The shipped lexicon follows its own rules, and damaged ones are named."""

import hashlib
import json
import random

import pytest

from training.grounding import lexicon
from training.grounding.lexicon import LexiconError
from w2b_core.vocabulary import Vocabulary, VocabularyFileError

#: What a robot is told every day and must know: never held out.
ALWAYS = {'stop': 'stop wait stay pause', 'forward': 'forward go walk move ahead',
          'backward': 'back reverse return'}


@pytest.fixture(scope='module')
def shipped():
    return lexicon.load()


def test_it_is_large_enough_and_in_the_vocabulary(shipped):
    assert len(shipped.of('stop')) >= 25
    assert len(shipped.of('forward')) >= 25
    assert len(shipped.of('backward')) >= 20
    known = set(Vocabulary.load().words)
    for words in (shipped.words, shipped.near_miss, shipped.common, shipped.random,
                  shipped.excluded):
        assert set(words) <= known
    assert len(shipped.near_miss) >= 130
    assert (len(shipped.common), len(shipped.random)) == (400, 1500)


def test_held_out_families_follow_the_rule(shipped):
    for behaviour, always in ALWAYS.items():
        paper = ('halt', 'suspend') if behaviour == 'stop' else ()
        others = sorted({*shipped.of(behaviour)} - {*always.split(), *paper},
                        key=lambda family: hashlib.sha256(
                            f'w2b held out {behaviour} {family}'.encode()).hexdigest())
        assert shipped.held_out[behaviour] == (*paper, *others[:3])


def test_common_and_random_words_are_the_draws_of_the_rule(shipped):
    try:
        words = Vocabulary.load('bolukbasi').words
    except VocabularyFileError:
        pytest.skip('needs the source of the vocabulary: `vocabulary install bolukbasi`')
    taken = {*shipped.words, *shipped.near_miss, *shipped.excluded}
    free = [word for word in words
            if word.isascii() and word.isalpha() and word.islower() and word not in taken]
    assert list(shipped.common) == free[:400]
    assert list(shipped.random) == sorted(random.Random(0).sample(free[400:], 1500))


def test_every_phrase_label_is_a_behaviour_or_none(shipped):
    assert {phrase.label for phrase in shipped.phrases} <= {*shipped.behaviours, 'none'}
    kinds = [phrase.kind for phrase in shipped.phrases]
    assert min(kinds.count(kind) for kind in lexicon.KINDS) >= 30


GOOD = {'words': {'halt': {'class': 'stop', 'family': 'halt'},
                  'go': {'class': 'forward', 'family': 'go'},
                  'back': {'class': 'backward', 'family': 'back'}}}


@pytest.mark.parametrize(('change', 'names'), [
    ({'words': {**GOOD['words'], 'went': {'class': 'backward', 'family': 'go'}}},
     "family 'go': expected one class"),
    ({'near_miss': ['halt']}, "'halt': expected it once"),
    ({'near_miss': ['a', 'a']}, "'a' twice"),
    ({'words': {'halt': {'class': 'stop'}}}, 'words.halt.family'),
    ({'words': {True: {'class': 'stop', 'family': 'x'}}}, 'quote them'),
    ({'words': {}}, "class 'stop', got none"), ({'words': []}, 'words: expected names'),
    ({'phrases': [{'text': 'go', 'label': 'forward', 'kind': 'odd'}]}, r'phrases\[0\].kind'),
    ({'held_out': {'stop': ['go']}}, 'held_out.stop'), ({'colour': 1}, 'colour'),
    ({'random': 'halt'}, 'random: expected a list'), ({'excluded': [3]}, 'excluded')])
def test_damage_is_named(change, names):
    with pytest.raises(LexiconError, match=names):
        lexicon.parse({**GOOD, **change})
    assert lexicon.parse(GOOD).behaviours == ('stop', 'forward', 'backward')


@pytest.mark.parametrize(('name', 'text', 'names'), [
    ('a.yaml', 'words:\n  go: {class: stop, family: go}\n  go: {class: forward, family: go}\n',
     "'go': expected once, got it twice"),
    ('a.json', '{"words": {"go": {"class": "stop", "family": "a"}, "go": 1}}', 'twice'),
    ('a.yaml', ':::', 'expected'), ('a.json', '{', 'damaged'), ('a.yaml', '\x00', 'damaged'),
    ('a.yaml', '', 'nothing'), ('a.json', '[' * 100_000, 'damaged')])
def test_damaged_files_are_named(tmp_path, name, text, names):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(LexiconError, match=names) as caught:
        lexicon.load(path)
    assert str(path) in str(caught.value)
    assert '\n' not in str(caught.value)


def test_words_are_read_in_lower_case_and_once():
    words = {word.capitalize(): entry for word, entry in GOOD['words'].items()}
    found = lexicon.parse({'words': words, 'near_miss': ['Haltingly '], 'random': ['HALT', 'Tree']})
    assert dict(found.words) == dict(lexicon.parse(GOOD).words)
    assert (found.near_miss, found.random) == (('haltingly',), ('tree',))
    with pytest.raises(LexiconError, match="'halt': expected it once, got it twice"):
        lexicon.parse({'words': {**GOOD['words'], 'Halt': GOOD['words']['halt']}})
    with pytest.raises(LexiconError, match='near_miss: expected every word once'):
        lexicon.parse({**GOOD, 'near_miss': ['Haltingly', 'haltingly']})


def test_what_yaml_takes_for_other_things_are_words(tmp_path):
    path = tmp_path / 'a.yaml'
    path.write_text("""name: mine
version: 2
words:
  halt: {class: stop, family: halt}
  on: {class: forward, family: on}
  back: {class: backward, family: back}
near_miss:
random: [no, null, off, y, 1]
excluded: {true: means something else}
""")
    found = lexicon.load(path)
    assert found.words['on'] == lexicon.Entry('forward', 'on')
    assert found.random == ('no', 'null', 'off', 'y', '1')
    assert (found.near_miss, found.excluded) == ((), ('true',))


def test_a_missing_file_and_other_bytes(tmp_path):
    with pytest.raises(LexiconError, match='No such file'):
        lexicon.load(tmp_path / 'none.yaml')
    (tmp_path / 'a.yaml').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(LexiconError):
        lexicon.load(tmp_path / 'a.yaml')


def test_json_is_read_like_yaml(tmp_path):
    (tmp_path / 'a.json').write_text(json.dumps(GOOD))
    assert lexicon.load(tmp_path / 'a.json') == lexicon.parse(GOOD)


def test_what_a_vocabulary_lacks_is_left_out(shipped):
    known = {*list(shipped.words), 'robot'}
    some = shipped.within(known)
    assert shipped.unknown(known) == (*shipped.near_miss, *shipped.common, *shipped.random)
    assert shipped.unknown({*known, *shipped.unknown(known)}) == ()
    assert some.near_miss == ()
    with pytest.raises(LexiconError, match='two or more stem families'):
        shipped.within({'stop', 'go', 'back'})


def test_only_scored_claims_nothing_of_other_words(shipped):
    scored = shipped.only_scored()
    assert scored.behaviours == scored.scored
    assert {'sit', 'left'} <= set(scored.excluded)
    assert not set(scored.words) & set(scored.excluded)
