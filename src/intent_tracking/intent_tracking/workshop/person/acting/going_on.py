"""How a demonstration goes on after the beginning of its task, whose frames stay as they are.

People who give something reach out as far as their arm goes and hold it there; who pours tilts on
and keeps the tilt; who washes turns on and rinses to and fro; a tool strikes on. Nothing of it
depends on what anybody concludes from the motion. A generator of its own shakes the new frames, so
that all frames before them have the same bits with and without them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse
from intent_tracking.workshop.person.acting.hand_motion import Choreography, mirrored
from intent_tracking.workshop.person.acting.task_moves import Pace, moved
from intent_tracking.workshop.person.body.person_arm import PersonBody
from intent_tracking.workshop.person.body.skin import wrist_turn

_BACK = 12
"""Frames of the way back to where another act follows."""
_BLEND = 9
"""Frames in which the elbow leaves the way that it had."""
_FIRST = 0.6
"""Share of the frames in which what is given or poured still moves; then it is held."""
_TRIES, _ROOM = 30, 0.06
"""Ways are drawn until one keeps so far from what stands there [m]."""
_DEG = np.pi / 180.0

Obstacle = tuple[Array, float, float]
"""Spot (2,) on the table, radius and height [m]."""


@dataclass(frozen=True, eq=False)
class Going:
    """F frames of a person and what is carried, in the table frame."""

    hands: Array
    """(F, 4, 4) T_table_hand."""
    angles: Array
    """(F, 20) joint angles [rad]."""
    wrists: Array
    """(F, 3) turn of the forearm against the right hand [rad]."""
    elbows: Array
    """(F, 3) [m]."""
    shoulders: Array
    """(F, 3) [m]."""
    objects: Array
    """(F, N, 4, 4) T_table_object."""


def in_mirror(motion: Going) -> Going:
    """Return the same of a left hand."""
    swap = np.array([-1.0, 1.0, 1.0])
    return replace(
        motion, hands=mirrored(motion.hands), objects=mirrored(motion.objects),
        elbows=motion.elbows * swap, shoulders=motion.shoulders * swap,
    )  # fmt: skip


def filmed_on(
    shown: Going, ends: Sequence[int | None], tasks: Sequence[str], pace: Pace,
    body: PersonBody, stand: Sequence[Obstacle], rng: np.random.Generator,
) -> tuple[Going, NDArray[np.int64]]:  # fmt: skip
    """Return the motion in which every task goes on, and how many frames later each act begins.

    Args:
        shown: of D acts, F frames, of a right hand.
        ends: (D,) frame in which the beginning of each task has ended; None: nothing was taken.
        tasks: (D,).
        pace: `go_on` frames are put in for each.
        body: the person.
        stand: what else stands on the table.
        rng: source of how far it goes and of the trembling.
    """
    parts, late, done = [], np.zeros(len(ends), dtype=np.int64), 0
    for act, (end, task) in enumerate(zip(ends, tasks, strict=True)):
        if end is None:
            continue
        back = act + 1 < len(ends)
        for _ in range(_TRIES):
            further = _further(shown, end, act, task, pace, body, rng, back=back)
            if _free(further, act, stand):
                break
        parts += [_cut(shown, done, end + 1), further]
        late[act + 1 :] += len(further.hands)
        done = end + 1
    return _joined([*parts, _cut(shown, done, len(shown.hands))]), late


def _further(
    shown: Going, end: int, index: int, task: str, pace: Pace, body: PersonBody,
    rng: np.random.Generator, *, back: bool,
) -> Going:  # fmt: skip
    """Return only the frames that are put in behind frame `end`.

    Where another act follows (`back`) the object returns to where it was.
    """
    T_object, T_hand = shown.objects[end, index], shown.hands[end]
    stage = Choreography(T_hand, shown.angles[end], shown.objects[end], rng)
    grip = inverse(T_object) @ T_hand
    _MOVES.get(task, _strike_on)(stage, index, grip, pace, rng)
    if back:
        stage.carry(_BACK, index, T_object, grip)
    motion = stage.motion(rng.uniform(0.7, 1.3))
    elbows, shoulders = body.arms(motion.hands)
    fade = np.clip(1.0 - np.arange(len(elbows)) / _BLEND, 0.0, 1.0)[:, None]
    for follow in (fade, fade[::-1])[: 2 if back else 1]:
        own = int(np.argmax(follow[:, 0]))
        elbows = elbows + follow * (shown.elbows[end] - elbows[own])
        shoulders = shoulders + follow * (shown.shoulders[end] - shoulders[own])
    wrists = np.array([wrist_turn(T, e) for T, e in zip(motion.hands, elbows, strict=True)])
    everything = Going(motion.hands, motion.angles, wrists, elbows, shoulders, motion.objects)
    return _cut(everything, 1, len(elbows))


def _free(motion: Going, index: int, stand: Sequence[Obstacle]) -> bool:
    """Return whether the held object and the hand keep away from what stands there."""
    points = np.concatenate([motion.objects[:, index, :3, 3], motion.hands[:, :3, 3]])
    for spot, radius, top in stand:
        low = points[points[:, 2] < top + _ROOM]
        if len(low) and np.hypot(*(low[:, :2] - spot).T).min() < radius + _ROOM:
            return False
    return True


def _joined(parts: Sequence[Going]) -> Going:
    names = [own.name for own in fields(Going)]
    return Going(*(np.concatenate([getattr(own, name) for own in parts]) for name in names))


def _cut(motion: Going, first: int, end: int) -> Going:
    return Going(*(getattr(motion, own.name)[first:end] for own in fields(Going)))


def _go(stage: Choreography, index: int, grip: Array, frames: int, shift: Array,
        *turns: tuple[int, float]) -> None:  # fmt: skip
    target = moved(stage.objects[index], stage.hand, shift, turns)
    stage.carry(frames, index, target, grip)


def _reach_out(
    stage: Choreography, index: int, grip: Array, pace: Pace, rng: np.random.Generator
) -> None:
    rest = 1.0 - pace.begun
    way = np.array([rng.normal(0.0, 0.015), -rng.uniform(0.04, 0.09), rng.uniform(0.0, 0.04)])
    first = round(_FIRST * pace.go_on)
    _go(stage, index, grip, first, way + rest * np.array([0.03, -0.14, 0.01]))
    _go(stage, index, grip, pace.go_on - first, rng.normal(0.0, 0.003, 3))


def _tilt_on(
    stage: Choreography, index: int, grip: Array, pace: Pace, rng: np.random.Generator
) -> None:
    further = 72.0 * (1.0 - pace.begun) + rng.uniform(5.0, 20.0)
    first = round(_FIRST * pace.go_on)
    _go(stage, index, grip, first, rng.normal(0.0, 0.006, 3), (0, -further * _DEG))
    _go(stage, index, grip, pace.go_on - first, rng.normal(0.0, 0.004, 3),
        (0, -rng.uniform(0.0, 4.0) * _DEG))  # fmt: skip


def _rinse(
    stage: Choreography, index: int, grip: Array, pace: Pace, rng: np.random.Generator
) -> None:
    further = 100.0 * (1.0 - pace.begun) + rng.uniform(10.0, 35.0)
    sway = np.array([rng.uniform(0.015, 0.03), rng.normal(0.0, 0.006), 0.0])
    swing = rng.uniform(-12.0, 12.0) * _DEG
    beat = max(3, pace.go_on // 3)
    _go(stage, index, grip, beat, sway, (0, further * _DEG))
    for k, frames in enumerate(_split(pace.go_on - beat, beat)):
        way = -1.0 if k % 2 == 0 else 1.0
        _go(stage, index, grip, frames, 2.0 * way * sway, (0, way * swing))


def _strike_on(
    stage: Choreography, index: int, grip: Array, pace: Pace, rng: np.random.Generator
) -> None:
    vary = rng.uniform(0.85, 1.15) * pace.begun
    for k, frames in enumerate(_split(pace.go_on, max(2, pace.task // 6))):
        way = 1.0 if k % 2 == 0 else -1.0
        _go(stage, index, grip, frames, way * vary * np.array([0.0, 0.05, 0.05]),
            (2, -way * 45.0 * vary * _DEG))  # fmt: skip


def _split(frames: int, beat: int) -> list[int]:
    """Return as many beats as fit, the last one with the frames that are left."""
    count = max(1, frames // beat)
    return [beat] * (count - 1) + [frames - beat * (count - 1)]


_MOVES = {"hand-over": _reach_out, "pouring": _tilt_on, "dish-washing": _rinse}
