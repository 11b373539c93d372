"""Detection of known objects in one RGB-D frame (Sec. III-A): hypothesise, verify, select."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.alignment import align
from intent_perception.camera import RgbdFrame
from intent_perception.conflict import Evidence, Selection, select
from intent_perception.explanation import COUNTS, DRAWN, MATCH, draw, explain, settle
from intent_perception.geometry import Array
from intent_perception.hypotheses import Slots, sample_pairs
from intent_perception.model_library import ModelLibrary
from intent_perception.oriented_image import OrientedImage, orient
from intent_perception.segmentation import Segmentation, segment
from intent_perception.table import TablePlane, find_table
from intent_perception.table_prior import sample_resting
from intent_perception.verification import support_of_all

Floats = NDArray[np.float32]

_SLOTS = 3  # poses kept of each model in each image cell


@dataclass(frozen=True)
class DetectorConfig:
    """Parameters of the detector."""

    focal_length: float = 525.0
    """Images of a longer focal length are reduced to about this one [pixel]."""
    max_depth: float = 1.8
    """Measurements beyond are ignored [m]."""
    normal_radius: float = 0.009
    """Half the window in which normals are estimated [m]."""
    table_tolerance: float = 0.008
    """Deviation of the table top from a plane [m], 0.001..0.05."""
    table_share: float = 0.15
    """Least share of the image that a table covers, 0..1."""
    pair_iterations: int = 4000
    """Scene point pairs drawn."""
    pair_lookups: int = 240
    """Model pairs tried for each of them."""
    hash_only: bool = False
    """Whether to do without the table prior, as the paper does."""
    resting_points: int = 900
    """Scene points from which resting poses are proposed."""
    resting_lookups: int = 600
    """Resting model points tried for each of them."""
    refined_per_model: int = 48
    """Hypotheses of each model that are refined on their points."""
    drawn: int = 160
    """Hypotheses that are drawn and held against the depth image."""
    tolerance: float = 0.006
    """Depth difference of a match at 1 m [m]."""
    least_pixels: float = 80.0
    """Pixels an object must explain."""
    least_quality: float = 0.6
    """Least share of the judged pixels that must match."""
    seed: int = 0
    """Of all random draws."""


@dataclass(frozen=True, eq=False)
class Detection:
    """An object found, in the camera frame, with what speaks for it."""

    model: int
    """Number in the library."""
    T_camera_object: Array
    """(4, 4)."""
    confidence: float
    """Probability that it is right."""
    visible_fraction: float
    """Share of its silhouette that is seen."""
    features: Floats
    """What the confidence is computed from."""


@dataclass(frozen=True, eq=False)
class Findings:
    """Everything that recognition says about one frame."""

    detections: tuple[Detection, ...]
    """Best first."""
    image: OrientedImage
    """The scene as it was seen."""
    segmentation: Segmentation
    """Its parts."""
    hypotheses: int
    """How many were generated."""


class Detector:
    """The stages of Sec. III-A over one library of models."""

    def __init__(self, library: ModelLibrary, config: DetectorConfig) -> None:
        self.library = library
        self.config = config

    def oriented(self, frame: RgbdFrame) -> OrientedImage:
        """Return points and normals of a frame."""
        config = self.config
        return orient(frame, config.focal_length, config.normal_radius, config.max_depth)

    def table(self, image: OrientedImage) -> TablePlane | None:
        """Return the table of a scene, None if there is none."""
        rng = np.random.default_rng(self.config.seed)
        return find_table(image, rng, self.config.table_tolerance, self.config.table_share)

    def find(self, frame: RgbdFrame) -> Findings:
        """Return all objects of the library in a frame."""
        image = self.oriented(frame)
        return self.find_in(image, self.table(image), None)

    def find_in(
        self, image: OrientedImage, table: TablePlane | None, allowed: NDArray[np.bool_] | None
    ) -> Findings:
        """Return all objects of the library in a scene.

        Args:
            image: the scene.
            table: its table, if it has one.
            allowed: (H, W) pixels that may be objects, None = all.
        """
        config = self.config
        rng = np.random.default_rng(config.seed)
        parts = segment(image, table, allowed)
        models, poses, hypotheses = self._hypotheses(image, parts, rng)
        models, poses = self._refined(image, parts, models, poses)
        evidence, poses = self._drawn(image, parts, models, poses)
        chosen = select(evidence, image.depth.shape, config.least_pixels, config.least_quality, 0.5)
        detections = self._detections(image, parts, models, poses, evidence, chosen)
        return Findings(detections, image, parts, hypotheses)

    def _hypotheses(
        self, image: OrientedImage, parts: Segmentation, rng: np.random.Generator
    ) -> tuple[NDArray[np.int64], Floats, int]:
        library, config = self.library, self.config
        height, width = image.depth.shape
        slots = Slots.empty(len(library), height, width, _SLOTS)
        pixels = np.argwhere(parts.mask == 1).astype(np.int64)
        if len(pixels) < config.least_pixels:
            return np.zeros(0, np.int64), np.zeros((0, 12), np.float32), 0
        points, intrinsics = image.points(), _intrinsics(image)
        tolerance = config.tolerance * 1.7
        made = 0
        if parts.table is not None and not config.hash_only:
            spread = rng.choice(len(pixels), min(config.resting_points, len(pixels)), replace=False)
            made += sample_resting(
                config.resting_lookups,
                rng,
                pixels[np.sort(spread)],
                points,
                image.smooth,
                image.normals,
                parts.mask,
                intrinsics,
                parts.table.T_table_camera().astype(np.float32),
                library.resting.starts,
                library.resting.entries,
                library.resting.poses,
                library.points,
                library.normals,
                library.offsets,
                library.coarse,
                library.axes,
                tolerance,
                slots.columns,
                slots.score,
                slots.pose,
            )
        made += sample_pairs(
            config.pair_iterations,
            config.pair_lookups,
            rng,
            pixels,
            points,
            image.smooth,
            image.normals,
            parts.mask,
            intrinsics,
            library.pairs.distances,
            library.pairs.tolerance,
            library.pairs.starts,
            library.pairs.entries,
            library.points,
            library.normals,
            library.offsets,
            library.coarse,
            library.axes,
            _plane(parts.table),
            tolerance,
            slots.columns,
            slots.score,
            slots.pose,
        )
        models, _, poses = slots.best(config.refined_per_model)
        return models, poses, made

    def _refined(
        self,
        image: OrientedImage,
        parts: Segmentation,
        models: NDArray[np.int64],
        poses: Floats,
    ) -> tuple[NDArray[np.int64], Floats]:
        library, config = self.library, self.config
        surface = (library.points, library.normals, library.offsets)
        scene = (image.smooth, image.normals, parts.mask, _intrinsics(image))
        steps = np.array([0.016, 0.012, 0.010, 0.008, 0.008], np.float32)
        align(poses, models, *surface, 160, *scene, steps)
        result = support_of_all(poses, models, *surface, *scene, config.tolerance, 0.6)
        worth = result[:, 0]
        # every model keeps a share, the rest goes to the best of all
        order = np.argsort(-worth, kind="stable")
        rank = np.zeros(len(models), np.int64)
        for number in range(len(library)):
            mine = order[models[order] == number]
            rank[mine] = np.arange(len(mine))
        quota = max(2, config.drawn // (2 * len(library)))
        first = order[(rank[order] < quota) & (worth[order] > 0.25)]
        rest = order[(rank[order] >= quota) & (worth[order] > 0.25)]
        kept = np.concatenate([first, rest])[: config.drawn]
        return models[kept], poses[kept]

    def _drawn(
        self,
        image: OrientedImage,
        parts: Segmentation,
        models: NDArray[np.int64],
        poses: Floats,
    ) -> tuple[Evidence, Floats]:
        library = self.library
        intrinsics = _intrinsics(image)
        steps = np.array([0.010, 0.007, 0.005], np.float32)
        values, windows, counts, start = [], [], [], 0
        for number, pose in zip(models, poses, strict=True):
            mesh = (library.vertices[number], library.faces[number])
            settle(pose, *mesh, image.smooth, image.normals, parts.mask, intrinsics, steps, 2)
            value, window, count = self._evidence(image, parts, number, pose)
            values.append(value.ravel())
            windows.append((*window, value.shape[1], value.shape[0], start))
            counts.append(count)
            start += value.size
        evidence = Evidence(
            np.concatenate([*values, np.zeros(0, np.float32)]),
            np.array(windows, np.int64).reshape(-1, 5),
            np.array(counts, np.float32).reshape(-1, COUNTS),
        )
        return evidence, poses

    def _evidence(
        self, image: OrientedImage, parts: Segmentation, number: int, pose: Floats
    ) -> tuple[Floats, tuple[int, int], Floats]:
        intrinsics = _intrinsics(image)
        left, top, drawn = draw(
            pose,
            self.library.vertices[number],
            self.library.faces[number],
            intrinsics,
            *image.depth.shape,
        )
        value, count = explain(
            left,
            top,
            drawn,
            image.depth,
            image.smooth,
            image.normals,
            parts.mask,
            intrinsics,
            self.config.tolerance,
        )
        return value, (left, top), count

    def _detections(
        self,
        image: OrientedImage,
        parts: Segmentation,
        models: NDArray[np.int64],
        poses: Floats,
        evidence: Evidence,
        selection: Selection,
    ) -> tuple[Detection, ...]:
        steps = np.array([0.006, 0.005, 0.004, 0.004], np.float32)
        found = []
        quality = evidence.quality()
        for index, new in zip(selection.chosen, selection.new, strict=True):
            number, pose = int(models[index]), poses[index].copy()
            settle(
                pose,
                self.library.vertices[number],
                self.library.faces[number],
                image.depth,
                image.normals,
                parts.mask,
                _intrinsics(image),
                steps,
                1,
            )
            counts = evidence.counts[index]
            visible = float(counts[MATCH] / max(counts[DRAWN], 1.0))
            features = np.array([quality[index], visible, new, counts[MATCH]], np.float32)
            found.append(
                Detection(
                    number,
                    self.library.object_pose(number, pose),
                    float(quality[index]),
                    visible,
                    features,
                )
            )
        return tuple(sorted(found, key=lambda d: -d.confidence))


def _intrinsics(image: OrientedImage) -> Floats:
    camera = image.camera
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)


def _plane(table: TablePlane | None) -> Floats:
    if table is None:
        return np.zeros(4, np.float32)
    return np.array([*table.normal, table.offset], np.float32)
