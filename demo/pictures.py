"""The demo's pictures: paths as a plot, and the walking robot as a GIF, rendered off-screen."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pybullet_data
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from demo.robot import Motion
from w2b_core.bodies.model import Body
from w2b_core.bodies.urdf import to_urdf
from w2b_sim.engines.quiet_pybullet import pybullet

PANEL_PX = (400, 240)
GIF_FRAMES = 60
GIF_FRAME_MS = 80


def plot_paths(motions: Mapping[str, Motion], heard: set[str], path: Path) -> None:
    """Draw the path of the base under each word, from above."""
    figure = Figure(figsize=(8, 4.2), layout='constrained')
    axes = figure.subplots()
    for word, motion in motions.items():
        x, y = motion.positions_m[:, 0], motion.positions_m[:, 1]
        new = word not in heard
        kind = 'never heard' if new else 'heard in training'
        line, = axes.plot(x, y, '--' if new else '-', lw=1.8, label=f'{word} ({kind})')
        axes.plot(x[-1], y[-1], 'D' if new else 's', color=line.get_color(), ms=9,
                  mfc='none' if new else line.get_color())
    axes.plot(0, 0, 'k+', ms=16, label='start')
    axes.set(xlabel='x (m)', ylabel='y (m)', aspect='equal',
             title='Path of the robot in 25 s under each word')
    axes.margins(y=0.4)
    axes.grid(alpha=0.3)
    axes.legend(loc='upper center', bbox_to_anchor=(0.5, -0.18), ncols=3, frameon=False)
    # Equal axes leave room above and below; it is cut off.
    figure.savefig(path, dpi=130, bbox_inches='tight', pad_inches=0.15)


def draw_gif(body: Body, joint_names: Sequence[str], motions: Mapping[str, Motion],
             captions: Mapping[str, str], path: Path) -> None:
    """Render the motions beside each other, two in a row; a disc marks where each began."""
    reach_m = max(float(np.abs(motion.positions_m[:, :2]).max()) for motion in motions.values())
    with Camera(body, joint_names, distance_m=0.9 + reach_m) as camera:
        panels = {word: camera.film(motion, captions[word]) for word, motion in motions.items()}
    width, height = PANEL_PX
    rows = -(-len(panels) // 2)
    frames = []
    for number in range(GIF_FRAMES):
        sheet = Image.new('RGB', (2 * width, rows * height), 'white')
        for place, film in enumerate(panels.values()):
            sheet.paste(film[number], (place % 2 * width, place // 2 * height))
        frames.append(sheet.quantize(64, dither=Image.Dither.NONE))
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=GIF_FRAME_MS, loop=0,
                   optimize=True)


class Camera:
    """A PyBullet world that only poses the body and takes pictures of it."""

    def __init__(self, body: Body, joint_names: Sequence[str], distance_m: float) -> None:
        self._distance_m = distance_m
        self._client = pybullet.connect(pybullet.DIRECT)
        here = self._here = {'physicsClientId': self._client}
        pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), **here)
        pybullet.loadURDF('plane.urdf', **here)
        disc = pybullet.createVisualShape(pybullet.GEOM_CYLINDER, radius=0.06, length=0.002,
                                          rgbaColor=(0.8, 0.1, 0.1, 1.0), **here)
        pybullet.createMultiBody(0.0, baseVisualShapeIndex=disc, **here)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / 'body.urdf'
            file.write_text(to_urdf(body, capsule_element=True), encoding='utf-8')
            self._robot = pybullet.loadURDF(str(file), useFixedBase=True, **here)
        numbers = {pybullet.getJointInfo(self._robot, number, **here)[1].decode(): number
                   for number in range(pybullet.getNumJoints(self._robot, **here))}
        self._joints = [numbers[name] for name in joint_names]

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_exception: object) -> None:
        pybullet.disconnect(**self._here)

    def film(self, motion: Motion, caption: str) -> list[Image.Image]:
        """Return pictures at even intervals of a motion, with its caption."""
        stamps = sorted(motion.poses.keys() & motion.joints.keys())
        chosen = [stamps[index] for index in np.linspace(0, len(stamps) - 1, GIF_FRAMES, dtype=int)]
        return [self._picture(motion, stamp, caption) for stamp in chosen]

    def _picture(self, motion: Motion, stamp: int, caption: str) -> Image.Image:
        here, (width, height) = self._here, PANEL_PX
        position, orientation = motion.poses[stamp]
        pybullet.resetBasePositionAndOrientation(self._robot, position, orientation, **here)
        for number, angle in zip(self._joints, motion.joints[stamp], strict=True):
            pybullet.resetJointState(self._robot, number, angle, **here)
        view = pybullet.computeViewMatrixFromYawPitchRoll(
            [0.0, 0.0, 0.05], distance=self._distance_m, yaw=0, pitch=-30, roll=0, upAxisIndex=2)
        lens = pybullet.computeProjectionMatrixFOV(50, width / height, 0.05, 20)
        pixels = pybullet.getCameraImage(
            width, height, view, lens, shadow=1, lightDirection=(1, -1, 2),
            renderer=pybullet.ER_TINY_RENDERER, **here)[2]
        rgb = np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))[..., :3]
        picture = Image.fromarray(np.ascontiguousarray(rgb))
        draw = ImageDraw.Draw(picture)
        draw.rectangle((0, 0, width, 22), fill='white')
        draw.text((8, 4), caption, fill='black', font=ImageFont.load_default(14))
        return picture
