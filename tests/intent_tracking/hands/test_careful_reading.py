"""Which of the two landmark networks reads a hand, and where."""

import numpy as np
import pytest
from tests.support.hand_films import needs_networks

from intent_tracking.hands.hand_reader import HandReader, HandReaderConfig, Hints
from intent_tracking.hands.hand_square import HandSquare
from intent_tracking.hands.networks.landmark_network import KeyPoints

pytestmark = needs_networks
IMAGE = np.zeros((480, 640, 3), np.uint8)
PLACE = HandSquare(np.array([300.0, 200.0]), 100.0, 0.0)


class Network:
    """Reads the same hand in every square, with the presence that it is told."""

    def __init__(self, presence):
        self.presence, self.squares = presence, []

    def read(self, color, square):
        self.squares.append(square)
        pixels = 300.0 + 40.0 * np.random.default_rng(0).normal(size=(21, 2))
        return KeyPoints(pixels, np.zeros(21), np.zeros((21, 3)), self.presence, 1.0)


@pytest.fixture
def reader():
    reader = HandReader(HandReaderConfig(careful_looks=1))
    reader._landmarks, reader._careful = Network(0.9), Network(0.8)
    return reader


def presences(reader, frames, **hints):
    """Return the presence of the hand in each frame; it is found in the first."""
    seen = [reader.read(IMAGE, hints=Hints(regions=(PLACE,)))]
    seen += [reader.read(IMAGE, hints=Hints(**hints)) for _ in range(frames - 1)]
    return [hands[0].presence for hands in seen]


def test_full_reads_the_start_and_the_first_look_after_it(reader):
    assert presences(reader, 4) == [0.8, 0.8, 0.9, 0.9]


def test_full_reads_a_hand_in_doubt(reader):
    assert presences(reader, 4, careful=frozenset({0})) == [0.8] * 4


def test_lite_is_asked_for_what_full_does_not_see(reader):
    reader._careful.presence = 0.1
    assert presences(reader, 3) == [0.9] * 3


def test_a_hand_is_read_where_the_hint_says(reader):
    there = HandSquare(np.array([310.0, 280.0]), 90.0, 0.2)
    presences(reader, 3, squares={0: there})
    assert reader._landmarks.squares[-1] is there


def test_what_is_not_at_the_hint_is_read_where_it_was(reader):
    there = HandSquare(np.array([9000.0, 280.0]), 90.0, 0.2)
    assert presences(reader, 3, squares={0: there})[-1] == 0.9
