"""What every batched engine is made of: a body's tables, a layout, clocks, and threads."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_sim.engines.batched import kernel, standing
from w2b_sim.engines.batched.compilation import (
    announced,
    compiled_evaluate_recorded,
    lanes_for,
)
from w2b_sim.engines.batched.contacts import CONTACT_GAP_M
from w2b_sim.engines.batched.layout import Layout
from w2b_sim.engines.batched.recording_kernel import FrameLog, RecordedBatch
from w2b_sim.engines.batched.supported import UnsupportedBodyError
from w2b_sim.engines.batched.tables import CompiledBody, compile_body
from w2b_sim.engines.interface import Start
from w2b_sim.recording import Recording
from w2b_sim.worlds import World

Array = NDArray[np.float64]
logger = logging.getLogger(__name__)

BITS = {'single': 32, 'float32': 32, 'double': 64, 'float64': 64}
#: Sweeps of the viscous solve's two stages: in double precision until they change nothing, in
#: single what evolution needs (more sweeps agree no better with the original, for chaos hides it).
VISCOUS_SWEEPS = {32: (4, 6), 64: (24, 32)}
COULOMB_SWEEPS = 10
#: Torque-limited joints' rows are strongly coupled to those of dry friction and converge slowly.
DYNAMIC_COULOMB_SWEEPS = {32: 12, 64: 20}
#: ... and their visits wait for one another: more lanes than a register has fill the time.
DYNAMIC_COULOMB_REGISTERS = 2
#: In worlds with dry friction, whose reference is PyBullet, a contact begins at Bullet's distance:
#: within it a link may approach the floor by the gap that is left, and no more, in a step.
SPECULATIVE_GAP_M = 0.02
#: ... but no farther than a link can fall in a step: a contact beyond that does nothing.
FASTEST_FALL_M_S = 2.0
#: Shares of a batch a thread: more than one, so that a thread on a busy core takes fewer.
SHARES_PER_THREAD = 2
#: A friction coefficient that nothing reaches, in place of infinity (which times zero is NaN).
UNBOUNDED_FRICTION = 1e30


class Machine:
    """
    A body in a world, ready for compiled calls.

    Parameters
    ----------
    body, world
        What moves, and where.
    precision
        `double` (`float64`) or `single` (`float32`).
    threads
        That share a batch; the compiled code runs without the interpreter's lock.
    friction_law
        `world` as the world has it, or `coulomb` to use the dry friction solve in any world: what
        `Variations.friction` needs.
    joints
        See `tables.compile_body`.
    physics_steps
        In a control period instead of the world's: fewer for speed. docs/engine.md has what that
        costs the physical twin in truth.
    sweeps
        Of the solve's stages; None for the precision's own, or as many more as the body needs to
        stand still in a world with dry friction (see `standing`).
    lanes
        None for what suits the processor.
    say
        Called with one line when code is compiled; None for this module's logger.

    Raises
    ------
    UnsupportedBodyError
        If the engine does not model the body, with the reason.
    ValueError
        If an option is not one of those named.

    """

    #: Whether it runs commanded leaky networks.
    LEAKY: ClassVar[bool] = False

    def __init__(self, body: Body, world: World, precision: str = 'double', threads: int = 1, *,
                 friction_law: str = 'world', joints: str = 'auto',
                 physics_steps: int | None = None, sweeps: tuple[int, int] | None = None,
                 lanes: int | None = None, say: Callable[[str], None] | None = None) -> None:
        if precision not in BITS:
            raise ValueError(f'precision: expected one of {", ".join(BITS)}, got {precision!r}')
        if threads < 1:
            raise ValueError(f'threads: expected at least 1, got {threads}')
        if friction_law not in ('world', 'coulomb'):
            raise ValueError(f"friction_law: expected 'world' or 'coulomb', got {friction_law!r}")
        if physics_steps is not None:
            world = replace(world, physics_steps=physics_steps)
        compiled = compile_body(body, world, joints, leaky=self.LEAKY)
        self.body, self.world, self.threads = body, world, threads
        self._say = say
        bits = BITS[precision]
        self._dtype = np.float32 if bits == 32 else np.float64
        self._tables = compiled.cast(self._dtype)
        self._compiled = compiled
        coulomb = friction_law == 'coulomb' or world.friction is not None
        if not coulomb and world.slip_m_per_n_s <= 0:
            raise UnsupportedBodyError(
                f'world {world.name}: unbounded friction needs slip above 0, '
                f'got {world.slip_m_per_n_s}')
        slow = coulomb and len(compiled.tables.dynamic_link) > 0
        if lanes is None:
            lanes = lanes_for(bits) * (DYNAMIC_COULOMB_REGISTERS if slow else 1)
        self.layout = _layout(compiled, bits, lanes, coulomb)
        # Where friction slips as well, a body that creeps may be right.
        self._choose = (sweeps is None and slow and world.friction is not None
                        and world.slip_m_per_n_s == 0)
        if sweeps is None:
            sweeps = ((0, DYNAMIC_COULOMB_SWEEPS[bits] if slow else COULOMB_SWEEPS) if coulomb
                      else VISCOUS_SWEEPS[bits])
        #: Of the contact solve's two stages, where the body needs no more to stand still.
        self.usual_sweeps = sweeps
        h = world.physics_step_s
        speculative = world.friction is not None
        self._clock = kernel.Clock(
            h, world.physics_steps, world.steps, *sweeps,
            min(SPECULATIVE_GAP_M, FASTEST_FALL_M_S * h) if speculative else CONTACT_GAP_M,
            1 / h if speculative else 0.0)

    @property
    def sweeps(self) -> tuple[int, int]:
        """Sweeps of the contact solve's two stages."""
        self._settle()
        return self._clock.first_sweeps, self._clock.second_sweeps

    def standing_creep_m(self, sweeps: int) -> float:
        """
        Return how far the base moves in `standing.STAND_S`, with so many sweeps, m.

        The body stands from its start with every servo at the middle of its joint; the first
        `standing.SETTLE_S` do not count.
        """
        begin, end = (self._stand(self._clock._replace(
            second_sweeps=sweeps, steps=1 + round(seconds / self.world.control_period_s)))
            for seconds in (standing.SETTLE_S, standing.SETTLE_S + standing.STAND_S))
        return float(np.linalg.norm(end - begin))

    def _stand(self, clock: kernel.Clock) -> Array:
        """Return where the base (3,) is after `clock.steps` frames without any motor command."""
        raise NotImplementedError

    def _settle(self) -> None:
        """Choose the sweeps that the body stands with, before the first evaluation."""
        if not self._choose:
            return
        self._choose = False
        usual = self._clock.second_sweeps
        key = (self.body.links, self.body.joints, self.body.height_m, self.world,
               self.layout.bits, self._tables.dynamic.tobytes())
        sweeps, creep = standing.enough_sweeps(key, usual, self.standing_creep_m)
        if sweeps != usual:
            self._clock = self._clock._replace(second_sweeps=sweeps)
            (self._say or logger.info)(
                f'{self.body.name}: {sweeps} sweeps of the contact solve, not {usual}, so that it '
                f'stands still (it creeps {1e3 * creep:.2f} mm in {standing.STAND_S:g} s); '
                f'`python -m training standing` tells what that costs')

    def _share(self, run: Callable[[int, int], None], blocks: int, layout: Layout) -> None:
        """Call `run`, which is compiled for `layout`, for ranges of blocks, in threads."""
        shares = 1 if self.threads == 1 else min(self.threads * SHARES_PER_THREAD, blocks)
        edges = np.linspace(0, blocks, shares + 1).astype(int)
        with announced(layout, self._say):
            if len(edges) == 2:
                run(0, blocks)
            else:
                list(_pool(self.threads).map(run, edges[:-1].tolist(), edges[1:].tolist()))

    def _phases(self, seconds: Sequence[float]) -> NDArray[np.int64]:
        """Return the phase (T,) of each frame; a last one sees what the last phase did."""
        frames = [round(length / self.world.control_period_s) for length in seconds]
        if min(frames, default=0) < 1:
            raise ValueError(f'seconds: expected phases of at least '
                             f'{self.world.control_period_s} s, got {list(seconds)}')
        return np.repeat(np.arange(len(frames)), [*frames[:-1], frames[-1] + 1])

    @property
    def _frame_widths(self) -> tuple[int, ...]:
        """Numbers of one frame in each array of a `FrameLog`."""
        joints = self.layout.joints
        return 3, 4, 1, joints, joints, self.layout.touches, joints, joints

    def _recorded(self, batch: RecordedBatch, shape: tuple[int, int, int],
                  clock: kernel.Clock | None = None) -> Recording:
        """
        Run a batch of evaluations (C, W, K) and return their recordings (C, W, K, T, ...).

        `clock` is the machine's, of as many steps as there are frames, if it is not given.
        """
        count, layout, frames = len(batch.start), replace(self.layout, records=1), len(batch.phase)
        if clock is None:
            self._settle()
            clock = self._clock._replace(steps=frames)
        log = FrameLog(*(np.zeros((count, frames, width), dtype=self._dtype)
                         for width in self._frame_widths))
        evaluate = compiled_evaluate_recorded()

        def run(first: int, last: int) -> None:
            evaluate(layout, self._tables, clock, batch, log, first, last)
        self._share(run, -(-count // layout.lanes), layout)
        place, turn, rate, angle, target, touch, effort, limited = (
            array.reshape(*shape, *array.shape[1:]) for array in log)
        return Recording(self.world.control_period_s, place, turn, rate[..., 0], angle, target,
                         touch, effort, limited)

    def _seeds(self, given: dict[str, Array], shape: tuple[int, int, int]) -> NDArray[np.uint32]:
        """Return the seeds of evaluations (C, W, K), padded to whole blocks of lanes."""
        seeds = np.broadcast_to(given['seed'], shape).ravel()
        return lane_seeds(seeds, -(-len(seeds) // self.layout.lanes) * self.layout.lanes)

    def _starts(self, starts: Sequence[Start], given: dict[str, Array]) -> list[Array]:
        """Return height and quaternion w, x, y, z: turned by roll, then pitch, then yaw."""
        def angle(name: str) -> Array:
            return given[name] + np.array([getattr(start, name) for start in starts])
        half = [angle(name) / 2 for name in ('roll_rad', 'pitch_rad', 'yaw_rad')]
        (cr, cp, cy), (sr, sp, sy) = ([f(x) for x in half] for f in (np.cos, np.sin))
        return [self._compiled.height_m + angle('height_m'),
                cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]

    def _parameters(self, given: dict[str, Array]) -> list[Array]:
        """Return the columns of `kernel.Batch.parameters` (ValueError)."""
        h = self.world.physics_step_s
        slip = given['slip_m_per_n_s']
        if not self.layout.coulomb and ((slip <= 0).any()
                                        or np.isfinite(given['friction']).any()):
            raise ValueError("variations: friction and slip 0 need friction_law='coulomb'")
        return [given['erp'] / h, slip / h if self.layout.coulomb else h / slip,
                np.minimum(given['friction'], UNBOUNDED_FRICTION),
                given['gravity_m_s2'] * h, given['base_mass_scale'], given['touch_gap_m'],
                given['touch_delay'], given['touch_flip_probability'], given['push_m_s'],
                given['servo_gain_scale'], given['motor_noise_rad_s']]


def columns(values: Sequence[Array], shape: tuple[int, int, int]) -> Array:
    """Return values that broadcast to (C, W, K) as the columns of an array, a row an evaluation."""
    table = np.empty((*shape, len(values)))
    for column, value in enumerate(values):
        table[..., column] = value
    return table.reshape(-1, len(values))


def _layout(compiled: CompiledBody, bits: int, lanes: int, coulomb: bool) -> Layout:
    tables = compiled.tables
    return Layout(bits=bits, lanes=lanes, links=len(tables.parent),
                  contacts=len(tables.contact_link), hidden=compiled.hidden,
                  sensors=len(tables.sensor_kind), touches=len(compiled.touch_links),
                  dynamic=len(tables.dynamic_link), chain=int(tables.chain_length.max()),
                  coulomb=int(coulomb))


def lane_seeds(seeds: Array, padded: int) -> NDArray[np.uint32]:
    """Return well-mixed 32-bit seeds, padded to whole blocks."""
    mixed = seeds.astype(np.uint64)
    mixed = (mixed ^ (mixed >> np.uint64(31))) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    result = np.zeros(padded, dtype=np.uint32)
    result[:len(seeds)] = (mixed >> np.uint64(32)).astype(np.uint32)
    return result


def noisy(given: dict[str, Array], *more: str) -> bool:
    """Return whether a deviation asks for random numbers; `more` are those of one engine alone."""
    return any(given[name].any() for name in (
        'touch_delay', 'touch_flip_probability', 'push_m_s', 'motor_noise_rad_s', *more))


@lru_cache(maxsize=4)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix='batched-engine')
