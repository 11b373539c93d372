"""Who else is there: the other hand of the same person, a bystander, a board held before it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import make_pose, transform_points
from intent_tracking.workshop.person.body.skin import Skin, wrist_turn
from intent_tracking.workshop.person.filming.film import Company
from intent_tracking.workshop.person.filming.look import Look
from intent_tracking.workshop.person.filming.room import Clothes, Piece, block

_RESTING = np.radians([25, -15, 15, 15] + [0, 14, 18, 10] * 4)


@dataclass(frozen=True, eq=False)
class Gathering:
    """Several others."""

    members: Sequence[Company]

    def pieces(self, f: int) -> list[Piece]:
        """Return what is seen of all in frame `f`."""
        return [piece for member in self.members for piece in member.pieces(f)]


@dataclass(frozen=True, eq=False)
class RestingHand:
    """A hand that lies on the table with its arm, and sways a little."""

    still: list[Piece]
    sway: Array
    """(F, 3) [m]."""

    def pieces(self, f: int) -> list[Piece]:
        """Return hand and arm in frame `f`."""
        shift = self.sway[f % len(self.sway)]
        return [
            Piece(Mesh(p.mesh.vertices + shift, p.mesh.faces), p.color, p.grain) for p in self.still
        ]


@dataclass(frozen=True, eq=False)
class PassingBoard:
    """A board that is held between camera and hand for a while."""

    centers: Array
    """(F, 3) table frame [m]; NaN where it is not there."""
    rotation: Array
    """(3, 3) its axes are those of the camera."""
    size: Array
    """(3,) [m]."""
    color: Array

    def pieces(self, f: int) -> list[Piece]:
        """Return the board in frame `f`."""
        if np.isnan(self.centers[f, 0]):
            return []
        corners = block(np.zeros(3), self.size)
        return [Piece(corners.transformed(make_pose(self.rotation, self.centers[f])), self.color)]


def resting_hand(
    skin: Skin, look: Look, clothes: Clothes, place: Array, ahead: Array, frames: int,
    rng: np.random.Generator,
) -> RestingHand:  # fmt: skip
    """Return a hand that lies palm down on the table.

    Args:
        skin: of the hand.
        look: its colours.
        clothes: sleeve of the arm.
        place: (2,) of the wrist on the table [m].
        ahead: (2,) direction of the fingers.
        frames: length of the film.
        rng: source of posture and sway.
    """
    x = np.append(ahead / np.linalg.norm(ahead), 0.0)
    z = np.array([0.0, 0.0, -1.0])
    pose = make_pose(np.stack([x, np.cross(z, x), z], axis=1), np.append(place, 0.0))
    angles = _RESTING + rng.normal(0.0, 0.06, 20)
    elbow = pose[:3, 3] - 0.26 * x + np.array([0.0, 0.0, 0.05])
    wrist = wrist_turn(pose, elbow)  # of either side: the elbow is straight behind
    vertices = transform_points(pose, skin.posed(angles, wrist))
    lift = 0.001 - vertices[:, 2].min()
    vertices[:, 2] += lift
    pose[2, 3] += lift
    elbow[2] += lift
    faces = skin.faces()
    pieces = [
        Piece(Mesh(vertices, np.ascontiguousarray(faces[skin.tones == tone])), color, 0.05)
        for tone, color in enumerate(look.palette)
        if np.any(skin.tones == tone)
    ]
    shoulder = elbow - 0.24 * x + np.array([0.0, 0.0, 0.16])
    pieces += look.worn(pose, skin.hand, angles, wrist)
    pieces += look.bare_arm(pose, elbow, shoulder, skin.hand.thickness)
    pieces.append(Piece(clothes.sleeve(pose[:3, 3], elbow, shoulder), clothes.color, 0.12))
    phase, size = rng.uniform(0.0, 6.3, 2), rng.uniform(0.0, 0.010)
    time = np.arange(frames)[:, None]
    sway = size * np.sin(0.11 * time + np.append(phase, 0.0)) * [1.0, 1.0, 0.0]
    return RestingHand(pieces, sway)


def mirrored_skin(skin: Skin) -> Skin:
    """Return the same person's other hand."""
    other = "left" if skin.hand.side == "right" else "right"
    return replace(skin, hand=replace(skin.hand, side=other))


def passing_board(
    T_table_camera: Array, camera: Camera, hands: Array, span: tuple[int, int],
    rng: np.random.Generator,
) -> PassingBoard:  # fmt: skip
    """Return a board that comes from the image's side and covers the hand from first to last frame.

    Args:
        T_table_camera: (4, 4) of the camera.
        camera: its intrinsics.
        hands: (F, 4, 4) T_table_hand.
        span: first frame in which the hand is hidden, and the first one after.
        rng: colour and side.
    """
    eye, share = T_table_camera[:3, 3], rng.uniform(0.50, 0.60)
    palms = hands[:, :3, 3] + 0.07 * hands[:, :3, 0]
    between = eye + share * (palms - eye)
    depth = float(((between - eye) @ T_table_camera[:3, 2]).mean())
    size = np.array([2.0, 2.0, 0.0]) * (0.15 * share + 0.02) + [0.0, 0.0, 0.004]
    away = 0.5 * camera.width / camera.fx * depth + size[0]
    frame = np.arange(len(hands))
    outside = np.maximum(span[0] - frame, frame - span[1] + 1)
    centers = (
        between
        + (rng.choice([-1.0, 1.0]) * np.clip(outside, 0, 6)[:, None] / 5.0 * away)
        * T_table_camera[:3, 0]
    )
    centers[outside > 5] = np.nan
    return PassingBoard(centers, T_table_camera[:3, :3], size, rng.uniform(0.1, 0.8, 3))
