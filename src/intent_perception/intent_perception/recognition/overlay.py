"""Recognised objects drawn over the colour image."""

from collections.abc import Sequence

import cv2
import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, ColorImage
from intent_perception.geometry.rendering import render
from intent_perception.objects.model import ObjectModel


def overlay(
    color: ColorImage,
    camera: Camera,
    models: Sequence[ObjectModel],
    poses: Sequence[Array],
    texts: Sequence[str],
    paints: Sequence[tuple[int, int, int]],
) -> ColorImage:
    """Return the image with each model tinted, outlined and labelled.

    Args:
        color: (H, W, 3) RGB.
        camera: its intrinsics.
        models: what to draw.
        poses: T_camera_object (4, 4) of each.
        texts: label of each.
        paints: RGB of each.
    """
    picture = color.copy()
    for model, pose, text, paint in zip(models, poses, texts, paints, strict=True):
        inside = render(camera, [model.mesh], pose[None]).label == 0
        if not inside.any():
            continue
        picture[inside] = (0.65 * picture[inside] + 0.35 * np.array(paint)).astype(np.uint8)
        outlines, _ = cv2.findContours(
            inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        cv2.drawContours(picture, outlines, -1, paint, 1)
        rows, columns = np.nonzero(inside)
        place = (int(columns.min()), max(12, int(rows.min()) - 4))
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 3)
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, paint, 1)
    return picture
