"""The package by itself: numpy and PyYAML are all that it needs."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from w2b_core.controller import file as controller_file

PACKAGE = Path(__file__).resolve().parents[2] / 'ros2_ws' / 'src' / 'w2b_core'
ALLOWED = ('numpy', 'yaml')
#: Imports whatever is named first, with nothing in reach but the standard library and ALLOWED.
ALONE = """
import importlib.abc, sys
from pathlib import Path

allowed = {*sys.stdlib_module_names, *ALLOWED, 'w2b_core'}

class Nothing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] not in allowed:
            raise ModuleNotFoundError(f'not in reach: {name}', name=name)

sys.meta_path.insert(0, Nothing())
"""
EVERY_MODULE = """
import importlib, pkgutil, w2b_core
names = [module.name for module in pkgutil.walk_packages(w2b_core.__path__, 'w2b_core.')
         if not module.name.endswith('__main__')]
for name in names:
    importlib.import_module(name)
print(len(names))
"""
WALK = """
from w2b_core import bodies
from w2b_core.brain import Brain
from w2b_core.controller import file as controller_file
from w2b_core.sensor_frames import SensorFrame
from w2b_core.vocabulary import Vocabulary

controller = controller_file.load(controller_file.shipped(CONTROLLER))
brain = Brain(controller, Vocabulary.load(), frame_timeout_s=0.5, clock=lambda: 0.0)
joints = {motor.joint: 0.0 for motor in controller.motors}
feet = {name[6:]: True for name in controller.sensors if name.startswith('touch:')}
period = round(controller.period_s * 1e9)
answer = brain.hear('march')
targets = [brain.sense(SensorFrame(number * period, joints, feet)).position_rad
           for number in range(1, 41)]
print(answer.level.name, max(abs(after - before).max()
                             for before, after in zip(targets, targets[1:])))
"""


def alone(script: str, *arguments: str, allowed: tuple[str, ...] = ALLOWED) -> str:
    done = subprocess.run(
        [sys.executable, '-c', ALONE.replace('ALLOWED', repr(allowed)) + script, *arguments],
        capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_module_imports():
    assert int(alone(EVERY_MODULE)) > 60


@pytest.mark.parametrize('name', controller_file.shipped_names())
def test_a_shipped_controller_hears_a_word_and_moves(name):
    level, step = alone(WALK.replace('CONTROLLER', repr(name))).split()
    assert level == 'OK'
    assert float(step) > 0.01


def test_the_guard_guards():
    """Without numpy it fails: the two tests above would notice a library more."""
    with pytest.raises(AssertionError, match='not in reach: numpy'):
        alone(EVERY_MODULE, allowed=('yaml',))


def test_the_lists_of_dependencies_say_the_same():
    text = (PACKAGE / 'setup.py').read_text()
    listed = re.search(r'install_requires=\[(.*?)\]', text)
    assert listed is not None
    assert set(re.findall(r"'([^']+)'", listed[1])) == {'setuptools', 'numpy', 'PyYAML'}
    needed = {part.text for part in ElementTree.parse(PACKAGE / 'package.xml').iter('exec_depend')}
    assert needed - {'python3-defusedxml'} == {'python3-numpy', 'python3-yaml'}
    assert '# defusedxml' in text, 'optional'
