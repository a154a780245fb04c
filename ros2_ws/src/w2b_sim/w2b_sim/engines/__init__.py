"""The engines that move bodies: PyBullet, and the batched servo-kinematic engine."""
