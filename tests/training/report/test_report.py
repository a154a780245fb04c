"""The report: complete, self-contained, the same for the same results, with the paper's values."""

from __future__ import annotations

import json
import re
import socket
from html.parser import HTMLParser
from pathlib import Path

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from tests.training.report.report_data import tables
from tests.training.study_files import main_command, plain, run_inline
from training.evolution.vectors import vectors
from training.report import behaviour, figures, figures_robustness, pages, style
from training.report import tables as report_tables
from training.report.about import core_time
from training.report.comparisons import comparisons, panels, per_run, thresholds_m
from training.report.findings import beyond, findings
from training.report.published import COMMANDS, COSINES, FITNESS, TITLES
from training.report.robustness import robustness_section
from training.report.statistics import compare_all, median_interval
from training.report.verdicts import UNTESTED

WHOLE = {**{('paper', body): 1.0 for body in TITLES}, ('balanced', 'quadruped'): 1.0}


@pytest.fixture(scope='module')
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of a study on the real engine: two treatments of the quadruped, both word sets."""
    study = tmp_path_factory.mktemp('report') / 'study'
    experiment = plain()['experiments'][0]
    run_inline(plain(experiments=[{**experiment, 'seeds': 2},
                                  {**experiment, 'words': 'balanced', 'seeds': 2}]), study)
    assert main_command('report', study) == 0
    return study / 'report'


class Page(HTMLParser):
    """Collects what a page refers to, and checks that its tags match."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.headings: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        if tag not in ('meta', 'img', 'br', 'link'):
            self.open.append(tag)
        self.sources += [value or '' for name, value in attributes if name in ('src', 'href')]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == 'h2':
            self.headings.append(data)


def test_the_page_needs_nothing_beside_it(reported: Path) -> None:
    text = (reported / 'report.html').read_text(encoding='utf-8')
    page = Page()
    page.feed(text)
    assert page.open == []
    pictures = [source for source in page.sources if not source.startswith('#')]
    assert len(pictures) == 9
    # Figures first, verdicts after them.
    first = text[:text.index('id="findings"')]
    assert re.findall(r'<figure id="(\w+)"', first) == ['displacement', 'grounding']
    assert text.count('<figure id="displacement"') == 1
    assert all(source.startswith('data:image/png;base64,') for source in pictures)
    for source in page.sources:
        assert not source.startswith('#') or f'id="{source[1:]}"' in text
    for fact in ('@media print', 'Provenance', 'hash of the commands’ vectors', 'batched, float32',
                 'Objective: program', 'commit '):
        assert fact in text, fact
    assert 'http' not in re.sub(r'data:image/png;base64,[^"]*', '', text)
    for heading in ('What replicates', 'Beyond the paper', 'What differs from the paper',
                    'Figure 4', 'Figures 5 and 6', 'Table III', 'Tables I and II',
                    'elsewhere', 'All comparisons', 'Time'):
        assert any(heading in found for found in page.headings), heading
    assert 'nan' not in re.sub(r'data:image/png;base64,[^"]*', '', text).lower().split()


def test_every_figure_comes_as_png_and_pdf(reported: Path) -> None:
    names = {path.stem for path in (reported / 'figures').glob('*.png')}
    assert names == {'fitness', 'priming', 'displacement', 'balanced', 'conditions', 'lexicon',
                     'similarity', 'effects', 'grounding'}
    for name in names:
        assert (reported / 'figures' / f'{name}.pdf').read_bytes().startswith(b'%PDF')
        picture = matplotlib.image.imread(reported / 'figures' / f'{name}.png')
        assert picture.shape[0] > 300
        assert picture[..., :3].std() > 0.01, 'not blank'


def test_the_same_results_give_the_same_report(reported: Path, tmp_path: Path) -> None:
    assert main_command('report', reported.parent, '--out', tmp_path) == 0
    for name in ('report.html', 'summary.md', 'comparisons.csv', 'figures/displacement.pdf'):
        assert (tmp_path / name).read_bytes() == (reported / name).read_bytes(), name


