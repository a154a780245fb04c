"""The recogniser of a server: a process that starts when somebody talks, and blocks nothing."""

from __future__ import annotations

import asyncio
import json
import sys
from contextlib import suppress
from typing import Any

from w2b_web.voice.recogniser import MISSING, is_there
from w2b_web.voice.worker import HEADER

#: The model loads in 0.3 s, and a word takes 0.1 s, on a machine that has time.
ANSWER_S = 30.0
#: A process that nobody needed for this long ends: it holds 130 MB.
IDLE_S = 300.0


class ListenError(RuntimeError):
    """Nothing can be recognised; one line says why."""


class Listener:
    """Recognises one sound after the other; used in one event loop."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._process: asyncio.subprocess.Process | None = None
        self._idle: asyncio.TimerHandle | None = None
        self.started = 0

    async def recognise(self, pcm: bytes) -> str:
        """
        Return the word that a sound is, empty if it is none.

        Parameters
        ----------
        pcm
            As `sound.from_bytes` takes it.

        Raises
        ------
        ListenError
            If it cannot be recognised.

        """
        if not is_there():
            raise ListenError(MISSING)
        async with self._turn:
            if self._idle is not None:
                self._idle.cancel()
            answer: dict[str, Any] | None = None
            try:
                async with asyncio.timeout(ANSWER_S):
                    answer = await self._answer(pcm)
            except (TimeoutError, OSError, ValueError) as error:
                why = 'it took too long' if isinstance(error, TimeoutError) else str(error)
                raise ListenError(f'the recogniser ended: {why}; talk again') from error
            finally:
                # What it answers later would be taken for the answer to the next.
                if answer is None:
                    self._kill()
            self._idle = asyncio.get_running_loop().call_later(IDLE_S, self._kill)
        if 'error' in answer:
            raise ListenError(str(answer['error']))
        return str(answer['text'])

    async def _answer(self, pcm: bytes) -> dict[str, Any]:
        """Ask; once more if the process that is there had died."""
        try:
            return await self._ask(pcm)
        except (OSError, ValueError):
            self._kill()
            return await self._ask(pcm)

    async def _ask(self, pcm: bytes) -> dict[str, Any]:
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                sys.executable, '-m', 'w2b_web.voice.worker', stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE)
            self.started += 1
            if 'error' in (ready := await self._line()):
                return ready
        assert self._process.stdin is not None
        self._process.stdin.write(HEADER.pack(len(pcm)) + pcm)
        await self._process.stdin.drain()
        return await self._line()

    async def _line(self) -> dict[str, Any]:
        assert self._process is not None
        assert self._process.stdout is not None
        line = await self._process.stdout.readline()
        if not line:
            raise OSError('no answer')
        found: dict[str, Any] = json.loads(line)
        return found

    def _kill(self) -> None:
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()
            if self._process.stdin is not None:
                self._process.stdin.close()
        self._process = None

    async def close(self) -> None:
        """End the process."""
        if self._idle is not None:
            self._idle.cancel()
        process = self._process
        self._kill()
        if process is not None:
            # Its pipes are closed too.
            await process.communicate()
