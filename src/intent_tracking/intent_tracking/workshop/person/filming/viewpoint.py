"""Where a camera may stand: in front, beside, above, rolled, on the demonstrator's head."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.transforms import look_at
from intent_perception.workshop.scenes.sensor_noise import KinectNoise

PLACEMENTS = ("facing", "side", "above", "rolled", "upside down", "head")
NEAREST, FARTHEST = 0.40, 1.20
"""Range of the distance to where the hand works [m]."""

STEREO = Camera(640, 480, 615.0, 615.0, 322.0, 241.0)
"""About what a stereo camera for the desk has at this size."""
STRUCTURED_NOISE = KinectNoise(nearest=0.2, farthest=3.0)
"""A Kinect that also measures near things."""
STEREO_NOISE = KinectNoise(
    nearest=0.2, farthest=3.0, axial_growth=0.0040, axial_correlation=2.5, lateral=1.4,
    edge_dropout=0.4, grazing=70.0,
)  # fmt: skip
"""Block matching: error that is alike over several pixels and grows faster, ragged outlines."""


def sample_viewpoint(placement: str, edge: float, rng: np.random.Generator) -> Array:
    """Return T_table_camera (4, 4) of a camera of the given placement.

    Args:
        placement: one of `PLACEMENTS`.
        edge: y of the table edge at the demonstrator's side [m].
        rng: source of the rest.

    Raises:
        ValueError: if there is no such placement.
    """
    if placement not in PLACEMENTS:
        raise ValueError(f"expected one of {', '.join(PLACEMENTS)}, got {placement!r}")
    target = np.array([rng.uniform(-0.04, 0.04), rng.uniform(0.0, 0.08), rng.uniform(0.05, 0.12)])
    if placement == "head":
        eye = np.array([rng.uniform(-0.08, 0.08), edge + rng.uniform(0.0, 0.06), 0.0])
        eye[2] = rng.uniform(0.42, 0.62)
        return look_at(eye, target * [1.0, 1.0, 0.3], np.array([0.0, -1.0, 0.6]))
    distance = rng.uniform(NEAREST, FARTHEST)
    pose = look_at(target + distance * _direction(placement, rng), target, _upward(placement, rng))
    quarter = 90.0 if rng.random() < 0.5 else -90.0
    turn = {"rolled": quarter, "upside down": 180.0}.get(placement, 0.0)
    return rolled(pose, np.radians(turn + rng.uniform(-6.0, 6.0)))


def rolled(T_table_camera: Array, angle: float) -> Array:
    """Return a camera's pose (4, 4) turned about its line of sight [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    turned = T_table_camera.copy()
    turned[:3, :3] = T_table_camera[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return turned


def _direction(placement: str, rng: np.random.Generator) -> Array:
    """Return the unit direction (3,) from the table to the camera."""
    down = np.radians(rng.uniform(*((68.0, 88.0) if placement == "above" else (15.0, 50.0))))
    yaw = np.radians(rng.uniform(-35.0, 35.0))
    if placement == "side":
        yaw = np.radians(rng.choice([-1.0, 1.0]) * rng.uniform(60.0, 105.0))
    return np.array([np.sin(yaw) * np.cos(down), -np.cos(yaw) * np.cos(down), np.sin(down)])


def _upward(placement: str, rng: np.random.Generator) -> Array:
    """Return what is up in the image: seen from above, any side of the table."""
    if placement != "above":
        return np.array([0.0, 0.0, 1.0])
    turn = rng.uniform(-np.pi, np.pi)
    return np.array([np.sin(turn), np.cos(turn), 0.0])
