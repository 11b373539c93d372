"""What a person means with an object: prior, grasp and the motion so far in one distribution.

    p(t | grasp, motion) ~ p(t | class) p(grasp | t) p(motion | t)

over the tasks and "none of these". Each task's networks, balanced, give p(grasp | t) / p(grasp) =
2 p(t | grasp); a person who means none of the tasks grasps as people grasp at all, ratio 1. The
motion's share is that of the motion network, from the first movement of the object on.
"""

from collections.abc import Sequence

import numpy as np

from intent_inference.intention.class_priors import ClassPriors
from intent_inference.motion.measures import HeldMotion, person_of
from intent_inference.motion.motion_network import PHASES, MotionFilter, MotionNetwork
from intent_inference.network.probability_calibration import sigmoid
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import rotation_angle
from intent_tracking.scene.scene_state import SceneState

_LEAST_RATIO = 0.02
"""Of p(grasp | t) / p(grasp): labels and tracker are wrong now and then."""
_UNKNOWN_WEIGHT = 0.3
_LIFTED, _TURNED = 0.03, 0.35
"""An object that moved [m] or turned [rad] so far from where it rested is being moved."""
_STILL = 0.004
"""Between frames; what moves less is at rest [m]."""
_GAPS = 10
"""Frames from which the usual distance of the palm is taken."""
_SETTLED = 10
"""Frames of rest, away from the hand, after which a new place is where an object rests."""


def intended(
    log_prior: Array, affords: Array, motion: Array | None = None, *, known: bool = True
) -> Array:
    """Return p(meaning) (T + 1,), the last for none of the tasks.

    Args:
        log_prior: (T + 1,) of the meanings.
        affords: (T,) log-odds of the tasks' balanced networks.
        motion: (T + 1,) log p(motion | meaning) up to a constant; None: no motion yet.
        known: whether the object is of a class that the networks learned; of others they know
            little, and what they say weighs less.
    """
    ratio = np.log(np.maximum(2.0 * sigmoid(affords), _LEAST_RATIO))
    score = log_prior + np.append(ratio if known else _UNKNOWN_WEIGHT * ratio, 0.0)
    if motion is not None:
        score = score + motion
    chance = np.exp(score - score.max())
    return np.asarray(chance / chance.sum())


class Rests:
    """Where objects rest on the table when nobody moves them."""

    def __init__(self) -> None:
        self._rest: dict[str, Array] = {}
        self._last: dict[str, Array] = {}
        self._still: dict[str, int] = {}

    def step(self, state: SceneState, near: Sequence[str]) -> None:
        """Take in a frame; objects that a hand is near keep the place that they had."""
        for name, pose in zip(state.object_ids, state.T_table_objects, strict=True):
            if not np.isfinite(pose).all():
                continue
            before = self._last.get(name)
            self._last[name] = pose
            moved = before is None or np.linalg.norm(pose[:3, 3] - before[:3, 3]) > _STILL
            self._still[name] = 0 if moved else self._still.get(name, 0) + 1
            if name not in self._rest or (name not in near and self._still[name] >= _SETTLED):
                self._rest[name] = pose

    def of(self, name: str) -> Array | None:
        """Return the pose (4, 4) in which an object rests; None for one never seen."""
        return self._rest.get(name)

    def left(self, name: str, pose: Array) -> bool:
        """Return whether a pose (4, 4) is away from where the object rests."""
        rest = self._rest.get(name)
        if rest is None or not np.isfinite(pose).all():
            return False
        turn = rotation_angle(rest[:3, :3].T @ pose[:3, :3])
        return bool(np.linalg.norm(pose[:3, 3] - rest[:3, 3]) > _LIFTED or turn > _TURNED)


class HeldIntention:
    """Follows one object in the hand, from contact until it is put down."""

    def __init__(
        self, network: MotionNetwork, tasks: tuple[str, ...], priors: ClassPriors,
        object_id: str, object_class: str, *, known: bool = True,
    ) -> None:  # fmt: skip
        """Begin with an object of a class; nothing is known of its motion."""
        self.object_id = object_id
        """The object that is held."""
        self.object_class = object_class
        self._known = known
        self._log_prior = priors.of(object_class, tasks)
        self._filter = MotionFilter(network, tasks)
        self._motion: HeldMotion | None = None
        self._moving = False
        self._gaps: list[float] = []

    def hold(self, gap: float) -> None:
        """Take in how far the palm is from the held object [m]; the first ones count."""
        if len(self._gaps) < _GAPS:
            self._gaps.append(gap)

    @property
    def palm_gap(self) -> float:
        """Median distance of the palm to the object as it was taken [m]."""
        return float(np.median(self._gaps)) if self._gaps else 0.0

    def step(self, state: SceneState, index: int, rest: Array, came_from: Array | None) -> None:
        """Take in one frame of the object's motion.

        Args:
            state: with a tracked hand.
            index: the object's place in the state.
            rest: (4, 4) pose in which the object rested.
            came_from: (3,) where the wrist was first seen [m]; None: not known.
        """
        poses = state.T_table_objects
        if not np.isfinite(poses[index]).all():
            return
        if self._motion is None:
            person = person_of(state.T_table_hand, came_from, state.hand_side)
            self._motion = HeldMotion(rest, person)
        gaps = np.linalg.norm(poses[:, :2, 3] - poses[index, :2, 3], axis=1)
        gaps[index] = np.nan
        known = gaps[np.isfinite(gaps)]
        other = float(known.min()) if len(known) else float("nan")
        second = state.stamp * 1e-9
        self.take(second, self._motion.step(second, poses[index], other))

    def take(self, second: float, measures: Array) -> None:
        """Take in the measures (M,) of the motion at a stamp [s]."""
        self._filter.step(second, measures)
        self._moving = True

    def intends(self, affords: Array) -> Array:
        """Return p(meaning) (T + 1,) with the grasp's log-odds (T,) and the motion so far."""
        motion = self._filter.log_evidence if self._moving else None
        return intended(self._log_prior, affords, motion, known=self._known)

    def stage(self, affords: Array) -> str:
        """Return the likeliest phase."""
        return PHASES[int(np.argmax(self._filter.phases(self.intends(affords))))]

    def moved(self) -> dict[str, Array]:
        """Return by measure of motion how far it moved the log-odds (T + 1,) so far."""
        return self._filter.moved() if self._moving else {}
