"""Sound as the recogniser takes it: 16 kHz, one channel, 16 bits; without steady noise."""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RATE_HZ = 16_000
#: What is listened to at once; a word takes less than 1 s.
LONGEST_S, SHORTEST_S = 6.0, 0.2
LONGEST_BYTES = int(2 * RATE_HZ * LONGEST_S)

Samples = NDArray[np.int16]

#: Window and step of the spectrum, in samples.
_WINDOW, _STEP = 512, 128
#: Of the noise's power, what is taken away, and the least that stays of an amplitude.
_TAKEN, _LEFT = 1.0, 0.4
#: Of the frames, the quietest are noise.
_QUIET = 0.2
#: A faint noise that hides digital silence, which ruins the features.
_FLOOR = 3.0
#: Loudest over quietest 30 ms, below which there is only steady noise, in dB.
_SPEECH_DB = 6.0


class SoundError(ValueError):
    """Sound that cannot be listened to; one line says what was expected."""


def from_bytes(pcm: bytes) -> Samples:
    """
    Return samples from 16-bit little-endian bytes.

    Raises
    ------
    SoundError
        If it is too short, too long, or half a sample.

    """
    seconds = len(pcm) / 2 / RATE_HZ
    if len(pcm) % 2 or not SHORTEST_S <= seconds <= LONGEST_S:
        raise SoundError(f'expected {SHORTEST_S:g} to {LONGEST_S:g} s of 16-bit sound at '
                         f'{RATE_HZ} Hz, got {len(pcm)} bytes ({seconds:.2f} s)')
    return np.frombuffer(pcm, dtype='<i2').astype(np.int16)


def read_wav(path: Path) -> Samples:
    """
    Return the samples of a WAV file: any rate, channels are averaged.

    Raises
    ------
    SoundError
        If it is no WAV file of 16 bits, or too short or too long.

    """
    try:
        with wave.open(str(path), 'rb') as file:
            rate_hz, channels, width = (file.getframerate(), file.getnchannels(),
                                        file.getsampwidth())
            if width != 2:
                raise SoundError(f'{path}: expected 16 bits a sample, got {8 * width}')
            # What is too long is not read: a header may claim anything.
            data = file.readframes(int(rate_hz * (LONGEST_S + 1.0)))
    except (OSError, EOFError, wave.Error) as error:
        raise SoundError(f'{path}: expected a WAV file, got {error or "an early end"}') from error
    if not rate_hz or not channels:
        raise SoundError(f'{path}: expected a rate and channels, got {rate_hz} Hz, {channels}')
    whole = data[:len(data) // (2 * channels) * 2 * channels]
    mono = np.frombuffer(whole, dtype='<i2').reshape(-1, channels).mean(axis=1)
    try:
        return from_bytes(resample(mono, rate_hz).astype('<i2').tobytes())
    except SoundError as error:
        raise SoundError(f'{path}: {error}') from None


def resample(mono: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
    """Return a sound at `RATE_HZ`; what is above half of it is taken away first."""
    if rate_hz == RATE_HZ:
        return mono
    if rate_hz > RATE_HZ and len(mono):
        spectrum = np.fft.rfft(mono)
        spectrum[np.fft.rfftfreq(len(mono), 1.0 / rate_hz) > 0.48 * RATE_HZ] = 0.0
        mono = np.fft.irfft(spectrum, len(mono))
    count = int(len(mono) * RATE_HZ / rate_hz)
    return np.interp(np.arange(count) * rate_hz / RATE_HZ, np.arange(len(mono)), mono)


def is_steady(samples: Samples) -> bool:
    """Return whether a sound is as loud all the time: silence, or noise without speech."""
    frame = RATE_HZ * 30 // 1000
    frames = samples[:len(samples) // frame * frame].reshape(-1, frame).astype(np.float64)
    level_db = 10.0 * np.log10(np.mean(frames**2, axis=1) + _FLOOR**2)
    low, high = np.quantile(level_db, (0.1, 0.95))
    return bool(high - low < _SPEECH_DB)


def without_noise(samples: Samples) -> Samples:
    """
    Return a sound without the noise of its quietest moments.

    Spectral subtraction (Boll, 1979) of the mean power of the quietest fifth of the frames, with
    the power smoothed over time against musical noise, and a floor.
    """
    window = np.sqrt(np.hanning(_WINDOW + 1)[:_WINDOW])
    dithered = samples + np.random.default_rng(0).normal(0.0, _FLOOR, len(samples))
    padded = np.concatenate([np.zeros(_WINDOW), dithered, np.zeros(_WINDOW + _STEP)])
    count = (len(padded) - _WINDOW) // _STEP + 1
    places = _STEP * np.arange(count)[:, None] + np.arange(_WINDOW)
    spectrum = np.fft.rfft(padded[places] * window)
    power = np.abs(spectrum)**2
    inner = np.arange(_WINDOW // _STEP, count - _WINDOW // _STEP - 1)
    quiet = inner[np.argsort(power[inner].sum(axis=1))[:max(4, int(_QUIET * len(inner)))]]
    noise = power[quiet].mean(axis=0)
    smooth = power
    for index in range(1, count):
        smooth[index] = 0.6 * smooth[index - 1] + 0.4 * power[index]
    gain = np.sqrt(np.maximum(1.0 - _TAKEN * noise / np.maximum(smooth, 1e-9), _LEFT**2))
    pieces = np.fft.irfft(spectrum * gain) * window
    clean, weight = np.zeros(len(padded)), np.zeros(len(padded))
    for index, piece in enumerate(pieces):
        clean[_STEP * index:_STEP * index + _WINDOW] += piece
        weight[_STEP * index:_STEP * index + _WINDOW] += window**2
    clean = clean / np.maximum(weight, 1e-3)
    return np.clip(clean[_WINDOW:_WINDOW + len(samples)], -32767, 32767).astype(np.int16)
