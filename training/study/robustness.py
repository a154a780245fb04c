"""
A study's champions scored again: `python -m training robustness CONFIG.yaml --out DIR`.

What `python -m training study` does after evolution, by itself: perturbed starts, PyBullet, and the
lexicon of words that no run heard (training/study/lexicon.yaml), as CONFIG.yaml's `robustness`
says. Only finished runs are scored, each once; changed settings score them anew.
"""

from __future__ import annotations

import argparse

from training.study import command


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    command.add_arguments(parser)


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    return command.run_command(args, ('rescore',))
