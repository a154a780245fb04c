"""The inertial measurement unit: parts, a registry that finds them, and orientation."""
