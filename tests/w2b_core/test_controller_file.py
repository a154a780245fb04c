"""Controller files: what is written is read again to the bit, and every damage is named."""

import copy
import json
import os
import stat
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.controller import file as cf
from w2b_core.network import Network, prime, step
from w2b_core.vocabulary import Vocabulary

SHIPPED = ('quadruped_all_engines', 'quadruped_sensors_off')
MAX = 1e300
numbers = st.floats(-MAX, MAX, allow_nan=False)
names = st.text('abcdefghijklmnopqrstuvwxyz_0123456789', min_size=1, max_size=12)
angles = st.floats(-6.28, 6.28)
weights = st.floats(-1e6, 1e6)
texts = st.text(st.characters(exclude_categories=['Cs', 'Cc', 'Zl', 'Zp']), max_size=20)
values = st.recursive(st.none() | st.booleans() | st.integers(-2**60, 2**60) | numbers | texts,
                      lambda item: st.lists(item, max_size=3)
                      | st.dictionaries(texts, item, max_size=3), max_leaves=8)


@st.composite
def controllers(draw: st.DrawFn) -> cf.Controller:
    hidden, count = draw(st.integers(1, 6)), draw(st.integers(0, 5))
    joints = draw(st.lists(names, min_size=1, max_size=5, unique=True))
    motors = []
    for joint in joints:
        lower, upper = sorted((draw(angles), draw(angles)))
        motors.append(cf.Motor(joint, lower, upper, draw(st.floats(1e-9, 1e6))))
    sensors = draw(st.lists(st.one_of(
        names.map('touch:{}'.format), st.sampled_from(joints).map('position:{}'.format),
        st.sampled_from(joints).map('motor:{}'.format)), max_size=count, unique=True))
    words = draw(st.lists(st.text(st.characters(categories=['L', 'N']), min_size=1, max_size=9),
                          max_size=4, unique=True))
    return cf.Controller(
        body=draw(st.sampled_from(bodies.names())),
        network=Network(
            draw(hnp.arrays(float, (hidden, hidden + 1 + len(sensors)), elements=weights)),
            draw(hnp.arrays(float, (len(motors), hidden), elements=weights)),
            np.array([motor.time_constant for motor in motors])),
        sensors=tuple(sensors), motors=tuple(motors),
        period_s=draw(st.floats(1e-6, 10)),
        words=tuple(cf.TrainedWord(word, draw(st.sampled_from(tuple(BEHAVIOURS))),
                                   f'{draw(st.integers(0, 2**256 - 1)):064x}',
                                   draw(st.none() | numbers)) for word in words),
        record=draw(st.dictionaries(texts, values, max_size=4)),
        vector_length=draw(st.integers(1, 1000)))


@settings(deadline=None, max_examples=150)
@given(controllers())
def test_what_is_saved_is_loaded_to_the_bit(tmp_path_factory, controller):
    path = tmp_path_factory.getbasetemp() / 'round_trip.json'
    cf.save(controller, path)
    again = cf.load(path)
    assert again == controller
    assert again.network.hidden_weights.tobytes() == controller.network.hidden_weights.tobytes()
    assert again.network.motor_weights.tobytes() == controller.network.motor_weights.tobytes()
    assert (again.body, again.sensors, again.motors, again.period_s, again.words, again.record) \
        == (controller.body, controller.sensors, controller.motors, controller.period_s,
            controller.words, controller.record)
    assert cf.dumps(again) == path.read_text(encoding='utf-8')


def valid() -> dict[str, Any]:
    document = json.loads(cf.shipped('quadruped_sensors_off').read_text())
    assert isinstance(document, dict)
    return document


def changed(*keys: str | int, to: Any) -> bytes:
    document = valid()
    at: Any = document
    for key in keys[:-1]:
        at = at[key]
    at[keys[-1]] = to
    return json.dumps(document).encode()


def without(*keys: str | int) -> bytes:
    document = valid()
    at: Any = document
    for key in keys[:-1]:
        at = at[key]
    del at[keys[-1]]
    return json.dumps(document).encode()


