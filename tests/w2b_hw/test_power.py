"""Undervoltage from a hwmon folder as the kernel lays it out."""

import pytest

from w2b_hw.power import Power


def hwmon(tmp_path, **sensors):
    for folder, (name, alarm) in sensors.items():
        (tmp_path / folder).mkdir()
        (tmp_path / folder / 'name').write_text(f'{name}\n')
        if alarm is not None:
            (tmp_path / folder / 'in0_lcrit_alarm').write_text(f'{alarm}\n')
    return tmp_path


@pytest.mark.parametrize(('alarm', 'expected'), [('0', False), ('1', True), ('x', None),
                                                 (None, None)])
def test_the_alarm_of_rpi_volt_is_read(tmp_path, alarm, expected):
    power = Power(hwmon(tmp_path, hwmon0=('cpu_thermal', '1'), hwmon1=('rpi_volt', alarm)))
    assert power.present
    assert power.undervoltage() is expected


def test_a_machine_without_the_sensor_knows_nothing(tmp_path):
    power = Power(hwmon(tmp_path, hwmon0=('coretemp', '1')))
    assert not power.present
    assert power.undervoltage() is None
    assert Power(tmp_path / 'none').undervoltage() is None
