"""What follows an event with Coulomb's friction: the mode, and what is told of it. Natural units, a
block of 0.3 rad."""

import math

import numpy as np
import pytest
from stepping import FLAT, RESTS, ROCKS, TILTED, run_at, setting_of

from rockcheck.ebm.core import coulomb
from rockcheck.ebm.core.ground import ground_of
from rockcheck.ebm.core.names import Ending, Event, Guard, HistoryMode, Pivot
from rockcheck.ebm.core.state import Base, mode_code, rock_on
from rockcheck.scenes import Record, Rest

ALPHA = 0.3
SLIDES = FLAT | {"pivot": Pivot.SLIPPING, "slip": 1}


def run_after(guard, event, slide=0.0, **mode):
    """A run of an upright block that slides so, after an event that this guard has found."""
    run = run_at((0.0, math.cos(ALPHA), 0.0, slide, 0.0, 0.0), **mode)
    run = run._replace(records=run.records._replace(log=np.zeros((4, 5))))
    run.state.guard, run.state.event, run.state.before = guard, event, mode_code(run.state)
    return run


def follow(run, push=0.0, mu=0.5):
    """What follows with this friction on a base that accelerates so."""
    along, upward = (Record.from_samples([a] * 3, time_step=1.0) for a in (push, 0.0))
    base = Base(ground_of(along, 1.0, 1.0), ground_of(upward, 1.0, 1.0))
    coulomb.after_event(setting_of(ALPHA, mu), base, run)
    return run


def told(run):
    """The kinds of the events in the log."""
    return run.records.log[: run.state.events, 1].tolist()


def test_a_pivot_whose_slip_ends_stands():
    """Whatever rounding has left of its velocity."""
    run = follow(run_after(Guard.SLIP, Event.UNTOLD, slide=2e-9, **SLIDES))
    assert run.state.motion.vx == 0.0
    assert mode_code(run.state) == HistoryMode.REST
    assert told(run) == [Event.STICKS]


def test_a_block_that_is_pushed_beyond_its_slope_uplifts():
    run = follow(run_after(Guard.UPLIFT_PLUS, Event.UNTOLD, **RESTS), push=0.4)
    assert mode_code(run.state) == HistoryMode.ROCK
    assert run.records.log[0].tolist() == [0.0, Event.UPLIFT, HistoryMode.REST, 2.0, 0.0]


def test_a_mode_that_fits_is_allowed_the_noise_alone():
    """And is no modelling choice."""
    run = follow(run_after(Guard.CONE_PLUS, Event.UNTOLD, **RESTS), push=0.4)
    assert run.state.slack == 1.0
    assert run.state.rules.sum() == 0


def test_an_impact_is_told_as_one_and_leaves_the_slide():
    run = follow(run_after(Guard.PHI, Event.FLOOR_IMPACT, slide=0.1, **ROCKS, sense=1), mu=0.2)
    assert run.state.motion.vx == 0.1
    assert mode_code(run.state) == HistoryMode.SLIDE
    assert told(run) == [Event.FLOOR_IMPACT]


def test_a_block_settles_where_an_impact_leaves_it_at_rest():
    """Without an impulse of its own."""
    run = run_after(Guard.PHI, Event.FLOOR_IMPACT, **ROCKS, sense=1)
    run.state.impulse = 0.3
    follow(run)
    assert told(run) == [Event.FLOOR_IMPACT, Event.SETTLED]
    assert run.records.log[:2, 4].tolist() == [0.3, 0.0]


@pytest.mark.parametrize(("mu", "guard"), [(0.1, Guard.CONE_PLUS), (0.9, Guard.NONE)])
def test_a_rocking_block_is_held_by_its_friction_alone(mu, guard):
    """Released from 0.1 rad it asks for friction of about 0.2."""
    block, still = setting_of(ALPHA, mu, pivot="bilateral"), ground_of(Rest(), 1.0, 1.0)
    run = run_at((0.0, math.cos(0.2), 0.1, 0.0, 0.0, 0.0), **ROCKS, sense=1)
    run.state.tolerance_rad = run.state.last_term_rad = 1e-10
    coulomb.expand(block, Base(still, still), run, 0.1)
    coulomb.locate(block, run)
    assert run.state.guard == guard


@pytest.mark.parametrize("push", [0.0, 0.3, -0.3])
def test_below_its_slope_a_block_rests_on_and_nothing_is_told(push):
    """tan(0.3) is 0.309."""
    run = follow(run_after(Guard.UPLIFT_PLUS, Event.UNTOLD, **RESTS), push)
    assert mode_code(run.state) == HistoryMode.REST
    assert told(run) == []


def test_a_mode_that_an_impact_has_left_is_not_selected_anew():
    """At rest nothing rocks: it would be told from the motion alone."""
    run = run_after(Guard.PHI, Event.FLOOR_IMPACT, **TILTED, sense=1)
    rock_on(run.state, -1)
    follow(run)
    assert mode_code(run.state) == HistoryMode.ROCK
    assert not run.state.known


def test_a_run_whose_motion_is_not_finite_ends():
    run = run_after(Guard.UPLIFT_PLUS, Event.UNTOLD, **RESTS)
    run.state.motion.theta = math.nan
    follow(run)
    assert run.state.ending == Ending.NOT_FINITE
    assert told(run) == []


@pytest.mark.parametrize(
    ("before", "now", "event"),
    [
        ("REST", "REST", "UNTOLD"),
        ("REST", "SLIDE", "SLIPS"),
        ("REST", "ROCK", "UPLIFT"),
        ("SLIDE", "SLIDE_ROCK", "UPLIFT"),
        ("SLIDE", "REST", "RELEASE"),
        ("ROCK", "SLIDE_ROCK", "SLIPS"),
        ("ROCK", "FLIGHT", "LIFT_OFF"),
        ("SLIDE_ROCK", "SLIDE_ROCK", "RELEASE"),
        ("LEAN", "LADDER", "SLIPS"),
        ("LEAN", "ROCK", "RELEASE"),
        ("LADDER", "SLIDE_ROCK", "RELEASE"),
        ("FLIGHT", "FLIGHT", "RELEASE"),
    ],
)
def test_a_change_without_impact_is_named_by_the_modes(before, now, event):
    assert coulomb._change(HistoryMode[before], HistoryMode[now]) == Event[event]
