"""What open pages say into their microphones: bounded, recognised one by one, then told to them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from w2b_web.rate import Rate
from w2b_web.voice.listener import Listener, ListenError
from w2b_web.voice.recogniser import DIRECT
from w2b_web.voice.sound import LONGEST_BYTES, LONGEST_S

#: Of one page, in the long run.
TALKS_PER_S = 1.0


@dataclass
class Talk:
    """What one page has said since its button was pressed."""

    robot: str
    sound: bytearray = field(default_factory=bytearray)
    ended: bool = False


class Talks:
    """
    The pages that talk; used in the server's event loop.

    Parameters
    ----------
    listener
        Recognises.
    tell
        (page, kind, values) sends a message to a page that may be gone.
    say
        (robot, word, page) says a word to a robot.
    clock
        Monotonic seconds.

    """

    def __init__(self, listener: Listener, tell: Callable[..., None],
                 say: Callable[[str, str, int], None],
                 clock: Callable[[], float] = time.monotonic) -> None:
        self._listener = listener
        self._tell = tell
        self._say = say
        self._clock = clock
        self._talks: dict[int, Talk] = {}
        self._rates: dict[int, Rate] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, page: int, robot: str) -> None:
        """Begin to take a page's sound, for a robot."""
        before = self._talks.get(page)
        if before is not None and before.ended:
            self._tell(page, 'note', level='warn', text='not listening: the last word is being '
                       'recognised')
        elif self._rates.setdefault(page, Rate(TALKS_PER_S, self._clock)).allow():
            self._talks[page] = Talk(robot)
        else:
            self._tell(page, 'note', level='warn', text='not listening: expected one word a second '
                       'at most')

    def take(self, page: int, sound: bytes) -> bool:
        """Take a piece of sound; return whether a page may send it."""
        if page not in self._rates:
            return False
        talk = self._talks.get(page)
        # What comes after the end, or after a refusal, was under way.
        if talk is not None and not talk.ended:
            talk.sound += sound[:LONGEST_BYTES - len(talk.sound)]
        return True

    def end(self, page: int) -> None:
        """Recognise what a page said, and tell it."""
        talk = self._talks.get(page)
        if talk is None or talk.ended:
            return
        talk.ended = True
        task = asyncio.get_running_loop().create_task(self._recognise(page, talk))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _recognise(self, page: int, talk: Talk) -> None:
        cut = len(talk.sound) >= LONGEST_BYTES
        began_s = self._clock()
        try:
            text = await self._listener.recognise(bytes(talk.sound))
        except ListenError as error:
            self._tell(page, 'note', level='bad', text=f'not understood: {error}')
            return
        finally:
            if self._talks.get(page) is talk:
                del self._talks[page]
        sent = text in DIRECT
        if sent:
            self._say(talk.robot, text, page)
        self._tell(page, 'heard', text=text, sent=sent, robot=talk.robot,
                   took_s=round(self._clock() - began_s, 3))
        if cut:
            self._tell(page, 'note', level='warn', text=f'only the first {LONGEST_S:g} s were '
                       'listened to')

    def forget(self, page: int) -> None:
        """Drop what a page said that is gone."""
        self._talks.pop(page, None)
        self._rates.pop(page, None)

    async def close(self) -> None:
        """Recognise nothing more."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._listener.close()
