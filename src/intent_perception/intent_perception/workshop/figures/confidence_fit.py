"""Command: fit the weights of `confidence` on development scenes (seeds below 1000).

python -m intent_perception.fit_confidence [--rounds N] [--detections FILE.npz] [--out FILE.yaml]

Scenes of known objects, of clutter alone and of both are searched with 6 and with 48 models. Half
of them have other lamps than the models' colours were taken under, a third a worse camera, which
bends surfaces too. Every detection is compared with the truth, and a logistic function of its
features is fitted. A weight may not have a sign that contradicts what its feature means, and large
weights cost: rendered scenes are cleaner than real ones. The report beside the weights is of scenes
that had no part in the fit (five parts, each judged by the fit to the other four).
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.optimize import minimize

from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.safe_files import write_arrays, write_text
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import OBJECT_CLASSES, ObjectModel
from intent_perception.recognition.confidence import FEATURES, FITTED, SIGNS
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.recognizer import RecognizerConfig
from intent_perception.workshop.figures.scoring import Claim, expected_calibration_error, judge
from intent_perception.workshop.scenes.sensor_noise import KinectNoise
from intent_perception.workshop.scenes.table_scenes import TabletopScene, tabletop_scene

_KINDS = {
    "six": (20, 3, 6),
    "clutter for six": (400, 5, 6),
    "all": (100, 1, 48),
    "clutter": (200, 1, 48),
    "both": (300, 1, 48),
}
"""First seed, scenes in a round and models searched for of each kind of scene."""
_MOST_ROUNDS = 25  # then the next kind's seeds begin
_PARTS = 5

_PENALTY = 1.0
_WORSE_CAMERA = KinectNoise(axial_floor=0.0018, lateral=1.2, edge_dropout=0.4, grazing=70.0)
_PALE = 0.4  # largest share of a colour's saturation that gloss takes
_BEND = 0.002  # spread of the worse camera's smooth error of depth at 1 m [m]
_LAMP_LEVEL, _LAMP_TINT = 0.3, 0.08  # spread of the logarithm of brightness and of each channel


@dataclass(frozen=True, eq=False)
class DevelopmentScene:
    """One scene to learn from."""

    scene: TabletopScene
    """What is there."""
    size: int
    """Of the library that is searched for, 6 or 48 models."""
    kind: str
    """What stands there."""
    seed: int
    """Of the scene."""


@dataclass
class Detections:
    """Everything found in the development scenes so far."""

    scenes: list[tuple[str, int]] = field(default_factory=list)
    """Kind and seed of each scene."""
    features: list[Floats] = field(default_factory=list)
    """(F,) of each detection."""
    right: list[bool] = field(default_factory=list)
    """Whether it is."""
    scene: list[int] = field(default_factory=list)
    """In which it was found, an index of scenes."""

    @classmethod
    def read(cls, path: Path | None) -> "Detections":
        """Return what a file keeps, nothing where there is none."""
        if path is None or not path.exists():
            return cls()
        kept = read_arrays(path, "detections")
        scenes = list(zip(kept["kinds"].tolist(), kept["seeds"].tolist(), strict=True))
        right, scene = kept["right"].tolist(), kept["scene"].tolist()
        return cls(scenes, list(kept["features"]), right, scene)

    def write(self, path: Path) -> None:
        """Keep everything in a file."""
        arrays = {
            "kinds": np.array([kind for kind, _ in self.scenes]),
            "seeds": np.array([seed for _, seed in self.scenes]),
            "features": np.array(self.features, np.float32).reshape(-1, len(FEATURES)),
            "right": np.array(self.right, dtype=bool),
            "scene": np.array(self.scene, dtype=np.int64),
        }
        write_arrays(path, arrays)

    def add(self, item: DevelopmentScene, detector: Detector) -> None:
        """Search one scene."""
        found = detector.find(item.scene.frame).detections
        claims = [
            Claim(detector.library.models[d.model], d.T_camera_object, d.confidence) for d in found
        ]
        # both are in the order of falling confidence
        self.features += [d.features for d in found]
        self.right += [j.right for j in judge(item.scene.objects, claims)[0]]
        self.scene += [len(self.scenes)] * len(found)
        self.scenes.append((item.kind, item.seed))


def fit(features: Array, right: NDArray[np.bool_]) -> Array:
    """Return weights and bias (F + 1,) of the logistic function that explains what was right.

    Args:
        features: (N, F) of `confidence.features_of`.
        right: (N,).
    """
    center, scale = features.mean(axis=0), features.std(axis=0) + 1e-6
    rows = np.hstack([(features - center) / scale, np.ones((len(features), 1))])
    target = 2.0 * right - 1.0

    def loss(values: Array) -> tuple[float, Array]:
        margin = target * (rows @ values)
        slope = -(rows.T @ (target / (1.0 + np.exp(np.clip(margin, -50.0, 50.0)))))
        slope[:-1] += 2.0 * _PENALTY * values[:-1]
        cost = np.logaddexp(0.0, -margin).sum() + _PENALTY * float(values[:-1] @ values[:-1])
        return float(cost), slope

    bounds = [(0.0, None) if s > 0 else (None, 0.0) if s < 0 else (None, None) for s in SIGNS]
    start = np.zeros(rows.shape[1])
    best = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[*bounds, (None, None)]).x
    weights = best[:-1] / scale
    return np.append(weights, best[-1] - weights @ center)


def fitted(kept: Detections) -> dict[str, Any]:
    """Return what the file of weights holds: a report, the bias and the weights."""
    features, right = np.array(kept.features, np.float64), np.array(kept.right)
    part = np.array(kept.scene) % _PARTS
    said = np.zeros(len(right))
    for k in range(_PARTS):
        values = fit(features[part != k], right[part != k])
        said[part == k] = _probability(features[part == k], values)
    values = fit(features, right)
    accepted = said >= RecognizerConfig().least_confidence
    empty = np.array(["clutter" in kind for kind, _ in kept.scenes])
    in_empty = accepted & ~right & empty[np.array(kept.scene)]
    error = expected_calibration_error(said[accepted].tolist(), right[accepted].tolist())
    weights = dict(zip(FEATURES, np.round(values[:-1], 3).tolist(), strict=True))
    return {
        "scenes": len(kept.scenes),
        "detections": len(right),
        "right": int(right.sum()),
        "right_accepted": float(np.round(accepted[right].mean(), 3)),
        "accepted_right": float(np.round(right[accepted].mean(), 3)),
        "false_per_empty_scene": float(np.round(in_empty.sum() / max(1, empty.sum()), 3)),
        "calibration_error": float(np.round(error or 0.0, 3)),
        "bias": float(np.round(values[-1], 3)),
        "weights": weights,
    }


def _probability(features: Array, values: Array) -> Array:
    chance: Array = 1.0 / (1.0 + np.exp(-(features @ values[:-1] + values[-1])))
    return chance


def development_scenes(
    rounds: int, known: Sequence[tuple[str, int]] = ()
) -> Iterator[DevelopmentScene]:
    """Yield scenes of all kinds in turn, without those whose kind and seed are known already."""
    database, clutter = ObjectDatabase.load(), list(ObjectDatabase.clutter())
    six = [database[f"{name}_0"] for name in OBJECT_CLASSES]
    models = {
        "six": six,
        "clutter for six": clutter,
        "all": list(database),
        "clutter": clutter,
        "both": [*clutter, *clutter, *database],
    }
    for index in range(rounds):
        for kind, (first, count, size) in _KINDS.items():
            for seed in range(first + index * count, first + (index + 1) * count):
                if (kind, seed) not in known:
                    yield DevelopmentScene(_scene(models[kind], seed), size, kind, seed)


def _scene(models: list[ObjectModel], seed: int) -> TabletopScene:
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(models), 1 + seed % 6, replace=False)
    noise = _WORSE_CAMERA if seed % 3 == 0 else None
    scene = tabletop_scene([models[k] for k in chosen], rng, noise)
    if seed % 2:
        scene = replace(scene, frame=_under_other_lamps(scene.frame, rng))
    if seed % 3 == 0:
        scene = replace(scene, frame=_bent(scene.frame, rng))
    return scene


def _under_other_lamps(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    gain = np.exp(rng.normal(-0.2, _LAMP_LEVEL) + rng.normal(0.0, _LAMP_TINT, 3))
    grey, pale = frame.color.mean(axis=2, keepdims=True), rng.uniform(0.0, _PALE)
    color = gain * ((1.0 - pale) * frame.color + pale * grey)
    return replace(frame, color=np.clip(color, 0.0, 255.0).astype(np.uint8))


def _bent(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    """Return a frame whose depth errs smoothly from place to place, as real depth cameras do."""
    coarse = rng.normal(0.0, _BEND, (frame.depth.shape[0] // 16, frame.depth.shape[1] // 16))
    size = (frame.depth.shape[1], frame.depth.shape[0])
    error = cv2.resize(coarse.astype(np.float32), size, interpolation=cv2.INTER_CUBIC)
    depth = np.where(frame.depth > 0.0, frame.depth + error * frame.depth**2, np.float32(0.0))
    return replace(frame, depth=depth.astype(np.float32))


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20, help=f"of scenes, at most {_MOST_ROUNDS}")
    parser.add_argument("--detections", type=Path, help="file that a stopped run goes on from")
    parser.add_argument("--out", type=Path, default=FITTED)
    arguments = parser.parse_args()
    database = ObjectDatabase.load()
    six = [database[f"{name}_0"] for name in OBJECT_CLASSES]
    detectors = {
        len(models): Detector(ModelLibrary.of(models), DetectorConfig())
        for models in (six, list(database))
    }
    kept = Detections.read(arguments.detections)
    for item in development_scenes(min(_MOST_ROUNDS, arguments.rounds), kept.scenes):
        kept.add(item, detectors[item.size])
        if arguments.detections is not None:
            kept.write(arguments.detections)
    report = yaml.safe_dump(fitted(kept), sort_keys=False)
    write_text(arguments.out, report)
    sys.stdout.write(report)
