"""A real browser that opens the page: Debian's Chromium, driven by playwright."""

from __future__ import annotations

import importlib.util
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ARTEFACTS = Path(__file__).resolve().parents[2] / 'out' / 'page'
CHROMIUM = shutil.which('chromium') or shutil.which('google-chrome')
#: Why there is no browser here, empty if there is one.
MISSING = ('' if CHROMIUM and importlib.util.find_spec('playwright') else
           'no chromium here (make setup installs it, as root on Debian)' if not CHROMIUM else
           'no playwright here (make setup installs it)')
#: As root Chromium has no sandbox; without a GPU it draws on the CPU.
OPTIONS = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--mute-audio',
           *(['--no-sandbox'] if os.geteuid() == 0 else [])]
DEADLINE_S = 60.0


class Page:
    """An open page, looked at through what it shows."""

    def __init__(self, page: Any, address: str) -> None:
        self.page, self.address = page, address
        self.errors: list[str] = []
        self.foreign: list[str] = []
        page.on('pageerror', lambda error: self.errors.append(str(error)))
        page.on('console', lambda line: self.errors.append(line.text)
                if line.type == 'error' and 'ERR_CONNECTION' not in line.text
                and 'WebSocket connection' not in line.text else None)
        page.on('request', lambda request: self.foreign.append(request.url)
                if not request.url.startswith((address, address.replace('http', 'ws'), 'data:'))
                else None)

    def open(self) -> None:
        self.page.goto(self.address)

    def until(self, condition: Callable[[], Any], what: str,
              deadline_s: float = DEADLINE_S) -> Any:
        end_s = time.monotonic() + deadline_s
        while not (found := condition()):
            assert time.monotonic() < end_s, f'waited {deadline_s:g} s for {what}; the page ' \
                f'shows: {self.page.inner_text("body")}'
            self.page.wait_for_timeout(40)
        return found

    def see(self, selector: str, *texts: str) -> None:
        """Wait until an element shows some texts."""
        self.until(lambda: all(text in self.page.inner_text(selector) for text in texts),
                   f'{texts} in {selector}')

    def ask(self, expression: str) -> Any:
        return self.page.evaluate(expression)

    def at_m(self) -> list[float]:
        return self.until(lambda: self.ask('w2b.last && w2b.last.p'), 'a pose')

    def say(self, text: str) -> None:
        self.page.fill('#word', text)
        self.page.keyboard.press('Enter')

    def shot(self, name: str) -> None:
        """Keep what is seen, for people."""
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=ARTEFACTS / f'{name}.png')
