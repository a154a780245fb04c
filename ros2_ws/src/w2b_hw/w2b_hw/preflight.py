"""
`w2b preflight`: is everything there that the robot needs, and what to do if not.

It only reads: no servo moves, no chip is written to.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from pathlib import Path

from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.shell import w2b_command
from w2b_hw import calibration, command_line
from w2b_hw.calibration import DEFAULT_PATH, HOW_TO_FINISH, CalibrationError
from w2b_hw.imu import registry
from w2b_hw.imu.part import ImuError
from w2b_hw.joints import BODY, TWIN, JointList, named
from w2b_hw.power import HWMON, Power
from w2b_hw.relax import ALL_LED_OFF_H, MODE1, PRE_SCALE
from w2b_hw.transport import (
    DEFAULT_DEVICE,
    Transport,
    is_emulated,
    open_transport,
    read_register,
)

#: Topics that the robot publishes with or without an IMU.
MEASURED = frozenset({'joint_states'})
NO_IMU = 'none wanted'
CONFIG = '/boot/firmware/config.txt'
WANTED_HZ = 400_000
#: Brain and hardware node need 150 MB; a system under memory pressure misses frames.
WANTED_MB = 300
_POWER_ON_PRESCALE = 0x1E
_MODULES = {'numpy': 'apt install python3-numpy', 'yaml': 'apt install python3-yaml',
            'smbus2': 'pip install smbus2', 'imufusion': 'pip install imufusion',
            'adafruit_pca9685': 'pip install adafruit-circuitpython-pca9685 adafruit-blinka',
            'w2b_core.status': 'build the workspace and source its setup.bash'}
_ROS_MODULES = ('rclpy', 'sensor_msgs.msg', 'trajectory_msgs.msg', 'diagnostic_msgs.msg',
                'std_srvs.srv', 'lifecycle_msgs.msg')


class Grade(Enum):
    """What a check found."""

    OK = 'ok'
    WARN = 'WARN'
    FAIL = 'FAIL'


@dataclass(frozen=True)
class Check:
    """One finding, and what to do about it."""

    grade: Grade
    name: str
    found: str
    fix: str = ''

    def __str__(self) -> str:
        """Return one line."""
        line = f'{self.grade.value:<4} {self.name}: {self.found}'
        return f'{line} -> {self.fix}' if self.fix else line


def check_servo_chip(transport: Transport, address: int) -> Check:
    """Read the PCA9685's state."""
    name = f'servo chip 0x{address:02x}'
    try:
        mode1 = read_register(transport, address, MODE1)[0]
        prescale = read_register(transport, address, PRE_SCALE)[0]
        all_led = read_register(transport, address, ALL_LED_OFF_H)[0]
    except OSError as error:
        return Check(Grade.FAIL, name, f'no answer (error {error.errno})',
                     'check SDA, SCL, ground and VCC (3.3 V); i2cdetect -y 1 should show it')
    if all_led != 0 or prescale < 3:
        return Check(Grade.FAIL, name, f'answers, but not as a PCA9685 does (ALL_LED_OFF_H '
                     f'0x{all_led:02x}, PRE_SCALE {prescale})', 'another chip at this address?')
    fresh = mode1 == 0x11 and prescale == _POWER_ON_PRESCALE
    return Check(Grade.OK, name, 'in its power-on state' if fresh
                 else f'set up before (MODE1 0x{mode1:02x}, PRE_SCALE {prescale})')


def check_imu(transport: Transport, choice: str) -> Check:
    """Look for the IMU by its identity."""
    try:
        part = registry.identify(transport, choice)
    except (ImuError, ValueError) as error:
        return Check(Grade.FAIL, 'imu', *str(error).rsplit(': ', 1))
    return Check(Grade.OK, 'imu', NO_IMU if part is None else part.name)


