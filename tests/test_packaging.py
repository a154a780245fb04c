"""The package `w2b`: one version, one set of commands, and a wheel that works without ROS."""

import ast
import json
import os
import subprocess
import sys
import tomllib
import venv
import zipfile
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import pytest

import w2b_core
from w2b_controller.cli.commands import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())
PACKAGES = {path.name: path for path in sorted((ROOT / 'ros2_ws' / 'src').iterdir())
            if (path / 'package.xml').is_file()}
MODULES = {**{name: path / name for name, path in PACKAGES.items()}, 'training': ROOT / 'training'}


def setup_arguments(package: Path) -> dict[str, ast.expr]:
    tree = ast.parse((package / 'setup.py').read_text())
    call = next(node for node in ast.walk(tree)
                if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'setup')
    return {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg}


def scripts(package: Path) -> dict[str, str]:
    found = setup_arguments(package).get('entry_points')
    lines = ast.literal_eval(found)['console_scripts'] if found else []
    return dict(line.split(' = ') for line in lines)


@pytest.mark.parametrize('name', PACKAGES)
def test_each_ros_package_has_the_one_version(name):
    manifest = ElementTree.parse(PACKAGES[name] / 'package.xml')
    assert manifest.findtext('version') == w2b_core.__version__
    assert 'package.xml' in ast.unparse(setup_arguments(PACKAGES[name])['version'])


def test_a_citation_names_the_same_version():
    lines = (ROOT / 'CITATION.cff').read_text().splitlines()
    assert f'version: {w2b_core.__version__}' in lines


def test_every_program_that_colcon_installs_is_a_subcommand_of_w2b():
    of_colcon = {name: target for package in PACKAGES.values()
                 for name, target in scripts(package).items()}
    assert of_colcon.pop('w2b') == PROJECT['project']['scripts']['w2b']
    assert len(of_colcon) >= 11
    assert of_colcon == {name: COMMANDS.get(name).target for name in of_colcon}


def test_each_library_is_in_constraints_and_no_requirements_file_includes_another():
    pinned = {line.partition('==')[0].lower().replace('_', '-') for line in
              (ROOT / 'requirements' / 'constraints.txt').read_text().splitlines()}
    for path in (ROOT / 'requirements').glob('*.txt'):
        if path.name == 'constraints.txt':
            continue
        for line in path.read_text().splitlines():
            assert not line.startswith('-'), f'{path.name}: setuptools reads this file too'
            if line and not line.startswith('#'):
                name = line.partition('=')[0].partition('>')[0].lower().replace('_', '-')
                assert name in pinned, f'{path.name}: {name}'


def test_all_requirements_are_in_an_extra():
    dynamic = PROJECT['tool']['setuptools']['dynamic']
    used = set(dynamic['dependencies']['file']).union(
        *(extra['file'] for extra in dynamic['optional-dependencies'].values()))
    there = {f'requirements/{path.name}' for path in (ROOT / 'requirements').glob('*.txt')}
    assert used == there - {'requirements/constraints.txt'}


@pytest.mark.parametrize('name', MODULES)
def test_types_are_offered(name):
    assert (MODULES[name] / 'py.typed').is_file()


@pytest.fixture(scope='module')
def wheel(tmp_path_factory) -> Path:
    """The wheel, built from what git would commit, in a folder of its own."""
    folder = tmp_path_factory.mktemp('wheel')
    source = folder / 'source'
    listed = subprocess.run(
        ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'], cwd=ROOT,
        capture_output=True, text=True, check=True).stdout.split('\0')
    for name in filter(None, listed):
        if (ROOT / name).is_file() and not name.startswith(('docs/', 'tests/')):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    done = subprocess.run(
        [sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation',
         '--wheel-dir', str(folder), str(source)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, = folder.glob('w2b-*.whl')
    return found


def test_the_wheel_has_every_file_of_the_packages(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    expected = {f'{name}/{path.relative_to(top).as_posix()}' for name, top in MODULES.items()
                for path in top.rglob('*') if path.is_file() and '__pycache__' not in path.parts}
    assert expected <= names, sorted(expected - names)
    strange = {name for name in names - expected if '.dist-info/' not in name}
    assert not strange


@pytest.fixture(scope='module')
def elsewhere(wheel, tmp_path_factory):
    """
    Return a function that runs a program of a new environment that has the wheel.

    The environment is empty but for the wheel and the libraries that it requires, lent from here
    so that the test works offline: neither ROS nor anything of an extra is in reach.
    """
    folder = tmp_path_factory.mktemp('elsewhere')
    venv.create(folder / 'venv', with_pip=False)
    subprocess.run([sys.executable, '-m', 'pip', '--python', str(folder / 'venv/bin/python'),
                    'install', '--quiet', '--no-deps', str(wheel)], check=True)
    site = next((folder / 'venv').glob('lib/python3*/site-packages'))
    lend(site, 'numpy', 'yaml', 'rich', 'markdown_it', 'mdurl', 'pygments')

    def run(program, *arguments):
        environment = {name: value for name, value in os.environ.items()
                       if not name.startswith(('PYTHON', 'AMENT', 'COLCON', 'W2B', 'ROS'))}
        return subprocess.run([folder / 'venv' / 'bin' / program, *arguments], cwd=folder,
                              env=environment, capture_output=True, text=True, timeout=120,
                              check=False)
    return run


def lend(site: Path, *names: str) -> None:
    """Link packages of this environment into another."""
    for name in names:
        found = find_spec(name)
        assert found is not None, name
        package = Path(found.submodule_search_locations[0])
        (site / name).symlink_to(package)
        libraries = package.with_name(f'{name}.libs')
        if libraries.is_dir():
            (site / libraries.name).symlink_to(libraries)


PROGRAM = """
import importlib.util, json
import w2b_core, w2b_sim, training
from w2b_core.controller import file
from w2b_core.vocabulary import Vocabulary
from pathlib import Path
from w2b_core.mind import mind_of
mind = mind_of(file.load(file.shipped('quadruped_serial')))
print(json.dumps({
    'from': w2b_core.__file__, 'version': w2b_core.__version__,
    'ros': importlib.util.find_spec('rclpy') is not None,
    'numba': importlib.util.find_spec('numba') is not None,
    'joints': len(mind.motors), 'follows': mind.follows,
    'body': file.load(file.shipped('quadruped_serial')).body,
    'words': len(Vocabulary.load().words),
    'configs': sorted(p.name for p in Path(training.__file__).parent.glob('configs/*.yaml'))}))
"""


def test_the_wheel_works_in_an_empty_environment_without_ros(elsewhere):
    done = elsewhere('python', '-c', PROGRAM)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert str(ROOT) not in said['from']
    assert not said['ros']
    assert not said['numba']
    assert said['version'] == w2b_core.__version__
    assert (said['joints'], said['follows']) == (8, False)
    assert said['body'] == 'quadruped'
    assert said['words'] > 26_000
    assert 'paper.yaml' in said['configs']


@pytest.mark.parametrize(('command', 'expected'), [
    (('w2b', '--help'), 'usage: w2b'), (('w2b', 'urdf', 'quadruped'), '<robot'),
    (('w2b', 'vocabulary', '--help'), 'usage'), (('w2b', 'arm', '--help'), 'usage: w2b arm')])
def test_its_commands_run(elsewhere, command, expected):
    done = elsewhere(*command)
    assert done.returncode == 0, done.stderr
    assert expected in done.stdout


def test_a_command_that_needs_more_says_which_extra(elsewhere):
    done = elsewhere('w2b', 'stop')
    assert done.returncode == 2
    assert "pip install '.[ros]'" in done.stderr
