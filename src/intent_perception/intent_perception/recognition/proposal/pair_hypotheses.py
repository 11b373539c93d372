"""Hypotheses: a model and a rigid transform from one oriented point pair of the scene (Sec. III-A).

Each pair of scene points looks up model pairs of its signature; each of those fixes a pose, which
the first verification stage keeps or drops. The best few poses of every model in every part of the
image survive, so that neither a large model nor a large object starves the others.
"""

import numpy as np

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.recognition.proposal.pair_hash import (
    BINS,
    angle_bin,
    is_degenerate,
    pair_frame,
)
from intent_perception.recognition.proposal.pose_slots import keep
from intent_perception.recognition.proposal.proposal_arrays import (
    ModelArrays,
    PairArrays,
    SceneArrays,
    SlotArrays,
)
from intent_perception.recognition.verification.point_check import support

_PAIR_YIELD = 0.0044
"""Chance that a pair whose first point lies on an object gives a pose that refinement takes to the
right one: the least measured over two views of six objects (a knife seen from the side)."""
_TRIES = 24


def pair_iterations(success: float, share: float) -> int:
    """Return how many scene pairs to draw, N = ln(1 - success) / ln(1 - share * yield).

    Args:
        success: probability with which an object is to be hit at least once.
        share: of the points drawn from, those that lie on the object.
    """
    return int(np.ceil(np.log1p(-success) / np.log1p(-share * _PAIR_YIELD)))


@borrowing_kernel
def transform_of_pair(
    scene_frame: Floats,
    scene_middle: Floats,
    first: Floats,
    first_normal: Floats,
    second: Floats,
    second_normal: Floats,
    model_frame: Floats,
    rotation: Floats,
    translation: Floats,
) -> bool:
    """Write the transform that takes a model pair onto a scene pair; False if it fixes none.

    Args:
        scene_frame: (3, 3) `pair_frame` of the scene pair.
        scene_middle: (3,) middle of its points [m].
        first: (3,) first model point; its normal, the second point and its normal follow.
        first_normal: (3,).
        second: (3,).
        second_normal: (3,).
        model_frame: (3, 3) room for the model's frame.
        rotation: (3, 3) out.
        translation: (3,) out [m].
    """
    if not pair_frame(first, first_normal, second, second_normal, model_frame):
        return False
    for r in range(3):
        for c in range(3):
            rotation[r, c] = (
                scene_frame[r, 0] * model_frame[c, 0]
                + scene_frame[r, 1] * model_frame[c, 1]
                + scene_frame[r, 2] * model_frame[c, 2]
            )
    for r in range(3):
        middle = np.float32(0.0)
        for c in range(3):
            middle += rotation[r, c] * np.float32(0.5) * (first[c] + second[c])
        translation[r] = scene_middle[r] - middle
    return True


