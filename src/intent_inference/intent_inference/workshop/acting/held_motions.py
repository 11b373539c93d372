"""Motions of held objects, drawn with a wide variety of people, directions, speeds and layouts.

No pixel, hand or mesh: the pose of a held object over time, in a frame whose x is away from the
person and whose y is the side of the other hand. What is not known of people is drawn widely
instead of being fitted to recordings.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from intent_inference.motion.measures import HeldMotion, Person
from intent_inference.motion.motion_network import NOTHING, RATE, STEPS
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_vector

GRASP, HOLD, CARRY, ACT, BACK = range(len(STEPS))
_JITTER, _JITTER_TURN = 0.002, 0.02
"""Of a tracked object [m], [rad]."""
_USUAL_PACE = -0.2
"""Logarithm of the median factor on all durations."""
_PAUSES = 0.01
"""So often something is lifted a little and held there before it is carried on: the grip is not
firm yet, or somebody waits."""
_INTO = 0.4
"""So often what is poured into stands on the table and is known: as often it is in the other hand,
a sink or a pot that nobody has practised with."""
_FACING = 0.4
"""Error of the direction away from the person, as a forearm tells it [rad]."""


@dataclass(frozen=True, eq=False)
class Motion:
    """One demonstration after contact."""

    kind: str
    manner: str
    """How this person moves: the network has a component for each kind in each manner."""
    poses: Array
    """(F, 4, 4) of the object."""
    steps: Array
    """(F,) index of the step."""
    other: Array
    """(2,) place of another object on the table [m], NaN: none."""
    facing: float
    """How far the direction to the person is estimated wrong [rad]."""

    def measures(self) -> Array:
        """Return the measures (F, M) as they are computed of a tracked object."""
        c, s = np.cos(self.facing), np.sin(self.facing)
        person = Person(np.array([c, s, 0.0]), np.array([-s, c, 0.0]))
        held = HeldMotion(self.poses[0], person)
        return np.array([
            held.step(frame / RATE, pose, float(np.linalg.norm(pose[:2, 3] - self.other)))
            for frame, pose in enumerate(self.poses)
        ])  # fmt: skip


class _Stage:
    """Collects the poses of one motion."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.pace = float(np.exp(rng.normal(_USUAL_PACE, 0.35)))
        self.size = float(rng.uniform(0.75, 1.3))
        self.body = float(rng.uniform(0.30, 0.70))
        """How far behind the object the person is [m]."""
        self.upright = bool(rng.random() < 0.5)
        """A full vessel is kept upright; other things are turned at will."""
        self.steady = bool(rng.random() < 0.5)
        """Some carry things as they stood, others turn them on the way."""
        self.mouth = float(rng.uniform(0.22, 0.80))
        """How high above the object: people sit at tables or stand before them [m]."""
        self.other = np.full(2, np.nan)
        if rng.random() < 0.6:
            self.other = rng.uniform(0.12, 0.5) * _circle(rng)
        self.place, self.turn = np.zeros(3), np.eye(3)
        self.poses: list[Array] = []
        self.steps: list[int] = []
        self.rest(rng.uniform(0.0, 0.5), GRASP)

    @property
    def manner(self) -> str:
        """How this person moves things."""
        pace = "quick" if self.pace < np.exp(_USUAL_PACE) else "slow"
        return f"{'steady' if self.steady else 'turning'}, {pace}"

    def rest(self, seconds: float, step: int) -> None:
        """Stay for so long."""
        self.go(seconds * self.pace, self.place, self.turn, step)

    def go(self, seconds: float, place: Array, turn: Array, step: int) -> None:
        """Move smoothly to a place and turn."""
        frames = max(1, round(seconds * RATE))
        start, first = self.place.copy(), self.turn.copy()
        way = _vector(turn @ first.T)
        for k in range(1, frames + 1):
            s = k / frames
            s = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
            self.put(start + s * (place - start), rotation_from_vector(s * way) @ first, step)
        self.place, self.turn = np.asarray(place, dtype=np.float64), turn

    def put(self, place: Array, turn: Array, step: int) -> None:
        """Append one frame, with the noise of a tracker."""
        noise = rotation_from_vector(self.rng.normal(0.0, _JITTER_TURN, 3))
        self.poses.append(make_pose(noise @ turn, place + self.rng.normal(0.0, _JITTER, 3)))
        self.steps.append(step)

    def carry(self, out: Array, tilt: Array, step: int = CARRY) -> None:
        """Lift and carry to an offset (3,) with a turn, at a person's pace."""
        way = float(np.linalg.norm(out - self.place))
        seconds = self.pace * self.rng.uniform(0.45, 1.0) * (0.6 + 1.6 * way)
        if step == CARRY and self.steps[-1] == GRASP and self.rng.random() < _PAUSES:
            up = self.place.copy()
            up[2] += self.size * self.rng.uniform(0.03, 0.15)
            self.go(self.pace * self.rng.uniform(0.3, 0.8), up, self.turn, HOLD)
            self.rest(self.rng.uniform(0.1, 1.0), HOLD)
        elif self.rng.random() < 0.3:  # first straight up
            up = self.place.copy()
            up[2] += self.rng.uniform(0.3, 1.0) * max(out[2], 0.04)
            self.go(0.4 * seconds, up, self.turn, step)
        self.go(seconds, out, tilt, step)

    def swing(self, seconds: float, way: Array, turn: Array, rate: float) -> None:
        """Oscillate by a way (3,) [m] and a turn (3,) [rad] about where it is."""
        place, first = self.place.copy(), self.turn.copy()
        for k in range(max(1, round(seconds * RATE))):
            s = np.sin(2.0 * np.pi * rate * k / RATE)
            self.put(place + s * way, rotation_from_vector(s * turn) @ first, ACT)

    def back(self, elsewhere: Array | None = None) -> None:
        """Put the object down, upright, where it was or elsewhere."""
        place = np.zeros(3) if elsewhere is None else elsewhere
        self.carry(place, np.eye(3), BACK)
        self.rest(self.rng.uniform(0.1, 0.5), BACK)


