"""What is shown of a run: a bar that fits 80 columns, plain lines where there is no terminal."""

import re

import pytest

from training.evolution import progress
from training.evolution.progress import counting, progress_bar
from training.evolution.run import Progress


@pytest.fixture
def clock(monkeypatch):
    """Seconds that a test sets; element 0."""
    now = [0.0]
    monkeypatch.setattr(progress, 'monotonic', lambda: now[0])
    return now


def show(shown, clock, generations):
    """Report 100 evaluations and a second a generation."""
    for generation in generations:
        clock[0] += 1
        shown(Progress(generation, 60, generation / 8, 100 * (generation - 30), generation - 30))


def test_lines_every_ten_seconds_where_there_is_no_terminal(clock, capsys):
    with progress_bar(60, 'quadruped seed 0') as shown:
        show(shown, clock, range(31, 40))
        assert capsys.readouterr().err == '', 'not yet'
        show(shown, clock, range(40, 56))
        assert capsys.readouterr().err == (
            'quadruped seed 0: generation 40 of 60, fitness 5.000, 100 evaluations/s, '
            '0:00:20 left\n'
            'quadruped seed 0: generation 50 of 60, fitness 6.250, 100 evaluations/s, '
            '0:00:10 left\n')
    last = capsys.readouterr().err
    assert last.startswith('quadruped seed 0: generation 55 of 60, ')
    assert last.count('\n') == 1


def test_nothing_is_shown_of_a_run_that_does_not_move(capsys):
    with progress_bar(60, 'quadruped seed 0'):
        pass
    assert capsys.readouterr().err == ''


def test_counting_in_lines(clock, capsys):
    with counting(10, 'PyBullet: random') as advance:
        clock[0] = 11.0
        advance(2)
        assert capsys.readouterr().err == 'PyBullet: random: 2 of 10, 0:00:44 left\n'
        advance(3)
    assert capsys.readouterr().err.startswith('PyBullet: random: 5 of 10, ')


@pytest.mark.parametrize('title', ['quadruped seed 0', 'spherical_1dof_original seed 12'])
def test_the_bar_is_whole_at_80_columns(monkeypatch, capsys, title):
    monkeypatch.setenv('COLUMNS', '80')
    monkeypatch.setenv('FORCE_COLOR', '1')
    monkeypatch.setenv('TERM', 'xterm')
    with progress_bar(6000, title) as shown:
        shown(Progress(5997, 6000, 12.3456, 123450, 10.0))
    text = re.sub(r'\x1b\[[0-9;?]*[a-zA-Z]', '', capsys.readouterr().err)
    line = text.replace('\r', '\n').strip().splitlines()[-1]
    assert len(line) <= 80
    for part in (title, '5997/6000', 'fitness 12.346', '12,345 ev/s', '-:--:--'):
        assert part in line, line
