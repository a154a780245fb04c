"""Recipes: the shipped ones are what made the shipped champions; a wrong one is one clear line."""

import argparse
from pathlib import Path

import pytest
import yaml

from training.configuration import ConfigError
from training.pipeline.command import add_arguments, recipe_of
from training.pipeline.recipe import RECIPES, load_recipe, shipped
from w2b_core.controller import file as controller_file

BASE = yaml.safe_load((RECIPES / 'quadruped.yaml').read_text())
WORDS = yaml.safe_load((RECIPES / 'words.yaml').read_text())
#: What a shipped record calls what is now another field.
RENAMED = {'listening': 'pretraining'}


def step(index, **changes):
    steps = [dict(part) for part in BASE['steps']]
    steps[index] = {**steps[index], **changes}
    return {'steps': steps}


@pytest.mark.parametrize(('body', 'name'), [
    ('quadruped', 'quadruped_serial'), ('physical_twin', 'physical_twin_serial')])
def test_a_shipped_recipe_says_what_the_shipped_champion_was_made_by(body, name):
    record = controller_file.load(controller_file.shipped(name)).record
    recipe = load_recipe(shipped()[body])
    made = recipe.config(record['seed']).to_json()
    for field, value in record['config'].items():
        found = made[RENAMED.get(field, field)]
        if field == 'listening':
            assert found['attempts'] == value['attempts'] == 0
        elif field == 'careful':
            assert value is True
            assert found is not None
        else:
            assert found == value, field
    for role in ('trained', 'validation', 'held_out'):
        assert list(map(list, getattr(recipe.words, role))) == record['words'][role]


@pytest.mark.parametrize(('changes', 'message'), [
    ({'body': 'quadrupd'}, "body: expected one of .*, or a file such as .*, got 'quadrupd'"),
    ({'mov_m': 1}, "the recipe: unknown field 'mov_m' .did you mean 'move_m'"),
    ({'move_m': -1}, 'move_m: expected a number greater than 0, got -1'),
    ({'training': {'populaton': 3}}, r"training: unknown field 'populaton' .did you mean"),
    ({'training': {'randomisation': {'frction': True}}},
     "training.randomisation: unknown field 'frction' .did you mean 'friction'"),
    ({'training': {'world': 'mars'}}, "world: expected one of paper, earth, got 'mars'"),
    ({'seeds': []}, 'seeds: expected at least 1, got 0'),
    ({'seeds': ['a']}, r"seeds\[0\]: expected a valid integer.*, got 'a'"),
    ({'steps': BASE['steps'][1:]}, 'steps: expected pretrain and evolve first'),
    ({'steps': BASE['steps'][:-1]}, 'choose and examine last'),
    (step(2, seed=0), 'steps: walks: expected other starts than those of final, got the same seed'),
    (step(2, name='walk'), "steps: expected each name once, got 'walk' twice"),
    (step(1, step='evolv'), r"steps\[1\]\.step: expected one of 'pretrain', .*, got 'evolv'"),
    (step(1, discard_below=[0, 0, 0]), 'discard_below: expected at most 2 bounds, got 3'),
    (step(1, stages=[{**BASE['steps'][1]['stages'][0], 'generations': 0}]),
     r'stages\[0\]\.generations: expected a number greater than or equal to 1, got 0'),
    (step(1, stages=[{'generations': 5}]), r"stages\[0\]: the field 'moves' is missing"),
    ({'words': {'trained': {'forward': 'forward'}}},
     "words: expected at least one for each direction, got none for 'backward'"),
    ({'words': {**WORDS, 'held_out': {'stop': ['Stop']}}},
     "words: expected one role each, got two for 'Stop'"),
])
def test_a_wrong_recipe_is_refused_with_the_field(tmp_path, changes, message):
    path = tmp_path / 'wrong.yaml'
    path.write_text(yaml.safe_dump({**BASE, 'words': WORDS, **changes}))
    with pytest.raises(ConfigError, match=message) as refused:
        load_recipe(path)
    assert str(refused.value).startswith(f'{path}: ')
    assert '\n' not in str(refused.value)


def test_a_recipe_that_cannot_be_read_is_named(tmp_path):
    for content, message in ((b'name: [', 'not valid YAML'), (b'- 1', 'expected a mapping'),
                             (b'words: none.yaml', 'none.yaml: not a readable recipe'),
                             (b'name: a\nname: b', "the key 'name' stands twice")):
        path = tmp_path / 'bad.yaml'
        path.write_bytes(content)
        with pytest.raises(ConfigError, match=message):
            load_recipe(path)


def options(*said: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args([*said, '--out', 'nowhere'])


def test_options_stand_in_place_of_a_recipes_numbers(tmp_path: Path):
    plain = recipe_of(options())
    assert plain == load_recipe(RECIPES / 'quadruped.yaml')
    changed = recipe_of(options('--seeds', '6,12', '--keep', '3', '--ears', '4',
                                '--effort', '0.01'))
    assert changed.seeds == (6, 12)
    assert changed.pretrain.runs == 4
    assert changed.pretrain.plan.generations == 8
    assert [stage.generations for stage in changed.stages()] == [4, 3, 2]
    gates = [part for part in changed.steps if part.step == 'gate']
    assert [part.keep for part in gates] == [3, 2]
    path = tmp_path / 'mine.yaml'
    path.write_text(yaml.safe_dump({**BASE, 'words': WORDS, 'name': 'mine'}))
    assert recipe_of(options(str(path))).name == 'mine'
    assert recipe_of(options('--body', 'physical_twin')).body == 'physical_twin'
