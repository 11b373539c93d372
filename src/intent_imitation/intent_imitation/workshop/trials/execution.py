"""A plan carried out in physics: the robot's hand holds by contact and friction alone.

The wrist flies freely: a strong constraint drags the hand's base along the planned motion. Fingers
are motors of limited torque. Nothing attaches the object to the hand.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from intent_imitation.planner.plan import GraspCandidate
from intent_imitation.workshop.trials.motions import MotionConfig, Stage, interpolate, stages
from intent_inference.grasping.contacts import PAD, Contacts
from intent_inference.grasping.grasping_hand import GraspingHand, Preshape
from intent_inference.grasping.urdf import urdf_text
from intent_perception.basics.arrays import Array
from intent_perception.basics.late_module import LateModule
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    quaternion_from_rotation,
    rotation_angle,
    rotation_from_quaternion,
)
from intent_perception.objects.database import ObjectModel

pybullet = LateModule("pybullet")


@dataclass(frozen=True)
class ExecutionConfig(Checked):
    """The physics of an execution and when an object counts as held."""

    rate: int = 240
    """Steps per second, 60..10000."""
    iterations: int = 100
    """Iterations of the constraint solver per step, 10..10000."""
    friction: float = 0.8
    """Coulomb coefficient between hand and object, as in the shake test, 0..10."""
    stiffness: float = 0.4
    """Share of a joint's error that its motor would remove in one step, torque permitting, 0..1."""
    inertia: float = 1e-4
    """Least inertia of the hand's links [kg m²]: lighter ones make the solver's iterations slow;
    0..0.01."""
    correction: float = 0.5
    """Share of a penetration that a step removes, 0..1."""
    closing: float = 0.7
    """Share of its stage in which the hand closes; the rest of the stage it squeezes; 0.05..1."""
    wrist_force: float = 400.0
    """Largest force of the wrist [N], 1..100000."""
    drift: float = 0.03
    """The object may slip this far in the hand after it has closed [m], 0.0001..1."""
    rotation: float = 0.6
    """The object may turn this far in the hand after it has closed [rad], 0.001..3.1."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Where everything was at the end of a stage."""

    stage: str
    T_table_hand: Array
    joints: Array
    """(J,) [rad]."""
    T_table_objects: Array
    """(N, 4, 4)."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a plan."""

    held: bool
    """The object was lifted and stayed in the hand through the task's motion."""
    slip: float
    """How far its centre moved in the hand after the hand had closed [m]."""
    turn: float
    """How far it turned in the hand [rad]."""
    T_object_hand: Array
    """(4, 4) grasp after closing, as executed."""
    joints: Array
    """(J,) posture after closing [rad]."""
    contacts: Contacts
    """Contacts after closing, in the object frame."""
    snapshots: tuple[Snapshot, ...]
    """At the end of every stage."""


