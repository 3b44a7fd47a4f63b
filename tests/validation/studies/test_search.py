"""The search of the values at which a run does not stand."""

import numpy as np
import pytest

from rockcheck.scenes import PAPER_BLOCK, Floor, Scene, Wall
from rockcheck.validation.studies.population.search import Look, falls_within
from rockcheck.validation.studies.population.tasks import GapTask

GRID = np.linspace(0.0, 1.0, 101)
NARROW = 1e-4


def searched(*runs, grid=GRID, resolution=NARROW, own=None):
    """The intervals found of runs that fall in the given intervals; `own` is a value a run."""

    def stands(which, values):
        return np.array(
            [
                not any(low <= value <= high for low, high in runs[run])
                for run, value in zip(which, values, strict=True)
            ]
        )

    count = len(grid)
    seen = np.array([stands(np.full(count, run), grid) for run in range(len(runs))])
    look = Look.at(grid, seen)
    if own is not None:
        look = look.with_own(np.array(own), stands)
    return falls_within(stands, look, resolution)


def test_the_ends_of_an_island_are_found_to_the_resolution():
    ((island,),) = searched([(0.2334, 0.2778)])
    assert island.low == pytest.approx(0.2334, abs=NARROW)
    assert island.high == pytest.approx(0.2778, abs=NARROW)
    assert 0.0 <= island.low - island.stands_below <= NARROW
    assert 0.0 <= island.stands_above - island.high <= NARROW


def test_what_falls_at_both_ends_of_the_search_has_no_value_beyond():
    ((first, last),) = searched([(0.0, 0.1), (0.9, 1.0)])
    assert first.stands_below is None
    assert first.low == 0.0
    assert last.stands_above is None
    assert last.high == 1.0


def test_what_never_falls_has_no_interval():
    assert searched([]) == [[]]


def test_what_always_falls_has_one():
    (falls,) = searched([(0.0, 1.0)])
    assert len(falls) == 1
    assert falls[0].high == 1.0


def test_runs_are_searched_side_by_side():
    first, second = searched([(0.5, 1.0)], [(0.105, 0.155), (0.755, 0.805)])
    assert [fall.low for fall in first] == pytest.approx([0.5], abs=NARROW)
    assert [fall.low for fall in second] == pytest.approx([0.105, 0.755], abs=NARROW)


def test_what_lies_between_two_values_looked_at_is_missed():
    assert searched([(0.101, 0.109)]) == [[]]


def test_a_run_that_falls_at_its_own_value_is_never_missed():
    first, second = searched([(0.101, 0.109)], [(0.101, 0.109)], own=[0.104, 0.304])
    assert [(fall.low, fall.high) for fall in first] == [pytest.approx((0.101, 0.109), abs=NARROW)]
    assert second == []


@pytest.mark.parametrize("own", [np.nan, -0.1, 0.0, 0.5, 1.0, 1.1])
def test_an_own_value_beyond_the_look_or_in_it_is_not_played(own):
    def never(which, values):
        assert which.size == values.size == 0
        return np.ones(0, dtype=bool)

    stands = np.array([[True, True, False]])
    look = Look.at(np.array([0.0, 0.5, 1.0]), stands).with_own(np.array([own]), never)
    assert look.values.tolist() == [[0.0, 0.0, 0.5, 1.0]]
    assert look.stands.tolist() == [[True, True, True, False]]


def test_the_resolution_may_grow_with_the_value():
    grid = np.geomspace(0.1, 10.0, 50)
    ((fall,),) = searched([(3.3, 10.0)], grid=grid, resolution=0.01 * grid[:-1])
    assert fall.low == pytest.approx(3.3, rel=0.011)


def test_a_run_may_fall_at_the_last_value_alone():
    ((last,),) = searched([(0.995, 1.0)])
    assert last.low == pytest.approx(0.995, abs=NARROW)
    assert last.high == 1.0


def test_a_change_as_narrow_as_the_resolution_is_not_halved_again():
    ((fall,),) = searched([(0.3, 1.0)], grid=np.array([0.0, 1.0]), resolution=0.5)
    assert (fall.stands_below, fall.low) == (0.0, 0.5)


def test_runs_of_a_search_that_nothing_decides_are_counted_and_do_not_stand():
    """Without friction, between walls that take nothing, it slides to and fro for ever."""
    elastic = Wall(side="right", gap=0.5, restitution=1.0)
    scene = Scene(
        name="to and fro",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.0),
        walls=[elastic],
        initial_velocity=2.0,
        duration=1.0,
    )
    found = GapTask(
        about=("to and fro",),
        scene=scene,
        model="ebm-unilateral",
        side="left",
        restitution=1.0,
        fine=(0.3, 0.4, 0.5),
        tabulated=(0.3, 0.5),
        reach=(np.inf,),
        free_stands=(False,),
    ).play()
    assert found.runs == 5  # three looked at, two tabulated
    assert found.undecided == 5
    assert [row.undecided for row in found.rows] == [1, 1]
    assert [(fall.low, fall.high) for fall in found.intervals] == [(0.3, 0.5)]
