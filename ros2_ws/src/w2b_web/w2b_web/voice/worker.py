"""
A process that recognises words: sound on its standard input, one line of JSON each on its output.

A request is the number of bytes (4 bytes, little endian) and the sound (`sound.from_bytes`). It
ends with its input. Alone it holds the model, 130 MB, and nobody waits for it in a callback.
"""

from __future__ import annotations

import json
import signal
import struct
import sys
from typing import BinaryIO

from w2b_web.voice.recogniser import MissingError, Recogniser
from w2b_web.voice.sound import LONGEST_BYTES, SoundError, from_bytes

HEADER = struct.Struct('<I')


def serve(requests: BinaryIO, answers: BinaryIO) -> int:
    """Answer requests until they end; return the exit code."""
    try:
        recogniser = Recogniser()
    except MissingError as error:
        _answer(answers, error=str(error))
        return 1
    _answer(answers, words=list(recogniser.words))
    while len(header := requests.read(HEADER.size)) == HEADER.size:
        length, = HEADER.unpack(header)
        if length > LONGEST_BYTES:
            _answer(answers, error=f'expected {LONGEST_BYTES} bytes at most, got {length}')
            return 1
        try:
            heard = recogniser.recognise(from_bytes(requests.read(length)))
        except SoundError as error:
            _answer(answers, error=str(error))
        else:
            _answer(answers, text=heard.text, took_s=round(heard.took_s, 3))
    return 0


def _answer(answers: BinaryIO, **values: object) -> None:
    answers.write(json.dumps(values).encode() + b'\n')
    answers.flush()


def main() -> int:
    """Serve standard input; a Ctrl-C at the terminal is its parent's affair."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return serve(sys.stdin.buffer, sys.stdout.buffer)


if __name__ == '__main__':
    raise SystemExit(main())