def _circle(rng: np.random.Generator) -> Array:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def _vector(turn: Array) -> Array:
    from intent_perception.geometry.transforms import vector_from_rotation

    return np.asarray(vector_from_rotation(turn))


def _place(s: _Stage, out: tuple[float, float], across: tuple[float, float],
           up: tuple[float, float]) -> Array:  # fmt: skip
    draw = s.rng.uniform
    return s.size * np.array([draw(*out), draw(*across), draw(*up)])


def _tilt(s: _Stage, low: float, high: float, towards: float | None = None) -> Array:
    """Return a turn by an angle [deg] about a horizontal axis, and some about the vertical.

    `towards`: horizontal direction [rad] that the top leans to; None: any.
    """
    angle = np.radians(s.rng.uniform(low, high))
    lean = s.rng.uniform(0.0, 2.0 * np.pi) if towards is None else towards + s.rng.normal(0.0, 0.5)
    axis = np.array([-np.sin(lean), np.cos(lean), 0.0])
    spin = np.array([0.0, 0.0, s.rng.normal(0.0, 0.08 if s.steady else 0.5)])
    return np.asarray(rotation_from_vector(axis * angle) @ rotation_from_vector(spin))


def _turned(s: _Stage) -> Array:
    """Return a turn of something that is shown or given, not used yet."""
    return _tilt(s, 0, 40) if s.upright else _tilt(s, 0, 150)


def _given(s: _Stage) -> Array:
    """Return a turn of something on its way to somebody."""
    return _tilt(s, 0, 8) if s.steady else _turned(s)


def _face(s: _Stage) -> Array:
    """Return a place before the person's face."""
    draw = s.rng.uniform
    return np.array([-s.body + draw(0.08, 0.28), draw(-0.10, 0.28), s.mouth * draw(0.8, 1.1)])


