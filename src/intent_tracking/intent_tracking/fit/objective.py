"""Rendered costs of a posed hand and objects against the observed tile, compiled.

Two costs share the same z-buffers. The first is the published one (Oikonomidis et al., BMVC 2011)
with objects as further rendered bodies, lengths in cm inside D, angles in rad:

    D = sum min(|o_d - r_d|, 4 cm) / (sum(o_f v r_f) + eps)
        + 20 (1 - 2 sum(o_s ^ r_m) / (sum(o_s ^ r_m) + sum(o_s v r_m)))  for hand and for objects
    E = D + 10 kc,  kc = sum over neighbouring fingers of -min(phi, 0)

o_d, r_d: observed and rendered depth; o_s: observed hand (object) pixels; r_m: rendered hand
(object) pixels whose depth agrees within 1 cm or is missing; phi: angle by which a finger is
abducted less than its neighbour on the little finger's side, plus the gap at rest.

The second is a sum over pixels, so that the change by one finger needs that finger's pixels only:

    C = sum_valid  b (min(|o_d - r_d| / 4 cm, 1) + |o_s - r_s| / 2) + 1.5 (1 - b) (o_f + r_f)

b = 1 where both are foreground. A model pixel behind an unknown occluder counts as not rendered.
"""

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import (
    HandArrays,
    HandBuffers,
    new_hand_buffers,
    place_hand,
    turn,
)
from intent_tracking.scene.object_kernel import ObjectArrays, off_grid, signed_distance
from intent_tracking.scene.raster import FAR, draw_capsule, draw_mesh
from intent_tracking.scene.state_layout import CAPSULES, HAND_SIZE, OBJECT_SIZE

SKIN_WEIGHT = np.float32(20.0)
KINEMATIC_WEIGHT = np.float32(10.0)
PENETRATION_WEIGHT = np.float32(3000.0)
FORTH_PENETRATION_WEIGHT = np.float32(20.0)
"""The same in E, whose other terms are a mean over the tile [1/m]."""
REST_GAP = np.float32(0.15)


