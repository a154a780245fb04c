"""
Checkpoints, written as `w2b_core.files` writes.

A checkpoint holds all that a run needs to go on as if it had never stopped: named arrays and the
state of its random generator, in one .npz file whose members carry checksums.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core.files import write_atomically as write_atomically
from w2b_core.files import write_json as write_json

FORMAT = 1


class CheckpointError(ValueError):
    """A checkpoint cannot be used; the message says which file, why, and what to do."""


def save(path: Path, arrays: Mapping[str, NDArray[np.generic]],
         generator: np.random.Generator) -> None:
    """Write a checkpoint of `arrays` and of the generator's state."""
    buffer = BytesIO()
    state = json.dumps({'format': FORMAT, 'generator': generator.bit_generator.state})
    np.savez(buffer, state=np.array(state), **arrays)  # type: ignore[arg-type]
    write_atomically(path, buffer.getvalue())


def save_array(path: Path, array: NDArray[np.generic]) -> None:
    """Write one array as a .npy file."""
    buffer = BytesIO()
    np.save(buffer, array, allow_pickle=False)
    write_atomically(path, buffer.getvalue())


def reason(error: Exception) -> str:
    """Return why a file could not be read, in a few words; numpy's hint at pickles misleads."""
    if 'pickle' in str(error):
        return 'not a file of numpy arrays'
    return f'{type(error).__name__}: {" ".join(str(error).split())}'


def load(path: Path, generator: np.random.Generator) -> dict[str, NDArray[np.generic]]:
    """
    Return the arrays of the checkpoint at `path`, and set the generator's state.

    Raises
    ------
    CheckpointError
        If the file is damaged or of another format.

    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        state = json.loads(str(arrays.pop('state')))
        if state['format'] != FORMAT:
            raise CheckpointError(f'{path}: expected checkpoint format {FORMAT}, got '
                                  f'{state["format"]}; resume with the program that wrote it')
        generator.bit_generator.state = state['generator']
    except CheckpointError:
        raise
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile,
            zlib.error) as error:
        raise CheckpointError(f'{path}: not a readable checkpoint ({reason(error)}); delete it to '
                              'start this run again from its first generation') from None
    return arrays
