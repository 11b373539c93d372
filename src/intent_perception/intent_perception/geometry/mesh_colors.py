"""The mean colour of a mesh file: of vertices or faces, of materials (OBJ with MTL, GLB), textures.

What a material needs beside the mesh is looked for in the mesh's folder. Colours that cannot be
read cost nothing but the colour.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_bytes

_LARGEST_FILE = 64 << 20
WITH_MATERIALS = ("obj", "glb")


def mean_color(visual: Any, areas: Array) -> Array | None:
    """Return RGB (3,) in 0..1 of trimesh's colours, weighted by the faces' areas (F,).

    None where the file gives none.
    """
    if visual.kind == "texture":
        return _material_color(visual)
    if visual.kind not in ("vertex", "face"):
        return None
    colors = np.asarray(visual.face_colors, dtype=np.float64)[:, :3] / 255.0
    if len(colors) != len(areas) or areas.sum() <= 0.0:
        return None
    return np.asarray(areas @ colors / areas.sum())


def material_color(path: Path, content: bytes, kind: str) -> Array | None:
    """Return RGB (3,) in 0..1 of the materials of a mesh file, None where there are none.

    Args:
        path: of the file, whose folder holds materials and textures.
        content: of the file.
        kind: one of `WITH_MATERIALS`.
    """
    import trimesh

    class Beside(trimesh.resolvers.Resolver):
        """Files in the folder of the mesh, and only there."""

        def __init__(self) -> None:
            pass

        def get(self, name: str) -> bytes:
            file = path.parent / Path(str(name).strip().replace("\\", "/")).name
            return read_bytes(file, _LARGEST_FILE)

        def keys(self) -> list[str]:
            return []

        def namespaced(self, _: str) -> "Beside":
            return self

        def write(self, name: str, _: bytes) -> None:
            raise ValueError(f"expected nobody to write {name}")

    try:
        scene = trimesh.load(
            io.BytesIO(content), file_type=kind, resolver=Beside(), force="scene", process=False
        )
        total, area = np.zeros(3), 0.0
        for part in scene.geometry.values():
            areas = np.asarray(part.area_faces)
            color = mean_color(part.visual, areas)
            if color is not None:
                total += color * areas.sum()
                area += float(areas.sum())
    except Exception:  # materials of every make: without them the object is grey
        return None
    return total / area if area > 0.0 else None


def _material_color(visual: Any) -> Array | None:
    """Return the mean colour of a texture where it is used, else of the material."""
    material = visual.material
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    if image is None or visual.uv is None:
        factor = getattr(material, "baseColorFactor", None)
        color = factor if factor is not None else getattr(material, "main_color", None)
        if color is None:
            return None
        found = np.asarray(color, dtype=np.float64)[:3]
        return found / 255.0 if found.max() > 1.0 else found
    pixels = np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0
    height, width = pixels.shape[:2]
    uv = np.asarray(visual.uv, dtype=np.float64) % 1.0
    rows = np.clip(((1.0 - uv[:, 1]) * height).astype(int), 0, height - 1)
    columns = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    return np.asarray(pixels[rows, columns].mean(axis=0))
