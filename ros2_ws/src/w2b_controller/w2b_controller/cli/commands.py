"""The subcommands of `w2b`: a name, the function that runs, and what has to be installed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Command:
    """
    One subcommand.

    Attributes
    ----------
    target
        `module:function`, imported only when the command is given. The function takes no argument:
        it reads `sys.argv`, answers `--help` and returns the exit code (None: 0).
    purpose
        One line for `w2b --help`.
    extra
        The extra of the package `w2b` that has its libraries; empty where none is needed.

    """

    target: str
    purpose: str
    extra: str = ''


#: Groups of subcommands as `w2b --help` shows them. A new subcommand is one entry here.
GROUPS: dict[str, dict[str, Command]] = {
    'the robot or the simulation that runs': {
        'say': Command('w2b_controller.say:main', 'say a word to the brain', 'ros'),
        'console': Command('w2b_controller.console:main', 'type words, see the answers', 'ros'),
        'status': Command('w2b_controller.cli.status:main', 'state of body and brain', 'ros'),
        'arm': Command('w2b_controller.cli.services:arm', 'energise the servos one by one', 'ros'),
        'disarm': Command('w2b_controller.cli.services:disarm', 'park, then servos off', 'ros'),
        'stop': Command('w2b_controller.cli.services:stop',
                        'emergency stop: servos off now', 'ros'),
        'reset': Command('w2b_controller.cli.services:reset',
                         'put the simulated body back to its start', 'ros'),
        'pause': Command('w2b_controller.cli.services:pause',
                         'stop the simulation; `pause off` lets it run', 'ros'),
        'echo': Command('w2b_controller.cli.echo:main', 'print the messages of a topic', 'ros'),
    },
    'nodes': {
        'brain': Command('w2b_controller.brain:main', 'hears words, sends joint targets', 'ros'),
        'sim': Command('w2b_sim.sim:main', 'a simulated body', 'sim,ros'),
        'hardware': Command('w2b_hw.node:main', "the robot's servos and IMU", 'hw,ros'),
    },
    'tools': {
        'vocabulary': Command('w2b_core.vocabulary.command:main', 'install and list word vectors'),
        'urdf': Command('w2b_sim.print_urdf:main', "print a body's robot description"),
        'train': Command('training.__main__:main', 'evolution, the study, measurements', 'train'),
        'preflight': Command('w2b_hw.preflight:main', 'check what the robot needs', 'hw'),
        'calibrate': Command('w2b_hw.calibrate:main', 'zero, range, direction of servos', 'hw'),
        'relax': Command('w2b_hw.relax:main', 'servos off over the bus, without ROS', 'hw'),
        'emulator': Command('w2b_hw.emulation.server:main', 'serve emulated chips', 'hw'),
    },
}
COMMANDS: dict[str, Command] = {
    name: command for group in GROUPS.values() for name, command in group.items()}
