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
    extras
        Extras of the package `w2b` that have its libraries, such as `sim,ros`; empty: none.

    """

    target: str
    about: str
    extras: str = ''


COMMANDS: Registry[Command] = Registry('command')

_ROBOT = 'w2b_controller.cli.robot'
for _name, _target, _extras, _about in (
        ('say', 'w2b_controller.say:main', 'ros', 'say a word to the brain, wait for its answer'),
        ('console', 'w2b_controller.console:main', 'ros', 'type words, read the answers'),
        ('arm', f'{_ROBOT}:arm', 'ros', 'let the servos follow the brain'),
        ('disarm', f'{_ROBOT}:disarm', 'ros', 'park and relax the servos'),
        ('stop', f'{_ROBOT}:stop', 'ros',
         'emergency stop: servos off at once; a simulation pauses'),
        ('reset', f'{_ROBOT}:reset', 'ros', 'put a simulated body back to its start'),
        ('pause', f'{_ROBOT}:pause', 'ros', 'stop the clock of a simulation, or let it go on'),
        ('status', f'{_ROBOT}:status', 'ros', 'how brain and body are'),
        ('echo', f'{_ROBOT}:echo', 'ros', 'print what is published on a topic'),
        ('record', 'w2b_controller.recording.record:main', 'recording,ros',
         'record all topics of a robot (MCAP)'),
        ('replay', 'w2b_controller.recording.replay:main', 'recording,ros',
         'publish a recording again, or tell what happened in it'),
        ('teach', 'w2b_controller.cli.teach:main', '', "add a word to a controller's ear"),
        ('brain', 'w2b_controller.brain:main', 'ros', 'the node that hears words, moves a body'),
        ('sim', 'w2b_sim.sim:main', 'sim,ros', 'the node that simulates a body'),
        ('description', 'w2b_description.description:main', 'ros',
         'the node that publishes robot_description and tf'),
        ('hardware', 'w2b_hw.node:main', 'hw,ros', 'the node that drives the servos of a robot'),
        ('page', 'w2b_web.page:main', 'web,ros', 'the node that shows robots in a browser'),
        ('listen', 'w2b_web.voice.listen:main', 'listen,ros',
         'hear one of a few words from a microphone or a WAV file'),
        ('play', 'w2b_web.play:main', 'web,sim,ros', 'a robot, a brain and the page, at once'),
        ('calibrate', 'w2b_hw.entry:calibrate', 'hw', 'calibrate the servos, one by one'),
        ('preflight', 'w2b_hw.entry:preflight', 'hw', 'check the robot before it is armed'),
        ('relax', 'w2b_hw.relax:main', 'hw', 'all servos off; needs nothing but the bus'),
        ('emulator', 'w2b_hw.entry:emulator', 'hw', 'the chips of a robot, emulated'),
        ('urdf', 'w2b_sim.print_urdf:main', '', "print a body's robot description"),
        ('robot', 'w2b_sim.own_robot.command:main', 'train', 'your own robot: draft, check it'),
        ('vocabulary', 'w2b_core.vocabulary.command:main', '', 'word vectors: install, look up'),
        ('train', 'training.__main__:main', 'train', 'evolution, the study, what is measured')):
    COMMANDS.add(_name, Command(_target, _about, _extras))
