"""Which hand is followed, and when the networks are asked."""

import numpy as np
import pytest

from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_tracking.hands.expectation import Expectation
from intent_tracking.hands.hand_reader import NO_HINTS, HandReaderConfig
from intent_tracking.hands.hand_square import HandSquare, square_of_key_points
from intent_tracking.hands.hand_watch import MISSED, HandWatch
from intent_tracking.hands.key_point_start import KeyPointConfig
from intent_tracking.hands.networks.network_files import COMMAND
from intent_tracking.hands.seen_hand import PALM, SeenHand
from intent_tracking.image.frame_evidence import NO_KEYS

RESTING, ACTING = 0, 1
PERIOD = 3


def hand_at(identity, u, v=240.0):
    """Return a hand whose key points lie around a pixel, in a square of 100 pixels."""
    middle = np.array([u, v])
    pixels = middle + 10.0 * np.random.default_rng(0).normal(size=(21, 2))
    pixels += middle - pixels[[0, 5, 9, 13, 17]].mean(axis=0)
    square = HandSquare(middle, 100.0, 0.0)
    return SeenHand(identity, pixels, np.zeros((21, 3)), 1.0, 1.0, square)


class Reader:
    """Says what it is told to say."""

    def __init__(self):
        self.hands, self.reads, self.resets = (), 0, 0
        self.hints, self.forgotten = NO_HINTS, []

    def reset(self):
        self.resets += 1

    def forget(self, identity):
        self.forgotten.append(identity)

    def read(self, color, search=False, only=None, hints=NO_HINTS):
        self.reads, self.hints = self.reads + 1, hints
        return tuple(hand for hand in self.hands if only in (None, hand.identity))


def frame(depth=0.7, arm=None):
    """Return a frame of a wall; an arm comes from the right border to a column (80 rows high)."""
    image = np.full((480, 640), depth, np.float32)
    if arm is not None:
        image[200:280, arm:] = depth - 0.1
    return RgbdFrame(0, np.zeros((480, 640, 3), np.uint8), image, KINECT)


class Film:
    """A watch over what its reader is told."""

    def __init__(self):
        self.watch, self.reader = HandWatch(None, KeyPointConfig(), PERIOD), Reader()
        self.watch._reader = self.reader
        self.told, self.arm = (2.0, 1.0), None

    def look(self, *hands, depth=0.7, arm=None, **expectation):
        self.reader.hands = hands
        now = frame(depth, arm or self.arm)
        self.watch.look(now, Expectation(**expectation), lambda *_: self.told)

    def follow(self, hand, *others, **more):
        """Look while a hand is followed."""
        expected = {"middle": hand.pixels[PALM].mean(axis=0), "joints": hand.pixels}
        self.look(hand, *others, **expected, **more)

    def act(self):
        """Look at a hand that reaches past one at rest, on an arm that stays from now on."""
        self.look(hand_at(RESTING, 100))
        self.arm = 250
        for u in range(300, 360, 10):
            self.look(hand_at(RESTING, 100), hand_at(ACTING, u))


@pytest.fixture
def film():
    return Film()


def test_a_hand_that_moves_is_chosen_over_one_at_rest(film):
    film.look(hand_at(RESTING, 100), hand_at(ACTING, 300), objects=np.array([[110.0, 240.0]]))
    assert film.watch.hand.identity == RESTING  # nearest to the object, while none acts
    film.act()
    assert film.watch.hand.identity == ACTING


def test_a_hand_at_rest_beside_one_that_acts_is_idle(film):
    film.act()
    film.watch._looks = 0  # all hands are looked at now and then only
    for _ in range(6):
        film.look(hand_at(RESTING, 100), hand_at(ACTING, 350))
    assert [hand.identity for hand in film.watch.idle] == [RESTING]


def test_a_hand_that_sways_does_not_act(film):
    for n in range(30):
        film.look(hand_at(RESTING, 100 + 3 * (-1) ** n), hand_at(ACTING, 300))
    assert film.watch.idle == []


def test_a_hidden_acting_hand_is_waited_for_and_the_resting_one_not_taken(film):
    film.act()
    for _ in range(20):
        film.look(hand_at(RESTING, 100))
        assert film.watch.hand is None
    film.look(hand_at(RESTING, 100), hand_at(ACTING, 350))
    assert film.watch.hand.identity == ACTING


def test_another_hand_that_acts_is_taken_after_long_waiting(film):
    film.act()
    taken = []
    for n in range(20):
        film.look(hand_at(2, 100 + 6 * n), arm=80)
        taken.append(film.watch.hand is not None)
    assert not any(taken[:10])
    assert film.watch.hand.identity == 2


def test_a_hand_without_depth_at_its_key_points_is_not_seen(film):
    film.look(hand_at(ACTING, 300), depth=0.0)
    assert film.watch.hand is None
    assert film.watch.missed == 1


