"""
The two networks, as pure functions.

`serial` is the paper's: a word is primed into the hidden neurons. `leaky` is what a separate ear
drives: leaky neurons with a command and senses at every step.
"""

from w2b_core.network.leaky import Drive, LeakyNetwork, LeakyState
from w2b_core.network.serial import Network, State, prime, step

__all__ = ['Drive', 'LeakyNetwork', 'LeakyState', 'Network', 'State', 'prime', 'step']
