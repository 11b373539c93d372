"""Per-finger render-and-compare search: gets fingers out of the minima that points cannot leave.

Palm, the other fingers and the objects are drawn once per finger. Each trial draws only the three
capsules of its finger and counts only the change of C (see `objective`) in their box.
"""

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.objective import PENETRATION_WEIGHT, draw_objects, penetration, pixel_cost
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import (
    HandArrays,
    HandBuffers,
    new_hand_buffers,
    place_finger,
    place_hand,
)
from intent_tracking.scene.object_kernel import ObjectArrays
from intent_tracking.scene.posture_prior import Posture
from intent_tracking.scene.raster import FAR, draw_capsule
from intent_tracking.scene.state_layout import CAPSULES, JOINTS


@borrowing_kernel
def finger_cost(
    hand: HandArrays,
    buffers: HandBuffers,
    objects: ObjectArrays,
    seen: Labelled,
    rest: Floats,
    thing: Floats,
    without: Floats,
    own: Floats,
    state: Floats,
    rotations: Floats,
    finger: int,
    prior: Floats,
    posture: Posture,
    pull: np.float32,
    unusual: np.float32,
    g: Floats,
) -> np.float32:
    """Return the cost of one finger's pose relative to the scene without that finger.

    Of buffers only this finger is posed anew. rest, thing (S, S): z-buffers of the hand without the
    finger and of all objects; without (S, S): cost of every pixel with these; own (S, S): work,
    `FAR` before and after.
    """
    place_finger(hand, state, rotations[0], finger, buffers)
    total, size = np.float32(0.0), seen.depth.shape[0]
    r0, r1, c0, c1 = size, 0, size, 0
    for i in range(3 * finger, 3 * finger + 3):
        a, b, c, d = draw_capsule(buffers.ends, i, hand.radii[i], own, seen.u0, seen.v0, seen.step)
        r0, r1, c0, c1 = min(r0, a), max(r1, b), min(c0, c), max(c1, d)
    blocks = (max(c1 - c0, 0) + 15) // 16
    c0 = min(c0, size - 16 * blocks)
    for row in range(r0, r1):
        for block in range(blocks):
            s = c0 + 16 * block
            zr, zf = rest[row, s : s + 16], own[row, s : s + 16]
            zt, d = thing[row, s : s + 16], seen.depth[row, s : s + 16]
            oh, ot = seen.hand[row, s : s + 16], seen.thing[row, s : s + 16]
            valid, before = seen.valid[row, s : s + 16], without[row, s : s + 16]
            for j in range(16):
                with_it = pixel_cost(min(zr[j], zf[j]), zt[j], d[j], oh[j], ot[j], valid[j])
                total += with_it - before[j]
        own[row] = FAR
    inside = penetration(hand, buffers, objects, state, rotations, 3 * finger, 3 * finger + 3, g)
    total += PENETRATION_WEIGHT * inside
    base = 6 + 4 * finger
    for n in range(base, base + 4):
        e = state[n] - prior[n]
        total += pull * e * e
    if finger > 0:
        e = state[base + 3] - np.float32(0.667) * state[base + 2]
        total += pull * e * e
    for n in range(JOINTS):
        across = np.float32(0.0)
        for m in range(JOINTS):
            across += posture.precision[n, m] * (state[6 + m] - posture.mean[m])
        total += unusual * across * (state[6 + n] - posture.mean[n])
    return total


@borrowing_kernel
def normal() -> np.float32:
    """Return a standard normal number of the compiled generator."""
    return np.float32(np.random.standard_normal())  # noqa: NPY002 (numba's own generator)


@borrowing_kernel
def between(low: np.float32, high: np.float32) -> np.float32:
    """Return a uniform number of the compiled generator."""
    return low + np.float32(np.random.random()) * (high - low)  # noqa: NPY002