def test_a_hand_outside_the_depth_image_is_not_seen(film):
    film.look(hand_at(ACTING, 2000))
    assert film.watch.hand is None


def test_a_settled_acting_hand_is_read_every_few_frames_only(film):
    film.act()
    before = film.reader.reads
    for _ in range(4 * PERIOD):
        film.look(hand_at(ACTING, 350), settled=True)
    assert film.reader.reads - before == 4


@pytest.mark.parametrize("acts", [True, False])
def test_a_hand_that_is_not_settled_or_does_not_act_is_read_in_every_frame(film, acts):
    if acts:
        film.act()
    before = film.reader.reads
    for _ in range(6):
        film.look(hand_at(ACTING, 350), settled=not acts)
    assert film.reader.reads - before == 6


def test_in_a_hurry_not_every_frame_is_read(film):
    for _ in range(2 * PERIOD):
        film.follow(hand_at(ACTING, 300), hurried=True)
    assert film.reader.reads == 2


def test_in_a_hurry_a_settled_hand_is_read_half_as_often(film):
    film.act()
    before = film.reader.reads
    for _ in range(8 * PERIOD):
        film.look(hand_at(ACTING, 350), settled=True, hurried=True)
    assert film.reader.reads - before == 4


def test_in_a_hurry_networks_are_shown_one_place_alone(film):
    film.act()
    joints = hand_at(ACTING, 350).pixels
    for _ in range(2 * PERIOD):
        film.look(middle=np.array([350.0, 240.0]), joints=joints, hurried=True)
    assert len(film.reader.hints.regions) == 1
    film.look(middle=np.array([350.0, 240.0]), joints=joints)
    assert len(film.reader.hints.regions) > 1


def test_what_moves_is_overlooked_after_some_looks_in_vain_until_a_hand_is_seen(film):
    film.look()
    told = []
    for _ in range(4):
        film.look(arm=400)
        told.append(film.watch.overlooked)
    assert told == [False, False, True, True]
    film.look(hand_at(ACTING, 420), arm=400)
    assert film.watch.moving
    assert not film.watch.overlooked


def test_missed_counts_looks_without_the_hand_and_begins_anew_with_it(film):
    film.act()
    for n in range(4):
        film.look()
        assert film.watch.missed == n + 1
    film.look(hand_at(ACTING, 350))
    assert film.watch.missed == 0


def test_an_acting_hand_beside_the_followed_one_is_seen_elsewhere_at_once(film):
    film.act()
    film.look(hand_at(ACTING, 350), middle=np.array([100.0, 240.0]))
    assert film.watch.hand is None
    assert film.watch.missed == MISSED
    assert film.watch.seen.identity == ACTING


def test_the_followed_hand_keeps_being_followed_under_a_new_number(film):
    film.act()
    for _ in range(2):  # the first look is at the old number alone
        film.look(hand_at(RESTING, 100), hand_at(7, 352), middle=np.array([350.0, 240.0]))
    assert film.watch.hand.identity == 7
    film.look(hand_at(RESTING, 100))
    assert film.watch.hand is None  # it acts still, so that it is waited for


def test_key_points_are_evidence_only_in_the_frame_in_which_they_are_seen(film):
    film.look(hand_at(ACTING, 300))
    assert film.watch.keys_of("left").weights.any()
    film.look()
    assert film.watch.keys_of("left") is NO_KEYS


def test_reset_forgets_all_hands(film):
    film.act()
    film.watch.reset()
    assert film.reader.resets == 1
    assert film.watch.hand is None
    film.look(hand_at(RESTING, 100))
    assert film.watch.hand.identity == RESTING


def test_without_network_files_the_trouble_names_the_command(tmp_path, monkeypatch):
    monkeypatch.setenv("INTENT_HAND_NETWORKS", str(tmp_path))
    watch = HandWatch(HandReaderConfig(), KeyPointConfig(), PERIOD)
    assert COMMAND in watch.trouble
    watch.look(frame(), Expectation(), lambda *_: (0.0, 1.0))
    assert watch.seen is None


def test_networks_that_are_switched_off_are_no_trouble():
    assert HandWatch(None, KeyPointConfig(), PERIOD).trouble == ""


def test_a_hand_on_an_arm_that_comes_in_front_acts_at_once(film):
    film.look(hand_at(RESTING, 100))
    film.look(hand_at(RESTING, 100), hand_at(ACTING, 450), arm=400)
    assert film.watch.hand.identity == ACTING


def test_a_hand_at_rest_is_not_followed_while_an_arm_moves_elsewhere(film):
    resting = hand_at(RESTING, 100)
    film.follow(resting)
    assert not film.watch.resting
    film.follow(resting, arm=400)
    assert film.watch.resting
    assert film.watch.hand is None


