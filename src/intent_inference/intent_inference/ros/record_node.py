"""ROS node: writes the grasps that somebody demonstrates into a table for `train add`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from intent_msgs.msg import SceneState, StableGrasp
from std_srvs.srv import Trigger

from intent_inference.intention.demonstration_log import DemonstrationLog
from intent_perception.basics.parameters import Checked
from intent_perception.ros.declared import declared
from intent_perception.ros.node import RESULTS, IntentNode, run
from intent_tracking.ros.convert import grasp_from_msg, state_from_msg


@dataclass(frozen=True)
class RecordConfig(Checked):
    """What is shown, and where it is written."""

    out: str = "demonstrations.csv.gz"
    """Table (.csv or .csv.gz); one that is there is gone on with."""
    shown: str = ""
    """Tasks that the demonstrated grasps serve, separated by commas."""
    refused: str = ""
    """Tasks that they do not serve; of all others nothing is said."""
    timelines: str = ""
    """Folder for one .npz of each grasp, as intent_inference.observe reads them; empty: none."""


class RecordNode(IntentNode):
    """Writes one row for each stable grasp; `~/undo` takes the last one back.

    It needs no database: features are written as the grasp detector has found them.
    """

    def __init__(self) -> None:
        super().__init__("record")
        config = declared(self, RecordConfig())
        self._labels = {
            **dict.fromkeys(_names(config.refused), 0),
            **dict.fromkeys(_names(config.shown), 1),
        }
        if not self._labels:
            raise ValueError("say by the parameter shown (or refused) which tasks are shown")
        timelines = Path(config.timelines) if config.timelines else None
        self._log, self._file = DemonstrationLog(Path(config.out), timelines), config.out
        self.create_service(Trigger, "~/undo", self._on_undo)
        self.listen_for_news(StableGrasp, "intent/stable_grasp", self._on_grasp)
        if timelines is not None:
            self.listen(SceneState, "intent/scene_state", self._on_state, RESULTS)

    def close(self) -> None:
        """Write the timeline that is still open."""
        self._log.finish()

    def _on_grasp(self, message: Any) -> None:
        grasp = grasp_from_msg(message)
        self._log.add(grasp, self._labels)
        self.get_logger().info(f"row {len(self._log)}: {grasp.object_id}, in {self._file}")

    def _on_state(self, message: Any) -> None:
        self._log.note_state(state_from_msg(message))

    def _on_undo(self, _: Any, response: Any) -> Any:
        response.success = self._log.undo()
        response.message = f"{len(self._log)} rows are left"
        return response


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def main() -> None:
    """Run the node until Ctrl-C."""
    run(RecordNode)
