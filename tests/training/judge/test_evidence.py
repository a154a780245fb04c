"""The table of evidence: which bounds a row misses, and that rows are kept."""

import copy
import json
from dataclasses import replace

import pytest

from training.__main__ import main
from training.judge import evidence
from training.judge.evidence import BOUNDS, ROWS, Row, missing

WALK = {'along_m': 1.8, 'body_lengths_per_s': 1.5, 'worst_body_lengths_per_s': 1.4,
        'worst_heading_error_deg': 2.0, 'worst_across_share': 0.02, 'at_speed_limit': 0.01,
        'yaw_deg': 1.0, 'displacement_m': 1.8, 'drift_m': 0.001, 'fastest_joint_hz': 1.5,
        'falls': 0}
GOOD = {'behaviours': {
    'stop': WALK, 'forward': WALK, 'backward': {**WALK, 'along_m': -1.8},
    'left': {**WALK, 'yaw_deg': 150.0, 'displacement_m': 0.01},
    'right': {**WALK, 'yaw_deg': -150.0, 'displacement_m': 0.01}, 'sit': WALK},
    'switches': {'obeyed': 90, 'of': 90, 'missed': []}}
SHIPS, HARD = ROWS[0], next(row for row in ROWS if 'hard' in row.conditions)
TWIN = BOUNDS['physical_twin']


def changed(behaviour, **figures):
    result = copy.deepcopy(GOOD)
    result['behaviours'][behaviour].update(figures)
    return result


@pytest.mark.parametrize('row', ROWS, ids=lambda row: row.name)
def test_what_is_within_the_bounds_misses_none(row):
    long = {name: {**one, 'along_m': 6 * one['along_m']}
            for name, one in GOOD['behaviours'].items()}
    result = {**GOOD, 'behaviours': long} if row.minute else GOOD
    assert missing(result, GOOD, row, TWIN) == []


@pytest.mark.parametrize(('result', 'row', 'missed'), [
    (changed('forward', worst_heading_error_deg=8.1), SHIPS, 'forward heading'),
    (changed('forward', worst_heading_error_deg=11.9), HARD, None),
    (changed('backward', worst_heading_error_deg=12.1), HARD, 'backward heading'),
    (changed('backward', worst_body_lengths_per_s=0.9), SHIPS, 'backward speed'),
    (changed('forward', worst_body_lengths_per_s=1.19), HARD, 'forward speed'),
    (changed('forward', worst_body_lengths_per_s=1.21), HARD, None),
    (changed('forward', worst_across_share=0.09), SHIPS, 'forward sideways'),
    (changed('left', yaw_deg=59.0), SHIPS, 'left turn'),
    (changed('right', displacement_m=0.13), SHIPS, 'right displacement'),
    (changed('stop', drift_m=0.011), SHIPS, 'stop drift'),
    (changed('sit', fastest_joint_hz=2.6), HARD, 'joint'),
    (changed('left', falls=1), HARD, 'falls'),
    ({**GOOD, 'switches': {'obeyed': 89, 'of': 90, 'missed': ['stop to sit']}}, SHIPS,
     'switches')])
def test_each_bound_is_told_when_it_is_missed(result, row, missed):
    assert missing(result, GOOD, row, TWIN) == ([] if missed is None else [missed])


def test_without_an_imu_the_heading_is_told_and_not_judged():
    blind = Row('no IMU', {'no_imu': True}, imu=False)
    assert missing(changed('forward', worst_heading_error_deg=170.0), GOOD, blind, TWIN) == []


def test_rows_are_kept_and_a_miss_is_the_exit_code(tmp_path, monkeypatch, capsys):
    walked = []

    def judge(controller, plan, starts, processes=1):
        walked.append((plan.engine, starts, plan.conditions.gyro_bias_rad_s))
        return changed('left', falls=len(walked) - 1)
    monkeypatch.setattr(evidence, 'judge', judge)
    command = ['evidence', 'physical_twin', '--out', str(tmp_path), '--starts', '2', '--rows', '1']
    assert main([*command, '--engines', 'mujoco']) == 0
    assert main(command) == 1
    assert walked == [('mujoco', 2, 0.01), ('pybullet', 2, 0.01)]
    lines = (tmp_path / 'table.md').read_text().splitlines()
    assert len(lines) == 4
    assert lines[2].startswith('| as it ships, 90 of 90 switches | pybullet, 2 | 1.50 (1.40)')
    assert lines[2].endswith('| falls |')
    assert lines[3].endswith('| none |')
    # Of another controller's rows none is taken.
    rows = json.loads((tmp_path / 'rows.json').read_text())
    (tmp_path / 'rows.json').write_text(json.dumps({**rows, 'controller': 'another'}))
    assert main([*command, '--engines', 'mujoco']) == 1
    assert len(walked) == 3
    # Nor of another engine's version, other sources, or other conditions of the same name.
    for change in (lambda: monkeypatch.setattr(evidence, 'version', lambda name: '0'),
                   lambda: monkeypatch.setattr(evidence, 'sources_sha256', lambda: 'others'),
                   lambda: monkeypatch.setattr(evidence, 'GYRO_BIAS_RAD_S', 0.02),
                   lambda: monkeypatch.setattr(evidence, 'BOUNDS', {
                       'physical_twin': replace(TWIN, seconds=5.0)})):
        change()
        before = len(walked)
        for _again in range(2):
            assert main([*command, '--engines', 'mujoco']) == 1
        assert len(walked) == before + 1, 'walked anew once, then kept'
    # Rows as they were kept without saying what they are of are walked anew too.
    (tmp_path / 'rows.json').write_text(json.dumps({**rows, 'mujoco: as it ships: 2': GOOD}))
    assert main([*command, '--engines', 'mujoco']) == 1
    assert len(walked) == 8
    assert capsys.readouterr().err == ''


def test_a_body_without_bounds_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(evidence, 'BOUNDS', {})
    assert main(['evidence', 'physical_twin', '--out', str(tmp_path)]) == 2
    assert 'expected a body with bounds' in capsys.readouterr().err
