"""Finds the moment of the stable grasp in a stream of scene states and describes it by Table I.

The paper reads features at the last frame of a demonstration; here the moment is found: fingers
on opposite sides of an object touch it and the hand has stopped moving relative to it.
"""

from collections import Counter, deque
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    require_pose,
    rotation_angle,
    rotation_from_vector,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model_memory import ModelMemory
from intent_tracking.grasp.grasp_features import (
    GraspedShape,
    GraspFeatures,
    as_right_hand,
    check_features,
    grasp_features,
    hand_distances,
)
from intent_tracking.scene.hand_model import FINGERS, HandModel, Side
from intent_tracking.scene.joint_table import JointTable
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE

_NANO = 1e-9
_PALM = len(FINGERS)


@dataclass(frozen=True)
class GraspConfig(Checked):
    """When a grasp is stable, and when it has ended."""

    contact: float = 0.018
    """A finger touches where its skin is this close to the object: the tracker's error [m];
    0.001..0.1."""
    window: float = 0.20
    """The hand must have kept still relative to the object for this long [s], 0.01..10."""
    share: float = 0.6
    """It must be touched in this share of the window: the track of a hidden thumb flickers;
    0.01..1."""
    drift: float = 0.012
    """Still: the wrist moved less than this in the object's frame [m]; 0.0001..1."""
    turn: float = 0.20
    """Still: the wrist turned less than this in the object's frame [rad]; 0.001..3.1."""
    bend: float = 0.12
    """Still: half of the joints moved less than this [rad]; the track of hidden fingers jitters;
    0.001..3.1."""
    opposition: float = -0.1
    """Two fingers oppose each other if the cosine between the touched normals is below this,
    -1..1."""
    release: float = 0.30
    """A grasp has ended once nothing has touched the object for this long [s], 0.01..60."""
    gap: float = 0.15
    """A longer gap in the track empties the window [s], 0.01..10."""
    samples: int = 12
    """Draws by which the state's standard deviations are carried to the features, 2..1000."""


@dataclass(frozen=True, eq=False)
class StableGrasp:
    """A person holds an object: which one, how, and how sure the track is about it."""

    stamp: int
    """Stamp of the frame at which the grasp was found [ns]."""
    object_id: str
    object_model: str
    object_class: str
    hand_side: Side
    features: GraspFeatures
    """Table I; of a left hand the mirrored grasp, so that networks of the right hand apply."""
    std: GraspFeatures
    """Standard deviations, of the same shapes; None where the feature is None."""
    T_object_hand: Array
    """(4, 4) pose of the hand as it is, a left hand not mirrored."""

    def __post_init__(self) -> None:
        """Refuse values that no grasp has."""
        if self.hand_side not in ("left", "right"):
            raise ValueError(f"expected hand_side left or right, got {self.hand_side!r}")
        require_pose(self.T_object_hand, "T_object_hand")
        check_features(self.features, self.std)


@dataclass(frozen=True, eq=False)
class _Glance:
    """What one frame says about hand and objects."""

    stamp: int
    touched: str | None
    """Id of the object that is grasped, if any."""
    T_object_hand: dict[str, Array]
    """Where the hand is in the frame of each object."""
    joints: Array


