"""Intent while the hand still reaches: evidence of single frames, filtered over time.

Neighbouring frames see nearly the same pose, so multiplying their likelihoods would count one fact
many times; the log-odds are averaged with an exponential memory instead. Only frames up to now are
used, and what was said is never revised.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import Features, stack_features
from intent_inference.quantisation.soft_evidence import SoftEvidence
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    inverse,
    quaternion_from_rotation,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model_memory import ModelMemory
from intent_tracking.grasp.grasp_features import (
    GraspedShape,
    GraspFeatures,
    as_right_hand,
    palm_center,
)
from intent_tracking.scene.hand_model import HandModel, Side
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE

_FORESIGHT = 0.25
"""The target is the object nearest to where the hand would be this much later [s]."""
_DIRECTION_STD, _POSITION_STD, _JOINT_STD = 0.15, 0.10, 0.30
"""Uncertainty of orientation [rad], unit grasp position and joint angles [rad] at the object …"""
_DIRECTION_PER_DISTANCE, _POSITION_PER_DISTANCE, _JOINT_PER_DISTANCE = 2.0, 2.0, 3.0
"""… and more of it per metre away: the hand still turns, and opens before it closes."""


@dataclass(frozen=True)
class ReachConfig(Checked):
    """How a frame of a reach is read."""

    memory: float = 0.15
    """Time constant of the filter [s], 0.001..10."""
    range: float = 0.60
    """Nothing is said while the palm is farther than this from every object's surface [m], 0..5."""
    release: float = 0.12
    """A grasped object counts as let go of when the palm is this far from its surface [m], 0..5."""


@dataclass(frozen=True, eq=False)
class ReachForecast:
    """What the reach says up to this frame."""

    target: int
    """Index of the object that the hand goes to."""
    log_odds: Array
    """(T,) filtered calibrated log-odds of each task."""
    evidence: SoftEvidence
    """This frame's evidence about the target."""


class ReachFilter:
    """Keeps the filtered log-odds of every object while a hand reaches."""

    def __init__(
        self, model: TaskModel, database: ObjectDatabase, config: ReachConfig | None = None
    ) -> None:
        self._model = model
        self._config = config or ReachConfig()
        self._shapes = ModelMemory(database, GraspedShape)
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._log_odds: dict[str, Array] = {}
        self._stamp: int | None = None
        self._palm: Array | None = None
        self._velocity = np.zeros(3)
        self._held: str | None = None
        self._newest = -1

    def hold(self, object_id: str) -> None:
        """Say nothing until the hand has let go of this object."""
        self.reset()
        self._held = object_id

    def gaps(self, state: SceneState) -> dict[str, float]:
        """Return by object id the distance of the palm to each known object's surface [m]."""
        palm = transform_points(state.T_table_hand, palm_of(state.hand_side))
        return {
            name: self._gap(state, i, palm)
            for i, name in enumerate(state.object_ids)
            if np.isfinite(state.T_table_objects[i]).all()
        }

    def step(
        self, state: SceneState, gaps_by_id: dict[str, float] | None = None
    ) -> ReachForecast | None:
        """Return the forecast up to a frame; None without a hand near a known object.

        Args:
            state: of the frame.
            gaps_by_id: of the same frame, where the caller has asked for them already.
        """
        if state.stamp < self._newest:  # another recording begins
            self.reset()
        self._newest = state.stamp
        if not state.hand_tracked:
            return None
        palm = transform_points(state.T_table_hand, palm_of(state.hand_side))
        elapsed = self._advance(state.stamp, palm)
        known = [
            i for i, name in enumerate(state.object_models)
            if self._shapes.get(name) is not None and np.isfinite(state.T_table_objects[i]).all()
        ]  # fmt: skip
        measured = self.gaps(state) if gaps_by_id is None else gaps_by_id
        gaps = {i: measured[state.object_ids[i]] for i in known}
        if self._held in state.object_ids:
            held = state.object_ids.index(self._held)
            if gaps.get(held, 0.0) < self._config.release:
                return None
        self._held = None
        near = [i for i in known if gaps[i] < self._config.range]
        if not near:
            self._log_odds = {}
            return None
        return self._forecast(state, near, gaps, elapsed, palm)

    def _forecast(
        self,
        state: SceneState,
        near: list[int],
        gaps: dict[int, float],
        elapsed: float,
        palm: Array,
    ) -> ReachForecast:
        geometries = {i: self._shapes.get(state.object_models[i]) for i in near}
        features = stack_features(
            [reach_features(own, state, i) for i, own in geometries.items() if own is not None]
        )
        tracked = np.nan_to_num(state.state_std[:HAND_SIZE], nan=0.0)
        far = np.array([gaps[i] for i in near])
        deviations = reach_deviations(features, far, tracked)
        evidence = self._model.evidence(features, deviations)
        fresh = self._model.calibrated_log_odds(evidence)
        kept = {}
        for row, index in enumerate(near):
            before = self._log_odds.get(state.object_ids[index])
            kept[state.object_ids[index]] = filtered(before, fresh[row], elapsed, self._config)
        self._log_odds = kept
        ahead = palm + _FORESIGHT * self._velocity
        target = min(near, key=lambda i: self._gap(state, i, ahead))
        row = near.index(target)
        own = SoftEvidence(
            evidence.likelihoods[row : row + 1],
            evidence.log_scale[row : row + 1],
            {name: seen[row : row + 1] for name, seen in evidence.observed.items()},
        )
        return ReachForecast(target, kept[state.object_ids[target]], own)

    def _advance(self, stamp: int, palm: Array) -> float:
        """Update the palm's velocity; return the time since the last frame [s]."""
        elapsed = 0.0
        if self._stamp is not None and self._palm is not None and stamp > self._stamp:
            elapsed = (stamp - self._stamp) * 1e-9
            share = 1.0 - float(np.exp(-elapsed / self._config.memory))
            fresh = (palm - self._palm) / elapsed
            self._velocity = self._velocity + share * (fresh - self._velocity)
        self._stamp, self._palm = stamp, palm
        return elapsed

    def _gap(self, state: SceneState, index: int, palm_table: Array) -> float:
        geometry = self._shapes.get(state.object_models[index])
        if geometry is None:
            return float("inf")
        return palm_gap(geometry, state.T_table_objects[index], palm_table)


