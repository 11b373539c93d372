"""The demonstrator's skin: one closed surface over all bones, bent by dual-quaternion skinning.

Flesh is modelled around a rest pose (fingers straight and spread) as blended round cones with a
thenar, a hypothenar, a web and finger pads, meshed once per person; a posture then moves every
vertex with the links near it (Kavan et al. 2008), which keeps the volume at a bent joint.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import inverse, quaternion_from_rotation
from intent_tracking.workshop.person.body.blended_surface import (
    RoundCones,
    smooth_union,
    surface_mesh,
)
from intent_tracking.workshop.person.body.person_hand import FOREARM, PALM, PARENT, DemonstratorHand

_RADII = np.array(
    [[0.0150, 0.0122, 0.0112, 0.0088], [0.0112, 0.0093, 0.0084, 0.0064],
     [0.0114, 0.0096, 0.0086, 0.0066], [0.0108, 0.0090, 0.0080, 0.0062],
     [0.0096, 0.0079, 0.0071, 0.0055]]
)  # fmt: skip
"""Radius at base, first and second hinge, and finger tip [m]."""

REST = np.radians([15, -15, 5, 5] + [0, 4, 4, 4] * 4).astype(float)
REST[[4, 8, 12, 16]] = np.radians([9.0, 2.0, -6.0, -13.0])
"""(20,) posture in which the skin is modelled: no two fingers touch [rad]."""

SKIN, PALMAR, NAIL, CREASE, GLOVE = range(5)
"""Tones of the skin: back of the hand, palm side, nails, folds over the joints; and cloth."""


class Flesh(Protocol):
    """The shape of one hand in the rest pose."""

    def bounds(self) -> tuple[Array, Array]:
        """Return two corners (3,) of a box around it [m]."""

    def field(self, points: Array) -> Array:
        """Return the signed distance to the skin, (N,) [m]."""

    def link_distances(self, points: Array) -> Array:
        """Return the distance to the flesh of each link, (N, 17) [m]."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A person's skin in the rest pose with what ties it to the links."""

    hand: DemonstratorHand
    rest: Mesh
    """Closed mesh of the right hand in the wrist frame [m]."""
    weights: Array
    """(V, 17) share of each link; rows sum to one."""
    tones: Array
    """(F,) SKIN, PALMAR or NAIL of each face."""

    @cached_property
    def _from_rest(self) -> Array:
        return inverse(self.hand.link_poses(REST))

    def posed(
        self, angles: Array, wrist: Array | None = None, subset: Array | None = None
    ) -> Array:
        """Return the vertices in a posture, in the wrist frame of the hand's own side.

        Args:
            angles: (20,) joint angles [rad].
            wrist: (3,) turn of the forearm against the hand, None: straight [rad].
            subset: numbers of the vertices that are wanted, None: all.

        Returns:
            (V, 3) or (len(subset), 3) [m].
        """
        motion = self.hand.link_poses(angles, wrist) @ self._from_rest
        vertices, weights = self.rest.vertices, self.weights
        if subset is not None:
            vertices, weights = vertices[subset], weights[subset]
        return blended_motion(vertices, weights, motion) * self.hand.mirror

    def faces(self) -> NDArray[np.int32]:
        """Return the faces (F, 3), turned outwards on the hand's own side."""
        faces = self.rest.faces
        return faces[:, ::-1] if self.hand.side == "left" else faces


