"""What the body does under words, beside what the ear says."""

import json
from pathlib import Path

import pytest

from training.__main__ import main
from training.grounding.closed_loop import judged
from w2b_core.controller import file as controller_file
from w2b_core.vocabulary import Vocabulary

WIDE = Path(__file__).with_name('lexicons') / 'wide.json'


def test_the_twin_does_what_its_ear_understands(capsys):
    """One start of 4 s in MuJoCo; the whole table is `make figures`' work."""
    assert main(['closed-loop', 'physical_twin', '--lexicon', str(WIDE), '--engine', 'mujoco',
                 '--starts', '1', '--seconds', '4', '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    unheard = found['never_heard']
    assert unheard['words'] >= 20
    assert unheard['ear'] > 0.5
    assert unheard['mujoco'] == pytest.approx(unheard['ear']), 'the difference is the legs'


def test_legs_that_do_nothing_are_wrong_under_moves_and_right_under_stops():
    ear = controller_file.load(controller_file.shipped('physical_twin')).ear
    lame = {name: [{'stop'}] * 3 for name in ear.behaviours}
    words = {'forward': 'forward', 'stop': 'stop', 'march': 'forward', 'halt': 'stop',
             'banana': 'stop', 'suspend': 'stop'}
    found = judged(ear, Vocabulary.load(), words, {'lame': lame})
    assert found['trained'] == {'words': 2, 'ear': 1.0, 'refused': 0.0, 'lame': 0.5}
    # A word counts once, whether it is refused or moves the body from three starts.
    assert found['never_heard'] == {'words': 4, 'ear': 0.75, 'refused': 0.25, 'lame': 0.5}


@pytest.mark.parametrize(('arguments', 'reason'), [
    (('quadruped_all_engines',), 'expected a controller with an ear'),
    (('physical_twin', '--starts', '0'), '--starts, --seconds: expected'),
    (('physical_twin', '--lexicon', 'nowhere.yaml'), 'nowhere.yaml')])
def test_bad_input_is_a_line(arguments, reason, capsys):
    assert main(['closed-loop', *arguments]) == 2
    told = capsys.readouterr().err
    assert reason in told
    assert told.count('\n') == 1
