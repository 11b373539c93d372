"""The sensor model has the noise that it states."""

import numpy as np
import pytest

from intent_perception.workshop.scenes.sensor_noise import KinectNoise, observe

COLOR = np.full((200, 300, 3), 120, np.uint8)


def wall(depth: float) -> np.ndarray:
    return np.full((200, 300), depth, np.float32)


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.mark.parametrize("depth", [0.5, 1.0, 2.0])
def test_axial_noise_grows_as_stated(depth: float) -> None:
    measured, _ = observe(wall(depth), COLOR, rng())
    deviation = np.std(measured[measured > 0])
    assert deviation == pytest.approx(0.0012 + 0.0019 * (depth - 0.4) ** 2, rel=0.08)
    assert np.mean(measured[measured > 0]) == pytest.approx(depth, abs=2e-4)


def test_depth_is_whole_millimetres_in_every_storage() -> None:
    measured, _ = observe(wall(0.8), COLOR, rng())
    millimetres = np.rint(measured * 1000).astype(np.uint16)
    np.testing.assert_array_equal(millimetres.astype(np.float32) / np.float32(1000), measured)


def test_edges_become_ragged_and_lose_measurements() -> None:
    depth = wall(1.0)
    depth[:, :150] = 0.7
    measured, _ = observe(depth, COLOR, rng())
    near_edge = measured[:, 149:151]
    assert np.mean(near_edge == 0) > 0.15
    assert np.std((measured[:, 145:155] > 0.85).sum(axis=1)) > 0.5
    assert np.mean(measured[:, 20:120] == 0) < 0.01


def test_grazing_surfaces_lose_measurements() -> None:
    columns = np.linspace(0.6, 2.6, 300, dtype=np.float32)
    steep = np.tile(columns, (200, 1))  # about 80 degrees near the left
    measured, _ = observe(steep, COLOR, rng(), KinectNoise(edge_step=1.0))
    assert np.mean(measured[:, 20:60] == 0) > 0.5


def test_nothing_is_measured_where_nothing_is() -> None:
    depth = wall(1.0)
    depth[50:100] = 0.0
    measured, _ = observe(depth, COLOR, rng())
    assert np.mean(measured[55:95] == 0) == 1.0


def test_image_noise_has_the_stated_strength() -> None:
    _, color = observe(wall(1.0), COLOR, rng())
    expected = np.sqrt(4.0**2 + 0.15**2 * 120)
    assert np.std(color.astype(float)) == pytest.approx(expected, rel=0.05)


def test_same_seed_gives_the_same_images() -> None:
    first, second = (observe(wall(1.0), COLOR, rng()) for _ in range(2))
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def test_negative_noise_is_refused() -> None:
    with pytest.raises(ValueError, match="lateral"):
        KinectNoise(lateral=-1.0)
