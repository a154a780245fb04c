"""The committed bundle is that of the sources beside it, and asks nobody else for anything."""

import json
import re
import shutil
import subprocess
from hashlib import sha256
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / 'ros2_ws' / 'src' / 'w2b_web'
BROWSER, HTML, STATIC = (PACKAGE / path for path in ('browser', 'w2b_web/html', 'w2b_web/static'))
MANIFEST = json.loads((STATIC / 'manifest.json').read_text())


def digest(path):
    return sha256(path.read_bytes()).hexdigest()


def test_it_was_made_from_these_sources():
    sources = {path.name: digest(path) for path in (BROWSER / 'src').iterdir()}
    sources |= {name: digest(BROWSER / name) for name in (
        'build.mjs', 'package.json', 'package-lock.json')}
    assert sources == MANIFEST['sources'], 'run: cd ros2_ws/src/w2b_web/browser && npm ci && ' \
        'npm run build'


def test_it_is_what_was_made():
    assert {path.name: digest(path) for path in STATIC.iterdir()
            if path.name != 'manifest.json'} == MANIFEST['bundle']


def test_its_libraries_are_pinned_and_bring_their_licences():
    package = json.loads((BROWSER / 'package.json').read_text())
    locked = json.loads((BROWSER / 'package-lock.json').read_text())['packages']
    licences = (STATIC / 'licences.txt').read_text()
    for name, version in package['dependencies'].items():
        assert locked[f'node_modules/{name}']['version'] == version
        assert locked[f'node_modules/{name}']['integrity'].startswith('sha512-')
        assert f'{name} {version}\n' in licences
    assert licences.count('Permission is hereby granted') == len(package['dependencies'])


def test_it_names_no_place_but_its_own():
    # Documentation in error messages, and names of XML: nothing of it is loaded.
    known = {'github.com', 'www.w3.org', 'jcgt.org', 'threejs.org'}
    for path in (*HTML.iterdir(), *STATIC.iterdir()):
        if path.suffix in ('.js', '.css', '.html', '.svg'):
            text = path.read_text(encoding='utf-8')
            assert set(re.findall(r'(?:https?:)?//([a-z0-9.-]+\.[a-z]{2,})', text)) <= known, path
    pages = list(HTML.glob('*.html'))
    assert len(pages) == 2
    for page in pages:
        assert not re.findall(r'(?:src|href)="(?!/|#)', page.read_text()), 'relative to its root'
        assert 'style=' not in page.read_text(), 'its policy allows no inline style'


def test_npm_makes_the_same(tmp_path):
    if shutil.which('npm') is None:
        pytest.skip('no npm here: the bundle is not made again (its hashes are tested)')
    copy = tmp_path / 'browser'
    shutil.copytree(BROWSER, copy, ignore=shutil.ignore_patterns('node_modules'))
    got = subprocess.run(['npm', 'ci', '--ignore-scripts', '--prefer-offline'], cwd=copy,
                         capture_output=True, text=True, timeout=120, check=False)
    if got.returncode:
        pytest.skip(f'npm got no packages here: {got.stderr.strip()[-200:]}')
    made = subprocess.run(['node', 'build.mjs', str(tmp_path / 'static')], cwd=copy,
                          capture_output=True, text=True, timeout=120, check=False)
    assert made.returncode == 0, made.stderr
    assert {path.name: digest(path) for path in (tmp_path / 'static').iterdir()} == {
        path.name: digest(path) for path in STATIC.iterdir()}
