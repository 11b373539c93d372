"""How soon the true task is meant most: on bags, on demonstrations, on motions that do nothing.

Bags go through recogniser, tracker and detector; where one ends before a second after lift-off, as
those in git do, its last frame counts. Of the demonstrations the grasp is the tracked one and the
motion is the true one of the script that was filmed, which goes on until more than a second after
lift-off, with the noise of a tracker: their pictures were tracked up to the grasp only.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.intention.class_priors import ClassPriors
from intent_inference.intention.estimator import InferenceConfig, least_deviations
from intent_inference.intention.held_intention import HeldIntention, intended
from intent_inference.motion.measures import HeldMotion, person_of
from intent_inference.motion.motion_network import RATE, MotionFilter, shipped_motion
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_variables
from intent_inference.quantisation.variables import ACTION, OBJECT, OBJECT_CLASS
from intent_inference.workshop.acting.held_motions import held_motion
from intent_inference.workshop.evaluation.scores import calibration_error
from intent_inference.workshop.recipes.bag_run import BagRun, run_bag
from intent_inference.workshop.training.labelled_table import deviations_of, read_grasps
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, pose_from_vector, rotation_from_vector

_IDLE = ("inspect", "move aside", "put back")
_AFTER, _LIFT = 1.0, 0.02
_NOISE, _TURN = 0.002, 0.02


def motion_figures(
    model: TaskModel, data: Path, bags: tuple[Path, ...], seed: int
) -> dict[str, Any]:
    """Return the contract's `motion`.

    Args:
        model: BN^H.
        data: folder with demonstrations.csv.gz and motions.npz.
        bags: folders of bags with truth.
        seed: of noise and idle motions.
    """
    rng = np.random.default_rng(seed)
    return {**_bags(bags), **_films(model, data, rng), "update_ms": _update(model)}


def _bags(bags: tuple[Path, ...]) -> dict[str, Any]:
    """Return the share of bags whose true task is meant most, at the grasp and a second later."""
    grasp, later, wrong = [], [], []
    for bag in bags:
        truth = read_arrays(bag / "truth.npz", "truth of a bag")
        task = str(np.ravel(truth["task"])[0]) if np.size(truth.get("task", ())) else ""
        run = run_bag(bag)
        if not task or not run.posteriors:
            continue
        first = run.posteriors[0]
        last = _second_after(run)
        grasp.append(first.meanings[int(np.argmax(first.intends))] == task)
        later.append(last.meanings[int(np.argmax(last.intends))] == task)
        if not later[-1]:
            wrong.append(bag.name)
    if not grasp:
        return {"first_right_grasp": None, "first_right_1s": None}
    return {
        "first_right_grasp": float(np.mean(grasp)), "first_right_1s": float(np.mean(later)),
        "bags": len(grasp), "wrong_1s": wrong,
    }  # fmt: skip


def _second_after(run: BagRun) -> Any:
    """Return the last word about the first grasp up to a second after lift-off."""
    first = run.posteriors[0]
    said = [p for p in run.said if p.object_id == first.object_id and p.stamp >= first.stamp]
    index = run.states[0].object_ids.index(first.object_id)
    start: float | None = None
    lift = first.stamp
    for state in run.states:
        if index >= len(state.object_ids) or state.object_ids[index] != first.object_id:
            continue
        height = float(state.T_table_objects[index, 2, 3])
        start = height if start is None else start
        if height > start + _LIFT and state.stamp >= first.stamp:
            lift = state.stamp
            break
    until = [p for p in said if p.stamp <= lift + _AFTER * 1e9]
    return until[-1] if until else first


def _films(model: TaskModel, data: Path, rng: np.random.Generator) -> dict[str, Any]:
    absent = {"films_first_right_grasp": None, "films_first_right_1s": None, "idle_called": None}
    if not (data / "motions.npz").is_file() or not (data / "demonstrations.csv.gz").is_file():
        return absent
    table = read_grasps(data / "demonstrations.csv.gz", model.tasks)
    observed = select_variables(table.features, (*OBJECT, *ACTION))
    widths = least_deviations(observed, InferenceConfig(), deviations_of(table))
    affords = model.calibrated_log_odds(model.evidence(observed, widths))
    names = table.columns["demonstration"].astype(int)
    shown, kinds = table.columns["shown"].astype(str), table.features[OBJECT_CLASS].astype(str)
    motions = read_arrays(data / "motions.npz", "motions of demonstrations")
    priors, idle, chances, right = ClassPriors({}), [], [], []
    at_grasp = []
    for row, name in enumerate(names):
        own = np.flatnonzero(motions["demonstration"] == name)
        if len(own) == 0:
            continue
        prior, tasks = priors.of(kinds[row], model.tasks), model.tasks
        start = intended(prior, affords[row])
        at_grasp.append((*tasks, "")[int(np.argmax(start))] == shown[row])
        filtered = _filtered(motions, int(own[0]), tasks, rng)
        meant = intended(prior, affords[row], filtered.log_evidence)
        best = int(np.argmax(meant))
        right.append((*tasks, "")[best] == shown[row])
        chances.append(float(meant[best]))
        for kind in _IDLE:
            still = _idle(kind, tasks, rng)
            idle.append(float(intended(prior, affords[row], still.log_evidence)[:-1].max()) > 0.5)
    return {
        "films_first_right_grasp": float(np.mean(at_grasp)),
        "films_first_right_1s": float(np.mean(right)),
        "films": len(right),
        "idle_called": float(np.mean(idle)),
        "ece": calibration_error(np.array(right, dtype=np.float64), np.array(chances)),
    }


def _filtered(
    motions: dict[str, Array], own: int, tasks: tuple[str, ...], rng: np.random.Generator
) -> MotionFilter:
    """Return the filter after a demonstration's motion up to a second after lift-off."""
    poses = pose_from_vector(motions["objects"][own].astype(np.float64))[: motions["frames"][own]]
    hand = pose_from_vector(motions["hand"][own].astype(np.float64))
    person = person_of(hand, motions["came_from"][own].astype(np.float64), motions["side"][own])
    held, result = HeldMotion(poses[0], person), MotionFilter(shipped_motion(), tasks)
    lifted = poses[:, 2, 3] > poses[0, 2, 3] + _LIFT
    end = int(np.argmax(lifted)) + round(_AFTER * RATE) if lifted.any() else len(poses)
    for frame, pose in enumerate(poses[: end + 1]):
        noise = make_pose(
            rotation_from_vector(rng.normal(0.0, _TURN, 3)) @ pose[:3, :3],
            pose[:3, 3] + rng.normal(0.0, _NOISE, 3),
        )
        result.step(frame / RATE, held.step(frame / RATE, noise))
    return result


