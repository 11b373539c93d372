"""Which side each seen hand is of: log-odds summed over the looks at it."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.scene.hand_model import SIDES, Side

Tell = Callable[[SeenHand, tuple[Side, ...]], tuple[float, float]]
"""Says what log-odds of a right hand a look at one is worth, and how well a hand of the given sides
explains it, 0..1."""
_FIRST_LOOKS, _PERIOD = 8, 4
"""First looks at a hand that all tell its side, and looks between two that do afterwards."""
_BESIDE_ODDS = 1.0
"""Log-odds of the other side for a hand that comes beside one at rest: mostly both are one's own,
else any side is as likely."""
_SURE_ODDS, _MOST_ODDS = 3.0, 8.0
"""Log-odds of a side below which every look at the hand must tell it, and the largest ones."""


@dataclass
class _Record:
    """Of one hand."""

    odds: float = 0.0
    explained: float = 1.0
    looks: int = 0


class SideOdds:
    """Remembers the sides of hands by their numbers."""

    def __init__(self) -> None:
        self._records: dict[int, _Record] = {}

    def noted(
        self, seen: SeenHand, doubted: bool, tell: Tell, others: Iterable[int] = ()
    ) -> SeenHand:
        """Return a seen hand with its side by all looks; first ones, and then some, tell it.

        Args:
            seen: the hand in this frame.
            doubted: whether its fit is in doubt: then it is asked more often what explains it.
            tell: about this look. Sides do not change: all looks count alike, however old.
            others: numbers of hands in this frame.
        """
        if seen.identity not in self._records:
            self._records[seen.identity] = _Record(self._beside(others))
        record = self._records[seen.identity]
        unsure = abs(record.odds) < _SURE_ODDS or (seen.right - 0.5) * record.odds < 0.0
        if unsure or record.looks < _FIRST_LOOKS or record.looks % _PERIOD == 0:
            worth, record.explained = tell(seen, SIDES)
            record.odds = min(max(record.odds + worth, -_MOST_ODDS), _MOST_ODDS)
        elif doubted and record.looks % 2 == 0:
            record.explained = tell(seen, ("right" if record.odds > 0.0 else "left",))[1]
        record.looks += 1
        right = 1.0 / (1.0 + math.exp(-record.odds))
        return replace(seen, right=right, looked=seen.right, explained=record.explained)

    def _beside(self, others: Iterable[int]) -> float:
        """Return the log-odds of a right hand that is first seen beside others."""
        odds = [self._records[number].odds for number in others if number in self._records]
        sure = [one for one in odds if abs(one) > _SURE_ODDS]
        return -math.copysign(_BESIDE_ODDS, sure[0]) if sure else 0.0
