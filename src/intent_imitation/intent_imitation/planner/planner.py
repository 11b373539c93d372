"""From the inferred task to an object and a grasp for the robot's own hand (Sec. IV-D, Fig. 6).

o* = argmax p(o | t*, BN^R) over the objects on the robot's table, then a* = argmax
p(a | o*, t*, BN^R) over preplanned grasps of o*. With every object and every preplanned grasp
equally likely before the task is known, p(o | t*) is p(t* | o) scaled to sum to one over the table,
and a* is the grasp with the greatest p(t* | o*, a); BN^R answers both. We weigh p(o | t*) with the
second, and pass over objects without a reachable grasp for the task: the robot must be able to act.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

import numpy as np

from intent_imitation.planner.affordance import task_chances
from intent_imitation.planner.grasp_library import GraspLibrary
from intent_imitation.planner.library_hypotheses import HypothesisSource
from intent_imitation.planner.plan import GraspCandidate, GraspPlan, ObjectChoice
from intent_imitation.planner.planner_config import PlannerConfig
from intent_imitation.planner.preconditions import fits_pose
from intent_imitation.planner.reachable import Reachable
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.intention.task_posterior import TaskPosterior
from intent_inference.network.model_file import load_model, shipped_model
from intent_inference.network.task_model import TaskModel
from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model_memory import ModelMemory
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_perception.recognition.rehearsal_scene import rehearsal_object


@dataclass(frozen=True, eq=False)
class _Option:
    """One object with what BN^R says of it for the task at hand."""

    id: str
    object_class: str
    chance: float
    """p(t* | o)."""
    grasps: tuple[GraspCandidate, ...]
    """Reachable grasps, best first."""
    judged: bool = True
    """Whether BN^R was asked about it."""

    @property
    def best(self) -> float:
        """p(t* | o, a) of the best reachable grasp, 0 without one."""
        return max((grasp.score_parts["task"] for grasp in self.grasps), default=0.0)


class GraspPlanner:
    """Answers a task with the fitting object on the robot's table and ranked grasps of it."""

    def __init__(
        self,
        database: ObjectDatabase,
        config: PlannerConfig | None = None,
        model: TaskModel | None = None,
        library: GraspLibrary | None = None,
    ) -> None:
        """Take what the robot knows.

        Args:
            database: objects that can be recognised.
            config: thresholds, and the files of library and network.
            model: BN^R; default: as configured.
            library: preplanned grasps; default: as configured.
        """
        self._config = config or PlannerConfig()
        if library is None:
            library = GraspLibrary.load(_file(self._config.library))
        if model is None:
            file = _file(self._config.network)
            model = load_model(file) if file else shipped_model(library.hand)
        self._model = model
        self._hand = GraspingHand.load(library.hand)
        self._source = HypothesisSource(database, library, self._hand, self._config.unshaken)
        self._reachable = Reachable(self._hand, self._source, self._config)
        self._example = database.example
        self._objects: RecognizedObjects | None = None
        self._working = Lock()
        self.forget()
        self._chances = ModelMemory[dict[str, tuple[Array, Array]]](database, lambda _: {})

    def start(self, objects: RecognizedObjects) -> None:
        """Take what was recognised on the robot's table; it holds until the next start.

        What does not depend on the task is worked out here, each object once: signed distance,
        features, and what BN^R says of the object and of each of its grasps. What BN^R says of
        things of no known class waits until nothing else affords a task: theirs takes seconds.
        """
        self._objects = objects
        for item in objects.objects:
            if self._source.knows(item.model):
                self._consider(item.model, item.object_class)

    def prepare(self) -> None:
        """Work out, before any is seen, what is asked of objects that the library does not hold.

        It takes a second for each, and may run in a thread beside the others.
        """
        for name in self._source.unpractised():
            self._consider(name, self._source.model(name).object_class)

    def _consider(self, model: str, object_class: str) -> None:
        with self._working:
            self._source.distance(model)
            if object_class:
                self._chance(model, object_class)

    def rehearse(self) -> None:
        """Plan on an invented table, so that the first real plan finds everything loaded."""
        self.start(RecognizedObjects(0, (rehearsal_object(self._example),), np.eye(4)))
        for task in self._model.tasks:
            self.plan(task)
        self._objects = None

    def rehearse_unpractised(self) -> None:
        """Go once through what only objects without a library need: set-up has it compiled."""
        self._source.rehearse(self._example)

    @property
    def config(self) -> PlannerConfig:
        """Thresholds and gaps."""
        return self._config

    @property
    def hand(self) -> GraspingHand:
        """The robot's hand."""
        return self._hand

    def kinds(self, item: RecognizedObject) -> Mapping[str, float]:
        """Return p(class) of a recognised object: as told, or as its shape suggests."""
        return self._source.kinds(item.model, item.object_class)

    def distance(self, model: str) -> SignedDistance:
        """Return the signed distance of a model's mesh, in its object frame."""
        return self._source.distance(model)

    def forget(self) -> None:
        """Forget which task was planned for, so that the next posterior is answered anew."""
        self._answered: tuple[str, str] | None = None

    def step(self, posterior: TaskPosterior) -> GraspPlan | None:
        """Return a plan for a grasp, or word that the last one no longer holds.

        None: nothing new, or not sure yet. By default (`acts_on` grasp) a stable grasp is answered
        once, by a plan for the best task at that moment. Where `acts_on` is motion, what the person
        does afterwards counts as well: the plan of another task takes the place of one, and where
        no task is meant any more the plan is cancelled.
        """
        if posterior.preliminary or posterior.stage == "PUT_BACK":
            self.forget()  # the hand reaches anew
            return None
        if self._objects is None:
            return None
        if self._config.acts_on == "motion":
            return self._intended(posterior)
        answered = self._answered is not None and self._answered[0] == posterior.object_id
        if posterior.stage != "GRASP" or posterior.best is None or answered:
            return None
        return self._answer(posterior, posterior.best)

    def _intended(self, posterior: TaskPosterior) -> GraspPlan | None:
        """Return what the person's intention asks for, given what was answered before."""
        meant = dict(zip(posterior.tasks, posterior.intends.tolist(), strict=False))
        task, before = posterior.best, self._answered
        if task is not None and meant[task] < self._config.intention:
            task = None
        if before is not None and before[0] == posterior.object_id:
            holds = meant.get(before[1], 0.0)
            if task == before[1]:
                return None
            if task is None and holds < 0.5 * self._config.intention:
                self._answered = (posterior.object_id, "")
                return self._cancelled(before[1], posterior.stamp) if before[1] else None
            if task is None or meant[task] < holds + self._config.overtake:
                return None
        return None if task is None else self._answer(posterior, task)

    def _answer(self, posterior: TaskPosterior, task: str) -> GraspPlan:
        self._answered = (posterior.object_id, task)
        return self.plan(task, posterior.stamp)

    def _cancelled(self, task: str, stamp: int) -> GraspPlan:
        names = self._hand.table.joint_names
        return GraspPlan(stamp, task, False, (), (), self._hand.name, names, cancelled=True)

    def plan(self, task: str, stamp: int = 0) -> GraspPlan:
        """Return the plan for a task on the table of the last start.

        Raises:
            ValueError: if there was no start or BN^R does not know the task.
        """
        if self._objects is None:
            raise ValueError("expected start(objects) before plan(task)")
        if task not in self._model.tasks:
            raise ValueError(f"BN^R knows the tasks {self._model.tasks}, not {task!r}")
        options = self._options(task, of_class=True)
        if not any(self._affords(option) for option in options):
            options = self._options(task, of_class=False)
        options.sort(
            key=lambda option: (
                not self._affords(option),
                not option.judged,
                -option.chance * (option.best if self._affords(option) else 1.0),
            )
        )
        total = sum(option.chance for option in options)
        judged = sum(option.judged for option in options)
        choices = tuple(
            ObjectChoice(
                option.id,
                option.object_class,
                _share(option.chance, total, judged) if option.judged else float("nan"),
                self._affords(option),
            )
            for option in options
        )
        fit = [option for option in options if self._affords(option)]
        return GraspPlan(
            stamp,
            task,
            bool(options) and not fit,
            choices,
            fit[0].grasps[: self._config.grasps] if fit else (),
            self._hand.name,
            self._hand.table.joint_names,
        )

    def _options(self, task: str, of_class: bool) -> list[_Option]:
        """Return all objects; unknown ones, or those of no class if asked, are not judged.

        Args:
            task: what they shall serve.
            of_class: whether only objects of a known class are looked at.
        """
        assert self._objects is not None  # plan() has checked it
        return [
            self._option(index, task)
            if self._source.knows(item.model) and (item.object_class or not of_class)
            else _Option(item.id, item.object_class, 0.0, (), judged=False)
            for index, item in enumerate(self._objects.objects)
        ]

    def _affords(self, option: _Option) -> bool:
        config = self._config
        return option.chance >= config.minimum_object and option.best >= config.minimum_grasp

    def _option(self, index: int, task: str) -> _Option:
        """Return one object with its reachable grasps for the task."""
        assert self._objects is not None  # plan() has checked it
        item = self._objects.objects[index]
        hypotheses = self._source.of(item.model, item.object_class)
        column = self._model.tasks.index(task)
        of_object, of_grasps = self._chance(item.model, item.object_class)
        chance = float(of_object[column])
        if not self._fits_pose(index, task):
            return _Option(item.id, item.object_class, chance, ())
        grasps = self._reachable.best(self._objects, index, hypotheses, of_grasps[:, column])
        return _Option(item.id, item.object_class, chance, grasps)

    def _chance(self, model: str, object_class: str) -> tuple[Array, Array]:
        """Return p(t | o) (T,) and p(t | o, a) (G, T) of an object and its hypotheses."""
        known = self._chances[model]
        if object_class not in known:
            hypotheses = self._source.of(model, object_class)
            of_grasps = np.zeros((0, len(self._model.tasks)))
            kinds = self._source.kinds(model, object_class)
            if len(hypotheses.grasps) > 0:
                of_grasps = task_chances(self._model, hypotheses.features, kinds)
            of_object = task_chances(self._model, hypotheses.object_features, kinds)[0]
            known[object_class] = of_object, of_grasps
        return known[object_class]

    def _fits_pose(self, index: int, task: str) -> bool:
        """Return whether an object, as it stands, can serve the task whatever the grasp."""
        assert self._objects is not None
        item = self._objects.objects[index]
        return fits_pose(
            task,
            self._source.model(item.model),
            item.T_table_object,
            self._source.distance(item.model),
            annotated=bool(item.object_class),
        )


def _share(chance: float, total: float, count: int) -> float:
    """Return a chance as a share of all; where none has any, they are equally likely."""
    return chance / total if total > 0.0 else 1.0 / count


def _file(name: str) -> Path | None:
    return Path(name) if name else None