def test_a_hand_whose_own_arm_moves_is_followed(film):
    hand = hand_at(RESTING, 350)
    film.follow(hand)
    film.follow(hand, arm=375)
    assert not film.watch.resting
    assert film.watch.hand.identity == RESTING


def test_a_hand_that_acted_is_followed_while_another_arm_moves(film):
    film.act()
    film.follow(hand_at(ACTING, 100))
    film.follow(hand_at(ACTING, 100), arm=400)
    assert not film.watch.resting


def test_the_end_of_an_arm_that_moves_is_shown_to_the_networks(film):
    film.look()
    film.look(arm=400)
    (end,) = film.reader.hints.regions
    assert abs(end.center - [400.0 + 0.35 * end.side, 240.0]).max() < 12.0
    assert film.reader.hints.view is not None


def test_the_fit_is_shown_to_the_networks_while_they_miss_its_hand(film):
    film.act()
    joints = hand_at(ACTING, 350).pixels
    for _ in range(2):
        film.look(middle=np.array([350.0, 240.0]), joints=joints)
    region, *_ = film.reader.hints.regions
    assert np.linalg.norm(region.center - joints[PALM].mean(axis=0)) < region.side


def test_key_points_that_slip_from_an_arm_to_its_shadow_are_forgotten(film):
    film.look()
    film.look(hand_at(ACTING, 450), arm=400)
    film.look(hand_at(ACTING, 200), arm=400)
    assert film.reader.forgotten == [ACTING]
    assert film.watch.hand is None


def test_readings_of_a_hand_at_rest_that_jump_do_not_act(film):
    film.look(hand_at(RESTING, 100))
    for u in (130, 160, 100, 170):
        film.look(hand_at(RESTING, u))
    film.look(hand_at(RESTING, 100), hand_at(ACTING, 450), arm=400)
    assert film.watch.hand.identity == ACTING


def test_a_hand_at_rest_that_an_arm_passes_does_not_act(film):
    for _ in range(5):
        film.look(hand_at(RESTING, 100))
    film.watch._looks = 0  # all hands are looked at now and then only
    for _ in range(6):
        film.look(hand_at(RESTING, 100), hand_at(ACTING, 60), arm=40)
    assert [hand.identity for hand in film.watch.idle] == [RESTING]
    assert film.watch.hand.identity == ACTING


def test_a_followed_hand_at_rest_is_left_for_one_that_acts(film):
    resting = hand_at(RESTING, 100)
    film.follow(resting)
    film.follow(resting, hand_at(ACTING, 450), arm=400)
    assert film.watch.resting
    assert film.watch.elsewhere.identity == ACTING


def test_where_nothing_has_come_no_hand_comes(film):
    film.look()
    assert not film.watch.comes(hand_at(ACTING, 450).pixels)
    film.look(arm=400)
    assert film.watch.comes(hand_at(ACTING, 450).pixels)


def test_without_networks_a_hand_may_be_anywhere():
    assert HandWatch(None, KeyPointConfig(), PERIOD).comes(hand_at(ACTING, 450).pixels)


def test_every_look_counts_for_the_side_until_it_is_sure(film):
    hand = hand_at(ACTING, 300)
    film.told = -0.5, 1.0
    for _ in range(4):
        film.look(hand)
    assert film.watch.seen.right == pytest.approx(1.0 / (1.0 + np.exp(2.0)))
    film.told = 3.0, 1.0
    film.look(hand)
    assert film.watch.seen.right == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


def test_key_points_that_no_hand_explains_count_little(film):
    film.look(hand_at(ACTING, 300))
    full = film.watch.keys_of("right").weights
    film.told = 0.0, 0.1
    film.look(hand_at(ACTING, 300))
    assert film.watch.keys_of("right").weights == pytest.approx(0.1 * full)


def test_a_hand_that_fits_well_is_read_where_the_fit_is(film):
    film.act()
    fit = hand_at(ACTING, 345)
    film.follow(fit, trusted=True)
    square = film.reader.hints.squares[ACTING]
    assert square.center == pytest.approx(square_of_key_points(fit.pixels).center)
    film.follow(fit)
    assert not film.reader.hints.squares


@pytest.mark.parametrize("doubted", [True, False])
def test_a_hand_that_fits_badly_is_read_with_care(film, doubted):
    film.act()
    film.follow(hand_at(ACTING, 350))
    film.follow(hand_at(ACTING, 350), doubted=doubted)
    assert film.reader.hints.careful == ({ACTING} if doubted else set())
    for _ in range(PERIOD):
        film.follow(hand_at(ACTING, 350), doubted=True, hurried=True)
    assert not film.reader.hints.careful  # it takes longer
