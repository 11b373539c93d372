"""What speaks for and against a hypothesis about the hand."""

from types import SimpleNamespace

import pytest

from intent_tracking.hands.hand_watch import GONE
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis
from intent_tracking.tracker.hypotheses.hypothesis_judge import HypothesisJudge
from intent_tracking.tracker.tracker_config import TrackerConfig

CONFIG = TrackerConfig()
NO_TABLE = SimpleNamespace(table=None)


def judge_of(hand=None, *, seen=None, ever=True, missed=0, resting=False):
    """Return a judge beside a watch that sees a hand here (`hand`) or anywhere (`seen`)."""
    watch = SimpleNamespace(
        hand=hand,
        seen=seen or hand,
        ever=ever,
        missed=missed,
        resting=resting,
        keys_of=lambda side: side,
    )
    return HypothesisJudge(CONFIG, NO_TABLE, watch)


def hand_seen(right=1.0, age=20, explained=1.0):
    return SimpleNamespace(right=right, age=age, explained=explained)


def hypothesis(side="right", cost=0.1, gap=0.005, **more):
    track = SimpleNamespace(hand=SimpleNamespace(side=side), cost=cost, key_gap=lambda *_: gap)
    return Hypothesis(track, [], cost, gap=gap, **{"age": 20, **more})


POOR = CONFIG.lost_cost + 0.1
FAR = CONFIG.contradiction + 0.01


def test_it_is_supported_where_a_hand_is_seen_in_this_frame():
    assert judge_of(hand_seen()).supported(hypothesis())


@pytest.mark.parametrize(("hand", "gap"), [(None, 0.005), (hand_seen(), None), (hand_seen(), FAR)])
def test_it_is_not_supported_by_a_hand_of_an_earlier_frame_or_elsewhere(hand, gap):
    assert not judge_of(hand).supported(hypothesis(gap=gap))


@pytest.mark.parametrize("poor", [{"cost": POOR}, {"thin": 3}])
def test_what_is_poor_is_lost_unless_it_is_supported(poor):
    assert judge_of().lost(hypothesis(**poor))
    assert not judge_of(hand_seen()).lost(hypothesis(**poor))


def test_what_fits_well_is_not_lost_without_the_networks():
    assert not judge_of(ever=False, missed=GONE).lost(hypothesis(gap=None))


def test_a_mediocre_fit_is_lost_once_a_hand_that_was_seen_is_gone():
    mediocre = hypothesis(cost=CONFIG.good_cost + 0.05)
    assert judge_of(missed=GONE).lost(mediocre)
    assert not judge_of(missed=GONE - 1).lost(mediocre)
    assert not judge_of(ever=False, missed=GONE).lost(mediocre)


@pytest.mark.parametrize(("right", "better", "worse"), [(0.97, "right", "left"),
                                                        (0.03, "left", "right")])  # fmt: skip
def test_the_side_that_the_networks_exclude_ranks_behind(right, better, worse):
    judge = judge_of(hand_seen(right))
    assert judge.rank(hypothesis(better)) + 0.2 < judge.rank(hypothesis(worse))


def test_without_networks_both_sides_rank_alike():
    assert judge_of().rank(hypothesis("left")) == judge_of().rank(hypothesis("right"))


def test_a_hand_beside_its_key_points_ranks_behind():
    judge = judge_of(hand_seen())
    assert judge.rank(hypothesis(gap=0.0)) < judge.rank(hypothesis(gap=0.02))


def test_key_points_that_no_hand_explains_say_little_against_a_fit():
    well, poorly = judge_of(hand_seen()), judge_of(hand_seen(explained=0.1))
    assert poorly.rank(hypothesis(gap=0.05)) < well.rank(hypothesis(gap=0.05))


def test_all_that_is_lost_is_equally_so():
    assert judge_of().rank(hypothesis(cost=POOR)) == judge_of().rank(hypothesis(cost=2 * POOR))


