"""Which side a hand is of, by all looks at it and by what lies beside it."""

import numpy as np
import pytest

from intent_tracking.hands.hand_square import HandSquare
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.hands.side_odds import SideOdds

SQUARE = HandSquare(np.zeros(2), 100.0, 0.0)


def hand(identity):
    """Return a hand of which this look says nothing."""
    return SeenHand(identity, np.zeros((21, 2)), np.zeros((21, 3)), 1.0, 0.5, SQUARE)


def right_after(odds, worth, others=()):
    """Return the probability of a right hand 1 after one look that is worth log-odds."""
    return odds.noted(hand(1), False, lambda *_: (worth, 1.0), others).right


@pytest.mark.parametrize("worth", [4.0, -4.0])
def test_a_hand_beside_a_known_one_is_likelier_of_the_other_side(worth):
    odds = SideOdds()
    odds.noted(hand(0), False, lambda *_: (worth, 1.0))
    assert (right_after(odds, 0.0, [0]) - 0.5) * worth < 0.0


def test_a_hand_that_is_no_longer_seen_tells_no_side():
    odds = SideOdds()
    odds.noted(hand(0), False, lambda *_: (4.0, 1.0))
    assert right_after(odds, 0.0, [1]) == 0.5


def test_looks_outweigh_what_lies_beside():
    odds = SideOdds()
    odds.noted(hand(0), False, lambda *_: (4.0, 1.0))
    assert right_after(odds, 2.0, [0]) > 0.5
