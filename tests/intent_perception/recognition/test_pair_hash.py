"""The hash table of oriented point pairs: exact, invariant, extendable, saved."""

from pathlib import Path

import numpy as np
import pytest

from intent_perception.geometry.transforms import make_pose, rotation_from_vector, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.proposal.model_surface import ModelSurface, surface_of
from intent_perception.recognition.proposal.pair_hash import PairTable, pair_frame
from intent_perception.recognition.proposal.pair_hypotheses import transform_of_pair

DATABASE = ObjectDatabase.load()


def surface(name: str) -> ModelSurface:
    return surface_of(DATABASE[name], 300, np.random.default_rng(1))


def everywhere(surface: ModelSurface) -> np.ndarray:
    return np.ones(len(surface.points), dtype=bool)


def table_of(*names: str) -> PairTable:
    table = PairTable.empty((0.03, 0.06), 0.003, 2000)
    for number, name in enumerate(names):
        found = surface(name)
        table = table.with_model(number, found, everywhere(found))
    return table


def test_transform_of_a_pair_is_exact_on_noise_free_data() -> None:
    mug = surface("mug_1")
    T_true = make_pose(rotation_from_vector(np.array([0.4, -1.1, 0.7])), np.array([0.1, -0.2, 0.9]))
    points = transform_points(T_true, mug.points).astype(np.float32)
    normals = (mug.normals @ T_true[:3, :3].T).astype(np.float32)
    table = PairTable.empty((0.03, 0.06), 0.003, 2000).with_model(0, mug, everywhere(mug))
    room, rotation, translation = np.zeros((3, 3), "f4"), np.zeros((3, 3), "f4"), np.zeros(3, "f4")
    frame = np.zeros((3, 3), np.float32)
    for _, i, j in table.entries[::50]:
        if not pair_frame(points[i], normals[i], points[j], normals[j], frame):
            continue
        middle = 0.5 * (points[i] + points[j])
        model = (mug.points[i], mug.normals[i], mug.points[j], mug.normals[j])
        assert transform_of_pair(frame, middle, *model, room, rotation, translation)
        assert np.allclose(rotation, T_true[:3, :3], atol=2e-3)
        assert np.allclose(translation, T_true[:3, 3], atol=2e-4)


def test_signatures_do_not_change_under_a_rigid_motion() -> None:
    mug = surface("mug_1")
    turn = rotation_from_vector(np.array([0.3, 0.8, -1.2]))
    moved = ModelSurface(
        (mug.points @ turn.T + 0.2).astype(np.float32),
        (mug.normals @ turn.T).astype(np.float32),
        mug.seen,
    )
    empty = PairTable.empty((0.06,), 0.003, 10**6)
    still = empty.with_model(0, mug, everywhere(mug))
    other = empty.with_model(0, moved, everywhere(mug))
    # only pairs at the edge of a bin or of the distance may change theirs
    counts = [np.bincount(t.keys, minlength=24**3) for t in (still, other)]
    assert np.abs(counts[0] - counts[1]).sum() < 0.02 * len(still.keys)


def test_a_model_is_added_without_touching_the_others() -> None:
    one, two = table_of("mug_1"), table_of("mug_1", "knife_2")
    kept = two.entries[two.entries[:, 0] == 0]
    assert two.models == 2
    assert np.array_equal(kept, one.entries)


def test_models_added_one_by_one_or_together_give_the_same_table() -> None:
    surfaces = [surface("mug_1"), surface("knife_2")]
    added = [(k, s, everywhere(s)) for k, s in enumerate(surfaces)]
    together = PairTable.empty((0.03, 0.06), 0.003, 2000).with_models(added)
    assert np.array_equal(together.entries, table_of("mug_1", "knife_2").entries)


def test_a_saved_table_is_read_back_unchanged(tmp_path: Path) -> None:
    table = table_of("hammer_3")
    table.save(tmp_path / "table.npz")
    again = PairTable.load(tmp_path / "table.npz")
    assert np.array_equal(again.entries, table.entries)
    assert np.array_equal(again.starts, table.starts)


def test_a_damaged_table_is_refused(tmp_path: Path) -> None:
    table_of("hammer_3").save(tmp_path / "table.npz")
    content = (tmp_path / "table.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(content[: len(content) // 2])
    with pytest.raises(ValueError, match="rebuild"):
        PairTable.load(tmp_path / "cut.npz")


def test_surface_points_are_seen_from_outside() -> None:
    glass = surface("glass_2")
    outward = np.einsum("ij,ij->i", glass.normals[:, :2], glass.points[:, :2]) > 0.0
    low = (glass.points[:, 2] < 0.0) & (np.abs(glass.normals[:, 2]) < 0.3)
    # the inner wall near the bottom is hidden by the rim from nearly everywhere
    assert np.sum(low & ~outward) < 0.2 * len(glass.points)