def _idle(kind: str, tasks: tuple[str, ...], rng: np.random.Generator) -> MotionFilter:
    """Return the filter a second after the lift-off of a simulated motion that does nothing."""
    motion, result = held_motion(kind, rng), MotionFilter(shipped_motion(), tasks)
    lifted = motion.poses[:, 2, 3] > motion.poses[0, 2, 3] + _LIFT
    end = int(np.argmax(lifted)) + round(_AFTER * RATE)
    for frame, measures in enumerate(motion.measures()[: end + 1]):
        result.step(frame / RATE, measures)
    return result


def _update(model: TaskModel) -> float:
    """Return the CPU time of one frame of motion and its distribution, median [ms]."""
    motion = held_motion("pour", np.random.default_rng(0))
    tasks, seconds = model.tasks, []
    own = HeldIntention(shipped_motion(), tasks, ClassPriors({}), "a", "mug")
    held = HeldMotion(motion.poses[0], person_of(np.eye(4), None, "right"))
    for frame, pose in enumerate(motion.poses):
        started = time.thread_time_ns()
        own.take(frame / RATE, held.step(frame / RATE, pose))
        own.intends(np.zeros(len(tasks)))
        seconds.append((time.thread_time_ns() - started) * 1e-6)
    return float(np.median(seconds))
