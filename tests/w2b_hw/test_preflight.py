"""Preflight: what it finds, and that it only reads."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import pytest

from w2b_core.controller import file as controller_file
from w2b_core.shell import w2b_command
from w2b_hw import calibration, preflight
from w2b_hw.calibration import Board, Calibration, nominal
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.joints import TWIN
from w2b_hw.power import Power
from w2b_hw.preflight import Grade
from w2b_hw.transport import Write


class ReadOnly:
    """A wire on which a write of data is an error."""

    def __init__(self, wire):
        self.wire = wire

    def transfer(self, messages):
        assert all(len(m.data) == 1 for m in messages if isinstance(m, Write)), 'it wrote'
        return self.wire.transfer(messages)

    def close(self):
        pass


def test_chips_in_order_are_found_by_reading_alone():
    wire = ReadOnly(EmulatedRobot().wire)
    chip, imu = preflight.check_servo_chip(wire, 0x40), preflight.check_imu(wire, 'auto')
    assert (chip.grade, chip.found) == (Grade.OK, 'in its power-on state')
    assert (imu.grade, imu.found) == (Grade.OK, 'lsm6dsox')


def test_chips_that_are_missing_or_others_are_named():
    wire = EmulatedRobot('none').wire
    assert 'no answer (error 121)' in str(preflight.check_servo_chip(wire, 0x41))
    wrong = preflight.check_servo_chip(EmulatedRobot().wire, 0x6A)
    assert wrong.grade is Grade.FAIL
    assert 'not as a PCA9685' in wrong.found
    imu = preflight.check_imu(wire, 'auto')
    assert imu.grade is Grade.FAIL
    assert imu.fix == 'check its wiring, or set imu:=none'


def test_the_bus_says_what_to_fix(tmp_path, monkeypatch):
    missing, = preflight.check_bus(f'{tmp_path}/i2c-1', 0x40, 'auto')
    assert 'dtparam=i2c_arm=on' in missing.fix

    def refuse(name):
        raise PermissionError(13, 'Permission denied')
    monkeypatch.setattr(preflight, 'open_transport', refuse)
    denied, = preflight.check_bus('/dev/i2c-1', 0x40, 'auto')
    assert 'usermod -aG i2c' in denied.fix


@pytest.mark.parametrize(('clock_hz', 'grade'), [(100_000, Grade.WARN), (400_000, Grade.OK),
                                                 (None, Grade.WARN)])
def test_the_bus_clock_comes_from_the_device_tree(tmp_path, clock_hz, grade):
    node = tmp_path / 'i2c-1' / 'of_node'
    node.mkdir(parents=True)
    if clock_hz is not None:
        (node / 'clock-frequency').write_bytes(clock_hz.to_bytes(4, 'big'))
    assert preflight.check_bus_clock('/dev/i2c-1', tmp_path).grade is grade


def test_calibration_missing_nominal_and_good(tmp_path):
    path = tmp_path / 'c.yaml'
    assert 'calibrate' in preflight.check_calibration(path).fix
    calibration.save(nominal(), path)
    assert preflight.check_calibration(path).grade is Grade.WARN
    servos = (replace(nominal().servos[0], zero_us=1490.0), *nominal().servos[1:])
    calibration.save(Calibration(Board(), servos), path)
    assert preflight.check_calibration(path).grade is Grade.OK


@pytest.mark.parametrize(('alarm', 'grade'), [('0', Grade.OK), ('1', Grade.FAIL)])
def test_undervoltage(tmp_path, alarm, grade):
    (tmp_path / 'hwmon0').mkdir()
    (tmp_path / 'hwmon0' / 'name').write_text('rpi_volt\n')
    (tmp_path / 'hwmon0' / 'in0_lcrit_alarm').write_text(alarm)
    assert preflight.check_power(Power(tmp_path)).grade is grade
    assert preflight.check_power(Power(tmp_path / 'none')).grade is Grade.WARN


def test_missing_packages_and_missing_ros_say_what_to_install():
    def load(module):
        if module in ('smbus2', 'rclpy'):
            raise ImportError(f'No module named {module!r}')
    smbus, ros = preflight.check_modules(load)
    assert (smbus.grade, smbus.fix) == (Grade.FAIL, 'pip install smbus2')
    assert (ros.grade, ros.fix) == (Grade.FAIL, '. /opt/ros/jazzy/setup.bash')
    assert [check.grade for check in preflight.check_modules(lambda module: None)] == [Grade.OK] * 2


@pytest.mark.parametrize(('text', 'grade'), [('MemAvailable:  512000 kB\n', Grade.OK),
                                             ('MemAvailable:  102400 kB\n', Grade.WARN),
                                             ('', Grade.WARN)])
def test_memory(tmp_path, text, grade):
    (tmp_path / 'meminfo').write_text(text)
    assert preflight.check_memory(tmp_path / 'meminfo').grade is grade


def test_the_calibration_line_says_once_what_to_do(tmp_path):
    path = tmp_path / 'c.yaml'
    assert str(preflight.check_calibration(path)) == (
        f'FAIL calibration: no calibration file at {path} -> make one with '
        f'`{w2b_command("calibrate")}`')
    calibration.save(nominal(), path)
    path.write_text(path.read_text().replace('25000000.0', '26000000.0'))
    check = preflight.check_calibration(path)
    assert 'checksum does not fit' in check.found
    assert f'`{w2b_command("calibrate --seal")}`' in check.fix
    assert 'calibrate' not in check.found


def test_emulated_chips_need_no_calibration(tmp_path):
    run = subprocess.run([sys.executable, '-m', 'w2b_hw.preflight', '--transport', 'emulated'],
                         env={**os.environ, 'HOME': str(tmp_path)}, capture_output=True,
                         text=True, timeout=60, check=False)
    assert 'ok   calibration: emulated chips need none\n' in run.stdout


def test_the_command_prints_a_line_for_each_check_and_fails_for_a_missing_one(tmp_path):
    path = tmp_path / 'c.yaml'
    command = [sys.executable, '-m', 'w2b_hw.preflight', '--transport', 'emulated',
               '--calibration', str(path)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert run.returncode == 1
    assert f'FAIL calibration: no calibration file at {path}' in run.stdout
    assert run.stdout.endswith('to fix\n')
    calibration.save(nominal(), path)
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert 'ok   servo chip 0x40: in its power-on state' in run.stdout
    assert 'WARN calibration' in run.stdout


def test_one_of_twelve_calibrated_servos_is_not_ready_unless_it_is_allowed(tmp_path):
    path = tmp_path / 'c.yaml'
    first, *rest = nominal(calibrated=False).servos
    calibration.save(Calibration(Board(), (replace(first, zero_us=1490.0, calibrated=True), *rest)),
                     path)
    check = preflight.check_calibration(path)
    assert check.grade is Grade.FAIL
    assert '1 of 12 servos are calibrated; not back_left_hip' in check.found
    assert 'zero (z), mark (m) and direction (t)' in check.fix
    assert preflight.check_calibration(path, allow_uncalibrated=True).grade is Grade.WARN
    command = [sys.executable, '-m', 'w2b_hw.preflight', '--transport', 'emulated',
               '--calibration', str(path)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 1
    assert 'FAIL calibration' in run.stdout
    run = subprocess.run([*command, '--allow-uncalibrated'], capture_output=True, text=True,
                         timeout=60, check=False)
    assert 'WARN calibration' in run.stdout


def test_an_implausible_servo_is_a_warning(tmp_path):
    path = tmp_path / 'c.yaml'
    first, *rest = nominal().servos
    calibration.save(Calibration(Board(), (replace(first, us_per_rad=1200.0), *rest)), path)
    check = preflight.check_calibration(path)
    assert check.grade is Grade.WARN
    assert '1200 us/rad' in check.found


@pytest.mark.parametrize(('controller', 'imu', 'reason'), [
    ('physical_twin', True, None), ('physical_twin_serial', False, None),
    ('physical_twin', False, 'senses imu/data, which the robot does not measure'),
    ('quadruped', True, 'drives 8 joints of quadruped, the robot is physical_twin'),
    ('nowhere.json', True, 'no such file')])
def test_a_controller_whose_senses_or_joints_the_robot_lacks_is_refused(controller, imu, reason):
    check = preflight.check_controller(controller, TWIN, imu)
    assert check.grade is (Grade.OK if reason is None else Grade.FAIL)
    assert reason is None or reason in str(check)


def test_touch_is_nothing_that_the_robot_measures(tmp_path):
    data = json.loads(controller_file.shipped('physical_twin_serial').read_text())
    rows = data['network']['hidden_weights']
    data['network']['sensors'] = ['touch:front_left_foot']
    data['network']['hidden_weights'] = [
        [*row[:len(rows) + 1], 0.0] for row in rows]
    path = tmp_path / 'touch.json'
    path.write_text(json.dumps(data))
    check = preflight.check_controller(str(path), TWIN, True)
    assert check.grade is Grade.FAIL
    assert 'senses contacts' in str(check)
