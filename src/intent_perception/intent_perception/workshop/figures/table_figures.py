"""How often and how exactly the table is found, whatever side the camera sees it from."""

from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.coded_images import write_picture
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.detector_config import DetectorConfig, oriented_scene, table_of
from intent_perception.workshop.figures.benchmark_plan import Plan
from intent_perception.workshop.scenes.table_views import TableView, table_views

_MOST_TILT, _MOST_HEIGHT = 5.0, 0.03
"""Further off than this [deg, m] another plane was taken for the table."""
_GREEN, _RED = (60, 220, 60), (255, 60, 60)
VIEWS = 40


def tables(plan: Plan, count: int = VIEWS) -> dict[str, Any]:
    """Return of how many rendered tables the plane is found, and how far off it is (median)."""
    models = [*ObjectDatabase.load(), *ObjectDatabase.clutter()]
    config, tilts, heights, missed = DetectorConfig(), [], [], []
    for number, view in enumerate(table_views(plan.seed, count, models)):
        table = table_of(oriented_scene(view.frame, config), config)
        error = None
        if table is not None:
            error = table_error(view.T_table_camera, table.T_table_camera())
        right = error is not None and error[0] < _MOST_TILT and error[1] < _MOST_HEIGHT
        if error is not None and right:
            tilts.append(error[0])
            heights.append(1000.0 * error[1])
        else:
            missed.append(f"{plan.seed + number} {view.placement}")
        if plan.pictures is not None:
            found = None if table is None else table.T_table_camera()
            path = plan.pictures / f"table_{plan.seed + number}_{view.placement}.png"
            _draw(path, view, found, table.outline if table is not None else None, right)
    return {
        "scenes": count,
        "found": len(tilts),
        "normal_deg_median": float(np.median(tilts)) if tilts else None,
        "height_mm_median": float(np.median(heights)) if heights else None,
        "normal_deg_max": max(tilts, default=None),
        "height_mm_max": max(heights, default=None),
        "missed": missed,
    }


def table_error(T_true: Array, T_found: Array) -> tuple[float, float]:
    """Return the angle between two table normals [deg] and the difference of the heights [m].

    Args:
        T_true: (4, 4) T_table_camera.
        T_found: (4, 4) T_table_camera.
    """
    cosine = float(np.clip(T_true[2, :3] @ T_found[2, :3], -1.0, 1.0))
    return float(np.degrees(np.arccos(cosine))), float(abs(T_true[2, 3] - T_found[2, 3]))


def _draw(
    path: Path, view: TableView, T_found: Array | None, outline: Floats | None, right: bool
) -> None:
    """Write the picture with the outline that was found, green where it is right."""
    import cv2

    image = view.frame.color.copy()
    if T_found is None or outline is None:
        cv2.putText(image, "no table", (20, 60), cv2.FONT_HERSHEY_SIMPLEX, 1.5, _RED, 3)
    else:
        corners = np.concatenate([outline, np.zeros((len(outline), 1))], axis=1)
        in_camera = (corners - T_found[:3, 3]) @ T_found[:3, :3]
        pixels = view.frame.camera.project(in_camera).astype(np.int32)
        cv2.polylines(image, [pixels], True, _GREEN if right else _RED, 2)
    write_picture(path, image)
