"""New ears for a gait: only the auditory synapses change, and they sort the words."""

import numpy as np

from training.robust import hearing
from training.robust.champions import HELD_OUT, TRAINED, TRIED, beginning, config_of, new_ears
from training.robust.scenarios import DIRECTION
from w2b_controller import controller_file
from w2b_controller.vocabulary import Vocabulary


def test_only_the_auditory_synapses_change_and_the_words_are_sorted(monkeypatch):
    monkeypatch.setattr(hearing, 'GENERATIONS', 60)
    vocabulary = Vocabulary.load()
    gait = controller_file.load(controller_file.shipped('quadruped_all_engines')).network
    heard = {behaviour: np.array([vocabulary.vector(word) for word, asked in TRAINED
                                  if asked == behaviour]) for behaviour in DIRECTION}
    network, reached = hearing.rehear(gait, heard, 0)
    again, reached_again = hearing.rehear(gait, heard, 0)
    assert again.hidden_weights.tobytes() == network.hidden_weights.tobytes()
    assert reached == reached_again
    changed = network.hidden_weights != gait.hidden_weights
    assert changed[:, gait.hidden_count].all()
    assert not np.delete(changed, gait.hidden_count, axis=1).any()
    assert network.motor_weights.tobytes() == gait.motor_weights.tobytes()
    # Three behaviours, each from 0 (sorted) to -1 (all of it elsewhere).
    assert reached > -1.0


def test_a_hardening_begins_with_the_gait_and_feeling_feet(monkeypatch):
    monkeypatch.setattr(hearing, 'GENERATIONS', 2)
    vocabulary = Vocabulary.load()
    vectors = {word: vocabulary.vector(word) for word, _asked in TRAINED + HELD_OUT + TRIED}
    config = new_ears(config_of('quadruped', 3))
    assert config.listening.attempts == 0
    genomes = beginning(config, 'quadruped_all_engines', vectors)
    assert genomes.shape == (config.population, 90)
    hidden = genomes[:, :50].reshape(-1, 5, 10)
    assert (hidden[..., 6:] != 0).all()
    assert np.abs(hidden[..., 6:]).mean() < 0.2
    assert beginning(config, None, vectors) is None
