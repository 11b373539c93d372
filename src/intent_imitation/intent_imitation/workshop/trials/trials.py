"""One random table after another: plan, judge the choice, carry out the grasp and its rivals."""

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from intent_imitation.demo.mesh_pictures import write_image
from intent_imitation.planner.affordance import task_chances
from intent_imitation.planner.grasp_library import LIBRARIES, GraspLibrary
from intent_imitation.planner.plan import GraspCandidate
from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.workshop.practice.table_merge import join_tables
from intent_imitation.workshop.trials.copying import copied_grasp
from intent_imitation.workshop.trials.execution import Outcome, World
from intent_imitation.workshop.trials.execution_pictures import picture_of_execution
from intent_imitation.workshop.trials.robot_tables import FITTING, Scene, SceneMaker, merged
from intent_imitation.workshop.trials.simulated_judge import Judge, LabelledGrasps, read_experience
from intent_inference import SHARE
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.quantisation.feature_table import Features
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.simulation.labels import label_grasp
from intent_inference.workshop.training.fitting import train
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.objects.database import CLUTTER, ObjectDatabase, ObjectModel

DATA = SHARE / "data"
TABLES = (DATA / "schunk.csv.gz", LIBRARIES / "tabletop.csv.gz")
"""Labelled grasps of the robot's hand: in free space, and of objects at rest."""
TASKS = tuple(FITTING)


@dataclass(frozen=True)
class TableTrial:
    """What happened on one table; None where it does not apply."""

    task: str
    fitting: bool
    """Some object affords the task."""
    unseen: bool
    """The chosen object (without a choice: one that fits) was not in training."""
    strange: bool
    """At least half of the objects on the table were not in training."""
    refused: bool
    """The planner said that nothing affords the task."""
    seconds: float
    """CPU time of planning [s]."""
    correct: bool | None = None
    """The chosen object affords the task (tables with a fitting object)."""
    class_only: bool | None = None
    """The object of the class most likely for the task affords it."""
    class_guessed: bool | None = None
    """The same where hidden classes are guessed from the shape."""
    held: bool | None = None
    """The executed grasp held through lift and task motion."""
    rule: bool | None = None
    """The executed grasp satisfies the task's label rule."""
    random_rule: float | None = None
    """Share of the chosen object's stable grasps that do."""
    copied_held: bool | None = None
    copied_rule: bool | None = None
    """The same for the human's posture, copied onto the chosen object."""


class Laboratory:
    """Everything that the trials share."""

    def __init__(self, seed: int, pictures: Path | None = None) -> None:
        """Train BN^R on half of the objects of each class and open the data sets.

        Args:
            seed: of the training.
            pictures: folder for a strip of pictures of every execution; None: no pictures.
        """
        self.pictures = pictures
        self.hand = GraspingHand.load("schunk")
        known, clutter = ObjectDatabase.load(), ObjectDatabase.load(CLUTTER)
        self.unseen = frozenset(
            model.name for model in known.models if int(model.name.rsplit("_", 1)[1]) % 2
        )
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.csv.gz"
            join_tables([path for path in TABLES if path.is_file()], file)
            table = read_grasps(file, list(TASKS))
            experience = read_experience(file, self.hand)
        practised = ~np.isin(table.columns["object_id"], list(self.unseen))
        self.model = train(table.select(practised), np.random.default_rng(seed))
        self.maker = SceneMaker(known, clutter, self.unseen)
        library = GraspLibrary.load()
        met = library.kinds.only([m.name for m in known.models if m.name not in self.unseen])
        library = replace(library, kinds=met)
        self.planner = GraspPlanner(merged(known, clutter), model=self.model, library=library)
        self.judge = Judge(self.hand, experience, self.planner.distance, self.planner.config)
        self.human = read_experience(DATA / "human.csv.gz", GraspingHand.load("human"))
        self._targets: dict[str, TaskObject] = {}

    def target(self, model: ObjectModel) -> TaskObject:
        """Return an object prepared for labelling."""
        if model.name not in self._targets:
            self._targets[model.name] = TaskObject(model)
        return self._targets[model.name]


