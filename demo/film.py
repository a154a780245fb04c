"""The walking robot as a GIF at true speed: a camera follows it, its path stays on the floor."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet_data
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from demo.robot import Motion
from w2b_core.bodies import visuals
from w2b_core.bodies.model import Body
from w2b_core.bodies.urdf import to_urdf
from w2b_sim.engines.quiet_pybullet import pybullet

Array = NDArray[np.float64]

SIZE_PX = (480, 300)
FRAME_MS = 100
#: Distance of the camera, in body lengths; what it looks at trails behind the robot.
DISTANCE, TRAIL = 4.2, 0.15
GRID_M = 0.1
BACKGROUND = (246, 246, 243)
COLOURS = ('#1f77b4', '#d62728', '#2ca02c', '#9467bd', '#ff7f0e', '#8c564b', '#e377c2', '#17becf',
           '#7f7f7f')


@dataclass(frozen=True)
class Take:
    """A motion with its caption and the colour of its path."""

    motion: Motion
    caption: str
    colour: str


def draw_gif(body: Body, joint_names: Sequence[str], takes: Sequence[Take], period_s: float,
             path: Path) -> None:
    """Write the takes one after the other."""
    with Camera(body, joint_names) as camera:
        frames = [frame.quantize(48, dither=Image.Dither.NONE)
                  for frame in camera.film(takes, max(1, round(FRAME_MS / 1e3 / period_s)))]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0,
                   optimize=True)


class Camera:
    """A PyBullet world that only poses the body and takes pictures of it."""

    def __init__(self, body: Body, joint_names: Sequence[str]) -> None:
        self._length_m = body.length_m
        self._client = pybullet.connect(pybullet.DIRECT)
        here = self._here = {'physicsClientId': self._client}
        pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), **here)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / 'body.urdf'
            file.write_text(to_urdf(body, capsule_element=True, visuals=visuals.of(body)),
                            encoding='utf-8')
            self._robot = pybullet.loadURDF(str(file), useFixedBase=True, **here)
        numbers = {pybullet.getJointInfo(self._robot, number, **here)[1].decode(): number
                   for number in range(pybullet.getNumJoints(self._robot, **here))}
        self._joints = [numbers[name] for name in joint_names]
        self._target: Array | None = None
        self._font = ImageFont.load_default(18)

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_exception: object) -> None:
        pybullet.disconnect(**self._here)

    def film(self, takes: Sequence[Take], stride: int) -> list[Image.Image]:
        """Return every `stride`-th frame of the takes, with path and caption."""
        pictures = []
        paths: list[tuple[str, list[Array]]] = []
        for take in takes:
            places: list[Array] = []
            paths.append((take.colour, places))
            stamps = sorted(take.motion.poses.keys() & take.motion.joints.keys())
            for number, stamp in enumerate(stamps):
                places.append(np.array(take.motion.poses[stamp][0]))
                if number % stride == 0:
                    pictures.append(self._picture(take, stamp, paths))
        return pictures

    def _picture(self, take: Take, stamp: int, paths: Sequence[tuple[str, list[Array]]]
                 ) -> Image.Image:
        here, (width, height) = self._here, SIZE_PX
        position, orientation = take.motion.poses[stamp]
        pybullet.resetBasePositionAndOrientation(self._robot, position, orientation, **here)
        for number, angle in zip(self._joints, take.motion.joints[stamp], strict=True):
            pybullet.resetJointState(self._robot, number, angle, **here)
        place = np.array([position[0], position[1], 0.3 * self._length_m])
        self._target = place if self._target is None else (
            self._target + TRAIL * (place - self._target))
        view = pybullet.computeViewMatrixFromYawPitchRoll(
            self._target.tolist(), distance=DISTANCE * self._length_m, yaw=25, pitch=-28, roll=0,
            upAxisIndex=2)
        lens = pybullet.computeProjectionMatrixFOV(40, width / height, 0.02, 20)
        _w, _h, pixels, _depth, mask = pybullet.getCameraImage(
            width, height, view, lens, shadow=0, lightDirection=(1, -1, 2),
            renderer=pybullet.ER_TINY_RENDERER, **here)
        rgb = np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))[..., :3]
        robot = np.reshape(np.asarray(mask), (height, width)) >= 0
        picture = Image.new('RGB', SIZE_PX, BACKGROUND)
        self._draw_floor(ImageDraw.Draw(picture), _project(view, lens), paths)
        picture.paste(Image.fromarray(np.ascontiguousarray(rgb)), mask=Image.fromarray(robot))
        draw = ImageDraw.Draw(picture)
        draw.rectangle((0, 0, width, 28), fill='white')
        draw.rectangle((8, 8, 20, 20), fill=take.colour)
        draw.text((28, 4), take.caption, fill='black', font=self._font)
        return picture

    def _draw_floor(self, draw: ImageDraw.ImageDraw, project: Array,
                    paths: Sequence[tuple[str, list[Array]]]) -> None:
        """Draw a grid of 10 cm and what was walked so far; the robot is in front of both."""
        assert self._target is not None
        reach = 12 * self._length_m
        centre = np.round(self._target[:2] / GRID_M) * GRID_M
        offsets = np.arange(-np.floor(reach / GRID_M), np.floor(reach / GRID_M) + 1) * GRID_M
        for offset in offsets:
            for axis in (0, 1):
                ends = np.zeros((2, 3))
                ends[:, axis] = centre[axis] + np.array([-reach, reach])
                ends[:, 1 - axis] = centre[1 - axis] + offset
                _line(draw, project, ends, (222, 222, 216), 1)
        for colour, places in paths:
            if len(places) > 1:
                points = np.array(places)
                points[:, 2] = 0.0
                _line(draw, project, points, colour, 3)


def _project(view: Sequence[float], lens: Sequence[float]) -> Array:
    """Return the matrix (4, 4) from homogeneous world points to clip space."""
    product: Array = np.reshape(lens, (4, 4)).T @ np.reshape(view, (4, 4)).T
    return product


def _line(draw: ImageDraw.ImageDraw, project: Array, points: Array,
          colour: str | tuple[int, int, int], width: int) -> None:
    """Draw a line through world points (N, 3), as far as they lie before the camera."""
    # A long line is cut into pieces: one end of it may lie behind the camera.
    pieces = np.linspace(points[0], points[1], 24) if len(points) == 2 else points
    clip = np.column_stack([pieces, np.ones(len(pieces))]) @ project.T
    ahead = clip[:, 3] > 0.02
    screen = np.empty((len(pieces), 2))
    screen[ahead, 0] = (clip[ahead, 0] / clip[ahead, 3] + 1) / 2 * SIZE_PX[0]
    screen[ahead, 1] = (1 - clip[ahead, 1] / clip[ahead, 3]) / 2 * SIZE_PX[1]
    for index in range(len(pieces) - 1):
        if ahead[index] and ahead[index + 1]:
            draw.line((*screen[index], *screen[index + 1]), fill=colour, width=width)
