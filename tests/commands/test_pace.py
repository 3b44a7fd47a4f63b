"""The time left: it is learnt from the parts that ended, and from the one that does not."""

import pytest

from rockcheck.commands.pace import Pace


class Clock:
    """A clock that a test turns, s."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_before_a_part_has_ended_nothing_is_known(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 9)
    clock.now = 5.0
    assert pace.left is None


def test_parts_that_end_give_the_mean(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 10)
    clock.now = 4.0
    pace.hear(2, 10)
    assert pace.left == pytest.approx(16.0)


def test_what_was_read_back_took_no_time(clock):
    pace = Pace(clock=clock)
    pace.hear(8, 10)
    clock.now = 3.0
    pace.hear(9, 10)
    assert pace.left == pytest.approx(3.0)


def test_a_part_that_outlasts_the_estimate_makes_it_grow(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 9)
    clock.now = 12.0
    pace.hear(8, 9)
    clock.now = 112.0
    assert pace.left == pytest.approx(100.0)


def test_a_word_on_what_plays_is_no_end(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 9)
    clock.now = 12.0
    pace.hear(8, 9)
    clock.now = 52.0
    pace.hear(8, 9)
    assert pace.left == pytest.approx(40.0)


def test_at_the_end_nothing_is_left(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 1)
    clock.now = 2.0
    pace.hear(1, 1)
    assert pace.left == 0.0


def test_the_first_part_of_what_compiles_says_nothing_of_the_others(clock):
    pace = Pace(compiles=True, clock=clock)
    pace.hear(0, 30)
    clock.now = 140.0
    pace.hear(1, 30)
    assert pace.left is None
    clock.now = 142.0
    pace.hear(2, 30)
    assert pace.left == pytest.approx(56.0)


def test_the_slowest_part_says_nothing_of_the_others(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 10)
    for done, now in ((1, 1.0), (2, 4.0), (3, 64.0)):
        clock.now = now
        pace.hear(done, 10)
    assert pace.left == pytest.approx(14.0)


def test_of_what_is_done_nothing_is_left(clock):
    pace = Pace(clock=clock)
    pace.hear(0, 2)
    clock.now = 4.0
    pace.hear(2, 2)
    clock.now = 9.0
    assert pace.left == 0.0
