"""Compiled loops over pixels against plain numpy."""

import numpy as np
import pytest

from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_tracking.image.appearance import AppearanceModel, color_bins
from intent_tracking.image.labelling import Bodies, LabellingConfig, label_pixels
from intent_tracking.image.pixel_kernels import NOBODY, OF_ARM, OF_HAND, OF_REST
from intent_tracking.image.tile import OUT_OF_RANGE, Tile, cut_tile
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.object_kernel import object_arrays

SIZE, FAR = 64, np.float32(1e3)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_bins_are_those_of_the_formula(rng: np.random.Generator) -> None:
    color = rng.integers(0, 256, (40, 50, 3), dtype=np.uint8)
    rgb = color.astype(np.float32)
    total = rgb.sum(axis=2) + 12.0
    chroma = np.clip(((rgb[..., :2] + 4.0) / total[..., None] - 0.15) * (24 / 0.45), 0, 23)
    light = np.minimum(total * (4 / 780.0), 3).astype(int)
    expected = (chroma[..., 0].astype(int) * 24 + chroma[..., 1].astype(int)) * 4 + light
    assert (color_bins(color) == expected).mean() > 0.999  # the rest lies on a bin's border


def test_colours_that_cannot_be_written_have_bins_too(rng: np.random.Generator) -> None:
    color = rng.integers(0, 256, (8, 9, 3), dtype=np.uint8)
    expected = color_bins(color)
    color.flags.writeable = False
    assert np.array_equal(color_bins(color), expected)
    assert np.array_equal(color_bins(color[::-1, ::2]), expected[::-1, ::2])


@pytest.mark.parametrize("place", [(20.0, 15.0), (2.0, 3.0), (59.0, 40.0), (30.0, 900.0)])
def test_a_tile_holds_the_nearest_pixels(
    rng: np.random.Generator, place: tuple[float, float]
) -> None:
    camera = Camera(60, 45, 50.0, 50.0, 29.5, 22.0)
    depth = rng.uniform(0.5, 1.0, (45, 60)).astype(np.float32)
    color = rng.integers(0, 256, (45, 60, 3), dtype=np.uint8)
    tile = cut_tile(RgbdFrame(0, color, depth, camera), (*place, 24.0), 32)
    for i in range(0, 32, 5):
        for j in range(0, 32, 5):
            row = round(place[1] + (i - 15.5) * 0.75)
            column = round(place[0] + (j - 15.5) * 0.75)
            if 0 <= row < 45 and 0 <= column < 60:
                assert tile.depth[i, j] == depth[row, column]
                assert np.array_equal(tile.color[i, j], color[row, column])
            else:
                assert tile.depth[i, j] == 0.0


def test_large_areas_without_depth_are_out_of_range() -> None:
    camera = Camera(60, 45, 50.0, 50.0, 29.5, 22.0)
    depth = np.ones((45, 60), np.float32)
    depth[:, 30:] = 0.0
    frame = RgbdFrame(0, np.zeros((45, 60, 3), np.uint8), depth, camera)
    tile = cut_tile(frame, (30.0, 22.0, 32.0), 32)
    assert np.all(tile.depth[:, :14] == 1.0)
    assert np.all(tile.depth[:, 18:] == OUT_OF_RANGE)


def hand_alone() -> Bodies:
    hand, buffers = hand_arrays(HandModel()), hand_buffers()
    state = np.zeros(26, np.float32)
    state[:3] = [-0.09, 0.0, 0.6]
    rotations = np.eye(3, dtype=np.float32)[None].copy()
    place_hand(hand, state, rotations[0], buffers)
    return Bodies(hand, buffers, object_arrays([]), state, rotations, ())


def test_pixels_on_the_hand_are_its_own_and_those_behind_the_wrist_the_arms() -> None:
    depth = np.full((SIZE, SIZE), 0.6, np.float32)
    tile = Tile(
        depth, np.full((SIZE, SIZE, 3), [200, 150, 130], np.uint8),
        np.float32(-0.4), np.float32(-0.4), np.float32(0.8 / SIZE),
    )  # fmt: skip
    rest = np.full((SIZE, SIZE), FAR)
    rest[-4:] = 0.6
    found = label_pixels(tile, hand_alone(), AppearanceModel([]), rest, None, LabellingConfig())
    x, y, _ = tile.points
    arm = (x + 0.09 < -0.03) & (x + 0.09 > -0.29) & (np.abs(y) < 0.06)
    assert np.all(found.label[arm] == OF_ARM)
    assert np.all(found.label[(found.hand_gap < 0.002) & (x > -0.08)] == OF_HAND)
    assert np.all(found.label[-4:] == OF_REST)
    assert np.all(found.label[np.abs(y[:, 0]) > 0.2][:-4] == NOBODY)


def test_what_lies_on_the_table_is_nobodys() -> None:
    tile = Tile(
        np.full((SIZE, SIZE), 0.6, np.float32), np.zeros((SIZE, SIZE, 3), np.uint8),
        np.float32(-0.4), np.float32(-0.4), np.float32(0.8 / SIZE),
    )  # fmt: skip
    plane = np.array([0.0, 0.0, -1.0, 0.601])
    rest = np.full((SIZE, SIZE), FAR)
    found = label_pixels(tile, hand_alone(), AppearanceModel([]), rest, plane, LabellingConfig())
    assert np.all(found.label == NOBODY)
    assert np.all(found.hand_gap == 1.0)