def check_calibration(path: Path, allow_uncalibrated: bool = False,
                      joints: JointList = TWIN) -> Check:
    """Load the calibration file; uncalibrated servos fail unless they are allowed."""
    try:
        found = calibration.load(path, joints)
    except CalibrationError as error:
        return Check(Grade.FAIL, 'calibration', error.problem,
                     error.fix or w2b_command('calibrate'))
    if found.problem:
        return Check(Grade.WARN if allow_uncalibrated else Grade.FAIL, 'calibration',
                     f'{path}: {found.problem}', HOW_TO_FINISH)
    doubts = [servo.doubt for servo in found.servos if servo.doubt]
    if doubts:
        return Check(Grade.WARN, 'calibration', f'{path}: {doubts[0]}',
                     w2b_command('calibrate'))
    if found == calibration.nominal(joints=joints):
        return Check(Grade.WARN, 'calibration', f'{path} holds nominal values only',
                     'calibrate each servo before it carries a leg')
    return Check(Grade.OK, 'calibration', f'{path}, clock {found.board.oscillator_hz / 1e6:.2f} '
                 f'MHz, {len(found.servos)} servos')


def check_controller(name: str, joints: JointList, imu: bool, body: str = '') -> Check:
    """
    Load the controller that the brain is to run: its joints, and what its senses need.

    A controller that carries its body must carry `body`, as its file describes it now.
    """
    try:
        controller = controller_file.load(controller_file.resolve(name))
    except ValueError as error:
        return Check(Grade.FAIL, 'controller', str(error), 'give a file, or a name that ships')
    if set(controller.joints) != set(joints.names):
        return Check(Grade.FAIL, 'controller', f'{name} drives {len(controller.joints)} joints of '
                     f'{controller.body}, the robot is {joints.body}',
                     'choose a controller of this body')
    try:
        if controller.carried is not None:
            controller.refuse_another_body(bodies.get(body or controller.body))
    except ValueError as error:
        return Check(Grade.FAIL, 'controller', f'{name}: {error}')
    lacks = controller.topics - MEASURED - ({'imu/data'} if imu else set())
    if lacks:
        return Check(Grade.FAIL, 'controller', f'{name} senses {", ".join(sorted(lacks))}, which '
                     'the robot does not measure', 'choose one without these senses'
                     + (', or connect the IMU' if 'imu/data' in lacks else ''))
    return Check(Grade.OK, 'controller', f'{name}: the robot has what it senses')


def check_bus_clock(device: str, adapters: Path) -> Check:
    """Read the bus clock from the device tree: a big-endian word."""
    property_ = adapters / Path(device).name / 'of_node' / 'clock-frequency'
    try:
        clock_hz = int.from_bytes(property_.read_bytes(), 'big')
    except OSError:
        return Check(Grade.WARN, 'bus clock', 'unknown: the device tree does not tell')
    if clock_hz < WANTED_HZ:
        return Check(Grade.WARN, 'bus clock', f'{clock_hz / 1e3:.0f} kHz',
                     f'dtparam=i2c_arm_baudrate={WANTED_HZ} in {CONFIG}, then reboot')
    return Check(Grade.OK, 'bus clock', f'{clock_hz / 1e3:.0f} kHz')


def check_power(power: Power) -> Check:
    """Read the undervoltage alarm."""
    if not power.present:
        return Check(Grade.WARN, 'supply', 'no undervoltage sensor on this machine')
    if power.undervoltage():
        return Check(Grade.FAIL, 'supply', 'undervoltage',
                     'a stronger 5 V supply for the Pi; servos on a supply of their own')
    return Check(Grade.OK, 'supply', 'no undervoltage')


def check_modules(load: Callable[[str], object] = import_module) -> list[Check]:
    """Import what the node needs."""
    missing = []
    for module, fix in _MODULES.items():
        try:
            load(module)
        except ImportError as error:
            missing.append(Check(Grade.FAIL, 'python', f'{module} is missing ({error})', fix))
    checks = missing or [Check(Grade.OK, 'python', f'{sys.version.split()[0]} with all packages')]
    try:
        for module in _ROS_MODULES:
            load(module)
    except ImportError as error:
        return [*checks, Check(Grade.FAIL, 'ros', str(error), '. /opt/ros/jazzy/setup.bash')]
    return [*checks, Check(Grade.OK, 'ros', 'rclpy and messages')]