def _drink(s: _Stage) -> None:
    mouth = _face(s)
    s.carry(mouth, _tilt(s, 0, 25, np.pi))
    for _ in range(int(s.rng.integers(1, 3))):
        s.go(s.pace * s.rng.uniform(0.3, 0.8), mouth, _tilt(s, 15, 75, np.pi), ACT)
        s.rest(s.rng.uniform(0.3, 2.0), ACT)
    s.back()


def _toast(s: _Stage) -> None:
    height = s.mouth * s.rng.uniform(0.6, 1.05)
    s.carry(np.array([*_place(s, (0.0, 0.35), (-0.2, 0.4), (0, 1))[:2], height]), _tilt(s, 0, 20))
    s.rest(s.rng.uniform(0.2, 1.2), ACT)
    if s.rng.random() < 0.6:
        _drink(s)
    else:
        s.back()


def _pour(s: _Stage) -> None:
    above = _place(s, (-0.12, 0.22), (-0.25, 0.30), (0.05, 0.30))
    if s.rng.random() < _INTO:
        s.other = above[:2] + s.rng.uniform(0.0, 0.12) * _circle(s.rng)
    s.carry(above, _tilt(s, 0, 30))
    s.go(s.pace * s.rng.uniform(0.5, 1.3), above - [0.0, 0.0, s.rng.uniform(0.0, 0.08)],
         _tilt(s, 55, 130), ACT)  # fmt: skip
    s.rest(s.rng.uniform(0.4, 2.5), ACT)
    s.back()


def _pass(s: _Stage) -> None:
    # Whoever takes it stands anywhere before or beside the person; the arm reaches out to there.
    side = s.rng.uniform(-2.0, 2.0)
    reach = s.size * s.rng.uniform(0.50, 0.85)
    height = s.rng.uniform(0.02, 1.0) * min(s.mouth, 0.65)
    there = np.array([reach * np.cos(side) - s.body, reach * np.sin(side), height])
    s.carry(there, _given(s))
    s.rest(s.rng.uniform(0.6, 3.0), ACT)
    if s.rng.random() < 0.4:
        s.back()


def _offer(s: _Stage) -> None:
    # Somebody near takes it: a short way out, low over the table, held there.
    side, way = s.rng.normal(0.0, 0.7), s.size * s.rng.uniform(0.07, 0.35)
    there = np.array([way * np.cos(side), way * np.sin(side), s.size * s.rng.uniform(0.03, 0.28)])
    s.carry(there, _given(s))
    s.rest(s.rng.uniform(0.5, 3.0), ACT)
    if s.rng.random() < 0.4:
        s.back()


def _offhand(s: _Stage) -> None:
    middle = np.array([
        -s.body + s.rng.uniform(0.20, 0.50), s.rng.uniform(-0.10, 0.28),
        s.rng.uniform(0.15, 0.80) * s.mouth,
    ])  # fmt: skip
    s.carry(middle, _turned(s))
    s.rest(s.rng.uniform(0.3, 1.5), ACT)
    s.go(s.pace * 0.8, middle + _place(s, (-0.1, 0.1), (0.0, 0.25), (-0.1, 0.1)),
         _turned(s), ACT)  # fmt: skip
    s.back()


def _wash(s: _Stage) -> None:
    s.carry(_place(s, (-0.2, 0.2), (-0.30, 0.30), (0.04, 0.30)), _tilt(s, 10, 100))
    s.go(s.pace * s.rng.uniform(0.3, 0.8), s.place, _tilt(s, 85, 180), ACT)
    s.swing(s.rng.uniform(0.6, 3.0), s.rng.normal(0.0, 0.02, 3), s.rng.normal(0.0, 0.2, 3),
            s.rng.uniform(0.5, 2.5))  # fmt: skip
    s.back()


def _strike(s: _Stage) -> None:
    s.carry(_place(s, (-0.30, 0.15), (-0.15, 0.25), (0.04, 0.60)), _tilt(s, 20, 110))
    way = np.array([*s.rng.normal(0.0, 0.03, 2), s.rng.uniform(0.03, 0.14)])
    s.swing(s.rng.uniform(0.8, 4.0), way, s.rng.normal(0.0, 0.3, 3), s.rng.uniform(0.8, 3.5))
    s.back()


