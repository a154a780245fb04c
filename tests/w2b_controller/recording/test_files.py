"""Files of a recording without ROS: bounded, readable after any end, understood by others."""

import errno
import io
import os
import random
import shutil
import struct

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

from w2b_controller.recording import reader
from w2b_controller.recording.definitions import DefinitionError, definition, parts
from w2b_controller.recording.events import events
from w2b_controller.recording.parts import PartsWriter, RecordingError, Topic, compress

STRING = Topic('/command', 'std_msgs/msg/String', 'string data\n', latched=False)
URDF = Topic('/robot_description', 'std_msgs/msg/String', 'string data\n', latched=True)


#: Of a message in little-endian CDR.
STRING_HEAD = b'\x00\x01\x00\x00'


def cdr(text):
    """Return a std_msgs/String as an independent encoder serialises it."""
    stream = io.BytesIO()
    writer = Writer(stream)
    schema = writer.register_msgdef('std_msgs/msg/String', 'string data')
    writer.write_message('/x', schema, {'data': text})
    writer.finish()
    stream.seek(0)
    (_schema, _channel, message), = make_reader(stream).iter_messages()
    return message.data


def record(folder, count, *, total=10**9, part=10**9, size=10, **options):
    writer = PartsWriter(folder, total_bytes=total, part_bytes=part, about={'namespace': '/'},
                         **options)
    writer.write(URDF, cdr('<robot/>'), 500, 400)
    for number in range(count):
        # Long ones are random: they do not shrink when they are compressed.
        text = 'x' * size if size <= 10 else random.randbytes(size // 2).hex()
        writer.write(STRING, STRING_HEAD + struct.pack('<I', len(text) + 1) + text.encode() + b'\0',
                     1000 + number, 900 + number)
    return writer


def count(path):
    """Return how many messages are read; a file without any is refused."""
    try:
        return len(list(reader.messages(path)))
    except RecordingError as error:
        if 'expected messages, got none' in str(error):
            return 0
        raise


def decoded(path):
    """Return the messages with their texts, as MCAP's own reader finds them by the index."""
    with path.open('rb') as stream:
        return [(message, ros) for _schema, _channel, message, ros in make_reader(
            stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages()]


def test_a_recording_is_read_by_an_independent_reader(tmp_path):
    record(tmp_path / 'r', 5).close()
    path, = (tmp_path / 'r').glob('*')
    found = decoded(path)
    assert [ros.data for _message, ros in found] == ['<robot/>', *['x' * 10] * 5]
    assert [message.log_time for message, _ros in found] == [500, *range(1000, 1005)]
    assert found[1][0].publish_time == 900
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary.statistics.message_count == 6
    assert summary.chunk_indexes, 'what reads by an index finds one'
    assert {schema.encoding for schema in summary.schemas.values()} == {'ros2msg'}


def test_what_was_flushed_before_a_kill_is_readable(tmp_path):
    writer = record(tmp_path / 'r', 5)
    writer.flush()
    # What the system has now is all there will be.
    shutil.copytree(tmp_path / 'r', tmp_path / 'killed')
    assert len(list(reader.messages(tmp_path / 'killed'))) == 6
    writer.close()


def test_whatever_byte_a_file_ends_at_what_is_whole_before_it_is_read(tmp_path):
    writer = record(tmp_path / 'r', 3)
    writer.flush()
    path, = (tmp_path / 'r').glob('*')
    whole, counts = path.read_bytes(), []
    cut = tmp_path / 'cut.mcap'
    for length in [*range(0, len(whole), 3), len(whole)]:
        cut.write_bytes(whole[:length])
        counts.append(count(cut))
    assert counts == sorted(counts)
    assert set(counts) == {0, 1, 2, 3, 4}
    # And it becomes a file that others read.
    compress(cut)
    assert len(decoded(cut)) == counts[-1]


def test_a_damaged_file_gives_what_is_before_the_damage(tmp_path):
    chance, counts = random.Random(5), []
    for finished in (True, False):
        writer = record(tmp_path / f'{finished}', 500, size=120)
        writer.flush()
        if finished:
            writer.close()
        path, = (tmp_path / f'{finished}').glob('*')
        whole = path.read_bytes()
        for _ in range(60):
            broken = bytearray(whole)
            place = chance.randrange(len(broken) - 40)
            broken[place:place + 40] = chance.randbytes(40)
            path.write_bytes(broken)
            counts.append(count(path))
        path.write_bytes(whole)
    assert max(counts) <= 501
    assert min(counts) < 250


def test_all_files_together_stay_below_the_bound_and_the_newest_stay(tmp_path):
    total, seen = 200_000, []
    folder = tmp_path / 'r'

    def measured(path):
        seen.append(sum(part.stat().st_size for part in path.glob('*')))
        return 10**12
    writer = record(folder, 6000, total=total, part=20_000, size=120, free_bytes=measured)
    writer.close()
    assert writer.parts > 12
    assert max([*seen, writer.size_bytes]) <= total
    found = list(reader.messages(folder))
    assert 0 < len(found) < 6000
    assert found[-1].log_ns == 1000 + 5999
    assert not (folder / '00000.mcap').exists()
    # Every file says by itself which robot it is.
    for path in folder.glob('*.mcap'):
        assert any(message.latched for message in reader.messages(path))


def test_a_full_disk_ends_a_recording_and_leaves_what_is_there(tmp_path):
    left = [10**12, 0]
    with pytest.raises(RecordingError, match=r'50 MB of free space .* got 0 MB'):
        record(tmp_path / 'r', 6000, part=20_000, free_bytes=lambda _path: left.pop(0))
    assert len(list(reader.messages(tmp_path / 'r'))) > 100


@pytest.mark.parametrize('end', [lambda writer: writer.flush(to_disk=True), PartsWriter.close])
def test_a_disk_that_fills_up_at_the_end_is_told_in_a_line(tmp_path, monkeypatch, end):
    writer = record(tmp_path / 'r', 5)

    def full(descriptor):
        raise OSError(errno.ENOSPC, 'No space left on device')
    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(RecordingError, match=r'expected to write on, got .*No space left'):
        end(writer)


def test_a_folder_with_files_in_it_is_left_alone(tmp_path):
    (tmp_path / 'mine').write_text('kept')
    with pytest.raises(RecordingError, match='expected a new or empty folder'):
        PartsWriter(tmp_path, total_bytes=10**9, part_bytes=10**6, about={})
    (tmp_path / 'file').write_text('kept')
    with pytest.raises(RecordingError):
        PartsWriter(tmp_path / 'file', total_bytes=10**9, part_bytes=10**6, about={})


@pytest.mark.parametrize('made', [None, b'', b'no MCAP at all, whatever its name says'])
def test_what_is_no_recording_is_refused(tmp_path, made):
    path = tmp_path / 'r.mcap'
    if made is not None:
        path.write_bytes(made)
    with pytest.raises(RecordingError, match='expected'):
        list(reader.messages(path))


def test_files_of_rosbag2_are_read_in_their_order_with_what_is_latched(tmp_path):
    for number in (10, 9):
        with (tmp_path / f'walk_{number}.mcap').open('wb') as stream:
            writer = McapWriter(stream)
            writer.start('ros2', 'libmcap')
            schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
            for topic, durability in (('/robot_description', 'transient_local'),
                                      ('/command', 'volatile')):
                channel = writer.register_channel(topic, 'cdr', schema, {
                    'offered_qos_profiles': f'- history: keep_last\n  durability: {durability}\n'})
                writer.add_message(channel, number, cdr(topic), number)
            writer.finish()
    found = list(reader.messages(tmp_path))
    assert [message.log_ns for message in found] == [9, 9, 10, 10]
    assert [message.latched for message in found] == [True, False] * 2


def test_a_definition_holds_those_of_all_its_parts():
    texts = {'a/msg/Top': 'Header header\nb/Part[] parts\nstring name\nint32 CONSTANT=3',
             'a/msg/Header': 'builtin_interfaces/Time stamp\n',
             'b/msg/Part': '# Comment other/Thing here\nfloat64[36] value\nInner inner',
             'b/msg/Inner': 'bool flag', 'builtin_interfaces/msg/Time': 'int32 sec\nuint32 nanosec'}
    found = definition('a/msg/Top', texts.__getitem__)
    assert found.startswith(texts['a/msg/Top'])
    assert [line for line in found.splitlines() if line.startswith('MSG: ')] == [
        'MSG: a/Header', 'MSG: b/Part', 'MSG: builtin_interfaces/Time', 'MSG: b/Inner']
    assert parts('a/msg/X', 'string<=10 name\nstd_msgs/Header header') == ['std_msgs/msg/Header']


def test_a_type_that_is_not_installed_is_named():
    pytest.importorskip('ament_index_python')
    with pytest.raises(DefinitionError, match='no_such_msgs/msg/Thing: expected its definition'):
        definition('no_such_msgs/msg/Thing')


def test_events_tell_each_word_but_no_latched_text(tmp_path):
    writer = record(tmp_path / 'r', 2)
    writer.close()
    found = list(map(str, events(reader.messages(tmp_path / 'r'))))
    assert len(found) == 2
    assert all('/command' in line and "said: 'xxxxxxxxxx'" in line for line in found)
