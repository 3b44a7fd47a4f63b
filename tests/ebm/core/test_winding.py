"""A pivot that winds by Bouc-Wen's law: its steps, its turns, and what follows an event. Natural
units, a block of 0.3 rad."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from stepping import FLAT, RESTS, TILTED, run_at, setting_of

from rockcheck.ebm.core import bouc_wen, motion
from rockcheck.ebm.core.ground import acceleration, ground_of
from rockcheck.ebm.core.names import Ending, Event, Guard, HistoryMode, Pivot, Row
from rockcheck.ebm.core.state import Base, mode_code
from rockcheck.scenes import Record, Rest, Sine

ALPHA, MU, YIELDS = 0.3, 0.5, 0.1
SLIPS = {"pivot": Pivot.SLIPPING, "slip": 1}
STILL = ground_of(Rest(), 1.0, 1.0)
LAW = {"pivot": "bilateral", "friction": "bouc-wen", "yield_displacement": YIELDS}
BLOCK = setting_of(ALPHA, MU, **LAW)


def winding(z, slide=0.0, rate=0.0, **mode):
    """A run of an upright block whose pivot has wound so far and slips so."""
    height = math.cos(ALPHA)
    place = (0.0, height, 0.0, slide - height * rate, math.sin(ALPHA) * abs(rate), rate)
    run = run_at(place, **mode)
    run = run._replace(records=run.records._replace(log=np.zeros((4, 5))))
    run.state.zeta, run.state.winds, run.state.before = z, True, mode_code(run.state)
    return run


def after(run, guard, event=Event.UNTOLD, push=0.0, mu=MU):
    """The run after an event that this guard has found, on a base that accelerates so."""
    run.state.guard, run.state.event = guard, event
    along = ground_of(Record.from_samples([push] * 3, time_step=1.0), 1.0, 1.0)
    bouc_wen.after_event(setting_of(ALPHA, mu, **LAW), Base(along, STILL), run)
    return run


def told(run):
    """The kinds of the events in the log."""
    return run.records.log[: run.state.events, 1].tolist()


@pytest.mark.parametrize("reach", [0.03, 1.0])
def test_a_step_of_a_pivot_that_loads_is_that_of_an_integration(reach):
    """Newton and Euler with Q = -mu z P, and u_y z' = V (1 - z^2)."""
    shakes = ground_of(Sine(amplitude=0.2, period=2.0), 1.0, 1.0)
    tilt, rate, slide, z = 0.1, 0.2, 0.3, 0.2
    s, c = math.sin(ALPHA - tilt), math.cos(ALPHA - tilt)
    run = winding(z, **TILTED, **SLIPS, sense=1)
    state = run.state
    state.motion = (0.0, c, tilt, slide - c * rate, s * rate, rate)
    state.tolerance_rad = state.last_term_rad = 1e-12
    bouc_wen.expand(BLOCK, Base(shakes, STILL), run, reach)
    state.tau = state.length
    motion.motion_at(BLOCK, state, run.a, state.tau, state.motion)
    bouc_wen.advance(run)

    def rates(t, y):
        v, phi, w, z = y
        s, c = math.sin(ALPHA - phi), math.cos(ALPHA - phi)
        push = (1.0 - c * w * w) / (1.0 + 3.0 * s * s + 3.0 * MU * z * s * c)
        turns = -3.0 * (MU * z * c + s) * push
        winds = (v + c * w) * (1.0 - z * z) / YIELDS
        return -MU * z * push - acceleration(shakes, t), w, turns, winds

    exact = solve_ivp(
        rates,
        (0.0, state.tau),
        (slide - c * rate, tilt, rate, z),
        "DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    end = [state.motion.vx, state.motion.theta, state.motion.w, state.zeta]
    assert state.tau > 0.02
    assert end == pytest.approx(exact.y[:, -1], abs=1e-10)


@pytest.mark.parametrize(("left", "winds"), [(9e-9, False), (1.1e-8, True)])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_pivot_has_yielded_within_ten_tolerances_of_its_limit(sense, left, winds):
    run = winding(0.0, **TILTED, **SLIPS, sense=sense)
    run.state.tolerance_rad, run.state.order = 1e-9, 2
    run.a[Row.Z, :2] = 1.0 - left, 0.0
    bouc_wen.advance(run)
    assert run.state.winds == winds
    assert told(run) == ([] if winds else [Event.SLIPS])


@pytest.mark.parametrize(("pivot", "winds"), [(Pivot.SLIPPING, False), (Pivot.STICK, True)])
def test_a_pivot_that_has_yielded_or_stands_keeps_its_z(pivot, winds):
    run = winding(0.4, **TILTED, sense=1, pivot=pivot, slip=1)
    run.state.winds, run.a[Row.Z, :2] = winds, (0.9, 0.0)
    bouc_wen.advance(run)
    assert run.state.zeta == 0.4


@pytest.mark.parametrize(("winds", "events"), [(True, []), (False, [Event.STICKS])])
def test_a_tilted_pivot_whose_slip_ends_slips_back(winds, events):
    """One that had yielded winds again: it sticks."""
    run = winding(1.0, **TILTED, **SLIPS, sense=1)
    run.state.winds = winds
    after(run, Guard.SLIP)
    assert run.state.mode.slip == -1
    assert run.state.winds
    assert told(run) == events


def test_a_pivot_that_loads_slips_on():
    run = after(winding(0.0, **TILTED, **SLIPS, sense=1), Guard.LOADS)
    assert run.state.mode.slip == 1
    assert told(run) == []


def test_an_impact_leaves_a_pivot_as_far_wound():
    run = winding(0.3, 0.05, -0.2, **TILTED, **SLIPS, sense=1)
    after(run, Guard.PHI, Event.FLOOR_IMPACT)
    assert told(run) == [Event.FLOOR_IMPACT]
    assert run.state.mode.sense == -1
    assert run.state.zeta == 0.3
    assert run.state.winds


def test_an_impact_that_leaves_a_block_sliding_leaves_it_as_far_wound():
    run = winding(0.3, 0.05, **TILTED, **SLIPS, sense=1)
    after(run, Guard.PHI, Event.FLOOR_IMPACT, mu=0.1)
    assert mode_code(run.state) == HistoryMode.SLIDE
    assert run.state.zeta == 0.3
    assert run.state.winds


def test_as_a_block_uplifts_friction_begins_as_coulombs():
    """The base pushes with 0.4: theta'' = 3/4 (0.4 c - s), and z is -Q/(mu P)."""
    run = after(winding(math.nan, **RESTS), Guard.UPLIFT_PLUS, push=0.4)
    s, c = math.sin(ALPHA), math.cos(ALPHA)
    turns = 0.75 * (0.4 * c - s)
    share = (0.4 - c * turns) / (MU * (1.0 + s * turns))
    assert run.state.ending == Ending.GOING
    assert run.state.mode.pivot == Pivot.SLIPPING
    assert mode_code(run.state) == HistoryMode.ROCK
    assert run.state.zeta == pytest.approx(-share, rel=1e-12)
    assert told(run) == [Event.UPLIFT]


@pytest.mark.parametrize(
    ("push", "guard", "shown", "z", "winds"),
    [
        (0.0, Guard.SLIP, HistoryMode.REST, 0.0, True),
        # It slides back, and unwinds.
        (0.2, Guard.SLIP, HistoryMode.SLIDE, 0.7, True),
        # As with Coulomb's friction, it slides at once.
        (0.2, Guard.CONE_PLUS, HistoryMode.SLIDE, -1.0, False),
    ],
)
def test_friction_of_a_flat_block_goes_on_only_where_it_slides_back(push, guard, shown, z, winds):
    """With a friction of 0.1."""
    mode = FLAT | SLIPS if guard == Guard.SLIP else RESTS
    run = after(winding(0.7, **mode), guard, push=push, mu=0.1)
    assert mode_code(run.state) == shown
    assert run.state.zeta == pytest.approx(z, abs=1e-12)
    assert run.state.winds == winds
