"""
Where the batched engine's time goes, by variation: what `python -m training bench --profile` tells.

A sampling profiler cannot name the parts of one compiled call, so each part is varied instead: an
evaluation without steps is priming alone, and one with twice the sweeps costs the sweeps once more.
More lanes than a vector register holds give the processor independent work to overlap, at the price
of more first-level cache: which of the two wins says what bounds the engine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import thread_time

from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS, World

ROUNDS = 7


def seconds(engines: Mapping[str, BatchedEngine], network: Network, words: object,
            rounds: int = ROUNDS) -> dict[str, float]:
    """Return each engine's processor time for the same batch, best of `rounds` in turn, s."""
    best = dict.fromkeys(engines, float('inf'))
    for engine in engines.values():
        engine.evaluate(network, words, [Start()])  # type: ignore[arg-type]
    for _ in range(rounds):
        for name, engine in engines.items():
            began = thread_time()
            engine.evaluate(network, words, [Start()])  # type: ignore[arg-type]
            best[name] = min(best[name], thread_time() - began)
    return best


def profile(body: Body, network: Network, words: object,
            engine: Callable[..., BatchedEngine] = BatchedEngine) -> dict[str, dict[str, float]]:
    """
    Return the shares of an evaluation in single precision, and the speed at other lane counts.

    `shares`: `priming`, `contact_sweeps` and `rest` (kinematics, balance, network, integration), of
    one. `lanes`: number of lanes -> speed relative to the default's.
    """
    world: World = WORLDS[body.world]
    usual = engine(body, world, 'single')
    first, second = usual.sweeps
    lanes = usual.layout.lanes
    times = seconds({
        'usual': usual,
        'primed': engine(body, replace(world, steps=1), 'single'),
        'twice': engine(body, world, 'single', sweeps=(2 * first, 2 * second)),
        **{f'lanes {count}': engine(body, world, 'single', lanes=count)
           for count in (lanes // 2, 2 * lanes)}}, network, words)
    whole = times['usual']
    priming = times['primed'] / whole
    sweeps = times['twice'] / whole - 1.0
    return {'shares': {'priming': priming, 'contact_sweeps': sweeps,
                       'rest': 1.0 - priming - sweeps},
            'lanes': {name.removeprefix('lanes '): whole / time
                      for name, time in times.items() if name.startswith('lanes ')}}


def lines(measured: Mapping[str, Mapping[str, float]]) -> str:
    """Return a profile as text."""
    shares = ', '.join(f'{name.replace("_", " ")} {share:.0%}'
                       for name, share in measured['shares'].items())
    speeds = ', '.join(f'{count} lanes {speed:.2f} times'
                       for count, speed in measured['lanes'].items())
    return f'an evaluation: {shares}; speed with {speeds} that of the default'
