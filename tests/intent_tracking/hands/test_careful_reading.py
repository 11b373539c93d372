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
        return KeyPoints(hand_around(300.0), np.zeros(21), np.zeros((21, 3)), self.presence, 1.0)


class Seeing:
    """Reads a hand in the middle of every square, the surer the nearer that is to a pixel."""

    def __init__(self, clear):
        self.clear, self.squares = np.array(clear), []

    def read(self, color, square):
        self.squares.append(square)
        presence = 1.0 - 0.001 * float(np.linalg.norm(square.center - self.clear))
        pixels = hand_around(square.center)
        return KeyPoints(pixels, np.zeros(21), np.zeros((21, 3)), presence, 1.0)


def hand_around(middle):
    """Return key points (21, 2) around a pixel."""
    return middle + 40.0 * np.random.default_rng(0).normal(size=(21, 2))


def squares_at(*columns):
    """Return a square at each of some columns of the image."""
    return tuple(HandSquare(np.array([column, 240.0]), 100.0, 0.0) for column in columns)


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


def test_of_several_squares_the_one_that_shows_a_hand_best_is_believed(reader):
    reader._landmarks = reader._careful = Seeing([320.0, 240.0])
    (hand,) = reader.read(IMAGE, hints=Hints(regions=squares_at(100.0, 500.0, 200.0)))
    assert abs(hand.pixels.mean(axis=0)[0] - 200.0) < 50.0


def test_a_hand_that_is_seen_plainly_is_looked_for_no_further(reader):
    reader._landmarks = Seeing([320.0, 240.0])
    reader.read(IMAGE, hints=Hints(regions=squares_at(100.0, 320.0, 500.0)))
    assert [square.center[0] for square in reader._landmarks.squares] == [100.0, 320.0]


def test_a_hand_that_was_hidden_is_looked_for_where_it_was(reader):
    (known, *_) = [reader.read(IMAGE, hints=Hints(regions=(PLACE,)))[0] for _ in range(4)]
    reader._landmarks.presence = reader._careful.presence = 0.0
    assert reader.read(IMAGE) == ()
    reader._landmarks.presence = 0.9
    assert reader.read(IMAGE) == ()
    (found,) = reader.read(IMAGE, hints=Hints(lost=True))
    assert found.identity == known.identity
