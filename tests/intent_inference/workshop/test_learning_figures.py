"""Figs. 2, 4 and 5 are drawn from what was learnt."""

from pathlib import Path

import numpy as np
import pytest
from tests.support.grasp_tables import made_up_grasps

from intent_inference.quantisation.quantiser import quantise
from intent_inference.workshop.evaluation.evaluate_command import print_report
from intent_inference.workshop.evaluation.evaluation_report import ReportConfig, evaluation_report
from intent_inference.workshop.evaluation.protocol import ProtocolConfig
from intent_inference.workshop.evaluation.roc_figures import draw_roc
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, train
from intent_inference.workshop.training.learning_figures import draw_quantisation, draw_structures

QUICK = TrainingConfig(recipes=(NetworkRecipe("tan", "6"),))


@pytest.mark.slow
@pytest.mark.parametrize("variable", ["dir", "fvol"])
def test_the_quantisation_of_vectors_and_scalars_is_drawn(variable: str, tmp_path: Path) -> None:
    values = made_up_grasps(200).features[variable]
    path = tmp_path / "fig2.png"
    draw_quantisation(quantise(variable, values, np.random.default_rng(0)), values, path)
    assert path.stat().st_size > 10_000


@pytest.mark.slow
def test_the_graph_of_every_task_is_drawn(tmp_path: Path) -> None:
    model = train(made_up_grasps(300), np.random.default_rng(0), QUICK)
    path = tmp_path / "fig4.png"
    draw_structures(model, path)
    assert path.stat().st_size > 10_000


@pytest.mark.slow
def test_the_report_has_every_figure_and_is_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = ReportConfig(trials=2, group_trials=1, calibration_folds=2)
    said: list[str] = []
    report = evaluation_report(
        made_up_grasps(400), ProtocolConfig(QUICK, baselines=False), config, said.append
    )
    own = report["tasks"]["pouring"]
    assert own["auc"]["full"]["mean"] > 0.8
    assert 0.0 <= own["ece"]["full"] < 0.3
    assert len(own["roc"]["full"]["true_positive_rate"]) == 101
    assert report["unseen_objects"]["ours"]["full"]["auc"] > 0.7
    assert report["unknown_auroc"] > 0.8
    assert len(said) == 6
    own["demonstrations"] = {
        "auc": 0.85, "false_positive_rate": 0.2, "false_positive_ci": [0.1, 0.3],
        "true_positive_rate": 0.8, "true_positive_ci": [0.7, 0.9],
    }  # fmt: skip
    path = tmp_path / "fig5.png"
    draw_roc(report, path)
    assert path.stat().st_size > 20_000
    print_report(report)
    assert "pouring" in capsys.readouterr().out
