"""The kinds of step: each takes candidates and a directory and returns candidates."""
