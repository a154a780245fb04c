"""`w2b COMMAND ...`: everything that w2b does, from one command."""

from __future__ import annotations

import importlib
import sys
from difflib import get_close_matches

from w2b_controller.cli.commands import COMMANDS, GROUPS, Command
from w2b_core import __version__
from w2b_core.shell import w2b_command

USAGE_ERROR = 2
#: Packages of this program: one that is missing is another part of the workspace.
_OWN = ('w2b_', 'training')


def help_text() -> str:
    """Return what `w2b --help` prints."""
    lines = ['usage: w2b COMMAND [ARGUMENT ...]', '',
             '`w2b COMMAND --help` explains a command. Exit code 0: done; 1: refused, with the',
             'reason; 2: nobody answered, or a usage error.']
    for title, group in GROUPS.items():
        lines += ['', f'{title}:', *(f'  {name:<12}{command.purpose}'
                                     for name, command in group.items())]
    return '\n'.join(lines)


def main() -> int:
    """Run the command line; return the exit code."""
    arguments = sys.argv[1:]
    if not arguments or arguments[0] in ('-h', '--help', 'help'):
        print(help_text(), file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else USAGE_ERROR
    name = arguments[0]
    if name == '--version':
        print(f'w2b {__version__}')
        return 0
    command = COMMANDS.get(name)
    if command is None:
        near = get_close_matches(name, COMMANDS, 1)
        hint = f'did you mean {near[0]!r}?' if near else f'see `{w2b_command("--help")}`'
        print(f'w2b: expected a command, got {name!r}; {hint}', file=sys.stderr)
        return USAGE_ERROR
    sys.argv = [f'w2b {name}', *arguments[1:]]
    try:
        module, _, function = command.target.partition(':')
        result = getattr(importlib.import_module(module), function)()
    except ModuleNotFoundError as error:
        print(f'w2b {name}: {missing(command, str(error.name))}', file=sys.stderr)
        return USAGE_ERROR
    return int(result or 0)


def missing(command: Command, module: str) -> str:
    """Return, in one line, what to install for a command that lacks a module."""
    if module.partition('.')[0].startswith(_OWN):
        return (f'expected the package {module.partition(".")[0]}, got none here; '
                "build it in the workspace (make build), or use the checkout's .venv (make setup)")
    extra = command.extra or 'dev'
    ros = ' (or source a ROS 2 Jazzy)' if 'ros' in extra else ''
    return (f'expected the Python module {module}, got none; in the checkout run '
            f"`python -m pip install '.[{extra}]'`{ros}")


if __name__ == '__main__':
    sys.exit(main())
