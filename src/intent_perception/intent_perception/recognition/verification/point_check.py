"""Is a hypothesis right? First a few surface points, then more, held against the depth image.

Every model point that faces the camera falls in one of a few classes: it matches the measured
surface; it would be in front of it, where the camera saw through (a contradiction); it is hidden
behind it (no evidence); nothing was measured there, or it lies on what is no object, such as the
table (hardly any evidence).
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel

Bytes = NDArray[np.uint8]

FRONT_COST = 1.2
"""What a point in front of the scene costs, in matching points."""
_HIDDEN_SHARE = 0.7
_UNKNOWN_SHARE = 0.6
_BARE_SHARE = 0.7  # a blade that lies flat cannot be told from the table it lies on
_EARLY = 14  # visible points after which a hopeless hypothesis is dropped
_FACING = -0.1


@borrowing_kernel
def support(  # noqa: PLR0915 (one kernel)
    rotation: Floats,
    translation: Floats,
    points: Floats,
    normals: Floats,
    smooth: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerance: float,
    normal_agreement: float,
    early: bool,
) -> tuple[float, int]:
    """Return a score up to 1 and the number of matching points of one pose.

    Args:
        rotation: (3, 3) object -> camera.
        translation: (3,) [m].
        points: (P, 3) model points, those that spread widest first.
        normals: (P, 3) their normals.
        smooth: (H, W) depth of the scene [m], 0 = none.
        scene_normals: (H, W, 3).
        mask: (H, W) 1 where the scene may be an object.
        intrinsics: (4,) fx, fy, cx, cy.
        tolerance: largest difference in depth of a match [m].
        normal_agreement: least cosine between the normals of a match.
        early: stop when the first points do not match.
    """
    height, width = smooth.shape
    facing = 0
    match = 0
    front = 0
    hidden = 0
    unknown = 0
    bare = 0
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x = rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz + translation[0]
        y = rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz + translation[1]
        z = rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz + translation[2]
        if z < 0.1:
            return -1.0, 0
        ax, ay, az = normals[i, 0], normals[i, 1], normals[i, 2]
        nx = rotation[0, 0] * ax + rotation[0, 1] * ay + rotation[0, 2] * az
        ny = rotation[1, 0] * ax + rotation[1, 1] * ay + rotation[1, 2] * az
        nz = rotation[2, 0] * ax + rotation[2, 1] * ay + rotation[2, 2] * az
        if nx * x + ny * y + nz * z > _FACING * z:
            continue
        facing += 1
        u = int(intrinsics[0] * x / z + intrinsics[2] + 0.5)
        v = int(intrinsics[1] * y / z + intrinsics[3] + 0.5)
        if u < 0 or v < 0 or u >= width or v >= height:
            hidden += 1
        else:
            measured = smooth[v, u]
            if measured <= 0.0:
                unknown += 1
            elif z < measured - tolerance:
                front += 1
            elif z > measured + tolerance:
                hidden += 1
            elif mask[v, u] == 1:
                agreement = (
                    scene_normals[v, u, 0] * nx
                    + scene_normals[v, u, 1] * ny
                    + scene_normals[v, u, 2] * nz
                )
                if agreement > normal_agreement:
                    match += 1
            else:
                bare += 1
        if early and facing == _EARLY and (2 * match + bare < 8 or front > 5):
            return -1.0, match
    if facing - hidden < 5:
        return -1.0, match
    score = (match - FRONT_COST * front) / (
        facing - _HIDDEN_SHARE * hidden - _UNKNOWN_SHARE * unknown - _BARE_SHARE * bare
    )
    return score, match


@kernel
def support_of_all(
    poses: Floats,
    models: NDArray[np.int64],
    points: Floats,
    normals: Floats,
    offsets: NDArray[np.int64],
    smooth: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerance: float,
    normal_agreement: float,
) -> Floats:
    """Return score and matching points (N, 2) of poses (N, 12), rotation by rows, translation."""
    result = np.zeros((len(poses), 2), np.float32)
    rotation = np.empty((3, 3), np.float32)
    translation = np.empty(3, np.float32)
    for k in range(len(poses)):
        for r in range(3):
            for c in range(3):
                rotation[r, c] = poses[k, 3 * r + c]
            translation[r] = poses[k, 9 + r]
        a, b = offsets[models[k]], offsets[models[k] + 1]
        score, match = support(
            rotation,
            translation,
            points[a:b],
            normals[a:b],
            smooth,
            scene_normals,
            mask,
            intrinsics,
            tolerance,
            normal_agreement,
            False,
        )
        result[k, 0] = score
        result[k, 1] = match
    return result
