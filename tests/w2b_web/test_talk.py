"""Push to talk through the page's server: words are heard, and what attacks it is refused."""

import asyncio
import json
import shutil
import time
from importlib.util import find_spec

import aiohttp
import pytest

from tests.w2b_web.serving import until
from tests.w2b_web.test_attacks import run, serving, until_closed
from w2b_web.voice.sound import LONGEST_BYTES, RATE_HZ
from w2b_web.voice.synthesis import Voice, in_noise
from w2b_web.voice.talks import TALKS_PER_S

__all__ = ['serving']
PIECE = 2048
#: Loading the model takes 0.3 s of a processor that has nothing else to do.
HEARD_S = 60.0
#: A page's next talk before this is refused.
NEXT_TALK_S = 1.1 / TALKS_PER_S
needs_speech = pytest.mark.skipif(
    shutil.which('espeak-ng') is None or find_spec('pocketsphinx') is None,
    reason='needs espeak-ng (apt-get install espeak-ng) and pocketsphinx (requirements/listen.txt)')


@pytest.fixture(scope='module')
def spoken():
    """Return a function that says a word as a microphone in a quiet room hears it."""
    voice = Voice('espeak-ng', 'en-us')
    return lambda word: in_noise(voice.say(word), 30.0, 0).astype('<i2').tobytes()


async def heard(page, kind):
    async with asyncio.timeout(HEARD_S):
        while True:
            message = json.loads((await page.receive()).data)
            if message['k'] == 'ping':
                await page.send_json({'do': 'pong', 'number': 0})
            elif message['k'] == kind:
                return message


async def say(page, sound):
    await page.send_json({'do': 'talk'})
    for place in range(0, len(sound), PIECE):
        await page.send_bytes(sound[place:place + PIECE])
    await page.send_json({'do': 'talked'})


@needs_speech
def test_a_word_comes_back_for_the_box_and_is_not_said(serving, spoken):
    async def attack(session):
        async with serving.page(session) as page:
            assert (await heard(page, 'hello'))['talk'] is True
            await say(page, spoken('march'))
            answer = await heard(page, 'heard')
            assert (answer['text'], answer['sent']) == ('march', False)
            await asyncio.sleep(NEXT_TALK_S)
            began_s = time.monotonic()
            await say(page, spoken('reverse'))
            assert (await heard(page, 'heard'))['text'] == 'reverse'
            print(f'heard {time.monotonic() - began_s:.2f} s after the button was let go')
    run(attack)
    assert not serving.asked.count('say')
    assert not serving.asked.count('arm')


@needs_speech
@pytest.mark.parametrize('word', ['stop', 'halt'])
def test_stop_and_halt_are_said_at_once(serving, spoken, word):
    async def attack(session):
        async with serving.page(session) as page:
            await say(page, spoken(word))
            assert (await heard(page, 'heard'))['sent'] is True
    run(attack)
    assert [(robot, request.do, request.text) for robot, request, _page in
            serving.asked.requests] == [('', 'say', word)]