TEXT = json.dumps(valid())
NESTED = json.loads('[' * 200 + ']' * 200)
#: Damage -> the file, and what the error must say.
DAMAGE: dict[str, tuple[bytes, str]] = {
    'a weight that overflows': (changed('network', 'hidden_weights', 0, 0, to=-1e308),
                                r'hidden_weights: expected numbers of at most 1e\+06, got 1e\+308'),
    'a limit of many turns': (changed('network', 'motors', 0, 'upper_rad', to=100.0),
                              r'motors\[0\].upper_rad: expected limits of at most one turn'),
    'a time constant that overflows': (changed('network', 'motors', 0, 'time_constant', to=1e300),
                                       r'motors\[0\].time_constant: .*, got 1e\+300'),
    'empty': (b'', r'\(line 1, column 1: expecting value\)'),
    'truncated': (TEXT.encode()[:-100], 'expected JSON, got'),
    'not JSON': (b'network: 5', 'expected JSON, got text that is not JSON'),
    'two documents': (TEXT.encode() * 2, 'not JSON .*: extra data'),
    'not UTF-8': (TEXT.replace('forward', 'forw\xe4rd').encode('latin-1'),
                  'UTF-8 text, got byte 0xe4'),
    'UTF-16': (TEXT.encode('utf-16'), 'UTF-8 text, got byte 0xff'),
    'a list': (b'[1]', 'the file: expected a JSON object, got a list'),
    'a number': (b'7', 'expected a JSON object, got a number'),
    'huge': (b' ' * (cf.MAX_BYTES + 1), 'of at most 4,000,000 bytes, got 4,000,001 bytes'),
    'nested without end': (b'[' * 100_000, 'levels of lists and objects'),
    'nested record': (changed('record', 'deep', to=NESTED).replace(
        b'[' * 200, b'[' * 20_000).replace(b']' * 200, b']' * 20_000), 'levels of lists'),
    'NaN': (changed('network', 'hidden_weights', 0, 0, to=float('nan')), 'finite numbers, got NaN'),
    'Infinity': (changed('network', 'motor_weights', 0, 0, to=float('inf')), 'got Infinity'),
    'minus infinity': (changed('period_s', to=-float('inf')), 'got -Infinity'),
    'overflow': (TEXT.replace('0.05', '1e999', 1).encode(), 'period_s: expected a finite number'),
    'overflow in the record': (changed('record', 'x', to=[1, {'y': 77.25}]).replace(
        b'77.25', b'-1e999'), r'record\.x\[1\]\.y: expected a finite number'),
    'integer of 10,000 digits': (TEXT.replace('0.05', '9' * 10_000, 1).encode(), 'digits'),
    'integer beyond doubles': (TEXT.replace('0.05', '9' * 400, 1).encode(),
                               'period_s: expected a finite number, got a number too large'),
    'field twice': (TEXT.replace('"version": 1', '"version": 1, "version": 1').encode(),
                    'version: expected once'),
    'other format': (changed('format', to='w2b-vocabulary'),
                     "format: expected 'w2b-controller', got 'w2b-vocabulary'"),
    'later version': (changed('version', to=3), 'version: expected 1 or 2, .* got 3'),
    'version as text': (changed('version', to='1'),
                        'version: expected a whole number, got a string'),
    'version true': (changed('version', to=True),
                     'version: expected a whole number, got a boolean'),
    'body no name': (changed('body', to='hexa pod'),
                     "body: expected a name of letters, digits and _, got 'hexa pod'"),
    'body null': (changed('body', to=None), 'body: expected a string, got null'),
    'no network': (without('network'), 'network: expected a JSON object, got nothing: the field'),
    'network a list': (changed('network', to=[]), 'network: expected a JSON object, got a list'),
    'no record': (without('record'), 'record: expected a JSON object, got nothing'),
    'record a list': (changed('record', to=[]), 'record: expected a JSON object, got a list'),
    'unknown field': (changed('colour', to='red'), 'colour: expected no such field'),
    'unknown network field': (changed('network', 'bias', to=[]),
                              r'network\.bias: expected no such'),
    'unknown motor field': (changed('network', 'motors', 0, 'gear', to=2),
                            r'network\.motors\[0\]\.gear: expected no such field'),
    'other input': (changed('network', 'input', to='wide'),
                    "network.input: expected 'serial', got 'wide'"),
    'vector length zero': (changed('network', 'vector_length', to=0),
                           'network.vector_length: expected at least 1, got 0'),
    'vector length a fraction': (changed('network', 'vector_length', to=300.5),
                                 'vector_length: expected a whole number, got a number'),
    'weights no list': (changed('network', 'hidden_weights', to='0.1'),
                        'network.hidden_weights: expected a list of rows .* got a string'),
    'weights empty': (changed('network', 'hidden_weights', to=[]), 'got an empty list'),
    'weights of empty rows': (changed('network', 'motor_weights', to=[[]] * 8),
                              'got an empty list'),
    'weights flat': (changed('network', 'hidden_weights', to=[0.1] * 50),
                     r'hidden_weights\[0\]: expected a row of finite numbers, got a number'),
    'weights too deep': (changed('network', 'hidden_weights', 0, 0, to=[0.1]),
                         r'hidden_weights\[0\]\[0\]: expected a finite number, got a list'),
    'ragged row': (without('network', 'hidden_weights', 3, 0),
                   r'hidden_weights\[3\]: expected 10 numbers as in the first row, got 9'),
    'row missing': (without('network', 'hidden_weights', 4), 'network.*weights: expected .* got'),
    'weight as text': (changed('network', 'hidden_weights', 1, 2, to='0.5'),
                       r'hidden_weights\[1\]\[2\]: expected a finite number, got a string'),
    'weight true': (changed('network', 'motor_weights', 1, 2, to=True),
                    r'motor_weights\[1\]\[2\]: expected a finite number, got a boolean'),
    'weight null': (changed('network', 'motor_weights', 1, 2, to=None), 'got null'),
    'motor row missing': (without('network', 'motor_weights', 7),
                          'network.motor_weights: expected 8 rows, .* got 7 rows'),
    'motor columns': (changed('network', 'motor_weights', to=[[0.1] * 6] * 8),
                      'network.motor_weights: expected .*5.* got .*6'),
    'sensor missing': (without('network', 'sensors', 3),
                       'network.hidden_weights: expected rows of 9 .* got rows of 10'),
    'sensor kind': (changed('network', 'sensors', 0, to='smell:front_lower_leg'),
                    r"network\.sensors\[0\]: .*one of touch:LINK, .* got 'smell:front_lower_leg'"),
    'sensor without place': (changed('network', 'sensors', 0, to='touch:'), r'sensors\[0\]'),
    'sensor of no joint': (changed('network', 'sensors', 1, to='position:tail'),
                           r'sensors\[1\]: expected a joint of network.motors'),
    'sensor twice': (changed('network', 'sensors', 1, to='touch:front_lower_leg'),
                     r'sensors\[1\]: expected a sensor not named before'),
    'sensor a number': (changed('network', 'sensors', 1, to=3),
                        r'network\.sensors\[1\]: expected a string, got a number'),
    'joint twice': (changed('network', 'motors', 1, 'joint', to='front_hip'),
                    r"motors\[1\]\.joint: expected a joint not named before, got 'front_hip'"),
    'joint unnamed': (changed('network', 'motors', 1, 'joint', to=''), r'motors\[1\]\.joint'),
    'limits reversed': (changed('network', 'motors', 2, 'upper_rad', to=-2.0),
                        r'motors\[2\]\.upper_rad: expected at least lower_rad, -0.78.* got -2.0'),
    'limit missing': (without('network', 'motors', 2, 'lower_rad'),
                      r'network\.motors\[2\]\.lower_rad: expected a finite number, got nothing'),
    'time constant zero': (changed('network', 'motors', 3, 'time_constant', to=0),
                           r'motors\[3\]\.time_constant: expected more than 0 and at most .*got 0'),
    'motor a list': (changed('network', 'motors', 0, to=['front_hip', -1, 1, 1]),
                     r'network\.motors\[0\]: expected a JSON object, got a list'),
    'period zero': (changed('period_s', to=0), 'period_s: expected more than 0 .* got 0'),
    'period absurd': (changed('period_s', to=1e-10), 'period_s: expected more than 0'),
    'period negative': (changed('period_s', to=-0.05), 'period_s: expected more than 0'),
    'words an object': (changed('words', to={}),
                        'words: expected a list of JSON objects, got an object'),
    'word twice': (changed('words', 1, 'word', to='forward'),
                   r"words\[1\]\.word: expected a word not listed before, got 'forward'"),
    'word blank': (changed('words', 1, 'word', to='a\nb'),
                   r'words\[1\]\.word: expected .*printable'),
    'behaviour': (changed('words', 0, 'behaviour', to='jump!'),
                  r"words\[0\]\.behaviour: expected a name of letters, digits and _, got 'jump!'"),
    'hash short': (changed('words', 0, 'sha256', to='ab12'), r'words\[0\]\.sha256: expected 64'),
    'hash no hexadecimal': (changed('words', 0, 'sha256', to='x' * 64), r'words\[0\]\.sha256'),
    'score as text': (changed('words', 0, 'score', to='0.5'),
                      r'words\[0\]\.score: expected a finite number or null, got a string'),
}


