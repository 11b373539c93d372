import numpy as np
import pytest

from intent_tracking.hands.hand_square import (
    HandSquare,
    search_views,
    square_of_key_points,
    upward_turn,
    whole_image,
)


def random_square(seed):
    rng = np.random.default_rng(seed)
    return HandSquare(rng.uniform(50, 400, 2), float(rng.uniform(30, 500)), rng.uniform(-3, 3))


@pytest.mark.parametrize("seed", range(5))
def test_to_crop_undoes_to_image(seed):
    square, points = random_square(seed), np.random.default_rng(seed).uniform(0, 224, (9, 2))
    np.testing.assert_allclose(square.to_crop(square.to_image(points, 224), 224), points)


@pytest.mark.parametrize("shape", [(480, 640), (1080, 1920), (720, 720), (9, 16), (640, 480)])
def test_whole_image_holds_every_pixel(shape):
    corners = np.array([[0, 0], [shape[1] - 1, shape[0] - 1]], float)
    crop = whole_image(shape[1], shape[0]).to_crop(corners, 192)
    assert crop.min() > -0.5
    assert crop.max() < 191.5


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("width", [300, 1500])
def test_cut_shows_a_spot_where_to_crop_says(seed, width):
    rng = np.random.default_rng(seed)
    square = HandSquare(np.full(2, width / 2), 0.6 * width, rng.uniform(-3, 3))
    spot = square.to_image(rng.uniform(40, 180, 2), 224)
    rows, columns = np.mgrid[:width, :width]
    bright = np.exp(-((columns - spot[0]) ** 2 + (rows - spot[1]) ** 2) / (0.02 * width) ** 2)
    crop = square.cut(np.repeat(np.uint8(255 * bright)[..., None], 3, axis=2), 224)[..., 0]
    weights = crop.astype(float)
    seen = np.array([(weights * axis).sum() for axis in np.mgrid[:224, :224][::-1]])
    np.testing.assert_allclose(
        seen / weights.sum(), square.to_crop(spot, 224), atol=0.35, err_msg="pixels"
    )


@pytest.mark.parametrize("turn", [0.3, np.pi / 2, 3.0, -2.0])
def test_square_of_key_points_turns_moves_and_grows_with_them(turn):
    pixels = np.random.default_rng(0).normal(0, 40, (21, 2))
    c, s = np.cos(turn), np.sin(turn)
    moved = 1.7 * pixels @ np.array([[c, s], [-s, c]]) + [300, 200]
    one, other = square_of_key_points(pixels), square_of_key_points(moved)
    assert other.side == pytest.approx(1.7 * one.side)
    np.testing.assert_allclose(
        other.center, 1.7 * np.array([[c, -s], [s, c]]) @ one.center + [300, 200]
    )
    assert np.cos(other.turn - one.turn - turn) == pytest.approx(1)


def test_upward_turn_of_right_is_a_quarter_clockwise():
    assert upward_turn(np.array([1.0, 0.0])) == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("shape", [(480, 640), (1080, 1920), (480, 1280), (1280, 480)])
def test_every_small_hand_is_whole_in_some_part_of_the_image(shape):
    height, width = shape
    parts = [view for view in search_views(width, height) if view.side < max(shape)]
    small = 0.1 * max(shape)
    for center in np.random.default_rng(0).uniform(
        small / 2, np.array([width, height]) - small / 2, (50, 2)
    ):
        apart = min(np.abs(view.center - center).max() for view in parts)
        assert apart <= 0.5 * (parts[0].side - small)


def test_small_image_is_searched_whole():
    assert len(search_views(160, 120)) == 1
