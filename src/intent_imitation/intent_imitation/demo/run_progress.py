"""How far a run has come: when it is complete, and when it must be given up."""

from collections.abc import Sequence

from intent_imitation.demo.collected import Collected

FOLLOWERS = ("grasp_detector", "inference")
"""Nodes that deal with every state of the tracker."""
_LEAST_SHARE = 0.9
"""Share of the readable frames that the tracker must have answered for a conclusion."""


class RunProgress:
    """Which of a bag's frames the nodes have dealt with, and when the last news came."""

    def __init__(self, stamps: Sequence[int], patience: float, now: float) -> None:
        """Begin to wait.

        Args:
            stamps: of the bag's frames [ns].
            patience: time without any news after which the run is given up [s].
            now: moment of a monotonic clock [s].
        """
        self._stamps, self._patience, self._heard = tuple(stamps), patience, now
        self._dealt = dict.fromkeys(("tracker", *FOLLOWERS), -1)
        self._refused: set[int] = set()

    def note(self, now: float) -> None:
        """Take note of any answer of a node."""
        self._heard = now

    def note_dealt(self, node: str, stamp: int, now: float) -> None:
        """Take note that a node has dealt with the input of a stamp [ns]."""
        if stamp > self._dealt[node]:
            self._dealt[node], self._heard = stamp, now

    def note_refused(self, stamp: int) -> None:
        """Take note that imitation has dealt with the posterior of a stamp [ns], plan or no plan.

        A task that BN^R does not know gets none.
        """
        self._refused.add(stamp)

    @property
    def total(self) -> int:
        """Number of the bag's frames."""
        return len(self._stamps)

    @property
    def seen(self) -> int:
        """Number of the bag's frames that the tracker has dealt with."""
        return sum(stamp <= self._dealt["tracker"] for stamp in self._stamps)

    def __str__(self) -> str:
        return f"{self.seen} of {len(self._stamps)} frames"

    def missing(self, got: Collected) -> str:
        """Return what is still to come, "" when every frame and grasp has been dealt with."""
        if self._dealt["tracker"] < self._stamps[-1]:
            return "the tracker has not dealt with the next frame"
        last_state = got.states[-1].stamp if got.states else -1
        late = [node for node in FOLLOWERS if self._dealt[node] < last_state]
        if late:
            return f"{' and '.join(late)} did not answer the tracker"
        final = [posterior for posterior in got.posteriors if not posterior.preliminary]
        if len(final) < len(got.grasps):
            return "inference gave no conclusion on a stable grasp"
        grasps = {grasp.stamp for grasp in got.grasps}
        concluded = {p.stamp for p in final if p.stamp in grasps and p.best is not None}
        if len({plan.stamp for plan in got.plans}) < len(concluded - self._refused):
            return "imitation gave no plan for a concluded task"
        return ""

    def check(self, got: Collected, now: float) -> None:
        """Give up once nothing new has come for too long.

        Raises:
            ValueError: that says after how many frames, and who is awaited.
        """
        if now - self._heard > self._patience:
            raise ValueError(
                f"the run stopped after {self}: no news for {self._patience:.0f} s, "
                f"{self.missing(got)}; nothing is concluded"
            )


def check_answers(readable: Sequence[int], got: Collected) -> None:
    """Refuse a run of which the tracker has answered too few frames for any conclusion.

    Args:
        readable: stamps [ns] of the bag's frames that are not damaged.
        got: what the nodes have said.

    Raises:
        ValueError: that says how many of how many.
    """
    answered = {state.stamp for state in got.states} & set(readable)
    if len(answered) < _LEAST_SHARE * len(readable):
        raise ValueError(
            f"the tracker answered {len(answered)} of {len(readable)} frames: too few to conclude "
            "anything; see the warnings of the nodes"
        )