def test_the_summary_has_every_comparison_and_the_papers_numbers(reported: Path) -> None:
    text = (reported / 'summary.md').read_text(encoding='utf-8')
    rows = pd.read_csv(reported / 'comparisons.csv')
    assert len(rows) == 2 * 10
    numbers = ['p', 'p_holm', 'rank_biserial', 'common_language', 'u', 'median_first']
    assert rows[numbers].dtypes.eq(float).all(), 'in full precision'
    assert (rows.p_holm >= rows.p).all()
    assert (rows.rank_biserial_low <= rows.rank_biserial).all()
    assert '1.84 (0.07)' in text
    assert '0.42 (0.42)' in text
    assert 'no runs of: Minimal' in text


def test_what_is_published_can_be_committed(reported: Path, tmp_path: Path) -> None:
    stale = tmp_path / 'docs' / 'figures' / 'gone.png'
    stale.parent.mkdir(parents=True)
    stale.write_bytes(b'')
    assert main_command('report', reported.parent, '--out', tmp_path / 'report',
                        '--publish', tmp_path / 'docs') == 0
    docs = tmp_path / 'docs'
    assert {path.name for path in docs.iterdir()} == {
        'summary.md', 'comparisons.csv', 'figures', 'results.parquet'}
    assert not stale.exists()
    text = (docs / 'summary.md').read_text(encoding='utf-8')
    linked = set(re.findall(r'\]\((figures/[^)]+)\)', text))
    assert linked == {f'figures/{path.name}' for path in (docs / 'figures').iterdir()}
    for path in (docs / 'figures').iterdir():
        assert path.stat().st_size <= pages.LARGEST_BYTES
    # Nothing of this machine.
    assert str(reported) not in text
    assert not re.search(rf'\b{re.escape(socket.gethostname())}\b', text)


@pytest.mark.parametrize('lacking', ['one run', 'one treatment', 'robustness', 'pybullet',
                                     'lexicon'])
def test_partial_studies_are_reported_with_what_they_lack(lacking: str) -> None:
    seeds = 1 if lacking == 'one run' else 3
    store = tables({('paper', 'minimal'): 1.0, ('balanced', 'quadruped'): 1.0}, seeds=seeds)
    if lacking == 'one treatment':
        store = {name: table[table.treatment == 'control'] for name, table in store.items()}
    if lacking in ('robustness', 'lexicon'):
        kept = () if lacking == 'robustness' else ('perturbed',)
        store['robustness'] = store['robustness'][store['robustness'].condition.isin(kept)]
    table = per_run(store['runs'], store['outcomes'], store['robustness'])
    limits = thresholds_m(table)
    rates = (behaviour.lexicon(store['robustness'], limits)
             if (store['robustness'].condition == 'lexicon').any() else None)
    tested = compare_all(comparisons(
        table, None if rates is None else behaviour.selectivity(rates)))
    about = {'config': {'name': 'x', 'robustness': {'perturbed_starts': 1, 'pybullet_starts': 1}},
             'identity': {'vocabulary': 'default'}}
    section = robustness_section(store, table, rates, limits, tested, about)
    text = ' '.join(section.paragraphs)
    assert ('No champion has been scored again yet' in text) == (lacking == 'robustness')
    assert ('PyBullet: no champion was scored in it' in text) == (lacking != 'robustness')
    assert ('lexicon' in section.figures) == (lacking not in ('robustness', 'lexicon'))
    assert figures.bars(table, tested, panels(table)) is not None
    assert figures.fitness(store['history'], panels(table)) is not None
    verdicts = {one.verdict for one in [*findings(tested, table), *beyond(tested, table)]}
    assert verdicts == {UNTESTED}, 'so few runs decide nothing'
    for frame in (*section.tables.values(), report_tables.displacement(table),
                  report_tables.by_held_out(table), report_tables.all_comparisons(tested)):
        assert 'nan' not in frame.to_csv(), frame


