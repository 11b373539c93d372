"""Normal equations of rigid bodies and joint chains gathered as wrenches, compiled.

A residual e of a point c on a body, with derivative g by the point, has the derivative
(g, (c - o) x g) = w by the body's translation and rotation about o: a wrench. A joint with axis a
through p moves its body by s . w with s = (-a x (p - o), a). So every capsule only gathers
sum weight w w^T and sum weight e w (27 numbers), and the joints are reached once per call by
adding up the capsules beyond each joint. This is what makes a row cost 27 additions instead of 90
scattered ones.
"""

import numpy as np

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.scene.hand_kernel import HandBuffers
from intent_tracking.scene.state_layout import CAPSULES, FINGER_CAPSULES

WRENCH = 27
"""21 of the symmetric matrix (lower triangle, row by row), 6 of the vector."""


@borrowing_kernel
def add_wrench(
    bag: Floats,
    gx: np.float32,
    gy: np.float32,
    gz: np.float32,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    e: np.float32,
    weight: np.float32,
) -> None:
    """Add one residual to a bag (27,): derivative g at the point (x, y, z) from o."""
    m0, m1, m2 = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
    w0, w1, w2 = weight * gx, weight * gy, weight * gz
    w3, w4, w5 = weight * m0, weight * m1, weight * m2
    bag[0] += w0 * gx
    bag[1] += w1 * gx
    bag[2] += w1 * gy
    bag[3] += w2 * gx
    bag[4] += w2 * gy
    bag[5] += w2 * gz
    bag[6] += w3 * gx
    bag[7] += w3 * gy
    bag[8] += w3 * gz
    bag[9] += w3 * m0
    bag[10] += w4 * gx
    bag[11] += w4 * gy
    bag[12] += w4 * gz
    bag[13] += w4 * m0
    bag[14] += w4 * m1
    bag[15] += w5 * gx
    bag[16] += w5 * gy
    bag[17] += w5 * gz
    bag[18] += w5 * m0
    bag[19] += w5 * m1
    bag[20] += w5 * m2
    bag[21] += w0 * e
    bag[22] += w1 * e
    bag[23] += w2 * e
    bag[24] += w3 * e
    bag[25] += w4 * e
    bag[26] += w5 * e


@borrowing_kernel
def empty_bag(bag: Floats, offset: int, normal: Floats, gradient: Floats) -> None:
    """Add a bag to the six unknowns of a body at `offset`."""
    n = 0
    for p in range(6):
        for q in range(p + 1):
            normal[offset + p, offset + q] += bag[n]
            n += 1
        gradient[offset + p] -= bag[21 + p]


@borrowing_kernel
def times_bag(bag: Floats, s: Floats, out: Floats) -> None:
    """Write the bag's symmetric matrix times s (6,) into out (6,)."""
    for p in range(6):
        total = np.float32(0.0)
        for q in range(6):
            high, low = max(p, q), min(p, q)
            total += bag[high * (high + 1) // 2 + low] * s[q]
        out[p] = total


@kernel
def empty_hand(
    bags: Floats, buffers: HandBuffers, state: Floats, normal: Floats, gradient: Floats
) -> None:
    """Add the bags (24, 27) of all capsules, gathered about the wrist, to the hand's unknowns."""
    whole, beyond = np.zeros(WRENCH, np.float32), np.zeros(WRENCH, np.float32)
    screws, image = np.zeros((4, 6), np.float32), np.zeros(6, np.float32)
    for i in range(FINGER_CAPSULES, CAPSULES):
        whole += bags[i]
    for finger in range(5):
        beyond[:] = np.float32(0.0)
        for level in range(4):
            n = 4 * finger + level
            ax, ay, az = buffers.axes[n, 0], buffers.axes[n, 1], buffers.axes[n, 2]
            x = buffers.pivots[n, 0] - state[0]
            y = buffers.pivots[n, 1] - state[1]
            z = buffers.pivots[n, 2] - state[2]
            screws[level, 0] = az * y - ay * z
            screws[level, 1] = ax * z - az * x
            screws[level, 2] = ay * x - ax * y
            screws[level, 3], screws[level, 4], screws[level, 5] = ax, ay, az
        for level in range(3, -1, -1):
            if level > 0:
                beyond += bags[3 * finger + level - 1]
            times_bag(beyond, screws[level], image)
            row = 6 + 4 * finger + level
            for p in range(6):
                normal[row, p] += image[p]
                gradient[row] -= screws[level, p] * beyond[21 + p]
            for upper in range(level + 1):
                total = np.float32(0.0)
                for p in range(6):
                    total += screws[upper, p] * image[p]
                normal[row, 6 + 4 * finger + upper] += total
        whole += beyond
    empty_bag(whole, 0, normal, gradient)


@borrowing_kernel
def add_row(
    normal: Floats,
    gradient: Floats,
    index: Indices,
    row: Floats,
    count: int,
    residual: np.float32,
    weight: np.float32,
) -> None:
    """Add weight row row^T to the lower triangle and -weight row residual to the gradient."""
    for p in range(count):
        w = weight * row[p]
        i = index[p]
        gradient[i] -= w * residual
        for q in range(p + 1):
            j = index[q]
            if i >= j:
                normal[i, j] += w * row[q]
            else:
                normal[j, i] += w * row[q]


@borrowing_kernel
def hand_row(
    buffers: HandBuffers,
    state: Floats,
    i: int,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    gx: np.float32,
    gy: np.float32,
    gz: np.float32,
    row: Floats,
    index: Indices,
) -> int:
    """Write d(g . c) / dx for a point c = (x, y, z) fixed on capsule i; return its length."""
    row[0], row[1], row[2] = gx, gy, gz
    rx, ry, rz = x - state[0], y - state[1], z - state[2]
    row[3], row[4], row[5] = ry * gz - rz * gy, rz * gx - rx * gz, rx * gy - ry * gx
    for p in range(6):
        index[p] = p
    count = 6
    if i < 15:
        finger = i // 3
        for level in range(i - 3 * finger + 2):
            n = 4 * finger + level
            rx, ry, rz = (
                x - buffers.pivots[n, 0],
                y - buffers.pivots[n, 1],
                z - buffers.pivots[n, 2],
            )
            row[count] = (
                buffers.axes[n, 0] * (ry * gz - rz * gy)
                + buffers.axes[n, 1] * (rz * gx - rx * gz)
                + buffers.axes[n, 2] * (rx * gy - ry * gx)
            )
            index[count] = 6 + n
            count += 1
    return count


@borrowing_kernel
def body_row(
    offset: int,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    gx: np.float32,
    gy: np.float32,
    gz: np.float32,
    row: Floats,
    index: Indices,
    count: int,
) -> int:
    """Append d(g . c) / dx of a point at (x, y, z) from the origin of the body at `offset`."""
    row[count], row[count + 1], row[count + 2] = gx, gy, gz
    row[count + 3], row[count + 4] = y * gz - z * gy, z * gx - x * gz
    row[count + 5] = x * gy - y * gx
    for p in range(6):
        index[count + p] = offset + p
    return count + 6
