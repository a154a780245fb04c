"""
Real descriptions, which do not ship: every URDF in the folder that W2B_ROBOT_DESCRIPTIONS names.

A robot is a folder with one or more expanded URDFs, its meshes in `meshes` or as the URDF names
them. Each is drafted with `--approximate`, checked and exported. What cannot be drafted must say
why in lines with a remedy.
"""

import os
import shutil
from pathlib import Path

import mujoco
import pytest

from w2b_core.bodies import robot_file
from w2b_core.bodies.robot_file import Grade, RobotFileError
from w2b_sim.own_robot import standing
from w2b_sim.own_robot.command import main

VARIABLE = 'W2B_ROBOT_DESCRIPTIONS'
FOLDER = os.environ.get(VARIABLE, '')
#: Robots that are known to be in order as they are; others may lack masses.
WHOLE = ('mini_pupper_2', 'spot_mini', 'bittle_esp32')


def urdfs() -> list[Path]:
    return sorted(Path(FOLDER).glob('*/*.urdf')) if FOLDER else []


def test_there_are_descriptions_where_the_variable_points():
    if not FOLDER:
        pytest.skip(f'{VARIABLE} names no folder of robot descriptions')
    assert urdfs(), f'{VARIABLE}={FOLDER}: expected folders with a URDF each'


@pytest.mark.parametrize('urdf', [pytest.param(path, id=path.parent.name + '/' + path.stem)
                                  for path in urdfs()])
def test_a_real_robot_is_drafted_stands_and_is_exported(urdf, tmp_path, capsys):
    path = tmp_path / urdf.name
    shutil.copy(urdf, path)
    yaml = path.with_suffix('.yaml')
    code = main(['init', str(path), '--approximate', '--meshes', str(urdf.parent)])
    said = capsys.readouterr()
    errors = [line for line in (said.out + said.err).splitlines() if line.startswith('error')]
    if code or errors:
        assert urdf.parent.name not in WHOLE, errors
        assert errors
        assert all('; ' in line for line in errors), errors
        with pytest.raises(RobotFileError) as refused:
            robot_file.read(yaml)
        assert all(one.fix for one in refused.value.findings if one.grade is Grade.ERROR)
        return
    body = robot_file.read(yaml).body
    assert len(body.joints) in (8, 12)
    for engine in ('pybullet', 'mujoco'):
        stood = standing.stand(body, engine)
        assert stood.problem == '', stood
    assert main(['export', str(yaml), '--out', str(tmp_path / 'out')]) == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / 'out' / f'{body.name}.xml'))
    assert model.body_mass.sum() == pytest.approx(sum(link.mass_kg for link in body.links))
