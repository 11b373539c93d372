"""The measurements behind the task labels: one margin per term of share/label_rules.yaml.

A margin is (value - threshold) / scale or its negative: at least 0 where the term passes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from intent_inference.grasping.contacts import Contacts, finger_of_links, holding_force
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.receivers import ReceiverBank
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import across, rotation_from_vector
from intent_perception.objects.database import Functions
from intent_tracking.grasp.grasp_features import hand_distances

GRAVITY = 9.81
_TOOL_AXIS = np.array([0.0, 0.0, 1.0])
"""Handle -> functional end in the object frame of knife, hammer and screwdriver."""

_LEAST_ACROSS = 0.35
_RINGS, _SPOKES = 6, 24
_DISC = np.stack(
    [
        np.repeat(np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS), _SPOKES)
        * turn(np.tile(np.arange(_SPOKES) * 2.0 * np.pi / _SPOKES, _RINGS))
        for turn in (np.cos, np.sin)
    ],
    axis=1,
)
"""(144, 2) points that share a disc of radius 1 evenly."""

Rule = dict[str, Any]
Terms = dict[str, float]


@dataclass(frozen=True, eq=False)
class GraspScene:
    """A stable grasp as the label rules see it; everything in the object frame."""

    target: TaskObject
    hand: GraspingHand
    T_object_hand: Array
    joints: Array
    contacts: Contacts
    centers: Array
    """(S, 3) centres of the spheres that cover hand and forearm [m]."""
    radii: Array
    """(S,) [m]."""
    hand_count: int
    """The first spheres are the hand, the others the forearm."""
    friction: float
    with_forces: bool
    """Whether to solve for holding forces, which takes milliseconds."""

    @property
    def forearm(self) -> Array:
        """(3,) direction of the forearm; a robot's approach."""
        return np.asarray(self.T_object_hand[:3, 0 if self.hand.is_human else 2])

    @property
    def palm(self) -> Array:
        """(3,) direction out of the palm."""
        return np.asarray(self.T_object_hand[:3, 2])

    @property
    def thumb_side(self) -> Array:
        """(3,) direction towards the thumb side of the (right) hand."""
        return np.asarray(-self.T_object_hand[:3, 1])

    @property
    def functions(self) -> Functions:
        """Annotations of the object."""
        functions = self.target.model.functions
        if functions is None:
            raise ValueError(f"{self.target.model.name} has no functional annotations")
        return functions

    @property
    def handle_share(self) -> float:
        """Share of the contact force that rests on the handle."""
        return self.target.handle_share(self.contacts) or 0.0

    @cached_property
    def functional_gap(self) -> float:
        """Distance of the hand to the part that works [m]."""
        points = self.target.functional_points
        local = (points - self.T_object_hand[:3, 3]) @ self.T_object_hand[:3, :3]
        return float(hand_distances(local, self.hand.table, self.joints).min())

    def wrapped_fingers(self, gap: float) -> int:
        """Return how many fingers other than the thumb come within `gap` [m] of the object."""
        links = self.hand.arrays.sphere_links
        distance = self.target.field.distance(self.centers[: self.hand_count])
        near = finger_of_links(self.hand)[links[distance - self.radii[: self.hand_count] < gap]]
        return len({self.hand.chains[finger] for finger in near if finger >= 0} - {"thumb"})

    def held(self, force: Array, torque: Array, point: Array) -> float:
        """Return the normal forces [N] that balance a force (3,) [N] at a point and a torque."""
        center = self.target.center_of_mass
        wrench = np.concatenate([force, torque + np.cross(point - center, force)])
        return holding_force(self.contacts, wrench, center, self.friction)


def hand_over_terms(scene: GraspScene, rule: Rule, bank: ReceiverBank) -> Terms:
    """Return the margins of hand-over: a receiver finds room where the object wants to be taken.

    A tool is taken by its handle, a vessel that has one too: the giver leaves it free.
    """
    share = bank.free_share(scene.centers, scene.radii, rule["receiver_gap"])
    terms = {"receivers": _above(share, rule["receivers"])}
    edge = scene.functions.edge
    if edge is not None:
        gaps = scene.target.edge_distance(scene.contacts.points)
        terms["edge"] = _above(float(gaps.min(initial=1.0)), rule["edge"])
    if scene.functions.opening is not None and scene.functions.handle:
        terms.update(vessel_handle_terms(scene, rule))
    return terms


