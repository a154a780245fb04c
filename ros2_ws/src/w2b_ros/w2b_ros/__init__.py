"""What all nodes of the robot share: life cycle, parameters, messages, diagnostics."""
