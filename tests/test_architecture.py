"""The arrows of the house: which package may import which, and no import circle anywhere."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / 'ros2_ws' / 'src'

#: Package -> what of this house it may import.
MAY_IMPORT: dict[str, set[str]] = {
    'w2b_core': set(),
    'w2b_ros': {'w2b_core'},
    'w2b_controller': {'w2b_core', 'w2b_ros'},
    'w2b_description': {'w2b_core', 'w2b_ros'},
    'w2b_sim': {'w2b_core', 'w2b_ros'},
    'w2b_hw': {'w2b_core', 'w2b_ros'},
    'w2b_web': {'w2b_core', 'w2b_ros'},
    'training': {'w2b_core', 'w2b_sim'},
}
#: Modules that may import one package more, and why.
EXCEPTIONS = {
    # The judge's simulated IMU goes through the very filter that the robot runs.
    'training.judge.imu': {'w2b_hw'},
    # Emulated chips on a simulated body; loaded only when asked for.
    'w2b_hw.emulation.coupled': {'w2b_sim'},
}
#: What only some packages may import at all, at the top of a module or within a function.
ONLY_IN = {
    'rclpy': {'w2b_ros', 'w2b_controller', 'w2b_description', 'w2b_sim', 'w2b_hw', 'w2b_web'},
    'mcap': {'w2b_controller'}, 'mcap_ros2': {'w2b_controller'},
    'pybullet': {'w2b_sim'}, 'numba': {'w2b_sim', 'training'},
    'aiohttp': {'w2b_web'}, 'pocketsphinx': {'w2b_web'}, 'sounddevice': {'w2b_web'},
    'smbus2': {'w2b_hw'}, 'adafruit_pca9685': {'w2b_hw'}, 'imufusion': {'w2b_hw'},
}


def folder(package: str) -> Path:
    return ROOT / package if package == 'training' else SOURCES / package / package


def modules(package: str) -> dict[str, Path]:
    top = folder(package)
    return {'.'.join((package, *path.relative_to(top).with_suffix('').parts)).removesuffix(
        '.__init__'): path for path in sorted(top.rglob('*.py'))}


def imports(path: Path, *, at_import: bool = False) -> Iterator[str]:
    """Yield what a file imports; `at_import`: only what is imported when the module is."""
    todo: list[ast.AST] = [ast.parse(path.read_text(encoding='utf-8'))]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f'{node.module}.{name.name}' for name in node.names)
        if at_import and (isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or (
                isinstance(node, ast.If) and 'TYPE_CHECKING' in ast.dump(node.test))):
            continue
        todo.extend(ast.iter_child_nodes(node))


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_arrows_point_one_way(package):
    wrong = {f'{module} imports {name}' for module, path in modules(package).items()
             for name in imports(path)
             if (top := name.split('.')[0]) in MAY_IMPORT and top != package
             and top not in MAY_IMPORT[package] | EXCEPTIONS.get(module, set())}
    assert not wrong, f'{package} may import {sorted(MAY_IMPORT[package])}'


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_libraries_are_met_only_where_they_belong(package):
    wrong = {f'{module} imports {name}' for module, path in modules(package).items()
             for name in imports(path)
             if package not in ONLY_IN.get(name.split('.')[0], {package})}
    assert not wrong


@pytest.mark.parametrize(('packages', 'at_import'), [
    (tuple(MAY_IMPORT), True),
    # Within functions too: a bus and what hangs on it are two layers.
    (('w2b_hw',), False)])
def test_no_module_takes_part_in_an_import_circle(packages, at_import):
    known = {name: path for package in packages for name, path in modules(package).items()}
    graph = {}
    for module, path in known.items():
        reached = {name for name in imports(path, at_import=at_import) if name in known}
        # `from package import module` names the package too, which need not be complete for it.
        graph[module] = reached - {module} - {name for name in reached if any(
            other.startswith(f'{name}.') for other in reached)
            and known[name].name == '__init__.py' and module.startswith(f'{name}.')}
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(' -> '.join(error.args[1]))


def test_the_command_that_prints_the_arrows_sees_those_that_are_tested():
    said = subprocess.run([sys.executable, ROOT / 'scripts' / 'house'], capture_output=True,
                          text=True, check=True).stdout
    rows = [[cell.strip(' `') for cell in line.strip('|').split('|')]
            for line in said.splitlines() if line.startswith('|')]
    header = next(row for row in rows if row[0] == 'files of that import')
    by_room = {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in rows
               if len(row) == len(header)}
    for package in MAY_IMPORT:
        printed = {other for other, count in by_room[package].items() if count.isdigit()}
        found = {top for path in modules(package).values() for name in imports(path)
                 if (top := name.split('.')[0]) in by_room and top != package}
        assert printed == found
