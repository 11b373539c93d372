"""The shake test: does the hand keep the object when gravity pulls from six sides?

The hand's base is fixed and its joints are motors with limited torque; the object is free and is
held by contact and friction alone. Every grasp starts from the same state of the engine.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from intent_inference.grasping.autograsp import ClosedGrasp
from intent_inference.grasping.contacts import PAD, Contacts
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.urdf import urdf_text
from intent_perception.basics.arrays import Array
from intent_perception.basics.late_module import LateModule
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    rotation_angle,
    rotation_from_quaternion,
)
from intent_perception.geometry.transforms import quaternion_from_rotation as quaternion
from intent_perception.objects.database import ObjectModel

pybullet = LateModule("pybullet")
_DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)])


@dataclass(frozen=True)
class ShakeConfig(Checked):
    """The shake test; share/simulation.yaml fixes it for the shipped data."""

    acceleration: float = 9.81
    """Pull in each of the six directions [m/s²], 0..1000."""
    duration: float = 0.35
    """Time of each pull [s], 0.01..10."""
    settling: float = 0.15
    """Time to close and settle before the pulls, without gravity [s], 0..10."""
    drift: float = 0.02
    """The object's centre of mass may move less than this [m], 0.0001..1."""
    rotation: float = 0.4
    """The object may turn less than this [rad], 0.001..3.1."""
    stiffness: float = 0.4
    """Share of a joint's error that its motor would remove in one step, torque permitting, 0..1."""
    settling_drift: float = 0.04
    """The object may move less than this while the hand closes [m], 0..1."""
    friction: float = 0.8
    """Coulomb coefficient between hand and object, 0..10."""
    rate: int = 240
    """Steps per second, 60..10000."""
    iterations: int = 100
    """Iterations of the constraint solver per step, 10..10000."""
    correction: float = 0.5
    """Share of a penetration that the solver removes in one step, 0..1."""


@dataclass(frozen=True, eq=False)
class ShakenGrasp:
    """What is left of a grasp after settling and six pulls."""

    held: bool
    """Whether the object stayed in all six directions."""
    directions: int
    """Number of directions held before the first loss."""
    stability: float
    """1 = it did not move; 0 = it moved or turned as far as allowed; below 0 = lost."""
    T_object_hand: Array
    """Settled pose (4, 4)."""
    joints: Array
    """Settled posture (J,) [rad]."""
    contacts: Contacts
    """Contacts of the settled grasp, object frame."""
    penetration: float
    """Deepest contact of the settled grasp [m]."""


class ShakeTest:
    """One hand and one object; a context manager.

    Joints that a pre-shape does not move are rigid, which halves the solver's work: there is one
    engine for each set of rigid joints, made when it is first needed.
    """

    def __init__(
        self, hand: GraspingHand, model: ObjectModel, config: ShakeConfig | None = None
    ) -> None:
        model.require_volume()
        self._hand, self._model = hand, model
        self._config = config or ShakeConfig()
        self._engines: dict[bytes, _Engine] = {}

    def __enter__(self) -> "ShakeTest":
        return self

    def __exit__(self, *_: object) -> None:
        while self._engines:
            self._engines.popitem()[1].close()

    def run(self, grasp: ClosedGrasp) -> ShakenGrasp:
        """Settle the grasp, record it, and pull the object to six sides until it is lost."""
        locked = np.where(grasp.closing == 0.0, np.round(grasp.joints, 4), np.nan)
        key = locked.tobytes()
        if key not in self._engines:
            if len(self._engines) == _MOST_ENGINES:
                self._engines.pop(next(iter(self._engines))).close()
            self._engines[key] = _Engine(self._hand, self._model, locked, self._config)
        return self._engines[key].run(grasp)


_MOST_ENGINES = 10


