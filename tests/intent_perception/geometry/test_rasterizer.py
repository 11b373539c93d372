"""Triangles are drawn where rays meet them."""

import numpy as np
import open3d as o3d
import pytest
from scipy.spatial.transform import Rotation

from intent_perception.geometry.rasterizer import NOTHING, rasterize
from intent_perception.objects.database import ObjectDatabase

INTRINSICS = np.array([500.0, 480.0, 61.0, 77.0], np.float32)
SIZE = (150, 120)


def drawn(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    depth = np.full(SIZE, -1.0, np.float32)
    rasterize(vertices, faces, INTRINSICS, depth)
    return depth


def met(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Depths at which the rays of the pixels meet triangles, by another library."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))
    )
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    fx, fy, cx, cy = INTRINSICS
    rays = np.zeros((*SIZE, 6), np.float32)
    rays[..., 3], rays[..., 4], rays[..., 5] = (u - cx) / fx, (v - cy) / fy, 1.0
    return scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()


@pytest.mark.parametrize("name", ["bottle_0", "glass_4", "mug_3", "hammer_1", "screwdriver_2"])
def test_models_are_drawn_where_rays_meet_them(name: str) -> None:
    mesh = ObjectDatabase.load()[name].mesh
    for seed in range(4):  # partly beyond the image's border
        turn = Rotation.random(random_state=seed).as_matrix()
        vertices = (mesh.vertices @ turn.T + [0.02, 0.0, 0.5]).astype(np.float32)
        ours, theirs = drawn(vertices, mesh.faces), met(vertices, mesh.faces)
        nothing, infinite = ours >= NOTHING, ~np.isfinite(theirs)
        assert np.mean(nothing == infinite) > 0.9995
        both = ~nothing & ~infinite
        assert both.sum() > 500
        assert np.mean(np.abs(ours - theirs)[both] < 1e-4) > 0.998


def test_neighbouring_triangles_leave_no_gap() -> None:
    rng = np.random.default_rng(0)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 200))
    rim = np.stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), np.full(200, 0.5)], axis=1)
    vertices = np.vstack([rim, [[0.0, 0.0, 0.5]]]).astype(np.float32)
    faces = np.array([[k, (k + 1) % 200, 200] for k in range(200)], np.int32)
    depth = drawn(vertices, faces)
    assert np.allclose(depth[40:110, 20:100], 0.5, atol=1e-5)


def test_what_is_too_near_is_not_drawn() -> None:
    near = np.array([[-0.1, -0.1, 0.04], [0.1, -0.1, 1.0], [0.0, 0.1, 1.0]], np.float32)
    assert (drawn(near, np.array([[0, 1, 2]], np.int32)) == NOTHING).all()
