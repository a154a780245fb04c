"""A page that can say nothing any more: closed, hung, or with its connection lost."""

import asyncio
import time

import aiohttp
import pytest

from tests.w2b_web.serving import Serving, heard, until
from w2b_web.senders import Senders


@pytest.fixture
def serving():
    with Serving() as running:
        yield running


def test_a_page_that_closes_is_lost_at_once(serving):
    async def scenario():
        async with aiohttp.ClientSession() as session:
            async with serving.page(session) as page:
                await heard(page, 'watching')
            closed_s = time.monotonic()
            await until(lambda: serving.asked.lost, 'that it is noticed')
            assert serving.asked.lost[0][1] - closed_s < 0.5
    asyncio.run(scenario())


def test_a_page_whose_browser_hangs_is_lost_within_2_s_though_its_connection_answers(serving):
    """The browser's network answers pings of the protocol for a page that hangs."""
    async def scenario():
        async with aiohttp.ClientSession() as session, serving.page(session) as page:
            for _ in range(3):
                await heard(page, 'ping')
                await page.send_json({'do': 'pong', 'number': 0})
            hung_s = time.monotonic()
            assert not serving.asked.lost
            while not serving.asked.lost:
                await heard(page, 'ping')
            assert serving.asked.lost[0][1] - hung_s < 2.0
            # Lost once, not at every look; and back as soon as it answers.
            await heard(page, 'ping')
            assert len(serving.asked.lost) == 1
            await page.send_json({'do': 'pong', 'number': 0})
            await until(lambda: not any(client.lost for client in serving.hub._clients.values()),
                        'that it is back')
    asyncio.run(scenario())


def senders():
    now = [0.0]
    return Senders(lambda: now[0]), now


def test_who_moved_the_robot_stops_it_when_lost():
    pages, _now = senders()
    pages.said(1, 'march')
    pages.understood('march', moves=True)
    assert not pages.lost(2)
    assert pages.lost(1)
    assert not pages.lost(1), 'once'


@pytest.mark.parametrize('since', [
    lambda pages: pages.understood('halt', moves=False),
    lambda pages: pages.understood('turn', moves=True),
    lambda pages: pages.stopped()])
def test_who_moved_it_before_somebody_else_did_or_it_stood_does_not(since):
    pages, _now = senders()
    pages.said(1, 'march')
    pages.understood('march', moves=True)
    since(pages)
    assert not pages.lost(1)


def test_a_word_that_is_not_answered_yet_counts_for_a_while():
    pages, now = senders()
    pages.said(1, 'march')
    assert pages.lost(1)
    pages.said(1, 'march')
    now[0] = 10.0
    assert not pages.lost(1)


def test_a_refused_word_moves_nothing():
    pages, _now = senders()
    pages.said(1, 'banana')
    pages.refused('banana')
    assert not pages.lost(1)


def test_of_two_pages_that_say_words_at_once_each_is_known_by_its_own():
    pages, _now = senders()
    pages.said(1, 'march')
    pages.said(2, 'left')
    pages.understood('march', moves=True)
    pages.understood('left', moves=True)
    assert not pages.lost(1)
    assert pages.lost(2)
