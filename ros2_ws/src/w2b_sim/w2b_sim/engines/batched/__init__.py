"""The batched servo-kinematic engine: whole evaluations in one compiled call, one robot a lane."""

from w2b_sim.engines import jit as jit  # before any other use of numba
from w2b_sim.engines.batched.engine import BatchedEngine
from w2b_sim.engines.batched.supported import UnsupportedBodyError
from w2b_sim.engines.batched.variations import Variations

__all__ = ['BatchedEngine', 'UnsupportedBodyError', 'Variations']
