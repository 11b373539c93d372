"""A peer of the recognition benchmark: OpenCV's point-pair features, `ppf_match_3d`.

The module is in OpenCV's contrib build only, which cannot stand beside the build that the project
uses. So this file runs as a program in an environment of its own (only opencv-contrib-python in
it), whose interpreter the variable INTENT_PPF_PYTHON names:

    python peer_ppf.py MODEL.ply SCENE.ply    # prints {"pose": 4x4 by rows, "train_s", "find_s"}
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

VARIABLE = "INTENT_PPF_PYTHON"
"""Names the interpreter of the other environment."""
_MODEL_STEP, _DISTANCE_STEP = 0.03, 0.05  # [diameters]
_SCENE_STEP = 1.0 / 40.0  # of the scene's points, the share that is tried
_POSES_REFINED = 10
_ICP = (100, 0.005, 2.5, 8)  # iterations, tolerance, rejection scale, levels


def ppf_claim(model: Path, scene: Path) -> dict[str, Any] | None:
    """Return the best pose that OpenCV finds of a model in a scan, None without its environment.

    Args:
        model: PLY with normals.
        scene: PLY with normals, in the same unit.

    Returns:
        pose (16 values, scene <- model, in the files' unit), CPU seconds `train_s` and `find_s`.

    Raises:
        ValueError: if the other environment cannot do it.
    """
    interpreter = os.environ.get(VARIABLE)
    if interpreter is None:
        return None
    command = [interpreter, __file__, str(model), str(scene)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        raise ValueError(f"{VARIABLE}={interpreter} cannot run ppf_match_3d: {last[0]}")
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def _main() -> None:
    import cv2

    cv2.setNumThreads(1)
    surface: Any = cv2.ppf_match_3d
    model, scene = (surface.loadPLYSimple(path, 1) for path in sys.argv[1:3])
    start = time.process_time()
    detector = cv2.ppf_match_3d_PPF3DDetector(_MODEL_STEP, _DISTANCE_STEP)
    detector.trainModel(model)
    trained = time.process_time()
    found = detector.match(scene, _SCENE_STEP, _DISTANCE_STEP)[:_POSES_REFINED]
    icp = cv2.ppf_match_3d_ICP(*_ICP)
    _, found = icp.registerModelToScene(model, scene, found)
    best = min(found, key=lambda pose: pose.residual)
    answer = {
        "pose": best.pose.ravel().tolist(),
        "train_s": trained - start,
        "find_s": time.process_time() - trained,
    }
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    _main()
