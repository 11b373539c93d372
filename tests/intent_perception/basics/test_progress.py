"""Progress is a bar on a terminal and a line elsewhere."""

import ast
import io

import pytest
from tests.conftest import ROOT

from intent_perception.basics import progress as module
from intent_perception.basics.progress import ProgressBar, counted


class Terminal(io.StringIO):
    """Says that it is one."""

    def isatty(self) -> bool:
        return True


def test_on_a_terminal_one_line_is_drawn_over_and_ends_full() -> None:
    screen = Terminal()
    with ProgressBar("frame", 4, screen) as bar:
        for _ in range(4):
            bar.advance("tracking")
    assert screen.getvalue().count("\n") == 1
    last = screen.getvalue().rsplit("\r", 1)[1]
    assert last.startswith(f"[{'#' * 24}] frame 4 of 4, tracking")


def test_elsewhere_a_line_comes_now_and_then_and_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = iter(range(0, 1000, 6))
    monkeypatch.setattr(module.time, "monotonic", lambda: float(next(clock)))
    log = io.StringIO()
    with ProgressBar("object", 4, log) as lines:
        for _ in range(4):
            lines.advance()
    said = log.getvalue().splitlines()
    assert 1 < len(said) < 5
    assert said[-1].startswith("object 4 of 4")
    assert "\r" not in log.getvalue()


def test_a_run_that_fails_does_not_claim_its_end() -> None:
    log = io.StringIO()

    def fail() -> None:
        with ProgressBar("object", 4, log) as lines:
            lines.advance()
            raise ValueError

    with pytest.raises(ValueError):
        fail()
    assert log.getvalue() == ""


def test_items_pass_through_unchanged(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(counted("letter", "abc")) == ["a", "b", "c"]
    assert capsys.readouterr().err.startswith("letter 3 of 3")


@pytest.mark.parametrize(
    ("module", "what"),
    [
        ("intent_imitation/ros/demo_node", "frame"),
        ("intent_inference/workshop/simulation/simulate_command", "object"),
        ("intent_inference/workshop/evaluation/demonstration_maker", "grasp"),
        ("intent_inference/workshop/recipes/bag_maker", "bag"),
        ("intent_perception/workshop/figures/recognition_benchmark", "part"),
        ("intent_tracking/workshop/figures/tracking_benchmark", "part"),
        ("intent_inference/workshop/evaluation/inference_benchmark", "part"),
        ("intent_imitation/workshop/trials/imitation_benchmark", "table"),
    ],
)
def test_long_commands_say_how_far_they_are(module: str, what: str) -> None:
    text = (ROOT / "src" / module.partition("/")[0] / f"{module}.py").read_text()
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    said = [call.args[0] for call in calls if ast.unparse(call.func) in ("ProgressBar", "counted")]
    assert what in {word.value for word in said if isinstance(word, ast.Constant)}