def blended_motion(vertices: Array, weights: Array, motion: Array) -> Array:
    """Return vertices moved by the weighted dual quaternions of rigid motions.

    Args:
        vertices: (V, 3) [m].
        weights: (V, L), rows sum to one.
        motion: (L, 4, 4) rigid motion of each link.

    Returns:
        (V, 3) [m].
    """
    real = quaternion_from_rotation(motion[:, :3, :3])
    real = np.where(real @ real[:1].T < 0.0, -real, real)  # blend on one half of the sphere
    translation = np.concatenate([motion[:, :3, 3], np.zeros((len(motion), 1))], axis=1)
    dual = 0.5 * _product(translation, real)
    r, d = weights @ real, weights @ dual
    size = np.linalg.norm(r, axis=1, keepdims=True)
    r, d = r / size, d / size
    v, w = r[:, :3], r[:, 3:]
    turned = vertices + 2.0 * _cross(v, _cross(v, vertices) + w * vertices)
    shift = 2.0 * (w * d[:, :3] - d[:, 3:] * v + _cross(v, d[:, :3]))
    moved: Array = turned + shift
    return moved


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products of rows; np.cross takes three times as long."""
    product = np.empty_like(b)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return product


def _product(a: Array, b: Array) -> Array:
    """Return the quaternion product, (x, y, z, w) each."""
    vector = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    scalar = a[:, 3:] * b[:, 3:] - np.sum(a[:, :3] * b[:, :3], axis=1, keepdims=True)
    return np.concatenate([vector, scalar], axis=1)


def make_skin(hand: DemonstratorHand, spacing: float = 0.0024, flesh: Flesh | None = None) -> Skin:
    """Return the skin of a person's hand.

    Args:
        hand: the bones.
        spacing: edge of the grid cells of the mesh [m].
        flesh: the shape around the bones, None = blended round cones.
    """
    flesh = flesh or _Flesh(hand)
    lower, upper = flesh.bounds()
    mesh = surface_mesh(flesh.field, lower, upper, spacing)
    weights = _smoothed(mesh, _weights(flesh.link_distances(mesh.vertices)))
    return Skin(hand, mesh, weights, _tones(hand, mesh, weights))


class _Flesh:
    """Round cones over the bones of one hand in the rest pose, grouped by link."""

    def __init__(self, hand: DemonstratorHand) -> None:
        poses = hand.link_poses(REST)
        t = hand.thickness
        digits, links = [], []
        for finger in range(5):
            for k in range(3):
                pose = poses[1 + 3 * finger + k]
                r0, r1 = _RADII[finger, k : k + 2] * t
                end = hand.bones[finger, k] - (r1 if k == 2 else 0.0)
                digits.append(_cone(pose, (0, 0, 0.0006), (end, 0, 0.0010), r0, r1))
                links.append(1 + 3 * finger + k)
                bone = hand.bones[finger, k]
                pad = (0.30 * bone, 0, 0.0026), (0.62 * bone, 0, 0.0024)
                digits.append(_cone(pose, *pad, 0.90 * r0, 0.90 * r0))
                links.append(1 + 3 * finger + k)
        self._digits, self._digit_links = _stacked(digits), np.array(links)
        self._palm, self._forearm = _palm(hand, poses, t), _forearm(t)

    def bounds(self) -> tuple[Array, Array]:
        points = np.concatenate([self._digits.starts, self._digits.ends, self._forearm.starts])
        return points.min(axis=0) - 0.05, points.max(axis=0) + 0.05

    def field(self, points: Array) -> Array:
        """Return the signed distance to the skin, (N,) [m]."""
        digits = self._digits.distances(points)
        fingers = [
            smooth_union(digits[:, (self._digit_links - 1) // 3 == f], 0.0016) for f in range(5)
        ]
        arm = smooth_union(self._forearm.distances(points), 0.006)
        palm = smooth_union(self._palm.distances(points), 0.0045)
        body = smooth_union(np.stack([palm, arm], axis=1), 0.005)
        thumb = smooth_union(np.stack([body, fingers[0]], axis=1), 0.0045)
        return smooth_union(np.stack([thumb, *fingers[1:]], axis=1), 0.0028)

    def link_distances(self, points: Array) -> Array:
        """Return the distance to the flesh of each link, (N, 17) [m]."""
        distances = np.zeros((len(points), 17))
        digits = self._digits.distances(points)
        for link in range(1, 16):
            distances[:, link] = digits[:, self._digit_links == link].min(axis=1)
        distances[:, PALM] = self._palm.distances(points).min(axis=1)
        # The forearm begins at the wrist: before it, distance grows with x.
        arm = self._forearm.distances(points).min(axis=1)
        distances[:, FOREARM] = arm + np.maximum(0.0, 0.35 * (points[:, 0] + 0.012))
        distances[:, PALM] += np.maximum(0.0, -0.35 * (points[:, 0] + 0.012))
        return distances


def _palm(hand: DemonstratorHand, poses: Array, t: float) -> RoundCones:
    """Return metacarpals, thenar, hypothenar, web and heel of the right hand."""
    b = hand.bases
    thumb = poses[1]
    tip = thumb[:3, 3] + thumb[:3, 0] * hand.bones[0, 0]
    cones = []
    for finger, carpal in zip(range(1, 5), (-0.014, -0.004, 0.007, 0.017), strict=True):
        radius = (0.0128, 0.0130, 0.0124, 0.0112)[finger - 1] * t
        end = b[finger] + [-0.006, 0.0, 0.0015]
        cones.append((np.array([0.012, carpal, 0.004]), end, 0.0135 * t, radius))
        pad = b[finger] + [-0.008, 0.0, 0.0060]
        cones.append(
            (0.45 * np.array([0.02, carpal, 0.006]) + 0.55 * pad, pad, 0.0105 * t, 0.0105 * t)
        )
    middle = 0.5 * (b[0] + tip)
    cones += [
        (np.array([0.008, -0.010, 0.008]), 0.25 * b[0] + 0.75 * tip, 0.0155 * t, 0.0125 * t),
        (
            np.array([0.030, -0.008, 0.010]),
            middle + np.array([0.004, 0.005, 0.002]),
            0.0120 * t,
            0.0125 * t,
        ),
        (np.array([0.052, -0.014, 0.006]), b[1] + [-0.022, -0.006, 0.004], 0.0110 * t, 0.0085 * t),
        (np.array([0.018, 0.022, 0.009]), b[4] + [-0.024, 0.001, 0.000], 0.0150 * t, 0.0135 * t),
        (np.array([0.004, -0.008, 0.004]), np.array([0.006, 0.014, 0.004]), 0.0165 * t, 0.0165 * t),
    ]
    return _stacked(cones)


def _forearm(t: float) -> RoundCones:
    """Return the bare forearm behind the wrist, flat where a watch would sit."""
    cones = []
    for y in (-0.011, 0.0, 0.011):
        start, end = np.array([-0.13, 1.2 * y, 0.002]), np.array([-0.005, y, 0.003])
        cones.append((start, end, 0.0235 * t, 0.0175 * t))
    return _stacked(cones)


def _cone(
    pose: Array, start: tuple[float, ...], end: tuple[float, ...], r0: float, r1: float
) -> tuple[Array, Array, float, float]:
    a, b = (pose[:3, :3] @ np.array(p) + pose[:3, 3] for p in (start, end))
    return a, b, r0, r1


def _stacked(cones: list[tuple[Array, Array, float, float]]) -> RoundCones:
    starts, ends = np.array([c[0] for c in cones]), np.array([c[1] for c in cones])
    return RoundCones(starts, ends, np.array([[c[2], c[3]] for c in cones]))


def _weights(distances: Array, width: float = 0.0024) -> Array:
    """Return each vertex's share of the nearest link and the links jointed to it, (V, 17)."""
    linked = np.eye(17, dtype=bool)
    for child, parent in enumerate(PARENT):
        if parent >= 0:
            linked[child, parent] = linked[parent, child] = True
    nearest = distances.argmin(axis=1)
    lowest = distances.min(axis=1, keepdims=True)
    weights = np.where(linked[nearest], np.exp((lowest - distances) / width), 0.0)
    normalised: Array = weights / weights.sum(axis=1, keepdims=True)
    return normalised