@kernel
def sample_pairs(  # noqa: C901, PLR0915 (one kernel)
    iterations: int,
    lookups: int,
    rng: np.random.Generator,
    pixels: Indices,
    scene: SceneArrays,
    pairs: PairArrays,
    models: ModelArrays,
    slots: SlotArrays,
    tolerance: float,
) -> int:
    """Fill slots with verified hypotheses from random scene pairs; return how many were generated.

    Args:
        iterations: scene pairs to draw.
        lookups: most model pairs taken per scene pair, drawn evenly among those of its signature.
        rng: of the draws.
        pixels: (N, 2) rows and columns of the points to draw from.
        scene: that the points lie in.
        pairs: the hash table.
        models: whose pairs it holds.
        slots: for the best poses, in and out.
        tolerance: of `support` [m].
    """
    height, width = scene.depth.shape
    frame = np.empty((3, 3), np.float32)
    model_frame = np.empty((3, 3), np.float32)
    rotation = np.empty((3, 3), np.float32)
    translation = np.empty(3, np.float32)
    middle = np.empty(3, np.float32)
    generated = 0
    for _ in range(iterations):
        drawn = rng.integers(0, len(pixels))
        row, column = pixels[drawn, 0], pixels[drawn, 1]
        shell = rng.integers(0, len(pairs.distances))
        distance = pairs.distances[shell]
        found = False
        v = u = 0
        length = 0.0
        for _try in range(_TRIES):
            angle = rng.random() * 2.0 * np.pi
            reach = scene.intrinsics[0] * distance / scene.depth[row, column]
            reach *= 0.4 + 0.65 * rng.random()
            u = int(column + reach * np.cos(angle) + 0.5)
            v = int(row + reach * np.sin(angle) + 0.5)
            if u < 0 or v < 0 or u >= width or v >= height or scene.mask[v, u] != 1:
                continue
            squared = 0.0
            for d in range(3):
                squared += (scene.points[v, u, d] - scene.points[row, column, d]) ** 2
            length = np.sqrt(squared)
            if abs(length - distance) < pairs.tolerance:
                found = True
                break
        if not found:
            continue
        a = b = c = 0.0
        for d in range(3):
            line = (scene.points[v, u, d] - scene.points[row, column, d]) / length
            a += scene.normals[row, column, d] * line
            b -= scene.normals[v, u, d] * line
            c += scene.normals[row, column, d] * scene.normals[v, u, d]
            middle[d] = np.float32(0.5) * (scene.points[v, u, d] + scene.points[row, column, d])
        if is_degenerate(a, b, c) or not pair_frame(
            scene.points[row, column],
            scene.normals[row, column],
            scene.points[v, u],
            scene.normals[v, u],
            frame,
        ):
            continue
        ka, kb, kc = angle_bin(a), angle_bin(b), angle_bin(c)
        total = 0
        for ia in range(max(0, ka - 1), min(BINS, ka + 2)):
            for ib in range(max(0, kb - 1), min(BINS, kb + 2)):
                first_key = ((shell * BINS + ia) * BINS + ib) * BINS
                total += (
                    pairs.starts[first_key + min(BINS, kc + 2)]
                    - pairs.starts[first_key + max(0, kc - 1)]
                )
        if total == 0:
            continue
        share = min(1.0, lookups / total)
        for ia in range(max(0, ka - 1), min(BINS, ka + 2)):
            for ib in range(max(0, kb - 1), min(BINS, kb + 2)):
                first_key = ((shell * BINS + ia) * BINS + ib) * BINS
                begin = pairs.starts[first_key + max(0, kc - 1)]
                size = pairs.starts[first_key + min(BINS, kc + 2)] - begin
                wanted = size * share
                count = int(wanted)
                if rng.random() < wanted - count:
                    count += 1
                if count == 0:
                    continue
                start = rng.integers(0, size)
                step = max(1, size // count)
                for e in range(count):
                    entry = begin + (start + e * step) % size
                    model = pairs.entries[entry, 0]
                    base = models.offsets[model]
                    i, j = base + pairs.entries[entry, 1], base + pairs.entries[entry, 2]
                    if not transform_of_pair(
                        frame,
                        middle,
                        models.points[i],
                        models.normals[i],
                        models.points[j],
                        models.normals[j],
                        model_frame,
                        rotation,
                        translation,
                    ):
                        continue
                    generated += 1
                    consider(
                        rotation, translation, model, scene.plane, scene, models, slots, tolerance
                    )
    return generated


@borrowing_kernel
def consider(
    rotation: Floats,
    translation: Floats,
    model: int,
    plane: Floats,
    scene: SceneArrays,
    models: ModelArrays,
    slots: SlotArrays,
    tolerance: float,
) -> None:
    """Hold a model's pose against the scene on its coarse points and keep it if it is good."""
    first = models.offsets[model]
    points = models.points[first : first + models.coarse[model]]
    normals = models.normals[first : first + models.coarse[model]]
    below = 0
    offset = plane[3]
    if offset > 0.0:
        for i in range(min(12, len(points))):
            height = offset
            for r in range(3):
                coordinate = translation[r]
                for c in range(3):
                    coordinate += rotation[r, c] * points[i, c]
                height += plane[r] * coordinate
            if height < -0.015:
                below += 1
        if below > 0:
            return
    score, match = support(
        rotation,
        translation,
        points,
        normals,
        scene.depth,
        scene.normals,
        scene.mask,
        scene.intrinsics,
        tolerance,
        0.5,
        True,
    )
    if score > 0.3 and match >= 8:
        keep(
            score,
            rotation,
            translation,
            models.axes[model],
            scene.intrinsics,
            slots.columns,
            slots.score[model],
            slots.pose[model],
        )
