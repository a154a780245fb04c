"""`w2b status`: what body and brain say of themselves."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from w2b_controller.cli import client
from w2b_controller.cli.client import DONE, REFUSED, Client
from w2b_controller.say import values_of
from w2b_core.shell import w2b_command

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

LEVELS = ('ok', 'warning', 'ERROR', 'stale')
#: Nodes report every second: within this time each has.
ROUND_S = 1.5
ABOUT = """Print one line for each part of body and brain: level, name, message.
Exit code 0: no part reports an error. 1: one does. 2: no node reports."""


def main() -> int:
    """Print the status; return the exit code."""
    parser = client.parser('status', ABOUT)
    parser.add_argument('--json', action='store_true', help='print JSON, one object a part')
    options = parser.parse_args(client.arguments())

    def ask(connection: Client) -> int:
        parts = collect(connection, options.timeout)
        for name in sorted(parts):
            print(as_json(parts[name]) if options.json else line(parts[name]))
        sys.stdout.flush()
        return REFUSED if any(part.level[0] >= 2 for part in parts.values()) else DONE
    return client.run('status', ask)


def collect(connection: Client, timeout_s: float) -> dict[str, DiagnosticStatus]:
    """Return the last status of each part by name, heard within one round of reports."""
    from diagnostic_msgs.msg import DiagnosticArray
    parts: dict[str, DiagnosticStatus] = {}

    def keep(message: DiagnosticArray) -> None:
        parts.update({status.name: status for status in message.status})
    connection.node.create_subscription(DiagnosticArray, '/diagnostics', keep, 10)
    connection.wait(lambda: bool(parts), timeout_s,
                    f'no node reports on /diagnostics; start `{w2b_command("sim")}` or '
                    f'`{w2b_command("hardware")}`, and `{w2b_command("brain")}`')
    connection.spin(lambda: False, ROUND_S)
    return parts


def line(status: DiagnosticStatus) -> str:
    """Return a status as one line."""
    return f'{LEVELS[min(status.level[0], 3)]:<8} {status.name}: {status.message}'


def as_json(status: DiagnosticStatus) -> str:
    """Return a status as one line of JSON."""
    return json.dumps({'name': status.name, 'level': status.level[0], 'message': status.message,
                       'hardware_id': status.hardware_id, 'values': values_of(status)})
