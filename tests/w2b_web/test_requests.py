"""What a browser may ask for, and how often."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from w2b_web.rate import Rate
from w2b_web.requests import FIELDS, LONGEST_TEXT, BadRequestError, parse


@pytest.mark.parametrize(('message', 'do', 'robot', 'text', 'number'), [
    ({'do': 'say', 'text': 'march'}, 'say', None, 'march', 0.0),
    ({'do': 'say', 'text': 'march', 'robot': '/dog1'}, 'say', '/dog1', 'march', 0.0),
    ({'do': 'stop'}, 'stop', None, '', 0.0),
    ({'do': 'arm', 'confirmed': True}, 'arm', None, '', 0.0),
    ({'do': 'speed', 'number': 2}, 'speed', None, '', 2.0)])
def test_requests(message, do, robot, text, number):
    request = parse(json.dumps(message))
    assert (request.do, request.robot, request.text, request.number) == (do, robot, text, number)


@pytest.mark.parametrize(('data', 'says'), [
    ('', 'expected JSON'), ('{', 'expected JSON'), ('[' * 5000, 'expected JSON'),
    ('{"do": NaN}', 'expected JSON'), ('[]', 'expected an object'), ('1', 'expected an object'),
    ('{}', 'do: expected one of'), ('{"do": ["stop"]}', 'do: expected one of'),
    ('{"do": "rm"}', 'do: expected one of'), ('{"do": "say"}', 'say: text: expected text'),
    ('{"do": "say", "text": 1}', 'say: text: expected text'),
    (json.dumps({'do': 'say', 'text': 'x' * (LONGEST_TEXT + 1)}), 'say: text: expected text'),
    ('{"do": "arm"}', 'arm: expected confirmed: true'),
    ('{"do": "arm", "confirmed": 1}', 'arm: expected confirmed: true'),
    ('{"do": "speed", "number": 1e9}', 'speed: expected 0.05 to 20.0'),
    ('{"do": "speed", "number": true}', 'expected a number'),
    ('{"do": "pong", "number": 1e999}', 'expected a number'),
    ('{"do": "stop", "robot": "/../x"}', 'robot: expected a namespace'),
    ('{"do": "stop", "robot": 3}', 'robot: expected a namespace')])
def test_what_is_no_request_is_named(data, says):
    with pytest.raises(BadRequestError, match='expected') as raised:
        parse(data)
    assert says in str(raised.value)
    assert len(str(raised.value)) < 300


@given(st.text() | st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(
        st.sampled_from(['do', 'text', 'robot', 'number', 'confirmed']),
        inner | st.sampled_from(list(FIELDS)))).map(json.dumps))
def test_whatever_comes_is_a_request_or_refused(data):
    try:
        request = parse(data)
    except BadRequestError:
        return
    assert request.do in FIELDS
    # ROS sends UTF-8.
    request.text.encode()


def test_a_rate_allows_so_many_at_once_and_a_second():
    now_s = 0.0
    rate = Rate(20.0, lambda: now_s)
    assert sum(rate.allow() for _ in range(100)) == 20
    now_s = 0.5
    assert sum(rate.allow() for _ in range(100)) == 10
    now_s = 100.0
    assert sum(rate.allow() for _ in range(100)) == 20


def test_a_slow_rate_allows_one_at_once():
    now_s = 0.0
    rate = Rate(0.2, lambda: now_s)
    assert [rate.allow(), rate.allow()] == [True, False]
    now_s = 5.0
    assert rate.allow()
