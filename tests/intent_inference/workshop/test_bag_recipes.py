"""The list of bags."""

from intent_inference.workshop.recipes.bag_recipes import RECIPES
from intent_perception.objects.database import ObjectDatabase


def test_the_list_of_bags_covers_what_it_must() -> None:
    scenarios = [recipe.scenario for recipe in RECIPES]
    acts = [act for scenario in scenarios for act in scenario.acts if act.grasped]
    database = ObjectDatabase.load()
    assert len(scenarios) >= 16
    assert len({recipe.seed for recipe in RECIPES}) == len(RECIPES)
    assert {act.task for act in acts} == {"hand-over", "pouring", "tool-use", "dish-washing"}
    assert len({act.object for act in acts if act.object in database}) >= 8
    assert sum(bool(recipe.own_models) for recipe in RECIPES) >= 2
    assert sum(scenario.side == "left" for scenario in scenarios) >= 2
    assert all(1 <= len(scenario.others) <= 3 for scenario in scenarios)