@pytest.mark.parametrize('damage', DAMAGE)
def test_damage_is_named_in_one_line(tmp_path, damage):
    data, reason = DAMAGE[damage]
    path = tmp_path / 'controller.json'
    path.write_bytes(data)
    with pytest.raises(cf.JsonFileError, match=reason) as caught:
        cf.load(path)
    message = str(caught.value)
    assert '\n' not in message
    assert len(message.replace(str(path), '')) < 400
    assert message.startswith(f'{path}: ')
    assert 'expected' in message
    assert 'got' in message


def test_there_are_at_least_twenty_kinds_of_damage():
    assert len(DAMAGE) >= 20


@settings(deadline=None, max_examples=300)
@given(st.integers(0, len(TEXT) - 1), st.binary(max_size=3), st.integers(0, 3))
def test_any_damage_is_an_error_of_one_line_or_none(tmp_path_factory, place, inserted, removed):
    path = tmp_path_factory.getbasetemp() / 'damaged.json'
    data = TEXT.encode()
    path.write_bytes(data[:place] + inserted + data[place + removed:])
    error = ''
    try:
        cf.load(path)
    except cf.JsonFileError as damage:
        error = str(damage)
    assert '\n' not in error


def test_missing_file(tmp_path):
    with pytest.raises(cf.JsonFileError, match='no such file'):
        cf.load(tmp_path / 'none.json')


