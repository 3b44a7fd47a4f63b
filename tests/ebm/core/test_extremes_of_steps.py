"""The extremes of a step of a loaded block: a dense look, the places of its corners. Natural
units."""

import math

import numpy as np
import pytest
from cases import RACK
from stepping import run_at, setting_of

from rockcheck.ebm.core import extremes, motion, series
from rockcheck.ebm.core.ground import ground_of
from rockcheck.ebm.core.names import Family, Guard, Keep, Pivot, Row
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import Rest, Sine, Wall

#: Where its top corners and bottom corners are, from the mass's centre, over R.
OFFSET = np.array(RACK.offset) / RACK.radius
HALF = np.array([RACK.half_width, RACK.half_height]) / RACK.radius
RACK_HEIGHT = HALF[1] + OFFSET[1]
#: What moves in a mode: its family, its pivot, and whether its top leans on the wall.
MODES = {
    "rocks": (Family.TILT, Pivot.STICK, False),
    "slides as it rocks": (Family.TILT, Pivot.SLIPPING, False),
    "flies tilted": (Family.TILT, Pivot.OFF, False),
    "flies upright": (Family.FLAT, Pivot.OFF, False),
    "slides down the wall": (Family.TILT, Pivot.SLIPPING, True),
}


def corner(x, theta, across, upward):
    """How far a corner is to the right of where the mass's centre first stood: across is -1 for the
    left side, upward 1 for the top."""
    place = HALF * (across, upward) - OFFSET
    return x + place[0] * np.cos(theta) - place[1] * np.sin(theta)


def pivot_of(theta):
    """The lower corner of a block that is tilted by theta, from its mass's centre."""
    across = np.where(np.asarray(theta) > 0.0, -HALF[0], HALF[0]) - OFFSET[0]
    return (
        across * np.cos(theta) + RACK_HEIGHT * np.sin(theta),
        across * np.sin(theta) - RACK_HEIGHT * np.cos(theta),
    )


def first_place(across):
    """Of a lower corner where the block first stands."""
    return (HALF * (across, -1.0) - OFFSET)[0]


def begun(motion_then, **mode):
    run = run_at(motion_then, **mode)
    run.state.control.keeps = Keep.EXTREMES
    extremes.begin(setting_of(RACK), run.state)
    return run


def random_motion(rng, family, pivot, sense, slip, leans):
    """One that turns back soon, on the floor unless it flies."""
    tilted = family == Family.TILT
    tilt = sense * rng.uniform(0.05, 0.2) if tilted else 0.0
    rate = sense * rng.uniform(-0.05, 0.15) if tilted else 0.0
    across, down = pivot_of(tilt if tilted else 1.0)
    x = rng.uniform(-0.1, 0.1)
    if not tilted:
        return x, RACK_HEIGHT + 0.2, 0.0, rng.uniform(-0.2, 0.2), rng.uniform(0.1, 0.4), 0.0
    if pivot == Pivot.OFF:
        vx = rate * down + rng.uniform(-0.1, 0.1)
        return x, 0.2 - down, tilt, vx, rng.uniform(0.1, 0.4), rate
    vx = rate * down + sense * slip * rng.uniform(0.01, 0.08)
    if leans:
        top = HALF * (-sense, 1.0) - OFFSET
        vx = rate * (top[0] * math.sin(tilt) + top[1] * math.cos(tilt))
    return x, -down, tilt, vx, -rate * across, rate


def look(run, sense, name, tau):
    """The figures of a record by the series of a step, at 4,000 times."""
    a, terms, times = run.a, run.state.order + 1, np.linspace(0.0, tau, 4000)
    phi, xi, y, sine = (
        np.polyval(a[row, :terms][::-1], times) for row in (Row.PHI, Row.XI, Row.Y, Row.SIN)
    )
    flat = name == "flies upright"
    theta = np.zeros(4000) if flat else sense * phi
    x = sense * (run.state.place + sine if name == "rocks" else xi)
    height = y - RACK_HEIGHT if flat else 0.0
    slip = x
    if not flat:
        across, down = pivot_of(theta)
        slip = x + across - first_place(-float(sense))
        height = y + down if name == "flies tilted" else 0.0
    outward = [[side * corner(x, theta, side, upward) for upward in (1, -1)] for side in (-1, 1)]
    return {
        "turned": [max(np.max(theta), 0.0), max(np.max(-theta), 0.0)],
        "tops": [[np.max(top), np.max(-top)] for top, _ in outward],
        "bottoms": [np.max(bottom) for _, bottom in outward],
        "slip": np.max(np.abs(slip)),
        "hop": max(np.max(height), 0.0),
        "turned_at": times[np.argmax(sense * theta)],
    }


