"""Command: Fig. 1 from a real run: copying the human's posture against goal-directed imitation.

python -m intent_imitation.copying_picture --out docs/copying.png [--task pouring] [--seed S]

A human grasp that affords the task is drawn from the simulated ones. Above, the robot's hand takes
the human's posture on the object that looks most like the human's; below, BN^R chooses object and
grasp for the same task. Both are carried out in physics, by contact and friction alone.
"""

import argparse
from pathlib import Path

import numpy as np

from intent_imitation.demo.hand_mesh import hand_mesh
from intent_imitation.demo.mesh_pictures import DrawnBody, Image, Tag, annotate, studio, write_image
from intent_imitation.demo.panels import MARKED_COLOR, OBJECT_COLORS, mosaic
from intent_imitation.planner.plan import GraspCandidate
from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.workshop.trials.copying import copied_grasp
from intent_imitation.workshop.trials.execution import World
from intent_imitation.workshop.trials.execution_pictures import STRIP_CAMERA, picture_of_execution
from intent_imitation.workshop.trials.robot_tables import FITTING, Scene, merged
from intent_imitation.workshop.trials.simulated_judge import LabelledGrasps, read_experience
from intent_imitation.workshop.trials.trials import DATA
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.labels import label_grasp
from intent_perception.basics.arrays import Array
from intent_perception.basics.late_module import need
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.transforms import look_at, make_pose, rotation_from_vector
from intent_perception.objects.database import CLUTTER, ObjectDatabase, ObjectModel

_SKIN = (0.91, 0.72, 0.60)
_TABLE_CAMERA = Camera(1216, 460, 1150.0, 1150.0, 607.5, 229.5)


def picture(human_object: str, robot_table: tuple[str, ...], task: str, seed: int) -> Image:
    """Return the figure: the human and the robot's table, then a row for each execution.

    Args:
        human_object: name of the object in the human's hand.
        robot_table: names of the robot's objects.
        task: what the human is up to.
        seed: of the table and of the human's grasp.

    Raises:
        ValueError: if no simulated human grasp of the object affords the task, or the robot finds
            no object for it.
    """
    rng = np.random.default_rng(seed)
    database = merged(ObjectDatabase.load(), ObjectDatabase.load(CLUTTER))
    human = read_experience(DATA / "human.csv.gz", GraspingHand.load("human"))[human_object]
    rows = np.flatnonzero(human.labels[task])
    if len(rows) == 0:
        raise ValueError(f"no simulated human grasp of {human_object} affords {task}")
    row = int(rng.choice(rows))
    models = tuple(database[name] for name in robot_table)
    scene = Scene(task, models, _row_of(models, rng), (False,) * len(models))
    hand, planner = GraspingHand.load("schunk"), GraspPlanner(database)
    planner.start(scene.recognized())
    plan = planner.plan(task)
    if not plan.grasps:
        raise ValueError(f"nothing on the robot's table affords {task}")
    kind = database[human_object].object_class
    index = next((k for k, model in enumerate(models) if model.object_class == kind), 0)
    copied = copied_grasp(
        TaskObject(models[index]),
        hand,
        human.T_object_hand[row],
        scene.T_table_objects[index],
        models[index].name,
    )
    chosen = [item.id for item in scene.recognized().objects].index(plan.grasps[0].object_id)
    first = _first_row(database[human_object], human, row, task)
    gap = np.full((first.shape[0], 8, 3), 255, dtype=np.uint8)
    strips = [np.hstack([first, gap, _table_seen(scene, chosen)])]
    if copied is not None:
        strips.append(_strip(scene, hand, copied, index, "posture copied"))
    strips.append(_strip(scene, hand, plan.grasps[0], chosen, "goal imitated"))
    width = max(image.shape[1] for image in strips)
    return np.vstack([_widened(image, width) for image in strips])


def _first_row(model: ObjectModel, human: LabelledGrasps, row: int, task: str) -> Image:
    """Draw the human's grasp from two sides."""
    table = GraspingHand.load("human").table
    rest = model.stable_poses[0]
    bodies = [
        DrawnBody(model.mesh, rest, OBJECT_COLORS[0]),
        DrawnBody(
            hand_mesh(table, human.grasp_joints[row]), rest @ human.T_object_hand[row], _SKIN
        ),
    ]
    middle = rest[:3, 3] + np.array([0.0, 0.0, 0.03])
    tiles = []
    for number, angle in enumerate((0.6, 2.7)):
        eye = middle + np.array([0.6 * np.cos(angle), 0.6 * np.sin(angle), 0.3])
        image = studio(STRIP_CAMERA, look_at(eye, middle), bodies)
        words = f"the human: {task}" if number == 0 else "the same, from behind"
        tiles.append(annotate(image, [Tag(words, (1.0, 1.0, 1.0), (0.0, 0.0))], size=0.65))
    return mosaic(tiles, len(tiles))


def _table_seen(scene: Scene, chosen: int) -> Image:
    """Draw the robot's table, the object that it chooses in green."""
    bodies = [
        DrawnBody(model.mesh, pose, MARKED_COLOR if k == chosen else OBJECT_COLORS[k])
        for k, (model, pose) in enumerate(zip(scene.models, scene.T_table_objects, strict=True))
    ]
    middle = scene.T_table_objects[:, :3, 3].mean(axis=0)
    image = studio(_TABLE_CAMERA, look_at(middle + np.array([0.0, -0.9, 0.5]), middle), bodies)
    words = "the robot's table, its choice in green"
    return annotate(image, [Tag(words, (1.0, 1.0, 1.0), (0.0, 0.0))], size=0.65)


def _strip(
    scene: Scene, hand: GraspingHand, grasp: GraspCandidate, index: int, words: str
) -> Image:
    """Carry out a grasp and draw it, with what the task's rule says of it."""
    with World(hand, scene.models, scene.T_table_objects) as world:
        outcome = world.execute(grasp, index, scene.task)
    target = TaskObject(scene.models[index])
    label = label_grasp(target, hand, outcome.T_object_hand, outcome.joints, outcome.contacts)
    verdict = "fits the task" if label[scene.task].afforded else "does not fit the task"
    text = f"{words}: {verdict}"
    return picture_of_execution(outcome, hand, scene.models, index, text)


def _row_of(models: tuple[ObjectModel, ...], rng: np.random.Generator) -> Array:
    """Return poses (N, 4, 4) of objects in a row, each turned about the vertical at random."""
    poses = []
    for index, model in enumerate(models):
        turn = rotation_from_vector([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
        place = [0.28 * (index - 0.5 * (len(models) - 1)), 0.0, 0.0]
        poses.append(make_pose(turn, place) @ model.stable_poses[0])
    return np.array(poses)


def _widened(image: Image, width: int) -> Image:
    padding = ((0, 8), (0, width - image.shape[1]), (0, 0))
    return np.asarray(np.pad(image, padding, constant_values=255), dtype=np.uint8)


def main() -> None:
    """Draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, required=True, help="picture to write")
    parser.add_argument("--task", choices=sorted(FITTING), default="pouring")
    parser.add_argument("--human", default="mug_0", help="object in the human's hand")
    parser.add_argument("--table", default="hammer_0,toy_car,mug_5", help="the robot's objects")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    need("pybullet")
    table = tuple(options.table.split(","))
    write_image(options.out, picture(options.human, table, options.task, options.seed))