def test_a_contradiction_of_the_key_points_makes_doubtful():
    judge = judge_of(hand_seen())
    assert judge.doubtful(hypothesis(gap=FAR), 1)
    assert not judge.doubtful(hypothesis(), 1)


def test_only_a_hand_seen_for_long_makes_the_other_side_doubtful():
    assert judge_of(hand_seen(right=0.05)).doubtful(hypothesis("right"), 1)
    assert not judge_of(hand_seen(right=0.05, age=2)).doubtful(hypothesis("right"), 1)
    assert not judge_of(hand_seen(right=0.5)).doubtful(hypothesis("right"), 1)


def test_a_bad_fit_is_doubted_now_and_then_and_a_very_bad_one_at_once():
    bad = hypothesis(cost=CONFIG.doubt_cost + 0.05)
    very_bad = hypothesis(cost=CONFIG.urgent_cost + 0.05)
    due, other = CONFIG.doubt_period, CONFIG.doubt_period + 1
    assert judge_of().doubtful(bad, due)
    assert not judge_of().doubtful(bad, other)
    assert judge_of().doubtful(very_bad, other)


def test_where_depth_explains_the_hand_key_points_need_only_not_contradict() -> None:
    judge = judge_of(hand_seen())
    assert judge.settled(hypothesis(cost=0.1, gap=0.02))
    assert not judge.settled(hypothesis(cost=0.1, gap=0.04))


def test_only_an_old_fit_on_which_all_agree_is_settled():
    judge = judge_of(hand_seen())
    assert judge.settled(hypothesis())
    apart, far = {"gap": 0.02, "cost": 0.2}, {"gap": 0.04}
    for other in ({"age": 2}, {"gap": None}, apart, far, {"cost": POOR}):
        assert not judge.settled(hypothesis(**other))


def test_a_gap_is_bounded_and_none_where_nothing_is_seen():
    judge = judge_of(hand_seen())
    assert judge.gap(hypothesis(gap=0.02).track, None) == 0.02
    assert judge.gap(hypothesis(gap=5.0).track, None) == pytest.approx(0.10)
    assert judge.gap(hypothesis(gap=-1.0).track, None) is None


def test_a_hand_that_rests_while_something_else_moves_is_given_up_however_well_it_fits():
    assert judge_of(hand_seen(), resting=True).lost(hypothesis())


@pytest.mark.parametrize(("right", "age", "taken"), [(0.5, 20, False), (0.2, 20, False),
                                                     (0.1, 20, True), (0.5, 5, True)])  # fmt: skip
def test_an_old_hand_keeps_its_side_unless_the_networks_clearly_name_the_other(right, age, taken):
    old = hypothesis("right", age=age)
    assert judge_of(hand_seen(right)).open_to(old, "left") == taken
    assert judge_of(hand_seen(right)).open_to(old, "right")


def test_a_hand_that_is_not_seen_keeps_its_side():
    assert not judge_of().open_to(hypothesis("right", gap=FAR), "left")


def test_a_poorer_fit_tells_the_shape_where_the_networks_agree():
    judge = judge_of(hand_seen())
    agreed, apart = hypothesis(gap=CONFIG.agreement / 2), hypothesis(gap=CONFIG.agreement * 2)
    assert judge.telling_cost(agreed) > judge.telling_cost(apart)
    assert judge_of().telling_cost(agreed) == judge.telling_cost(apart)


def test_networks_read_a_hand_where_it_fits_unless_they_contradicted():
    judge = judge_of()
    assert judge.trusted(hypothesis())
    assert judge.trusted(hypothesis(gap=None))
    assert not judge.trusted(hypothesis(gap=FAR))
    assert not judge.trusted(hypothesis(cost=CONFIG.trust_cost + 0.01))


def test_a_fit_is_doubted_by_its_cost():
    assert judge_of().doubted(hypothesis(cost=CONFIG.careful_cost + 0.01))
    assert not judge_of().doubted(hypothesis())
