"""`listen` over DDS: what it hears goes to the page's box; only stop and halt are said at once."""

import shutil
import sys
import wave
from importlib.util import find_spec

import pytest
from std_msgs.msg import String

from tests.ros.page_client import PageClient
from tests.w2b_web.serving import free_port
from w2b_web.voice.sound import RATE_HZ
from w2b_web.voice.synthesis import Voice, in_noise

pytestmark = pytest.mark.skipif(
    shutil.which('espeak-ng') is None or find_spec('pocketsphinx') is None,
    reason='needs espeak-ng (apt-get install espeak-ng) and pocketsphinx (requirements/listen.txt)')


@pytest.fixture
def spoken(tmp_path):
    """Return a function that writes a word as a WAV file, as a microphone in a quiet room does."""
    def write(word):
        path = tmp_path / f'{word}.wav'
        with wave.open(str(path), 'wb') as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(RATE_HZ)
            file.writeframes(in_noise(Voice('espeak-ng', 'en-us').say(word), 30.0, 0)
                             .astype('<i2').tobytes())
        return str(path)
    return write


def test_what_is_heard_waits_in_the_box_and_halt_stops_the_robot(system, spoken):
    commands = []
    system.node.create_subscription(String, 'command', lambda said: commands.append(said.data), 10)
    system.start('sim', body='physical_twin', real_time_factor=1.0)
    system.start('brain', controller='physical_twin')
    system.wait_for_brain()
    port = free_port()
    node = system.start('page', port=port)
    system.wait(lambda: 'in a browser' in node.log, 'the page')
    page = PageClient(port)
    try:
        system.wait(lambda: page.last('state').get('brain') is True, 'the robot on the page')
        listen = system.start('listen', spoken('march'), spoken('halt'), spoken('banana'))
        system.wait(lambda: listen.exit_code is not None, 'the end of listen')
        assert listen.exit_code == 1, listen.log
        assert 'march.wav: march (' in listen.log
        assert 'banana.wav: none of the words (' in listen.log
        assert "'halt': said" in listen.log
        system.wait(lambda: page.last('heard').get('text') == 'halt', 'what was heard')
        system.wait(lambda: page.last('answer').get('text') == 'halt', 'the answer of the brain')
        assert page.last('answer')['behaviour'] == 'stop'
        found = [message for _at, message in page.messages if message['k'] == 'heard']
        assert [(one['text'], one['sent']) for one in found] == [('march', False), ('halt', True)]
        # The brain heard *halt*, see above; this client may have been connected later.
        assert set(commands) <= {'halt'}, 'no other word is said without a person'
    finally:
        page.close()


def test_without_a_brain_stop_is_published_and_said_to_be_heard_by_none(system, spoken):
    # The client of the test hears no command: nobody does.
    listen = system.start('listen', spoken('stop'))
    assert listen.wait() == 0
    assert "'stop' was heard by no brain: start one with" in listen.log


@pytest.mark.parametrize(('content', 'says'), [
    (b'', 'expected a WAV file'), (b'RIFFxxxxWAVE', 'expected a WAV file'), (None, 'No such file')])
def test_what_is_no_sound_is_named(system, tmp_path, content, says):
    path = tmp_path / 'sound.wav'
    if content is not None:
        path.write_bytes(content)
    listen = system.start('listen', '--print', str(path))
    assert listen.wait() == 2
    assert says in listen.log
    assert 'Traceback' not in listen.log


def test_without_a_terminal_or_the_library_one_line_says_what_is_needed(system, tmp_path):
    listen = system.start('listen')
    assert listen.wait() == 2
    assert 'expected a terminal, where Enter begins to listen, or WAV files' in listen.log
    (tmp_path / 'pocketsphinx.py').write_text('raise ImportError("not here")')
    system.set_environment(PYTHONPATH=f'{tmp_path}:{system.environment.get("PYTHONPATH", "")}')
    listen = system.start('listen', '--print', sys.executable)
    assert listen.wait() == 2
    assert 'pip install -r requirements/listen.txt' in listen.log
    assert len(listen.log.strip().splitlines()) == 1
