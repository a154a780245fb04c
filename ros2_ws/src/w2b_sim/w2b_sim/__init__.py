"""The simulated bodies and worlds, and the engines that move them."""
