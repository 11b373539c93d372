"""Command: fit the weights of `confidence` on development scenes (seeds below 1000).

python -m intent_perception.fit_confidence [--scenes N]

Scenes of known objects, of clutter alone and of both are searched with 6 and with 48 models. Half
of them have other lamps than the models' colours were taken under, a third a worse camera, which
bends surfaces too. Every detection is compared with the truth, and a logistic function of its
features is fitted. A weight may not have a sign that contradicts what its feature means, and large
weights cost: rendered scenes are cleaner than real ones.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from intent_perception.camera import RgbdFrame
from intent_perception.confidence import FEATURES, SIGNS
from intent_perception.detection import Detector, DetectorConfig
from intent_perception.geometry import Array
from intent_perception.model import OBJECT_CLASSES
from intent_perception.model_library import ModelLibrary
from intent_perception.objects import ObjectDatabase
from intent_perception.scoring import Claim, judge
from intent_perception.sensor import KinectNoise
from intent_perception.tabletop import TabletopScene, tabletop_scene

_PENALTY = 2.0
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


def development_scenes(count: int) -> Iterator[DevelopmentScene]:
    """Yield scenes of all kinds in turn, count of each."""
    database, clutter = ObjectDatabase.load(), list(ObjectDatabase.clutter())
    six = [database[f"{name}_0"] for name in OBJECT_CLASSES]
    kinds = {
        "both": ([*clutter, *clutter, *database], 300, 48),
        "all": (list(database), 100, 48),
        "six": (six, 20, 6),
        "clutter": (clutter, 200, 48),
        "clutter for six": (clutter, 260, 6),
    }
    for index in range(count):
        for kind, (models, first, size) in kinds.items():
            seed = first + index
            rng = np.random.default_rng(seed)
            chosen = rng.choice(len(models), 1 + seed % 6, replace=False)
            noise = _WORSE_CAMERA if seed % 3 == 0 else None
            scene = tabletop_scene([models[k] for k in chosen], rng, noise)
            if seed % 2:
                scene = replace(scene, frame=_under_other_lamps(scene.frame, rng))
            if seed % 3 == 0:
                scene = replace(scene, frame=_bent(scene.frame, rng))
            yield DevelopmentScene(scene, size, kind, seed)


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
    parser.add_argument("--scenes", type=int, default=36, help="of each kind, at most 40")
    count = min(40, parser.parse_args().scenes)
    database = ObjectDatabase.load()
    six = [database[f"{name}_0"] for name in OBJECT_CLASSES]
    detectors = {
        len(models): Detector(ModelLibrary.of(models), DetectorConfig())
        for models in (six, list(database))
    }
    features, right = [], []
    for item in development_scenes(count):
        detector = detectors[item.size]
        found = detector.find(item.scene.frame).detections
        claims = [
            Claim(detector.library.models[d.model], d.T_camera_object, d.confidence) for d in found
        ]
        features += [d.features for d in found]
        right += [j.right for j in judge(item.scene.objects, claims)[0]]
    values = fit(np.array(features, dtype=np.float64), np.array(right))
    for name, value in zip([*FEATURES, "bias"], values, strict=True):
        sys.stdout.write(f'    "{name}": {value:.2f},\n')
    sys.stdout.write(f"{len(right)} detections, {np.mean(right):.0%} right\n")


if __name__ == "__main__":
    main()
