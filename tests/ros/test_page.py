"""The page in a real browser, with a real robot behind it."""

import math
import shutil
import wave
from importlib.util import find_spec

import numpy as np
import pytest

from tests.ros import browser as browsers
from tests.ros.browser import CHROMIUM, MISSING, OPTIONS
from tests.w2b_web.serving import free_port
from w2b_web.voice.sound import RATE_HZ
from w2b_web.voice.synthesis import Voice, in_noise, noise

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


@pytest.fixture(scope='module')
def chromium():
    """A browser, for all pages of this module."""
    from playwright.sync_api import sync_playwright
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield browser
        browser.close()


@pytest.fixture
def served(system, chromium):
    """Return a function that starts the node `page`, and one that opens it."""
    contexts = []

    def serve(**parameters):
        parameters.setdefault('port', free_port())
        node = system.start('page', **parameters)
        system.wait(lambda: 'in a browser' in node.log or node.exit_code is not None, 'the page')
        assert node.exit_code is None, node.log
        return node, f'http://127.0.0.1:{parameters["port"]}/'

    def opened(address, width=1280, height=800, **options):
        context = chromium.new_context(viewport={'width': width, 'height': height}, **options)
        contexts.append(context)
        page = browsers.Page(context.new_page(), address)
        page.open()
        return page

    yield serve, opened
    for context in contexts:
        context.close()


def start_robot(system):
    system.start('sim', body='physical_twin', real_time_factor=1.0)
    return system.start('brain', controller='physical_twin')


def test_a_word_moves_the_robot_and_the_page_shows_it(system, served):
    serve, opened = served
    brain = start_robot(system)
    node, address = serve()
    page = opened(address)
    page.see('#pills', 'page: connected', 'brain: listens')
    start = page.at_m()
    # Two words that it heard, one that it never heard, one refused, one that is none.
    page.say('march')
    page.see('#answer', '“march”: following forward', 'never heard in training', 'nearest:',
             'the body follows it')
    page.until(lambda: math.dist(page.at_m()[:2], start[:2]) > 0.15, 'the robot walking')
    page.say('banana')
    page.see('#answer', '“banana”: refused')
    page.say('forwrad')
    page.see('#answer', 'unknown word', 'say instead', 'forwards')
    assert page.ask('w2b.behaviour') == 'forward', 'what is refused changes nothing'
    page.see('#said', 'march', 'banana', 'refused')
    page.say('left')
    page.see('#now', 'left')
    page.see('#legend', 'forward', 'left')
    page.shot('page_1280')
    page.page.keyboard.press('Escape')
    page.see('#body-state', 'paused')
    page.see('#now', 'stop')
    stopped = page.ask('w2b.last.t')
    brain.kill()
    page.see('#banner', 'The brain is gone')
    assert page.ask('w2b.last.t') - stopped < 0.2, 'the simulation is paused'
    # The page comes back by itself after the node's restart, with a new token.
    node.stop()
    page.see('#banner', 'No connection', 'STOP does not get through')
    serve(port=int(address.rstrip('/').rpartition(':')[2]))
    page.see('#pills', 'page: connected')
    page.see('#body-state', 'paused')
    assert not page.errors
    assert not page.foreign, 'no request leaves the machine'


