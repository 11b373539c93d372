import numpy as np
import pytest
from tests.support.hand_images import (
    ORIGIN,
    SIZE,
    STEP,
    drawn_hand,
    mug_states,
    pose,
    random_tile,
    whole_cost,
)

from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.fit.objective import forth_costs
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.object_kernel import (
    geometry_of,
    object_arrays,
    object_distances,
    off_grid,
    signed_distance,
)
from intent_tracking.scene.raster import FAR, draw_capsule, draw_mesh


@pytest.mark.parametrize("side", ["right", "left"])
def test_compiled_kinematics_equal_the_joint_table(side):
    model = HandModel(side)
    state, rotation = pose(1)
    buffers = hand_buffers()
    place_hand(hand_arrays(model), state, rotation, buffers)
    local = model.joint_positions(state[6:].astype(float))
    expected = local @ rotation.T.astype(float) + state[:3]
    np.testing.assert_allclose(buffers.landmarks, expected, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_hand_depth_is_the_first_hit_of_every_ray(seed):
    depth, buffers, arrays = drawn_hand(*pose(seed))
    along = ORIGIN + STEP * np.arange(SIZE)
    rays = np.stack([*np.meshgrid(along, along), np.ones((SIZE, SIZE))], axis=-1)
    steps = np.arange(0.5, 0.95, 0.001)
    points = rays[:, :, None] * steps[:, None]
    nearest = np.full(points.shape[:3], np.inf)
    for (a, b), radius in zip(buffers.ends, arrays.radii, strict=True):
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        gap = np.linalg.norm(points - a - t[..., None] * (b - a), axis=-1) - radius
        nearest = np.minimum(nearest, gap)
    hit = nearest <= 0.0
    first = np.where(hit.any(axis=2), steps[hit.argmax(axis=2)], FAR)
    both = (first < 1.0) & (depth < 1.0)
    assert both.sum() > 100
    assert np.abs(first - depth)[both].max() < 0.0015
    assert ((first < 1.0) != (depth < 1.0)).mean() < 0.01


def test_mesh_depth_is_the_plane_of_a_square():
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * 0.05
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    depth = np.full((SIZE, SIZE), FAR)
    rotation = np.eye(3, dtype=np.float32)
    work = np.zeros((4, 3), np.float32)
    zero = np.float32(0.0)
    draw_mesh(
        vertices, faces, rotation, zero, zero, np.float32(0.6), depth, ORIGIN, ORIGIN, STEP, work
    )
    inside = depth < 1.0
    assert inside.sum() == pytest.approx((0.1 / 0.6 / STEP) ** 2, rel=0.05)
    np.testing.assert_allclose(depth[inside], 0.6, atol=1e-5)


def test_published_cost_is_lowest_at_the_true_pose():
    state, rotation = pose(2)
    depth = drawn_hand(state, rotation)[0]
    hand = (depth < 1.0).astype(np.float32)
    seen = Labelled(
        np.where(depth < 1.0, depth, np.float32(1.4)), hand, np.zeros_like(hand),
        np.ones_like(hand), np.ones_like(hand), ORIGIN, ORIGIN, STEP,
    )  # fmt: skip
    rng = np.random.default_rng(3)
    states = np.repeat(state[None], 64, axis=0)
    states[1:, :3] += rng.normal(0, 0.01, (63, 3))
    states[1:, 3:6] += rng.normal(0, 0.1, (63, 3))
    states[1:, 6:] += rng.normal(0, 0.15, (63, 20))
    costs = np.zeros(64, np.float32)
    arrays = hand_arrays(HandModel())
    forth_costs(arrays, object_arrays([]), seen, states, rotation[None], 0, 64, costs)
    assert costs.argmin() == 0


def cut(depth, size, row, column):
    return np.ascontiguousarray(depth[row : row + size, column : column + size])


@pytest.mark.parametrize("seed", range(4))
def test_a_hand_cut_off_by_the_tile_is_drawn_as_on_a_larger_one(seed):
    whole, buffers, arrays = drawn_hand(*pose(seed))
    row, column = 20, 26
    depth = np.full((16, 16), FAR)
    u0, v0 = ORIGIN + np.float32(column) * STEP, ORIGIN + np.float32(row) * STEP
    for i, radius in enumerate(arrays.radii):
        draw_capsule(buffers.ends, i, radius, depth, u0, v0, STEP)
    expected = cut(whole, 16, row, column)
    assert (expected < 1.0).any()
    assert (np.abs(depth - expected) > 1e-4).mean() < 0.02  # rays that graze the silhouette


@pytest.mark.parametrize("seed", range(4))
def test_a_capsule_changes_pixels_within_its_window_only(seed):
    _, buffers, arrays = drawn_hand(*pose(seed))
    for i, radius in enumerate(arrays.radii):
        depth = np.full((SIZE, SIZE), FAR)
        r0, r1, c0, c1 = draw_capsule(buffers.ends, i, radius, depth, ORIGIN, ORIGIN, STEP)
        rows, columns = np.nonzero(depth < 1.0)
        assert np.all((rows >= r0) & (rows < r1) & (columns >= c0) & (columns < c1))
        if 0 not in (r0, c0) and r0 < r1 and max(r1, c1) < SIZE:  # all of it is on the tile
            assert max(rows.min() - r0, columns.min() - c0) < 3
            assert max(r1 - rows.max(), c1 - columns.max()) < 4


def test_cost_in_the_window_of_the_hand_is_that_of_the_whole_tile():
    objects = object_arrays([geometry_of(ObjectDatabase.load()["mug_0"])])
    states, costs = mug_states(8), np.zeros(8, np.float32)
    states[:, 26:] = states[0, 26:]
    seen, base = random_tile(), np.tile(np.eye(3, dtype=np.float32), (2, 1, 1))
    forth_costs(hand_arrays(HandModel()), objects, seen, states, base, 0, 8, costs)
    expected = [whole_cost(objects, seen, state) for state in states]
    np.testing.assert_allclose(costs, expected, rtol=1e-5)


def test_a_point_off_the_grid_is_at_least_as_far_from_the_surface_as_said():
    objects = object_arrays([geometry_of(ObjectDatabase.load()["mug_0"])])
    points = np.random.default_rng(6).uniform(-0.12, 0.12, (500, 3)).astype(np.float32)
    gradient = np.empty(3, np.float32)
    least = np.array([off_grid(objects, 0, *point) for point in points])
    distance = np.array([signed_distance(objects, 0, *point, gradient) for point in points])
    assert 0 < (least > 0.0).sum() < 500
    assert np.all(distance[least > 0.0] >= least[least > 0.0] - 0.003)  # one cell of the grid


def test_distances_are_right_within_reach_and_beyond_it_elsewhere():
    objects = object_arrays([geometry_of(ObjectDatabase.load()["mug_0"])])
    points = np.random.default_rng(8).uniform(-0.3, 0.3, (3, 800)).astype(np.float32)
    rotation, zero, found = pose(3)[1], np.float32(0.0), np.zeros((2, 800), np.float32)
    for reach, distance in zip((np.float32(0.09), FAR), found, strict=True):
        object_distances(objects, 0, rotation, zero, zero, zero, points, reach, distance)
    within = found[1] < 0.09
    assert 0 < within.sum() < 800
    np.testing.assert_array_equal(found[0, within], found[1, within])
    assert np.all(found[0, ~within] >= 0.09)


def test_drawn_depth_agrees_with_ray_casting():
    o3d = pytest.importorskip("open3d")
    mesh = Mesh.of(*_cone())
    scene = o3d.t.geometry.RaycastingScene()
    rotation = pose(5)[1]
    placed = mesh.vertices @ rotation.T + [0, 0, 0.6]
    scene.add_triangles(
        o3d.core.Tensor(placed.astype(np.float32)), o3d.core.Tensor(mesh.faces.astype(np.uint32))
    )
    along = ORIGIN + STEP * np.arange(SIZE, dtype=np.float32)
    rays = np.stack([*np.meshgrid(along, along), np.ones((SIZE, SIZE), np.float32)], axis=-1)
    rays = np.concatenate([np.zeros_like(rays), rays], axis=-1).astype(np.float32)
    expected = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
    depth = np.full((SIZE, SIZE), FAR)
    draw_mesh(
        mesh.vertices.astype(np.float32), mesh.faces, rotation, np.float32(0), np.float32(0),
        np.float32(0.6), depth, ORIGIN, ORIGIN, STEP, np.zeros_like(mesh.vertices, np.float32),
    )  # fmt: skip
    both = np.isfinite(expected) & (depth < 1.0)
    assert both.sum() > 100
    assert np.abs(expected - depth)[both].max() < 0.0005


def _cone():
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.stack([0.04 * np.cos(angles), 0.04 * np.sin(angles), np.zeros(24)], axis=1)
    vertices = np.concatenate([ring, [[0, 0, 0.1], [0, 0, 0]]])
    following = np.roll(np.arange(24), -1)
    sides = np.stack([np.arange(24), following, np.full(24, 24)], axis=1)
    floor = np.stack([following, np.arange(24), np.full(24, 25)], axis=1)
    return vertices, np.concatenate([sides, floor])
