"""A recorded run made up for tests of the report: no node has ever said this."""

import numpy as np

from intent_imitation.demo.run_record import DemoRecord, DemoTruth
from intent_imitation.planner.plan import GraspCandidate, GraspPlan, ObjectChoice
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.schunk import JOINT_NAMES
from intent_inference.intention.contributions import Contribution
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.transforms import look_at, make_pose, vector_from_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.scene_state import SceneState

TASKS = ("hand-over", "pouring", "tool-use", "dish-washing")
NAMES = ("mug_1", "bottle_2")
CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
T_TABLE_CAMERA = look_at([0.0, 0.75, 0.55], [0.0, 0.0, 0.06])
STEP = 33_333_333


def recognized(database: ObjectDatabase) -> RecognizedObjects:
    """Return a mug and a bottle side by side."""
    items = []
    for index, name in enumerate(NAMES):
        pose = make_pose(np.eye(3), [0.2 * index - 0.1, 0.0, 0.0]) @ database[name].stable_poses[0]
        kind = database[name].object_class
        items.append(RecognizedObject(name, name, kind, pose, 0.9, 0.8))
    return RecognizedObjects(0, tuple(items), T_TABLE_CAMERA)


def state(objects: RecognizedObjects, stamp: int, visible: bool) -> SceneState:
    """Return a state with or without a hand beside the mug."""
    hand = np.concatenate([[-0.05, 0.12, 0.05], [0.0, 0.0, -1.5], np.full(20, 0.3)])
    if not visible:
        hand = np.full(26, np.nan)
    poses = [vector_from_pose(item.T_table_object) for item in objects.objects]
    values = np.concatenate([hand, *poses])
    classes = tuple(item.object_class for item in objects.objects)
    return SceneState(
        stamp, "right", values, np.abs(values), HandModel().shape, NAMES, NAMES, classes,
        T_TABLE_CAMERA, 0.1, visible, False, (False, False),
    )  # fmt: skip


def posterior(stamp: int, preliminary: bool) -> TaskPosterior:
    """Return a posterior that favours pouring."""
    reasons = tuple(
        Contribution(task, name, value)
        for task in TASKS
        for name, value in (("dir", 1.0), ("npos", -0.5))
    )
    chances = np.array([0.4, 0.9, 0.05, 0.3])
    return TaskPosterior(
        stamp, "mug_1", "mug", TASKS, chances, np.array([0.2, 0.5, 0.0, 0.1, 0.2]),
        "REACH" if preliminary else "GRASP", "pouring", ("pouring",), preliminary, 3.0,
        ("fvol",), () if preliminary else reasons,
    )  # fmt: skip


def plan(objects: RecognizedObjects, stamp: int) -> GraspPlan:
    """Return a plan that holds the mug from the side."""
    rotation = np.stack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], axis=1)
    place = objects.objects[0].T_table_object[:3, 3] - [0.0, 0.155, 0.0]
    closed = np.radians([0.0, -8.0, 38.0, -8.0, 38.0, -8.0, 38.0])
    parts = {"task": 0.9, "stability": 0.8, "clearance": 0.02}
    candidate = GraspCandidate(
        "mug_1", make_pose(rotation, place), rotation[:, 2], 0.0 * closed, closed, 0.85, parts
    )
    choices = (ObjectChoice("mug_1", "mug", 0.8, True), ObjectChoice("bottle_2", "", 0.2, False))
    return GraspPlan(stamp, "pouring", False, choices, (candidate,), "schunk", JOINT_NAMES)


def record(database: ObjectDatabase, complete: bool = True) -> DemoRecord:
    """Return a run of 12 frames with a grasp at frame 8, or one in which nothing happened."""
    objects = recognized(database)
    stamps = [index * STEP for index in range(12)]
    grey = np.full((120, 160, 3), 200, dtype=np.uint8)
    depth = np.zeros((120, 160), dtype=np.float32)
    frames = tuple(RgbdFrame(stamp, grey, depth, CAMERA) for stamp in stamps)
    states = tuple(state(objects, stamp, complete and k > 1) for k, stamp in enumerate(stamps))
    if not complete:
        return DemoRecord(
            "empty", frames, None, states, (), (), None, None, None, database, 12, 0, 1.0
        )
    nothing = GraspFeatures(*[None] * 9)
    grasp = StableGrasp(stamps[8], "mug_1", "mug_1", "mug", "right", nothing, None, np.eye(4))
    said = (*(posterior(stamp, True) for stamp in stamps[3:8]), posterior(stamps[8], False))
    return DemoRecord(
        "made_up", frames, objects, states, (grasp,), said, plan(objects, stamps[8]), frames[0],
        objects, database, 12, 1, 3.5, DemoTruth("pouring", stamps[8], 0.0115),
        robot_hand=GraspingHand.load("schunk"),
    )  # fmt: skip
