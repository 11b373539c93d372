"""The calibrate node finds the table in a stream, publishes it and writes it for the recognizer."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.support.harness import CAMERA_FRAME, Graph, Probe, ros_arguments
from tf2_msgs.msg import TFMessage

from intent_perception.objects.database import ObjectDatabase
from intent_perception.scene.camera_calibration import read_calibration
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

pytestmark = pytest.mark.slow


def test_the_plane_of_the_table_goes_to_tf_and_to_a_file(
    probe: Probe, graph: Graph, tmp_path: Path
) -> None:
    scene = tabletop_scene([ObjectDatabase.load()["glass_2"]], np.random.default_rng(0))
    file = tmp_path / "table.json"
    probe.listen(TFMessage, "/tf_static")
    options = ros_arguments("use_board:=false", f"output:={file}")
    graph.start("intent_perception", "calibrate", *options)
    assert probe.until(probe.connected)
    for _ in range(20):  # the node may not yet have found every publisher
        probe.send(scene.frame)
        if probe.until(file.exists, timeout=3.0):
            break
    assert probe.until(lambda: bool(probe.heard["/tf_static"]))
    transform = probe.heard["/tf_static"][0].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ("table", CAMERA_FRAME)
    found = read_calibration(str(file))
    assert json.loads(file.read_text())["source"] == "table"
    # The origin and the turn about the normal are the user's to choose: height and tilt are not.
    assert found[2, 3] == pytest.approx(scene.T_table_camera[2, 3], abs=0.004)
    tilt = np.arccos(np.clip(found[2, :3] @ scene.T_table_camera[2, :3], -1.0, 1.0))
    assert tilt < np.radians(0.5)