def vessel_handle_terms(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margin of a vessel's handle being left to the receiver."""
    return {"handle": _below(scene.handle_share, rule["handle"])}


def column_terms(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margin of the opening's free share."""
    return {"column": _above(_open_share(scene, rule["column"]), rule["column"])}


def direction_terms(scene: GraspScene, task: str, rule: Rule) -> Terms:
    """Return the margins of a task that depend on the hand's orientation alone."""
    functions, human = scene.functions, scene.hand.is_human
    opening, terms = functions.opening, Terms()
    if task == "pouring" and opening is not None:
        terms["forearm"] = _below(abs(float(opening.normal @ scene.forearm)), rule["forearm"])
        if human:
            terms["thumb"] = _above(float(opening.normal @ scene.thumb_side), rule["thumb"])
            terms["palm"] = _below(abs(float(opening.normal @ scene.palm)), rule["palm"])
    elif task == "dish-washing" and opening is not None and human:
        terms["thumb"] = _below(float(opening.normal @ scene.thumb_side), rule["thumb"])
    elif task == "tool-use":
        terms.update(_tool_directions(scene, rule))
    return terms


def pouring_terms(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margins of pouring: free opening, a wrist that can tilt, a hold while tilted."""
    opening = scene.functions.opening
    assert opening is not None
    terms = {
        **column_terms(scene, rule),
        **direction_terms(scene, "pouring", rule),
    }
    if scene.with_forces:
        weight, worst = GRAVITY * scene.target.model.mass, 0.0
        for tilt in np.radians(rule["hold"]["tilts"]):
            up = rotation_from_vector(scene.forearm * tilt) @ opening.normal
            force = scene.held(-weight * up, np.zeros(3), scene.target.center_of_mass)
            worst = max(worst, force)
        terms["hold"] = _below(worst, rule["hold"])
    return terms


def tool_use_terms(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margins of tool-use: a fist on the handle points the tool and resists its work."""
    kind = scene.target.model.object_class
    needed = rule["fingers"][kind] if scene.hand.is_human else 2
    terms = {
        "handle": _above(scene.handle_share, rule["handle"]),
        "clear": (scene.functional_gap - rule["clear"][kind]) / rule["clear"]["scale"],
        "fingers": (scene.wrapped_fingers(rule["fingers"]["gap"]) - needed + 0.5)
        / rule["fingers"]["scale"],
        **direction_terms(scene, "tool-use", rule),
    }
    if scene.with_forces:
        terms["wrench"] = _below(_working_force(scene, rule["wrench"]), rule["wrench"])
    return terms


def dish_washing_terms(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margins of dish-washing: a vessel turned over, a knife held by its handle."""
    opening = scene.functions.opening
    if opening is None:
        return {
            "handle": _above(scene.handle_share, rule["handle"]),
            "clear": (scene.functional_gap - rule["clear"]["knife"]) / rule["clear"]["scale"],
        }
    height = (scene.centers - opening.center) @ opening.normal + scene.radii
    inside = rule["inside"]
    terms = {
        "behind": _above(float(-height[: scene.hand_count].max()), rule["behind"]),
        "inside": _cylinder_gap(scene, inside["below"], 0.0, inside["radius"]) / inside["scale"],
    }
    terms.update(direction_terms(scene, "dish-washing", rule))
    if scene.with_forces:
        force = GRAVITY * scene.target.model.mass * opening.normal
        held = scene.held(force, np.zeros(3), scene.target.center_of_mass)
        terms["hold"] = _below(held, rule["hold"])
    return terms


def _open_share(scene: GraspScene, rule: Rule) -> float:
    """Return the share of the opening's disc that nothing of hand and forearm stands in front of.

    A liquid leaves over the rim away from the hand: a fingertip over the rim takes its own width.
    """
    opening = scene.functions.opening
    assert opening is not None
    offset = scene.centers - opening.center
    height = offset @ opening.normal
    beside = np.maximum(np.maximum(height - rule["above"], -rule["below"] - height), 0.0)
    shadow = np.sqrt(np.maximum(scene.radii**2 - beside**2, 0.0))
    lateral = offset - height[:, None] * opening.normal
    u = across(opening.normal)
    v = np.cross(opening.normal, u)
    disc = rule["radius"] * opening.radius * _DISC
    gaps = disc[:, None] - np.stack([lateral @ u, lateral @ v], axis=1)
    covered = np.any(np.linalg.norm(gaps, axis=2) < shadow, axis=1)
    return float(1.0 - covered.mean())


def _above(value: float, rule: Rule) -> float:
    return float((value - rule["at_least"]) / rule["scale"])


def _below(value: float, rule: Rule) -> float:
    return float((rule["at_most"] - min(value, 1e6)) / rule["scale"])


def _cylinder_gap(scene: GraspScene, below: float, above: float, share: float) -> float:
    """Return the distance [m] of hand and forearm to a cylinder around the opening's axis."""
    opening = scene.functions.opening
    assert opening is not None
    offset = scene.centers - opening.center
    height = offset @ opening.normal
    lateral = np.linalg.norm(offset - height[:, None] * opening.normal, axis=1)
    outside = np.stack([lateral - share * opening.radius, height - above, -below - height], axis=1)
    gap = np.linalg.norm(np.maximum(outside, 0.0), axis=1) + np.minimum(outside.max(axis=1), 0.0)
    return float((gap - scene.radii).min())


def _tool_directions(scene: GraspScene, rule: Rule) -> Terms:
    """Return the margins of where tool, edge and face point in the hand."""
    functions, screwdriver = scene.functions, scene.target.model.object_class == "screwdriver"
    edge, face, forearm = functions.edge, functions.face, scene.forearm
    terms: Terms = {}
    if not scene.hand.is_human:
        if not screwdriver:
            terms["side"] = _below(abs(float(_TOOL_AXIS @ forearm)), rule["side"])
        if edge is not None:  # the arm comes from the spine
            terms["edge"] = (float(edge.direction @ forearm) + 0.3) / rule["edge"]["scale"]
        return terms
    thumb = rule["thumb"]
    beside = float(_TOOL_AXIS @ scene.thumb_side)
    oblique = (beside + float(_TOOL_AXIS @ forearm)) / np.sqrt(2.0)
    margins = [_above(beside, thumb), _above(min(oblique, beside + thumb["oblique"]), thumb)]
    if screwdriver:
        margins.append(_above(-float(_TOOL_AXIS @ scene.palm), thumb))
        margins.append((float(_TOOL_AXIS @ forearm) - thumb["along"]) / thumb["scale"])
    terms["thumb"] = max(margins)
    if edge is not None:
        terms["edge"] = _above(_across_tool(edge.direction, forearm), rule["edge"])
    if face is not None:
        terms["face"] = _above(_across_tool(face.normal, forearm), rule["face"])
    return terms


def _across_tool(direction: Array, forearm: Array) -> float:
    """Return the cosine between a direction and the forearm, both seen along the tool's axis.

    In an oblique grip the forearm leans towards the tool; what counts is where edge and face point
    when the arm swings. A forearm along the tool turns both anyhow: the cosine shrinks with it.
    """
    across = forearm - (forearm @ _TOOL_AXIS) * _TOOL_AXIS
    length = float(np.linalg.norm(across))
    return float(direction @ across) / max(length, _LEAST_ACROSS)


def _working_force(scene: GraspScene, rule: Rule) -> float:
    """Return the normal forces [N] that resist cutting, striking or turning."""
    functions, zero = scene.functions, np.zeros(3)
    if functions.edge is not None:
        middle = 0.5 * (functions.edge.start + functions.edge.end)
        return scene.held(-rule["knife"] * functions.edge.direction, zero, middle)
    if functions.face is not None:
        return scene.held(-rule["hammer"] * functions.face.normal, zero, functions.face.center)
    tip = scene.target.center_of_mass if functions.tip is None else functions.tip
    push = -rule["screwdriver"] * _TOOL_AXIS
    return min(scene.held(push, turn * rule["torque"] * _TOOL_AXIS, tip) for turn in (1.0, -1.0))