def test_path_with_a_nul(tmp_path):
    with pytest.raises(cf.JsonFileError):
        cf.load('a\0b')


def test_directory(tmp_path):
    with pytest.raises(cf.JsonFileError, match='got a directory'):
        cf.load(tmp_path)


def test_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(cf.JsonFileError, match='not a file'):
        cf.load(tmp_path / 'pipe')


def test_endless_file_is_not_read():
    with pytest.raises(cf.JsonFileError, match='not a file'):
        cf.load('/dev/zero')


@pytest.fixture
def champion() -> cf.Controller:
    return cf.load(cf.shipped('quadruped_sensors_off'))


def test_controller_that_could_not_be_loaded_is_not_saved(champion, tmp_path):
    path = tmp_path / 'a.json'
    for record in ({'x': float('nan')}, {'x': {1, 2}}, {'x': np.float32(1)}, {'x': '\ud800'}):
        with pytest.raises(cf.JsonFileError) as caught:
            cf.save(replace(champion, record=record), path)
        assert '\n' not in str(caught.value)
    weights = champion.network.hidden_weights.copy()
    weights[0, 0] = np.nan
    network = replace(champion.network, hidden_weights=weights)
    with pytest.raises(cf.JsonFileError, match='finite'):
        replace(champion, network=network)
    batch = Network(weights[None], champion.network.motor_weights[None],
                    champion.network.motor_time_constants)
    with pytest.raises(cf.JsonFileError, match='one controller'):
        replace(champion, network=batch)
    with pytest.raises(cf.JsonFileError, match='motor_time_constants'):
        replace(champion, network=replace(champion.network, motor_time_constants=np.ones(8)))
    assert list(tmp_path.iterdir()) == []


