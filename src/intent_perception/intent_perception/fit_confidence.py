"""Command: fit scale and bias of `confidence` on development scenes (seeds below 1000).

python -m intent_perception.fit_confidence [--scenes N]

Scenes of known objects, of clutter alone and of both are searched with 6 and with 48 models; every
detection is compared with the truth, and a logistic function of its evidence is fitted.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from intent_perception.confidence import evidence_for
from intent_perception.detection import Detector, DetectorConfig
from intent_perception.geometry import Array
from intent_perception.model import OBJECT_CLASSES
from intent_perception.model_library import ModelLibrary
from intent_perception.objects import ObjectDatabase
from intent_perception.scoring import Claim, judge
from intent_perception.tabletop import TabletopScene, tabletop_scene


def fit(evidence: Array, right: NDArray[np.bool_]) -> tuple[float, float]:
    """Return scale and bias of the logistic function that explains best what was right.

    Args:
        evidence: (N,) of `evidence_for`.
        right: (N,).
    """
    target = 2.0 * right - 1.0

    def loss(values: Array) -> float:
        return float(np.logaddexp(0.0, -target * (values[0] * evidence + values[1])).sum())

    scale, bias = minimize(loss, np.array([1.0, 0.0]), method="BFGS").x
    return float(scale), float(bias)


def development_scenes(count: int) -> Iterator[tuple[TabletopScene, bool]]:
    """Yield scenes, and whether they are for the library of six models too."""
    database, clutter = ObjectDatabase.load(), list(ObjectDatabase.clutter())
    six = [database[f"{name}_0"] for name in OBJECT_CLASSES]
    both = [*clutter, *clutter, *database]
    kinds = ((six, 0, True), (list(database), 100, False), (clutter, 200, True), (both, 300, False))
    for models, seed, small in kinds:
        for index in range(count):
            rng = np.random.default_rng(seed + index)
            chosen = rng.choice(len(models), 1 + (seed + index) % 6, replace=False)
            yield tabletop_scene([models[k] for k in chosen], rng), small


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=24, help="of each kind, at most 100")
    count = min(100, parser.parse_args().scenes)
    database = ObjectDatabase.load()
    large = Detector(ModelLibrary.of(database), DetectorConfig())
    small = Detector(
        ModelLibrary.of(database[f"{name}_0"] for name in OBJECT_CLASSES), DetectorConfig()
    )
    evidence, right = [], []
    for scene, for_small in development_scenes(count):
        for detector in (small, large) if for_small else (large,):
            found = detector.find(scene.frame).detections
            claims = [
                Claim(detector.library.models[d.model], d.T_camera_object, d.confidence)
                for d in found
            ]
            judged, _ = judge(scene.objects, claims)
            evidence += [evidence_for(d.features) for d in found]
            right += [j.right for j in judged]
    scale, bias = fit(np.array(evidence), np.array(right))
    sys.stdout.write(f"scale {scale:.3f}, bias {bias:.3f}, {len(right)} detections\n")


if __name__ == "__main__":
    main()
