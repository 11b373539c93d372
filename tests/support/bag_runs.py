"""Bags through the steps of the four packages in one process, wired as the nodes are."""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from intent_inference.intention.task_posterior import TaskPosterior
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.recipes.bag_run import BagRun, models_file
from intent_inference.workshop.training.labelled_table import GraspTable, read_grasps
from intent_perception.geometry.transforms import inverse, transform_points
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_tracking.scene.hand_model import HandModel

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "src/intent_inference/intent_inference/share/data/human.csv.gz"


def folders() -> list[Path]:
    """Return every bag with truth, committed or generated; a generated one wins."""
    found = {}
    for parent in (ROOT / "bags", ROOT / "bags" / "generated"):
        for truth in sorted(parent.glob("*/truth.npz")):
            found[truth.parent.name] = truth.parent
    return list(found.values())


def database_of(folder: Path) -> ObjectDatabase:
    """Return the objects that the bag is to be run with."""
    return ObjectDatabase.load(models_file(folder))


@dataclass(frozen=True)
class Verdict:
    """One demonstration of a bag against its truth; None where there is nothing to judge."""

    bag: str
    object: str
    task: str
    recognized: bool
    """Class and pose of the grasped object are right in the last answer before the touch."""
    pose_error: float
    """ADD or, for symmetric objects and siblings, ADD-S [m]; NaN where nothing is near."""
    found_as: str
    grasp_offset: int | None
    """Frames from the true moment to the reported one; None: no grasp or several."""
    rank: int | None
    """Place of the true task in the posterior, 1 = first."""
    class_rank: int
    """The same by the class alone."""


def judge(folder: Path, run: BagRun) -> list[Verdict]:
    """Return a verdict on each demonstration of a bag."""
    truth = dict(np.load(folder / "truth.npz"))
    clutter = ObjectDatabase.clutter()
    database = database_of(folder)
    verdicts = []
    for act in range(len(truth["task"])):
        name = str(truth["object_ids"][truth["grasped"][act]])
        known = name in database
        model = database[name] if known else clutter[name]
        error, found_as = recognition_error(truth, act, run, database, model)
        begin = int(truth["grasp_frame"][act - 1]) + 15 if act else 0
        end = int(truth["grasp_frame"][act]) + 30
        moments = [int(np.searchsorted(truth["stamps"], grasp.stamp)) for _, grasp in run.grasps]
        mine = [i for i, frame in enumerate(moments) if begin <= frame < end]
        task = str(truth["task"][act])
        offset, rank = None, None
        if len(mine) == 1:
            offset = moments[mine[0]] - int(truth["grasp_frame"][act])
            rank = _rank(run.posteriors[mine[0]], task)
        verdicts.append(
            Verdict(
                folder.name, name, task, bool(error < 0.1 * model.diameter), error, found_as,
                offset, rank, class_rank(model.object_class, task),
            )
        )  # fmt: skip
    return verdicts


def recognition_error(
    truth: dict[str, Any], act: int, run: BagRun, database: ObjectDatabase, model: ObjectModel
) -> tuple[float, str]:
    """Return the error of the grasped object's pose at the touch [m] and what it was taken for."""
    touch = int(truth["touch_frame"][act])
    before = [answer for answer in run.recognized if answer[0] <= touch]
    if not before:
        return float("nan"), "-"
    frame, answer = before[-1]
    T_true = truth["objects_camera"][frame, truth["grasped"][act]].astype(float)
    points, _, _ = model.mesh.sample_surface(400, np.random.default_rng(0))
    true_points = transform_points(T_true, points)
    best, name = float("nan"), "-"
    for item in answer.objects:
        if item.object_class != model.object_class:
            continue
        other = database[item.model]
        T_camera_object = inverse(answer.T_table_camera) @ item.T_table_object
        if item.model == model.name:
            turns = model.symmetry.transforms()
            placed = T_camera_object @ turns
            error = min(
                float(np.linalg.norm(transform_points(T, points) - true_points, axis=1).mean())
                for T in placed
            )
        else:
            surface, _, _ = other.mesh.sample_surface(3000, np.random.default_rng(1))
            tree = cKDTree(transform_points(T_camera_object, surface))
            error = float(tree.query(true_points)[0].mean())
        if not best < error:
            best, name = error, item.model
    return best, name


def joint_error(folder: Path, run: BagRun) -> tuple[float, float, int]:
    """Return mean joint error [m] where tracked, share of lost frames, and frames in view."""
    truth = dict(np.load(folder / "truth.npz"))
    errors, lost, seen = [], 0, 0
    for index, state in enumerate(run.states):
        if not truth["hand_in_view"][index]:
            continue
        seen += 1
        if not state.hand_tracked:
            lost += 1
            continue
        hand = HandModel.from_shape(state.hand_side, state.hand_shape)
        joints = transform_points(state.T_table_hand, hand.joint_positions(state.state[6:26]))
        camera = transform_points(inverse(state.T_table_camera), joints)
        errors.append(np.linalg.norm(camera - truth["joints_camera"][index], axis=1).mean())
    return float(np.mean(errors)) if errors else float("nan"), lost / max(seen, 1), seen


@lru_cache(maxsize=1)
def _training_data() -> GraspTable:
    return read_grasps(DATA)


def class_rank(object_class: str, task: str) -> int:
    """Return the place of a task among those that the training data show for the class."""
    grasps = _training_data()
    ours = np.array([str(c) for c in grasps.features[OBJECT_CLASS]]) == object_class
    counts: Counter[str] = Counter()
    for name, column in grasps.labels.items():
        counts[name] = int(np.nansum(np.asarray(column, dtype=float)[ours]))
    order = sorted(counts, key=lambda name: -counts[name])
    return order.index(task) + 1


def _rank(posterior: TaskPosterior, task: str) -> int:
    order = [posterior.tasks[i] for i in np.argsort(-posterior.probability)]
    return order.index(task) + 1