class GraspDetector:
    """Reports every grasp once, in the frame in which it has become stable."""

    def __init__(self, database: ObjectDatabase, config: GraspConfig | None = None) -> None:
        self._config = config or GraspConfig()
        self._shapes = ModelMemory(database, GraspedShape)
        self._window: deque[_Glance] = deque()
        self.reset()

    def reset(self) -> None:
        """Forget the stream so far, for instance when another one starts."""
        self._window.clear()
        self._held: str | None = None
        self._last_touch = 0
        self._newest = -1

    def step(self, state: SceneState) -> StableGrasp | None:
        """Return the grasp that has become stable in this frame, or None.

        Where the clock goes back another recording begins, and what was held is forgotten.
        """
        if state.stamp < self._newest:
            self.reset()
        self._newest = state.stamp
        if self._window and not self._follows(state.stamp):
            self._window.clear()
        if not state.hand_tracked:
            return None
        glance = self._look(state)
        if self._held is not None:
            self._watch_release(state, glance)
            return None
        self._window.append(glance)
        horizon = state.stamp - self._config.window / _NANO
        while len(self._window) > 1 and self._window[1].stamp <= horizon:
            self._window.popleft()
        if self._window[0].stamp > horizon:
            return None
        touched = self._touched()
        if touched is None or not self._is_still(touched):
            return None
        self._held, self._last_touch = touched, state.stamp
        grasp = self._grasp(state, state.object_ids.index(touched))
        self._window.clear()
        return grasp

    def _follows(self, stamp: int) -> bool:
        return 0 < stamp - self._window[-1].stamp <= self._config.gap / _NANO

    def _look(self, state: SceneState) -> _Glance:
        """Return which object is grasped in a frame: the one that most fingers touch."""
        table, joints = state.hand.table, state.joint_angles
        T_table_hand, T_table_objects = state.T_table_hand, state.T_table_objects
        best, most = None, 1
        relative, near = {}, list[tuple[float, GraspedShape]]()
        for index, name in enumerate(state.object_ids):
            geometry = self._shapes.get(state.object_models[index])
            if geometry is None or state.objects_lost[index]:
                continue
            T_hand_object = inverse(T_table_hand) @ T_table_objects[index]
            relative[name] = inverse(T_hand_object)
            reach = float(np.linalg.norm(transform_points(T_hand_object, geometry.center)))
            reach -= 0.5 * geometry.model.diameter
            if reach > 0.25:
                continue
            near.append((reach, geometry))
            touched = touching_normals(geometry, T_hand_object, table, joints, self._config.contact)
            if len(touched) > most and _opposed(touched, self._config.opposition):
                best, most = name, len(touched)
        if near:  # slow the first time, which must not fall into the grasp
            min(near, key=lambda one: one[0])[1].prepare()
        return _Glance(state.stamp, best, relative, joints)

    def _touched(self) -> str | None:
        """Return the object that is grasped in most of the window, if in enough of it."""
        counts = Counter(glance.touched for glance in self._window if glance.touched is not None)
        if len(self._window) < 3 or not counts:
            return None
        name, count = counts.most_common(1)[0]
        return name if count >= self._config.share * len(self._window) else None

    def _is_still(self, touched: str) -> bool:
        """Return whether hand and object kept still relative to each other over the window."""
        if any(touched not in glance.T_object_hand for glance in self._window):
            return False
        last, config = self._window[-1], self._config
        for glance in self._window:
            moved = inverse(last.T_object_hand[touched]) @ glance.T_object_hand[touched]
            bend = float(np.median(np.abs(glance.joints - last.joints)))
            if (
                np.linalg.norm(moved[:3, 3]) > config.drift
                or rotation_angle(moved[:3, :3]) > config.turn
                or bend > config.bend
            ):
                return False
        return True

    def _watch_release(self, state: SceneState, glance: _Glance) -> None:
        """Re-arm once the held object has not been touched for a while."""
        if glance.touched == self._held:
            self._last_touch = state.stamp
        elif state.stamp - self._last_touch > self._config.release / _NANO:
            self._held = None

    def _grasp(self, state: SceneState, index: int) -> StableGrasp:
        """Return the grasp of object `index` over the window, described by Table I."""
        geometry = self._shapes.get(state.object_models[index])
        assert geometry is not None
        name = state.object_ids[index]
        pose = _mean_pose(np.array([glance.T_object_hand[name] for glance in self._window]))
        joints = np.median([glance.joints for glance in self._window], axis=0)
        features = _described(geometry, state, pose, joints)
        return StableGrasp(
            state.stamp,
            state.object_ids[index],
            state.object_models[index],
            state.object_classes[index],
            state.hand_side,
            features,
            self._deviations(geometry, state, index, pose, joints, features),
            pose,
        )

    def _deviations(
        self,
        geometry: GraspedShape,
        state: SceneState,
        index: int,
        pose: Array,
        joints: Array,
        features: GraspFeatures,
    ) -> GraspFeatures:
        """Return the features' standard deviations, from draws of the state's."""
        rng = np.random.default_rng(0)
        std = np.nan_to_num(state.state_std, nan=0.0)
        part = std[HAND_SIZE + OBJECT_SIZE * index :][:OBJECT_SIZE]
        T_table_object = state.T_table_objects[index]
        draws = []
        for _ in range(self._config.samples):
            hand = _disturbed(T_table_object @ pose, std[:6], rng)
            thing = _disturbed(T_table_object, part, rng)
            bent = joints + rng.normal(size=len(joints)) * std[6:HAND_SIZE]
            draws.append(_described(geometry, state, inverse(thing) @ hand, bent))
        return _spread(features, draws)


