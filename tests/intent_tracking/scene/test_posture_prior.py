import numpy as np

from intent_tracking.scene.hand_model import LIMITS
from intent_tracking.scene.posture_prior import shipped_posture, surprise
from intent_tracking.workshop.figures.posture_fit import OPEN, posture_of


def test_the_mean_posture_surprises_least():
    posture = shipped_posture()
    rng = np.random.default_rng(0)
    others = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (50, 20)).astype(np.float32)
    assert surprise(posture, posture.mean) == 0.0
    assert min(surprise(posture, other) for other in others) > 0.0


def test_an_open_hand_surprises_less_than_a_thumb_folded_into_the_palm():
    folded = OPEN.copy()
    folded[:4] = np.radians([-10, 5, 80, 80])
    posture = shipped_posture()
    usual = surprise(posture, OPEN.astype(np.float32))
    assert usual < 0.5 * surprise(posture, folded.astype(np.float32))


def test_a_gaussian_of_grasps_lies_between_them_and_the_open_hand():
    grasps = np.tile(np.radians(np.arange(20.0)), (400, 1))
    mean = posture_of(grasps, np.random.default_rng(1)).mean
    share = (mean - OPEN) / (grasps[0] - OPEN)
    np.testing.assert_allclose(share, 0.75, atol=0.03)