@pytest.mark.parametrize(
    ("name", "sense"),
    [
        (name, sense)
        for name in MODES
        for sense in (1, -1)
        if (name, sense) != ("flies upright", -1)
    ],
)
def test_the_extremes_of_a_step_are_those_of_a_dense_look(name, sense):
    """But for the lower corner where it flies: the top one over it is farther out."""
    family, pivot, leans = MODES[name]
    rng, tau = np.random.default_rng(4), 0.4
    still, pulse = ground_of(Rest(), 1.0, 1.0), Sine(amplitude=0.4, period=3.0)
    base = Base(ground_of(pulse, 1.0, 1.0), still)
    for _ in range(16):
        block = setting_of(RACK, 0.2)
        slip = int(rng.choice([-1, 1])) if pivot == Pivot.SLIPPING else 0
        start = random_motion(rng, family, pivot, sense, slip, leans)
        if leans:
            faces = block.left if sense > 0 else block.right
            faces.gap = -sense * corner(start[0], start[2], -sense, 1.0) - faces.arm
        mode = {"family": family, "pivot": pivot, "sense": sense, "slip": slip, "tip": leans}
        run = begun(start, **mode, pull=1)
        state = run.state
        state.order = motion.mode_series(block, base, run, series.ORDER, 0.0, tau)
        state.tau = state.length = tau
        state.t = tau
        motion.motion_at(block, state, run.a, tau, state.motion)
        extremes.follow(block, run, 0.0)
        expected, record = look(run, sense, name, tau), state.extremes
        assert record.turned == pytest.approx(expected["turned"], abs=1e-8)
        np.testing.assert_allclose(record.tops, expected["tops"], rtol=0.0, atol=1e-8)
        lifted = 1 if sense > 0 else 0
        assert record.bottoms[lifted] == pytest.approx(expected["bottoms"][lifted], abs=1e-8)
        assert record.slip == pytest.approx(expected["slip"], abs=1e-8)
        assert record.hop == pytest.approx(expected["hop"], abs=1e-8)
        if family == Family.TILT:
            at = record.turned_at[0 if sense > 0 else 1]
            assert at == pytest.approx(expected["turned_at"], abs=2e-4)


def rocking_steps(*, guard=Guard.NONE, quiet_from=math.inf):
    """The records of rocking steps that begin at t = 0, the figures of each by a dense look, and
    whether it turns; some turn, others do not."""
    rng, pulse = np.random.default_rng(5), Sine(amplitude=0.4, period=3.0)
    base = Base(ground_of(pulse, 1.0, 1.0), ground_of(Rest(), 1.0, 1.0))
    block = setting_of(RACK, 0.2)
    for number in range(40):
        sense, tau = (1, -1)[number % 2], rng.uniform(0.05, 0.4)
        start = random_motion(rng, Family.TILT, Pivot.STICK, sense, 0, False)
        run = begun(start, family=Family.TILT, pivot=Pivot.STICK, sense=sense, pull=1)
        state = run.state
        state.order = motion.mode_series(block, base, run, series.ORDER, 0.0, tau)
        state.tau = state.length = state.t = tau
        state.guard, state.quiet_from = guard, quiet_from
        motion.motion_at(block, state, run.a, tau, state.motion)
        extremes.follow(block, run, 0.0)
        phi = run.a[Row.PHI, : state.order + 1][::-1]
        rates = np.polyval(np.polyder(phi), np.linspace(0.0, tau, 4000))
        yield state.extremes, look(run, sense, "rocks", tau), np.min(rates) * np.max(rates) < 0.0


def test_where_rocking_turns_is_met():
    turning = [(record, dense) for record, dense, turns in rocking_steps() if turns]
    assert len(turning) > 5
    for record, dense in turning:
        assert record.turned == pytest.approx(dense["turned"], abs=1e-8)
        np.testing.assert_allclose(record.tops, dense["tops"], rtol=0.0, atol=1e-8)


def test_a_rocking_step_that_does_not_turn_is_left_to_the_end_of_its_arc():
    """But for a few that a bound cannot tell from one that turns."""
    onward = [(record, dense) for record, dense, turns in rocking_steps() if not turns]
    left = [record for record, dense in onward if np.max(dense["tops"] - record.tops) > 1e-6]
    assert len(left) > 0.8 * len(onward) > 5


