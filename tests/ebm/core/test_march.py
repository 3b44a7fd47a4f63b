"""How a run begins, and what an event changes. Natural units, a block of 0.3 rad."""

import math

import numpy as np
import pytest
from stepping import ROCKS, play, run_at, setting_of

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.core import march, series
from rockcheck.ebm.core.ground import ground_of
from rockcheck.ebm.core.names import Ending, Event, Guard, Row
from rockcheck.ebm.core.state import Base, Records, workspace
from rockcheck.scenes import PAPER_BLOCK, Floor, Rest, Scene

ALPHA = 0.3
HEIGHT = math.cos(ALPHA)
STILL = ground_of(Rest(), 1.0, 1.0)


@pytest.mark.parametrize(
    ("motion", "event"),
    [
        ((0.0, HEIGHT, 0.0, 0.0, 0.0, 0.0), Event.RELEASE),
        ((0.0, HEIGHT, 0.0, 0.1, 0.0, 0.0), Event.UNTOLD),
        ((0.0, HEIGHT, 0.0, 0.0, 0.1, 0.0), Event.UNTOLD),
        ((0.0, HEIGHT, 0.0, 0.0, 0.0, 0.1), Event.UNTOLD),
        ((0.0, 1.1 * HEIGHT, 0.0, 0.0, 0.0, 0.0), Event.UNTOLD),
        ((0.0, math.cos(ALPHA - 0.1), 0.1, 0.0, 0.0, 0.0), Event.UNTOLD),
    ],
)
def test_only_of_a_block_that_stands_its_first_mode_is_an_event(motion, event):
    run = run_at(motion)
    march.begin(setting_of(ALPHA), Base(STILL, STILL), run)
    assert run.state.event == event


def test_a_run_begins_on_a_base_of_which_nothing_is_left_from_the_run_before():
    run = run_at((0.0, HEIGHT, 0.1, 0.0, 0.0, 0.0))
    run.a[Row.G] = 7.0
    march.begin(setting_of(ALPHA), Base(STILL, STILL), run)
    assert run.a[Row.G].tolist() == [1.0] + [0.0] * (series.WIDTH - 1)


def test_the_tolerance_is_of_alpha():
    run = run_at((0.0, HEIGHT, 0.1, 0.0, 0.0, 0.0))
    run.state.control.tolerance = 1e-8
    march.begin(setting_of(ALPHA), Base(STILL, STILL), run)
    assert run.state.tolerance_rad == pytest.approx(0.3e-8, rel=1e-14)
    assert run.state.peak == 0.1


def test_what_a_series_leaves_out_is_half_of_the_tolerance():
    """Its terms fall like the powers of a ratio, from 1 to the tolerance."""
    run = run_at((0.0, HEIGHT, 0.1, 0.0, 0.0, 0.0))
    run.state.control.tolerance = 1e-8
    march.begin(setting_of(ALPHA), Base(STILL, STILL), run)
    ratio = 1e-8 ** (1.0 / series.ORDER)
    left_out = run.state.last_term_rad * ratio / (1.0 - ratio)
    assert left_out == pytest.approx(0.15e-8, rel=1e-12)


@pytest.mark.parametrize(
    ("theta", "ending", "decides", "rows", "ends"),
    [
        (0.1, Ending.DONE, False, 3, Ending.DONE),
        (0.1, Ending.DONE, True, 0, Ending.DONE),
        (0.1, Ending.OVERTURNED, False, 0, Ending.OVERTURNED),
        (math.nan, Ending.DONE, False, 0, Ending.NOT_FINITE),
    ],
)
def test_a_run_whose_time_is_up_has_all_its_rows(theta, ending, decides, rows, ends):
    run = run_at((0.0, HEIGHT, theta, 0.0, 0.0, 0.0), **ROCKS, sense=1)
    written = Records(np.zeros((3, 6)), np.zeros(3, dtype=np.int8), *run.records[2:])
    run.state.ending, run.state.control.until_decided = ending, decides
    march.end(setting_of(ALPHA), run._replace(records=written))
    assert run.state.rows == rows
    assert run.state.ending == ends


@pytest.mark.parametrize(("rate", "tried"), [(-0.3, 0), (0.0, 1)])
def test_after_an_impact_all_modes_may_be_tried_again(rate, tried):
    """However small its impulse; a touch without speed leaves the mode tried."""
    motion = (0.0, HEIGHT, 0.0, -HEIGHT * rate, math.sin(ALPHA) * rate, rate)
    run = run_at(motion, **ROCKS, sense=1)
    run.state.guard = Guard.PHI
    march.resolve(setting_of(ALPHA, pivot="bilateral"), Base(STILL, STILL), run)
    assert run.state.tried.sum() == tried


def test_a_run_goes_on_until_its_time_is_up():
    tilted = Scene(
        name="tilted",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.8),
        initial_rotation=0.1 * PAPER_BLOCK.alpha,
        duration=0.05,
    )
    state = play(tilted, EventBasedModel(tolerance=1e-6), workspace())
    assert state.ending == Ending.DONE
    assert state.steps > 0
    assert 0.0 < state.motion.theta < 0.1 * PAPER_BLOCK.alpha
