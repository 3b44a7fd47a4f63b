"""The length of a step: at its end the motion is that of an independent integration. Natural units,
a block of 0.3 rad."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from stepping import FLAT, RESTS, ROCKS, run_at, setting_of

from rockcheck.ebm.core import coulomb, motion, series, steps
from rockcheck.ebm.core.ground import acceleration, ground_of
from rockcheck.ebm.core.names import Ending, Event, Guard, HistoryMode, Kind, Pivot, Row
from rockcheck.ebm.core.state import Base, Records
from rockcheck.scenes import Block, Record, Rest, Ricker, Sine

ALPHA, TOLERANCE = 0.3, 1e-10
STILL = ground_of(Rest(), 1.0, 1.0)
PULSE = ground_of(Ricker(amplitude=0.6, period=2.0), 1.0, 1.0)


def begun(start, mode, t=0.0):
    """A run at this tolerance."""
    run, ratio = run_at(start, t=t, **mode), TOLERANCE ** (1.0 / series.ORDER)
    run.state.tolerance_rad = TOLERANCE * ALPHA
    run.state.last_term_rad = 0.5 * run.state.tolerance_rad * (1.0 - ratio) / ratio
    return run


def first_step(base, start, mode, t):
    """The motion at the end of a step that nothing else ends, and its length."""
    block, run = setting_of(ALPHA, 0.2), begun(start, mode, t)
    state = run.state
    coulomb.expand(block, base, run, 50.0)
    motion.motion_at(block, state, run.a, state.length, state.sampled)
    return state.sampled, state.length


@pytest.mark.parametrize("early", [1.0, 0.3, -0.4])
def test_a_flat_block_slides_as_friction_and_the_base_accelerate_it(early):
    """x'' = mu - u while it slides to the left."""
    t = PULSE.form.centre - early
    mode = FLAT | {"pivot": Pivot.SLIPPING, "slip": -1}
    end, length = first_step(
        Base(PULSE, STILL), (0.1, math.cos(ALPHA), 0.0, -5.0, 0.0, 0.0), mode, t
    )
    moved, _ = quad(lambda s: (length - s) * (0.2 - acceleration(PULSE, t + s)), 0.0, length)
    assert 0.05 < length < 5.0
    assert end.x == pytest.approx(0.1 - 5.0 * length + moved, abs=1e-9)


@pytest.mark.parametrize("upward", [STILL, ground_of(Sine(amplitude=0.4, period=0.9), 1.0, 1.0)])
def test_a_block_rocks_as_its_moments_turn_it(upward):
    """theta'' = 3/4 (u c - (1 + vertical) s) about the pivot."""
    t, tilt, rate = PULSE.form.centre - 0.3, 0.1, 0.05
    s, c = math.sin(ALPHA - tilt), math.cos(ALPHA - tilt)
    start = (s - math.sin(ALPHA), c, tilt, -c * rate, s * rate, rate)
    end, length = first_step(Base(PULSE, upward), start, ROCKS | {"sense": 1}, t)

    def turns(tau, state):
        angle, gravity = ALPHA - state[0], 1.0 + acceleration(upward, t + tau)
        push = acceleration(PULSE, t + tau)
        return [state[1], 0.75 * (push * math.cos(angle) - gravity * math.sin(angle))]

    exact = solve_ivp(turns, (0.0, length), [tilt, rate], "DOP853", rtol=1e-12, atol=1e-13)
    assert 0.05 < length < 5.0
    np.testing.assert_allclose([end.theta, end.w], exact.y[:, -1], rtol=0.0, atol=1e-9)


def test_forces_follow_a_base_that_shakes_fast_up_and_down():
    """A step of a rocking block ends before they err by the tolerance."""
    upward = ground_of(Sine(amplitude=0.4, period=0.03), 1.0, 1.0)
    run = begun((0.0, math.cos(ALPHA - 0.1), 0.1, 0.0, 0.0, 0.0), ROCKS | {"sense": 1})
    coulomb.expand(setting_of(ALPHA), Base(STILL, upward), run, 50.0)
    end = run.state.length
    gravity = series.value(run.a, Row.G, run.state.order, end)
    assert gravity == pytest.approx(1.0 + acceleration(upward, end), abs=TOLERANCE)


def rises():
    """A run until its outcome is decided, of a block that rises from 0.1 rad on a still base, and
    turns back 0.3 s later."""
    s, c, rate = math.sin(ALPHA - 0.1), math.cos(ALPHA - 0.1), 0.05
    start = (s - math.sin(ALPHA), c, 0.1, -c * rate, s * rate, rate)
    run = begun(start, ROCKS | {"sense": 1})
    run.state.control.until_decided = True
    return run


def step(run, tau):
    """One more step of this length."""
    block, base = setting_of(ALPHA), Base(STILL, STILL)
    coulomb.expand(block, base, run, tau)
    run.state.tau = tau
    steps.advance(block, base, run)


@pytest.mark.parametrize(("tau", "repeats"), [(0.5, True), (0.1, False)])
def test_a_swing_repeats_only_where_it_turns_back(tau, repeats):
    run = rises()
    step(run, tau)
    assert not run.state.repeats
    run.state.motion = rises().state.motion
    step(run, tau)
    assert run.state.repeats == repeats


def test_a_step_keeps_the_highest_tilt_on_its_way():
    """Energy of rotation, 2/3 rate^2, lifts the centre."""
    run, top = rises(), ALPHA - math.acos(math.cos(ALPHA - 0.1) + 2.0 / 3.0 * 0.05**2)
    step(run, 0.5)
    assert run.state.peak == pytest.approx(top, abs=1e-9)


@pytest.mark.parametrize(
    ("tau", "before", "counts"), [(0.1, 0.2, 0.1), (0.01, 0.2, 0.05), (0.01, 4.0, 0.1)]
)
def test_after_a_short_step_a_quarter_of_the_longer_one_before_counts(tau, before, counts):
    """Of one that is longer than this one could have been, 0.4, a quarter of that."""
    run = rises()
    step(run, 0.4)
    run.state.tau, run.state.stride = tau, before
    steps.advance(setting_of(ALPHA), Base(STILL, STILL), run)
    assert run.state.stride == counts


@pytest.mark.parametrize("sign", [1, -1])
def test_a_run_ends_overturned_once_the_block_is_sure_to_fall(sign):
    """It rises beyond its balance on a still base."""
    state = run_at((0.0, 1.0, 0.31 * sign, 0.0, 0.0, 0.1 * sign), **ROCKS, sense=sign).state
    steps._decide(setting_of(ALPHA), Base(STILL, STILL), state)
    assert state.ending == Ending.OVERTURNED
    assert state.motion.theta == sign * 0.5 * math.pi


def constant(acceleration):
    """A base that accelerates so for 2 s."""
    return ground_of(Record.from_samples([acceleration] * 3, time_step=1.0), 1.0, 1.0)


@pytest.mark.parametrize(
    ("push", "upward", "share", "grazes"),
    [
        (0.0, -2.0, 0.95, True),
        (0.0, -2.0, 1.05, False),
        # Pulled back with less than 0.1, here 0.022, less counts.
        (0.0, -1.1, 0.21, True),
        (0.0, -1.1, 0.24, False),
        # The floor pushes, and the base throws the block back.
        (2.0, 0.0, 0.95, False),
    ],
)
def test_a_hanging_block_grazes_the_floor_with_less_energy_than_its_swing_errs_by(
    push, upward, share, grazes
):
    """The error of a swing: four times the tolerance, here 1e-6, by its speed, here 0.1."""
    block, base = setting_of(ALPHA, pivot="bilateral"), Base(constant(push), constant(upward))
    rate = -math.sqrt(2.0 * share * 4e-6 * 0.1)
    start = (0.0, math.cos(ALPHA), 0.0, -math.cos(ALPHA) * rate, math.sin(ALPHA) * rate, rate)
    run = begun(start, ROCKS | {"sense": 1, "pull": -1 if upward else 1})
    coulomb.expand(block, base, run, 1.0)
    run.state.tolerance_rad, run.state.swing = 1e-6, 0.1
    assert steps._grazes(block, base, run) == grazes


def test_a_block_that_grazes_the_floor_is_put_where_it_rises_as_fast():
    """Pulled back by 3/4 sin(0.3) g it takes 2 w over that."""
    block, base, rate = setting_of(ALPHA, pivot="bilateral"), Base(STILL, constant(-2.0)), -1e-4
    start = (0.0, math.cos(ALPHA), 0.0, -math.cos(ALPHA) * rate, math.sin(ALPHA) * rate, rate)
    run = begun(start, ROCKS | {"sense": 1, "pull": -1})
    coulomb.expand(block, base, run, 1.0)
    run.state.tolerance_rad, run.state.swing = 1e-6, 0.1
    assert steps._grazes(block, base, run)
    assert run.state.t == pytest.approx(2e-4 / (0.75 * math.sin(ALPHA)), rel=1e-3)
    assert run.state.motion.w == pytest.approx(-rate, rel=1e-3)


@pytest.mark.parametrize(("events", "ending"), [(98, Ending.GOING), (99, Ending.TOO_MANY_EVENTS)])
def test_a_run_ends_at_the_last_event_that_it_may_have(events, ending):
    run = rises()
    run.state.control.most_events, run.state.events = 100, events
    run.state.guard = Guard.CONE_PLUS
    steps.passes_on(setting_of(ALPHA), Base(STILL, STILL), run)
    assert run.state.ending == ending


@pytest.mark.parametrize(("most", "uplift"), [(2.0, 0.5), (-2.0, 0.375)])
def test_rest_ends_where_the_base_accelerates_more_than_the_side_s_slope(most, uplift):
    """Arms of 0.8 and 0.6 at a height of 0.8, and an acceleration that rises to twice g in 1 s."""
    block = setting_of(Block(half_width=0.7, half_height=0.8, centre_of_mass=(0.1, 0.0)), 1.2)
    ramp = ground_of(Record.from_samples([0.0, most], time_step=1.0), 1.0, 1.0)
    run = run_at((0.0, 0.8, 0.0, 0.0, 0.0, 0.0), **RESTS)
    steps.rest(block, Base(ramp, STILL), run)
    assert run.state.t == pytest.approx(uplift, abs=1e-8)
    assert run.state.event == Event.RELEASE
    assert run.state.before == HistoryMode.REST


@pytest.mark.parametrize(("beyond", "ending"), [(2.0, Ending.DONE), (20.0, Ending.GOING)])
def test_a_squat_block_rests_until_the_moment_is_more_than_noise(beyond, ending):
    """Its height is a fifth: of the noise of a force an acceleration takes five times as much."""
    alpha = math.acos(0.2)
    push = constant(math.tan(alpha) + beyond * series.NOISE[Kind.FORCE])
    run = run_at((0.0, 0.2, 0.0, 0.0, 0.0, 0.0), **RESTS)
    run.state.t_end = 1.0
    steps.rest(setting_of(alpha, pivot="bilateral", friction="no-slip"), Base(push, STILL), run)
    assert run.state.ending == ending


def test_a_row_has_place_and_rates_and_the_mode():
    run = run_at((0.1, 0.2, 0.3, 0.4, 0.5, 0.6), **ROCKS, sense=1)
    rows = Records(np.zeros((2, 6)), np.zeros(2, dtype=np.int8), *run.records[2:])
    steps.sample_rest(run._replace(records=rows), 0.0)
    assert rows.out.tolist() == [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.0] * 6]
    assert rows.out_mode.tolist() == [HistoryMode.ROCK, 0]


@pytest.mark.parametrize(
    ("tau", "guard", "count", "whole"),
    [
        (0.5, Guard.NONE, 6, True),
        (0.3, Guard.NONE, 6, False),
        (0.2, Guard.PHI, 5, False),
        (0.5, Guard.PHI, 6, False),
    ],
)
def test_a_step_writes_the_rows_before_its_end(tau, guard, count, whole):
    """From 1 on, a row each 0.25, of a base that is smooth until 1.5."""
    run = run_at((0.0, math.cos(ALPHA), 0.0, 0.0, 0.0, 0.0), t=1.0, **RESTS)
    rows = Records(np.zeros((9, 6)), np.zeros(9, dtype=np.int8), *run.records[2:])
    state = run.state
    state.rows, state.control.output_step, state.smooth_until = 4, 0.25, 1.5
    state.tau, state.guard = tau, guard
    steps.sample(setting_of(ALPHA), run._replace(records=rows))
    assert state.rows == count
    assert state.whole == whole
