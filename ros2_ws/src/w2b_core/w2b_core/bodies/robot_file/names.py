"""Names that ROS, controller files and senses can hold: letters, digits and _."""

from __future__ import annotations

import re
from collections.abc import Iterable

from w2b_core.bodies.robot_file.findings import Findings


def plain_name(kind: str, name: str) -> str:
    """Return a name with _ for spaces, hyphens and the like; a letter comes first."""
    made = re.sub(r'[^A-Za-z0-9_]', '_', name)[:100]
    return made if made[0].isalpha() else f'{kind}_{made}'[:100]


def plain_names(kind: str, names: Iterable[str], found: Findings) -> dict[str, str]:
    """
    Return given name -> its `plain_name`.

    A name that changes is a warning, two that become one an error.
    """
    plain: dict[str, str] = {}
    changed = []
    for name in names:
        made = plain_name(kind, name)
        if made in plain.values():
            other = next(one for one, its in plain.items() if its == made)
            found.error(f'{kind} {name}', f'would be called {made}, as {other} is',
                        'rename one of them')
        if made != name:
            changed.append(name)
        plain[name] = made
    if changed:
        first = changed[0]
        found.warn(f'{kind} {first}', f'is called {plain[first]} here'
                   + (f', and {len(changed) - 1} other {kind}s so' if len(changed) > 1 else '')
                   + ': a name has letters, digits and _',
                   'rename it in the URDF if that is not what you want')
    return plain
