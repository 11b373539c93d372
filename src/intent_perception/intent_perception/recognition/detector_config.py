"""Parameters of the detector, and the scene as they show it."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.scene.oriented_image import OrientedImage, orient
from intent_perception.scene.table_plane import TablePlane
from intent_perception.scene.table_search import find_table


@dataclass(frozen=True)
class DetectorConfig(Checked):
    """Parameters of the detector."""

    focal_length: float = 525.0
    """Images of a longer focal length are reduced to about this one [pixel], 100..2000."""
    max_depth: float = 1.8
    """Measurements beyond are ignored [m], 0.3..100."""
    normal_radius: float = 0.009
    """Half the window in which normals are estimated [m], 0.002..0.1."""
    table_tolerance: float = 0.008
    """Deviation of the table top from a plane [m], 0.001..0.05."""
    table_share: float = 0.15
    """Least share of the image that a table covers, 0..1."""
    success: float = 0.7
    """Probability with which point pairs alone find an object of the assumed share, 0.5..0.9999."""
    assumed_share: float = 0.25
    """Share of all points above the table that lie on such an object, 0.01..1."""
    pair_lookups: int = 120
    """Model pairs tried for each of them, 1..100000."""
    hash_only: bool = False
    """Whether to do without the table prior, as the paper does."""
    resting_points: int = 450
    """Scene points from which resting poses are proposed, 1..100000."""
    resting_lookups: int = 300
    """Resting model points tried for each of them, 1..100000."""
    glance: float = 0.25
    """Share of all these draws in the first look; the second makes all of them on what the first
    leaves open, 0.001..1."""
    sure: float = 0.9
    """Objects of the first look at least this probable are not searched for again, 0..1."""
    refined_per_model: int = 80
    """Hypotheses of each model that are refined on their points, 1..10000."""
    tolerance: float = 0.006
    """Depth difference of a match at 1 m [m], 0.0005..0.1."""
    least_pixels: float = 80.0
    """Pixels an object must explain, 1..100000."""
    least_quality: float = 0.6
    """Least share of the judged pixels that must match, 0..1."""
    estimate: bool = True
    """Whether the shapes of things that are in no database are estimated."""
    seed: int = 0
    """Seed of all random draws, 0..2147483647."""

    @classmethod
    def for_clouds(cls) -> "DetectorConfig":
        """Return the parameters for clouds, in which no direction is up and no table is sought."""
        return cls(table_share=1.0, max_depth=100.0)


def oriented_scene(frame: RgbdFrame, config: DetectorConfig, reduced: int = 1) -> OrientedImage:
    """Return points and normals of a frame, on images smaller by a factor than recognition's."""
    return orient(frame, config.focal_length / reduced, config.normal_radius, config.max_depth)


def table_of(
    image: OrientedImage, config: DetectorConfig, up: Array | None = None
) -> TablePlane | None:
    """Return the table of a scene, None if there is none.

    Args:
        image: the scene.
        config: what a table is.
        up: (3,) the vertical in the camera's frame, None = the scene tells it.
    """
    rng = np.random.default_rng(config.seed)
    return find_table(image, rng, config.table_tolerance, config.table_share, up)
