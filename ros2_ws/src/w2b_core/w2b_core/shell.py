"""Command lines in messages, as the user has to type them."""

from __future__ import annotations

import os

#: What runs a command of a workspace that is not sourced: set by scripts/ros_env and deploy/run.
RUNNER = 'W2B_RUN'


def w2b_command(command: str) -> str:
    """
    Return the command line of a `w2b` command, such as `w2b brain`, for the shell of the user.

    `command` is what follows `w2b`. A process that was started through `scripts/ros_env` or
    `deploy/run` gets that runner in front: the user's shell knows no `w2b` without it.
    """
    return ' '.join(filter(None, (os.environ.get(RUNNER, ''), 'w2b', command)))
