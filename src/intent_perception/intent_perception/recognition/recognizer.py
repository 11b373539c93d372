"""The recogniser of Sec. III-A over a sequence: it looks while no hand is near the objects."""

from collections import Counter
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import require_pose, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.detection import Detection, Detector, DetectorConfig, Findings
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.scene.arm_pixels import ArmConfig, arm_pixels
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.table_plane import TablePlane


@dataclass(frozen=True)
class RecognizerConfig(Checked):
    """Parameters of the recogniser."""

    detection: DetectorConfig = field(default_factory=DetectorConfig)
    """How objects are found in one frame."""
    arm: ArmConfig = field(default_factory=ArmConfig)
    """How an arm over the table is told from objects."""
    least_confidence: float = 0.5
    """Objects less probable are not reported, 0..1."""
    hand_distance: float = 0.10
    """A hand this near an object holds the answer [m], 0..1."""
    edge: float = 0.03
    """Changes this near the table's edge do not count: the demonstrator sits there [m], 0..1."""
    changed_pixels: int = 150
    """Pixels that differ from the last answer's scene when it is looked at again, 1..100000."""
    changed_depth: float = 0.012
    """Difference in depth that counts as a change [m], 0.001..0.1."""


@dataclass(frozen=True, eq=False)
class RecognizedObject:
    """One object found in the scene."""

    id: str
    """Model name; further instances get ".2", ".3" …"""
    model: str
    """Name in the object database."""
    object_class: str
    """Its class."""
    T_table_object: Array
    """(4, 4) pose in the frame `table`."""
    confidence: float
    """Probability that model and pose are right."""
    visible_fraction: float
    """Share of the pixels of the object's silhouette on which it is seen."""

    def __post_init__(self) -> None:
        """Refuse what no recogniser says."""
        require_pose(self.T_table_object, f"T_table_object of {self.id!r}")
        if not (0.0 <= self.confidence <= 1.0 and 0.0 <= self.visible_fraction <= 1.0):
            raise ValueError(f"expected confidence and visibility of {self.id!r} in 0..1")


@dataclass(frozen=True, eq=False)
class RecognizedObjects:
    """All objects found in one frame."""

    stamp: int
    """Of the frame [ns]."""
    objects: tuple[RecognizedObject, ...]
    """In decreasing order of confidence; empty when there is nothing known."""
    T_table_camera: Array
    """(4, 4) camera -> table; the identity where no table is seen."""

    def __post_init__(self) -> None:
        """Refuse a camera that stands nowhere."""
        require_pose(self.T_table_camera, "T_table_camera")

    @property
    def table_seen(self) -> bool:
        """Whether there is a table: else the frame `table` is the camera's own."""
        return not np.array_equal(self.T_table_camera, np.eye(4))


class Recognizer:
    """Finds the objects again and again while no hand is near them, else holds its answer.

    A scene that has not changed keeps its answer, so that the same frames give the same answers
    however many of them a slow machine drops.
    """

    def __init__(
        self,
        database: ObjectDatabase,
        config: RecognizerConfig | None = None,
        T_table_camera: Array | None = None,
    ) -> None:
        """Prepare all models of a database.

        Args:
            database: what can be recognised.
            config: parameters, None = the defaults.
            T_table_camera: (4, 4) of a calibrated camera; None = the table is found in each frame.

        Raises:
            ValueError: if the camera's pose is none.
        """
        self._config = config or RecognizerConfig()
        self._detector = Detector(ModelLibrary.of(database), self._config.detection)
        if T_table_camera is not None:
            T_table_camera = require_pose(T_table_camera, "T_table_camera")
        self._T_table_camera = T_table_camera
        self._answer: RecognizedObjects | None = None
        self._seen: NDArray[np.float32] | None = None

    def reset(self) -> None:
        """Forget the answer that is held."""
        self._answer = None
        self._seen = None

    def step(self, frame: RgbdFrame) -> RecognizedObjects | None:
        """Return what is on the table; None while nothing new can be said.

        The first frame always gives an answer, which is empty where nothing known is seen.
        """
        detector, config = self._detector, self._config
        image = detector.oriented(frame)
        table = detector.table(image)
        arm = arm_pixels(image, table, config.arm)
        if self._answer is not None and (
            table is None or self._held(image, table, arm) or not self._changed(image, table, arm)
        ):
            return None
        if table is None and config.detection.table_share < 1.0:
            # Nothing says what stands out as an object, and a search among everything never ends.
            self._answer = RecognizedObjects(frame.stamp, (), self._frame_of(None))
        else:
            self._answer = self._reported(frame.stamp, detector.find_in(image, table, ~arm))
        self._seen = np.where(arm, np.float32(0.0), image.smooth)
        return self._answer

    def _held(self, image: OrientedImage, table: TablePlane, arm: NDArray[np.bool_]) -> bool:
        """Return whether an arm is near any object of the answer."""
        assert self._answer is not None
        points = image.points()[arm][::7].astype(np.float64)
        if len(points) == 0:
            return False
        hand = transform_points(self._frame_of(table), points)
        for item in self._answer.objects:
            model = self._detector.library.named(item.model)
            center = transform_points(item.T_table_object, model.center)
            gap = np.linalg.norm(hand - center, axis=1).min() - 0.5 * model.diameter
            if gap < self._config.hand_distance:
                return True
        return False

    def _changed(self, image: OrientedImage, table: TablePlane, arm: NDArray[np.bool_]) -> bool:
        """Return whether the scene differs from the one of the answer in more than noise."""
        assert self._seen is not None
        if self._seen.shape != image.smooth.shape:
            return True
        near_arm = cv2.dilate(arm.astype(np.uint8), np.ones((15, 15), np.uint8)) > 0
        both = (self._seen > 0.0) & (image.smooth > 0.0) & ~near_arm
        both &= table.inset(image.points()) > self._config.edge
        differs = both & (np.abs(self._seen - image.smooth) > self._config.changed_depth)
        # single pixels at edges flicker
        steady = differs[1:-1, 1:-1] & differs[:-2, 1:-1] & differs[2:, 1:-1]
        steady &= differs[1:-1, :-2] & differs[1:-1, 2:]
        return int(steady.sum()) > self._config.changed_pixels

    def _frame_of(self, table: TablePlane | None) -> Array:
        if self._T_table_camera is not None:
            return self._T_table_camera
        return np.eye(4) if table is None else table.T_table_camera()

    def _reported(self, stamp: int, findings: Findings) -> RecognizedObjects:
        T_table_camera = self._frame_of(findings.segmentation.table)
        counts: Counter[str] = Counter()
        objects = []
        for detection in findings.detections:
            if detection.confidence < self._config.least_confidence:
                continue
            objects.append(self._object(detection, T_table_camera, counts))
        return RecognizedObjects(stamp, tuple(objects), T_table_camera)

    def _object(
        self, detection: Detection, T_table_camera: Array, counts: Counter[str]
    ) -> RecognizedObject:
        model = self._detector.library.models[detection.model]
        counts[model.name] += 1
        suffix = "" if counts[model.name] == 1 else f".{counts[model.name]}"
        return RecognizedObject(
            id=model.name + suffix,
            model=model.name,
            object_class=model.object_class,
            T_table_object=T_table_camera @ detection.T_camera_object,
            confidence=detection.confidence,
            visible_fraction=detection.visible_fraction,
        )