def check_memory(meminfo: Path) -> Check:
    """Read what memory is free."""
    try:
        lines = meminfo.read_text(encoding='ascii').splitlines()
        free_mb = next(int(line.split()[1]) // 1024 for line in lines
                       if line.startswith('MemAvailable'))
    except (OSError, StopIteration, ValueError):
        return Check(Grade.WARN, 'memory', 'unknown')
    if free_mb < WANTED_MB:
        return Check(Grade.WARN, 'memory', f'{free_mb} MB available',
                     f'stop other programs: {WANTED_MB} MB keep frames on time')
    return Check(Grade.OK, 'memory', f'{free_mb} MB available')


def check_bus(name: str, address: int, imu: str) -> list[Check]:
    """Open the bus and look at what is on it."""
    try:
        transport = open_transport(name)
    except FileNotFoundError:
        return [Check(Grade.FAIL, 'bus', f'no {name}',
                      f'dtparam=i2c_arm=on in {CONFIG}, i2c-dev in /etc/modules, then reboot')]
    except PermissionError:
        return [Check(Grade.FAIL, 'bus', f'no permission for {name}',
                      'sudo usermod -aG i2c $USER, then log in again')]
    except (OSError, ValueError) as error:
        return [Check(Grade.FAIL, 'bus', str(error), 'see deploy/README.md')]
    try:
        return [Check(Grade.OK, 'bus', name), check_servo_chip(transport, address),
                check_imu(transport, imu)]
    finally:
        transport.close()


@command_line.command
def main() -> None:
    """Print all findings; exit code 1 if something is missing that the robot needs."""
    parser = argparse.ArgumentParser(description='Check what the robot needs. Only reads.')
    parser.add_argument('--transport', default=DEFAULT_DEVICE, help='(default: %(default)s)')
    parser.add_argument('--calibration', type=Path, default=DEFAULT_PATH,
                        help='(default: %(default)s)')
    parser.add_argument('--body', default=BODY,
                        help='body that the robot is built as (default: %(default)s)')
    parser.add_argument('--allow-uncalibrated', action='store_true',
                        help='servos that nobody calibrated are a warning, no failure')
    parser.add_argument('--controller', default=None, metavar='NAME_OR_FILE',
                        help='also check that the robot has what this controller senses')
    parser.add_argument('--imu', choices=registry.CHOICES, default=registry.AUTO)
    arguments = parser.parse_args(command_line.own())
    path = arguments.calibration.expanduser()
    try:
        joints = named(arguments.body)
    except ValueError as error:
        sys.exit(f'preflight: {error}')
    # As the hardware node has it: emulated chips are ideal unless a file is given.
    ideal = is_emulated(arguments.transport) and arguments.calibration == DEFAULT_PATH
    address = calibration.nominal().board.address
    if not ideal:
        with contextlib.suppress(CalibrationError):
            address = calibration.load(path, joints).board.address
    checks = check_bus(arguments.transport, address, arguments.imu)
    if arguments.transport.startswith('/'):
        checks.append(check_bus_clock(arguments.transport, Path('/sys/class/i2c-adapter')))
    checks += [Check(Grade.OK, 'calibration', 'emulated chips need none') if ideal
               else check_calibration(path, arguments.allow_uncalibrated, joints),
               check_power(Power(HWMON)), *check_modules(), check_memory(Path('/proc/meminfo'))]
    if arguments.controller is not None:
        imu = any(check.name == 'imu' and check.grade is Grade.OK and check.found != NO_IMU
                  for check in checks)
        checks.append(check_controller(arguments.controller, joints, imu, arguments.body))
    for check in checks:
        print(check)
    failed = sum(check.grade is Grade.FAIL for check in checks)
    print(f'preflight: {failed} to fix' if failed else 'preflight: ready')
    sys.exit(1 if failed else 0)


if __name__ == '__main__':
    main()