def _smoothed(mesh: Mesh, weights: Array, rounds: int = 8) -> Array:
    """Return the weights averaged over neighbouring vertices: no crease where owners change."""
    pairs = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    count = len(mesh.vertices)
    ones = np.ones(len(pairs))
    neighbours = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    degree = np.asarray(neighbours.sum(axis=1))
    for _ in range(rounds):
        weights = 0.4 * weights + 0.6 * (neighbours @ weights) / degree
    return weights


def _tones(hand: DemonstratorHand, mesh: Mesh, weights: Array) -> Array:
    """Return the tone of each face: nails on the backs of the finger tips, a lighter palm side."""
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    corner = mesh.vertices[mesh.faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    link = weights[mesh.faces[:, 0]].argmax(axis=1)
    poses = hand.link_poses(REST)
    palmar = np.einsum("fi,fi->f", normal, poses[link][:, :3, 2])
    tones = np.where(palmar > 0.25, PALMAR, SKIN)
    for finger in range(5):
        last = 3 + 3 * finger
        local = (centre - poses[last, :3, 3]) @ poses[last, :3, :3]
        length = hand.bones[finger, 2]
        long = (local[:, 0] > 0.52 * length) & (local[:, 0] < 0.93 * length)
        broad = np.abs(local[:, 1]) < 0.62 * _RADII[finger, 3] * hand.thickness
        tones[(link == last) & long & broad & (palmar < -0.3)] = NAIL
    return tones


def wrist_turn(T_hand: Array, elbow: Array) -> Array:
    """Return the rotation vector (3,) in the right hand that points the forearm to the elbow.

    Args:
        T_hand: (4, 4) pose of the right hand in some frame.
        elbow: (3,) the elbow in that frame [m].
    """
    target = T_hand[:3, :3].T @ (elbow - T_hand[:3, 3])
    target /= np.linalg.norm(target)
    back = np.array([-1.0, 0.0, 0.0])
    axis = np.cross(back, target)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.zeros(3)
    turn: Array = axis / sine * np.arctan2(sine, back @ target)
    return turn
