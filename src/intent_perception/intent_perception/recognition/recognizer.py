"""The recogniser of Sec. III-A over a sequence: it looks while no hand is near the objects."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import inverse, require_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig, oriented_scene, table_of
from intent_perception.recognition.estimation.shape_estimator import estimated_shapes
from intent_perception.recognition.estimation.shape_memory import KeptShape, ShapeMemory
from intent_perception.recognition.findings import Detection, Findings
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.scene_change import ChangeConfig, SceneMemory, centers_of
from intent_perception.scene.arm_pixels import ArmConfig, arm_pixels
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.scene.table_plane import TablePlane

_SAME_PLACE = 0.05
"""An object found again within this distance keeps its id [m]."""


@dataclass(frozen=True)
class RecognizerConfig(Checked):
    """Parameters of the recogniser."""

    detection: DetectorConfig = field(default_factory=DetectorConfig)
    """How objects are found in one frame."""
    arm: ArmConfig = field(default_factory=ArmConfig)
    """How an arm over the table is told from objects."""
    change: ChangeConfig = field(default_factory=ChangeConfig)
    """When a scene is looked at again."""
    least_confidence: float = 0.5
    """Objects less probable are not reported, 0..1."""


@dataclass(frozen=True, eq=False)
class RecognizedObject:
    """One object found in the scene."""

    id: str
    """Model name; further instances get ".2", ".3" …"""
    model: str
    """Name in the object database; of an estimated shape, that of its present revision."""
    object_class: str
    """Its class."""
    T_table_object: Array
    """(4, 4) pose in the frame `table`."""
    confidence: float
    """Probability that model and pose are right."""
    visible_fraction: float
    """Share of the pixels of the object's silhouette on which it is seen."""
    shape: ObjectModel | None = None
    """What it looks like, where that is estimated; None for an object of the database."""
    revision: int = 0
    """Of the estimated shape; grows as it improves."""

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
    """(4, 4) camera -> table; the identity where no table is seen and none is calibrated."""
    complete: bool = True
    """False: a first answer; what is still being looked at follows with the same stamp."""

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
            database: what can be recognised; it learns the shapes of what is not in it.
            config: parameters, None = the defaults.
            T_table_camera: (4, 4) of a calibrated camera; None = the table is found in each frame.

        Raises:
            ValueError: if the camera's pose is none.
        """
        self._config = config or RecognizerConfig()
        self._database = database
        self._detector = Detector(ModelLibrary.of(database), self._config.detection)
        self._things = ShapeMemory()
        self._memory = SceneMemory(self._config.change, self._config.arm, self._config.detection)
        if T_table_camera is not None:
            T_table_camera = require_pose(T_table_camera, "T_table_camera")
        self._T_table_camera = T_table_camera
        self.up: Array | None = None if T_table_camera is None else T_table_camera[2, :3]
        """(3,) the vertical in the camera's frame, where a calibration or an IMU tells it."""
        self.reset()

    def reset(self) -> None:
        """Forget the answer that is held."""
        self._answer: RecognizedObjects | None = None
        self._found: tuple[Detection, ...] = ()
        self._stands = False
        self._memory.forget()
        self._things.forget()

    def step(self, frame: RgbdFrame) -> RecognizedObjects | None:
        """Return what is on the table; None while nothing new can be said.

        The first frame always gives an answer, which is empty where nothing known is seen.
        """
        answers = list(self.looks(frame))
        return answers[-1] if answers else None

    def looks(self, frame: RgbdFrame) -> Iterator[RecognizedObjects]:
        """Yield what is on the table as it becomes known, nothing while nothing new can be said.

        First the table alone, then the objects that a first look finds, last the complete answer.
        """
        if self._stands and not self._differs(frame):
            return
        image = self._detector.oriented(frame)
        table = self._detector.table(image, self.up)
        if table is None and self._answer is not None:
            return
        everything = self._config.detection.table_share >= 1.0
        start = RecognizedObjects(frame.stamp, (), self._frame_of(table), table is None)
        if not everything and not self._stands:
            # Without a table nothing stands out, and a search among everything never ends.
            self._answer = start
            yield start
        if table is not None or everything:
            allowed = ~arm_pixels(image, table, self._config.arm)
            for findings in self._detector.looks(image, table, allowed, self._found):
                yield self._reported(frame.stamp, findings)
            self._memory.keep(frame, self.up)
            self._stands = True

    def _differs(self, frame: RgbdFrame) -> bool:
        """Return whether the scene is another one than that of the answer."""
        assert self._answer is not None
        objects, T_camera_table = self._answer.objects, inverse(self._answer.T_table_camera)
        models = [item.shape or self._detector.library.named(item.model) for item in objects]
        poses = np.reshape([T_camera_table @ item.T_table_object for item in objects], (-1, 4, 4))
        centers = centers_of(poses, np.reshape([model.center for model in models], (-1, 3)))
        return self._memory.differs(frame, centers, np.array([0.5 * m.diameter for m in models]))

    def _frame_of(self, table: TablePlane | None) -> Array:
        if self._T_table_camera is not None:
            return self._T_table_camera
        return np.eye(4) if table is None else table.T_table_camera()

    def _reported(self, stamp: int, findings: Findings) -> RecognizedObjects:
        """Return the answer of a look, and keep what it found."""
        T_table_camera = self._frame_of(findings.segmentation.table)
        least = self._config.least_confidence
        self._found = tuple(one for one in findings.detections if one.confidence >= least)
        before = self._answer.objects if self._answer is not None else ()
        objects: list[RecognizedObject] = []
        for detection in self._found:
            objects.append(self._object(detection, T_table_camera, before, objects))
        if findings.complete:
            objects += self._estimated(findings, T_table_camera, {item.id for item in objects})
        self._answer = RecognizedObjects(stamp, tuple(objects), T_table_camera, findings.complete)
        return self._answer

    def _estimated(
        self, findings: Findings, T_table_camera: Array, taken: set[str]
    ) -> list[RecognizedObject]:
        """Return what no object of the database explains, in a calibrated camera's table frame."""
        table = findings.segmentation.table
        if table is None:
            return []
        T_frame_table = T_table_camera @ inverse(table.T_table_camera())
        things = self._things.named(findings.shapes, taken)
        for kept in things:
            if kept.shape.model.name not in self._database:
                self._database.learn(kept.shape.model)
        return [_thing(kept, T_frame_table) for kept in things]

    def _object(
        self,
        detection: Detection,
        T_table_camera: Array,
        before: Sequence[RecognizedObject],
        others: Sequence[RecognizedObject],
    ) -> RecognizedObject:
        model = self._detector.library.models[detection.model]
        pose = T_table_camera @ detection.T_camera_object
        return RecognizedObject(
            id=_name(model.name, pose, before, others),
            model=model.name,
            object_class=model.object_class,
            T_table_object=pose,
            confidence=detection.confidence,
            visible_fraction=detection.visible_fraction,
        )


