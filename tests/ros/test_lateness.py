"""Waits are measured against the shortest one."""

import pytest

from intent_perception.ros.health.lateness import Lateness

SECOND, SKEW = 1_000_000_000, 7_000_000_000


def lateness_of(*waits):
    """Return the lateness after messages that waited so long [s], on a clock that is ahead."""
    lateness = Lateness()
    for number, wait in enumerate(waits):
        sent = (number + 1) * SECOND
        lateness.note(sent + SKEW, sent + round(wait * SECOND))
    return lateness.seconds


def test_a_message_is_late_by_what_it_waited_longer_than_others_whatever_the_clocks_say():
    assert lateness_of(0.002, 0.005, 0.102) == pytest.approx(0.1, abs=1e-3)


def test_a_message_that_waited_least_is_not_late():
    assert lateness_of(0.005, 0.102, 0.002) == 0.0


def test_of_a_clock_that_was_set_anew_nothing_is_kept():
    assert lateness_of(-3.0, *[0.002] * 40_000) == pytest.approx(0.0, abs=1e-3)


def test_where_the_middleware_tells_no_time_nothing_is_late():
    lateness = Lateness()
    lateness.note(0, SECOND)
    lateness.note(0, 3 * SECOND)
    assert lateness.seconds == 0.0
