"""What a study shows while it runs: how much is done, and when it will be over."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from tests.training.study_files import config
from training.study.progress import Display, Estimate, Running
from training.study.tasks import Task, TaskResult


def test_an_estimate_rests_on_the_runs_that_are_over() -> None:
    estimate = Estimate({'paper-quadruped': [0.02, 0.04]})
    assert estimate.seconds({'paper-quadruped': 3000}, workers=2) == pytest.approx(45.0)
    # A body of which nothing is known costs what the others do, until it is known.
    assert estimate.seconds({'paper-minimal': 1000}, workers=1) == pytest.approx(30.0)
    estimate.add('paper-minimal', 0.01)
    assert estimate.seconds({'paper-minimal': 1000}, workers=1) == pytest.approx(10.0)


def test_nothing_known_nothing_promised() -> None:
    assert Estimate({}).seconds({'paper-quadruped': 10}, workers=2) is None
    assert Estimate({'a': [1.0]}).seconds({'a': 10}, workers=0) is None


def shown(terminal: bool) -> str:
    study = config()
    tasks = [Task('evolve', '/study', study, {}, run) for run in study.runs()]
    output = StringIO()
    console = Console(file=output, force_terminal=terminal, width=160)
    with Display(console) as display:
        display.begin(('evolve',), study, tasks, {})
        display.show(2, [Running(tasks[0], 3, 0.5)])
        display.finished(tasks[0], TaskResult(seconds=6.0))
        display.finished(tasks[1], TaskResult(error='run [b]: no space left'))
        display.show(2, [])
    return output.getvalue()


def test_where_there_is_no_terminal_lines_are_printed() -> None:
    text = shown(terminal=False)
    assert 'evolutionary runs: 0 of 2 done, 2 workers, end not known yet' in text
    assert 'paper-quadruped-experimental-0000 at 3' in text
    assert 'failed: run [b]: no space left' in text


def test_on_a_terminal_the_picture_is_live() -> None:
    text = shown(terminal=True)
    assert 'evolutionary runs' in text
    assert '2 of 2' in text
