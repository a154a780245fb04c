"""What happened in a recording, for a person: words, answers, states of the body, diagnostics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from w2b_controller.recording.reader import Decoder, Recorded
from w2b_core.status import Level

WORD, STATUS, DIAGNOSTICS = ('std_msgs/msg/String', 'diagnostic_msgs/msg/DiagnosticStatus',
                             'diagnostic_msgs/msg/DiagnosticArray')


@dataclass(frozen=True)
class Event:
    """Something that happened `at_s` seconds after the recording began."""

    at_s: float
    topic: str
    text: str

    def __str__(self) -> str:
        return f'{self.at_s:9.3f} s  {self.topic:20} {self.text}'


def events(recorded: Iterable[Recorded]) -> Iterator[Event]:
    """Yield what happened: each word, and each change of an answer, a body or a diagnostic."""
    decoder, begin_ns = Decoder(), None
    last: dict[tuple[str, str], tuple[int, str]] = {}
    for message in recorded:
        begin_ns = message.log_ns if begin_ns is None else begin_ns
        at_s = (message.log_ns - begin_ns) / 1e9
        if message.type_name == WORD and not message.latched:
            yield Event(at_s, message.topic, f'said: {decoder.decode(message).data!r}')
        if message.type_name not in (STATUS, DIAGNOSTICS):
            continue
        found = decoder.decode(message)
        for status in [found] if message.type_name == STATUS else found.status:
            # bytes in rclpy, a number in MCAP's decoder.
            level = int(status.level[0] if isinstance(status.level, bytes) else status.level)
            before = last.get((message.topic, status.name))
            if before == (level, status.message):
                continue
            last[message.topic, status.name] = (level, status.message)
            if before is None and level == Level.OK and message.type_name == DIAGNOSTICS:
                continue
            yield Event(at_s, message.topic,
                        f'{Level(min(level, Level.STALE)).name:5} {status.name}: {status.message}')