def test_on_a_phone_in_the_dark_by_keyboard_and_with_labels(system, served):
    serve, opened = served
    start_robot(system)
    _node, address = serve()
    page = opened(address, 390, 844, color_scheme='dark')
    page.see('#pills', 'page', 'brain', 'body')
    page.at_m()
    assert page.ask('document.documentElement.dataset.theme') == 'dark'
    assert page.ask('document.documentElement.scrollWidth') == 390, 'nothing is cut off'
    box = page.page.locator('#stop').bounding_box()
    assert box['y'] + box['height'] <= 844, 'STOP is in sight'
    assert min(box['width'], box['height']) >= 44, 'and large enough for a thumb'
    unnamed = page.ask("""[...document.querySelectorAll('button, input, select, [role=img], meter')]
        .filter(node => node.checkVisibility() && !node.ariaLabel && !node.innerText.trim()
            && !node.labels?.length && !node.getAttribute('aria-labelledby'))
        .map(node => node.outerHTML)""")
    assert not unnamed, 'a screen reader has a name for everything'
    # Without a pointer: suggestions, a word, and one said earlier.
    page.page.keyboard.press('/')
    page.page.keyboard.type('forwar')
    page.see('#suggestions', 'forward')
    page.page.keyboard.press('ArrowDown')
    assert page.ask("document.querySelector('[aria-selected=true]').id") == page.ask(
        "document.activeElement.getAttribute('aria-activedescendant')")
    page.page.keyboard.press('Enter')
    page.see('#answer', 'following')
    page.page.keyboard.press('ArrowUp')
    assert page.ask("document.getElementById('word').value").startswith('forwar')
    # A second page sees what the first one said; a reset clears the path.
    other = opened(address)
    other.see('#said', 'forwar')
    page.page.locator('[data-do=reset]').click(timeout=60_000)
    page.see('#note', 'reset')
    page.shot('page_390')
    page.page.locator('#stop').click(timeout=60_000)
    other.see('#body-state', 'paused')
    for one in (page, other):
        assert not one.errors
        assert not one.foreign


def microphone(path, word):
    """Write what a microphone hears, over and over: a quiet room, a word, and the room again."""
    room = (noise(3 * RATE_HZ // 2, 0) * 0.095).astype('<i2')
    said = in_noise(Voice('espeak-ng', 'en-us').say(word), 30.0, 0)
    with wave.open(str(path), 'wb') as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE_HZ)
        file.writeframes(np.concatenate([room, said, room]).astype('<i2').tobytes())
    return path


@pytest.mark.skipif(
    shutil.which('espeak-ng') is None or find_spec('pocketsphinx') is None,
    reason='needs espeak-ng (apt-get install espeak-ng) and pocketsphinx (requirements/listen.txt)')
def test_what_is_spoken_waits_for_enter(system, served, chromium, tmp_path):
    serve, _opened = served
    start_robot(system)
    _node, address = serve()
    word = 'march'
    file = microphone(tmp_path / f'{word}.wav', word)
    browser = chromium.browser_type.launch(executable_path=CHROMIUM, args=[
        *OPTIONS, '--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream',
        f'--use-file-for-fake-audio-capture={file}'])
    try:
        page = browsers.Page(browser.new_page(viewport={'width': 1280, 'height': 800}), address)
        page.open()
        page.see('#pills', 'brain: listens')
        button = page.page.locator('#talk')
        page.until(button.is_visible, 'the button')
        hold = button.bounding_box()
        page.page.mouse.move(hold['x'] + hold['width'] / 2, hold['y'] + hold['height'] / 2)
        # Where in the word the page begins to listen is chance: it may be torn.
        for _try in range(8):
            page.page.mouse.down()
            page.until(lambda: button.inner_text() == 'Speak', 'that it listens')
            page.page.wait_for_timeout(3500)
            page.page.mouse.up()
            note = page.until(lambda: next(iter(
                text for text in [page.page.inner_text('#note')] if 'heard' in text
                or 'not understood' in text), ''), 'what was heard')
            if f'heard “{word}”' in note:
                break
            page.ask("document.getElementById('note').textContent = ''")
        page.see('#note', f'heard “{word}”')
        assert page.page.input_value('#word') == word
        assert page.ask('w2b.behaviour') == '', 'nothing moves before Enter'
        page.shot('talk_1280')
        page.page.keyboard.press('Enter')
        page.see('#answer', f'“{word}”: following forward', 'the body follows it')
        assert not page.errors
        assert not page.foreign
    finally:
        browser.close()
