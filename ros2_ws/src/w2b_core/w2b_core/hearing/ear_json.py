"""An ear as the JSON that lives in a controller file under `ear`, strictly validated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.hearing.ear import Ear
from w2b_core.hearing.english import STOP
from w2b_core.hearing.judge import Judge
from w2b_core.hearing.softmax import Softmax
from w2b_core.json_fields import Fields, Text, expect

FORMAT = 'projection'
#: Version -> whether a word's inflections count where it lies.
VERSIONS = {1: False, 2: True}

Array = NDArray[np.float64]


def to_json(ear: Ear) -> dict[str, Any]:
    """Return an ear as JSON values; `from_json` returns the same ear."""
    judge = ear.judge
    words: dict[str, list[str]] = {name: [] for name in ear.behaviours}
    for word, behaviour in ear.words.items():
        words[behaviour].append(word)
    version = next(number for number, forms in VERSIONS.items() if forms == ear.forms)
    return {
        'format': FORMAT, 'version': version, 'behaviours': list(ear.behaviours),
        'priority': list(ear.priority), 'vocabulary': ear.vocabulary,
        'vector_length': ear.vector_length, 'vectors_sha256': ear.vectors_sha256,
        'metric_sha256': ear.metric_sha256,
        'words': [{'behaviour': name, 'words': found} for name, found in words.items()],
        'near': list(ear.near), 'unclaimed': list(ear.unclaimed), 'classes': list(judge.classes),
        'sharpness': judge.sharpness, 'threshold': judge.threshold,
        'margins': [list(judge.margins)],
        'classifier': _softmax_json(judge.classifier), 'gate': _softmax_json(judge.gate),
        'means': judge.means.tolist(), 'how': dict(ear.how)}


def from_json(value: object) -> Ear:
    """
    Return the ear that a JSON object describes.

    Raises
    ------
    JsonFileError
        If a field is missing, unknown or damaged; the message names it.

    """
    fields = Fields(value, 'ear')
    kind, version = fields.text('format'), fields.integer('version')
    expect(kind == FORMAT and version in VERSIONS, fields.name('format'),
           f'{FORMAT!r} version {" or ".join(map(str, VERSIONS))}',
           Text(f'{kind[:40]!r} version {version}'))
    behaviours = _names(fields, 'behaviours')
    expect(STOP in behaviours, fields.name('behaviours'), f'{STOP!r} among them', list(behaviours))
    priority = fields.texts('priority')
    expect(sorted(priority) == sorted(behaviours), fields.name('priority'),
           'all behaviours in another order', list(priority))
    vocabulary = fields.text('vocabulary')
    length = fields.integer('vector_length')
    expect(length > 0, fields.name('vector_length'), 'a number above 0', length)
    vectors_sha256, metric_sha256 = _sha256(fields, 'vectors_sha256'), _sha256(
        fields, 'metric_sha256')
    words: dict[str, str] = {}
    for entry in fields.list_of_fields('words'):
        behaviour = entry.text('behaviour')
        expect(behaviour in behaviours, entry.name('behaviour'), 'one of the behaviours', behaviour)
        for word in entry.texts('words'):
            expect(word not in words, entry.name('words'), 'every word once', word)
            words[word] = behaviour
        entry.finish()
    near, unclaimed = fields.texts('near'), fields.texts('unclaimed')
    for word in near:
        expect(word not in words, fields.name('near'), 'no word of a behaviour', word)
    judge = _judge(fields, behaviours)
    how = fields.free('how')
    fields.finish()
    return Ear(behaviours, words, near, judge, metric_sha256, vocabulary, vectors_sha256,
               length, priority, unclaimed, how, VERSIONS[version])


def _judge(fields: Fields, behaviours: tuple[str, ...]) -> Judge:
    classes = _names(fields, 'classes')
    expect(len(classes) > 1 and set(classes) <= set(behaviours), fields.name('classes'),
           'two or more of the behaviours', list(classes))
    sharpness, threshold = fields.number('sharpness'), fields.number('threshold')
    expect(sharpness > 0, fields.name('sharpness'), 'a number above 0', sharpness)
    classifier = _softmax(fields.fields('classifier'), len(classes))
    elements = classifier.weights.shape[1]
    gate = _softmax(fields.fields('gate'), len(classes) + 1, elements)
    means = _matrix(fields, 'means', len(classes), elements)
    margins = _matrix(fields, 'margins', 1, None)[0]
    return Judge(classes, classifier, sharpness, gate, means, threshold, tuple(margins.tolist()))


def _softmax_json(softmax: Softmax) -> dict[str, Any]:
    return {'weights': softmax.weights.tolist(), 'biases': [softmax.biases.tolist()]}


def _softmax(fields: Fields, classes: int, elements: int | None = None) -> Softmax:
    weights = _matrix(fields, 'weights', classes, elements)
    biases = _matrix(fields, 'biases', 1, classes)
    fields.finish()
    return Softmax(weights, biases[0])


def _matrix(fields: Fields, key: str, rows: int, columns: int | None) -> Array:
    matrix = np.array(fields.matrix(key), dtype=np.float64)
    expect(len(matrix) == rows and columns in (None, matrix.shape[1]), fields.name(key),
           f'{rows} rows' + (f' of {columns} numbers' if columns else ''),
           Text(f'{matrix.shape[0]} rows of {matrix.shape[1]}'))
    return matrix


def _names(fields: Fields, key: str) -> tuple[str, ...]:
    names = fields.texts(key)
    expect(len(set(names)) == len(names) and all(names), fields.name(key), 'different names',
           list(names))
    return names


def _sha256(fields: Fields, key: str) -> str:
    value = fields.text(key)
    expect(len(value) == 64 and not set(value) - set('0123456789abcdef'), fields.name(key),
           'a SHA-256 in hexadecimal', value)
    return value
