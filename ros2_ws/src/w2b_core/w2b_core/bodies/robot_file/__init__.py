"""
A maker's robot: one YAML beside a URDF, read as a `Body` with its wiring.

`read(path)` is what the registry of bodies does with a name that is a file. The YAML may name a
registered body instead of a URDF (`body: physical_twin`): it then holds its wiring alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from w2b_core.bodies.model import Body
from w2b_core.bodies.robot_file.build import build
from w2b_core.bodies.robot_file.findings import Finding, Findings, Grade, RobotFileError
from w2b_core.bodies.robot_file.names import plain_name
from w2b_core.bodies.robot_file.settings import Settings, read_settings
from w2b_core.bodies.robot_file.stance import Stance
from w2b_core.bodies.robot_file.urdf_reader import Urdf, read_urdf
from w2b_core.bodies.wiring import Wiring

__all__ = ['Finding', 'Findings', 'Grade', 'RobotFile', 'RobotFileError', 'Settings', 'Stance',
           'read']


@dataclass(frozen=True)
class RobotFile:
    """
    What a maker's file says.

    Attributes
    ----------
    body
        None if the file names a registered body.
    wiring
        Joint -> its servo; empty where the file says nothing.
    findings
        Warnings.

    """

    settings: Settings
    body: Body | None
    wiring: dict[str, Wiring]
    stance: Stance | None
    urdf: Urdf | None
    findings: tuple[Finding, ...]


def read(path: Path) -> RobotFile:
    """
    Return the robot that a maker's file describes.

    Raises
    ------
    RobotFileError
        If the file or its URDF cannot be used: its message is one line, its `findings` are all.

    """
    found = Findings(path)
    settings = read_settings(path, found)
    if settings.urdf is None:
        return RobotFile(settings, None, settings.wiring, None, None, tuple(found))
    urdf = read_urdf(settings.urdf, found)
    body, stance = build(urdf, settings, found)
    wiring = {plain_name('joint', name): one for name, one in settings.wiring.items()}
    return RobotFile(settings, body, wiring, stance, urdf, tuple(found))
