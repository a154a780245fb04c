"""The columns of a study's store: names, types, units and meanings, declared once."""

from __future__ import annotations

from typing import NamedTuple


class Column(NamedTuple):
    """`type` is pyarrow's name of it; `unit` is '' for what has none."""

    name: str
    type: str
    unit: str
    meaning: str


_RUN = (
    Column('run', 'string', '', 'name of the run, and of its directory under runs/'),
    Column('word_set', 'string', '', 'paper, or balanced (two words for each move)'),
    Column('body', 'string', '', 'registered name of the body'),
    Column('treatment', 'string', '', 'experimental (word2vec vectors) or control (each permuted)'),
    Column('seed', 'int32', '', "the study's seed: with the word set it decides the held-out word"),
)

_PLACE = (
    Column('final_x_m', 'float64', 'm', 'x of the base at the last logged step; forward is +x'),
    Column('final_y_m', 'float64', 'm', 'y of the base at the last logged step'),
    Column('final_z_m', 'float64', 'm', 'height of the base at the last logged step'),
    Column('path_m', 'float64', 'm', "length of the base's path in x-y"),
    Column('largest_step_m', 'float64', 'm', 'longest move in x-y between two steps; above 0.1 the '
           'command scores 0, since that is a simulator exploding'),
)

TABLES: dict[str, tuple[Column, ...]] = {
    'runs': (
        *_RUN,
        Column('held_out', 'string', '', 'the stop word that the run never heard'),
        Column('fitness', 'float64', 'm', "the champion's: sum of its scores in training"),
        Column('generations', 'int32', '', 'generations of AFPO'),
        Column('population', 'int32', '', "AFPO's capacity"),
        Column('evaluations', 'int64', '', 'simulations in the whole run'),
        Column('objective', 'string', '', 'program (stop: minus the path), paper (minus the final '
               'distance) or balanced (minus the path)'),
        Column('engine', 'string', '', 'engine of the evolution'),
        Column('precision', 'string', '', 'float32 or float64'),
        Column('evolution_seed', 'int64', '', "seed of the run's random numbers"),
        Column('body_length_m', 'float64', 'm', 'length that displacements are divided by'),
        Column('wall_s', 'float64', 's', 'wall time of the evolution, all attempts together'),
        Column('engine_s', 'float64', 's', 'share of it inside the engine'),
        Column('cpu_s', 'float64', 's', 'CPU time of the evolution; missing if it was taken up '
               'again, since a killed attempt cannot say how much it used'),
        Column('attempts', 'int32', '', 'how often the run was started or taken up again'),
        Column('program_version', 'string', '', 'version of this program'),
        Column('results_sha256', 'string', '', "hash of the engine's results for the body; missing "
               'in runs made before it was introduced'),
        Column('sources_sha256', 'string', '', 'hash of source files, of those older runs only'),
        Column('git_commit', 'string', '', 'commit of this program, if known'),
        Column('vocabulary', 'string', '', 'vocabulary as configured'),
        Column('vocabulary_sha256', 'string', '', "hash of the commands' vectors"),
        Column('host', 'string', '', 'machine of the first attempt'),
        Column('champion', 'string', '', "the champion's controller file, from the study's folder"),
    ),
    'outcomes': (
        *_RUN,
        Column('word', 'string', '', 'the command'),
        Column('behaviour', 'string', '', 'what it stands for: forward, backward or stop'),
        Column('role', 'string', '', 'trained or held_out'),
        *_PLACE,
        Column('displacement_m', 'float64', 'm', 'final distance from the start in x-y'),
        Column('score', 'float64', 'm', "the champion's score by the run's objective"),
    ),
    'history': (
        *_RUN,
        Column('generation', 'int32', '', '1 to generations; thinned, the same ones for every run'),
        Column('best_fitness', 'float64', 'm', 'fitness of the best individual'),
        Column('median_fitness', 'float64', 'm', 'median fitness of the population'),
        Column('best_age', 'float64', '', 'generations since its oldest ancestor was drawn'),
        Column('survivors', 'float64', '', 'individuals left after selection'),
        Column('evaluations', 'float64', '', 'simulations of this generation'),
    ),
    'robustness': (
        *_RUN,
        Column('condition', 'string', '', 'perturbed (slightly different starts), pybullet '
               '(another engine) or lexicon (words that no run heard)'),
        Column('engine', 'string', '', 'engine of this trial'),
        Column('word', 'string', '', 'the command'),
        Column('word_class', 'string', '', 'what it asks for: forward, backward or stop; or '
               'unrelated'),
        Column('role', 'string', '', 'trained, held_out or lexicon'),
        Column('start', 'int32', '', 'number of the start within the condition'),
        Column('start_height_m', 'float64', 'm', 'how much the body was raised'),
        Column('start_roll_rad', 'float64', 'rad', 'how much it was tilted about x'),
        Column('start_pitch_rad', 'float64', 'rad', 'how much it was tilted about y'),
        *_PLACE,
        Column('displacement_m', 'float64', 'm', 'final distance from the start in x-y'),
    ),
}


def as_markdown() -> str:
    """Return the columns as the tables that docs/study/store.md shows."""
    parts = []
    for table, columns in TABLES.items():
        parts.append(f'## {table}.parquet\n\n| column | type | unit | meaning |\n|---|---|---|---|')
        parts.extend(f'| `{column.name}` | {column.type} | {column.unit} | {column.meaning} |'
                     for column in columns)
        parts.append('')
    return '\n'.join(parts)
