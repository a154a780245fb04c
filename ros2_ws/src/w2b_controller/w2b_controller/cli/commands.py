"""The subcommands of `w2b`, by name; a plugin adds one with `COMMANDS.add(name, Command(...))`."""

from __future__ import annotations

from dataclasses import dataclass

from w2b_core.registry import Registry


@dataclass(frozen=True)
class Command:
    """
    One subcommand.

    Attributes
    ----------
    target
        `module:function`, imported only when the command is given. The function takes no argument,
        reads `sys.argv`, and returns the exit code.
    about
        One line for `w2b --help`.

    """

    target: str
    about: str


COMMANDS: Registry[Command] = Registry('command')

_ROBOT = 'w2b_controller.cli.robot'
for _name, _target, _about in (
        ('say', 'w2b_controller.say:main', 'say a word to the brain and wait for its answer'),
        ('console', 'w2b_controller.console:main', 'type words, read the answers'),
        ('arm', f'{_ROBOT}:arm', 'let the servos follow the brain'),
        ('disarm', f'{_ROBOT}:disarm', 'park and relax the servos'),
        ('stop', f'{_ROBOT}:stop', 'emergency stop: servos off at once; a simulation pauses'),
        ('reset', f'{_ROBOT}:reset', 'put a simulated body back to its start'),
        ('pause', f'{_ROBOT}:pause', 'stop the clock of a simulation, or let it go on'),
        ('status', f'{_ROBOT}:status', 'how brain and body are'),
        ('echo', f'{_ROBOT}:echo', 'print what is published on a topic'),
        ('teach', 'w2b_controller.cli.teach:main', "add a word to a controller's ear"),
        ('brain', 'w2b_controller.brain:main', 'the node that hears words and moves a body'),
        ('sim', 'w2b_sim.sim:main', 'the node that simulates a body'),
        ('hardware', 'w2b_hw.node:main', 'the node that drives the servos of a robot'),
        ('calibrate', 'w2b_hw.calibrate:main', 'calibrate the servos, one by one'),
        ('preflight', 'w2b_hw.preflight:main', 'check bus, chips, calibration before arming'),
        ('relax', 'w2b_hw.relax:main', 'switch all servos off; needs nothing but the bus'),
        ('emulator', 'w2b_hw.emulation.server:main', 'the chips of a robot, emulated'),
        ('urdf', 'w2b_sim.print_urdf:main', "print a body's robot description"),
        ('vocabulary', 'w2b_core.vocabulary.command:main', 'install and look at word vectors')):
    COMMANDS.add(_name, Command(_target, _about))