def touching_normals(
    geometry: GraspedShape, T_hand_object: Array, table: JointTable, joints: Array, reach: float
) -> Array:
    """Return the surface normal (K, 3) nearest to each finger that touches, and to the palm.

    Args:
        geometry: the object.
        T_hand_object: (4, 4).
        table: a human hand.
        joints: (20,) [rad].
        reach: a finger touches within this distance of its skin [m].
    """
    points_hand = transform_points(T_hand_object, geometry.points)
    distances = hand_distances(points_hand, table, joints)
    groups = finger_of_capsules(table)
    normals = []
    for group in range(_PALM + 1):
        gaps = distances[:, groups == group].min(axis=1)
        nearest = int(gaps.argmin())
        if gaps[nearest] < reach:
            normals.append(geometry.normals[nearest])
    return np.array(normals).reshape(-1, 3)


def finger_of_capsules(table: JointTable) -> NDArray[np.int64]:
    """Return the finger (C,) of each capsule in the order of `FINGERS`; 5 for the palm."""
    names = [table.link_names[link].split("_")[0] for link in table.capsules.links]
    return np.array([FINGERS.index(name) if name in FINGERS else _PALM for name in names])


def _opposed(normals: Array, cosine: float) -> bool:
    return bool(np.any(normals @ normals.T < cosine))


def _described(
    geometry: GraspedShape, state: SceneState, T_object_hand: Array, joints: Array
) -> GraspFeatures:
    """Return Table I of a grasp; of a left hand, of its mirror image."""
    if state.hand_side == "left":
        T_object_hand = as_right_hand(geometry, T_object_hand)
    table = HandModel.from_shape("right", state.hand_shape).table
    return grasp_features(geometry, T_object_hand, joints, table)


def _mean_pose(poses: Array) -> Array:
    """Return the mean (4, 4) of nearby poses (N, 4, 4)."""
    left, _, right = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    return make_pose(left @ right, poses[:, :3, 3].mean(axis=0))


def _disturbed(pose: Array, std: Array, rng: np.random.Generator) -> Array:
    """Return a draw of a pose (4, 4) whose position and rotation vector deviate by std (6,)."""
    turn = rotation_from_vector(rng.normal(size=3) * std[3:])
    return make_pose(turn @ pose[:3, :3], pose[:3, 3] + rng.normal(size=3) * std[:3])


def _spread(features: GraspFeatures, draws: list[GraspFeatures]) -> GraspFeatures:
    """Return the root mean square deviation of the draws from the features."""
    spread: dict[str, Array | None] = {}
    for field in fields(GraspFeatures)[1:]:
        value = getattr(features, field.name)
        if value is None:
            spread[field.name] = None
            continue
        others = np.array([getattr(draw, field.name) for draw in draws])
        if field.name == "dir":  # q and -q are one orientation
            others = others * np.where(others @ value < 0.0, -1.0, 1.0)[:, None]
        spread[field.name] = np.sqrt(np.mean((others - value) ** 2, axis=0))
    return GraspFeatures(features.object_class, **spread)