@needs_speech
@pytest.mark.parametrize('sound', [
    b'\0' * 2 * RATE_HZ, b'\xff\x7f' * RATE_HZ, b'\xff\x7f\x00\x80' * (LONGEST_BYTES // 4)],
    ids=['silence', 'a constant', 'a square wave, too long'])
def test_what_is_no_speech_is_no_word(serving, sound):
    async def attack(session):
        async with serving.page(session) as page:
            await say(page, sound)
            assert (await heard(page, 'heard'))['text'] == ''
    run(attack)


@needs_speech
def test_nobody_waits_while_words_are_recognised(serving, spoken):
    async def attack(session):
        async with serving.page(session) as talker, serving.page(session) as other:
            await heard(other, 'watching')
            await say(talker, spoken('gallop'))
            waiting = asyncio.create_task(heard(talker, 'heard'))
            while not waiting.done():
                count = serving.asked.count('stop')
                await other.send_json({'do': 'pong', 'number': 0})
                await other.send_json({'do': 'stop'})
                await until(lambda count=count: serving.asked.count('stop') > count, 'stop')
                await asyncio.sleep(0.02)
            assert (await waiting)['text'] == 'gallop'
            assert serving.asked.count('stop') > 10, 'each is answered before the next'
    run(attack)


@needs_speech
def test_a_recogniser_that_died_is_started_again(serving, spoken):
    async def attack(session):
        async with serving.page(session) as page:
            await say(page, spoken('march'))
            await heard(page, 'heard')
            listener = serving.hub._talks._listener
            listener._process.kill()
            await asyncio.sleep(NEXT_TALK_S)
            await say(page, spoken('march'))
            assert (await heard(page, 'heard'))['text'] == 'march'
            assert listener.started == 2
    run(attack)


@pytest.mark.parametrize('sound', [b'\0', b'x' * 101, b'\0' * 1000], ids=len)
def test_too_little_or_half_a_sample_is_named(serving, sound):
    async def attack(session):
        async with serving.page(session) as page:
            await say(page, sound)
            assert 'not understood: ' in (await heard(page, 'note'))['text']
    run(attack)


def test_sound_without_talk_ends_its_connection_alone(serving):
    async def attack(session):
        async with serving.page(session) as good, serving.page(session) as bad:
            await bad.send_bytes(b'\0' * PIECE)
            await until_closed(bad)
            await serving.takes_a_word(good)
    run(attack)


def test_a_piece_that_is_too_large_ends_its_connection(serving):
    async def attack(session):
        async with serving.page(session) as page:
            await page.send_json({'do': 'talk'})
            await page.send_bytes(b'\0' * 5000)
            await until_closed(page)
            assert page.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
    run(attack)


def test_a_flood_of_sound_keeps_six_seconds_then_ends_and_stop_is_heard(
        serving, monkeypatch):
    async def attack(session):
        async with serving.page(session) as good, serving.page(session) as flood:
            await flood.send_json({'do': 'talk'})
            talks, kept = serving.hub._talks, []
            take = talks.take

            def watched(page, sound):
                may = take(page, sound)
                kept.append(len(talks._talks[page].sound))
                return may
            monkeypatch.setattr(talks, 'take', watched)
            try:
                for _ in range(2000):
                    await flood.send_bytes(b'\x01' * 4000)
            except (ConnectionError, aiohttp.ClientError):
                pass
            await until_closed(flood)
            assert max(kept) == LONGEST_BYTES
            assert len(kept) < 1000, 'it ends long before'
            await until(lambda: not talks._talks, 'that its sound is dropped')
            await good.send_json({'do': 'stop'})
            await until(lambda: serving.asked.count('stop') == 1, 'stop')
    run(attack)


def test_more_than_one_word_a_second_is_not_listened_to(serving):
    async def attack(session):
        async with serving.page(session) as page:
            for _ in range(3):
                await page.send_json({'do': 'talk'})
            assert 'one word a second' in (await heard(page, 'note'))['text']
    run(attack)


@pytest.mark.parametrize('changes', [{'token': None}, {'token': 'x' * 32}, {'origin': None},
                                     {'origin': 'http://evil.example'}], ids=str)
def test_a_stranger_is_not_listened_to(serving, changes):
    async def attack(session):
        with pytest.raises(aiohttp.WSServerHandshakeError) as raised:
            async with serving.page(session, **changes):
                pass
        assert raised.value.status == 403
    run(attack)
    assert serving.hub._talks._listener.started == 0


def test_without_the_library_the_page_says_how_to_get_it(serving, monkeypatch):
    monkeypatch.setattr('w2b_web.hub.is_there', lambda: False)
    monkeypatch.setattr('w2b_web.voice.listener.is_there', lambda: False)

    async def attack(session):
        async with serving.page(session) as page:
            assert (await heard(page, 'hello'))['talk'] is False
            await say(page, b'\0' * 2 * RATE_HZ)
            assert 'pip install -r requirements/listen.txt' in (await heard(page, 'note'))['text']
    run(attack)


@needs_speech
def test_a_page_that_leaves_while_it_is_listened_to_leaves_nothing(serving, spoken):
    async def attack(session):
        async with serving.page(session) as page:
            await say(page, spoken('halt'))
            await until(lambda: serving.hub._talks._tasks, 'that it is listened to')
        # What it said counts: it stops a robot.
        await until(lambda: serving.asked.count('say') == 1, 'the word')
        await until(lambda: not serving.hub._talks._tasks and not serving.hub._talks._rates
                    and not len(serving.hub), 'the end')
    run(attack)
