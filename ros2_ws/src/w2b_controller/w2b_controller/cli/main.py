"""`w2b COMMAND ...`: finds the subcommand and hands the rest of the command line to it."""

from __future__ import annotations

import importlib
import sys
from difflib import get_close_matches

from w2b_controller.cli.commands import COMMANDS
from w2b_core import __version__
from w2b_core.command_process import command
from w2b_core.registry import PluginError

USAGE_ERROR = 2


@command
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
        print(f'w2b: unknown command {name!r}: expected one of {", ".join(names)}'
              + ''.join(f'; did you mean {near!r}?' for near in get_close_matches(name, names, 1)),
              file=sys.stderr)
        return USAGE_ERROR
    module, _, function = COMMANDS.get(name).target.partition(':')
    sys.argv = [f'w2b {name}', *arguments[1:]]
    try:
        run = getattr(importlib.import_module(module), function)
        return int(run() or 0)
    except ModuleNotFoundError as error:
        print(f'w2b {name}: cannot start, the module {error.name} is missing; '
              + _what_to_install(str(error.name), COMMANDS.get(name).extras), file=sys.stderr)
        return USAGE_ERROR


def _what_to_install(module: str, extras: str) -> str:
    if module.startswith(('w2b_', 'training')):
        return ('build it in the workspace (`make build`), or use the checkout with its .venv '
                '(`make setup`)')
    ros = ' (a standard Jazzy has ROS: source it and the workspace)' if 'ros' in extras else ''
    return f"in the checkout run `python -m pip install '.[{extras or 'dev'}]'`{ros}"


def _help() -> str:
    width = max(map(len, COMMANDS))
    lines = '\n'.join(f'  {name:{width}}  {COMMANDS.get(name).about}' for name in COMMANDS)
    return f'usage: w2b COMMAND [ARG ...]\n\n{lines}\n\nw2b COMMAND --help says more.'


if __name__ == '__main__':
    sys.exit(main())