def _cut(s: _Stage) -> None:
    s.carry(_place(s, (-0.15, 0.15), (-0.15, 0.25), (0.01, 0.15)), _tilt(s, 0, 95))
    way = np.array([*(s.rng.uniform(0.015, 0.07) * _circle(s.rng)), s.rng.normal(0.0, 0.015)])
    s.swing(s.rng.uniform(0.8, 4.0), way, s.rng.normal(0.0, 0.1, 3), s.rng.uniform(0.8, 3.0))
    s.back()


def _screw(s: _Stage) -> None:
    s.carry(_place(s, (-0.15, 0.15), (-0.15, 0.25), (0.03, 0.25)), _tilt(s, 30, 120))
    axis = s.turn[:, 0] * s.rng.uniform(0.3, 0.9)
    s.swing(s.rng.uniform(0.8, 4.0), s.rng.normal(0.0, 0.006, 3), axis, s.rng.uniform(0.6, 2.0))
    s.back()


def _inspect(s: _Stage) -> None:
    near = _place(s, (-0.30, 0.05), (-0.10, 0.22), (0.06, 0.38))
    s.carry(_face(s) if s.rng.random() < 0.7 else near, _turned(s))
    for _ in range(int(s.rng.integers(1, 5))):
        s.go(s.pace * s.rng.uniform(0.5, 1.5), s.place + s.rng.normal(0.0, 0.02, 3),
             _turned(s), ACT)  # fmt: skip
        s.rest(s.rng.uniform(0.0, 1.5), ACT)
    s.back()


def _aside(s: _Stage) -> None:
    way = np.array([*(s.rng.uniform(0.08, 0.40) * _circle(s.rng)), 0.0])
    height = np.array([0.0, 0.0, s.rng.uniform(0.01, 0.14)])
    s.carry(0.5 * way + height, _tilt(s, 0, 12))
    s.go(s.pace * s.rng.uniform(0.3, 0.7), way, np.eye(3), BACK)
    s.rest(s.rng.uniform(0.3, 1.5), BACK)


def _put_back(s: _Stage) -> None:
    s.carry(_place(s, (-0.06, 0.06), (-0.06, 0.06), (0.02, 0.22)), _tilt(s, 0, 20))
    s.back()
    s.rest(s.rng.uniform(0.3, 1.5), BACK)


def _lift(s: _Stage) -> None:
    for _ in range(int(s.rng.integers(1, 3))):
        s.carry(_place(s, (-0.12, 0.10), (-0.08, 0.12), (0.05, 0.38)), _tilt(s, 0, 25))
        s.rest(s.rng.uniform(0.3, 2.0), ACT)
        s.back()


KINDS: dict[str, tuple[str, Callable[[_Stage], None]]] = {
    "pass": ("hand-over", _pass),
    "offer": ("hand-over", _offer),
    "to the other hand": ("hand-over", _offhand),
    "pour": ("pouring", _pour),
    "wash": ("dish-washing", _wash),
    "strike": ("tool-use", _strike),
    "cut": ("tool-use", _cut),
    "turn": ("tool-use", _screw),
    "drink": (NOTHING, _drink),
    "toast": (NOTHING, _toast),
    "inspect": (NOTHING, _inspect),
    "move aside": (NOTHING, _aside),
    "put back": (NOTHING, _put_back),
    "lift": (NOTHING, _lift),
}
"""Kind of motion to the task that it does and its script."""
OFTEN = {"toast": 0.5, "inspect": 3.0, "move aside": 2.0, "put back": 2.0}
"""How often a kind is done against the others of its task, where not once: who does no task with a
thing looks at it, makes room or puts it back more often than others drink or raise a toast."""


def held_motion(kind: str, rng: np.random.Generator) -> Motion:
    """Return one motion of a kind, of a person drawn anew."""
    stage = _Stage(rng)
    KINDS[kind][1](stage)
    facing = float(rng.normal(0.0, _FACING))
    return Motion(
        kind, stage.manner, np.array(stage.poses), np.array(stage.steps), stage.other, facing
    )
