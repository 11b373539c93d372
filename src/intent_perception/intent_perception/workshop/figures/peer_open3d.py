"""The peer of the recognition benchmark: Open3D's FPFH features, RANSAC and ICP."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.detection import Detector
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.segmentation import segment
from intent_perception.workshop.figures.scoring import Claim

_VOXEL = 0.003
_FEATURE_RADIUS = 0.015
_NEIGHBOURS = 100
_TRIALS = 100_000
_SURENESS = 0.999


@dataclass(frozen=True, eq=False)
class _Prepared:
    cloud: Any
    features: Any


class Open3dPeer:
    """Global registration of each model to all points above the table, then ICP.

    Each model is claimed at most once, with the share of its points that meet the scene (Open3D's
    fitness) as confidence; the caller picks the threshold that suits it best.
    """

    def __init__(self, models: Iterable[ObjectModel], detector: Detector) -> None:
        self._models = tuple(models)
        self._detector = detector  # segmentation is shared: the peer gets the same points
        self._prepared = [
            _prepare(*model.mesh.sample_surface(20_000, np.random.default_rng(0))[:2])
            for model in self._models
        ]

    def find(self, image: OrientedImage) -> list[Claim]:
        """Return one claim per model."""
        from open3d import utility

        utility.random.seed(0)
        parts = segment(image, self._detector.table(image))
        chosen = parts.mask == 1
        if chosen.sum() < 100:
            return []
        scene = _prepare(
            image.points()[chosen].astype(np.float64), image.normals[chosen].astype(np.float64)
        )
        return [
            self._claim(model, prepared, scene)
            for model, prepared in zip(self._models, self._prepared, strict=True)
        ]

    def _claim(self, model: ObjectModel, prepared: _Prepared, scene: _Prepared) -> Claim:
        from open3d.pipelines import registration

        distance = 1.5 * _VOXEL
        found = registration.registration_ransac_based_on_feature_matching(
            prepared.cloud,
            scene.cloud,
            prepared.features,
            scene.features,
            True,
            distance,
            registration.TransformationEstimationPointToPoint(False),
            3,
            [
                registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                registration.CorrespondenceCheckerBasedOnDistance(distance),
            ],
            registration.RANSACConvergenceCriteria(_TRIALS, _SURENESS),
        )
        refined = registration.registration_icp(
            prepared.cloud,
            scene.cloud,
            distance,
            found.transformation,
            registration.TransformationEstimationPointToPlane(),
        )
        return Claim(model, np.asarray(refined.transformation), float(refined.fitness))


def _prepare(points: np.ndarray[Any, Any], normals: np.ndarray[Any, Any]) -> _Prepared:
    from open3d import geometry, utility
    from open3d.pipelines import registration

    cloud = geometry.PointCloud(utility.Vector3dVector(points))
    cloud.normals = utility.Vector3dVector(normals)
    cloud = cloud.voxel_down_sample(_VOXEL)
    cloud.normalize_normals()
    features = registration.compute_fpfh_feature(
        cloud, geometry.KDTreeSearchParamHybrid(radius=_FEATURE_RADIUS, max_nn=_NEIGHBOURS)
    )
    return _Prepared(cloud, features)
