import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TRAINING = Path(__file__).resolve().parents[2] / 'training'

#: Package of `training` -> the other packages of it that it may import: arrows point one way.
MAY_IMPORT: dict[str, set[str]] = {
    'evolution': set(),
    'grounding': {'evolution'},
    'judge': {'evolution'},
    'legs': {'evolution', 'judge'},
    'robust': {'evolution'},
    'pipeline': {'evolution', 'legs', 'robust'},
    'measure': {'evolution', 'judge', 'pipeline', 'study'},
    'study': {'evolution'},
    'report': {'evolution', 'grounding', 'study'},
}
#: Modules of `training` itself that every package may import.
BELOW_ALL = {'carried_body', 'configuration'}


def imports(path: Path) -> Iterator[str]:
    """Yield the dotted name of every module or name that a source file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: imports are absolute here'
            yield from (f'{node.module}.{name.name}' for name in node.names)


def test_every_package_is_named_here():
    assert {path.parent.name for path in TRAINING.glob('*/*.py')} == set(MAY_IMPORT)
    assert {path.name for path in TRAINING.glob('*.py')} == {
        '__init__.py', '__main__.py', *(f'{name}.py' for name in BELOW_ALL)}


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_packages_import_only_what_lies_below_them(package):
    reached = {name.split('.')[1]: f'{path.name} imports {name}'
               for path in (TRAINING / package).rglob('*.py')
               for name in imports(path) if name.startswith('training.')}
    assert package in reached, 'modules of a package use each other'
    wrong = {name: how for name, how in reached.items()
             if name not in {package, *MAY_IMPORT[package], *BELOW_ALL}}
    assert not wrong, f'training.{package} may import {sorted(MAY_IMPORT[package])}: {wrong}'
