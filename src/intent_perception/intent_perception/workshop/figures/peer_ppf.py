"""A peer of the recognition benchmark: OpenCV's point-pair features, `ppf_match_3d`.

The module is in OpenCV's contrib build only, which cannot stand beside the build that the project
uses. So this file runs as a program in an environment of its own, whose interpreter the variable
INTENT_PPF_PYTHON names; without the variable the peer is left out:

    python3 -m venv ppf && ppf/bin/pip install opencv-contrib-python-headless
    export INTENT_PPF_PYTHON=$PWD/ppf/bin/python
    scripts/env.sh python -m intent_perception.benchmark --part peers

As a program, `python peer_ppf.py STEP MODEL.ply ... -- SCENE.ply ...` prints one JSON object, see
`PpfAnswer`. All files are ASCII PLY with normals, in one unit.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypedDict

VARIABLE = "INTENT_PPF_PYTHON"
"""Names the interpreter of the other environment."""
_SCENE_SHARE = 1.0 / 40.0  # of the scene's points are tried as reference points
_DISTANCE_STEP = 0.05  # [diameters]
_POSES_REFINED = 10
_ICP = (100, 0.005, 2.5, 8)  # iterations, tolerance, rejection scale, levels


class PpfAnswer(TypedDict):
    """What the program finds."""

    train_s: list[float]
    """CPU seconds to train each model."""
    find_s: list[list[float]]
    """CPU seconds of each model in each scene."""
    poses: list[list[list[float] | None]]
    """Best pose (16 values by rows, scene <- model, in the files' unit) of each model in each
    scene; None where it has none."""


def is_there() -> bool:
    """Return whether an environment is named that has the module."""
    return VARIABLE in os.environ


def ppf_answer(step: float, models: Sequence[Path], scenes: Sequence[Path]) -> PpfAnswer:
    """Return what OpenCV finds of the models in the scenes.

    Args:
        step: between the points of a trained model [diameters].
        models: files.
        scenes: files.

    Raises:
        ValueError: if the other environment cannot do it.
    """
    interpreter = os.environ[VARIABLE]
    files = [*map(str, models), "--", *map(str, scenes)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [interpreter, __file__, str(step), *files]
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    except OSError as error:
        raise ValueError(f"{VARIABLE}={interpreter} is no interpreter: {error}") from error
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        raise ValueError(f"{VARIABLE}={interpreter} cannot run ppf_match_3d: {last[0]}")
    answer: PpfAnswer = json.loads(done.stdout.splitlines()[-1])
    return answer


def _main() -> None:
    import cv2

    cv2.setNumThreads(1)
    surface: Any = cv2.ppf_match_3d
    middle = sys.argv.index("--")
    detectors, answer = [], PpfAnswer(train_s=[], find_s=[], poses=[])
    for path in sys.argv[2:middle]:
        model = surface.loadPLYSimple(path, 1)
        start = time.process_time()
        detector = surface.PPF3DDetector(float(sys.argv[1]), _DISTANCE_STEP)
        detector.trainModel(model)
        answer["train_s"].append(time.process_time() - start)
        detectors.append((model, detector))
    icp = surface.ICP(*_ICP)
    for path in sys.argv[middle + 1 :]:
        scene = surface.loadPLYSimple(path, 1)
        poses: list[list[float] | None] = []
        seconds = []
        for model, detector in detectors:
            start = time.process_time()
            found = detector.match(scene, _SCENE_SHARE, _DISTANCE_STEP)[:_POSES_REFINED]
            if found:
                found = icp.registerModelToScene(model, scene, found)[1]
            best = min(found, key=lambda pose: pose.residual, default=None)
            seconds.append(time.process_time() - start)
            poses.append(None if best is None else best.pose.ravel().tolist())
        answer["poses"].append(poses)
        answer["find_s"].append(seconds)
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    _main()
