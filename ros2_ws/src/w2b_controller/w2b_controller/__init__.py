"""The ROS 2 nodes of the brain: `brain`, `say`, `console`."""

