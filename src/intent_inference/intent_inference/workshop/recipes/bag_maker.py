"""Rebuilds the bags, every one from its seed: `python bags/make.py [NAME...] [--seed S] [--list]`.

Each becomes a rosbag2 folder bags/generated/NAME with `truth.npz` inside. `--seed S` films all of
them with other people, rooms, grasps and noise (the folder's name then ends in the seed).
"""

import argparse
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.workshop.recipes.bag_recipes import RECIPES, ROBOT_TABLE, BagRecipe
from intent_inference.workshop.recipes.demonstrated_labels import label_row, task_labels
from intent_inference.workshop.recipes.own_models import own_models, write_models
from intent_inference.workshop.simulation.labels import TASKS
from intent_perception.bags.bag_files import BagWriter
from intent_perception.basics.own_folder import made_beside
from intent_perception.basics.progress import counted
from intent_perception.basics.safe_files import write_arrays
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    rotation_from_vector,
)
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_tracking.workshop.person.acting.person_grasp import Grasp
from intent_tracking.workshop.person.acting.script import Script, rehearse
from intent_tracking.workshop.person.body.person_hand import sample_hand
from intent_tracking.workshop.person.body.skin import make_skin
from intent_tracking.workshop.person.filming.film import (
    Set,
    Shot,
    all_seen,
    film,
    sample_set,
    still_life,
)


def make_bag(recipe: BagRecipe, seed: int, folder: Path) -> str:
    """Write one bag with its truth; return a line about it."""
    models = _models()
    scenario = recipe.scenario
    for attempt in range(6):
        rng = np.random.default_rng([seed, attempt])
        skin = make_skin(sample_hand(rng, scenario.side))
        try:
            script = rehearse(scenario, models, skin, rng, _suits)
        except ValueError as error:
            print(f"  {scenario.name}: {error}; another person tries", flush=True)
            continue
        scene = next((s for s in _sets(rng, script.edge) if all_seen(script, s)), None)
        if scene is None:
            print(f"  {scenario.name}: something is hidden; another person tries", flush=True)
            continue
        with made_beside(folder) as part:
            count = _write_film(part, recipe, script, scene, film(script, skin, scene, rng))
        return f"{scenario.name}: {count} frames, grasps at {script.grasp_frames}"
    raise ValueError(f"{scenario.name} cannot be shown with seed {seed}")


def _write_film(
    folder: Path, recipe: BagRecipe, script: Script, scene: Set, shots: Iterable[Shot]
) -> int:
    """Write the bag of a film with its truth; return the number of frames."""
    truths, stamps = [], []
    with BagWriter(folder, quality=80) as writer:
        for shot in shots:
            writer.write(shot.frame)
            stamps.append(shot.frame.stamp)
            truths.append((shot.joints_camera, shot.objects_camera, shot.hand_in_view))
    _write_truth(folder, recipe, script, np.array(stamps), truths, scene.T_table_camera)
    if recipe.own_models:
        write_models(folder, script.models)
    return len(stamps)


def _suits(model: ObjectModel, task: str, grasp: Grasp) -> bool:
    """Return whether the label rules do not deny that the grasp affords the task."""
    return task_labels(model, grasp)[task].afforded is not False


def _sets(rng: np.random.Generator, edge: float) -> list[Set]:
    return [sample_set(rng, edge) for _ in range(8)]


def _models() -> dict[str, ObjectModel]:
    everything = [*ObjectDatabase.load(), *ObjectDatabase.clutter(), *own_models()]
    return {model.name: model for model in everything}


def _write_truth(
    folder: Path,
    recipe: BagRecipe,
    script: Script,
    stamps: np.ndarray,
    truths: list[tuple[Any, ...]],
    pose: np.ndarray,
) -> None:
    """Write truth.npz: joints_camera (F, 21, 3), objects_camera (F, N, 4, 4) and the acts."""
    acts = [(i, act) for i, act in enumerate(recipe.scenario.acts) if act.grasped]
    frames = np.array(script.grasp_frames, dtype=np.int64)
    arrays = dict(
        stamps=stamps,
        joints_camera=np.array([t[0] for t in truths], dtype=np.float32),
        objects_camera=np.array([t[1] for t in truths], dtype=np.float32),
        hand_in_view=np.array([t[2] for t in truths]),
        hand_side=np.array(recipe.scenario.side),
        object_ids=np.array([model.name for model in script.models]),
        object_classes=np.array([model.object_class for model in script.models]),
        T_table_camera=pose,
        task=np.array([act.task for _, act in acts], dtype=str),
        grasp_frame=frames,
        grasp_stamp=stamps[frames],
        touch_frame=np.array(script.touch_frames, dtype=np.int64),
        grasped=np.array([i for i, _ in acts], dtype=np.int64),
        T_object_hand=script.grips,
        label_names=np.array(TASKS),
        labels=np.array(
            [label_row(script.models[i], g) for (i, _), g in zip(acts, script.grasps, strict=True)]
        ).reshape(-1, len(TASKS)),
    )
    write_arrays(folder / "truth.npz", arrays)


