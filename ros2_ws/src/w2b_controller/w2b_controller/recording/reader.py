"""Reads a recording, also one whose recorder was killed: what is broken at its end is left out."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from zstandard import ZstdError

from w2b_controller.recording.parts import DURABILITY, LATCHED, RecordingError

#: What is raised where a file ends early or is damaged.
BROKEN = (McapError, EOFError, struct.error, ValueError, KeyError, ZstdError)
#: Longer records are none: the length is damaged.
RECORD_BYTES = 64 * 2**20


@dataclass(frozen=True)
class Recorded:
    """One message: `log_ns` is when it was received, `data` its CDR; see `Decoder`."""

    topic: str
    schema: Schema
    latched: bool
    log_ns: int
    data: bytes

    @property
    def type_name(self) -> str:
        """Type of the message, such as `std_msgs/msg/String`."""
        return self.schema.name


def files(path: Path) -> list[Path]:
    """Return the files of a recording, which is a folder or one file, in the order of time."""
    if path.is_dir():
        found = sorted(path.glob('*.mcap'), key=lambda one: (len(one.name), one.name))
        if found:
            return found
    elif path.is_file():
        return [path]
    raise RecordingError(f'{path}: expected a recording, a folder with files *.mcap or one of '
                         'them, got none')


def messages(path: Path) -> Iterator[Recorded]:
    """
    Yield the messages of a recording in the order in which they were received.

    Raises
    ------
    RecordingError
        If it is none, or has no message.

    """
    count = 0
    for part in files(path):
        for message in _messages(part):
            count += 1
            yield message
    if not count:
        raise RecordingError(f'{path}: expected messages, got none')


def latched(channel: Channel) -> bool:
    """Return whether late listeners got the last message, in our files and in those of rosbag2."""
    offered = channel.metadata.get('offered_qos_profiles', '')
    return (channel.metadata.get(DURABILITY) == LATCHED or LATCHED in offered
            or 'durability: 1' in offered)


def _messages(path: Path) -> Iterator[Recorded]:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    with path.open('rb') as stream:
        try:
            for record in StreamReader(
                    stream, validate_crcs=True, record_size_limit=RECORD_BYTES).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    yield Recorded(channel.topic, schemas[channel.schema_id], latched(channel),
                                   record.log_time, record.data)
        except BROKEN:
            # Its recorder was killed, or it is no MCAP: `messages` says so if nothing is left.
            return


class Decoder:
    """Decodes messages by the definitions in the recording: no ROS is needed."""

    def __init__(self) -> None:
        self._decoders: dict[str, Any] = {}

    def decode(self, message: Recorded) -> Any:
        """Return a message with its fields as attributes."""
        # By their names: each file of a recording numbers its schemas anew.
        if message.type_name not in self._decoders:
            self._decoders[message.type_name] = DecoderFactory().decoder_for(
                'cdr', message.schema)
        return self._decoders[message.type_name](message.data)
