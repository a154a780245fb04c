"""
Evolve a controller of the minimal robot for three words, and say a word to it.

Install:   pip install '.[train]'     (or in the checkout: make setup)
Usage:     python examples/evolve_minimal.py [--generations 300] [--out out/minimal]
Output:    DIR/champion.json (a controller file), DIR/statistics.npz, and one line a word
Run time:  300 generations take some seconds on one core, plus 10 to 60 s once to compile the engine

The same command again goes on from the last checkpoint.
"""

import argparse

from training.evolution.config import RunConfig
from training.evolution.run import run

WORDS = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))

parser = argparse.ArgumentParser(description=__doc__,
                                 formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument('--generations', type=int, default=300)
parser.add_argument('--population', type=int, default=50)
parser.add_argument('--engine', default='batched', help='batched (default), pybullet or mujoco')
parser.add_argument('--out', default='out/minimal', help='directory (default: out/minimal)')
options = parser.parse_args()

config = RunConfig(body='minimal', seed=1, words=WORDS, held_out=(('halt', 'stop'),),
                   generations=options.generations, population=options.population,
                   engine=options.engine)
result = run(config, options.out)
print(f'fitness {result.fitness:.3f} after {result.evaluations} evaluations')
for outcome in result.outcomes:
    (x_m, _y_m, _z_m), = outcome.final_position_m
    print(f'{outcome.word}: {x_m:+.2f} m along x')
print(f'{options.out}/champion.json')