@lru_cache(maxsize=2)
def palm_of(side: Side) -> Array:
    """Return the middle (3,) of the palm in the hand frame [m]."""
    return palm_center(HandModel(side).table)


def palm_gap(geometry: GraspedShape, T_table_object: Array, palm_table: Array) -> float:
    """Return the distance from a point (3,) in the table frame to the object's surface [m]."""
    palm = transform_points(inverse(T_table_object), palm_table)
    return float(np.linalg.norm(geometry.points[::8] - palm, axis=1).min())


def reach_features(geometry: GraspedShape, state: SceneState, index: int) -> GraspFeatures:
    """Return O and A of Table I of one frame; a left hand's are those of the mirrored grasp.

    Args:
        geometry: the object.
        state: with a tracked hand.
        index: the object's place in the state.
    """
    T_object_hand = inverse(state.T_table_objects[index]) @ state.T_table_hand
    if state.hand_side == "left":
        T_object_hand = as_right_hand(geometry, T_object_hand)
    offset = transform_points(T_object_hand, palm_of("right")) - geometry.center
    return GraspFeatures(
        object_class=geometry.model.object_class,
        size=geometry.size,
        conv=geometry.convexity,
        dir=quaternion_from_rotation(T_object_hand[:3, :3]),
        npos=offset / max(float(np.linalg.norm(offset)), 1e-9),
        fcon=state.joint_angles,
        fvol=None,
        coc=None,
        gbvl=None,
    )


def filtered(before: Array | None, fresh: Array, elapsed: float, config: ReachConfig) -> Array:
    """Return the filtered log-odds after one more frame.

    Args:
        before: (T,) filtered log-odds up to the frame before; None: the first frame.
        fresh: (T,) log-odds of this frame alone.
        elapsed: time since the frame before [s].
        config: see there.
    """
    if before is None:
        return fresh
    share = 1.0 - float(np.exp(-elapsed / config.memory))
    return before + share * (fresh - before)


def reach_deviations(features: Features, gaps: Array, tracked: Array) -> Features:
    """Return how far each frame's pose may be from that of the grasp to come.

    Args:
        features: N frames or objects with dir, npos and fcon.
        gaps: (N,) from the palm to the object's surface [m].
        tracked: (26,) or (N, 26) standard deviations of the hand's state [m, rad].
    """
    far = gaps[:, None]
    tracked = np.broadcast_to(tracked, (len(gaps), HAND_SIZE))
    turn = np.linalg.norm(tracked[:, 3:6], axis=1, keepdims=True) / np.sqrt(3.0)
    direction = np.hypot(_DIRECTION_STD + _DIRECTION_PER_DISTANCE * far, turn)
    position = _POSITION_STD + _POSITION_PER_DISTANCE * far
    joint = np.hypot(_JOINT_STD + _JOINT_PER_DISTANCE * far, tracked[:, 6:])
    return {
        "dir": np.repeat(direction / 2.0, 4, axis=1),
        "npos": np.repeat(position, 3, axis=1),
        "fcon": np.broadcast_to(joint, features["fcon"].shape).copy(),
    }
