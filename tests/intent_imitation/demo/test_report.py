"""The report says what the record holds, and says so where it holds nothing."""

import json
from contextlib import nullcontext
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure
from tests.support import demo_records
from tests.support.browser import measured

from intent_imitation.demo import flow
from intent_imitation.demo.report import write_report
from intent_imitation.demo.run_record import moments, result
from intent_perception.objects.database import ObjectDatabase

KEYS = {
    "bag", "stable_grasp_stamp", "posterior", "best_task", "true_task", "chosen_object", "grasp",
    "frames", "frames_lost", "track_error_mm", "seconds",
}  # fmt: skip


class _Page(HTMLParser):
    """Collects images, their alternative texts and foreign addresses."""

    def __init__(self) -> None:
        super().__init__()
        self.images: list[dict[str, str | None]] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag == "img":
            self.images.append(values)
        for name in ("src", "href"):
            if values.get(name):
                self.links.append(str(values[name]))


@pytest.fixture(scope="module")
def database() -> ObjectDatabase:
    return ObjectDatabase.load()


@pytest.mark.parametrize("complete", [True, False])
def test_result_has_every_key_of_the_contract_and_is_json(
    database: ObjectDatabase, complete: bool
) -> None:
    values = json.loads(
        json.dumps(result(demo_records.record(database, complete)), allow_nan=False)
    )
    assert set(values) >= KEYS


def test_result_gives_the_best_grasp_and_the_error_in_millimetres(database: ObjectDatabase) -> None:
    values = result(demo_records.record(database))
    assert values["chosen_object"] == "mug_1"
    assert values["track_error_mm"] == pytest.approx(11.5)
    assert set(values["grasp"]) >= {"wrist_pose", "joints", "score"}
    assert values["posterior"]["pouring"] == pytest.approx(0.9)


def test_moments_hold_the_first_the_last_and_the_grasp_frame(database: ObjectDatabase) -> None:
    made_up = demo_records.record(database)
    stamps = [state.stamp for state in made_up.states]
    chosen = moments(stamps, made_up.grasps)
    assert {stamps[0], made_up.grasps[0].stamp, stamps[-1]} <= set(chosen)
    assert len(chosen) <= 6
    assert list(chosen) == sorted(set(chosen))


@pytest.mark.slow
def test_page_is_one_file_without_network_and_every_image_has_a_text(
    database: ObjectDatabase, tmp_path: Path
) -> None:
    write_report(demo_records.record(database), tmp_path)
    page = _Page()
    page.feed((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert len(page.images) == 7
    assert all(image.get("alt") for image in page.images)
    assert all(link.startswith("data:image/") for link in page.links)


@pytest.mark.slow
def test_pictures_show_something_where_the_hand_and_objects_are(
    database: ObjectDatabase, tmp_path: Path
) -> None:
    write_report(demo_records.record(database), tmp_path)
    for name in ("objects", "tracking", "posterior", "evidence", "robot_objects", "grasp", "flow"):
        image = cv2.imread(str(tmp_path / f"{name}.png"))
        assert image is not None, name
        assert np.std(image) > 5.0, name


@pytest.mark.slow
def test_report_of_a_run_without_a_grasp_says_that_nothing_was_concluded(
    database: ObjectDatabase, tmp_path: Path
) -> None:
    write_report(demo_records.record(database, complete=False), tmp_path)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "No stable grasp was seen" in text
    assert "nothing to conclude" in text
    assert not {"posterior.png", "evidence.png", "grasp.png"} & {p.name for p in tmp_path.iterdir()}


def test_no_axes_are_empty_where_nothing_was_reached(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    canvas = Figure()
    monkeypatch.setattr(flow, "figure", lambda *_: nullcontext(canvas))
    flow.draw_flow(tmp_path / "flow.png", None, None, None, None, (), None)
    assert canvas.axes
    assert not [axes for axes in canvas.axes if axes.axison and not axes.has_data()]


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_a_browser_shows_all_words_without_scrolling_sideways(
    database: ObjectDatabase, tmp_path: Path, width: int
) -> None:
    write_report(demo_records.record(database), tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    found = measured(page, width, tmp_path)
    assert found["page"] <= width
    assert found["text"] <= width
    assert found["font"] >= 13.0
