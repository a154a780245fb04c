"""
Writes a recording: a folder of MCAP files, bounded in size, readable after any end.

The file that is being written holds one record after the other, so that a killed recorder loses no
more than was not yet handed to the system. A file that is full is written anew with compressed
chunks and an index, then takes the place of the first: that is what Foxglove and `ros2 bag` read.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from w2b_core import __version__

PROFILE, LIBRARY = 'ros2', f'w2b {__version__}'
#: Free space that is left on the disk: a robot whose disk is full does not start again.
FREE_BYTES = 50_000_000
#: Key of a channel's metadata, and its value where late listeners get the last message.
DURABILITY, LATCHED = 'w2b_durability', 'transient_local'


class RecordingError(OSError):
    """A recording that cannot be written or read; one line says why."""


@dataclass(frozen=True)
class Topic:
    """What a channel of a recording is: `definition` is the type's full text."""

    name: str
    type_name: str
    definition: str
    latched: bool


class PartsWriter:
    """
    Writes messages into numbered files, and removes the oldest when they become too many.

    Parameters
    ----------
    folder
        New or empty folder.
    total_bytes
        That all files together have at most.
    part_bytes
        That one file has, before it is compressed.
    about
        Written into each file.
    free_bytes
        Returns the free space of the disk.

    Raises
    ------
    RecordingError
        If the folder has something in it or cannot be made.

    """

    def __init__(self, folder: Path, *, total_bytes: int, part_bytes: int,
                 about: dict[str, str], free_bytes: Callable[[Path], int] | None = None) -> None:
        self.folder, self.messages, self.parts = folder, 0, 0
        self._total, self._part = total_bytes, min(part_bytes, total_bytes // 4)
        self._about = about
        self._free = free_bytes or (lambda path: shutil.disk_usage(path).free)
        self._latest: dict[str, tuple[Topic, bytes, int]] = {}
        self._stream: IO[bytes] | None = None
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise RecordingError(f'{folder}: expected a new or empty folder, got files in it')
        except OSError as error:
            raise RecordingError(str(error)) from error

    def write(self, topic: Topic, data: bytes, log_ns: int, sent_ns: int) -> None:
        """
        Write one serialised message.

        Parameters
        ----------
        topic
            Where it was published.
        data
            The message in CDR.
        log_ns, sent_ns
            When it was received and published, in nanoseconds of the system's clock.

        Raises
        ------
        RecordingError
            If the disk is full, or nearly so.

        """
        with self._writing():
            if self._stream is not None and self._stream.tell() >= self._part:
                self._close()
            if self._stream is None:
                self._open(log_ns)
            self._add(topic, data, log_ns, sent_ns)
        self.messages += 1
        if topic.latched:
            self._latest[topic.name] = (topic, data, sent_ns)

    def flush(self, to_disk: bool = False) -> None:
        """
        Hand over what was written to the system, so that it survives the end of this process.

        RecordingError if the disk is full.
        """
        if self._stream is not None:
            with self._writing():
                self._stream.flush()
                if to_disk:
                    os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Close the last file (RecordingError if the disk is full)."""
        if self._stream is not None:
            with self._writing():
                self._close()

    @property
    def size_bytes(self) -> int:
        """Size of all files."""
        return sum(path.stat().st_size for path in self.folder.glob('*.mcap'))

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except RecordingError:
            raise
        except OSError as error:
            raise RecordingError(f'{self.folder}: expected to write on, got {error}') from error

    def _open(self, now_ns: int) -> None:
        free = self._free(self.folder)
        if free < FREE_BYTES + 2 * self._part:
            raise RecordingError(f'{self.folder}: expected {FREE_BYTES // 10**6} MB of free space '
                                 f'beside the next file, got {free // 10**6} MB')
        self._make_room()
        self._path = self.folder / f'{self.parts:05d}.mcap'
        self._stream = self._path.open('xb')
        self.parts += 1
        self._writer = Writer(self._stream, use_chunking=False, index_types=IndexType.NONE,
                              enable_data_crcs=False)
        self._writer.start(PROFILE, LIBRARY)
        self._writer.add_metadata('w2b', self._about)
        self._channels: dict[str, int] = {}
        # Each file can be understood by itself: who the robot is, how it is, what was said.
        for topic, data, sent_ns in self._latest.values():
            self._add(topic, data, now_ns, sent_ns)

    def _add(self, topic: Topic, data: bytes, log_ns: int, sent_ns: int) -> None:
        if topic.name not in self._channels:
            schema = self._writer.register_schema(
                topic.type_name, 'ros2msg', topic.definition.encode())
            self._channels[topic.name] = self._writer.register_channel(
                topic.name, 'cdr', schema, {DURABILITY: LATCHED} if topic.latched else {})
        self._writer.add_message(self._channels[topic.name], log_ns, data, sent_ns)

    def _make_room(self) -> None:
        """Remove the oldest files until another one fits."""
        for path in sorted(self.folder.glob('*.mcap')):
            # The new file, and the compressed one that takes its place.
            if self.size_bytes + 2 * self._part <= self._total:
                return
            path.unlink()

    def _close(self) -> None:
        stream, self._stream = self._stream, None
        assert stream is not None
        self._writer.finish()
        stream.flush()
        os.fsync(stream.fileno())
        stream.close()
        compress(self._path)


def compress(path: Path) -> None:
    """Write a file anew with compressed chunks and an index; a broken end of it is left out."""
    new = path.with_suffix('.new')
    with path.open('rb') as source, new.open('wb') as target:
        writer = Writer(target, chunk_size=256 * 1024, compression=CompressionType.ZSTD)
        writer.start(PROFILE, LIBRARY)
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        try:
            for record in StreamReader(source).records:
                if isinstance(record, Schema) and record.id not in schemas:
                    schemas[record.id] = writer.register_schema(
                        record.name, record.encoding, record.data)
                elif isinstance(record, Channel) and record.id not in channels:
                    channels[record.id] = writer.register_channel(
                        record.topic, record.message_encoding, schemas[record.schema_id],
                        record.metadata)
                elif isinstance(record, Metadata):
                    writer.add_metadata(record.name, record.metadata)
                elif isinstance(record, Message):
                    writer.add_message(channels[record.channel_id], record.log_time, record.data,
                                       record.publish_time, record.sequence)
        except (McapError, EOFError):
            pass
        writer.finish()
        target.flush()
        os.fsync(target.fileno())
    new.replace(path)