def _thing(kept: KeptShape, T_frame_table: Array) -> RecognizedObject:
    """Return a thing as it is reported, in the frame to which T_frame_table (4, 4) leads."""
    shape = kept.shape
    return RecognizedObject(
        id=kept.id,
        model=shape.model.name,
        object_class=shape.object_class,
        T_table_object=T_frame_table @ shape.T_table_object,
        confidence=shape.confidence,
        visible_fraction=shape.likeness.visible,
        shape=shape.model,
        revision=kept.revision,
    )


def _name(
    model: str,
    pose: Array,
    before: Sequence[RecognizedObject],
    others: Sequence[RecognizedObject],
) -> str:
    """Return the id of an object: the one that it had before, else the first that is free."""
    taken = {item.id for item in others}
    alike = [item for item in before if item.model == model and item.id not in taken]
    for item in alike:
        if np.linalg.norm(item.T_table_object[:3, 3] - pose[:3, 3]) < _SAME_PLACE:
            return item.id
    number = 1
    while (name := model if number == 1 else f"{model}.{number}") in taken:
        number += 1
    return name


def table_alone(frame: RgbdFrame, config: DetectorConfig | None = None) -> RecognizedObjects:
    """Return the table of a frame as the recogniser sees it, and no object."""
    config = config or DetectorConfig()
    table = table_of(oriented_scene(frame, config), config)
    T_table_camera = np.eye(4) if table is None else table.T_table_camera()
    return RecognizedObjects(frame.stamp, (), T_table_camera)


def things_alone(frame: RgbdFrame, config: RecognizerConfig | None = None) -> RecognizedObjects:
    """Return everything on the table of a frame by its estimated shape, as if none were known."""
    config = config or RecognizerConfig()
    image = oriented_scene(frame, config.detection)
    table = table_of(image, config.detection)
    if table is None:
        return RecognizedObjects(frame.stamp, (), np.eye(4))
    scene = SceneView.of(image, segment(image, table, ~arm_pixels(image, table, config.arm)))
    rng = np.random.default_rng(config.detection.seed)
    shapes = estimated_shapes(scene, table.T_table_camera(), rng)
    things = tuple(_thing(kept, np.eye(4)) for kept in ShapeMemory().named(shapes, set()))
    return RecognizedObjects(frame.stamp, things, table.T_table_camera())
