"""The report's words follow the record: no statement that the run does not bear out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support import demo_records

from intent_imitation.demo.charts import prior_bar
from intent_imitation.demo.flow import why_no_object
from intent_imitation.demo.grasp_pictures import picture_of_grasp, picture_of_robot_table
from intent_imitation.demo.panels import shown_name
from intent_imitation.demo.report_text import (
    figures,
    footer,
    grasp_text,
    object_rows,
    origin,
    posterior_text,
    summary,
    table_text,
)
from intent_imitation.demo.run_record import DemoRecord, result
from intent_imitation.planner.plan import ObjectChoice
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.intention.contributions import Contribution
from intent_perception.objects.database import ObjectDatabase

GRIPPER = Path(__file__).parents[2] / "data" / "parallel_gripper" / "gripper.yaml"


@pytest.fixture(scope="module")
def made_up() -> DemoRecord:
    return demo_records.record(ObjectDatabase.load())


def test_the_head_names_bag_date_version_and_synthetic_pixels(made_up: DemoRecord) -> None:
    assert made_up.truth is not None
    truth = replace(made_up.truth, synthetic=True)
    run = replace(made_up, truth=truth, written="2026-01-02 03:04 UTC", version="1.2.3")
    for part in ("made_up", "synthetic", "2026-01-02 03:04 UTC", "Intent 1.2.3"):
        assert part in origin(run)
    assert "synthetic" not in origin(made_up)


def test_nothing_is_green_where_nothing_was_chosen(made_up: DemoRecord) -> None:
    assert made_up.plan is not None
    unfit = replace(made_up.plan, nothing_affords=True, grasps=())
    assert "green" in table_text(made_up.plan)
    assert "green" not in table_text(unfit)
    assert "confidence" in table_text(None)


def test_without_a_task_nobody_says_that_nothing_was_recognised(made_up: DemoRecord) -> None:
    assert why_no_object(None) == "no task to choose for"
    assert "table was not seen" not in summary(replace(made_up, plan=None))
    assert "not seen" in summary(replace(made_up, plan=None, robot_objects=None))


def test_no_caption_says_schunk_for_another_hand(made_up: DemoRecord) -> None:
    assert made_up.plan is not None
    assert "Schunk" in grasp_text(made_up.plan)
    assert grasp_text(replace(made_up.plan, hand="my_gripper")).startswith("The my gripper hand")


def test_the_time_of_the_replay_is_no_headline_and_is_explained(made_up: DemoRecord) -> None:
    assert not any(figure.value.endswith(" s") for figure in figures(made_up))
    assert "frame by frame" in footer(made_up)


def test_a_thing_that_was_not_judged_has_no_number_anywhere(made_up: DemoRecord) -> None:
    assert made_up.plan is not None
    thing = ObjectChoice("bottle_2", "", float("nan"), False)
    run = replace(made_up, plan=replace(made_up.plan, objects=(made_up.plan.objects[0], thing)))
    rows = object_rows(run)
    assert rows is not None
    assert rows.rows[1] == ("bottle_2", "unknown", "not judged", "")
    assert result(run)["robot_objects"][1]["probability"] is None
    assert "not judged" in table_text(run.plan)
    assert picture_of_robot_table(run) is not None


def test_the_bars_of_a_task_sum_to_its_log_odds(made_up: DemoRecord) -> None:
    posterior = made_up.final
    assert posterior is not None
    for task, chance in zip(posterior.tasks, posterior.probability, strict=True):
        bars = sum(c.log_odds for c in posterior.explanation if c.task == task)
        total = bars + prior_bar(posterior, task)
        assert 1.0 / (1.0 + np.exp(-total)) == pytest.approx(chance)


def test_what_the_motion_moved_is_no_bar_of_the_grasp(made_up: DemoRecord) -> None:
    posterior = made_up.final
    assert posterior is not None
    moved = tuple(Contribution(task, "height", 2.0) for task in posterior.tasks)
    later = replace(posterior, explanation=(*posterior.explanation, *moved))
    assert later.grasp_explanation == posterior.explanation
    for task in posterior.tasks:
        assert prior_bar(later, task) == prior_bar(posterior, task)


def test_forecasts_without_a_grasp_are_called_so() -> None:
    assert "no stable grasp followed" in posterior_text(0)
    assert "line marks" in posterior_text(1)


def test_things_of_no_known_class_are_called_so_in_pictures(made_up: DemoRecord) -> None:
    assert made_up.objects is not None
    mug = made_up.objects.objects[0]
    assert shown_name(mug) == "mug_1"
    assert shown_name(replace(mug, id="thing_0", object_class="")) == "thing_0: unknown thing"
    own = made_up.database["mug_1"]
    estimated = replace(mug, id="thing_1", object_class="mug", shape=own)
    assert shown_name(estimated) == "thing_1: mug"


def test_the_grasp_is_drawn_with_the_robot_s_own_hand(made_up: DemoRecord) -> None:
    assert made_up.plan is not None
    assert made_up.robot_objects is not None
    gripper = GraspingHand.load(GRIPPER)
    schunk = made_up.plan.grasps[0]
    bent = np.zeros(len(gripper.table.joint_names))
    ours = replace(schunk, pregrasp_joints=bent, grasp_joints=bent)
    pictures = [
        picture_of_grasp(grasp, made_up.robot_objects, made_up.database, (200, 200), hand)
        for grasp, hand in ((schunk, GraspingHand.load("schunk")), (ours, gripper))
    ]
    assert (pictures[0] != pictures[1]).mean() > 0.05