@borrowing_kernel
def draw_trial(
    state: Floats, origin: Floats, limits: Floats, finger: int, trial: int, spread: np.float32
) -> None:
    """Draw a pose of one finger: near the present one, or anywhere on a natural curl."""
    base, first = 6 + 4 * finger, 4 * finger
    kind = trial % 4
    if kind < 2:
        width = spread if kind == 0 else np.float32(0.35) * spread
        sideways = np.float32(1.0) if finger == 0 else np.float32(0.5)
        state[base] = origin[base] + normal() * width * sideways
        for n in range(base + 1, base + 4):
            state[n] = origin[n] + normal() * width
    else:
        state[base] = origin[base] + normal() * np.float32(0.1)
        if finger == 0:  # the thumb opposes, which decides where it is more than its curl
            state[base] = between(limits[first, 0], limits[first, 1])
        curl = between(np.float32(0.0), np.float32(1.0))
        for level in range(1, 3):
            low, high = limits[first + level, 0], limits[first + level, 1]
            together = low + curl * (high - low) + normal() * np.float32(0.2)
            state[base + level] = together if kind == 2 and finger > 0 else between(low, high)
        state[base + 3] = np.float32(0.667) * state[base + 2]
    for level in range(4):
        low, high = limits[first + level, 0], limits[first + level, 1]
        state[base + level] = min(max(state[base + level], low), high)


@kernel
def sweep_fingers(
    hand: HandArrays,
    objects: ObjectArrays,
    seen: Labelled,
    state: Floats,
    rotations: Floats,
    prior: Floats,
    posture: Posture,
    limits: Floats,
    trials: int,
    pull: np.float32,
    unusual: np.float32,
    spread: np.float32,
    seed: int,
) -> None:
    """Improve the fingers of `state` in place, one after the other.

    Args:
        hand: `HandArrays`.
        objects: `ObjectArrays`.
        seen: `Labelled` tile.
        state: (26 + 6 K,), fingers are overwritten where the cost falls.
        rotations: (1 + K, 3, 3).
        prior: (26 + 6 K,) predicted state.
        posture: `Posture`.
        limits: (20, 2) [rad].
        trials: poses drawn per finger.
        pull: weight of the prior [1 / rad^2].
        unusual: weight of the squared Mahalanobis distance from usual postures.
        spread: standard deviation of local trials [rad].
        seed: of the trials.
    """
    np.random.seed(seed)  # noqa: NPY002 (numba's own generator)
    size = seen.depth.shape[0]
    buffers = new_hand_buffers()
    work = np.empty((max(objects.vertices.shape[0], 1), 3), np.float32)
    thing = np.full((size, size), FAR)
    draw_objects(objects, state, rotations, seen, thing, work)
    rest, without = np.empty((size, size), np.float32), np.empty((size, size), np.float32)
    own = np.full((size, size), FAR)
    trial_state, g = state.copy(), np.empty(3, np.float32)
    for finger in range(5):
        place_hand(hand, state, rotations[0], buffers)
        rest[:, :] = FAR
        for i in range(CAPSULES):
            if i >= 15 or i // 3 != finger:
                draw_capsule(buffers.ends, i, hand.radii[i], rest, seen.u0, seen.v0, seen.step)
        for row in range(size):
            cost_row, zr, zt, d = without[row], rest[row], thing[row], seen.depth[row]
            oh, ot, valid = seen.hand[row], seen.thing[row], seen.valid[row]
            for j in range(size):
                cost_row[j] = pixel_cost(zr[j], zt[j], d[j], oh[j], ot[j], valid[j])
        trial_state[:] = state
        best = finger_cost(
            hand, buffers, objects, seen, rest, thing, without, own, trial_state, rotations, finger,
            prior, posture, pull, unusual, g,
        )  # fmt: skip
        for trial in range(trials):
            draw_trial(trial_state, state, limits, finger, trial, spread)
            cost = finger_cost(
                hand, buffers, objects, seen, rest, thing, without, own, trial_state, rotations,
                finger, prior, posture, pull, unusual, g,
            )  # fmt: skip
            if cost < best - np.float32(0.5):
                best = cost
                for n in range(6 + 4 * finger, 10 + 4 * finger):
                    state[n] = trial_state[n]
