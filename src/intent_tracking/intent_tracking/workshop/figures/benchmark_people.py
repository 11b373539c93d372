"""Figures on films of people: every frame counts in which the acting hand is in view."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import ColorImage
from intent_perception.geometry.coded_images import write_picture
from intent_perception.geometry.transforms import transform_points
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_bags import LOST_ERROR
from intent_tracking.workshop.figures.benchmark_views import joint_deviation
from intent_tracking.workshop.figures.hand_drawing import (
    FOUND_COLOR,
    TRUE_COLOR,
    captioned,
    tiled,
    with_skeleton,
)
from intent_tracking.workshop.people.casting import Cast
from intent_tracking.workshop.people.people_film import PeopleFilm, people_film
from intent_tracking.workshop.person.filming.film import Shot

FILMS = 60
RECOVERED = 0.03
"""A hand that was hidden is found again once its joints are this near on average [m]."""
_WARM_UP = 3
"""First frames, which still compile or read something, do not count as CPU time."""
_LEAST_HIDDEN = 5
"""Frames without a hand in view that count as hidden."""
_PICTURED = (0.35, 0.55, 0.75, 0.95)
"""Moments of the picture sheet, as shares of a film."""


@dataclass(frozen=True, eq=False)
class FilmErrors:
    """What a tracker got wrong on one film."""

    number: int
    cast: Cast
    joints: Array
    """(F,) mean error of 21 joints [m], NaN without an answer."""
    in_view: NDArray[np.bool_]
    """(F,) the frames that count."""
    whole: NDArray[np.bool_]
    """(F,) frames with the whole hand in view."""
    side_right: NDArray[np.bool_]
    """(F,) whether the answer names the right side."""
    covered: Array
    """Share of joint coordinates within two published deviations, every fourth frame."""
    seconds: Array
    """(F,) CPU time of each step [s]."""
    pictures: list[ColorImage] = field(default_factory=list)

    @property
    def counted(self) -> Array:
        """(V,) errors of the frames in view, lost ones at `LOST_ERROR` [m]."""
        errors = self.joints[self.in_view]
        return np.where(np.isnan(errors), LOST_ERROR, errors)

    @property
    def first_frames(self) -> int | None:
        """Frames from the first one with the whole hand to the first answer; all if none."""
        whole = np.flatnonzero(self.whole)
        if not len(whole):
            return None
        answered = np.flatnonzero(~np.isnan(self.joints[whole[0] :]))
        return int(answered[0]) if len(answered) else len(self.joints) - int(whole[0])

    @property
    def recovery_frames(self) -> list[int]:
        """Frames from each return of a hidden hand until it is within `RECOVERED`."""
        found = []
        for back in _returns(self.in_view):
            near = np.flatnonzero(self.joints[back:] < RECOVERED)
            found.append(int(near[0]) if len(near) else len(self.joints) - back)
        return found


def people_figures(
    seed: int, films: int = FILMS, picture: Path | None = None, config: TrackerConfig | None = None
) -> dict[str, Any]:
    """Return the figures over the first films of a seed.

    Args:
        seed: of people, rooms and noise; the tracker's too.
        films: how many.
        picture: PNG with the true hand (green) and the tracker's (red) over some frames.
        config: of the tracker.
    """
    config = replace(config or TrackerConfig(), seed=seed)
    errors = [film_errors(people_film(seed, n), config, picture is not None) for n in range(films)]
    if picture is not None:
        sheet = tiled([error.pictures for error in errors])
        write_picture(picture, sheet)
    return summary(errors)


def film_errors(film: PeopleFilm, config: TrackerConfig, draw: bool = False) -> FilmErrors:
    """Return the errors on one film; the tracker is told the table and the known objects."""
    tracker = Tracker(film.models, config)
    tracker.start(film.objects)
    moments = _moments(len(film.script.hands)) if draw else set()
    rows, pictures = [], []
    for number, shot in enumerate(film.shots()):
        began = time.process_time()
        state = tracker.step(shot.frame)
        seconds = time.process_time() - began
        error = np.linalg.norm(state.joints_camera - shot.joints_camera, axis=1).mean()
        right = state.hand_tracked and state.hand_side == film.cast.side
        cover = _covered(state, shot) if number % 4 == 0 else float("nan")
        rows.append((error, shot.hand_in_view, shot.hand_whole, right, cover, seconds))
        if number in moments:
            pictures.append(_pictured(film, shot, state, float(error)))
    joints, in_view, whole, sides, covered, cpu = (np.array(c) for c in zip(*rows, strict=True))
    covered = covered[np.isfinite(covered)]
    return FilmErrors(film.number, film.cast, joints, in_view, whole, sides, covered, cpu, pictures)


def summary(errors: Sequence[FilmErrors]) -> dict[str, Any]:
    """Return the figures over some films."""
    joints = np.concatenate([e.joints[e.in_view] for e in errors])
    sides = np.concatenate([e.side_right[e.in_view] for e in errors])
    seconds = np.concatenate([e.seconds[_WARM_UP:] for e in errors])
    known = ~np.isnan(joints)
    groups = _groups(errors)
    worst = max(groups, key=lambda name: groups[name])
    return {
        "films": len(errors),
        "tracked": float(known.mean()),
        "joint_error_mm": 1e3 * float(np.where(known, joints, LOST_ERROR).mean()),
        "tracked_joint_error_mm": 1e3 * float(joints[known].mean()) if known.any() else None,
        "best_group_mm": min(groups.values()),
        "worst_group_mm": groups[worst],
        "worst_group": worst,
        "side_right": float(sides[known].mean()) if known.any() else 0.0,
        "first_frames_median": _median([e.first_frames for e in errors]),
        "recovery_frames_median": _median([n for e in errors for n in e.recovery_frames]),
        "coverage_2sigma": _mean(np.concatenate([e.covered for e in errors])),
        "cpu_ms": 1e3 * float(seconds.mean()),
        "cpu_ms_p95": 1e3 * float(np.percentile(seconds, 95)),
        "groups": {name: round(groups[name], 2) for name in sorted(groups)},
        "each_mm": {str(e.number): round(1e3 * float(e.counted.mean()), 1) for e in errors},
    }


def _groups(errors: Sequence[FilmErrors]) -> dict[str, float]:
    """Return the mean error of each group of films, every frame in view counted [mm]."""
    members: dict[str, list[Array]] = {}
    for error in errors:
        for name in error.cast.groups:
            members.setdefault(name, []).append(error.counted)
    pooled = {name: np.concatenate(parts) for name, parts in members.items()}
    return {name: 1e3 * float(all_.mean()) for name, all_ in pooled.items() if len(all_)}


def _returns(in_view: NDArray[np.bool_]) -> Iterator[int]:
    """Yield the frames in which a hand that was seen comes back after it was hidden."""
    seen = np.flatnonzero(in_view)
    for before, after in pairwise(seen):
        if after - before > _LEAST_HIDDEN:
            yield int(after)


def _covered(state: SceneState, shot: Shot) -> float:
    """Return the share of joint coordinates within two published deviations, NaN without any."""
    if not (state.hand_tracked and shot.hand_in_view):
        return float("nan")
    expected = transform_points(state.T_table_camera, shot.joints_camera)
    offset = np.abs(state.joints_table - expected)
    return float((offset <= 2.0 * joint_deviation(state)).mean())


def _moments(frames: int) -> set[int]:
    return {int(share * frames) for share in _PICTURED}


def _pictured(film: PeopleFilm, shot: Shot, state: SceneState, error: float) -> ColorImage:
    """Return one tile of the picture sheet."""
    camera = shot.frame.camera
    image = with_skeleton(shot.frame.color, shot.joints_camera, camera, TRUE_COLOR)
    image = with_skeleton(image, state.joints_camera, camera, FOUND_COLOR)
    cast = film.cast
    found = f"{1e3 * error:.0f} mm" if state.hand_tracked else "no hand"
    text = f"{film.number} {found} T{cast.tone} {cast.dress}, {cast.exposure}, {cast.placement}"
    return captioned(image, text)


def _median(values: Sequence[int | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
