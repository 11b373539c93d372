"""Command: draw `hand_wrist` on the human hand and the base frame of the Schunk hand.

python -m intent_imitation.frames_picture --out docs/grasp_frames.png
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from intent_imitation.demo.hand_mesh import capsule_mesh, hand_mesh
from intent_imitation.demo.mesh_pictures import DrawnBody, Image, Tag, annotate, studio, write_image
from intent_inference.grasping.schunk import schunk_hand
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.transforms import inverse, look_at, transform_points
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.joint_table import JointTable

_SKIN = (0.91, 0.72, 0.60)
_STEEL = (0.62, 0.65, 0.70)
_AXES = {"x": (0.86, 0.20, 0.18), "y": (0.16, 0.62, 0.25), "z": (0.15, 0.35, 0.85)}


def frame_picture(table: JointTable, joints: Array, color: tuple[float, ...], eye: Array) -> Image:
    """Return a hand with the axes of its base frame (560, 640, 3).

    Args:
        table: the hand.
        joints: (J,) posture [rad].
        color: of the hand, RGB in 0..1.
        eye: (3,) where the camera is, in the hand's base frame [m].
    """
    camera = Camera(640, 560, 760.0, 760.0, 320.0, 280.0)
    mesh = hand_mesh(table, joints)
    centre = np.mean(mesh.bounds, axis=0)
    T_base_camera = look_at(centre + eye, centre, np.array([0.0, 0.0, 1.0]))
    length = 0.16
    bodies = [DrawnBody(mesh, np.eye(4), (color[0], color[1], color[2]))]
    tags = []
    for axis, (name, paint) in enumerate(_AXES.items()):
        tip = length * np.eye(3)[axis]
        bodies.append(
            DrawnBody(capsule_mesh(np.stack([np.zeros(3), tip]), 0.0025), np.eye(4), paint)
        )
        pixel = camera.project(transform_points(inverse(T_base_camera), tip[None] * 1.06))[0]
        tags.append(Tag(name, paint, (float(pixel[0]), float(pixel[1]))))
    picture = studio(camera, T_base_camera, bodies, table=None)
    # Axes inside the hand shine through, so that the origin can be seen.
    through = studio(camera, T_base_camera, bodies[1:], table=None)
    return annotate(cv2.addWeighted(picture, 0.6, through, 0.4, 0.0), tags)


def main() -> None:
    """Draw both hands side by side."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, required=True, help="picture to write")
    human = HandModel().table
    relaxed = np.radians([30, -20, 15, 10] + [4, 20, 20, 12] * 4)
    schunk = schunk_hand()
    open_hand = np.zeros(len(schunk.joint_names))
    images = [
        frame_picture(human, relaxed, _SKIN, np.array([0.26, -0.22, 0.38])),
        frame_picture(schunk, open_hand, _STEEL, np.array([0.50, -0.38, 0.12])),
    ]
    write_image(parser.parse_args().out, np.hstack(images))
