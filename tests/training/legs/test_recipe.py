"""Recipes: what is refused, by field, before anything is written."""

from pathlib import Path

import pytest
import yaml

from training.legs.recipe import RecipeError, load_recipe

RECIPES = Path(__file__).resolve().parents[3] / 'training' / 'recipes'
TWIN = RECIPES / 'twin.yaml'
ROBOTS = RECIPES.parents[1] / 'examples' / 'robots'
OWN = [(RECIPES / 'own_robot.yaml', str(path)) for path in sorted(ROBOTS.glob('*.yaml'))]


def changed(tmp_path, **changes):
    content = {**yaml.safe_load(TWIN.read_text(encoding='utf-8')), **changes}
    path = tmp_path / 'recipe.yaml'
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    return path


@pytest.mark.parametrize(('path', 'body'), [
    (TWIN, None), (RECIPES / 'quadruped.yaml', None), *OWN])
def test_every_shipped_recipe_is_valid_and_shares_its_bodys_symmetry(path, body):
    recipe = load_recipe(path, **({} if body is None else {'body': body}))
    assert recipe.mirrors()
    free = recipe.model_copy(update={'network': recipe.network.model_copy(
        update={'symmetry': ()})})
    assert recipe.sharing().size < 0.7 * free.sharing().size


@pytest.mark.parametrize(('changes', 'message'), [
    ({'body': 'centipede'}, 'centipede'), ({'world': 'moon'}, 'moon'),
    ({'senses': ['smell']}, 'expected one of touch:LINK'),
    ({'senses': ['touch:tail']}, 'tail'),
    ({'behaviours': ['stop', 'forward', 'fly']}, 'fly'),
    ({'behaviours': ['stop', 'sit']}, 'one that walks'),
    ({'behaviours': ['stop', 'forward', 'left']}, 'mirrors'),
    ({'network': {'symmetry': ['upside_down']}}, 'upside_down'),
    ({'network': {'per_limb': 0}}, 'per_limb'), ({'population': 1}, 'population'),
    ({'stages': []}, 'stages'), ({'speed': 3}, 'speed'), ({'seeds': '8'}, None),
    ({'aims': {'walk': {'rhythm_hz': {'full': 0.0, 'weight': 1.0}}}}, 'full above free'),
    ({'aims': {'walk': {'beauty': {'full': 1.0, 'weight': 1.0}}}}, 'beauty'),
    ({'first': {'entries': [{'onto': 0, 'joint': 1, 'neuron': 0, 'between': [0, 1]}]}},
     'one of onto and joint'),
    ({'first': {'entries': [{'onto': 7, 'neuron': 0, 'between': [0, 1]}]}}, 'onto'),
    ({'first': {'entries': [{'of': 4, 'onto': 0, 'neuron': 0, 'between': [0, 1]}]}}, 'of'),
    ({'first': {'entries': [{'joint': 0, 'sense': 'gravity:x', 'between': [0, 1]}]}},
     'gravity:x')])
def test_what_does_not_fit_is_refused_with_the_field(tmp_path, changes, message):
    if message is None:
        assert load_recipe(changed(tmp_path, **changes)).seeds == 8
        return
    with pytest.raises(RecipeError, match=message):
        load_recipe(changed(tmp_path, **changes))


def test_an_asymmetric_body_with_a_symmetric_recipe_is_refused(tmp_path):
    path = changed(tmp_path, body='minimal', senses=[], first={}, network={
        'symmetry': ['left_right', 'fore_aft']})
    with pytest.raises(RecipeError, match=r'mirror|forward'):
        load_recipe(path)


@pytest.mark.parametrize('text', ['{', '- 1', 'name: [unclosed', ''])
def test_a_file_that_is_no_recipe_is_refused(tmp_path, text):
    path = tmp_path / 'recipe.yaml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(RecipeError, match=r'recipe\.yaml'):
        load_recipe(path)
    with pytest.raises(RecipeError, match='absent'):
        load_recipe(tmp_path / 'absent.yaml')


def test_the_hash_follows_what_the_recipe_says(tmp_path):
    assert load_recipe(TWIN).sha256() == load_recipe(changed(tmp_path)).sha256()
    assert load_recipe(TWIN).sha256() != load_recipe(TWIN, seed=2).sha256()
