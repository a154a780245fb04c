"""What colcon installs: proper ament_python packages."""

import subprocess
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


@pytest.mark.parametrize('package', PACKAGES)
def test_the_manifest_is_format_3_and_names_every_imported_ros_package(package):
    root = ET.parse(SOURCES / package / 'package.xml').getroot()
    assert root.get('format') == '3'
    assert root.findtext('license') == 'Apache-2.0'
    assert root.findtext('export/build_type') == 'ament_python'
    assert root.findtext('name') == package
    declared = {node.text for node in root.iter('exec_depend')}
    sources = ''.join(path.read_text() for path in (SOURCES / package / package).rglob('*.py'))
    for name in ('rclpy', 'std_msgs', 'sensor_msgs', 'trajectory_msgs', 'diagnostic_msgs',
                 'nav_msgs', 'geometry_msgs', 'rosgraph_msgs', 'std_srvs', 'lifecycle_msgs',
                 'rcl_interfaces', 'builtin_interfaces', 'w2b_controller', 'w2b_core',
                 'w2b_ros'):
        if name != package and (f'from {name}.' in sources or f'import {name}' in sources):
            assert name in declared, name


@pytest.mark.parametrize(('package', 'executable'), [
    ('w2b_controller', 'console'), ('w2b_controller', 'say'), ('w2b_controller', 'vocabulary')])
def test_the_commands_explain_themselves(installed, environment, package, executable):
    done = subprocess.run([installed / package / 'lib' / package / executable, '--help'],
                          env=environment, capture_output=True, text=True, timeout=120, check=True)
    assert 'usage' in done.stdout


@pytest.mark.parametrize('path', sorted(SOURCES.glob('w2b_[cs]*/launch/*.launch.py')),
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
