"""Rates of commanded leaky networks beside primed ones on the same body, and MuJoCo's C loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from w2b_core.behaviours import DEFAULT_BEHAVIOURS
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_core.network.sharing import Sharing
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.batched.leaky_engine import LeakyEngine
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS, World

BODY = 'physical_twin'
CONTROLLERS, COMMANDS = 24, 4
SENSES = ('heading', 'steer', 'yaw_rate')
#: Physics steps of a control period in a world with dry friction: those of fine training.
FINE_STEPS = 20
MUJOCO_EVALUATIONS = 2


def tasks(body: Body) -> dict[str, tuple[int, Callable[[], object]]]:
    """
    Return name -> (evaluations, call): the same number of robots, for the same time.

    `serial` are primed networks of the body's five neurons; `leaky` commanded ones of 14 that
    record every frame; `mujoco` its compiled loop alone (`mujoco.rollout`), without a network,
    whose joints hold the rest pose.
    """
    world = WORLDS[body.world]
    if world.friction is not None:
        world = replace(world, physics_steps=FINE_STEPS)
    rng = np.random.default_rng(1)
    hidden, joints = body.hidden_neurons, len(body.joints)
    serial = Network(rng.normal(size=(CONTROLLERS, hidden, hidden + 1 + len(body.sensors))),
                     rng.normal(size=(CONTROLLERS, joints, hidden)),
                     np.array([joint.time_constant for joint in body.joints]))
    words = rng.normal(scale=0.17, size=(COMMANDS, 300))
    sharing = Sharing(body, DEFAULT_BEHAVIOURS, SENSES, ())
    leaky = sharing.network(rng.normal(scale=0.5, size=(CONTROLLERS, sharing.size)))
    commands = np.eye(len(DEFAULT_BEHAVIOURS))[:COMMANDS, None]
    seconds = [(world.steps - 1) * world.control_period_s]
    primed = BatchedEngine(body, world, 'single')
    commanded = LeakyEngine(body, world, hidden=sharing.hidden.count, senses=SENSES)
    count = CONTROLLERS * COMMANDS
    return {'serial': (count, lambda: primed.evaluate(serial, words, [Start()])),
            'leaky': (count, lambda: commanded.record(leaky, commands, seconds)),
            'mujoco': (MUJOCO_EVALUATIONS, _mujoco(body, world))}


def _mujoco(body: Body, world: World) -> Callable[[], object]:
    import mujoco
    from mujoco import rollout

    from w2b_sim.engines.mujoco_model import substeps, to_mjcf

    model = mujoco.MjModel.from_xml_string(to_mjcf(body, world))
    data = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros(size)
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    steps = (world.steps - 1) * world.physics_steps * substeps(world)
    return lambda: rollout.rollout(model, data, np.tile(start, (MUJOCO_EVALUATIONS, 1)),
                                   nstep=steps)


def line(rates: dict[str, float]) -> str:
    """Return the rates, evaluations a second and core, as a line."""
    return (f'{BODY}, steps of {1e3 * WORLDS["earth"].control_period_s / FINE_STEPS:g} ms: '
            f'{rates["serial"]:,.0f} evaluations a second of primed networks, '
            f'{rates["leaky"]:,.0f} of commanded ones ({rates["leaky"] / rates["serial"]:.2f} '
            f'times), {rates["mujoco"]:.1f} of MuJoCo\'s compiled loop')
