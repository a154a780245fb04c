"""`w2b COMMAND ...`: finds the subcommand and hands the rest of the command line to it."""

from __future__ import annotations

import importlib
import sys

from w2b_controller.cli.commands import COMMANDS
from w2b_core import __version__
from w2b_core.registry import PluginError

USAGE_ERROR = 2
#: What is installed where, for the message about a module that is missing.
INSTALL = ('in a checkout run `make build` and use `scripts/ros_env w2b ...`; with a standard '
           'Jazzy source its setup.bash and the workspace first; for the rest install the extra '
           "that has it, as in `pip install '.[sim]'`")


def main() -> int:
    """Run the command line; return the exit code."""
    arguments = sys.argv[1:]
    try:
        names = COMMANDS.names()
    except PluginError as error:
        print(f'w2b: {error}', file=sys.stderr)
        return USAGE_ERROR
    if not arguments or arguments[0] in ('-h', '--help', 'help'):
        print(_help())
        return 0 if arguments else USAGE_ERROR
    if arguments[0] == '--version':
        print(f'w2b {__version__}')
        return 0
    name = arguments[0]
    if name not in names:
        print(f'w2b: unknown command {name!r}: expected one of {", ".join(names)}',
              file=sys.stderr)
        return USAGE_ERROR
    module, _, function = COMMANDS.get(name).target.partition(':')
    sys.argv = [f'w2b {name}', *arguments[1:]]
    try:
        run = getattr(importlib.import_module(module), function)
        return int(run() or 0)
    except ModuleNotFoundError as error:
        print(f'w2b {name}: cannot start, the module {error.name} is missing; {INSTALL}',
              file=sys.stderr)
        return USAGE_ERROR
    except BrokenPipeError:
        # Who read our output has seen enough.
        sys.stderr.close()
        return 0


def _help() -> str:
    width = max(map(len, COMMANDS))
    lines = '\n'.join(f'  {name:{width}}  {COMMANDS.get(name).about}' for name in COMMANDS)
    return f'usage: w2b COMMAND [ARG ...]\n\n{lines}\n\nw2b COMMAND --help says more.'
