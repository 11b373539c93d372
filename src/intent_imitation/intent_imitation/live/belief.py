"""What the graph says about one moment, gathered from its results as they come."""

from collections import deque
from dataclasses import dataclass
from typing import Any

from intent_imitation.planner.plan import GraspPlan
from intent_inference.intention.task_posterior import TaskPosterior
from intent_tracking.scene.scene_state import SceneState

_NANO = 1e-9
_WORDS = {
    "REACH": "reaches for",
    "GRASP": "has grasped",
    "TRANSPORT": "carries",
    "ACT": "uses",
    "PUT_BACK": "puts back",
}
"""What the hand does with the object, at each stage of a task."""


@dataclass(frozen=True)
class Chance:
    """One bar of the picture."""

    task: str
    probability: float


@dataclass(frozen=True, eq=False)
class Belief:
    """What is believed at the moment of a frame."""

    state: SceneState | None
    """Hand and objects; None: the tracker says nothing."""
    stage: str
    """What the hand does, in words."""
    object_name: str
    """What it reaches for or holds, "" for nothing."""
    chances: tuple[Chance, ...]
    """Of each task."""
    current: bool
    """False: the chances are of an earlier moment."""
    preliminary: bool
    """The hand still reaches: the chances are a forecast."""
    answer: str
    """What the robot would do, "" while it has no answer."""


@dataclass(frozen=True)
class Point:
    """One posterior on the way of time."""

    seconds: float
    """Since the first one [s]."""
    chances: tuple[float, ...]
    preliminary: bool

    def as_row(self) -> list[float]:
        """Return time, 1 where it is a forecast, and the chances."""
        chances = [round(chance, 4) for chance in self.chances]
        return [round(self.seconds, 3), int(self.preliminary), *chances]


class BeliefKeeper:
    """Remembers the last result of each kind, and how the posterior went."""

    def __init__(self, minutes: float = 2.0) -> None:
        """Begin.

        Args:
            minutes: of the posterior that are kept [min].
        """
        self._seconds = 60.0 * minutes
        self.forget()

    def forget(self) -> None:
        """Begin anew, as with another recording."""
        self._state: SceneState | None = None
        self._posterior: TaskPosterior | None = None
        self._plan: GraspPlan | None = None
        self._first = -1
        self._grasps: deque[float] = deque(maxlen=20)
        self._points: deque[Point] = deque(maxlen=4000)

    def note_state(self, state: SceneState) -> None:
        """Take a scene state; one that is seconds older than the last begins anew."""
        if self._state is not None and state.stamp < self._state.stamp - 1e9:
            self.forget()
        self._state = state
        if self._first < 0:
            self._first = state.stamp

    def lose_track(self) -> None:
        """Take note that the tracker says nothing any more."""
        self._state = None

    def note_posterior(self, posterior: TaskPosterior) -> None:
        """Take a posterior."""
        if self._posterior is not None and posterior.tasks != self._posterior.tasks:
            self._points.clear()  # another model
        if posterior.preliminary:
            self._plan = None
        before, self._posterior = self._posterior, posterior
        values = shown_chances(posterior)[1]
        if self._first < 0 or posterior.stamp < self._first:
            self._first = posterior.stamp
        seconds = (posterior.stamp - self._first) * _NANO
        held = (
            before is not None
            and not before.preliminary
            and before.object_id == posterior.object_id
            and before.stamp < posterior.stamp
        )
        if not posterior.preliminary and not held:
            self._grasps.append(seconds)
        self._points.append(Point(seconds, values, posterior.preliminary))
        while self._points[0].seconds < seconds - self._seconds:
            self._points.popleft()

    def note_plan(self, plan: GraspPlan) -> None:
        """Take the robot's answer."""
        self._plan = plan

    @property
    def belief(self) -> Belief:
        """What is believed now."""
        posterior, state = self._posterior, self._state
        seen = state is not None and state.hand_visible
        chances: tuple[Chance, ...] = ()
        if posterior is not None:
            chances = tuple(map(Chance, *shown_chances(posterior)))
        return Belief(
            state=state,
            stage=self._stage_in_words(),
            object_name="" if posterior is None or not seen else _spoken(posterior.object_id),
            chances=chances,
            current=seen,
            preliminary=posterior is not None and posterior.preliminary,
            answer=_answer(self._plan),
        )

    def _stage_in_words(self) -> str:
        state, posterior = self._state, self._posterior
        if state is None:
            return "unknown, the tracker is silent"
        if not state.hand_visible:
            return "not in view"
        if state.hand_lost:
            return "lost"
        if posterior is None or (state.stamp - posterior.stamp) * _NANO > 1.0:
            held = posterior is not None and not posterior.preliminary
            return _WORDS["GRASP"] if held else "in view"
        return _WORDS[posterior.stage]

    def as_json(self) -> dict[str, Any]:
        """Return the belief and the posterior over time for the page; all finite numbers."""
        belief, posterior = self.belief, self._posterior
        now = 0.0
        if self._state is not None:
            now = max((self._state.stamp - self._first) * _NANO, 0.0)
        return {
            "now": round(now, 3),
            "stage": belief.stage,
            "object": belief.object_name,
            "current": belief.current,
            "preliminary": belief.preliminary,
            "answer": belief.answer,
            "tasks": [] if posterior is None else list(shown_chances(posterior)[0]),
            "grasps": [round(second, 3) for second in self._grasps],
            "points": [point.as_row() for point in self._points],
        }


def shown_chances(posterior: TaskPosterior) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return names and probabilities of what is shown: what the person means."""
    return posterior.meanings, tuple(float(p) for p in posterior.intends)


def _answer(plan: GraspPlan | None) -> str:
    if plan is None:
        return ""
    if not plan.grasps:
        return plan.refusal
    return f"takes {_spoken(plan.grasps[0].object_id)} for {plan.task}"


def _spoken(name: str) -> str:
    return name.replace("_", " ")
