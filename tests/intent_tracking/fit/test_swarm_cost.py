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

from intent_perception.objects.database import ObjectDatabase
from intent_tracking.fit.objective import penetration, turn_bodies
from intent_tracking.fit.pso import fly, remember
from intent_tracking.fit.swarm_cost import joint_costs, near_penetration, sums_of_nothing
from intent_tracking.scene.hand_kernel import hand_arrays, new_hand_buffers, place_hand
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.inverse_depth import PADDING, draw_capsule, draw_meshes, mesh_arrays
from intent_tracking.scene.object_kernel import geometry_of, object_arrays
from intent_tracking.scene.packed_objects import PackedObjects

IDENTITIES = np.tile(np.eye(3, dtype=np.float32), (2, 1, 1))


@pytest.fixture(scope="module")
def mug():
    return geometry_of(ObjectDatabase.load()["mug_0"])


def image_of(meshes, state, rotations):
    image = np.zeros((SIZE, SIZE + PADDING), np.float32)
    count = max(meshes.vertices.shape[1], len(meshes.faces))
    work, chosen = np.zeros((3, count), np.float32), np.zeros(count + 1, np.int32)
    window = draw_meshes(meshes, state, rotations, image, ORIGIN, ORIGIN, STEP, work, chosen)
    return image[:, :SIZE], window


def depth_of(image):
    return np.divide(1.0, image, out=np.full_like(image, np.inf), where=image > 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_capsules_of_inverse_depth_are_those_of_depth(seed):
    depth, buffers, arrays = drawn_hand(*pose(seed))
    image = np.zeros((SIZE, SIZE + PADDING), np.float32)
    for i, radius in enumerate(arrays.radii):
        draw_capsule(buffers.ends, i, radius, image, ORIGIN, ORIGIN, STEP)
    found = depth_of(image[:, :SIZE])
    both = np.isfinite(found) & (depth < 1.0)
    assert both.sum() > 100
    assert (np.isfinite(found) != (depth < 1.0)).sum() <= 1  # a ray that grazes the silhouette
    assert np.abs(found[both] - depth[both]).max() < 1e-4


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["mug_0", "hammer_0"])
def test_meshes_of_the_swarm_are_drawn_where_rays_hit_them(name, seed):
    o3d = pytest.importorskip("open3d")
    meshes = PackedObjects([geometry_of(ObjectDatabase.load()[name])]).coarse_meshes([0])
    state, rotations = np.zeros(32, np.float32), np.stack([np.eye(3), pose(seed)[1]])
    state[26:29] = [0.01, -0.02, 0.7]
    rotations = rotations.astype(np.float32)
    found = depth_of(image_of(meshes, state, rotations)[0])
    scene = o3d.t.geometry.RaycastingScene()
    placed = meshes.vertices.T @ rotations[1].T + state[26:29]
    scene.add_triangles(o3d.core.Tensor(placed), o3d.core.Tensor(meshes.faces.astype(np.uint32)))
    along = ORIGIN + STEP * np.arange(SIZE, dtype=np.float32)
    rays = np.stack([*np.meshgrid(along, along), np.ones((SIZE, SIZE), np.float32)], axis=-1)
    rays = np.concatenate([np.zeros_like(rays), rays], axis=-1).astype(np.float32)
    expected = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
    both = np.isfinite(expected) & np.isfinite(found)
    assert both.sum() > 50
    assert (np.isfinite(expected) != np.isfinite(found)).sum() <= 2  # rays along an edge
    assert np.abs(expected[both] - found[both]).max() < 0.0005


def test_a_mesh_changes_pixels_within_its_window_only(mug):
    state = np.zeros(32, np.float32)
    state[26:29] = [0.15, -0.02, 0.7]  # partly outside the tile
    image, (r0, r1, c0, c1) = image_of(mesh_arrays([(mug.vertices, mug.faces)]), state, IDENTITIES)
    rows, columns = np.nonzero(image)
    assert len(rows) > 50
    assert np.all((rows >= r0) & (rows < r1) & (columns >= c0) & (columns < c1))


def test_cost_of_every_particle_is_that_of_the_whole_tile(mug):
    objects, states, seen = object_arrays([mug]), mug_states(8), random_tile()
    costs = np.zeros(8, np.float32)
    meshes = mesh_arrays([(mug.vertices, mug.faces)])
    joint_costs(
        hand_arrays(HandModel()),
        objects,
        meshes,
        seen,
        sums_of_nothing(seen),
        states,
        IDENTITIES,
        costs,
    )
    expected = [whole_cost(objects, seen, state) for state in states]
    np.testing.assert_allclose(costs, expected, rtol=1e-5)


def test_penetration_is_that_of_every_capsule(mug):
    arrays, objects, gradient = hand_arrays(HandModel()), object_arrays([mug]), np.zeros(3, "f4")
    found, expected = [], []
    for state in mug_states(40):
        buffers, rotations = new_hand_buffers(), IDENTITIES.copy()
        turn_bodies(state, IDENTITIES, rotations)
        place_hand(arrays, state, rotations[0], buffers)
        scene = arrays, buffers, objects, state, rotations
        found.append(near_penetration(*scene, gradient))
        expected.append(penetration(*scene, 0, 24, gradient))
    assert max(expected) > 0.02
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_step_of_the_swarm_is_that_of_the_published_equations():
    rng = np.random.default_rng(7)
    position, own = rng.normal(0, 0.3, (2, 64, 32)).astype(np.float32)
    velocity, spread = rng.normal(0, 0.2, (64, 32)), np.full(32, 0.2, np.float32)
    low, high = np.full(32, -0.5, np.float32), np.full(32, 0.4, np.float32)
    draws = rng.random((2, 64, 32), dtype=np.float32)
    pull = 2.8 * draws[0] * (own - position) + 1.3 * draws[1] * (own[3] - position)
    faster = np.clip(0.7298438 * (velocity + pull), -0.4, 0.4)
    expected = np.clip(position + faster, -0.5, 0.4)
    fly(position, velocity, own, own[3], draws, spread, low, high)
    np.testing.assert_allclose(velocity, faster, atol=1e-6)
    np.testing.assert_allclose(position, expected, atol=1e-6)


def test_every_particle_remembers_its_best_position():
    rng = np.random.default_rng(9)
    position, own = rng.normal(size=(2, 16, 32)).astype(np.float32)
    costs, own_cost = rng.random((2, 16), dtype=np.float32)
    least, better = np.minimum(costs, own_cost), (costs < own_cost)[:, None]
    expected = np.where(better, position, own)
    assert remember(position, costs, own, own_cost) == least.argmin()
    np.testing.assert_array_equal(own, expected)
    np.testing.assert_array_equal(own_cost, least)
