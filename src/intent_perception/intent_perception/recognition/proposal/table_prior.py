"""Hypotheses from one scene point and the table: the object rests in one of its stable poses.

A point's height above the table and the tilt of its normal select points of resting models; the
normal's azimuth then gives the object's turn about the vertical, the point its place. One point
instead of two: objects too flat or too small for point pairs are found this way. The paper has no
such prior; these hypotheses come in addition to its own (Sec. III-A), through the same tests.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import kernel
from intent_perception.recognition.proposal.pair_hypotheses import consider
from intent_perception.recognition.proposal.proposal_arrays import (
    ModelArrays,
    RestingArrays,
    SceneArrays,
    SlotArrays,
)

_HEIGHT_STEP = 0.004  # [m]
_HEIGHTS = 128
_TILTS = 18
_POSES = 10  # most resting poses of one model


def resting_table(
    points: Floats,
    normals: Floats,
    offsets: NDArray[np.int64],
    stable_poses: list[Floats],
    axes: Floats,
    sector: NDArray[np.bool_],
) -> RestingArrays:
    """Return the table of all models.

    Args:
        points: (P, 3) points of all models one after the other [m].
        normals: (P, 3).
        offsets: (M + 1,) where each model's points begin.
        stable_poses: M times (S, 4, 4) T_table_object.
        axes: (M, 3) symmetry axes, zero without.
        sector: (P,) points of a model that stand for all those turned about its axis.
    """
    keys: list[NDArray[np.int64]] = []
    entries: list[NDArray[np.int64]] = []
    rows: list[Floats] = []
    for model, poses in enumerate(stable_poses):
        mine = slice(offsets[model], offsets[model + 1])
        for T_rest in poses[:_POSES]:
            upright = abs(T_rest[2, :3] @ axes[model]) > 0.99
            height = points[mine] @ T_rest[2, :3] + T_rest[2, 3]
            tilt = np.arccos(np.clip(normals[mine] @ T_rest[2, :3], -1.0, 1.0))
            level = np.clip(height / _HEIGHT_STEP, 0, _HEIGHTS - 1).astype(np.int64)
            # what faces the table is never seen
            kept = (tilt < 2.6) & (height < _HEIGHT_STEP * _HEIGHTS) & (height > 0.003)
            if upright:
                kept &= sector[mine]
            bins = np.minimum((tilt / np.pi * _TILTS).astype(np.int64), _TILTS - 1)
            index = np.flatnonzero(kept)
            keys.append(level[index] * _TILTS + bins[index])
            row = np.full(len(index), len(rows))
            entries.append(np.stack([np.full(len(index), model), row, index], axis=1))
            rows.append(np.concatenate([T_rest[:3, :3].ravel(), [0.0, 0.0, T_rest[2, 3]]]))
    order = np.argsort(np.concatenate(keys), kind="stable")
    all_keys = np.concatenate(keys)[order]
    starts = np.searchsorted(all_keys, np.arange(_HEIGHTS * _TILTS + 1)).astype(np.int64)
    return RestingArrays(
        starts, np.concatenate(entries)[order].astype(np.int64), np.array(rows, np.float32)
    )


@kernel
def sample_resting(  # noqa: C901, PLR0915 (one kernel)
    lookups: int,
    rng: np.random.Generator,
    pixels: Indices,
    scene: SceneArrays,
    T_table_camera: Floats,
    resting: RestingArrays,
    models: ModelArrays,
    slots: SlotArrays,
    tolerance: float,
) -> int:
    """Fill slots with verified hypotheses, one set for each given pixel; return how many were made.

    Args:
        lookups: most entries taken per pixel, drawn evenly among those that fit.
        rng: of the draws.
        pixels: (N, 2) rows and columns.
        scene: that the pixels lie in.
        T_table_camera: (4, 4).
        resting: points of resting models.
        models: whose points they are.
        slots: for the best poses, in and out.
        tolerance: of `support` [m].
    """
    no_plane = np.zeros(4, np.float32)
    rotation = np.empty((3, 3), np.float32)
    translation = np.empty(3, np.float32)
    turned = np.empty((3, 3), np.float32)
    place = np.empty(3, np.float32)
    facing = np.empty(3, np.float32)
    made = 0
    for k in range(len(pixels)):
        row, column = pixels[k, 0], pixels[k, 1]
        for r in range(3):
            place[r] = T_table_camera[r, 3]
            facing[r] = 0.0
            for c in range(3):
                place[r] += T_table_camera[r, c] * scene.points[row, column, c]
                facing[r] += T_table_camera[r, c] * scene.normals[row, column, c]
        tilt = np.arccos(min(1.0, max(-1.0, facing[2])))
        azimuth = np.arctan2(facing[1], facing[0])
        level = int(place[2] / _HEIGHT_STEP)
        tilt_bin = min(_TILTS - 1, int(tilt / np.pi * _TILTS))
        low, high = max(0, tilt_bin - 1), min(_TILTS, tilt_bin + 2)
        total = 0
        for i in range(max(0, level - 1), min(_HEIGHTS, level + 2)):
            total += resting.starts[i * _TILTS + high] - resting.starts[i * _TILTS + low]
        if total == 0:
            continue
        share = min(1.0, lookups / total)
        for i in range(max(0, level - 1), min(_HEIGHTS, level + 2)):
            for entry in range(resting.starts[i * _TILTS + low], resting.starts[i * _TILTS + high]):
                if share < 1.0 and rng.random() > share:
                    continue
                model = resting.entries[entry, 0]
                pose = resting.poses[resting.entries[entry, 1]]
                index = models.offsets[model] + resting.entries[entry, 2]
                x = np.float32(0.0)
                y = np.float32(0.0)
                nx = np.float32(0.0)
                ny = np.float32(0.0)
                for c in range(3):
                    x += pose[c] * models.points[index, c]
                    y += pose[3 + c] * models.points[index, c]
                    nx += pose[c] * models.normals[index, c]
                    ny += pose[3 + c] * models.normals[index, c]
                if nx * nx + ny * ny < 0.1:  # a horizontal face has no azimuth
                    yaw = rng.random() * 2.0 * np.pi
                else:
                    yaw = azimuth - np.arctan2(ny, nx)
                cosine, sine = np.float32(np.cos(yaw)), np.float32(np.sin(yaw))
                for c in range(3):
                    turned[0, c] = cosine * pose[c] - sine * pose[3 + c]
                    turned[1, c] = sine * pose[c] + cosine * pose[3 + c]
                    turned[2, c] = pose[6 + c]
                dx = place[0] - (cosine * x - sine * y) - T_table_camera[0, 3]
                dy = place[1] - (sine * x + cosine * y) - T_table_camera[1, 3]
                dz = pose[11] - T_table_camera[2, 3]
                for r in range(3):
                    for c in range(3):
                        rotation[r, c] = (
                            T_table_camera[0, r] * turned[0, c]
                            + T_table_camera[1, r] * turned[1, c]
                            + T_table_camera[2, r] * turned[2, c]
                        )
                    translation[r] = (
                        T_table_camera[0, r] * dx
                        + T_table_camera[1, r] * dy
                        + T_table_camera[2, r] * dz
                    )
                made += 1
                consider(rotation, translation, model, no_plane, scene, models, slots, tolerance)
    return made
