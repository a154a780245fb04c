"""The wheel: built, installed into an empty environment, and used there without ROS."""

import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import numpy
import pytest
import yaml

import w2b_core

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = sorted(path.parent for path in (ROOT / 'ros2_ws' / 'src').glob('*/package.xml'))


@pytest.fixture(scope='module')
def installed(tmp_path_factory):
    """The Python of an environment that holds the wheel, numpy and PyYAML, and nothing else."""
    folder = tmp_path_factory.mktemp('wheel')
    source = folder / 'source'
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(
        '.git', '.venv', 'out', 'build', 'install', 'log', 'docs', 'tests', '*.egg-info',
        '__pycache__'))
    subprocess.run([sys.executable, '-m', 'pip', 'wheel', str(source), '--quiet', '--no-deps',
                    '--no-build-isolation', '--disable-pip-version-check', '-w', str(folder)],
                   check=True, timeout=200)
    wheel, = folder.glob('*.whl')
    venv.create(folder / 'empty', symlinks=True, with_pip=False)
    python = folder / 'empty' / 'bin' / 'python'
    site = Path(subprocess.run(
        [python, '-c', 'import sysconfig; print(sysconfig.get_path("purelib"))'],
        capture_output=True, text=True, check=True).stdout.strip())
    subprocess.run([sys.executable, '-m', 'pip', '--python', str(python), 'install', '--quiet',
                    '--no-deps', '--no-index', '--disable-pip-version-check', str(wheel)],
                   check=True, timeout=200)
    for library in (numpy, yaml):
        top = Path(library.__file__).parent
        for path in (top, top.with_name(f'{top.name}.libs'), top.with_name('_yaml')):
            if path.is_dir() and not (site / path.name).exists():
                (site / path.name).symlink_to(path)
    return python


def run(python: Path, *arguments: str) -> 'subprocess.CompletedProcess[str]':
    kept = {name: value for name, value in os.environ.items()
            if name not in ('PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH', 'W2B_PLUGINS')}
    return subprocess.run([str(python), *arguments], capture_output=True, text=True, check=False,
                          timeout=100, env=kept, cwd=python.parent)


def test_a_shipped_controller_hears_a_word_without_ros(installed):
    done = run(installed, '-c', """
from w2b_core.controller import file
from w2b_core.hearing.heard import Heard
from w2b_core.mind import mind_of
from w2b_core.vocabulary import Vocabulary
import importlib.util
assert importlib.util.find_spec('rclpy') is None
controller = file.load(file.shipped(file.shipped_names()[0]))
mind = mind_of(controller)
print(len(Vocabulary.load().vector('forward')), mind.follows, len(mind.motors))
""")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r'300 False \d+\n', done.stdout)


def test_the_command_is_there_and_says_what_it_lacks(installed):
    command = installed.parent / 'w2b'
    helped = run(command, '--help')
    assert helped.returncode == 0
    assert 'emergency stop' in helped.stdout
    assert run(command, '--version').stdout == f'w2b {w2b_core.__version__}\n'
    missing = run(command, 'say', 'forward')
    assert missing.returncode == 2
    assert len(missing.stderr.splitlines()) == 1
    assert 'the module rclpy is missing' in missing.stderr
    unknown = run(command, 'dance')
    assert unknown.returncode == 2
    assert "unknown command 'dance': expected one of say, " in unknown.stderr


def test_data_files_of_training_are_in_the_wheel(installed):
    done = run(installed, '-c', """
from importlib.resources import files
assert (files('training') / 'configs' / 'paper.yaml').is_file()
assert (files('training') / 'report' / 'templates' / 'report.html').is_file()
import training
""")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize('package', PACKAGES, ids=lambda path: path.name)
def test_versions_are_one(package):
    manifest = (package / 'package.xml').read_text()
    assert f'<version>{w2b_core.__version__}</version>' in manifest
    assert f"version='{w2b_core.__version__}'" in (package / 'setup.py').read_text()


def test_requirements_and_extras_pin_the_same():
    extras = (ROOT / 'pyproject.toml').read_text()
    for name in ('controller', 'sim', 'mujoco', 'hw'):
        for line in (ROOT / 'requirements' / f'{name}.txt').read_text().splitlines():
            if '==' in line:
                assert f"'{line.strip()}'" in extras, f'{name}.txt pins {line}'
