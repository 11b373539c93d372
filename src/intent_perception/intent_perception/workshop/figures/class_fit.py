"""Command: fit the odds of the classes to rendered things, and write them into the package.

python -m intent_perception.fit_classes [--scenes N] [--more N] [--data FOLDER]

Scenes of seeds below 1000, and as many as wanted that are like them but hold more kinds of things;
every second mesh of others is held back for the benchmark.
"""

import argparse
import os
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays
from intent_perception.recognition.detector_config import DetectorConfig, oriented_scene, table_of
from intent_perception.recognition.estimation.belongings import readings_of
from intent_perception.recognition.estimation.class_odds import CLASSES, FITTED
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.workshop.scenes.table_scenes import TabletopScene
from intent_perception.workshop.scenes.training_scenes import training_scene
from intent_perception.workshop.scenes.unseen_scenes import HELD_BACK, unseen_scene

_PURE = 0.8  # of a thing's pixels are of one object: else it is two in one
_SEEN = 0.5  # of an object that is fitted to
_HIDDEN_UNITS = 64
_NETS = 4
_DECAY = 0.1
_EPOCHS = 150
_FOLDS = 4
_LEAST_HANDLE = 12  # pixels of a handle that must be seen for a mug


def examples(scenes: Iterable[TabletopScene]) -> tuple[Array, Array, Array]:
    """Return features (N, F), class numbers (N,) and scenes (N,) of rendered things."""
    features, classes, origin = [], [], []
    config = DetectorConfig()
    for number, scene in enumerate(scenes):
        image = oriented_scene(scene.frame, config)
        table = table_of(image, config)
        if table is None:
            continue
        view = SceneView.of(image, segment(image, table))
        rng = np.random.default_rng(config.seed)
        for thing, outline in readings_of(view, table.T_table_camera(), rng):
            h, w = thing.mask.shape
            own = scene.owner[thing.top : thing.top + h, thing.left : thing.left + w][thing.mask]
            own = own[own >= 0]
            if len(own) == 0 or np.bincount(own).max() < _PURE * len(own):
                continue
            truth = scene.objects[int(np.bincount(own).argmax())]
            if truth.visibility < _SEEN:
                continue
            features.append(outline.features)
            classes.append(CLASSES.index(truth.model.object_class))
            origin.append(number)
    return np.array(features), np.array(classes), np.array(origin)


def fitted(features: Array, classes: Array, origin: Array) -> tuple[dict[str, Array], Any]:
    """Return the weights, and class probabilities (N, 7) from fits that never saw the scene."""
    mean, spread = features.mean(axis=0), features.std(axis=0) + 0.02
    values = np.clip((features - mean) / spread, -4.0, 4.0)
    scores = np.zeros((len(values), len(CLASSES)))
    for fold in range(_FOLDS):
        held = origin % _FOLDS == fold
        for net in _nets(values[~held], classes[~held]):
            scores[held] += np.log(net.predict_proba(values[held]) + 1e-9) / _NETS
    sharpness = min(np.linspace(0.4, 1.4, 41), key=lambda s: _surprise(scores * s, classes))
    nets = _nets(values, classes)
    weights = {
        "mean": mean,
        "spread": spread,
        "sharpness": np.array(sharpness),
        "first": np.stack([net.coefs_[0] for net in nets]),
        "first_bias": np.stack([net.intercepts_[0] for net in nets]),
        "second": np.stack([net.coefs_[1] for net in nets]),
        "second_bias": np.stack([net.intercepts_[1] for net in nets]),
    }
    likely = np.exp(scores * sharpness)
    return weights, likely / likely.sum(axis=1, keepdims=True)


def _nets(values: Array, classes: Array) -> list[Any]:
    from sklearn.neural_network import MLPClassifier

    nets = []
    for seed in range(_NETS):
        net = MLPClassifier(
            (_HIDDEN_UNITS,), alpha=_DECAY, max_iter=_EPOCHS, random_state=seed, tol=1e-4
        )
        nets.append(net.fit(values, classes))
    return nets


def _surprise(scores: Array, classes: Array) -> float:
    shifted = scores - scores.max(axis=1, keepdims=True)
    likely = shifted - np.log(np.exp(shifted).sum(axis=1, keepdims=True))
    return float(-likely[np.arange(len(classes)), classes].mean())


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=990)
    parser.add_argument("--more", type=int, default=1290)
    parser.add_argument(
        "--data", type=Path, default=Path(os.environ.get("INTENT_DATA", "../shared/data"))
    )
    arguments = parser.parse_args()
    folder = arguments.data / "meshes"
    meshes = folder if folder.is_dir() else None
    scenes = (unseen_scene(seed, meshes) for seed in range(min(arguments.scenes, HELD_BACK)))
    more = (training_scene(number, meshes) for number in range(arguments.more))
    found = examples(chain(scenes, more))
    weights, odds = fitted(*found)
    write_arrays(FITTED, weights)
    right = odds.argmax(axis=1) == found[1]
    print(f"{len(right)} things, {right.mean():.3f} right in scenes that the fit did not see")
    for number, name in enumerate(CLASSES):
        own = found[1] == number
        told = np.bincount(odds[own].argmax(axis=1), minlength=len(CLASSES))
        print(f"{name or 'none':12}", " ".join(f"{value:5d}" for value in told))
