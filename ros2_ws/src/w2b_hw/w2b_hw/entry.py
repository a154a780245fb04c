"""Entry points of the tools that need packages: of a missing one they say how to install it."""

from __future__ import annotations

from w2b_hw import command_line


@command_line.command
def preflight() -> int | None:
    """Run `preflight`."""
    from w2b_hw.preflight import main
    return main()


@command_line.command
def calibrate() -> int | None:
    """Run `calibrate`."""
    from w2b_hw.calibrate import main
    return main()


@command_line.command
def emulator() -> int | None:
    """Run `emulator`."""
    from w2b_hw.emulation.server import main
    return main()
