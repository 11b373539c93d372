"""States of an invented grasp: nodes go through them before they say that they are ready."""

import numpy as np

from intent_perception.geometry.transforms import make_pose, transform_points, vector_from_pose
from intent_perception.objects.model import ObjectModel
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.scene_state import SceneState

_IN_HAND = np.array([0.085, 0.0, 0.045])
"""Where the middle of the object is in the hand's frame [m]."""
_BENT, _PERIOD = 0.6, 33_000_000


def rehearsal_states(model: ObjectModel, count: int) -> list[SceneState]:
    """Return so many states of a right hand that keeps still around an object.

    Args:
        model: the object, in its stable pose.
        count: how many, at the usual rate of a camera.
    """
    palm_in = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    middle = transform_points(model.rest, model.center)
    hand = make_pose(palm_in, middle - palm_in @ _IN_HAND)
    values = [*vector_from_pose(hand), *np.full(20, _BENT), *vector_from_pose(model.rest)]
    return [
        SceneState(
            k * _PERIOD, "right", np.array(values), np.full(len(values), 0.01),
            HandModel("right").shape, (model.name,), (model.name,), (model.object_class,),
            np.eye(4), 0.1, True, False, (False,),
        )
        for k in range(1, count + 1)
    ]  # fmt: skip
