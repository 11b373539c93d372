"""What speaks for and against a placed model: colour, residual, surface beyond it, turns."""

import numpy as np
import pytest

from intent_perception.geometry.rasterizer import NOTHING
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.verification.alternatives import turns_that_matter
from intent_perception.recognition.verification.color_evidence import color_mismatch
from intent_perception.recognition.verification.contour import surface_beyond
from intent_perception.recognition.verification.fit_measures import patch_residual
from intent_perception.scene.oriented_image import orient
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.scene.table_search import find_table
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

DATABASE = ObjectDatabase.load()
RED = np.array([0.8, 0.15, 0.1], np.float32)


def pixels(color: np.ndarray) -> np.ndarray:
    return np.tile(color.astype(np.float32), (200, 1))


@pytest.mark.parametrize("change", ["darker", "paler", "warmer"])
def test_lamps_and_gloss_hardly_count(change: str) -> None:
    seen = {
        "darker": 0.5 * RED,
        "paler": 0.65 * RED + 0.35 * RED.mean(),
        "warmer": RED * np.array([1.1, 1.0, 0.9]),
    }[change]
    assert color_mismatch(pixels(seen), RED) < 0.6


def test_another_hue_counts_much() -> None:
    assert color_mismatch(pixels(RED[::-1]), RED) > 8.0
    assert color_mismatch(pixels(np.full(3, 0.4)), RED) > 4.0


def test_a_model_without_colour_fits_every_colour() -> None:
    assert color_mismatch(pixels(RED), np.full(3, np.nan, np.float32)) == 0.0


def drawn_square(depth: float) -> np.ndarray:
    drawn = np.full((60, 60), NOTHING, np.float32)
    drawn[10:50, 10:50] = depth
    return drawn


def test_patches_average_noise_out_but_no_error_of_shape() -> None:
    rng = np.random.default_rng(2)
    everywhere = np.ones((100, 100), np.uint8)
    noisy = (0.8 + rng.normal(0.0, 0.002, (100, 100))).astype(np.float32)
    bent = (0.8 + 0.003 * np.sin(np.arange(100) / 8.0) * np.ones((100, 1))).astype(np.float32)
    residuals = [
        patch_residual(20, 20, drawn_square(0.8), raw, everywhere, 0.012) for raw in (noisy, bent)
    ]
    assert residuals[0] < 0.0006
    assert residuals[1] > 0.0015


def test_a_surface_that_runs_on_is_seen() -> None:
    nothing = np.zeros((100, 100), np.float32)
    everywhere = np.ones((100, 100), np.uint8)
    runs_on = np.full((100, 100), 0.8, np.float32)
    ends = runs_on + 0.1
    ends[30:70, 30:70] = 0.8
    far, near = (
        surface_beyond(20, 20, drawn_square(0.8), smooth, everywhere, nothing, 0.006)
        for smooth in (runs_on, ends)
    )
    assert far == pytest.approx(1.0, abs=0.01)
    assert near == 0.0


def test_turning_a_bottle_changes_nothing_turning_a_mug_does() -> None:
    library = ModelLibrary.of(DATABASE.select(["bottle_0", "mug_0"]))
    quarter = np.array([[[0, -1, 0], [1, 0, 0], [0, 0, 1]]], np.float32)
    matters = [
        turns_that_matter(
            library.points[a:b], library.normals[a:b], quarter, np.zeros(3, np.float32)
        )[0]
        for a, b in zip(library.offsets[:-1], library.offsets[1:], strict=True)
    ]
    assert matters == [False, True]


def test_what_is_explained_is_not_looked_at_again() -> None:
    frame = tabletop_scene([DATABASE["bottle_0"]], np.random.default_rng(12), standing=1.0).frame
    image = orient(frame, 525.0, 0.009, 1.8)
    table = find_table(image, np.random.default_rng(0), 0.008, 0.15)
    scene = SceneView.of(image, segment(image, table))
    mask = scene.parts.mask
    assert scene.without(np.zeros(scene.shape, np.float32)).parts.mask.sum() > 0.95 * mask.sum()
    assert scene.without(mask.astype(np.float32)).parts.mask.sum() == 0


def test_the_table_is_level_around_an_object() -> None:
    frame = tabletop_scene([DATABASE["bottle_0"]], np.random.default_rng(12), standing=1.0).frame
    image = orient(frame, 525.0, 0.009, 1.8)
    table = find_table(image, np.random.default_rng(0), 0.008, 0.15)
    scene = SceneView.of(image, segment(image, table))
    assert abs(scene.table_height(200, 150, 440, 330)) < 0.002
    assert scene.table_height(0, 0, 2, 2) == 0.0
