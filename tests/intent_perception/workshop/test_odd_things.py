"""Things and scenes that the odds of the classes are fitted to."""

import numpy as np
import pytest

from intent_perception.workshop.scenes.training_scenes import training_scene
from intent_perception.workshop.scenes.unseen_scenes import unseen_scene
from intent_perception.workshop.things.odd_things import odd_thing


@pytest.mark.parametrize("seed", range(24))
def test_odd_things_are_as_large_as_household_things_and_come_to_rest(seed: int) -> None:
    thing = odd_thing(np.random.default_rng(seed), "thing")
    assert thing.object_class == ""
    assert 0.02 < thing.size.max() < 0.5
    assert len(thing.stable_poses)


def test_a_number_gives_the_same_training_scene_again_and_no_scene_of_a_benchmark() -> None:
    first, again, other = training_scene(1, None), training_scene(1, None), unseen_scene(1, None)
    np.testing.assert_array_equal(first.frame.depth, again.frame.depth)
    assert not np.array_equal(first.frame.depth, other.frame.depth)
