"""Bodies around an axis are found from the points of the side that a camera sees."""

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.recognition.estimation.revolution import (
    crossing,
    fit_revolution,
    section_radius,
    slice_quantiles,
)

CENTER = np.array([0.12, -0.05])


def seen_side(radius: float, noise: float, taper: float = 0.0) -> tuple[Array, Array]:
    """Return points and normals of the half of a standing cone that faces -y."""
    rng = np.random.default_rng(0)
    angle, height = rng.uniform(-np.pi, 0.0, 900), rng.uniform(0.0, 0.12, 900)
    across = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    width = radius + taper * height
    points = np.column_stack([CENTER + width[:, None] * across, height])
    normals = np.column_stack([across, np.full(900, -taper)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points + rng.normal(0.0, noise, points.shape), normals


def test_the_normals_of_a_round_body_meet_in_its_axis() -> None:
    points, normals = seen_side(0.04, 0.0)
    found, _ = crossing(points[:, :2], normals[:, :2])
    np.testing.assert_allclose(found, CENTER, atol=1e-6)


@pytest.mark.parametrize("taper", [0.0, 0.15, -0.1])
def test_axis_and_outline_are_found_within_half_a_millimetre(taper: float) -> None:
    points, normals = seen_side(0.04, 0.001, taper)
    start = np.array([0.1, -0.1, 0.0])
    body = fit_revolution(points, normals, np.eye(3), start, False)
    assert body is not None
    np.testing.assert_allclose(body.point[:2], CENTER, atol=5e-4)
    np.testing.assert_allclose(body.radii, 0.04 + taper * body.heights, atol=1e-3)
    assert body.share > 0.95


def test_a_handle_stands_off_the_body_and_does_not_move_its_axis() -> None:
    points, normals = seen_side(0.04, 0.0005)
    handle = np.array([[0.12, -0.05 - 0.07, z] for z in np.linspace(0.03, 0.09, 60)])
    aside = np.tile([1.0, 0.0, 0.0], (60, 1))
    both, directions = np.concatenate([points, handle]), np.concatenate([normals, aside])
    body = fit_revolution(both, directions, np.eye(3), np.zeros(3), False)
    assert body is not None
    np.testing.assert_allclose(body.point[:2], CENTER, atol=1e-3)
    np.testing.assert_allclose(body.gaps[-60:], 0.03, atol=2e-3)


def test_a_section_is_a_circle_at_power_two() -> None:
    places = np.array([[0.03, 0.04], [0.05, 0.0]])
    np.testing.assert_allclose(section_radius(places, 1.0, 2.0), 0.05)
    np.testing.assert_allclose(section_radius(places, 1.0, 2.0001), 0.05, rtol=1e-3)


def test_quantiles_of_slices_are_numpy_s() -> None:
    rng = np.random.default_rng(0)
    values, index, shares = rng.normal(size=300), rng.integers(0, 9, 300), np.array([0.03, 0.9])
    found = slice_quantiles(values, index, 10, shares, 3)
    expected = [np.quantile(values[index == k], shares) for k in range(9)]
    np.testing.assert_allclose(found[:9], expected, rtol=1e-12)
    assert np.isnan(found[9]).all()
