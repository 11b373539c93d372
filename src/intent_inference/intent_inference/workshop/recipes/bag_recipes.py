"""What each bag shows."""

from dataclasses import dataclass

from intent_tracking.workshop.person.acting.script import Act, Scenario
from intent_tracking.workshop.person.acting.task_moves import Pace


@dataclass(frozen=True)
class BagRecipe:
    """One bag."""

    scenario: Scenario
    seed: int
    """Everything random in the bag comes from it."""
    own_models: tuple[str, ...] = ()
    """Objects that are not in the shipped database: `models.yaml` is written beside the bag."""


_BRISK = Pace(reach=24, approach=7, close=7, hold=12, task=24)
"""For the bags that are committed: fewer frames, fewer megabytes."""
_WHOLE = Pace(go_on=21)
"""Filmed on until more than a second after lift-off."""


def _one(
    name: str, model: str, task: str, others: tuple[str, ...], seed: int, *, side: str = "right",
    hesitate: int = 0, pass_by: bool = False, own: bool = False, pace: Pace | None = None,
) -> BagRecipe:  # fmt: skip
    scenario = Scenario(name, (Act(model, task),), others, side, hesitate, pass_by, pace or _WHOLE)
    return BagRecipe(scenario, seed, (model,) if own else ())


RECIPES = (
    _one("pour_mug", "mug_0", "pouring", ("bottle_3", "toy_car"), 11),
    _one("wash_mug", "mug_0", "dish-washing", ("glass_1", "can"), 12),
    _one("give_mug", "mug_0", "hand-over", ("hammer_2",), 13),
    _one("pour_bottle", "bottle_0", "pouring", ("glass_0", "ball"), 14, pace=_BRISK),
    _one("give_bottle", "bottle_0", "hand-over", ("knife_1", "box"), 15, pace=_BRISK),
    _one("pour_glass", "glass_1", "pouring", ("mug_3",), 16, hesitate=8),
    _one("wash_glass", "glass_1", "dish-washing", ("mug_2", "bowl", "can"), 17, pace=_BRISK),
    _one("strike_hammer", "hammer_0", "tool-use", ("screwdriver_1", "box"), 18),
    _one("give_hammer", "hammer_0", "hand-over", ("bottle_5",), 19),
    _one("cut_knife", "knife_0", "tool-use", ("glass_3",), 20),
    _one("give_knife", "knife_0", "hand-over", ("mug_4", "ball"), 21, pass_by=True),
    _one("turn_screwdriver", "screwdriver_0", "tool-use", ("hammer_3", "can"), 22, side="left"),
    _one("give_screwdriver", "screwdriver_0", "hand-over", ("bottle_1",), 23),
    _one("pour_bottle_left", "bottle_2", "pouring", ("mug_1", "book"), 24, side="left", hesitate=6),
    BagRecipe(Scenario("pour_then_give", (Act("bottle_3", "pouring"), Act("glass_1", "hand-over")),
                    ("ball",), pace=Pace(20, 0, 7, 6, 12, 12, go_on=30)), 25),
    BagRecipe(Scenario("no_grasp", (Act("bottle_4", "pouring", grasped=False),
                                 Act("mug_5", "pouring", grasped=False)), ("can",)), 26),
    _one("unknown_object", "toy_car", "hand-over", ("bottle_6", "glass_5"), 27),
    _one("own_mug", "my_mug", "pouring", ("screwdriver_4", "ball"), 28, own=True),
    _one("own_bottle", "my_bottle", "hand-over", ("knife_5",), 29, own=True, pass_by=True),
)  # fmt: skip

ROBOT_TABLE = ("hammer_4", "toy_car", "mug_2")
"""What stands on the robot's own table."""
