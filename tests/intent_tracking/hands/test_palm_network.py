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

from intent_tracking.hands.hand_square import whole_image
from intent_tracking.hands.networks.palm_network import PalmNetwork, anchor_centers, merged_palms


def test_anchors_are_the_cells_centres():
    anchors = anchor_centers(192)
    assert anchors.shape == (2016, 2)
    np.testing.assert_allclose(anchors[0], 3.5)  # the middle of pixels 0..7
    np.testing.assert_allclose(anchors[2 * 24 * 24], 7.5)
    np.testing.assert_allclose(np.sort(191 - anchors, axis=0), np.sort(anchors, axis=0))


def answers(*boxes):
    """Anchors, values and scores of boxes (u, v, size, score)."""
    values = np.zeros((len(boxes), 18), np.float32)
    values[:, 2:4] = [[size, size] for *_, size, _ in boxes]
    return np.array([b[:2] for b in boxes], float), values, np.array([b[3] for b in boxes])


def test_answers_for_one_palm_are_averaged_by_their_scores():
    palms = merged_palms(*answers((50, 50, 40, 0.9), (53, 50, 40, 0.6)), 0.5)
    assert len(palms) == 1
    assert palms[0][0] == 0.9
    np.testing.assert_allclose(palms[0][1][2], [51.2, 50])


def test_palms_apart_are_two_best_first():
    palms = merged_palms(*answers((20, 20, 30, 0.6), (120, 20, 30, 0.8)), 0.5)
    assert [score for score, _ in palms] == [0.8, 0.6]


def test_unlikely_answers_are_no_palms():
    assert merged_palms(*answers((20, 20, 30, 0.4)), 0.5) == []


@needs_networks
@pytest.mark.slow
@pytest.mark.parametrize("quarters", range(4))
def test_palm_is_found_however_the_camera_is_rolled(quarters):
    frame = frames_of("wash_glass", 31)[30]
    hand = frame.camera.project(truth_of(ROOT / "bags" / "wash_glass")["joints_camera"][30])
    image = turned_image(frame.color, quarters)
    network = PalmNetwork("palm_detection_lite")
    palms = network.find(image, whole_image(image.shape[1], image.shape[0]), 0.5)
    middle = turned_pixels(hand, frame.color.shape, quarters).mean(axis=0)
    assert min(np.linalg.norm(p.square.center - middle) / p.square.side for p in palms) < 0.35
