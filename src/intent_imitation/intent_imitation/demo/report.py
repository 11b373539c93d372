"""The report of a demonstration: pictures and one self-contained `report.html`."""

from pathlib import Path

from intent_imitation.demo.charts import draw_evidence, draw_timeline
from intent_imitation.demo.flow import draw_flow
from intent_imitation.demo.grasp_pictures import (
    picture_of_grasp,
    picture_of_robot_table,
    pictures_of_hypotheses,
)
from intent_imitation.demo.mesh_pictures import Image, write_image
from intent_imitation.demo.page import Chapter, PagePicture, page
from intent_imitation.demo.panels import (
    Moment,
    picture_of_objects,
    start_stamp,
    strip,
    tracked_moments,
    view_of_action,
)
from intent_imitation.demo.report_text import (
    EVIDENCE_TEXT,
    figures,
    footer,
    grasp_rows,
    grasp_text,
    object_rows,
    origin,
    posterior_text,
    summary,
    table_text,
    tracking_text,
)
from intent_imitation.demo.run_record import DemoRecord, DemoTruth, moments, result
from intent_perception.basics.safe_files import write_text

__all__ = ["DemoRecord", "DemoTruth", "moments", "result", "write_report"]


def write_report(record: DemoRecord, out_dir: Path) -> None:
    """Write the pictures and `report.html` of a run into a folder, made if missing.

    Parts that the run did not reach (no grasp, no plan) are named as such, not left out.
    """
    out_dir.mkdir(parents=True, exist_ok=True)
    shown = tracked_moments(record)
    seen = _seen(record, shown, out_dir)
    concluded = _concluded(record, out_dir)
    answered = _answered(record, _demonstration(shown), out_dir)
    flow = PagePicture(
        out_dir / "flow.png",
        "The process in six steps: the human's tracked grasp, the inferred intention, the robot's "
        "table, its choice of object, ranked grasp hypotheses and the chosen grasp.",
    )
    chapters = [seen, concluded, answered]
    text = page(origin(record), summary(record), figures(record), flow, chapters, footer(record))
    write_text(out_dir / "report.html", text)


def _seen(record: DemoRecord, shown: list[Moment], out_dir: Path) -> Chapter:
    """Draw recognition and tracking."""
    pictures = []
    first = min(record.frames, key=lambda frame: frame.stamp, default=None)
    if first is not None and record.objects is not None and record.objects.objects:
        image = picture_of_objects(first, record.objects, record.database)
        pictures.append(_saved(out_dir / "objects.png", image, _OBJECTS_TEXT))
    if shown:
        pictures.append(_saved(out_dir / "tracking.png", strip(shown), tracking_text(shown)))
    return Chapter(
        "What the camera saw",
        "Each object is recognised once, before the hand comes near; then hand (26 values) and "
        "objects (6 values each) are tracked together in every frame.",
        pictures,
        missing=_why_nothing_seen(record),
    )


def _concluded(record: DemoRecord, out_dir: Path) -> Chapter:
    """Draw the posterior over time and its explanation."""
    pictures = []
    stamps = [grasp.stamp for grasp in record.grasps]
    if record.posteriors:
        path = out_dir / "posterior.png"
        true_task = record.truth.task if record.truth is not None else None
        draw_timeline(path, record.posteriors, stamps, start_stamp(record), true_task)
        pictures.append(PagePicture(path, posterior_text(len(stamps))))
    if record.final is not None and record.final.explanation:
        draw_evidence(out_dir / "evidence.png", record.final)
        pictures.append(PagePicture(out_dir / "evidence.png", EVIDENCE_TEXT))
    return Chapter(
        "What the human is up to",
        "Bayesian networks, one model for each task, weigh the object, the hand's place and its "
        "posture. Each answers for itself, so the probabilities need not sum to one.",
        pictures,
        missing="The hand never held an object still, so there is nothing to conclude.",
    )


def _answered(record: DemoRecord, demonstration: Image | None, out_dir: Path) -> Chapter:
    """Draw the robot's choice and the flow picture, which shows its parts again."""
    pictures: list[PagePicture] = []
    table = picture_of_robot_table(record)
    if table is not None:
        pictures.append(_saved(out_dir / "robot_objects.png", table, table_text(record.plan)))
    hypotheses = pictures_of_hypotheses(record)
    grasp = _best_grasp(record)
    if grasp is not None:
        words = grasp_text(record.plan)
        pictures.append(_saved(out_dir / "grasp.png", grasp, words, narrow=True))
    draw_flow(
        out_dir / "flow.png", demonstration, record.final, table, record.plan, hypotheses, grasp
    )
    return Chapter(
        "What the robot will do",
        "The robot need not copy the hand it saw: it takes the object on its own table that serves "
        "the task best, and the grasp of its own hand that keeps the task possible.",
        pictures,
        missing="The robot has no answer: no task was concluded, or one that BN^R does not know."
        if record.plan is None
        else f"The robot has no grasp: {record.plan.refusal}.",
        tables=[object_rows(record), grasp_rows(record)],
    )


def _best_grasp(record: DemoRecord) -> Image | None:
    """Return the best grasp, drawn large."""
    if record.plan is None or not record.plan.grasps or record.robot_objects is None:
        return None
    if record.robot_hand is None:  # nobody draws another hand in its place
        return None
    best = record.plan.grasps[0]
    return picture_of_grasp(
        best, record.robot_objects, record.database, (760, 760), record.robot_hand
    )


def _demonstration(shown: list[Moment]) -> Image | None:
    """Return the tracked scene at the grasp, or the last one that was drawn."""
    at_grasp = [moment for moment in shown if moment.caption == "stable grasp"]
    chosen = at_grasp or shown[-1:]
    return view_of_action(shown).cut(chosen[0].image, 1000) if chosen else None


def _saved(path: Path, image: Image, text: str, narrow: bool = False) -> PagePicture:
    write_image(path, image)
    return PagePicture(path, text, narrow)


def _why_nothing_seen(record: DemoRecord) -> str:
    if not record.states:
        return "The tracker answered no frame."
    return "No object was recognised, and no frame of the run can be shown."


_OBJECTS_TEXT = "Recognised objects drawn over the first image, with the recogniser's confidence."
