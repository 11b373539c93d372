"""The published cost of a hand together with the objects that it moves, for many particles.

The same E as `objective.forth_costs`, but every particle has its own poses of the objects, so that
their meshes are drawn for each: into images of inverse depth, which that is cheapest for.
"""

import math

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.objective import (
    FORTH_PENETRATION_WEIGHT,
    KINEMATIC_WEIGHT,
    complete_sums,
    finger_crossing,
    forth_cost,
    forth_shares,
    sums_above,
    turn_bodies,
)
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import HandArrays, HandBuffers, new_hand_buffers, place_hand
from intent_tracking.scene.inverse_depth import (
    FARTHEST,
    PADDING,
    MeshArrays,
    draw_capsule,
    draw_meshes,
)
from intent_tracking.scene.object_kernel import ObjectArrays, signed_distance
from intent_tracking.scene.raster import FAR
from intent_tracking.scene.state_layout import CAPSULES, HAND_SIZE, OBJECT_SIZE


@borrowing_kernel
def grid_place(
    objects: ObjectArrays, k: int, r: Floats, x: np.float32, y: np.float32, z: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Return where a point relative to object k's origin is in its distance grid [cells]."""
    scale = objects.grid_scale[k]
    return (
        (r[0, 0] * x + r[1, 0] * y + r[2, 0] * z - objects.grid_origin[k, 0]) * scale,
        (r[0, 1] * x + r[1, 1] * y + r[2, 1] * z - objects.grid_origin[k, 1]) * scale,
        (r[0, 2] * x + r[1, 2] * y + r[2, 2] * z - objects.grid_origin[k, 2]) * scale,
    )


@borrowing_kernel
def near_penetration(
    hand: HandArrays,
    buffers: HandBuffers,
    objects: ObjectArrays,
    state: Floats,
    rotations: Floats,
    gradient: Floats,
) -> np.float32:
    """Return `objective.penetration` of all capsules, computed where it can be positive only.

    That is in cells of the distance grid none of whose corners is farther from the surface than
    the capsule's radius: no two corners' distances differ by more than the cell's diagonal.
    """
    total, zero, half = np.float32(0.0), np.float32(0.0), np.float32(0.5)
    grid, ends = objects.grid, buffers.ends
    for k in range(objects.surface.shape[0]):
        r, o = rotations[1 + k], HAND_SIZE + OBJECT_SIZE * k
        x0, y0, z0 = state[o], state[o + 1], state[o + 2]
        scale, start = objects.grid_scale[k], objects.grid_start[k]
        nx, ny, nz = objects.grid_shape[k, 0], objects.grid_shape[k, 1], objects.grid_shape[k, 2]
        ox, oy, oz = objects.grid_origin[k, 0], objects.grid_origin[k, 1], objects.grid_origin[k, 2]
        diagonal = np.float32(math.sqrt(3.0)) / scale
        for i in range(CAPSULES):
            reach = hand.radii[i] - np.float32(0.001)
            ax, ay, az = grid_place(
                objects, k, r, ends[i, 0, 0] - x0, ends[i, 0, 1] - y0, ends[i, 0, 2] - z0
            )
            bx, by, bz = grid_place(
                objects, k, r, ends[i, 1, 0] - x0, ends[i, 1, 1] - y0, ends[i, 1, 2] - z0
            )
            for s in range(3):
                t = half * np.float32(s)
                gx, gy, gz = ax + t * (bx - ax), ay + t * (by - ay), az + t * (bz - az)
                if min(gx, gy, gz) < zero:
                    continue
                a, b, c = int(gx), int(gy), int(gz)
                if a >= nx - 1 or b >= ny - 1 or c >= nz - 1:
                    continue
                if grid[start + (a * ny + b) * nz + c] - diagonal < reach:
                    x, y, z = ox + gx / scale, oy + gy / scale, oz + gz / scale
                    total += max(reach - signed_distance(objects, k, x, y, z, gradient), zero)
    return total


@borrowing_kernel
def image_sums(
    hand_image: Floats, thing_image: Floats, seen: Labelled, r0: int, r1: int, c0: int, c1: int
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return `objective.forth_sums` of two images of inverse depth; clear their rows r0..r1-1."""
    one, zero = np.float32(1.0), np.float32(0.0)
    total, area = zero, zero
    hand_and, hand_or, thing_and, thing_or = zero, zero, zero, zero
    for row in range(r0, r1):
        wh, wt, d = hand_image[row, c0:c1], thing_image[row, c0:c1], seen.depth[row, c0:c1]
        oh, ot = seen.hand[row, c0:c1], seen.thing[row, c0:c1]
        for j in range(c1 - c0):
            z, first = one / max(wh[j], wt[j], FARTHEST), wh[j] > wt[j]
            shares = forth_shares(z, first, d[j], oh[j], ot[j])
            total += shares[0]
            area += shares[1]
            hand_and += shares[2]
            hand_or += shares[3]
            thing_and += shares[4]
            thing_or += shares[5]
        hand_image[row] = zero
        thing_image[row] = zero
    return total, area, hand_and, hand_or, thing_and, thing_or


def sums_of_nothing(seen: Labelled) -> Floats:
    """Return the sums of D above every row (S + 1, S / 16, 6) of a tile with nothing drawn."""
    size = len(seen.depth)
    nothing = np.full((size, size), FAR)
    above = np.empty((size + 1, size // 16, 6), np.float32)
    sums_above(nothing, nothing, seen, above)
    return above


@kernel
def joint_costs(
    hand: HandArrays,
    objects: ObjectArrays,
    meshes: MeshArrays,
    seen: Labelled,
    above: Floats,
    states: Floats,
    base: Floats,
    costs: Floats,
) -> None:
    """Write E of all particles; rotations are increments exp(state[3:6]) on `base`.

    Args:
        hand: `HandArrays`.
        objects: `ObjectArrays` of K objects, for their distance grids.
        meshes: `MeshArrays` of the same objects, to be drawn.
        seen: `Labelled` tile.
        above: (S + 1, S / 16, 6) sums of the tile with nothing drawn, of `sums_above`.
        states: (P, 26 + 6 K) particles.
        base: (1 + K, 3, 3) rotations that the increments turn.
        costs: (P,) receives E + penetration.
    """
    size = seen.depth.shape[0]
    buffers = new_hand_buffers()
    work = np.empty((3, max(meshes.vertices.shape[1], meshes.faces.shape[0])), np.float32)
    chosen = np.empty(meshes.faces.shape[0] + 1, np.int32)
    hand_image = np.zeros((size, size + PADDING), np.float32)
    thing_image = np.zeros((size, size + PADDING), np.float32)
    rotations = base.copy()
    sums, gradient = np.empty(6, np.float32), np.empty(3, np.float32)
    for p in range(len(states)):
        state = states[p]
        turn_bodies(state, base, rotations)
        place_hand(hand, state, rotations[0], buffers)
        r0, r1, c0, c1 = draw_meshes(
            meshes, state, rotations, thing_image, seen.u0, seen.v0, seen.step, work, chosen
        )
        for i in range(CAPSULES):
            a, b, c, d = draw_capsule(
                buffers.ends, i, hand.radii[i], hand_image, seen.u0, seen.v0, seen.step
            )
            r0, r1, c0, c1 = min(r0, a), max(r1, b), min(c0, c), max(c1, d)
        r1, c0, c1 = max(r0, r1), c0 // 16 * 16, (max(c0, c1) + 15) // 16 * 16
        drawn = image_sums(hand_image, thing_image, seen, r0, r1, c0, c1)
        complete_sums(drawn, above, r0, r1, c0, c1, sums)
        inside = near_penetration(hand, buffers, objects, state, rotations, gradient)
        costs[p] = forth_cost(sums) + KINEMATIC_WEIGHT * finger_crossing(state)
        costs[p] += FORTH_PENETRATION_WEIGHT * inside
