"""One word from a microphone of this machine: begins when it is loud, ends when it is quiet."""

from __future__ import annotations

from collections.abc import Generator, Iterable

import numpy as np

from w2b_web.voice.sound import LONGEST_S, RATE_HZ, Samples

BLOCK = RATE_HZ * 30 // 1000
#: What is noise, before a person speaks; how much louder speech is; the silence that ends it.
_NOISE_S, _LOUDER_DB, _PAUSE_S = 0.3, 8.0, 0.6
_WAIT_S = 5.0


class MicrophoneError(RuntimeError):
    """There is no microphone; one line says why, and what to do."""


def level_db(block: Samples) -> float:
    """Return how loud a block is."""
    return float(10.0 * np.log10(np.mean(block.astype(np.float64)**2) + 1.0))


def utterance(blocks: Iterable[Samples]) -> Samples:
    """Return what is said until a pause, or until `sound.LONGEST_S`; silence if nobody speaks."""
    kept: list[Samples] = []
    noise_db = quiet_s = 0.0
    speaks = False
    block_s = BLOCK / RATE_HZ
    for block in blocks:
        kept.append(block)
        heard_s = len(kept) * block_s
        if heard_s <= _NOISE_S:
            noise_db = max(noise_db, level_db(block))
            continue
        loud = level_db(block) > noise_db + _LOUDER_DB
        speaks = speaks or loud
        quiet_s = 0.0 if loud else quiet_s + block_s
        if (speaks and quiet_s >= _PAUSE_S) or heard_s + block_s > LONGEST_S or (
                not speaks and heard_s >= _WAIT_S):
            break
    return np.concatenate(kept) if kept else np.zeros(0, np.int16)


def microphone(device: str = '') -> Generator[Samples, None, None]:
    """
    Yield blocks of sound from a microphone.

    Parameters
    ----------
    device
        Part of its name, or its number; empty: the default one.

    Raises
    ------
    MicrophoneError
        If there is none.

    """
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise MicrophoneError(f'expected PortAudio for a microphone, got {error}: '
                              'sudo apt-get install libportaudio2, or give a WAV file') from error
    try:
        with sounddevice.InputStream(
                samplerate=RATE_HZ, channels=1, dtype='int16', blocksize=BLOCK,
                device=(int(device) if device.isdigit() else device) or None) as stream:
            while True:
                yield stream.read(BLOCK)[0][:, 0].copy()
    except (sounddevice.PortAudioError, ValueError) as error:
        raise MicrophoneError(f'expected a microphone, got {error}: choose one with --device '
                              '(python -m sounddevice lists them), or give a WAV file') from error