@borrowing_kernel
def forth_shares(
    z: np.float32, hand_first: bool, d: np.float32, oh: np.float32, ot: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return what one pixel adds to the six sums of D: rendered depth z, observed depth d [m]."""
    one, zero = np.float32(1.0), np.float32(0.0)
    missing = d <= zero
    observed = oh + ot
    hidden = (not missing) and observed == zero and d < z - np.float32(0.015)
    front = one if (z < np.float32(100.0) and not hidden) else zero
    hand = front if hand_first else zero
    thing = front - hand
    difference = abs(z - d)
    union = max(front, observed)
    agree = one if (missing or difference < np.float32(0.01)) else zero
    return (
        zero if missing else union * min(difference, np.float32(0.04)),
        union,
        hand * oh * agree,
        oh if missing else max(hand, oh),
        thing * ot * agree,
        ot if missing else max(thing, ot),
    )


@borrowing_kernel
def forth_sums(
    hand_depth: Floats, thing_depth: Floats, seen: Labelled, r0: int, r1: int, c0: int, c1: int
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return the six sums of D over rows r0..r1-1 and columns c0..c1-1.

    Depth differences [m], union of observed and rendered foreground, then for hand and objects the
    pixels in both images and those in either.
    """
    zero = np.float32(0.0)
    total, area = zero, zero
    hand_and, hand_or, thing_and, thing_or = zero, zero, zero, zero
    for row in range(r0, r1):
        zh, zt, d = hand_depth[row, c0:c1], thing_depth[row, c0:c1], seen.depth[row, c0:c1]
        oh, ot = seen.hand[row, c0:c1], seen.thing[row, c0:c1]
        for j in range(c1 - c0):
            z, first = min(zh[j], zt[j]), zh[j] < zt[j]
            shares = forth_shares(z, first, d[j], oh[j], ot[j])
            total += shares[0]
            area += shares[1]
            hand_and += shares[2]
            hand_or += shares[3]
            thing_and += shares[4]
            thing_or += shares[5]
    return total, area, hand_and, hand_or, thing_and, thing_or


@borrowing_kernel
def forth_cost(sums: Floats) -> np.float32:
    """Return D from its six sums over the tile."""
    one, two, eps = np.float32(1.0), np.float32(2.0), np.float32(1e-6)
    cost = np.float32(100.0) * sums[0] / (sums[1] + eps)
    cost += SKIN_WEIGHT * (one - two * sums[2] / (sums[2] + sums[3] + eps))
    if sums[5] > np.float32(0.0):
        cost += SKIN_WEIGHT * (one - two * sums[4] / (sums[4] + sums[5] + eps))
    return cost


@borrowing_kernel
def sums_above(hand_depth: Floats, thing_depth: Floats, seen: Labelled, above: Floats) -> None:
    """Write the sums of D over all rows above each row in strips of 16 columns.

    above (S + 1, S / 16, 6): the sums over any rows of a strip are a difference of two entries.
    """
    above[0] = np.float32(0.0)
    for row in range(seen.depth.shape[0]):
        for strip in range(above.shape[1]):
            c = 16 * strip
            sums = forth_sums(hand_depth, thing_depth, seen, row, row + 1, c, c + 16)
            for n in range(6):
                above[row + 1, strip, n] = above[row, strip, n] + sums[n]


@borrowing_kernel
def complete_sums(
    drawn: Floats, above: Floats, r0: int, r1: int, c0: int, c1: int, sums: Floats
) -> None:
    """Write the six sums of D over a tile of which a window was drawn anew.

    Args:
        drawn: the six sums over the window.
        above: (S + 1, S / 16, 6) of the tile without it, see `sums_above`.
        r0: first row of the window.
        r1: one past its last row.
        c0: first column, a multiple of 16.
        c1: one past the last column, a multiple of 16.
        sums: (6,) is written.
    """
    size = above.shape[0] - 1
    for n in range(6):
        sums[n] = drawn[n]
        for strip in range(size // 16):
            sums[n] += above[size, strip, n]
        for strip in range(c0 // 16, c1 // 16):
            sums[n] -= above[r1, strip, n] - above[r0, strip, n]


@borrowing_kernel
def finger_crossing(state: Floats) -> np.float32:
    """Return kc [rad] of a state: abduction is positive towards the thumb."""
    total = np.float32(0.0)
    for finger in range(1, 4):
        gap = state[6 + 4 * finger] - state[10 + 4 * finger] + REST_GAP
        total -= min(gap, np.float32(0.0))
    return total


@borrowing_kernel
def penetration(
    hand: HandArrays,
    buffers: HandBuffers,
    objects: ObjectArrays,
    state: Floats,
    rotations: Floats,
    first: int,
    last: int,
    gradient: Floats,
) -> np.float32:
    """Return how deep samples of capsules first..last-1 lie inside the objects, summed [m]."""
    total = np.float32(0.0)
    for k in range(objects.surface.shape[0]):
        r, o = rotations[1 + k], HAND_SIZE + OBJECT_SIZE * k
        for i in range(first, last):
            for s in range(3):
                t = np.float32(s) * np.float32(0.5)
                a, b = buffers.ends[i, 0], buffers.ends[i, 1]
                x = a[0] + t * (b[0] - a[0]) - state[o]
                y = a[1] + t * (b[1] - a[1]) - state[o + 1]
                z = a[2] + t * (b[2] - a[2]) - state[o + 2]
                lx = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
                ly = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
                lz = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
                if off_grid(objects, k, lx, ly, lz) < hand.radii[i]:
                    phi = signed_distance(objects, k, lx, ly, lz, gradient)
                    total += max(hand.radii[i] - phi - np.float32(0.001), np.float32(0.0))
    return total


@borrowing_kernel
def pixel_cost(
    zh: np.float32, zt: np.float32, d: np.float32, oh: np.float32, ot: np.float32, valid: np.float32
) -> np.float32:
    """Return one pixel's share of C."""
    one, zero = np.float32(1.0), np.float32(0.0)
    z = min(zh, zt)
    observed = oh + ot
    hidden = observed == zero and d < z - np.float32(0.015)
    front = one if (z < np.float32(100.0) and not hidden) else zero
    hand = front if zh < zt else zero
    both = front * observed
    cost = both * (
        min(abs(z - d) * np.float32(25.0), one) + np.float32(0.5) * abs(hand - oh)
    ) + np.float32(1.5) * abs(front - observed)
    return cost * valid


@borrowing_kernel
def draw_objects(
    objects: ObjectArrays,
    state: Floats,
    rotations: Floats,
    seen: Labelled,
    depth: Floats,
    work: Floats,
) -> tuple[int, int, int, int]:
    """Draw the K objects of a state into depth (S, S); return the window as `draw_mesh` does."""
    r0, r1, c0, c1 = depth.shape[0], 0, depth.shape[0], 0
    for k in range(objects.surface.shape[0]):
        o = HAND_SIZE + OBJECT_SIZE * k
        vertices = objects.vertices[objects.vertex_start[k] : objects.vertex_start[k + 1]]
        faces = objects.faces[objects.face_start[k] : objects.face_start[k + 1]]
        a, b, c, d = draw_mesh(
            vertices, faces, rotations[1 + k], state[o], state[o + 1], state[o + 2], depth,
            seen.u0, seen.v0, seen.step, work,
        )  # fmt: skip
        r0, r1, c0, c1 = min(r0, a), max(r1, b), min(c0, c), max(c1, d)
    return r0, r1, c0, c1


@borrowing_kernel
def image_costs(
    hand_depth: Floats, thing_depth: Floats, seen: Labelled
) -> tuple[np.float32, np.float32, np.float32]:
    """Return C, and the costs and the number of sure pixels where a hand is seen or drawn."""
    one, zero = np.float32(1.0), np.float32(0.0)
    total, own, area = zero, zero, zero
    for row in range(hand_depth.shape[0]):
        zh, zt, d = hand_depth[row], thing_depth[row], seen.depth[row]
        oh, ot, valid, sure = seen.hand[row], seen.thing[row], seen.valid[row], seen.sure[row]
        for j in range(hand_depth.shape[1]):
            cost = pixel_cost(zh[j], zt[j], d[j], oh[j], ot[j], valid[j])
            counts = sure[j] * (one if (zh[j] < zt[j] or oh[j] > zero) else zero)
            total += cost
            own += cost * counts
            area += valid[j] * counts
    return total, own, area


@kernel
def rendered_cost(
    hand: HandArrays, objects: ObjectArrays, seen: Labelled, state: Floats, rotations: Floats
) -> tuple[np.float32, np.float32]:
    """Return (C + penetration, C per observed or drawn hand pixel) of one state.

    The second leaves out the silhouettes' edges, one pixel to each side, which would make a small
    or distant hand look worse; it is 1 where hardly a pixel can speak for or against the hand.
    """
    size = seen.depth.shape[0]
    buffers = new_hand_buffers()
    work = np.empty((max(objects.vertices.shape[0], 1), 3), np.float32)
    hand_depth, thing_depth = np.full((size, size), FAR), np.full((size, size), FAR)
    place_hand(hand, state, rotations[0], buffers)
    for i in range(CAPSULES):
        draw_capsule(buffers.ends, i, hand.radii[i], hand_depth, seen.u0, seen.v0, seen.step)
    draw_objects(objects, state, rotations, seen, thing_depth, work)
    total, own, area = image_costs(hand_depth, thing_depth, seen)
    gradient = np.empty(3, np.float32)
    inside = penetration(hand, buffers, objects, state, rotations, 0, CAPSULES, gradient)
    return total + PENETRATION_WEIGHT * inside, own / area if area > np.float32(
        30.0
    ) else np.float32(1.0)


@borrowing_kernel
def turn_bodies(state: Floats, base: Floats, rotations: Floats) -> None:
    """Write the rotations (1 + K, 3, 3) that the increments of a state make of `base`."""
    for body in range(base.shape[0]):
        o = 3 if body == 0 else 23 + 6 * body
        turn(state[o], state[o + 1], state[o + 2], base[body], rotations[body])


@kernel
def forth_costs(
    hand: HandArrays,
    objects: ObjectArrays,
    seen: Labelled,
    states: Floats,
    base: Floats,
    first: int,
    last: int,
    costs: Floats,
) -> None:
    """Write E of particles first..last-1; rotations are increments exp(state[3:6]) on `base`.

    The objects are drawn once, where the first particle has them; `swarm_cost` moves them.

    Args:
        hand: `HandArrays`.
        objects: `ObjectArrays` of K objects.
        seen: `Labelled` tile.
        states: (P, 26 + 6 K) particles.
        base: (1 + K, 3, 3) rotations that the increments turn.
        first: first particle.
        last: one past the last particle.
        costs: (P,) receives E + penetration.
    """
    size = seen.depth.shape[0]
    buffers = new_hand_buffers()
    work = np.empty((max(objects.vertices.shape[0], 1), 3), np.float32)
    hand_depth, thing_depth = np.full((size, size), FAR), np.full((size, size), FAR)
    above, sums = np.empty((size + 1, size // 16, 6), np.float32), np.empty(6, np.float32)
    rotations, gradient = base.copy(), np.empty(3, np.float32)
    if last > first:
        turn_bodies(states[first], base, rotations)
        draw_objects(objects, states[first], rotations, seen, thing_depth, work)
    sums_above(hand_depth, thing_depth, seen, above)
    for p in range(first, last):
        state = states[p]
        turn_bodies(state, base, rotations)
        place_hand(hand, state, rotations[0], buffers)
        r0, r1, c0, c1 = size, 0, size, 0
        for i in range(CAPSULES):
            a, b, c, d = draw_capsule(
                buffers.ends, i, hand.radii[i], hand_depth, seen.u0, seen.v0, seen.step
            )
            r0, r1, c0, c1 = min(r0, a), max(r1, b), min(c0, c), max(c1, d)
        r1, c0, c1 = max(r0, r1), c0 // 16 * 16, (max(c0, c1) + 15) // 16 * 16
        drawn = forth_sums(hand_depth, thing_depth, seen, r0, r1, c0, c1)
        complete_sums(drawn, above, r0, r1, c0, c1, sums)
        hand_depth[r0:r1] = FAR
        inside = penetration(hand, buffers, objects, state, rotations, 0, CAPSULES, gradient)
        costs[p] = forth_cost(sums) + KINEMATIC_WEIGHT * finger_crossing(state)
        costs[p] += FORTH_PENETRATION_WEIGHT * inside
