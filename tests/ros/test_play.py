"""`w2b play`: everything starts with one command and ends with one Ctrl-C."""

import argparse
import re
from pathlib import Path

import psutil
import pytest

from tests.ros.page_client import PageClient
from tests.w2b_web.serving import free_port
from w2b_web.play import has_display, processes

#: A controller that carries its body, which is no registered one.
ROBOTS = Path(__file__).resolve().parents[2] / 'examples' / 'robots'
DOG12, DOG12_YAML = str(ROBOTS / 'dog12_legs.json'), str(ROBOTS / 'dog12.yaml')


def play(system, *arguments):
    """Start it; return it, and a page that it serves."""
    port = free_port()
    played = system.start('play', '--no-browser', '--port', str(port), *arguments)
    system.wait(lambda: 'in a browser' in played.log or played.exit_code is not None, 'the page')
    assert re.search(rf'play: open http://127.0.0.1:{port}/ in a browser', played.log), played.log
    return played, PageClient(port)


def children(played):
    return psutil.Process(played.pid).children(recursive=True)


def test_a_simulated_robot_hears_words_and_ctrl_c_ends_all(system):
    played, page = play(system, '--speed', '2')
    system.wait(lambda: page.last('state').get('brain') and page.last('f'), 'robot and brain')
    page.send('say', text='march')
    system.wait(lambda: page.last('answer').get('body_follows') == 'true', 'the body following')
    started = children(played)
    assert len(started) == 3
    assert played.stop() == 0
    assert 'play: all ended' in played.log
    assert not [child for child in started if child.is_running()]
    page.close()


def test_the_page_draws_a_robot_that_comes_from_a_file(system):
    """Its YAML names the robot, its controller lies beside it."""
    played, page = play(system, '--robot', DOG12_YAML, '--speed', '2')
    system.wait(lambda: page.last('shape').get('links') and page.last('f'), 'the drawing')
    assert page.last('shape')['name'] == 'dog12'
    turning = {joint['name'] for joint in page.last('shape')['joints'] if joint['kind'] == 'turn'}
    assert turning == set(page.last('names')['joints'])
    assert len(turning) == len(page.last('f')['q']) == 12
    system.wait(lambda: page.last('state').get('brain'), 'the brain')
    page.send('say', text='march')
    system.wait(lambda: page.last('answer').get('body_follows') == 'true', 'the body following')
    assert played.stop() == 0
    page.close()


def test_the_simulated_hardware_ends_with_it_even_if_it_is_killed(system):
    played, page = play(system, '--hardware', 'simulated')
    assert 'press Arm there' in played.log
    system.wait(lambda: page.last('state').get('hardware') is True and page.last('f')
                and page.last('state')['brain'], 'hardware and brain')
    started = children(played)
    played.kill()
    gone, alive = psutil.wait_procs(started, timeout=60)
    assert len(gone) >= 3
    assert not alive
    page.close()


def test_a_part_that_cannot_start_ends_all_with_its_reason(system):
    port = free_port()
    first = system.start('page', port=port)
    system.wait(lambda: 'in a browser' in first.log, 'the page')
    played = system.start('play', '--no-browser', '--port', str(port))
    assert played.wait() == 1
    assert 'play: page ended with 1' in played.log
    assert 'is in use, by another page most likely' in played.log
    assert 'play: all ended' in played.log


def options(**given):
    return argparse.Namespace(**{'robot': 'physical_twin', 'engine': 'pybullet', 'hardware': None,
                                 'speed': 1.0, 'port': 8096, 'namespace': '', **given})


@pytest.mark.parametrize(('given', 'robot', 'words'), [
    ({}, 'sim', ['body:=physical_twin', 'engine:=pybullet', 'real_time_factor:=1.0']),
    ({'robot': 'quadruped', 'engine': 'mujoco', 'speed': 2.0}, 'sim',
     ['body:=quadruped', 'engine:=mujoco', 'real_time_factor:=2.0']),
    ({'robot': DOG12}, 'sim', [f'body:={DOG12}']),
    ({'robot': DOG12_YAML}, 'sim', [f'body:={DOG12_YAML}']),
    ({'robot': DOG12_YAML, 'hardware': 'simulated'}, 'hardware', [f'body:={DOG12_YAML}']),
    ({'hardware': 'simulated'}, 'hardware', ['transport:=simulated', 'body:=physical_twin']),
    ({'hardware': 'emulated'}, 'hardware', ['transport:=emulated']),
    ({'namespace': 'dog1'}, 'sim', ['__ns:=/dog1'])])
def test_what_it_starts(given, robot, words):
    started = processes(options(**given))
    own = given.get('robot', '').startswith('/')
    assert list(started) == [robot, 'brain', *(['description'] if own else []), 'page']
    assert not own or f'body:={given["robot"]}' in started['description']
    assert set(words) <= set(started[robot])
    assert f'controller:={given.get("robot", "physical_twin")}' in started['brain']
    assert 'port:=8096' in started['page']


def test_a_robot_that_is_unknown_is_refused():
    with pytest.raises(ValueError, match='physical_twin'):
        processes(options(robot='dog9'))


def test_a_browser_is_opened_only_where_there_is_a_screen():
    assert has_display({'DISPLAY': ':0'})
    assert not has_display({'DISPLAY': ''})
    assert not has_display({})
