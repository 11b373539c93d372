"""The inference node serves whatever tasks its model has learnt."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from intent_msgs.msg import StableGrasp, TaskPosterior
from tests.support.grasp_tables import made_up_grasps
from tests.support.harness import Graph, Probe

from intent_inference.network.model_file import save_model
from intent_inference.ros.convert import posterior_from_msg
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, train
from intent_perception.ros.node import LATCHED
from intent_tracking.grasp.grasp_detector import StableGrasp as Grasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.ros.convert import grasp_to_msg


def test_a_task_added_as_a_label_column_reaches_the_topic(
    graph: Graph, probe: Probe, tmp_path: Path
) -> None:
    table = made_up_grasps(300)
    drinking = (table.features["npos"][:, 0] > 0.3).astype(float)
    table = replace(table, labels={**table.labels, "drinking": drinking})
    config = TrainingConfig(recipes=(NetworkRecipe("tan", "6"),))
    save_model(train(table, np.random.default_rng(0), config), tmp_path / "model.npz")
    probe.listen(TaskPosterior, "/intent/task_posterior")
    publisher = probe.create_publisher(StableGrasp, "/intent/stable_grasp", LATCHED)
    name = graph.start(
        "intent_inference", "inference", "--ros-args", "-p", f"model:={tmp_path / 'model.npz'}"
    )
    values = {n: table.features[n][0] for n in ("size", "conv", "dir", "npos", "fcon")}
    features = GraspFeatures(object_class="mug", fvol=None, coc=None, gbvl=None, **values)
    unknown = GraspFeatures(None, None, None, None, None, None, None, None, None)
    grasp = Grasp(5_000_000_000, "mug_0", "mug_0", "mug", "right", features, unknown, np.eye(4))
    publisher.publish(grasp_to_msg(grasp))
    heard = probe.heard["/intent/task_posterior"]
    assert probe.until(lambda: bool(heard)), graph.log(name)
    posterior = posterior_from_msg(heard[0])
    assert posterior.tasks == ("pouring", "hand-over", "drinking")
    assert posterior.missing == ("fvol",)
    assert not posterior.preliminary
