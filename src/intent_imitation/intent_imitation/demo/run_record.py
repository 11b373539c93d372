"""The recorded run of a demonstration, and its result as JSON keys."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from intent_imitation.planner.plan import GraspPlan, ObjectChoice
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import quaternion_from_rotation
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.scene.scene_state import SceneState


@dataclass(frozen=True)
class DemoTruth:
    """What is known about a bag that was made or annotated; never read by the nodes."""

    task: str | None
    """The demonstrated task."""
    grasp_stamp: int | None
    """Stamp of the grasp [ns]."""
    joint_error: float | None
    """Mean distance of the 21 tracked joints from the truth while the hand is in view [m]."""
    synthetic: bool = False
    """The pixels are rendered, by bags/make.py."""


@dataclass(frozen=True, eq=False)
class DemoRecord:
    """All that the five nodes said about one bag, and the images to show it over."""

    bag: str
    """Name of the bag."""
    frames: tuple[RgbdFrame, ...]
    """Frames of the bag, at least those at `moments`."""
    objects: RecognizedObjects | None
    """The demonstrator's table, as the tracker started from it."""
    states: tuple[SceneState, ...]
    """Every tracked state, in order."""
    grasps: tuple[StableGrasp, ...]
    """Every stable grasp, in order."""
    posteriors: tuple[TaskPosterior, ...]
    """Preliminary and final ones, in order."""
    plan: GraspPlan | None
    """The answer to the first final posterior."""
    robot_frame: RgbdFrame | None
    """The robot's own table."""
    robot_objects: RecognizedObjects | None
    """What was recognised on it."""
    database: ObjectDatabase
    """The objects that the nodes knew."""
    frames_total: int
    """Frames sent."""
    frames_lost: int
    """Frames without a scene state, or whose hand was in view and lost."""
    seconds: float
    """Wall time from the first frame to the plan [s]."""
    truth: DemoTruth | None = None
    frames_left_out: int = 0
    """Frames of the bag that are damaged."""
    written: str = ""
    """Date and time of the run, as the report shows it."""
    version: str = ""
    """Of this software."""
    robot_hand: GraspingHand | None = None
    """The hand that the plan is for, to be drawn; None: it is not known what it looks like."""

    @property
    def final(self) -> TaskPosterior | None:
        """The conclusion at the first stable grasp."""
        return next((p for p in self.posteriors if not p.preliminary), None)


def moments(stamps: Sequence[int], grasps: Sequence[StableGrasp]) -> tuple[int, ...]:
    """Return the stamps [ns] of the (at most six) frames that the report shows.

    With a grasp: the start, two during the reach, the grasp itself, two afterwards; without one,
    six spread evenly.
    """
    if len(stamps) == 0:
        return ()
    ordered = np.sort(np.asarray(stamps, dtype=np.int64))
    last = len(ordered) - 1
    if grasps:
        grasp = int(np.argmin(np.abs(ordered - grasps[0].stamp)))
        wanted = [0, round(0.45 * grasp), round(0.75 * grasp), grasp]
        wanted += [round(grasp + 0.5 * (last - grasp)), last]
    else:
        wanted = [round(last * k / 5) for k in range(6)]
    return tuple(int(ordered[k]) for k in sorted(set(wanted)))


def result(record: DemoRecord) -> dict[str, Any]:
    """Return the keys of `result.json` (CONTRACT.md); null where there is nothing to say."""
    final, plan, truth = record.final, record.plan, record.truth
    error = truth.joint_error if truth is not None else None
    return {
        "bag": record.bag,
        "stable_grasp_stamp": record.grasps[0].stamp * 1e-9 if record.grasps else None,
        "posterior": None if final is None else _posterior(final),
        "best_task": None if final is None else final.best,
        "true_task": None if truth is None else truth.task,
        "chosen_object": plan.grasps[0].object_id if plan is not None and plan.grasps else None,
        "grasp": grasp_values(plan) if plan is not None and plan.grasps else None,
        "nothing_affords": None if plan is None else plan.nothing_affords,
        "nothing_recognised": None if plan is None else plan.nothing_recognised,
        "robot_objects": None if plan is None else [_choice(choice) for choice in plan.objects],
        "frames": record.frames_total,
        "frames_lost": record.frames_lost,
        "frames_left_out": record.frames_left_out,
        "track_error_mm": None if error is None else error * 1e3,
        "seconds": record.seconds,
    }


def _posterior(posterior: TaskPosterior) -> dict[str, float]:
    return {task: float(p) for task, p in zip(posterior.tasks, posterior.probability, strict=True)}


def _choice(choice: ObjectChoice) -> dict[str, Any]:
    return {
        "id": choice.id,
        "class": choice.object_class,
        "probability": choice.probability if choice.judged else None,
        "affords": choice.affords,
    }


def grasp_values(plan: GraspPlan) -> dict[str, Any]:
    """Return the best grasp as JSON values in m and rad; the pose is in the table frame."""
    best = plan.grasps[0]
    return {
        "hand": plan.hand,
        "wrist_pose": {
            "position": [float(x) for x in best.T_table_hand[:3, 3]],
            "quaternion_xyzw": [
                float(x) for x in quaternion_from_rotation(best.T_table_hand[:3, :3])
            ],
        },
        "approach": [float(x) for x in best.approach],
        "joints": _named(plan.joint_names, best.grasp_joints),
        "pregrasp_joints": _named(plan.joint_names, best.pregrasp_joints),
        "score": float(best.score),
        "score_parts": {name: float(value) for name, value in best.score_parts.items()},
        "shaken": best.shaken,
    }


def _named(names: Sequence[str], joints: Sequence[float] | np.ndarray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, joints, strict=True)}
