"""Synthesised speech (eSpeak NG, Flite, where they are) and noise, to measure a recogniser."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from w2b_web.voice.sound import RATE_HZ, Samples, read_wav

#: The words were chosen with the first ones (`recogniser.WORDS`), never heard were the others.
CHOSEN_WITH = ('espeak-ng:en-us', 'espeak-ng:en-gb', 'flite:rms', 'flite:slt', 'flite:kal16')
OTHERS = ('espeak-ng:en-gb-scotland', 'espeak-ng:en-us+f4', 'espeak-ng:en-us+m7',
          'espeak-ng:en-gb-x-rp+f3', 'flite:awb')
#: Root mean square of speech, of 32,767, and the silence before and after it.
_SPEECH, _PAUSE_S = 3000.0, 0.3
#: Words a minute of eSpeak NG.
_PACE = '150'
MISSING = 'expected espeak-ng or flite to synthesise speech: sudo apt-get install espeak-ng flite'


@dataclass(frozen=True)
class Voice:
    """A voice of a synthesiser."""

    program: str
    name: str

    def say(self, text: str) -> Samples:
        """Return a text as sound."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'said.wav'
            arguments = {'espeak-ng': ['-v', self.name, '-s', _PACE, '-w', str(path), text],
                         'flite': ['-voice', self.name, '-t', text, '-o', str(path)]}
            subprocess.run([self.program, *arguments[self.program]], check=True,
                           capture_output=True)
            return read_wav(path)


def voices(names: tuple[str, ...] = (*CHOSEN_WITH, *OTHERS)) -> list[Voice]:
    """Return those of the voices whose synthesiser is installed."""
    found = [Voice(*name.split(':')) for name in names]
    return [voice for voice in found if shutil.which(voice.program)]


def noise(count: int, seed: int) -> Samples:
    """Return pink noise of a root mean square of 1000."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).normal(size=count))
    hz = np.maximum(np.fft.rfftfreq(count, 1.0 / RATE_HZ), 60.0)
    sound = np.fft.irfft(spectrum / np.sqrt(hz), count)
    return np.clip(1000.0 * sound / sound.std(), -32767, 32767).astype(np.int16)


def in_noise(said: Samples, snr_db: float, seed: int) -> Samples:
    """Return speech of a common loudness with a pause around it, in noise of a ratio to it."""
    speech = said.astype(np.float64)
    loud = np.abs(speech) > 0.02 * np.abs(speech).max()
    speech *= _SPEECH / np.sqrt(np.mean(speech[loud]**2))
    pause = np.zeros(int(_PAUSE_S * RATE_HZ))
    clean = np.concatenate([pause, speech, pause])
    loudness = _SPEECH / 10.0**(snr_db / 20.0)
    return np.clip(clean + noise(len(clean), seed) * (loudness / 1000.0), -32767,
                   32767).astype(np.int16)