def run_trial(
    laboratory: Laboratory, scene: Scene, rng: np.random.Generator, copying: bool = True
) -> TableTrial:
    """Plan on one table, judge the choice, carry out the grasp and the human's posture.

    Args:
        laboratory: what all trials share.
        scene: the table and the task.
        rng: of the human grasp to be copied.
        copying: whether to carry out the human's posture too.
    """
    objects = scene.recognized()
    laboratory.planner.start(objects)
    started = time.process_time()
    plan = laboratory.planner.plan(scene.task)
    seconds = time.process_time() - started
    affording = laboratory.judge.affording(scene)
    rivals = (
        class_choice(laboratory, scene, rng, told=True),
        class_choice(laboratory, scene, rng, told=False),
    )
    strange = 2 * sum(scene.unseen) >= len(scene.unseen)
    if not plan.grasps:
        hidden = any(u and a for u, a in zip(scene.unseen, affording, strict=True))
        blank = TableTrial(scene.task, any(affording), hidden, strange, True, seconds)
        if not any(affording):
            return blank
        told, guessed = (affording[rival] for rival in rivals)
        return replace(blank, correct=False, class_only=told, class_guessed=guessed)
    index = [item.id for item in objects.objects].index(plan.grasps[0].object_id)
    outcome, rule = executed(laboratory, scene, plan.grasps[0], index, "chosen")
    trial = TableTrial(
        scene.task,
        any(affording),
        scene.unseen[index],
        strange,
        False,
        seconds,
        held=outcome.held,
        rule=rule,
        random_rule=laboratory.judge.share(scene.models[index].name, scene.task),
    )
    if trial.fitting:
        told, guessed = (affording[rival] for rival in rivals)
        trial = replace(trial, correct=affording[index], class_only=told, class_guessed=guessed)
    copied = copied_posture(laboratory, scene, index, rng) if copying else None
    if copied is not None:
        copied_outcome, copied_rule = executed(laboratory, scene, copied, index, "copied")
        trial = replace(trial, copied_held=copied_outcome.held, copied_rule=copied_rule)
    return trial


def class_choice(laboratory: Laboratory, scene: Scene, rng: np.random.Generator, told: bool) -> int:
    """Return the object that the class alone would choose.

    Hidden classes are all alike (told), or taken to be those that the shapes suggest.
    """
    planner, column = laboratory.planner, laboratory.model.tasks.index(scene.task)
    chances = []
    for item in scene.recognized().objects:
        known: Features = {OBJECT_CLASS: np.array([item.object_class])}
        kinds = {} if told else planner.kinds(item)
        chances.append(task_chances(laboratory.model, known, kinds)[0, column])
    return int(np.argmax(np.array(chances) + 1e-6 * rng.random(len(chances))))


def executed(
    laboratory: Laboratory, scene: Scene, grasp: GraspCandidate, index: int, words: str
) -> tuple[Outcome, bool | None]:
    """Return what became of a grasp, and whether it satisfied the task's rule.

    Where the laboratory keeps pictures, a strip shows the execution; `words` name it.
    """
    with World(laboratory.hand, scene.models, scene.T_table_objects) as world:
        outcome = world.execute(grasp, index, scene.task)
    if laboratory.pictures is not None:
        title = f"{words}: {scene.models[index].name}, {scene.task}"
        strip = picture_of_execution(outcome, laboratory.hand, scene.models, index, title)
        laboratory.pictures.mkdir(parents=True, exist_ok=True)
        count = len(list(laboratory.pictures.glob("*.png")))
        write_image(laboratory.pictures / f"{count:03d}_{scene.task}_{words}.png", strip)
    labels = label_grasp(
        laboratory.target(scene.models[index]),
        laboratory.hand,
        outcome.T_object_hand,
        outcome.joints,
        outcome.contacts,
    )
    return outcome, labels[scene.task].afforded


def copied_posture(
    laboratory: Laboratory, scene: Scene, index: int, rng: np.random.Generator
) -> GraspCandidate | None:
    """Return the robot's copy of a human grasp for the task on an object of the same class.

    The human's object is the robot's own where a human grasp of it affords the task; None where no
    object of the class has one, or the robot's hand closes on nothing.
    """
    model = scene.models[index]
    own = [name for name in laboratory.human if name.rsplit("_", 1)[0] == model.object_class]
    names = [name for name in (model.name, *own) if _fitting_rows(laboratory.human, name, scene)]
    if not names:
        return None
    rows = _fitting_rows(laboratory.human, names[0], scene)
    human = laboratory.human[names[0]].T_object_hand[rows[int(rng.integers(len(rows)))]]
    pose = scene.T_table_objects[index]
    return copied_grasp(laboratory.target(model), laboratory.hand, human, pose, model.name)


def _fitting_rows(human: dict[str, LabelledGrasps], name: str, scene: Scene) -> list[int]:
    """Return the rows of human grasps of an object that afford the scene's task."""
    if name not in human:
        return []
    return [int(row) for row in np.flatnonzero(human[name].labels[scene.task])]
