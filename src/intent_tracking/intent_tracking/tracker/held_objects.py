"""The objects of one hypothesis from frame to frame: what they are expected to do, what they did.

An object near the hand may have been taken or put down since the last frame. Both are tried against
the image: moved with the hand, and left where it was.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, rotation_angle
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.image.pixel_kernels import OF_OBJECT
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_kernel import HandBuffers, place_hand
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis
from intent_tracking.tracker.object_life import ObjectLife, ObjectLifeConfig, hand_gap
from intent_tracking.tracker.problem import Fit, Problem, Ties

_DOUBT_PLACE, _DOUBT_TURN = 0.004, 0.10
"""How far an object may be from where it is that a trial is worth it [m, rad]."""
_SAME_PLACE = 0.05
"""What is recognised this near a held object is the held one, under another name [m]."""


def joined_objects(
    before: RecognizedObjects, answer: RecognizedObjects, held: Mapping[str, Array]
) -> tuple[RecognizedObjects, list[int | None]]:
    """Return the objects of a new answer beside those that a hand holds, and the answer's table.

    Objects keep their place in the list; only a complete answer says that one is gone.

    Args:
        before: the objects so far.
        answer: of the recogniser.
        held: id -> (4, 4) present pose in the answer's frame `table` of objects near a hand: these
            are followed, whatever the recogniser says of them.

    Returns:
        the objects, and which of the former ones each is, None = a new one.
    """
    fresh = {item.id: item for item in answer.objects}
    objects: list[RecognizedObject] = []
    kept: list[int | None] = []
    for k, item in enumerate(before.objects):
        new = fresh.pop(item.id, None)
        if item.id in held:
            objects.append(replace(item, T_table_object=held[item.id]))
        elif new is not None or not answer.complete:
            objects.append(new or item)
        else:
            continue
        kept.append(k)
    for item in fresh.values():
        place = item.T_table_object[:3, 3]
        if all(np.linalg.norm(pose[:3, 3] - place) > _SAME_PLACE for pose in held.values()):
            objects.append(item)
            kept.append(None)
    return replace(answer, objects=tuple(objects)), kept


def expected(guess: BodyState, lives: list[ObjectLife]) -> BodyState:
    """Return a prediction in which rested objects rest and carried ones follow the hand."""
    for k, life in enumerate(lives):
        if not life.taken:
            guess = guess.with_object(k, life.rest)
        elif life.grip is not None:
            guess = guess.with_object(k, guess.pose(0) @ life.grip)
    return guess


def ties_of(lives: list[ObjectLife], active: tuple[int, ...], config: ObjectLifeConfig) -> Ties:
    """Return what the fit expects of the active objects."""
    values = np.array([lives[k].ties(config) for k in active], np.float32)
    touch, place, turn = values.reshape(-1, 3).T
    return Ties(touch.copy(), place.copy(), turn.copy())


def reconsidered(
    hypothesis: Hypothesis, problem: Problem, fit: Fit, config: ObjectLifeConfig
) -> Fit:
    """Return a fit with objects moved along or left behind where that explains the image better."""
    track, lives = hypothesis.track, hypothesis.lives
    motion = fit.state.pose(0) @ inverse(track.state.pose(0))
    for row, k in enumerate(problem.active):
        if lives[k].gap > config.near:
            continue
        before = track.state.pose(1 + k)
        for pose in (motion @ before, before):
            if _apart(pose, fit.state.pose(1 + row)):
                ties = ties_of(lives, problem.active, config)
                ties.place[row], ties.turn[row] = config.free_place, config.free_turn
                fit = track.reconsidered(problem, fit, row, pose, ties)
    return fit


def _apart(one: Array, other: Array) -> bool:
    offset = float(np.linalg.norm(one[:3, 3] - other[:3, 3]))
    angle = float(rotation_angle(one[:3, :3].T @ other[:3, :3]))
    return offset > _DOUBT_PLACE or angle > _DOUBT_TURN


def note_objects(
    hypothesis: Hypothesis, problem: Problem, config: ObjectLifeConfig, buffers: HandBuffers
) -> None:
    """Bring the record of every object up to date with the present state of the track."""
    track = hypothesis.track
    place_hand(track.arrays, track.state.values, track.state.rotations[0], buffers)
    for k, life in enumerate(hypothesis.lives):
        now = track.state.pose(1 + k)
        gap = hand_gap(buffers, track.arrays.radii, track.objects([k]), now)
        life.update(gap, track.before.pose(1 + k), now, config)
        if k in problem.active:
            label = OF_OBJECT + problem.active.index(k)
            seen = int((problem.view.pixels.label == label).sum())
            life.unseen = life.unseen + 1 if seen < 12 else 0
            life.hold(inverse(track.state.pose(0)) @ now, seen > 60)
