"""The page in a real browser, with a real robot behind it."""

import math
import socket

import pytest

from tests.ros import browser as browsers
from tests.ros.browser import CHROMIUM, MISSING, OPTIONS

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


@pytest.fixture(scope='module')
def chromium():
    """A browser, for all pages of this module."""
    from playwright.sync_api import sync_playwright
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield browser
        browser.close()


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


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
    page.see('#answer', '“march”: following', 'forward', 'never heard in training', 'nearest:',
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