def test_failed_save_leaves_the_old_file(champion, tmp_path, monkeypatch):
    path = tmp_path / 'a.json'
    cf.save(champion, path)
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(28, 'No space left on device')
    monkeypatch.setattr('os.replace', fail)
    with pytest.raises(cf.JsonFileError, match='No space left'):
        cf.save(replace(champion, period_s=0.1), path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ['a.json']


def test_save_into_nowhere_says_so(champion, tmp_path):
    with pytest.raises(cf.JsonFileError, match='No such file'):
        cf.save(champion, tmp_path / 'no' / 'a.json')


def test_saved_file_is_as_readable_as_any_other(champion, tmp_path):
    cf.save(champion, tmp_path / 'a.json')
    (tmp_path / 'b').touch()
    assert stat.S_IMODE((tmp_path / 'a.json').stat().st_mode) \
        == stat.S_IMODE((tmp_path / 'b').stat().st_mode)


def test_a_changed_weight_changes_one_line(champion):
    weights = champion.network.hidden_weights.copy()
    weights[2, 3] += 1
    other = replace(champion, network=replace(champion.network, hidden_weights=weights))
    before, after = cf.dumps(champion).splitlines(), cf.dumps(other).splitlines()
    assert len(before) == len(after)
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert other != champion


def test_targets_span_the_limits(champion):
    state = prime(champion.network, np.ones(300))
    np.testing.assert_array_equal(champion.targets_rad(state.motors), np.zeros(8))
    for motors, angle in ((np.ones(8), np.pi / 4), (-np.ones(8), -np.pi / 4)):
        np.testing.assert_allclose(champion.targets_rad(motors), angle)
    moving = step(champion.network, state, np.zeros(4))
    assert np.abs(champion.targets_rad(step(champion.network, moving, np.zeros(4)).motors)).max() \
        <= np.pi / 4


def test_changed_words_are_named(champion):
    vocabulary = Vocabulary.load()
    assert champion.changed_words(vocabulary) == ()
    assert champion.changed_words(Vocabulary.load(scale=1.5)) \
        == ('forward', 'backward', 'stop', 'cease', 'suspend')
    words = list(champion.words)
    words[1] = replace(words[1], word='foward')
    words[2] = replace(words[2], sha256='0' * 64)
    assert replace(champion, words=tuple(words)).changed_words(vocabulary) == ('foward', 'stop')


def test_shipped_controllers_load(shared):
    assert set(SHIPPED) <= set(cf.shipped_names())
    for name in cf.shipped_names():
        controller = cf.load(cf.shipped(name))
        assert cf.dumps(controller) == cf.shipped(name).read_text(encoding='utf-8')
    with pytest.raises(cf.JsonFileError, match=r'one of .*quadruped_sensors_off'):
        cf.shipped('hexapod')


@pytest.mark.parametrize('name', SHIPPED)
def test_champions_are_those_of_the_reference_and_never_heard_halt(shared, name):
    controller = cf.load(cf.shipped(name))
    with np.load(shared / 'reference' / 'robust_champions.npz') as arrays:
        prefix = name.removeprefix('quadruped_')
        np.testing.assert_array_equal(controller.network.hidden_weights,
                                      arrays[f'{prefix}_hidden'])
        np.testing.assert_array_equal(controller.network.motor_weights, arrays[f'{prefix}_motor'])
    assert not controller.network.hidden_weights[:, 6:].any()  # touch never acts
    assert [word.word for word in controller.words] \
        == ['forward', 'backward', 'stop', 'cease', 'suspend']
    assert controller.body == 'quadruped'
    assert controller.motors[0] == cf.Motor('front_hip', -np.pi / 4, np.pi / 4, 0.3)
    assert controller.motors[7] == cf.Motor('right_knee', -np.pi / 4, np.pi / 4, 1.0)


def test_equal_controllers_are_equal_and_others_not(champion):
    assert copy.deepcopy(champion) == champion
    assert replace(champion, body='quadruped_blind') != champion
    assert champion != 'champion'