def test_a_study_under_way_is_said_to_be_partial(
        reported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert 'Partial' not in (reported / 'summary.md').read_text(encoding='utf-8')
    study = tmp_path / 'study'
    run_inline(plain(robustness={'perturbed_starts': 0, 'pybullet_starts': 0}), study)
    (study / 'runs' / 'paper-quadruped-control-0000' / 'summary.json').unlink()
    about = json.loads((study / 'study.json').read_text())
    about['config']['robustness'] |= {'perturbed_starts': 2}
    (study / 'study.json').write_text(json.dumps(about))
    for path in study.glob('runs/*/rescored.json'):
        path.unlink()
    capsys.readouterr()
    assert main_command('report', study) == 0
    said = capsys.readouterr()
    assert said.out == f'{study / "report" / "report.html"}\n', 'for scripts: the path alone'
    few, missing, unscored = said.err.splitlines()
    assert few == 'report: 0 of 1 seeds: too few, no verdict.'
    assert missing.startswith('report: Partial: 1 of 2 configured runs not finished yet (Quadruped '
                              'control 0 of 1)')
    assert unscored.startswith('report: Partial: 1 of 1 champion not scored yet')
    page = (study / 'report' / 'report.html').read_text(encoding='utf-8')
    assert page.count('<p class="partial">Partial: 1 of ') == 2
    summary = (study / 'report' / 'summary.md').read_text(encoding='utf-8')
    assert '**Partial: 1 of 2 configured runs' in summary
    # One run is one run, and no hour.
    assert summary.splitlines()[2].startswith('1 evolutionary run of 6 generations and ')
    assert ' core seconds. Engine' in summary
    assert 'Size: 1 run a body and treatment' in summary
    assert ' 1 runs' not in summary


@pytest.mark.parametrize(('seconds', 'said'), [
    (4.2, '4.2 core seconds'), (90, '1.5 core minutes'), (5400, '1.5 core hours')])
def test_core_time_has_the_unit_that_suits_it(seconds: float, said: str) -> None:
    assert core_time(seconds) == said


def test_commands_are_code_and_numbers_are_not_wrapped(reported: Path) -> None:
    page = re.sub(r'data:image/png;base64,[^"]*', '',
                  (reported / 'report.html').read_text(encoding='utf-8'))
    assert '`' not in page
    assert '<code>python -m training fidelity</code>' in page
    cells = re.findall(r'<td( class="n")?>([^<]*)</td>', page)
    intervals = [css for css, text in cells if re.fullmatch(r'[-+.\d]+ \[[^\]]+\]', text)]
    assert len(intervals) > 20
    assert all(intervals)
    assert not any(css for css, text in cells if text == 'fitness: E against C')


def test_a_study_without_runs_is_an_error(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main_command('report', tmp_path) == 2
    assert 'no study here' in capsys.readouterr().err


@pytest.mark.parametrize('content', [b'', b'[]', b'{}', b'{"config": {}}'])
def test_a_damaged_study_file_is_an_error(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes) -> None:
    (tmp_path / 'study.json').write_bytes(content)
    assert main_command('report', tmp_path) == 2
    error = capsys.readouterr().err
    assert 'study.json: damaged' in error
    assert 'delete it and run the study again' in error
    assert error.count('\n') == 1


def test_table_1_is_the_papers_to_two_decimals() -> None:
    table, largest = report_tables.table_1(vectors('default', COMMANDS))
    assert largest < 0.005
    for row, values in zip(COMMANDS, COSINES, strict=False):
        for column, value in zip(COMMANDS[COMMANDS.index(row) + 1:], values, strict=True):
            assert table.loc[row, column] == f'{value:.2f} ({value:.2f})'


def test_permuted_vectors_are_nearly_at_right_angles() -> None:
    cosines = report_tables.permuted_cosines(vectors('default', COMMANDS), range(20))
    upper = cosines[:, *np.triu_indices(6, 1)]
    # Two random directions in 300 dimensions: standard deviation 1 / sqrt(300).
    assert upper.std() == pytest.approx(300 ** -0.5, rel=0.2)
    assert abs(upper.mean()) < 0.02


def test_table_3_stands_beside_the_papers() -> None:
    store = tables(WHOLE)
    table = per_run(store['runs'], store['outcomes'])
    rows = report_tables.table_3(table, compare_all(comparisons(table))).set_index('robot')
    assert rows.loc['Minimal', 'C, paper'] == '5.30 (0.06)'
    assert rows.loc['Quadruped, balanced set', 'C, paper'] == ''
    median = select_median(table, 'minimal', 'control')
    assert rows.loc['Minimal', 'C, here'].startswith(f'{median:.2f} (')


def select_median(table: pd.DataFrame, body: str, treatment: str) -> float:
    rows = table[(table.body == body) & (table.treatment == treatment)]
    return float(rows.fitness.median())


def test_the_projection_is_for_the_papers_study() -> None:
    rows, hours = report_tables.timing(tables(WHOLE)['runs'])
    # 25.5 s for 100 generations in the median; 1,400 runs of 6,000.
    assert hours == pytest.approx(1400 * 60 * 25.5 / 3600, rel=1e-6)
    assert len(rows) == 7
    # Of a busy machine, the CPU time tells more.
    busy = tables(WHOLE)['runs'].assign(cpu_s=10.0)
    assert report_tables.timing(busy)[1] == pytest.approx(1400 * 60 * 10 / 3600, rel=1e-3)
    assert report_tables.timing(tables({('paper', 'minimal'): 1.0})['runs'])[1] is None


def test_bars_are_the_medians_with_their_intervals() -> None:
    store = tables(WHOLE)
    table = per_run(store['runs'], store['outcomes'])
    tested = compare_all(comparisons(table))
    figure = figures.bars(table, tested, panels(store['runs'])[:6])
    axes = figure.axes[1]
    assert 'Minimal' in axes.get_title(loc='left')
    heights = sorted(patch.get_height() for patch in axes.patches)
    rows = table[(table.word_set == 'paper') & (table.body == 'minimal')]
    expected = sorted(rows.groupby('treatment')[['move', 'stop', 'test']].median().to_numpy().flat)
    assert heights == pytest.approx(expected)
    low, high = median_interval(rows[rows.treatment == 'control'].move)
    ends = [tuple(segment[:, 1]) for container in axes.containers
            for line in getattr(container, 'lines', [()])[2:] for bar in line
            for segment in bar.get_segments()]
    assert any(end == pytest.approx((low, high)) for end in ends)
    texts = [text.get_text() for text in axes.texts]
    # E against C under the unheard word, and both treatments' move against stop.
    assert texts.count('***') + texts.count('**') >= 3


def test_a_rate_of_zero_is_said_and_one_not_measured_is_not() -> None:
    store = tables({('paper', 'minimal'): 1.0})
    own = behaviour.own_words(store['outcomes'], store['robustness'], {'minimal': 0.25})
    own.loc[own.question == 'backward', 'rate'] = 0.0
    own = own[(own.question != 'forward') | (own.treatment == 'control')]
    axes = figures_robustness.conditions(own, [('paper', 'minimal')]).axes[0]
    zeros = sorted(text.get_position()[0] for text in axes.texts if text.get_text() == '0')
    # Backward in two treatments, as evolved and perturbed; control's held-out words, likewise.
    assert len(zeros) == 6
    assert all(0.5 < x < 1.5 or 2.5 < x < 3.0 for x in zeros)


def test_places_on_the_displacement_axis() -> None:
    lengths = np.array([0.0, 0.25, 1.0, 10.0, 100.0])
    assert style.squeezed(lengths) == pytest.approx([0, 0.25, 1, 2, 3])
    assert style.unsqueezed(style.squeezed(lengths)) == pytest.approx(lengths)


def test_intervals_of_a_rate_stay_within_it() -> None:
    mean, low, high = figures_robustness.mean_interval(np.array([0.0, 1.0, 1.0, 1.0]))
    assert 0 <= low <= mean <= high <= 1
    assert figures_robustness.mean_interval(np.ones(3)) == (1.0, 1.0, 1.0)


def test_the_papers_bodies_have_titles() -> None:
    assert set(FITNESS) == set(TITLES)
