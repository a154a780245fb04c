"""The README's Python runs as it stands there, and its links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from w2b_core.controller import file as controller_file
from w2b_core.hearing import Refused
from w2b_core.vocabulary import Vocabulary

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md')), ROOT / 'deploy' / 'README.md']
README = (ROOT / 'README.md').read_text(encoding='utf-8')


def test_its_python_runs_and_the_robot_obeys_words_that_it_never_heard(tmp_path):
    code = '\n'.join(re.findall(r'```python\n(.*?)```', README, re.DOTALL))
    assert 'import' in code
    done = subprocess.run([sys.executable, '-c', code], cwd=tmp_path, capture_output=True,
                          text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stderr
    way_m = {word: float(metres) for word, metres in
             re.findall(r'^(\w+): ([+-][0-9.]+) m', done.stdout, re.MULTILINE)}
    assert way_m['march'] > 0.3
    assert abs(way_m['halt']) < 0.1
    assert way_m['revert'] < -0.3
    assert done.stdout.count('never heard in training') == 3
    assert (tmp_path / 'walk.png').stat().st_size > 5_000


def test_what_it_says_to_the_robot_is_understood_as_it_says(tmp_path):
    ear = controller_file.load(controller_file.shipped('physical_twin')).ear
    vocabulary = Vocabulary.load()
    said = {text.strip('"'): comment for text, comment in
            re.findall(r'w2b say (\S+|"[^"]+") +# (.*)', README)}
    assert set(said) == {'march', 'do not move', 'banana'}
    assert ear.understand('march', vocabulary).behaviour == 'forward'
    assert ear.understand('do not move', vocabulary).behaviour == 'stop'
    assert isinstance(ear.understand('banana', vocabulary), Refused)
    line, = re.findall(r'w2b teach (.*)', README)
    arguments = line.replace('mine.json', str(tmp_path / 'mine.json')).split()
    done = subprocess.run(
        [sys.executable, '-c', 'from w2b_controller.cli.teach import main; '
         'raise SystemExit(main())', *arguments], capture_output=True, text=True, timeout=100,
        check=False)
    assert done.returncode == 0, done.stderr
    taught = controller_file.load(tmp_path / 'mine.json').ear
    assert taught.understand(arguments[0], vocabulary).behaviour == arguments[1]
    assert isinstance(ear.understand(arguments[0], vocabulary), Refused), 'it was no command before'


def test_it_is_short():
    assert len(README.split()) <= 900


def test_its_figures_are_those_of_the_pages_that_commands_write():
    ear, legs = ((ROOT / 'docs' / f'{name}.md').read_text(encoding='utf-8')
                 for name in ('grounding', 'legs'))
    families, few = re.search(r'understands ([\d.]+) with all\s+other families heard, '
                              r'([\d.]+) with', README).groups()
    assert f'| all words but one family heard | {families} (' in ear
    assert f'| 4 words a behaviour heard | {few} (' in ear
    speed, error = re.search(r'walk ([\d.]+) body lengths a second .*?within (\d+) degrees', README,
                             re.DOTALL).groups()
    block = re.search(r'<!-- begin judge -->(.*?)<!-- end judge -->', legs, re.DOTALL)[1]
    rows = [line.split(' | ') for line in block.splitlines()
            if line.split(' | ')[1:2] in (['forward'], ['backward'])]
    assert len(rows) == 4
    for row in rows:
        assert round(float(row[2].split()[0]), 1) == float(speed)
        assert float(re.search(r'\(([\d.]+)\)', row[3])[1]) <= float(error)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_that_are_there(page):
    text = page.read_text(encoding='utf-8')
    for target in re.findall(r'\]\(([^)#\s]+)', text):
        if '://' not in target:
            assert (page.parent / target).exists(), f'{page.name}: {target}'
