"""What colcon installs: proper ament_python packages."""

import ast
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

SOURCES = Path(__file__).resolve().parents[2] / 'ros2_ws' / 'src'
PACKAGES = {'w2b_controller': {'brain', 'console', 'say', 'vocabulary', 'w2b'},
            'w2b_sim': {'sim', 'urdf'}}


@pytest.mark.parametrize('package', PACKAGES)
def test_the_executables_are_where_ros2_run_looks_for_them(installed, package):
    folder = installed / package / 'lib' / package
    assert PACKAGES[package] <= {path.name for path in folder.iterdir()}


@pytest.mark.parametrize('package', PACKAGES)
def test_the_package_is_in_the_index_with_its_files(installed, package):
    prefix = installed / package
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
    assert marker.is_file()
    share = prefix / 'share' / package
    assert {'package.xml', 'LICENSE', 'config', 'launch'} <= {path.name
                                                              for path in share.iterdir()}
    assert all(yaml.safe_load(path.read_text()) for path in (share / 'config').glob('*.yaml'))
    assert list((share / 'launch').glob('*.launch.py'))


def test_data_files_are_installed_with_the_modules(installed, environment):
    for module, folder in (('controllers', '*.json'), ('vocabularies/default', '*')):
        source = SOURCES / 'w2b_core' / 'w2b_core' / module
        names = {path.name for path in source.glob(folder) if path.is_file()}
        assert names
        found = {path.name for path in installed.glob(
            f'w2b_core/lib/python3*/site-packages/w2b_core/{module}/{folder}')}
        assert names <= found


#: Keys of rosdep for libraries from PyPI; those without one are in requirements/.
ROSDEP = {'numpy': 'python3-numpy', 'yaml': 'python3-yaml', 'rich': 'python3-rich',
          'pybullet': 'python3-pybullet-pip', 'numba': 'python3-numba',
          'smbus2': 'python3-smbus2', 'scipy': 'python3-scipy', 'matplotlib': 'python3-matplotlib',
          'aiohttp': 'python3-aiohttp', 'defusedxml': 'python3-defusedxml'}
NO_KEY = {'mcap', 'mcap_ros2', 'zstandard',
          'gensim', 'imufusion', 'adafruit_pca9685', 'mujoco', 'llvmlite'}
#: Imported for one mode of a workstation only; the robot must not need them. `rich` draws the bar
#: of an installation of vectors, `trimesh` reads meshes of a robot that is imported; pocketsphinx
#: and sounddevice are what push to talk needs.
OPTIONAL = {'w2b_hw': {'w2b_sim'}, 'w2b_core': {'rich'}, 'w2b_sim': {'trimesh'},
            'w2b_web': {'pocketsphinx', 'sounddevice'}}
EVERY_PACKAGE = sorted(path.parent.name for path in SOURCES.glob('*/package.xml'))


def imported(package: str) -> set[str]:
    """Return the top names of all that a package's modules and launch files import."""
    names = set()
    for path in (*(SOURCES / package / package).rglob('*.py'),
                 *(SOURCES / package / 'launch').glob('*.py')):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names |= {name.name.partition('.')[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add(str(node.module).partition('.')[0])
    return names - set(sys.stdlib_module_names) - {package, '__future__'}


@pytest.mark.parametrize('package', EVERY_PACKAGE)
def test_the_manifest_is_format_3_and_declares_all_that_is_imported(package):
    root = ET.parse(SOURCES / package / 'package.xml').getroot()
    assert root.get('format') == '3'
    assert root.findtext('license') == 'Apache-2.0'
    assert root.findtext('export/build_type') == 'ament_python'
    assert root.findtext('name') == package
    declared = {node.text for node in root.iter('exec_depend')}
    assert {ROSDEP.get(name, name) for name in
            imported(package) - NO_KEY - OPTIONAL.get(package, set())} <= declared
    assert {node.text for node in root.iter('test_depend')} == {'python3-pytest'}
    if (SOURCES / package / 'launch').is_dir():
        assert {'launch', 'launch_ros'} <= declared


def test_colcon_tests_every_package(installed, environment, tmp_path):
    """Each brings tests that colcon finds, runs and counts."""
    done = subprocess.run(
        [sys.executable, '-m', 'colcon', '--log-base', str(tmp_path / 'log'), 'test',
         '--base-paths', str(SOURCES), '--build-base', str(installed.parent / 'build'),
         '--install-base', str(installed), '--test-result-base', str(tmp_path / 'results'),
         '--executor', 'sequential', '--return-code-on-test-failure'],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    results = {path.parent.name: ET.parse(path).getroot() for path in
               (tmp_path / 'results').glob('*/pytest.xml')}
    assert sorted(results) == EVERY_PACKAGE
    for package, root in results.items():
        suite = next(root.iter('testsuite'))
        passed = int(suite.get('tests')) - int(suite.get('skipped'))
        assert passed >= 1, package
        assert suite.get('failures') == suite.get('errors') == '0', package


@pytest.mark.parametrize(('package', 'executable'), [
    ('w2b_controller', 'console'), ('w2b_controller', 'say'), ('w2b_controller', 'vocabulary')])
def test_the_commands_explain_themselves(installed, environment, package, executable):
    done = subprocess.run([installed / package / 'lib' / package / executable, '--help'],
                          env=environment, capture_output=True, text=True, timeout=120, check=True)
    assert 'usage' in done.stdout


@pytest.mark.parametrize('path', sorted(SOURCES.glob('*/launch/*.launch.py')),
                         ids=lambda path: path.name)
def test_a_launch_file_describes_its_arguments(path):
    pytest.importorskip('launch_ros', reason='launch comes with a standard Jazzy only')
    from launch.actions import DeclareLaunchArgument
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    description = get_launch_description_from_python_launch_file(str(path))
    arguments = [entity for entity in description.entities
                 if isinstance(entity, DeclareLaunchArgument)]
    assert arguments
    assert all(argument.description for argument in arguments)
