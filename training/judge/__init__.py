"""The judge: what a controller does in an independent engine, under disturbances."""
