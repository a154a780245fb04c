"""Calibration: angles to pulses, and files that are whole, fitting, or refused."""

import math
from dataclasses import replace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from w2b_core import plain_yaml
from w2b_hw import calibration
from w2b_hw.calibration import Board, Calibration, CalibrationError, Servo, load, nominal, save
from w2b_hw.joints import JOINTS


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'folder' / 'calibration.yaml'
    save(nominal(), path)
    return path


def edited(path, change, reseal=True):
    document = yaml.safe_load(path.read_text())
    change(document)
    document.pop('checksum', None) if reseal else None
    if reseal:
        document['checksum'] = calibration.checksum(document)
    path.write_text(yaml.safe_dump(document))


def test_what_is_saved_is_loaded(tmp_path):
    mine = nominal()
    servos = list(mine.servos)
    servos[3] = replace(servos[3], channel=15, direction=-1, zero_us=1487.5, us_per_rad=612.3)
    mine = Calibration(Board(oscillator_hz=26.3e6), tuple(servos))
    save(mine, tmp_path / 'c.yaml')
    assert load(tmp_path / 'c.yaml') == mine
    assert [file.name for file in tmp_path.iterdir()] == ['c.yaml']


def test_a_failed_save_leaves_the_old_file(path, monkeypatch):
    before = path.read_text()

    def fail(source, target):
        raise OSError('disk full')
    monkeypatch.setattr('os.replace', fail)
    with pytest.raises(OSError, match='disk full'):
        save(Calibration(Board(oscillator_hz=26e6), nominal().servos), path)
    assert path.read_text() == before
    assert len(list(path.parent.iterdir())) == 1


def test_pulse_is_zero_plus_direction_times_slope():
    servo = Servo('front_left_hip', 0, direction=-1, zero_us=1450, us_per_rad=600,
                  min_rad=-0.5, max_rad=0.5)
    assert servo.pulse_us(0.25) == pytest.approx(1300)
    assert servo.angle_rad(1300) == pytest.approx(0.25)


@given(st.floats(allow_nan=False), st.sampled_from([1, -1]), st.floats(1300, 1700),
       st.floats(300, 900))
def test_no_angle_gives_a_pulse_outside_the_limits(angle, direction, zero_us, us_per_rad):
    servo = Servo('front_left_hip', 0, direction, zero_us, us_per_rad, min_us=900, max_us=2100,
                  min_rad=-0.4, max_rad=0.4)
    assert 900 <= servo.pulse_us(angle) <= 2100
    assert abs(servo.pulse_us(angle) - zero_us) <= 0.4 * us_per_rad + 1e-6


@pytest.mark.parametrize(('change', 'message'), [
    ({'channel': 16}, 'channel: expected 0 to 15, got 16'),
    ({'direction': 0}, 'direction: expected 1 or -1'),
    ({'zero_us': 3000}, 'zero_us'), ({'min_us': 300}, 'min_us'), ({'max_us': 2600}, 'max_us'),
    ({'us_per_rad': math.nan}, 'us_per_rad'), ({'us_per_rad': '600'}, "got '600'"),
    ({'max_rad': True}, 'max_rad'), ({'min_rad': 0.1}, 'min_rad'),
    ({'max_us': 1600}, 'max_rad 0.524 rad needs a pulse of 1833 us, outside its 500..1600')])
def test_a_servo_out_of_range_is_refused(change, message):
    with pytest.raises(CalibrationError, match=message):
        replace(nominal().servos[0], **change)


@pytest.mark.parametrize(('servos', 'message'), [
    (nominal().servos[:11], "missing \\['front_right_ankle'\\]"),
    ((*nominal().servos, Servo('tail', 13)), "unknown \\['tail'\\]"),
    ((*nominal().servos[:11], replace(nominal().servos[11], channel=0)), 'channel 0 is used')])
def test_every_joint_has_one_servo_and_a_channel_of_its_own(servos, message):
    with pytest.raises(CalibrationError, match=message):
        Calibration(Board(), servos)


def test_servos_come_in_the_order_of_the_joints():
    assert [s.joint for s in Calibration(Board(), nominal().servos[::-1]).servos] == list(JOINTS)


def test_no_file_says_how_to_make_one(tmp_path):
    with pytest.raises(CalibrationError, match=r'no calibration file at .*w2b calibrate'):
        load(tmp_path / 'none.yaml')


def test_every_truncation_is_refused(path):
    text = path.read_text()
    for length in range(0, len(text) - 1, 97):
        path.write_text(text[:length])
        with pytest.raises(CalibrationError):
            load(path)


@pytest.mark.parametrize(('change', 'message'), [
    (lambda d: d['servos'][0].update(zero_us=1501.0), 'checksum does not fit'),
    (lambda d: d.update(checksum='0' * 64), 'checksum does not fit'),
    (lambda d: d.pop('checksum'), "missing \\['checksum'\\]")])
