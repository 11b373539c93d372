"""Kernels that move a hand of spheres against a signed distance grid until it holds.

The grid's values bound how far a sphere may move before it can touch (conservative advancement),
so that a try needs tens of postures instead of hundreds. Everything is float32.
"""

import numba as nb
import numpy as np

from intent_inference.grasping.hand_spheres import SphereArrays
from intent_perception.basics.arrays import Floats
from intent_perception.geometry.sdf import sample

_TOUCH = 0.0005  # the approach has arrived at this distance [m]
_PENETRATION = 0.0002  # a finger is stopped this deep [m]
_SMALLEST, _LARGEST = 0.0044, 0.14  # step of the fastest joint [rad]
_APPROACH_STEPS, _CLOSING_STEPS = 40, 160


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _links(
    hand: SphereArrays, first: int, last: int, joints: Floats, turns: Floats, t: Floats
) -> None:
    """Place the links first..last-1, whose parents are placed: turns (L, 3, 3), t (L, 3)."""
    for link in range(first, last):
        parent, origin = hand.parents[link], hand.origins[link]
        for i in range(3):
            t[link, i] = t[parent, i]
            for k in range(3):
                t[link, i] += turns[parent, i, k] * origin[k, 3]
        angle = np.float32(0.0)
        place = np.float32(0.0)
        if hand.drivers[link] >= 0:
            if hand.slides[link]:
                place = hand.ratios[link] * joints[hand.drivers[link]]
            else:
                angle = hand.ratios[link] * joints[hand.drivers[link]]
        c, s = np.cos(angle), np.sin(angle)
        x, y, z = hand.axes[link, 0], hand.axes[link, 1], hand.axes[link, 2]
        d = np.float32(1.0) - c
        q00, q01, q02 = c + x * x * d, x * y * d - z * s, x * z * d + y * s
        q10, q11, q12 = y * x * d + z * s, c + y * y * d, y * z * d - x * s
        q20, q21, q22 = z * x * d - y * s, z * y * d + x * s, c + z * z * d
        for i in range(3):
            a = np.float32(0.0)
            b = np.float32(0.0)
            e = np.float32(0.0)
            for k in range(3):
                a += turns[parent, i, k] * origin[k, 0]
                b += turns[parent, i, k] * origin[k, 1]
                e += turns[parent, i, k] * origin[k, 2]
            if hand.drivers[link] >= 0:
                turns[link, i, 0] = a * q00 + b * q10 + e * q20
                turns[link, i, 1] = a * q01 + b * q11 + e * q21
                turns[link, i, 2] = a * q02 + b * q12 + e * q22
            else:
                turns[link, i, 0], turns[link, i, 1], turns[link, i, 2] = a, b, e
            t[link, i] += place * (a * x + b * y + e * z)


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _centers(
    hand: SphereArrays, first: int, last: int, turns: Floats, t: Floats, spheres: Floats
) -> None:
    """Place the spheres of the links first..last-1."""
    for sphere in range(hand.sphere_starts[first], hand.sphere_starts[last]):
        link, local = hand.sphere_links[sphere], hand.sphere_centers[sphere]
        for i in range(3):
            spheres[sphere, i] = (
                turns[link, i, 0] * local[0]
                + turns[link, i, 1] * local[1]
                + turns[link, i, 2] * local[2]
            ) + t[link, i]


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def place_spheres(
    hand: SphereArrays, rotation: Floats, position: Floats, joints: Floats, spheres: Floats
) -> None:
    """Place all spheres of a hand at a pose."""
    count = len(hand.parents)
    turns = np.empty((count, 3, 3), dtype=np.float32)
    t = np.empty((count, 3), dtype=np.float32)
    turns[0] = rotation
    t[0] = position
    _links(hand, 1, count, joints, turns, t)
    _centers(hand, 0, count, turns, t, spheres)


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def measure_spheres(
    hand: SphereArrays,
    values: Floats,
    origin: Floats,
    spacing: float,
    first: int,
    spheres: Floats,
    clearance: Floats,
) -> None:
    """Measure the spheres from `first` on, as many as `clearance` is long."""
    for i in range(len(clearance)):
        x, y, z = spheres[first + i, 0], spheres[first + i, 1], spheres[first + i, 2]
        distance = sample(values, origin, spacing, x, y, z)
        clearance[i] = distance - hand.sphere_radii[first + i]


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _approach(
    hand: SphereArrays,
    values: Floats,
    origin: Floats,
    spacing: float,
    position: Floats,
    direction: Floats,
    travel: float,
    spheres: Floats,
    clearance: Floats,
) -> bool:
    """Move the rigid hand until it touches or has travelled enough; False: started in contact."""
    moved = np.float32(0.0)
    for step in range(_APPROACH_STEPS):
        measure_spheres(hand, values, origin, spacing, 0, spheres, clearance)
        nearest = clearance.min()
        if step == 0 and nearest < -_TOUCH:
            return False
        advance = min(max(np.float32(0.95) * nearest, np.float32(4e-4)), travel - moved)
        if nearest < _TOUCH or advance <= 1e-6:
            break
        moved += advance
        for i in range(3):
            position[i] += direction[i] * advance
            for sphere in range(len(spheres)):
                spheres[sphere, i] += direction[i] * advance
    return True


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _longest_step(
    hand: SphereArrays,
    chain: int,
    speeds: Floats,
    active: np.ndarray,
    turns: Floats,
    t: Floats,
    spheres: Floats,
    clearance: Floats,
) -> np.float32:
    """Return the step of the chain's joints during which no sphere of it can reach the object."""
    step = np.float32(_LARGEST)
    start, end = hand.chain_starts[chain], hand.chain_starts[chain + 1]
    for sphere in range(hand.sphere_starts[start], hand.sphere_starts[end]):
        link = hand.sphere_links[sphere]
        speed = np.float32(0.0)
        while link > 0:
            joint = hand.drivers[link]
            if joint >= 0 and active[joint]:
                dx, dy, dz = (
                    spheres[sphere, 0] - t[link, 0],
                    spheres[sphere, 1] - t[link, 1],
                    spheres[sphere, 2] - t[link, 2],
                )
                lever = np.sqrt(dx * dx + dy * dy + dz * dz)
                if hand.slides[link]:
                    lever = np.float32(1.0)
                speed += np.abs(speeds[joint] * hand.ratios[link]) * lever
            link = hand.parents[link]
        if speed > 1e-6:
            step = min(step, max(clearance[sphere], np.float32(0.0)) / speed)
    return max(step, np.float32(_SMALLEST))


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _blocked_link(
    hand: SphereArrays,
    chain: int,
    spheres: Floats,
    proposed: Floats,
    clearance: Floats,
    distance: Floats,
) -> int:
    """Return the outermost link of the chain that a posture drives into something, or -1."""
    start, end = hand.chain_starts[chain], hand.chain_starts[chain + 1]
    first, last = hand.sphere_starts[start], hand.sphere_starts[end]
    blocked = -1
    for sphere in range(first, last):
        if distance[sphere - first] < -_PENETRATION and (
            distance[sphere - first] < clearance[sphere] - 1e-6
        ):
            blocked = max(blocked, hand.sphere_links[sphere])
    for other in range(len(hand.chain_starts) - 1):
        if not hand.collide[chain, other]:
            continue
        begin = hand.sphere_starts[hand.chain_starts[other]]
        stop = hand.sphere_starts[hand.chain_starts[other + 1]]
        for i in range(first, last):
            for j in range(begin, stop):
                reach = hand.sphere_radii[i] + hand.sphere_radii[j] - np.float32(0.001)
                after = np.float32(0.0)
                before = np.float32(0.0)
                for k in range(3):
                    after += (proposed[i, k] - spheres[j, k]) ** 2
                    before += (spheres[i, k] - spheres[j, k]) ** 2
                if after < reach * reach and after < before:
                    blocked = max(blocked, hand.sphere_links[i])
    return blocked


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _propose(
    hand: SphereArrays,
    chain: int,
    step: float,
    joints: Floats,
    speeds: Floats,
    active: np.ndarray,
    proposal: Floats,
) -> None:
    """Write the chain's joints after a step, within limits and passive bend; stop those at one."""
    for joint in range(len(joints)):
        proposal[joint] = joints[joint]
        if not active[joint] or hand.joint_chains[joint] != chain:
            continue
        value = joints[joint] + speeds[joint] * step
        upper = hand.upper[joint]
        leader = hand.follows[joint]
        if leader >= 0:
            bend = hand.follow_ratio * proposal[leader] + hand.follow_slack
            if value > bend:
                value = max(bend, joints[joint])
                if not active[leader]:
                    active[joint] = False
        if value >= upper or value <= hand.lower[joint]:
            value = min(max(value, hand.lower[joint]), upper)
            active[joint] = False
        proposal[joint] = value


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _close(
    hand: SphereArrays,
    values: Floats,
    origin: Floats,
    spacing: float,
    joints: Floats,
    speeds: Floats,
    turns: Floats,
    t: Floats,
    spheres: Floats,
    clearance: Floats,
) -> None:
    """Flex all fingers side by side; a finger that is stopped keeps bending beyond the contact."""
    chains = len(hand.chain_starts) - 1
    active = (np.abs(speeds) > 0) & (hand.joint_chains >= 0)
    proposal = joints.copy()
    proposed = spheres.copy()
    for _ in range(_CLOSING_STEPS):
        moving = False
        for chain in range(chains):
            start, end = hand.chain_starts[chain], hand.chain_starts[chain + 1]
            first, last = hand.sphere_starts[start], hand.sphere_starts[end]
            busy = False
            for joint in range(len(joints)):
                busy |= active[joint] and hand.joint_chains[joint] == chain
            if not busy:
                continue
            moving = True
            step = _longest_step(hand, chain, speeds, active, turns, t, spheres, clearance)
            _propose(hand, chain, step, joints, speeds, active, proposal)
            _links(hand, start, end, proposal, turns, t)
            _centers(hand, start, end, turns, t, proposed)
            distance = np.empty(last - first, dtype=np.float32)
            measure_spheres(hand, values, origin, spacing, first, proposed, distance)
            blocked = _blocked_link(hand, chain, spheres, proposed, clearance, distance)
            if blocked < 0:
                for joint in range(len(joints)):
                    if hand.joint_chains[joint] == chain:
                        joints[joint] = proposal[joint]
                spheres[first:last] = proposed[first:last]
                clearance[first:last] = distance
            else:
                link = blocked
                while link > 0:
                    if hand.drivers[link] >= 0:
                        active[hand.drivers[link]] = False
                    link = hand.parents[link]
                _links(hand, start, end, joints, turns, t)
        if not moving:
            break


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def try_grasp(
    hand: SphereArrays,
    values: Floats,
    origin: Floats,
    spacing: float,
    rotation: Floats,
    position: Floats,
    direction: Floats,
    travel: float,
    joints: Floats,
    speeds: Floats,
    spheres: Floats,
    clearance: Floats,
) -> int:
    """Approach and close; position, joints, spheres and clearance hold the result."""
    count = len(hand.parents)
    turns = np.empty((count, 3, 3), dtype=np.float32)
    t = np.empty((count, 3), dtype=np.float32)
    turns[0] = rotation
    t[0] = position
    _links(hand, 1, count, joints, turns, t)
    _centers(hand, 0, count, turns, t, spheres)
    if not _approach(
        hand, values, origin, spacing, position, direction, travel, spheres, clearance
    ):
        return 1
    t[0] = position
    _links(hand, 1, count, joints, turns, t)
    _close(hand, values, origin, spacing, joints, speeds, turns, t, spheres, clearance)
    if clearance.min() > 0.0018:
        return 2
    if clearance.min() < -0.003:
        return 3
    return 0
