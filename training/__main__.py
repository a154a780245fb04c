"""
`python -m training COMMAND ...`: evolution, the study, and what is measured about them.

`--plugin FILE.py`, with any command, adds the bodies and behaviours that the file registers.

Each command is a module with `add_arguments(parser)` and `main(args) -> exit code`, imported only
when its command is given. A command may have two words.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from w2b_core.command_process import command
from w2b_core.registry import PluginError, load_plugins, use_plugin

# Before numpy is imported: its matrices here are so small that threads only wait for one another
# (the benchmark of the ear takes four times as long with two).
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

#: Command -> (module, what it does). A command's own --help says more.
COMMANDS = {
    'evolve': ('training.evolution.evolve',
               'one evolutionary run: words in, a controller file out'),
    'champions': ('training.pipeline.command',
                  'a body in, a controller that other engines let through out, by a recipe'),
    'ablation': ('training.pipeline.ablation',
                 'how robustness grows with each means of the robust mode'),
    'legs': ('training.legs.command', 'train legs that are commanded, by a recipe'),
    'assemble': ('training.legs.assemble', 'an ear and legs in, a controller file out'),
    'rest': ('training.robust.rest', 'under how many of all words a controller rests'),
    'ear': ('training.grounding.ear', 'train an ear: a lexicon in, an ear out'),
    'closed-loop': ('training.grounding.closed_loop',
                    'what the body does under words, heard in training or not'),
    'judge': ('training.judge.command',
              'what a controller does in an independent engine, under disturbances'),
    'evidence': ('training.judge.evidence',
                 "the judge's rows of a champion, and which bounds they miss"),
    'grounding': ('training.grounding.benchmark',
                  'judge hearing on a lexicon: unseen words, refusal, phrases, rivals'),
    'study': ('training.study.command', 'the whole study of the paper, or a part of it'),
    'study export': ('training.study.commands.export', "a study's finished runs in one file"),
    'study import': ('training.study.commands.import_', 'take up runs from such a file'),
    'study status': ('training.study.commands.status', 'how far a study is, and when it ends'),
    'study pause': ('training.study.commands.pause', 'free the processors, lose nothing'),
    'study resume': ('training.study.commands.resume', 'let a paused study go on'),
    'report': ('training.report.command', "a study's tables and figures as one HTML file"),
    'robustness': ('training.study.robustness', "re-score a study's champions elsewhere"),
    'fidelity': ('training.measure.fidelity', 'how closely the engines repeat recorded traces'),
    'servos': ('training.measure.servos', 'what a controller asks of its servos, an estimate'),
    'standing': ('training.measure.standing', 'sweeps that a body stands still with, and their '
                 'cost'),
    'bench': ('training.measure.bench', 'evaluations a second of the engines'),
}


def _with_plugins(arguments: Sequence[str]) -> list[str]:
    """Load what `--plugin FILE.py` names, before any list of choices is made; return the rest."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument('--plugin', action='append', default=[])
    found, rest = parser.parse_known_args(arguments)
    for path in found.plugin:
        use_plugin(path)
    load_plugins()
    return rest


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        arguments = _with_plugins(arguments)
    except PluginError as error:
        print(f'--plugin: {error}', file=sys.stderr)
        return 2
    parser = argparse.ArgumentParser(
        prog='python -m training', description=__doc__.partition('\n\nEach')[0].strip('\n'),
        formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    if ' '.join(arguments[:2]) in COMMANDS:
        arguments[:2] = [' '.join(arguments[:2])]
    chosen = next((word for word in arguments if not word.startswith('-')), None)
    for name, (module, purpose) in COMMANDS.items():
        command = commands.add_parser(name, help=purpose, description=purpose)
        if name != chosen:
            continue
        try:
            implementation = importlib.import_module(module)
        except ModuleNotFoundError as error:
            print(f'{name}: cannot start, the module {error.name} is missing; in a checkout run '
                  '`make setup` and `. .venv/bin/activate` first (or use .venv/bin/python), '
                  'elsewhere install requirements/training.txt', file=sys.stderr)
            return 2
        if implementation.__doc__:
            command.description = implementation.__doc__.strip()
            command.formatter_class = argparse.RawDescriptionHelpFormatter
        implementation.add_arguments(command)
        command.set_defaults(main=implementation.main)
    args = parser.parse_args(arguments)
    return int(args.main(args))


if __name__ == '__main__':
    sys.exit(main())
