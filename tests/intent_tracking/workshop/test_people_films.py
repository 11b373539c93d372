"""Films of people: the same every time, true, and measured."""

from itertools import islice

import numpy as np
import pytest

from intent_tracking.tracker.recording import Recording
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_people import FilmErrors, summary
from intent_tracking.workshop.figures.benchmark_real import camera_figures, real_figures
from intent_tracking.workshop.people.casting import cast
from intent_tracking.workshop.people.people_film import PeopleFilm, joints_camera, people_film
from intent_tracking.workshop.person.filming.film import Shot

KEYS = {
    "films", "tracked", "joint_error_mm", "best_group_mm", "worst_group_mm", "worst_group",
    "side_right", "first_frames_median", "recovery_frames_median", "coverage_2sigma", "cpu_ms",
    "cpu_ms_p95", "groups",
}  # fmt: skip
SEED = 7
_INSIDE = [1, 2, 3, 5, 6, 7, 9, 10, 11, 13, 14, 15, 17, 18, 19]
"""Joints that are not on the outline, as finger tips are, nor under a sleeve."""


def _film(placement: str) -> PeopleFilm:
    """Return the first film without objects, which is fast, of a placement."""
    for number in range(200):
        chosen = cast(SEED, number)
        alone = chosen.company == "alone" and chosen.hidden == "never"
        if chosen.placement == placement and chosen.objects == "none" and alone:
            return people_film(SEED, number)
    raise AssertionError(f"no film from {placement}")


def _shots(film: PeopleFilm, count: int) -> list[Shot]:
    return list(islice(film.shots(), count))


@pytest.mark.slow
@pytest.mark.parametrize("placement", ["rolled", "head"])
def test_the_true_joints_lie_inside_the_hand_that_is_seen(placement: str) -> None:
    behind = []
    for shot in _shots(_film(placement), 36):
        inner = shot.joints_camera[_INSIDE]
        u, v = np.rint(shot.frame.camera.project(inner)).astype(int).T
        seen = (u >= 0) & (u < 640) & (v >= 0) & (v < 480) & shot.hand_in_view
        surface = shot.frame.depth[v[seen], u[seen]]
        behind.append((inner[seen, 2] - surface)[surface > 0.0])
    gap = np.concatenate(behind)  # a joint may be hidden by another finger, far in front of it
    assert len(gap) > 50
    assert np.mean(gap > 0.0) > 0.95
    assert np.quantile(gap, 0.25) < 0.02


@pytest.mark.slow
def test_a_film_is_the_same_every_time() -> None:
    first, second = _film("facing"), _film("facing")
    assert first.cast == second.cast
    for a, b in zip(_shots(first, 3), _shots(second, 3), strict=True):
        assert np.array_equal(a.frame.color, b.frame.color)
        assert np.array_equal(a.frame.depth, b.frame.depth)
        assert np.array_equal(a.joints_camera, b.joints_camera)
    shown = joints_camera(first.script, first.skin, first.scene, 2)
    assert np.allclose(shown, _shots(first, 3)[2].joints_camera)


def _errors(number: int, joints: np.ndarray, in_view: np.ndarray) -> FilmErrors:
    right = ~np.isnan(joints)
    seconds = np.full(len(joints), 0.02)
    covered = np.array([0.9])
    return FilmErrors(number, cast(SEED, number), joints, in_view, in_view, right, covered, seconds)


def test_a_lost_frame_counts_as_100_mm_and_one_out_of_view_not_at_all() -> None:
    joints = np.array([np.nan, np.nan, 0.01, 0.01, 0.5])
    figures = summary([_errors(0, joints, np.array([False, True, True, True, False]))])
    assert figures["joint_error_mm"] == pytest.approx(40.0)
    assert figures["tracked"] == pytest.approx(2.0 / 3.0)
    assert figures["first_frames_median"] == 1.0


def test_recovery_counts_from_the_return_of_a_hidden_hand_until_it_is_near() -> None:
    in_view = np.r_[np.ones(5, bool), np.zeros(8, bool), np.ones(7, bool)]
    joints = np.r_[
        np.full(5, 0.01), np.full(8, np.nan), [np.nan, 0.2, 0.05, 0.01], np.full(3, 0.01)
    ]
    assert _errors(0, joints, in_view).recovery_frames == [3]


def test_the_figures_have_all_keys_and_name_the_worst_group() -> None:
    everywhere = np.ones(6, bool)
    pair = [_errors(0, np.full(6, 0.01), everywhere), _errors(1, np.full(6, 0.03), everywhere)]
    figures = summary(pair)
    assert set(figures) >= KEYS
    assert figures["groups"][figures["worst_group"]] == pytest.approx(30.0)
    assert figures["best_group_mm"] == pytest.approx(10.0)


def test_without_recordings_the_part_real_is_null(tmp_path) -> None:
    assert real_figures(tmp_path, TrackerConfig()) is None


def test_a_camera_that_could_not_be_tracked_counts_as_lost_in_every_frame() -> None:
    figures = camera_figures(None, {})
    assert figures["tracked"] == 0.0
    assert figures["mean_mm_capped_200"] == 200.0


def test_wrist_and_thumb_base_do_not_count_on_real_recordings() -> None:
    class _Found(Recording):
        joints_camera = np.full((2, 21, 3), 0.5)
        arrays = {"hand_side": np.array("right")}  # noqa: RUF012

    truth = {
        "joints_camera": np.full((2, 21, 3), 0.5),
        "valid": np.array([True, False]),
        "K": np.array([[300.0, 0, 0], [0, 300.0, 0], [0, 0, 1.0]]),
    }
    truth["joints_camera"][:, :2, 0] = 0.6
    truth["joints_camera"][:, 5, 2] = 0.519
    figures = camera_figures(_Found((), np.array([0.01, 0.03])), truth)
    assert figures["mean_mm_capped_200"] == pytest.approx(1.0)
    assert figures["frames"] == 1
    assert figures["side_right"] == 1.0