def make_robot_table(seed: int, folder: Path) -> str:
    """Write the short bag of the robot's own table."""
    rng = np.random.default_rng([seed, 77])
    models = _models()
    chosen = tuple(models[name] for name in ROBOT_TABLE)
    scene = sample_set(rng, 0.40)
    poses = []
    for x, model in zip((-0.20, 0.02, 0.20), chosen, strict=True):
        turn = rotation_from_vector(np.array([0, 0, rng.uniform(-np.pi, np.pi)]))
        spot = np.array([x, rng.uniform(-0.06, 0.08), 0.0])
        poses.append(make_pose(turn, spot) @ model.stable_poses[0])
    with made_beside(folder) as part:
        count = _write_still(part, chosen, np.array(poses), scene, rng)
    return f"robot_table: {count} frames"


def _write_still(
    folder: Path,
    models: tuple[ObjectModel, ...],
    poses: np.ndarray,
    scene: Set,
    rng: np.random.Generator,
) -> int:
    """Write the bag of a table without a hand, with its truth; return the number of frames."""
    stamps = []
    with BagWriter(folder, quality=80) as writer:
        for frame, _ in still_life(models, poses, scene, 8, rng):
            writer.write(frame)
            stamps.append(frame.stamp)
    count = len(stamps)
    objects = np.tile(inverse(scene.T_table_camera) @ poses, (count, 1, 1, 1))
    none = np.zeros(0, dtype=np.int64)
    arrays = dict(
        stamps=np.array(stamps),
        joints_camera=np.full((count, 21, 3), np.nan, np.float32),
        objects_camera=objects.astype(np.float32), hand_in_view=np.zeros(count, bool),
        hand_side=np.array("none"), object_ids=np.array(ROBOT_TABLE),
        object_classes=np.array([m.object_class for m in models]),
        T_table_camera=scene.T_table_camera, task=np.zeros(0, dtype="<U1"), grasp_frame=none,
        grasp_stamp=none, touch_frame=none, grasped=none, T_object_hand=np.zeros((0, 4, 4)),
    )  # fmt: skip
    write_arrays(folder / "truth.npz", arrays)
    return count


def main(generated: Path) -> None:
    """Make the bags named on the command line, or all, by default in the given folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="bags to make; default: all")
    parser.add_argument("--seed", type=int, help="film with this seed instead of each bag's own")
    parser.add_argument("--list", action="store_true", help="only list the bags")
    parser.add_argument("--out", type=Path, default=generated, help="folder for the bags")
    options = parser.parse_args()
    known = {recipe.scenario.name: recipe for recipe in RECIPES}
    names = options.names or [*known, "robot_table"]
    unknown = sorted(set(names) - {*known, "robot_table"})
    if unknown:
        parser.error(
            f"no bag is called {', '.join(unknown)}; known: {', '.join(known)}, robot_table"
        )
    if options.list:
        for name in names:
            acts = known[name].scenario.acts if name in known else ()
            print(name, *(f"{act.object} {act.task}" for act in acts), sep="\t")
        return
    for name in counted("bag", names):
        start = time.process_time()
        folder = options.out / (name if options.seed is None else f"{name}_{options.seed}")
        if name == "robot_table":
            line = make_robot_table(3 if options.seed is None else options.seed, folder)
        else:
            seed = known[name].seed
            if options.seed is not None:
                seed = 1000 * options.seed + seed
            line = make_bag(known[name], seed, folder)
        size = sum(f.stat().st_size for f in folder.iterdir()) / 1e6
        print(f"{line}, {size:.1f} MB, {time.process_time() - start:.0f} s", flush=True)
