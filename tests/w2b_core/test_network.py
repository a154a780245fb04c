"""The network against the recorded reference, and its stepping semantics."""

from math import tanh

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.reference import BODIES, traces, word_vectors
from w2b_core.network import Network, prime, step


def random_network(seed=0, hidden=5, sensors=4, motors=8, batch=()):
    rng = np.random.default_rng(seed)
    return Network(rng.normal(size=(*batch, hidden, hidden + 1 + sensors)),
                   rng.normal(size=(*batch, motors, hidden)), rng.uniform(0.1, 1, motors))


@pytest.mark.parametrize('body', BODIES)
def test_priming_gives_the_recorded_state(shared, body):
    record, vectors = traces(shared), word_vectors(shared)
    hidden, motor = record[f'{body}.h'], record[f'{body}.m']
    signals = np.array([vectors[word] for word in record['words']])
    network = Network(hidden[:, None], motor[:, None], np.ones(motor.shape[1]))
    state = prime(network, signals)
    recorded = record[f'{body}.state']
    np.testing.assert_allclose(state.previous_hidden, recorded[..., 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(state.hidden, recorded[..., 1], rtol=0, atol=1e-12)


def test_priming_is_the_recurrence_of_the_paper():
    network = random_network(hidden=2, sensors=1, motors=1)
    (w00, w01, a0, _), (w10, w11, a1, _) = network.hidden_weights
    x, y = 0.0, 0.0
    for element in (0.3, -0.2, 0.7):
        x, y = (tanh(w00 * x + w01 * y + a0 * element + x),
                tanh(w10 * x + w11 * y + a1 * element + y))
    state = prime(network, [0.3, -0.2, 0.7])
    np.testing.assert_allclose(state.hidden, [x, y], atol=1e-14)
    assert state.primed
    assert (state.motors == 0).all()


def test_first_step_counts_the_primed_value_twice_and_later_ones_once():
    network = random_network(hidden=2, sensors=1, motors=1)
    primed = prime(network, [0.5, 0.1])
    first = step(network, primed, [1.0])
    second = step(network, first, [0.0])
    weights = network.hidden_weights
    expected_first = np.tanh(2 * primed.hidden + weights[:, :2] @ primed.hidden + weights[:, 3])
    expected_second = np.tanh(first.hidden + weights[:, :2] @ first.hidden)
    np.testing.assert_allclose(first.hidden, expected_first, atol=1e-14)
    np.testing.assert_allclose(second.hidden, expected_second, atol=1e-14)
    np.testing.assert_array_equal(second.previous_hidden, first.hidden)


def test_motors_lag_the_hidden_neurons_by_one_step_with_their_time_constants():
    network = random_network()
    primed = prime(network, [0.5, 0.1])
    first = step(network, primed, np.zeros(4))
    second = step(network, first, np.ones(4))
    lag = network.motor_time_constants
    np.testing.assert_allclose(first.motors, np.tanh(lag * (network.motor_weights @ primed.hidden)),
                               atol=1e-14)
    np.testing.assert_allclose(
        second.motors, np.tanh(first.motors + lag * (network.motor_weights @ first.hidden)),
        atol=1e-14)


def test_sensors_reach_the_motors_two_steps_later():
    network = random_network()
    primed = prime(network, [0.5, 0.1])
    dark, light = (step(network, primed, np.full(4, value)) for value in (0.0, 1.0))
    np.testing.assert_array_equal(dark.motors, light.motors)
    dark, light = (step(network, state, np.zeros(4)) for state in (dark, light))
    assert (dark.motors != light.motors).all()


@given(seed=st.integers(0, 2**32 - 1), controllers=st.integers(1, 4), words=st.integers(1, 3))
def test_a_batch_gives_the_same_bits_as_its_members(seed, controllers, words):
    batch = random_network(seed, sensors=2, motors=3, batch=(controllers, 1))
    rng = np.random.default_rng(seed)
    signals = rng.normal(size=(words, 30))
    sensors = rng.normal(size=(controllers, words, 2))
    state = step(batch, prime(batch, signals), sensors)
    for c in range(controllers):
        one = Network(batch.hidden_weights[c, 0], batch.motor_weights[c, 0],
                      batch.motor_time_constants)
        for w in range(words):
            alone = step(one, prime(one, signals[w]), sensors[c, w])
            np.testing.assert_array_equal(alone.hidden, state.hidden[c, w])
            np.testing.assert_array_equal(alone.motors, state.motors[c, w])


@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0, 1e6))
def test_neurons_stay_in_their_range(seed, scale):
    network = random_network(seed)
    state = prime(network, np.random.default_rng(seed).normal(size=50) * scale)
    for _ in range(5):
        state = step(network, state, np.ones(4))
        assert (np.abs(state.hidden) <= 1).all()
        assert (np.abs(state.motors) <= 1).all()


def test_words_primed_one_after_the_other_are_one_long_signal():
    network = random_network()
    rng = np.random.default_rng(3)
    first, second = rng.normal(size=(2, 300))
    in_order = prime(network, np.concatenate([first, second])).hidden
    reversed_ = prime(network, np.concatenate([second, first])).hidden
    assert np.abs(in_order - reversed_).max() > 1e-6


@pytest.mark.parametrize(('change', 'message'), [
    ({'hidden_weights': np.zeros((5, 5))}, r'hidden_weights: expected \(\.\.\., H, H \+ 1 \+ S\)'),
    ({'motor_weights': np.zeros((8, 4))}, r'motor_weights: expected \(\.\.\., M, 5\)'),
    ({'motor_time_constants': np.ones(7)}, r'motor_time_constants: expected \(8,\), got \(7,\)'),
])
def test_shapes_that_do_not_belong_together_are_refused(change, message):
    parts = {'hidden_weights': np.zeros((5, 10)), 'motor_weights': np.zeros((8, 5)),
             'motor_time_constants': np.ones(8)}
    with pytest.raises(ValueError, match=message):
        Network(**{**parts, **change})


@pytest.mark.parametrize('signal', [[], 1.0, [np.nan], [np.inf, 0]])
def test_a_signal_that_is_empty_or_not_finite_is_refused(signal):
    with pytest.raises(ValueError, match='signal: expected'):
        prime(random_network(), signal)


def test_the_wrong_number_of_sensors_is_refused():
    network = random_network()
    with pytest.raises(ValueError, match=r'sensors: expected \(\.\.\., 4\), got \(3,\)'):
        step(network, prime(network, [1.0]), np.zeros(3))
