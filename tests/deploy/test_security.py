"""The SROS2 policy: valid, and only the brain and the page (and the operator) command."""

import os
import subprocess
from pathlib import Path

import pytest

pytest.importorskip('lxml')
from tests.deploy.policy import FOLDER, RULES, allowed, tree

ENCLAVES = ('brain', 'hardware', 'sim', 'description', 'page', 'operator', 'teleop', 'viewer')


def test_the_policy_is_valid_by_the_schema_of_sros2():
    pytest.importorskip('sros2', reason='sros2 and its schema come with a standard Jazzy only')
    from lxml import etree
    from sros2.policy import get_policy_schema
    etree.XMLSchema(etree.parse(str(get_policy_schema('policy.xsd')))).assertValid(tree())


def test_the_policy_has_the_form_that_sros2_reads():
    root = tree().getroot()
    assert (root.tag, root.get('version')) == ('policy', '0.2.0')
    enclaves, = root
    assert [enclave.get('path') for enclave in enclaves] == [f'/w2b/{name}' for name in ENCLAVES]
    for profile in root.iter('profile'):
        assert set(profile.attrib) == {'ns', 'node'}
        assert len(profile), 'what is included was found'
        for group in profile:
            if not isinstance(group.tag, str):
                continue
            rules = {(group.tag, name) for name in group.attrib
                     if name != '{http://www.w3.org/XML/1998/namespace}base'}
            assert rules
            assert rules <= RULES
            assert {group.get(direction) for _tag, direction in rules} == {'ALLOW'}
            assert {one.tag for one in group} == {group.tag.removesuffix('s')}


@pytest.mark.parametrize(('topic', 'who'), [
    ('/joint_trajectory', {'brain'}), ('/command', {'page', 'operator'}), ('/cmd_vel', {'teleop'}),
    ('/body_status', {'hardware', 'sim'}), ('/command_answer', {'brain'})])
def test_only_who_shall_publishes(topic, who):
    assert {enclave.removeprefix('/w2b/') for enclave, rules in allowed().items()
            if topic in rules['topics', 'publish']} == who


def test_nobody_may_publish_or_offer_everything():
    for enclave, rules in allowed().items():
        for rule in (('topics', 'publish'), ('services', 'reply')):
            assert not [name for name in rules[rule] if '*' in name], enclave


def test_only_page_and_operator_ask_for_anything():
    asking = {enclave for enclave, rules in allowed().items() if rules['services', 'request']}
    assert asking == {'/w2b/page', '/w2b/operator'}
    page = allowed()['/w2b/page']['services', 'request']
    assert not [name for name in page if 'change_state' in name or '*' in name]


@pytest.fixture
def keystore(tmp_path):
    """Return a function that runs the script with a `ros2` that notes what it is asked for."""
    programs, calls = tmp_path / 'bin', tmp_path / 'calls'
    programs.mkdir()
    (programs / 'ros2').write_text(f"""#!/bin/bash
echo "$ROS_DOMAIN_ID $*" >> {calls}
case $2 in
    create_keystore) mkdir -p "$3/enclaves" ;;
    create_enclave) mkdir -p "$3/enclaves$4" && echo "$RANDOM" > "$3/enclaves$4/key.pem" ;;
    create_permission) cp "$5" "$3/enclaves$4/policy.xml" && cp "$(dirname "$5")"/*.xml "$3" ;;
esac
""")
    (programs / 'ros2').chmod(0o755)

    def run(*arguments, path=f'{programs}:/usr/bin:/bin'):
        calls.write_text('')
        done = subprocess.run(
            ['bash', FOLDER / 'keystore', *map(str, arguments)], capture_output=True, text=True,
            env={**os.environ, 'PATH': path, 'ROS_DOMAIN_ID': '42'}, check=False)
        return done, calls.read_text().splitlines()
    return run


def test_the_script_makes_a_key_and_permissions_for_every_enclave(keystore, tmp_path):
    store = tmp_path / 'keys'
    done, calls = keystore(store)
    assert done.returncode == 0, done.stderr
    assert 'domain 42, namespace /' in done.stdout
    for name in ENCLAVES:
        assert [line for line in calls if f'create_enclave {store} /w2b/{name}' in line]
        assert [line for line in calls if f'create_permission {store} /w2b/{name}' in line]
    keys = {path: path.read_text() for path in store.rglob('key.pem')}
    assert len(keys) == len(ENCLAVES)
    assert all(path.stat().st_mode & 0o077 == 0 for path in keys), 'nobody else reads a key'
    # Again: permissions are renewed, keys stay.
    done, calls = keystore(store)
    assert done.returncode == 0
    assert {path: path.read_text() for path in store.rglob('key.pem')} == keys
    assert sum('create_permission' in line for line in calls) == len(ENCLAVES)
    assert not [line for line in calls if 'create_enclave' in line or 'create_keystore' in line]


def test_the_permissions_of_a_namespace_are_its_own(keystore, tmp_path):
    done, _calls = keystore(tmp_path / 'keys', 'dog1')
    assert done.returncode == 0, done.stderr
    rules = allowed(tmp_path / 'keys' / 'policy.xml')['/w2b/brain']
    assert '/dog1/joint_trajectory' in rules['topics', 'publish']
    assert '/dog1/brain/change_state' in rules['services', 'reply']
    assert '/diagnostics' in rules['topics', 'publish']
    assert not [name for name in rules['topics', 'subscribe']
                if not name.startswith(('/dog1/', '/clock', '/parameter_events'))]


def test_what_cannot_be_is_refused_in_a_line(keystore, tmp_path):
    done, calls = keystore(tmp_path / 'keys', 'dog 1')
    assert done.returncode == 2
    assert 'expected a namespace' in done.stderr
    assert not calls
    done, calls = keystore()
    assert done.returncode == 2
    assert 'keystore DIR [NAMESPACE]' in done.stderr
    done, _calls = keystore(tmp_path / 'keys', path='/usr/bin:/bin')
    assert done.returncode == 1
    assert 'ros-jazzy-sros2' in done.stderr
    assert not (tmp_path / 'keys').exists()
    assert Path(FOLDER / 'keystore').stat().st_mode & 0o111
