"""How near a grasp is to those of a table: the angles between them."""

import numpy as np

from intent_inference.quantisation.feature_table import Features
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_perception.basics.arrays import Array
from intent_tracking.grasp.grasp_features import GraspFeatures


def nearest_grasp(grasp: GraspFeatures, table: Features) -> float:
    """Return how far the nearest grasp of the same class is off [rad].

    Three angles alike: between the hands' orientations, between the sides of the object on which
    they are, and of the finger joints (root mean square).

    Args:
        grasp: with class, dir, npos and fcon; NaN comes back where one of them is unknown.
        table: of N grasps, with the same variables.
    """
    if grasp.dir is None or grasp.npos is None or grasp.fcon is None:
        return float("nan")
    alike = np.asarray(table[OBJECT_CLASS], dtype=str) == (grasp.object_class or "")
    if not alike.any():
        return float("nan")
    turn = 2.0 * _angle(np.abs(table["dir"][alike] @ grasp.dir))
    side = _angle(table["npos"][alike] @ grasp.npos)
    fingers = np.sqrt(np.mean((table["fcon"][alike] - grasp.fcon) ** 2, axis=1))
    return float(np.nanmin((turn + side + fingers) / 3.0))


def _angle(cosine: Array) -> Array:
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))
