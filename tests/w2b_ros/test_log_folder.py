"""Where ROS logs when its own folder cannot be written: a node starts all the same."""

import os
from pathlib import Path

import pytest

from w2b_ros.ros_process import provide_log_folder


@pytest.fixture(autouse=True)
def environment(monkeypatch, tmp_path):
    for name in ('ROS_HOME', 'ROS_LOG_DIR'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('HOME', str(tmp_path))


@pytest.mark.parametrize(('name', 'value'), [
    ('ROS_LOG_DIR', '/proc/nowhere'), ('ROS_HOME', '/proc/nowhere'), ('HOME', '/proc/nowhere'),
    ('ROS_LOG_DIR', '/dev/null'), ('HOME', None)])
def test_logs_go_where_they_can_be_written(monkeypatch, capsys, name, value):
    if value is None:
        monkeypatch.delenv(name)
    else:
        monkeypatch.setenv(name, value)
    monkeypatch.setenv('ROS_LOG_DIR', os.environ.get('ROS_LOG_DIR', ''))  # restored afterwards
    provide_log_folder()
    folder = Path(os.environ['ROS_LOG_DIR'])
    assert folder.is_dir()
    assert os.access(folder, os.W_OK)
    assert 'proc' not in str(folder)
    assert capsys.readouterr().err.startswith('warning: ')


def test_ros_keeps_its_own_folder_where_that_can_be_written(tmp_path, capsys):
    provide_log_folder()
    assert 'ROS_LOG_DIR' not in os.environ
    assert (tmp_path / '.ros' / 'log').is_dir()
    assert capsys.readouterr().err == ''
