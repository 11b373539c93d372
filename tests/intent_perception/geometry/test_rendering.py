"""The z-buffer against Open3D's ray casting, and its laws."""

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import Lamp, render, visible_pixels
from intent_perception.geometry.transforms import inverse, look_at, make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectDatabase

MODELS = ObjectDatabase.load()
T_CAMERA_TABLE = inverse(look_at([0.0, -0.75, 0.55], [0.0, 0.0, 0.05]))


def scene() -> tuple[list[Mesh], Array, Array]:
    table = Mesh.of([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    meshes, poses, colors = [table], [T_CAMERA_TABLE], [np.array([0.5, 0.4, 0.3])]
    names = ("mug_0", "bottle_3", "hammer_0", "glass_6", "knife_2", "screwdriver_1")
    for k, name in enumerate(names):
        model = MODELS[name]
        turn = rotation_from_vector([0, 0, 0.9 * k])
        place = make_pose(turn, [0.17 * (k % 3 - 1), 0.2 * (k // 3) - 0.1, 0.0])
        meshes.append(model.mesh)
        poses.append(T_CAMERA_TABLE @ place @ model.stable_poses[0])
        colors.append(model.color)
    return meshes, np.stack(poses), np.stack(colors)


def test_depth_is_that_of_ray_casting() -> None:
    o3d = pytest.importorskip("open3d", exc_type=ImportError)
    meshes, poses, _ = scene()
    rendered = render(KINECT, meshes, poses)
    caster = o3d.t.geometry.RaycastingScene()
    for mesh, pose in zip(meshes, poses, strict=True):
        moved = mesh.transformed(pose)
        vertices = o3d.core.Tensor(moved.vertices.astype(np.float32))
        caster.add_triangles(vertices, o3d.core.Tensor(moved.faces.astype(np.uint32)))
    rays = np.concatenate([np.zeros((480, 640, 3)), KINECT.rays()], axis=2).astype(np.float32)
    hit = caster.cast_rays(o3d.core.Tensor(rays))
    expected = hit["t_hit"].numpy()
    expected[~np.isfinite(expected)] = 0.0
    error = np.abs(rendered.depth - expected)
    same = rendered.label == np.where(expected > 0, hit["geometry_ids"].numpy().astype(int), -1)
    assert np.mean(same) > 0.9995  # pixels whose ray grazes an outline may differ
    assert np.mean(error[same] > 0.0005) < 1e-4


def test_normals_are_those_of_the_faces_towards_the_camera() -> None:
    meshes, poses, _ = scene()
    rendered = render(KINECT, meshes, poses, normals=True)
    assert rendered.normal is not None
    table = rendered.label == 0
    np.testing.assert_allclose(
        rendered.normal[table], T_CAMERA_TABLE[None, :3, 2].repeat(table.sum(), 0), atol=1e-5
    )
    seen = rendered.label >= 0
    facing = np.einsum("ij,ij->i", rendered.normal[seen], KINECT.rays()[seen])
    assert facing.max() <= 1e-4


def test_faces_behind_the_camera_are_cut_off() -> None:
    floor = Mesh.of(
        [[-50, 0, -50], [50, 0, -50], [50, 0, 50], [-50, 0, 50]], [[0, 2, 1], [0, 3, 2]]
    )
    rendered = render(KINECT, [floor], make_pose(np.eye(3), [0, 1.0, 0])[None])
    assert np.all(rendered.label[:200] == -1)
    rows = np.arange(300, 480)
    expected = KINECT.fy / (rows - KINECT.cy)
    np.testing.assert_allclose(rendered.depth[300:, 320], expected, rtol=1e-3)


def test_nearer_object_hides_the_farther() -> None:
    mesh = MODELS["mug_0"].mesh
    poses = np.stack([make_pose(np.eye(3), [0, 0, z]) for z in (1.0, 0.6)])
    alone = visible_pixels(render(KINECT, [mesh], poses[:1]), 1)
    both = visible_pixels(render(KINECT, [mesh, mesh], poses), 2)
    assert alone[0] > 1000
    assert both[0] < 0.1 * alone[0]


def test_light_from_the_left_makes_the_left_brighter() -> None:
    mesh = MODELS["bottle_0"].mesh
    pose = make_pose(rotation_from_vector([np.pi / 2, 0, 0]), [0, 0, 0.6])[None]
    lamp = Lamp(direction=np.array([-1.0, 0.0, -0.3]))
    image = render(KINECT, [mesh], pose, [[0.5, 0.5, 0.5]], lamp).color
    assert image is not None
    row = image[240].sum(axis=1).astype(float)
    columns = np.flatnonzero(row)
    middle = len(columns) // 2
    assert row[columns[:middle]].mean() > 1.3 * row[columns[middle:]].mean()


def test_empty_scene_is_empty() -> None:
    rendered = render(KINECT, [], np.zeros((0, 4, 4)), np.zeros((0, 3)))
    assert not rendered.depth.any()
    assert np.all(rendered.label == -1)


def test_numbers_of_meshes_and_poses_must_agree() -> None:
    with pytest.raises(ValueError, match="expected poses"):
        render(KINECT, [MODELS["mug_0"].mesh], np.zeros((2, 4, 4)))