@pytest.mark.parametrize(
    "ends", [{"guard": Guard.PHI}, {"quiet_from": 0.0}], ids=["with its arc", "on a quiet base"]
)
def test_the_end_of_a_rocking_step_is_met_where_it_ends(ends):
    for record, dense, _ in rocking_steps(**ends):
        assert record.turned == pytest.approx(dense["turned"], abs=1e-8)
        np.testing.assert_allclose(record.tops, dense["tops"], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("weight", [1.0, -2.0])
@pytest.mark.parametrize("place", range(5))
def test_a_combination_has_a_series_by_its_weight(place, weight):
    """One without weight need not be there."""
    a, order = run_at().a, [Row.PHI, Row.SIN, Row.COS, Row.XI, Row.Y]
    terms = np.arange(1.0, 17.0)
    a[order] = math.nan
    a[order[place], :16] = terms
    weights = [0.0] * 5
    weights[place] = weight
    extremes._combine(a, 3.0, *weights)
    assert a[Row.WATCHED, :16].tolist() == [weight + 3.0, *(weight * terms[1:])]


def test_a_record_has_the_places_of_all_corners():
    """Outward of each side, and inward; of two motions the larger one."""
    block, rng = setting_of(RACK), np.random.default_rng(8)
    for _ in range(20):
        places = [(rng.uniform(-0.2, 0.2), 0.0, rng.uniform(-0.5, 0.5)) for _ in range(2)]
        state = begun((*places[0], 0.0, 0.0, 0.0)).state
        other = run_at((*places[1], 0.0, 0.0, 0.0)).state.motion
        extremes.meet(block, state, other, 3.0)
        record = state.extremes
        for i, across in enumerate((-1.0, 1.0)):
            tops, bottoms = (
                [across * corner(x, theta, across, upward) for x, _, theta in places]
                for upward in (1.0, -1.0)
            )
            assert record.start[i] == pytest.approx(tops[0], abs=1e-14)
            assert record.tops[i, 0] == pytest.approx(max(tops), abs=1e-14)
            assert record.tops[i, 1] == pytest.approx(-min(tops), abs=1e-14)
            assert record.bottoms[i] == pytest.approx(max(bottoms), abs=1e-14)
            turns = [0.0, *(-across * theta for _, _, theta in places)]
            assert record.turned[i] == max(turns)
            assert record.turned_at[i] == (3.0 if turns[2] > max(turns[:2]) else 0.0)


def test_slip_and_hop_are_those_of_the_lower_corner():
    block = setting_of(RACK)
    for theta in (0.2, -0.3):
        across, down = pivot_of(theta)
        first = first_place(-math.copysign(1.0, theta))
        state = begun((first - across + 0.05, 0.02 - down, theta, 0.0, 0.0, 0.0)).state
        assert state.extremes.slip == pytest.approx(0.05, abs=1e-14)
        assert state.extremes.hop == pytest.approx(0.02, abs=1e-14)
        back = run_at((first - across - 0.01, -down, theta, 0.0, 0.0, 0.0)).state.motion
        extremes.meet(block, state, back, 3.0)
        assert state.extremes.slip == pytest.approx(0.05, abs=1e-14)
        assert state.extremes.last_slip == pytest.approx(-0.01, abs=1e-14)
        assert state.extremes.hop == pytest.approx(0.02, abs=1e-14)
    flat = begun((-0.07, block.height + 0.03, 0.0, 0.0, 0.0, 0.0)).state
    assert flat.extremes.slip == 0.07
    assert flat.extremes.hop == pytest.approx(0.03, abs=1e-15)


def test_the_first_uplift_and_the_first_slip_are_dated():
    """By the start of the first step that tilts from upright, and of the first that slips."""
    block, still = setting_of(RACK), ground_of(Rest(), 1.0, 1.0)
    run = begun((0.0, block.height, 0.0, 0.0, 0.0, 0.0), family=Family.FLAT, sense=1)
    state, record = run.state, run.state.extremes
    steps = [
        (Family.FLAT, Pivot.STICK, math.nan, math.nan),
        (Family.TILT, Pivot.STICK, 2.0, math.nan),
        (Family.TILT, Pivot.SLIPPING, 2.0, 3.0),
        (Family.FLAT, Pivot.STICK, 2.0, 3.0),
        (Family.TILT, Pivot.SLIPPING, 2.0, 3.0),
    ]
    for number, (family, pivot, uplift, slips) in enumerate(steps, 1):
        state.mode.family, state.mode.pivot, state.mode.slip = family, pivot, 1
        state.order = motion.mode_series(block, Base(still, still), run, 8, 0.0, 0.1)
        state.tau = 0.1
        extremes.follow(block, run, float(number))
        assert record.uplift == pytest.approx(uplift, nan_ok=True)
        assert record.slips == pytest.approx(slips, nan_ok=True)


def test_a_block_that_begins_tilted_has_not_uplifted():
    block, still = setting_of(RACK), ground_of(Rest(), 1.0, 1.0)
    run = begun((0.0, 0.9, 0.1, 0.0, 0.0, 0.0), family=Family.TILT, sense=1, pivot=Pivot.STICK)
    run.state.order = motion.mode_series(block, Base(still, still), run, 8, 0.0, 0.1)
    run.state.tau = 0.1
    extremes.follow(block, run, 2.0)
    assert math.isnan(run.state.extremes.uplift)


@pytest.mark.parametrize(("across", "side"), [(-1.0, "left"), (1.0, "right")])
@pytest.mark.parametrize("tilt", [0.2, -0.2])
def test_the_speed_at_a_wall_is_that_of_the_corner_that_touches_it(tilt, across, side):
    """The lower one of the side that tilts away, the top one of the other; of an upright block the
    faster one."""
    number = 0 if side == "left" else 1
    upward = 1.0 if across * tilt < 0.0 else -1.0
    gap = across * corner(0.0, tilt, across, upward) - (HALF[0] - across * OFFSET[0])
    block = setting_of(RACK, walls=[Wall(side=side, gap=gap * RACK.radius)])
    state = run_at((0.0, 0.9, tilt, across * 0.3, 0.1, 0.05)).state
    place = HALF * (across, upward) - OFFSET
    speed = 0.3 - across * 0.05 * (place[0] * math.sin(tilt) + place[1] * math.cos(tilt))
    extremes.approach(block, state)
    assert state.extremes.approach[number] == pytest.approx(speed, abs=1e-12)
    assert state.extremes.approach[1 - number] == 0.0
    state.motion.x -= across * 1e-9
    extremes.approach(block, state)
    assert state.extremes.approach[number] == 0.0


def test_a_strike_is_counted_where_a_corner_comes_faster_than_rounding():
    state = run_at(t=5.0).state
    record = state.extremes
    record.first[:] = math.nan
    for t, left, right, impulses in (
        (5.0, 0.2, 0.0, (0.3, 9.0)),
        (6.0, 0.1, 0.4, (0.5, 0.7)),
        (7.0, 2e-9, 5e-10, (0.0, 9.0)),
    ):
        state.t, record.approach[:], state.wall_impulse[:] = t, (left, right), impulses
        extremes.struck(state)
    assert record.strikes.tolist() == [3, 1]
    assert record.first.tolist() == [5.0, 6.0]
    assert record.speed.tolist() == [0.2, 0.4]
    assert record.impulse.tolist() == [0.5, 0.7]


@pytest.mark.parametrize(
    ("been", "x", "theta", "met"),
    [
        ((0.1, 0.0), 0.1, 0.0, True),
        ((0.1, 0.0), 0.101, 0.0, False),
        ((-0.1, 0.0), -0.101, 0.0, False),
        ((0.0, 0.2), 0.0, 0.2, True),
        ((0.0, 0.2), 0.0, 0.201, False),
        ((0.0, -0.2), 0.0, -0.201, False),
    ],
)
def test_a_place_is_met_where_the_block_has_been_as_far(been, x, theta, met):
    block = setting_of(RACK)
    state = begun((0.0, RACK_HEIGHT, 0.0, 0.0, 0.0, 0.0)).state
    there = run_at((been[0], 0.9, been[1], 0.0, 0.0, 0.0)).state.motion
    extremes.meet(block, state, there, 1.0)
    assert extremes.has_met(block, state.extremes, x, theta) == met


@pytest.mark.parametrize(
    ("part", "index"),
    [("turned", 0), ("turned", 1), ("bottoms", 0), ("bottoms", 1)]
    + [("tops", (i, j)) for i in range(2) for j in range(2)],
)
def test_each_figure_of_a_record_counts_by_more_than_rounding(part, index):
    block, reached = setting_of(RACK), [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.2), (0.0, -0.2)]
    state = begun((0.0, RACK_HEIGHT, 0.0, 0.0, 0.0, 0.0)).state
    for x, theta in reached:
        extremes.meet(block, state, run_at((x, 0.9, theta, 0.0, 0.0, 0.0)).state.motion, 1.0)
    largest = state.extremes[part][index]
    for less, known in ((0.0 if part == "turned" else 5e-14, True), (2e-13, False)):
        state.extremes[part][index] = largest - less
        met = all(extremes.has_met(block, state.extremes, x, theta) for x, theta in reached)
        assert met == known


@pytest.mark.parametrize(("across", "side"), [(-1.0, "left"), (1.0, "right")])
def test_a_block_reaches_a_wall_where_its_corner_does(across, side):
    rng = np.random.default_rng(2)
    block = setting_of(RACK, walls=[Wall(side=side, gap=0.1)])
    for _ in range(20):
        theta = rng.uniform(-0.3, 0.3)
        farthest = max(across * corner(0.0, theta, across, upward) for upward in (1.0, -1.0))
        wall = across * first_place(across) + 0.1 / RACK.radius
        touches = across * (wall - farthest)
        assert extremes.reaches_wall(block, touches, theta)
        assert not extremes.reaches_wall(block, touches - across * 1e-9, theta)
