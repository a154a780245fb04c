"""The controller file: what a controller is, read and written as validated JSON."""
