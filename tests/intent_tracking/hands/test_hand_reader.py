import cv2
import numpy as np
import pytest
from tests.support.hand_films import (
    ROOT,
    frames_of,
    needs_networks,
    truth_of,
    turned_image,
    turned_pixels,
)

from intent_tracking.hands.hand_reader import HandReader, HandReaderConfig

pytestmark = [needs_networks, pytest.mark.slow]
FILM, FRAMES = "wash_glass", 48


@pytest.fixture(scope="module")
def reader():
    return HandReader()


def read_all(reader, images):
    reader.reset()
    return [reader.read(image) for image in images]


def test_right_hand_is_followed_through_a_film(reader):
    frames, truth = frames_of(FILM, FRAMES), truth_of(ROOT / "bags" / FILM)
    seen = read_all(reader, [frame.color for frame in frames])
    for i in range(20, FRAMES):
        (hand,) = seen[i]
        assert hand.identity == 0
        assert hand.right > 0.5
        fingers = frames[i].camera.project(truth["joints_camera"][i])[5:]
        assert np.median(np.linalg.norm(hand.pixels[5:] - fingers, axis=1)) < 8


def test_mirrored_film_shows_a_left_hand(reader):
    images = [frame.color[:, ::-1].copy() for frame in frames_of(FILM, FRAMES)[30:36]]
    assert all(hand.right < 0.3 for hands in read_all(reader, images) for hand in hands)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_key_points_turn_with_the_image(reader, quarters):
    color = frames_of(FILM, FRAMES)[40].color
    (upright,) = read_all(reader, [color] * 4)[-1]
    (turned,) = read_all(reader, [turned_image(color, quarters)] * 4)[-1]
    expected = turned_pixels(upright.pixels, color.shape, quarters)
    np.testing.assert_allclose(turned.pixels, expected, atol=2.0)
    z, flat = turned.shape[:, 2], turned_pixels(upright.shape[:, :2], (1, 1), quarters)
    np.testing.assert_allclose(z, upright.shape[:, 2], atol=0.005)
    np.testing.assert_allclose(turned.shape[:, :2], flat, atol=0.005)


@pytest.mark.parametrize("factor", [0.5, 2.0, 3.0])
def test_key_points_scale_with_the_image(reader, factor):
    color = frames_of(FILM, FRAMES)[40].color
    larger = cv2.resize(color, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR)
    (hand,), (scaled,) = (read_all(reader, [image] * 3)[-1] for image in (color, larger))
    expected = (hand.pixels + 0.5) * factor - 0.5
    assert np.linalg.norm(scaled.pixels - expected, axis=1).mean() < 2.5 * factor


def test_two_hands_keep_their_numbers_and_sides():
    """Each is a twentieth of the image: both are found in its parts."""
    films = [frame.color for frame in frames_of(FILM, FRAMES)[24:48]]
    pairs = [np.concatenate([image, image[:, ::-1]], axis=1) for image in films]
    seen = read_all(HandReader(HandReaderConfig(second_period=2)), pairs)
    sides = {hand.identity: hand.right > 0.5 for hand in seen[-1]}
    assert sorted(sides.values()) == [False, True]
    for hands in seen[12:]:
        assert {hand.identity: hand.pixels[:, 0].mean() < 640 for hand in hands} == sides


def test_hand_that_was_hidden_for_a_moment_keeps_its_number(reader):
    films = [frame.color for frame in frames_of(FILM, FRAMES)[30:34]]
    seen = read_all(reader, [*films, *[np.zeros_like(films[0])] * 5, *films, *films])
    assert seen[6] == ()
    assert [hand.identity for hand in seen[-1]] == [0]


def test_same_film_gives_the_same_bits(reader):
    images = [frame.color for frame in frames_of(FILM, FRAMES)[25:35]]
    first, second = read_all(reader, images), read_all(reader, images)
    for one, other in zip(first, second, strict=True):
        assert [hand.pixels.tobytes() for hand in one] == [hand.pixels.tobytes() for hand in other]


def test_hand_at_the_image_border_is_read_without_failing(reader):
    color = frames_of(FILM, FRAMES)[40].color
    (hand,) = read_all(reader, [color] * 2)[-1]
    u, v = hand.pixels[9].astype(int)
    for part in (color[v:], color[:v], color[:, u:], color[:, :u]):
        for hands in read_all(reader, [np.ascontiguousarray(part)] * 2):
            assert all(np.isfinite(one.pixels).all() for one in hands)


@pytest.mark.parametrize("shape", [(1, 1), (8, 8), (480, 640), (2, 3000)])
def test_image_without_a_hand_has_none(reader, shape):
    image = np.full((*shape, 3), 128, np.uint8)
    assert read_all(reader, [image] * 3)[-1] == ()


def test_grey_hand_is_found(reader):
    color = frames_of(FILM, FRAMES)[40].color
    grey = np.repeat(color.mean(axis=2, keepdims=True).astype(np.uint8), 3, axis=2)
    assert len(read_all(reader, [grey])[-1]) == 1


def test_image_of_one_channel_is_refused(reader):
    with pytest.raises(ValueError, match="expected colour"):
        reader.read(np.zeros((480, 640), np.uint8))


def test_no_hands_to_follow_is_refused():
    with pytest.raises(ValueError, match=r"hands in 1\.\.4"):
        HandReaderConfig(hands=0)
