"""The figures of docs/grounding.md: maps, confusion, risk and coverage, accuracy against k."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from training.grounding.lexicon import Lexicon
from w2b_core.files import write_atomically
from w2b_core.hearing import places
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]

COLOURS = {'stop': '#c0392b', 'forward': '#27ae60', 'backward': '#2980b9', 'near miss': '#b0b0b0'}
NAMED = 9
DPI = 110


def write(folder: Path, judged: Mapping[str, Any], words: Lexicon, vocabulary: Vocabulary,
          metric: Metric) -> None:
    """Write `grounding.json` and the figures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / 'grounding.json', (json.dumps(judged, indent=1) + '\n').encode())
    for name, figure in (('map', _maps(words, vocabulary, metric)),
                         ('confusion', _confusion(judged, words)),
                         ('coverage', _coverage(judged)), ('accuracy', _accuracy(judged))):
        figure.savefig(folder / f'{name}.png', dpi=DPI, bbox_inches='tight',
                       metadata={'Software': None})


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def _maps(words: Lexicon, vocabulary: Vocabulary, metric: Metric) -> Figure:
    """Draw the lexicon's words in the plane that parts them most, before and after the metric."""
    groups = {name: [word for word, entry in words.words.items() if entry.behaviour == name]
              for name in words.scored} | {'near miss': list(words.near_miss)}
    figure = _figure(12, 6)
    panels = figure.subplots(1, 2)
    for panel, title in zip(panels, ('word vectors', 'behind the learned metric'), strict=True):
        def place(names: list[str], plain: bool = title == 'word vectors') -> Array:
            if plain:
                return unit(unit(vocabulary.matrix(names).astype(np.float64)) - metric.mean)
            return places.project(names, vocabulary, metric)

        heads = np.array([place(groups[name]).mean(axis=0) for name in words.scored])
        axes = np.linalg.svd(heads - heads.mean(axis=0), full_matrices=False)[2][:2]
        for name, found in reversed(groups.items()):
            if not found:
                continue
            x, y = axes @ (place(found) - heads.mean(axis=0)).T
            panel.scatter(x, y, s=14, color=COLOURS.get(name), label=name, alpha=0.8)
            for index in range(min(NAMED, len(found)) if name != 'near miss' else 0):
                at = index * len(found) // NAMED
                panel.annotate(found[at], (x[at], y[at]), fontsize=7, alpha=0.9)
        panel.set_title(title)
        panel.set_xticks([])
        panel.set_yticks([])
    panels[0].legend(fontsize=8)
    return figure


def _confusion(judged: Mapping[str, Any], words: Lexicon) -> Figure:
    """Draw what words of a left-out family are taken for."""
    names = list(words.scored)
    table = np.zeros((len(names), len(names)))
    for word, entry in words.words.items():
        if entry.behaviour in names:
            answer = judged['wrong'].get(word, entry.behaviour)
            table[names.index(entry.behaviour), names.index(answer)] += 1
    shares = table / table.sum(axis=1, keepdims=True)
    figure = _figure(4.2, 3.6)
    panel = figure.subplots()
    panel.imshow(shares, cmap='Blues', vmin=0, vmax=1)
    for row in range(len(names)):
        for column in range(len(names)):
            panel.text(column, row, f'{shares[row, column]:.2f}\n{table[row, column]:.0f}',
                       ha='center', va='center', fontsize=9,
                       color='white' if shares[row, column] > 0.5 else 'black')
    panel.set_xticks(range(len(names)), names)
    panel.set_yticks(range(len(names)), names)
    panel.set_xlabel('taken for')
    panel.set_ylabel('asks for')
    return figure


def _coverage(judged: Mapping[str, Any]) -> Figure:
    """Draw the accuracy of accepted synonyms against the share that is accepted."""
    figure = _figure(5, 3.4)
    panel = figure.subplots()
    curve = np.array(judged['refusal']['curve'])
    if len(curve):
        panel.plot(curve[:, 0], curve[:, 1], color='#444444')
        refused = judged['refusal']['synonyms_refused']
        panel.axvline(1 - refused, color='#c0392b', linewidth=1,
                      label='90 % of random words refused')
        panel.legend(fontsize=8, loc='lower left')
    panel.set_xlabel('share of synonyms accepted (never heard)')
    panel.set_ylabel('right among them')
    panel.set_ylim(0.5, 1.02)
    return figure


def _accuracy(judged: Mapping[str, Any]) -> Figure:
    """Draw the accuracy against the words heard, with the rivals."""
    figure = _figure(6.4, 4)
    panel = figure.subplots()
    rows = [(int(name), row) for name, row in judged['accuracy'].items()
            if name.isdigit() and row]
    counts = [count for count, _row in rows]
    macros = [row['macro'] for _count, row in rows]
    low, high = ([row[key] for _count, row in rows] for key in ('low', 'high'))
    panel.plot(counts, macros, color='#c0392b', linewidth=2, marker='o', label='the ear')
    panel.fill_between(counts, low, high, color='#c0392b', alpha=0.12)
    for name, found in judged['rivals'].items():
        points = [(int(count), row['macro']) for count, row in found.items() if count.isdigit()]
        if points:
            panel.plot(*zip(*points, strict=True), marker='.', linewidth=1, label=name)
    panel.axhline(1 / len(judged['accuracy']['leave_one_family_out']['per_behaviour']),
                  color='#888888', linestyle=':', label='chance')
    panel.set_xlabel('words a behaviour that were heard (k)')
    panel.set_ylabel('macro accuracy, unseen stem families')
    panel.set_xticks(counts)
    panel.legend(fontsize=7, loc='center left', bbox_to_anchor=(1.0, 0.5))
    return figure
