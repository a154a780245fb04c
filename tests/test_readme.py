"""The README's Python runs as it stands there, and its links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

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


def test_it_is_short():
    text = re.sub(r'<!-- begin (\w+) -->.*?<!-- end \1 -->|```.*?```', '', README, flags=re.DOTALL)
    assert len(text.split()) <= 900


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_that_are_there(page):
    text = page.read_text(encoding='utf-8')
    for target in re.findall(r'\]\(([^)#\s]+)', text):
        if '://' not in target:
            assert (page.parent / target).exists(), f'{page.name}: {target}'