class _Engine:
    """One hand with some rigid joints and one object in one physics engine."""

    def __init__(
        self, hand: GraspingHand, model: ObjectModel, locked: Array, config: ShakeConfig
    ) -> None:
        self._hand, self._model, self._config = hand, model, config
        self._center = model.mesh.center_of_mass
        table = hand.table
        self._links = [
            link for link, d in enumerate(table.drivers) if d >= 0 and np.isnan(locked[d])
        ]
        self._joint_ids = [link - 1 for link in self._links]
        self._drivers = table.drivers[self._links]
        self._ratios = table.ratios[self._links]
        self._client = pybullet.connect(pybullet.DIRECT)
        with tempfile.TemporaryDirectory() as folder:
            self._load(Path(folder), locked)

    def close(self) -> None:
        """Free the engine."""
        pybullet.disconnect(self._client)

    def _load(self, folder: Path, locked: Array) -> None:
        """Load the hand as URDF and the object as a compound of its convex parts."""
        hand, client = self._hand, self._client
        (folder / "hand.urdf").write_text(urdf_text(hand.table, hand.effort, locked))
        self._body = pybullet.loadURDF(
            str(folder / "hand.urdf"),
            useFixedBase=True,
            flags=pybullet.URDF_MAINTAIN_LINK_ORDER | pybullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
        for link in range(-1, len(hand.table.parents) - 1):
            pybullet.changeDynamics(
                self._body,
                link,
                lateralFriction=self._config.friction,
                spinningFriction=PAD,
                physicsClientId=client,
            )
        (folder / "object.obj").write_text(_grouped_obj(self._model))
        self._shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, fileName=str(folder / "object.obj"), physicsClientId=client
        )
        self._object = self._new_object()
        # Not the direct (Dantzig) solver: its friction lets pulls along +x, +y, +z slip that it
        # holds along -x, -y, -z.
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=1.0 / self._config.rate,
            numSolverIterations=self._config.iterations,
            contactERP=self._config.correction,
            globalCFM=1e-6,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )

    def _new_object(self) -> int:
        """Return a new body at the origin, of which the engine remembers no contacts."""
        body: int = pybullet.createMultiBody(
            self._model.mass,
            self._shape,
            basePosition=[0.0, 0.0, 0.0],
            baseInertialFramePosition=self._center.tolist(),
            physicsClientId=self._client,
        )
        edges = self._model.size**2
        inertia = self._model.mass / 12.0 * (edges.sum() - edges)
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=1.0,  # the engine multiplies the two coefficients
            localInertiaDiagonal=inertia.tolist(),
            physicsClientId=self._client,
        )
        return body

    def run(self, grasp: ClosedGrasp) -> ShakenGrasp:
        """Settle the grasp, record it, and pull the object to six sides until it is lost."""
        self._reset(grasp)
        start = self._object_pose()
        self._step(int(self._config.settling * self._config.rate))
        settled = self._object_pose()
        contacts, penetration = self._contacts(settled)
        T_object_hand = inverse(settled) @ grasp.T_object_hand
        joints = self._joints(grasp)
        moved = np.linalg.norm(settled[:3, 3] - start[:3, 3])
        count, stability = 0, -1.0
        if moved <= self._config.settling_drift and len(contacts.points) >= 2:
            count, stability = self._shake(settled)
        held = count == len(_DIRECTIONS)
        return ShakenGrasp(held, count, stability, T_object_hand, joints, contacts, penetration)

    def _reset(self, grasp: ClosedGrasp) -> None:
        """Place hand and object; both stand still, the motors squeeze beyond the contact."""
        client, limits = self._client, self._hand.table.limits
        target = np.clip(
            grasp.joints + self._hand.squeeze * grasp.closing, limits[:, 0], limits[:, 1]
        )
        effort = self._hand.effort * self._hand.grips.get(grasp.preshape, 1.0)
        pybullet.removeBody(self._object, physicsClientId=client)
        self._object = self._new_object()
        pybullet.setGravity(0.0, 0.0, 0.0, physicsClientId=client)
        pybullet.resetBasePositionAndOrientation(
            self._body,
            grasp.T_object_hand[:3, 3].tolist(),
            quaternion(grasp.T_object_hand[:3, :3]).tolist(),
            physicsClientId=client,
        )
        pybullet.resetJointStatesMultiDof(
            self._body,
            self._joint_ids,
            (self._ratios * grasp.joints[self._drivers])[:, None].tolist(),
            [[0.0]] * len(self._joint_ids),
            physicsClientId=client,
        )
        pybullet.setJointMotorControlArray(
            self._body,
            self._joint_ids,
            pybullet.POSITION_CONTROL,
            targetPositions=(self._ratios * target[self._drivers]).tolist(),
            forces=effort[self._drivers].tolist(),
            positionGains=[self._config.stiffness] * len(self._joint_ids),
            velocityGains=[0.6] * len(self._joint_ids),
            physicsClientId=client,
        )

    def _step(self, count: int) -> None:
        for _ in range(count):
            pybullet.stepSimulation(physicsClientId=self._client)

    def _shake(self, settled: Array) -> tuple[int, float]:
        """Return how many directions are held, and the least margin of those tried."""
        margin = 1.0
        with self._saved_state() as state:
            for count, direction in enumerate(_DIRECTIONS):
                pybullet.restoreState(stateId=state, physicsClientId=self._client)
                pull = self._config.acceleration * direction
                pybullet.setGravity(*pull.tolist(), physicsClientId=self._client)
                margin = min(margin, self._pull(settled))
                if margin < 0.0:
                    return count, margin
        return len(_DIRECTIONS), margin

    def _pull(self, settled: Array) -> float:
        """Return the margin after one pull; stops early once the object is gone."""
        steps = round(self._config.duration * self._config.rate)
        margin = 1.0
        for step in range(0, steps, 21):
            self._step(min(21, steps - step))
            pose = self._object_pose()
            drift = float(np.linalg.norm(self._mass_center(pose) - self._mass_center(settled)))
            turn = float(rotation_angle(settled[:3, :3].T @ pose[:3, :3]))
            margin = 1.0 - max(drift / self._config.drift, turn / self._config.rotation)
            if margin < -0.5:
                break
        return margin

    @contextmanager
    def _saved_state(self) -> Iterator[int]:
        state = pybullet.saveState(physicsClientId=self._client)
        try:
            yield state
        finally:
            pybullet.removeState(state, physicsClientId=self._client)

    def _object_pose(self) -> Array:
        """Return the pose (4, 4) of the object frame; the engine reports the centre of mass."""
        position, orientation = pybullet.getBasePositionAndOrientation(
            self._object, physicsClientId=self._client
        )
        rotation = rotation_from_quaternion(orientation)
        return make_pose(rotation, np.array(position) - rotation @ self._center)

    def _mass_center(self, pose: Array) -> Array:
        return np.asarray(pose[:3, :3] @ self._center + pose[:3, 3])

    def _joints(self, grasp: ClosedGrasp) -> Array:
        """Return the posture (J,); of links that share a driver the first counts."""
        states = pybullet.getJointStates(self._body, self._joint_ids, physicsClientId=self._client)
        joints = grasp.joints.copy()
        angles = np.array([state[0] for state in states]) / self._ratios
        joints[self._drivers[::-1]] = angles[::-1]
        return joints

    def _contacts(self, pose: Array) -> tuple[Contacts, float]:
        """Return the contacts in the object frame and the deepest penetration [m]."""
        found = [
            contact
            for contact in pybullet.getContactPoints(
                self._body, self._object, physicsClientId=self._client
            )
            if contact[9] > 0.0
        ]
        points = np.array([contact[6] for contact in found]).reshape(-1, 3)
        normals = np.array([contact[7] for contact in found]).reshape(-1, 3)
        contacts = Contacts(
            (points - pose[:3, 3]) @ pose[:3, :3],
            -normals @ pose[:3, :3],  # the engine's normals point from the object to the hand
            np.array([contact[3] + 1 for contact in found], dtype=np.int64),
            np.array([contact[9] for contact in found], dtype=np.float64),
        )
        return contacts, max((-contact[8] for contact in found), default=0.0)


def _grouped_obj(model: ObjectModel) -> str:
    """Return an OBJ file with one group per convex part, which the engine loads as a compound."""
    lines, offset = [], 1
    for index, part in enumerate(model.parts):
        lines.append(f"o part_{index}")
        lines += ["v {:.6f} {:.6f} {:.6f}".format(*vertex) for vertex in part.mesh.vertices]
        lines += ["f {} {} {}".format(*(face + offset)) for face in part.mesh.faces]
        offset += len(part.mesh.vertices)
    return "\n".join(lines) + "\n"