def test_an_edited_file_is_refused(path, change, message):
    edited(path, change, reseal=False)
    with pytest.raises(CalibrationError, match=message):
        load(path)


@pytest.mark.parametrize(('change', 'message'), [
    (lambda d: d.update(version=2), 'version 2'),
    (lambda d: d.update(format='other'), "got 'other'"),
    (lambda d: d['servos'][0].pop('channel'), "servos\\[0\\]: missing \\['channel'\\]"),
    (lambda d: d['servos'][0].update(colour='red'), "unknown \\['colour'\\]"),
    (lambda d: d.update(servos={}), 'servos: expected a list'),
    (lambda d: d.update(board=[]), 'board: expected fields'),
    (lambda d: d['board'].update(oscillator_hz=1.0), 'oscillator_hz: expected')])
def test_a_sealed_file_of_another_kind_is_refused(path, change, message):
    edited(path, change)
    with pytest.raises(CalibrationError, match=message):
        load(path)


@pytest.mark.parametrize('text', ['', '[]', '{', 'a: !!python/object:os.system x', '\x00', '3'])
def test_what_is_no_calibration_at_all_is_refused_in_one_line(path, text):
    path.write_text(text)
    with pytest.raises(CalibrationError) as error:
        load(path)
    assert '\n' not in str(error.value)
    assert 'calibrate' in str(error.value)


def test_sealing_accepts_a_good_edit_and_refuses_a_bad_one(path):
    edited(path, lambda d: d['board'].update(oscillator_hz=26.1e6), reseal=False)
    calibration.seal(path)
    assert load(path).board.oscillator_hz == 26.1e6
    edited(path, lambda d: d['servos'][0].update(max_us=9999), reseal=False)
    with pytest.raises(CalibrationError, match='max_us'):
        calibration.seal(path)


def replaced(path, old, new):
    """Edit the text of the file as a person does."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize('value', ['5.5', '0.5', '5.0', '"5"', '0x5', '05', '1_0', '0:5', 'true',
                                   '!!int 5', '.inf', '16', '-1', '[5]', '~', '', '9' * 400])
def test_a_channel_is_a_whole_number_or_the_file_is_not_sealed(path, value):
    replaced(path, 'channel: 5', f'channel: {value}')
    with pytest.raises(CalibrationError) as error:
        calibration.seal(path)
    assert '\n' not in str(error.value)


@pytest.mark.parametrize(('old', 'new'), [
    ('direction: 1', 'direction: 1.0'), ('direction: 1', 'direction: yes'),
    ('direction: 1', 'direction: true'), ('address: 64', 'address: 64.0'),
    ('address: 64', 'address: 0100'), ('version: 1', 'version: 1.0'),
    ('version: 1', 'version: true'), ('calibrated: true', 'calibrated: 1'),
    ('calibrated: true', 'calibrated: yes'), ('zero_us: 1500.0', 'zero_us: 1_500'),
    ('zero_us: 1500.0', 'zero_us: 25:00'), ('zero_us: 1500.0', 'zero_us: 1500,0'),
    ('joint: front_left_hip', 'joint: 3'), ('joint: front_left_hip', 'joint: [a]'),
    ('channel: 5', 'channel: 5\n  channel: 6'), ('board:', 'version: 1\nboard:'),
    ('  address: 64', '  address: 64\n  address: 65'), ('board:', 'board: &board'),
    ('channel: 5', '<<: {channel: 5}'), ('channel: 5', '5: 5'), ('format:', '---\nformat:')])
def test_no_surprise_of_yaml_is_sealed(path, old, new):
    if old == 'format:':
        path.write_text(path.read_text() + '---\na: 1\n')
    else:
        replaced(path, old, new)
    with pytest.raises(CalibrationError) as error:
        calibration.seal(path)
    assert '\n' not in str(error.value)


def test_a_whole_number_will_do_for_microseconds_and_angles(path):
    replaced(path, 'zero_us: 1500.0', 'zero_us: 1510')
    calibration.seal(path)
    assert load(path).servos[0].zero_us == 1510


def test_a_file_from_before_servos_were_marked_says_of_none_that_it_was_calibrated(path):
    edited(path, lambda d: [servo.pop('calibrated') for servo in d['servos']])
    assert load(path).problem.startswith('0 of 12 servos are calibrated')


def test_a_save_that_does_not_read_back_is_no_save(path, monkeypatch):
    monkeypatch.setattr(calibration, 'load', lambda path, joints: nominal())
    with pytest.raises(CalibrationError, match='does not hold what was written'):
        save(nominal(calibrated=False), path)


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
                    lambda inner: st.lists(inner, max_size=3)
                    | st.dictionaries(st.text(max_size=3), inner, max_size=3)))
def test_plain_yaml_reads_what_it_can_or_refuses(document):
    text = yaml.safe_dump(document)
    try:
        again = plain_yaml.load(text)
    except yaml.YAMLError:
        return
    assert again is not NotImplemented
