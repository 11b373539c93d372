"""Skin with more to see: folds over the joints, a glove."""

from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_tracking.workshop.person.body.person_hand import FOREARM
from intent_tracking.workshop.person.body.skin import CREASE, GLOVE, PALMAR, REST, SKIN, Skin

_FOLD = 0.0016
"""Half the length of a fold along the finger [m]."""
_KNUCKLE = 0.0045
_CUFF = -0.045
"""x of a glove's end behind the wrist [m]."""


def with_folds(skin: Skin) -> Skin:
    """Return the skin with folds inside the finger joints and darker knuckles outside."""
    centre = skin.rest.vertices[skin.rest.faces].mean(axis=1)
    link = skin.weights[skin.rest.faces[:, 0]].argmax(axis=1)
    poses = skin.hand.link_poses(REST)
    tones = skin.tones.copy()
    for finger in range(5):
        own = (link > 0) & (link < FOREARM) & ((link - 1) // 3 == finger)
        for k in range(1 if finger else 2, 3):
            pose = poses[1 + 3 * finger + k]
            along = (centre - pose[:3, 3]) @ pose[:3, 0]
            inside = own & (tones == PALMAR) & (np.abs(along) < _FOLD)
            outside = own & (tones == SKIN) & (np.abs(along) < _KNUCKLE)
            tones[inside | outside] = CREASE
    return replace(skin, tones=tones)


def gloved(skin: Skin, thickness: float = 0.0012) -> Skin:
    """Return the hand in a glove of cloth that thick [m], up to behind the wrist."""
    vertices, faces = skin.rest.vertices, skin.rest.faces
    covered = np.clip((vertices[:, 0] - _CUFF) / 0.004, 0.0, 1.0)
    puffed = vertices + thickness * covered[:, None] * _vertex_normals(skin.rest)
    tones = skin.tones.copy()
    tones[vertices[faces].mean(axis=1)[:, 0] > _CUFF] = GLOVE
    return replace(skin, rest=Mesh(puffed, faces), tones=tones)


def _vertex_normals(mesh: Mesh) -> Array:
    """Return the unit normals (V, 3)."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normals = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(normals, mesh.faces[:, corner], np.cross(b - a, c - a))
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Array = normals / np.maximum(size, 1e-15)
    return unit