class World:
    """Table, objects and hand in one physics engine; a context manager."""

    def __init__(
        self,
        hand: GraspingHand,
        models: Sequence[ObjectModel],
        T_table_objects: Array,
        config: ExecutionConfig | None = None,
    ) -> None:
        """Build the scene.

        Args:
            hand: the robot's hand.
            models: N objects with volume and convex parts.
            T_table_objects: (N, 4, 4) where they stand.
            config: physics.
        """
        self._config, self._hand, self._models = config or ExecutionConfig(), hand, models
        self._client = pybullet.connect(pybullet.DIRECT)
        self._centers = [model.require_volume().center_of_mass for model in models]
        with tempfile.TemporaryDirectory() as folder:
            self._load(Path(folder), T_table_objects)

    def __enter__(self) -> "World":
        return self

    def __exit__(self, *_: object) -> None:
        pybullet.disconnect(self._client)

    def _load(self, folder: Path, T_table_objects: Array) -> None:
        """Load table, objects and hand; the hand waits high above."""
        client = self._client
        pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=1.0 / self._config.rate,
            numSolverIterations=self._config.iterations,
            contactERP=self._config.correction,
            physicsClientId=client,
        )
        plate = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=[1.0, 1.0, 0.02], physicsClientId=client
        )
        table = pybullet.createMultiBody(
            0.0, plate, basePosition=[0.0, 0.0, -0.02], physicsClientId=client
        )
        pybullet.changeDynamics(table, -1, lateralFriction=0.8, physicsClientId=client)
        self._objects = [
            self._add_object(folder, index, pose) for index, pose in enumerate(T_table_objects)
        ]
        (folder / "hand.urdf").write_text(urdf_text(self._hand.table, self._hand.effort))
        self._body = pybullet.loadURDF(
            str(folder / "hand.urdf"),
            basePosition=[0.0, 0.0, 1.5],
            flags=pybullet.URDF_MAINTAIN_LINK_ORDER,
            physicsClientId=client,
        )
        for link in range(-1, len(self._hand.table.parents) - 1):
            pybullet.changeDynamics(
                self._body,
                link,
                lateralFriction=self._config.friction,
                spinningFriction=PAD,
                localInertiaDiagonal=[self._config.inertia] * 3,
                physicsClientId=client,
            )
        self._driven = [k - 1 for k, driver in enumerate(self._hand.table.drivers) if driver >= 0]

    def _add_object(self, folder: Path, index: int, pose: Array) -> int:
        """Add one object as a compound of its convex parts and return its body."""
        model, center, client = self._models[index], self._centers[index], self._client
        file = folder / f"object_{index}.obj"
        file.write_text(compound_obj(model))
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, fileName=str(file), physicsClientId=client
        )
        body = pybullet.createMultiBody(
            model.mass,
            shape,
            baseInertialFramePosition=center.tolist(),
            physicsClientId=client,
        )
        pybullet.resetBasePositionAndOrientation(  # places the centre of mass
            body,
            (pose[:3, :3] @ center + pose[:3, 3]).tolist(),
            quaternion_from_rotation(pose[:3, :3]).tolist(),
            physicsClientId=client,
        )
        edges = model.size**2
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=1.0,  # the engine multiplies the two coefficients
            spinningFriction=0.001,
            rollingFriction=0.0005,
            localInertiaDiagonal=(model.mass / 12.0 * (edges.sum() - edges)).tolist(),
            physicsClientId=client,
        )
        return int(body)

    def execute(
        self, grasp: GraspCandidate, target: int, task: str, motion: MotionConfig | None = None
    ) -> Outcome:
        """Carry out a grasp of the object with index `target` and the task's test motion."""
        center = self._object_center(target)
        plan = stages(grasp, task, center, motion or MotionConfig())
        shape = preshape_of(self._hand, grasp.pregrasp_joints)
        limits = self._hand.table.limits
        squeezed = np.clip(
            grasp.grasp_joints + self._hand.squeeze * shape.rates, limits[:, 0], limits[:, 1]
        )
        self._effort = self._hand.effort * self._hand.grips[shape.name]
        self._place_hand(plan[0].T_table_hand, grasp.pregrasp_joints)
        snapshots, T_object_hand, joints = [], np.eye(4), grasp.grasp_joints
        contacts = self._contacts(target)
        height = center[2]
        at = plan[0].T_table_hand
        for stage in plan:
            self._run(at, stage, grasp.pregrasp_joints, squeezed)
            at = stage.T_table_hand
            snapshots.append(self._snapshot(stage.name))
            if stage.name == "close":
                T_object_hand = self._grasp_of(target)
                joints, contacts = self._joints(), self._contacts(target)
        final = self._grasp_of(target)
        slip, turn = self._change(T_object_hand, final, target)
        lifted = self._object_center(target)[2] > height + 0.5 * (motion or MotionConfig()).lift
        held = lifted and slip < self._config.drift and turn < self._config.rotation
        return Outcome(bool(held), slip, turn, T_object_hand, joints, contacts, tuple(snapshots))

    def _place_hand(self, pose: Array, joints: Array) -> None:
        """Put the hand somewhere at rest and tie its wrist to the world."""
        client = self._client
        position, orientation = pose[:3, 3].tolist(), quaternion_from_rotation(pose[:3, :3])
        pybullet.resetBasePositionAndOrientation(
            self._body, position, orientation.tolist(), physicsClientId=client
        )
        for link, angle in zip(self._driven, self._angles(joints), strict=True):
            pybullet.resetJointState(self._body, link, angle, 0.0, physicsClientId=client)
        self._wrist = pybullet.createConstraint(
            self._body, -1, -1, -1, pybullet.JOINT_FIXED, [0, 0, 0], [0, 0, 0], position,
            childFrameOrientation=orientation.tolist(), physicsClientId=client,
        )  # fmt: skip

    def _run(self, start: Array, stage: Stage, opened: Array, closed: Array) -> None:
        """Move the wrist through one stage; the fingers follow in proportion while they close."""
        steps = max(1, round(stage.duration * self._config.rate))
        for step in range(1, steps + 1):
            share = step / steps
            pose = interpolate(start, stage.T_table_hand, share)
            pybullet.changeConstraint(
                self._wrist,
                pose[:3, 3].tolist(),
                quaternion_from_rotation(pose[:3, :3]).tolist(),
                maxForce=self._config.wrist_force,
                physicsClientId=self._client,
            )
            grip = stage.closed
            if stage.name == "close":  # a finger that snaps shut knocks the object away
                grip *= min(1.0, share / self._config.closing)
            self._drive(opened + grip * (closed - opened))
            pybullet.stepSimulation(physicsClientId=self._client)

    def _drive(self, joints: Array) -> None:
        """Set the fingers' targets (J,) [rad]."""
        drivers = [driver for driver in self._hand.table.drivers if driver >= 0]
        pybullet.setJointMotorControlArray(
            self._body,
            self._driven,
            pybullet.POSITION_CONTROL,
            targetPositions=self._angles(joints),
            forces=[float(self._effort[driver]) for driver in drivers],
            positionGains=[self._config.stiffness] * len(drivers),
            velocityGains=[0.6] * len(drivers),
            physicsClientId=self._client,
        )

    def _angles(self, joints: Array) -> list[float]:
        """Return the angle of every driven link, coupled ones included."""
        table = self._hand.table
        links = [link + 1 for link in self._driven]
        return [float(table.ratios[link] * joints[table.drivers[link]]) for link in links]

    def _joints(self) -> Array:
        """Return the posture (J,); of coupled links the first counts [rad]."""
        table = self._hand.table
        joints = np.zeros(len(table.joint_names))
        states = pybullet.getJointStates(self._body, self._driven, physicsClientId=self._client)
        for link, state in zip(self._driven[::-1], states[::-1], strict=True):
            joints[table.drivers[link + 1]] = state[0] / table.ratios[link + 1]
        return joints

    def _hand_pose(self) -> Array:
        """Return T_table_hand; the base's centre of mass is its origin."""
        position, turn = pybullet.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        return make_pose(rotation_from_quaternion(turn), np.array(position))

    def _object_pose(self, index: int) -> Array:
        """Return T_table_object; the engine reports the centre of mass."""
        position, turn = pybullet.getBasePositionAndOrientation(
            self._objects[index], physicsClientId=self._client
        )
        rotation = rotation_from_quaternion(turn)
        return make_pose(rotation, np.array(position) - rotation @ self._centers[index])

    def _object_center(self, index: int) -> Array:
        pose = self._object_pose(index)
        return np.asarray(pose[:3, :3] @ self._centers[index] + pose[:3, 3])

    def _grasp_of(self, index: int) -> Array:
        return np.asarray(inverse(self._object_pose(index)) @ self._hand_pose())

    def _change(self, before: Array, after: Array, target: int) -> tuple[float, float]:
        """Return how far the object's centre moved and how far it turned, seen from the hand."""
        center = np.append(self._centers[target], 1.0)
        moved = inverse(before) @ center - inverse(after) @ center
        turn = rotation_angle(before[:3, :3].T @ after[:3, :3])
        return float(np.linalg.norm(moved[:3])), float(turn)

    def _snapshot(self, name: str) -> Snapshot:
        poses = np.array([self._object_pose(index) for index in range(len(self._objects))])
        return Snapshot(name, self._hand_pose(), self._joints(), poses)

    def _contacts(self, target: int) -> Contacts:
        """Return where the hand touches the object, in the object frame."""
        pose = self._object_pose(target)
        found = pybullet.getContactPoints(
            self._body, self._objects[target], physicsClientId=self._client
        )
        found = [contact for contact in found or () if contact[9] > 0.0]
        points = np.array([contact[6] for contact in found]).reshape(-1, 3)
        normals = np.array([contact[7] for contact in found]).reshape(-1, 3)
        return Contacts(
            (points - pose[:3, 3]) @ pose[:3, :3],
            -normals @ pose[:3, :3],  # the engine's normals point from the object to the hand
            np.array([contact[3] + 1 for contact in found], dtype=np.int64),
            np.array([contact[9] for contact in found], dtype=np.float64),
        )


def preshape_of(hand: GraspingHand, pregrasp_joints: Array) -> Preshape:
    """Return the pre-shape whose open posture (J,) is nearest to the given one."""
    gaps = [float(np.abs(shape.open - pregrasp_joints).max()) for shape in hand.preshapes]
    return hand.preshapes[int(np.argmin(gaps))]


def compound_obj(model: ObjectModel) -> str:
    """Return an OBJ file with one group per convex part, which the engine loads as a compound."""
    lines, offset = [], 1
    for index, part in enumerate(model.parts):
        lines.append(f"o part_{index}")
        lines += ["v {:.6f} {:.6f} {:.6f}".format(*vertex) for vertex in part.mesh.vertices]
        lines += ["f {} {} {}".format(*(face + offset)) for face in part.mesh.faces]
        offset += len(part.mesh.vertices)
    return "\n".join(lines) + "\n"
