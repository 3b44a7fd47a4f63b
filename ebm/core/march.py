"""The event loop: series, first root of the guards, impact or selection, until the end. Natural
units (see ebm.core.motion).

docs/theory.md, "How an event is handled", goes with this file.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core import bouc_wen
from rockcheck.ebm.core.contacts import CLOSED, closed_floor, stand, stop
from rockcheck.ebm.core.decide import decided, energy_of, quiet_from, swing_error, swings_again
from rockcheck.ebm.core.ground import STILL, next_exceedance, next_kink
from rockcheck.ebm.core.guards import (
    G_CONE_MINUS,
    G_CONE_PLUS,
    G_FAR_GAP,
    G_PHI,
    G_PUSH,
    G_SLIP,
    G_TIP_GAP,
    G_TOPPLE,
    G_UPLIFT_MINUS,
    G_UPLIFT_PLUS,
    fill_guards,
    first_event,
    rock_guards_hold,
)
from rockcheck.ebm.core.guards import KIND as GUARD_KIND
from rockcheck.ebm.core.laws.strike import LANDING, ON_WALL, strike
from rockcheck.ebm.core.modes import MEMORY, MODES, SLACK, code_of, forget, leave, select, slacken
from rockcheck.ebm.core.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    MODE_SIZE,
    OMEGA,
    PHI,
    PULL,
    SIN,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    VY,
    XI,
    G,
    S,
    U,
    W,
    X,
    Y,
    flat_series,
    flat_state,
    tilt_series,
    tilt_state,
)
from rockcheck.ebm.core.rules import GRAZES, LANDS_ALONG, RULES
from rockcheck.ebm.core.running import (
    BEFORE,
    CHANGING,
    DONE,
    EVENT_NAMES,
    EVENTS,
    FAILURES,
    FLOOR_IMPACT,
    GOING,
    KIND,
    LANDS,
    LEAVES_REST,
    LEFT,
    LIFT_OFF,
    MODE_NAMES,
    NO_EVENT,
    NOT_FINITE,
    OVERTURNED,
    PEAK,
    PIVOT,
    QUIET,
    RELEASE,
    REPEATS,
    RIGHT,
    ROWS,
    SETTLED,
    SLIPS,
    STEPS,
    STICKS,
    STRIDE,
    SWING,
    SWUNG,
    T_REST,
    TOO_MANY_EVENTS,
    TOO_MANY_STEPS,
    UPLIFT,
    WALL_IMPACT,
    WALL_IMPACTS,
    ZETA,
    Control,
    Records,
    Run,
    Scratch,
    T,
    Tally,
    mode_code,
    note,
)
from rockcheck.ebm.core.series import (
    AHEAD,
    FORCE,
    INSTANT,
    NO_ROOT,
    NOISE,
    ORDER,
    POSITION,
    first_root,
    longest_step,
    size_of,
    slope,
    stays_below,
    step_size,
    value,
)
from rockcheck.ebm.core.settle import no_impacts, settling_speed
from rockcheck.scenes.compiled import inner_kernel, kernel

__all__ = [
    "DONE",
    "EVENT_NAMES",
    "FAILURES",
    "MODE_NAMES",
    "OVERTURNED",
    "TOO_MANY_EVENTS",
    "TOO_MANY_STEPS",
    "Control",
    "Tally",
    "run",
]

# Where the counts of the modelling choices begin in a run's integers.
_RULES = MODE_SIZE + 7
#: Events that are changes of mode and nothing else.
_CHANGES = (UPLIFT, SLIPS, LIFT_OFF, RELEASE)
#: A step reaches at most so many times as far as the last ones went: where a block rattles, its
#: series need few terms. Of a longer step before, this share counts after each further one.
_FARTHER, _FADES = 8.0, 0.25


@kernel
def run(b, gh, gv, z, t_end, control, out, out_mode, log, a, stack, yields=None):
    """Simulates from state z (changed in place) at t = 0 to t_end; returns a Tally, and how often
    each modelling choice was made.

    Row i of `out` (n x 6) is the state at i * output_step, `out_mode` its mode; `log` (n x 5) takes
    one row an event: time, kind, mode before, mode after, impulse. `a` and `stack` are a
    `workspace()`. With Bouc-Wen friction `yields` is its yield displacement; without it the loop is
    compiled for Coulomb's.
    """
    scratch = scratch_with(a, stack)
    return march(
        b, gh, gv, z, t_end, control, yields, Records(out, out_mode, log), scratch
    ), scratch.whole[_RULES:]


@kernel
def scratch_with(a, stack):
    """Scratch for runs, with a `workspace()`."""
    return Scratch(
        a,
        stack,
        np.zeros(10 + MEMORY + 16),
        np.zeros(_RULES + RULES, dtype=np.int64),
        np.zeros(MODES, dtype=np.bool_),
    )


@inner_kernel
def march(b, gh, gv, z, t_end, control, yields, records, scratch):
    """Simulates as `run` does, in `Scratch` that another run may have used; returns a Tally.

    Where arrays are made, or parts of them, their references are counted one by one, unless that is
    in an inner kernel.
    """
    a, stack, reals, whole, tried = scratch
    reals[:] = 0.0
    whole[:] = 0
    control = _in_rad(control, b)
    r = Run(
        z,
        whole[:MODE_SIZE],
        reals[:10],
        whole[MODE_SIZE:_RULES],
        whole[_RULES:],
        tried,
        reals[10 : 10 + MEMORY],
        reals[10 + MEMORY : 16 + MEMORY],
        reals[16 + MEMORY : 18 + MEMORY],
        reals[18 + MEMORY : 20 + MEMORY],
        reals[20 + MEMORY :],
    )
    ending = _begin(b, gh, gv, r, control, a)
    while ending >= GOING:
        if ending == CHANGING:
            ending = _follow(b, gh, gv, r, yields, records, a)
        elif r.m[FAMILY] == FLAT and r.m[FLOOR] == STICK and gv.kind == STILL and yields is None:
            ending = _rest(b, gh, r, t_end, control, records)
        else:
            ending = _may_go_on(b, gh, gv, r, t_end, control)
            if ending == GOING:
                ending = _step(b, gh, gv, r, t_end, control, yields, records, a, stack)
    if ending == DONE and not math.isfinite(z[THETA]):
        ending = NOT_FINITE
    if ending == DONE and not control.until_decided:
        _sample_rest(r, np.inf, control, records)
    at_rest = r.m[FAMILY] == FLAT and r.m[FLOOR] == STICK
    steps, events, walls, rows = (
        r.counts[STEPS],
        r.counts[EVENTS],
        r.counts[WALL_IMPACTS],
        r.counts[ROWS],
    )
    return Tally(
        ending,
        r.now[T],
        r.now[PEAK],
        at_rest,
        steps,
        events,
        walls,
        int(r.gains[0]),
        r.gains[1],
        rows,
        r.now[T_REST],
    )


@inner_kernel
def _begin(b, gh, gv, r, control, a):
    """Prepares the first mode at t = 0."""
    z, now = r.z, r.now
    now[T_REST] = now[ZETA] = now[SWUNG] = now[PIVOT] = np.nan
    now[PEAK], now[QUIET], now[STRIDE] = (
        abs(z[THETA]),
        quiet_from(gh, gv, control.tolerance),
        np.inf,
    )
    no_impacts(r.rattle)
    for k in range(
        a.shape[1]
    ):  # the series of 1 + vertical acceleration: of a still base it stays as it is
        a[G, k] = 0.0
    a[G, 0] = 1.0
    forget(r.tried, r.memory, 0.0)
    stands = (
        z[THETA] == 0.0 and z[W] == 0.0 and z[VX] == 0.0 and z[VY] == 0.0 and closed_floor(b, z)
    )
    return _change(r, LEAVES_REST if stands else NO_EVENT, 0)


@inner_kernel
def _in_rad(control, b):
    """The control with its tolerance in rad, given in alpha: all that a block does before it
    topples happens within alpha.

    Terms fall like the powers of a ratio. If the last one is the tolerance, and the first one is 1,
    that ratio is known, and what is left out is a geometric series. It may be half of the
    tolerance.
    """
    ratio = control.tolerance ** (1.0 / ORDER)
    tolerance = control.tolerance * min(b.left.alpha, b.right.alpha)
    last_term = 0.5 * tolerance * (1.0 - ratio) / ratio
    return Control(
        tolerance,
        control.most_steps,
        control.most_events,
        control.until_decided,
        control.output_step,
        last_term,
    )


@inner_kernel
def _change(r, kind, before):
    """The mode has ended, by an event of this kind: CHANGING."""
    r.counts[KIND], r.counts[BEFORE] = kind, before
    return CHANGING


@inner_kernel
def _follow(b, gh, gv, r, yields, records, a):
    """Selects the mode that follows, and notes the event that ended the one before, unless it goes
    on."""
    kind, ended = r.counts[KIND], code_of(r.m)
    if yields is not None:
        bouc_wen.begin(b, gh, gv, r, yields, a)
    elif not select(b, r.z, gh, gv, r.now[T], r.m, r.tried, r.memory, r.rules, a):
        return NOT_FINITE
    if kind in _CHANGES and yields is None and code_of(r.m) == ended:
        return GOING
    if kind == LEAVES_REST:
        if mode_code(r) == 0:
            return GOING
        r.now[T_REST] = np.nan
        kind = SLIPS if r.m[FAMILY] == FLAT else UPLIFT
    if kind != NO_EVENT:
        _note_event(r, records.log, kind, r.counts[BEFORE])
    return GOING


@inner_kernel
def _note_event(r, log, kind, before):
    """One row of the log, and one more where an impact ends in rest."""
    note(r, log, kind, before)
    if (
        FLOOR_IMPACT <= kind <= LANDS
        and kind != LIFT_OFF
        and mode_code(r) == 0
        and log.shape[0] > r.counts[EVENTS]
    ):
        note(r, log, SETTLED, before)


@inner_kernel
def _rest(b, gh, r, t_end, control, records):
    """Rest on a base that only moves sideways: straight to the next uplift or slip."""
    m, now = r.m, r.now
    to_left, to_right = b.left.arm / b.height, b.right.arm / b.height
    if not b.no_slip:
        to_left, to_right = min(to_left, b.mu_s), min(to_right, b.mu_s)
    if math.isnan(now[T_REST]):
        now[T_REST] = now[T]
    noise = (
        2.0 * r.memory[SLACK] * NOISE[FORCE] / b.height
    )  # of an acceleration, for all guards of rest to see it
    low, high = -np.inf if m[FAR] != 0 else -to_right, np.inf if m[TIP] != 0 else to_left
    until = next_exceedance(gh, now[T], low, high, noise, 0.5 * AHEAD)
    _sample_rest(r, min(until, t_end), control, records)
    if until >= t_end:
        now[T] = t_end if not control.until_decided else now[T]
        return DONE
    now[T], now[STRIDE] = until, np.inf
    leave(m, r.tried, r.memory, until, FORCE)
    return _change(r, LEAVES_REST, 0)


@inner_kernel
def _sample_rest(r, until, control, records):
    """Rows of a block that does not change, up to a time."""
    rows = r.counts[ROWS]
    code = mode_code(r)
    while rows < records.out.shape[0] and rows * control.output_step <= until:
        _write(records, rows, r.z, code)
        rows += 1
    r.counts[ROWS] = rows


@inner_kernel
def _may_go_on(b, gh, gv, r, t_end, control):
    """GOING, or why the run ends here: its time is up, its outcome is certain, or it has taken too
    many steps."""
    z, now = r.z, r.now
    if now[T] >= t_end:
        return DONE
    if control.until_decided:
        if now[REPEATS] != 0.0:
            return DONE
        verdict = decided(b, r.m, z, gh, gv, now[T], now[QUIET], now[PEAK])
        if verdict > 0.0:
            now[PEAK] = verdict
            if verdict < 0.5 * math.pi:
                return DONE
            z[THETA] = math.copysign(verdict, z[THETA])
            return OVERTURNED
    if r.counts[STEPS] >= control.most_steps:
        return TOO_MANY_STEPS
    r.counts[STEPS] += 1
    return GOING


@inner_kernel
def _step(b, gh, gv, r, t_end, control, yields, records, a, stack):
    """One step of the series, to its end or to the first event in it, and what that event does."""
    z, m, now = r.z, r.m, r.now
    t = now[T]
    end = min(min(next_kink(gh, t), next_kink(gv, t)), t_end)
    if yields is None:
        order, pivot, h = _expand(
            b, m, z, gh, gv, t, min(end - t, _FARTHER * now[STRIDE]), control, a
        )
    else:
        order, pivot, h = bouc_wen.expand(b, gh, gv, r, end - t, control, yields, a)
    if not h > 0.0:  # no step is good for a series that is not finite
        return NOT_FINITE
    if yields is None:
        tau, which = _locate(b, m, order, pivot, h, r.memory[SLACK], a, stack)
    else:
        tau, which = bouc_wen.locate(b, m, order, h, r.memory[SLACK], a, stack)
    if not math.isfinite(tau):
        return NOT_FINITE
    whole = which < 0 and tau >= end - t
    _sample(b, r, t, end if whole else t + tau, order, pivot, control, records, a)
    _advance(b, r, order, pivot, tau, control, a, stack)
    now[STRIDE] = max(tau, INSTANT, _FADES * min(now[STRIDE], h))
    now[T] = end if whole else t + tau
    if yields is not None:
        bouc_wen.wind_up(r, order, tau, control.tolerance, records.log, a)
    if which < 0 or (
        which == G_PHI
        and gv.kind != STILL
        and not b.unilateral
        and _grazes(b, r, order, pivot, tau, h, control, a)
    ):
        return GOING
    now[SWING] = 0.0
    if r.counts[EVENTS] + 1 >= control.most_events:
        return TOO_MANY_EVENTS
    if which == G_TOPPLE or _lies_along_wall(m, z, which, r.rules):
        z[THETA] = math.copysign(0.5 * math.pi, z[THETA])
        now[PEAK] = 0.5 * math.pi
        note(r, records.log, LEFT if m[S] > 0 else RIGHT, mode_code(r))
        return OVERTURNED
    return _resolve(b, gh, gv, r, which, yields, records, a, stack)


@inner_kernel
def _expand(b, m, z, gh, gv, t, reach, control, a):
    """Series of the mode's motion about t: their order, the place of a sticking pivot, and the step
    they are good for."""
    if m[FAMILY] == FLAT:
        order = flat_series(b, m, z, gh, gv, t, ORDER, a)
        return order, 0.0, step_size(a, U, G, order, control.last_term, reach)
    # The tolerance is relative to a motion that is still tiny, since it may grow.
    enough = 0.01 * control.tolerance * min(1.0, 1e2 * (abs(z[THETA]) + abs(z[W])))
    order = tilt_series(b, m, z, gh, gv, t, ORDER, enough, reach, a)
    h = reach
    if order == ORDER:
        last, before = size_of(a, PHI, COS, order), size_of(a, PHI, COS, order - 1)
        rocks = m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0
        if not rocks:
            last, before = (
                max(last, size_of(a, XI, Y, order)),
                max(before, size_of(a, XI, Y, order - 1)),
            )
        if not rocks or gv.kind != STILL:  # forces follow the base acceleration
            last, before = (
                max(last, size_of(a, U, G, order)),
                max(before, size_of(a, U, G, order - 1)),
            )
        h = longest_step(last, before, order, control.last_term, reach)
    return order, m[S] * z[X] - a[SIN, 0], h


@inner_kernel
def _locate(b, m, order, pivot, h, slack, a, stack):
    """The first time within the step at which a guard ends the mode, and which; h and -1 where none
    does."""
    rocks = m[FAMILY] == TILT and m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0
    if rocks and m[PULL] > 0 and rock_guards_hold(b, m, pivot, order, h, a):
        tau = first_root(a, PHI, order, h, h, min(slack * NOISE[POSITION], CLOSED), AHEAD, stack)
        return (h, -1) if tau == NO_ROOT else (tau, G_PHI)
    fill_guards(b, m, pivot, a)
    return first_event(order, h, slack, a, stack)


@inner_kernel
def _sample(b, r, t, until, order, pivot, control, records, a):
    """The rows of this step, which starts at t."""
    rows = r.counts[ROWS]
    code = mode_code(r)
    while rows < records.out.shape[0] and rows * control.output_step < until:
        _state(b, r.m, order, rows * control.output_step - t, pivot, a, r.row)
        _write(records, rows, r.row, code)
        rows += 1
    r.counts[ROWS] = rows


@inner_kernel
def _write(records, rows, z, code):
    for k in range(6):
        records.out[rows, k] = z[k]
    records.out_mode[rows] = code


@inner_kernel
def _state(b, m, order, tau, pivot, a, z):
    """The state at tau after the start of the step."""
    if m[FAMILY] == FLAT:
        flat_state(b, m, order, tau, a, z)
    else:
        tilt_state(b, m, order, tau, pivot, a, z)


@inner_kernel
def _advance(b, r, order, pivot, tau, control, a, stack):
    """Moves the state to tau after the start of the step; keeps the largest rotation on the way."""
    z, now = r.z, r.now
    rises, energy = r.m[FAMILY] == TILT and a[OMEGA, 0] > 0.0, energy_of(b, z)
    _state(b, r.m, order, tau, pivot, a, z)
    turns = rises and r.m[S] * z[W] < 0.0
    if turns and not stays_below(a, PHI, order, tau, now[PEAK]):
        top = first_root(a, OMEGA, order - 1, tau, tau, NOISE[POSITION], AHEAD, stack)
        if top > 0.0:
            now[PEAK] = max(now[PEAK], value(a, PHI, order, top))
    if turns and control.until_decided:
        now[REPEATS] = swings_again(b, r.m, energy, pivot, control.tolerance, now)
    now[PEAK] = max(now[PEAK], abs(z[THETA]))
    now[SWING] = max(now[SWING], abs(z[W]))


@inner_kernel
def _grazes(b, r, order, pivot, tau, h, control, a):
    """Whether a hanging block that comes down with less energy than a swing errs by does not land.
    It is then put where it turns back.

    A block at rest whose floor falls away swings back to just where it started. That cannot be told
    from a touch.
    """
    z, m = r.z, r.m
    if m[TIP] != 0 or m[FAR] != 0 or value(a, G, order, tau) >= 0.0:
        return False
    back = slope(a, OMEGA, order - 1, tau)
    past = 2.0 * abs(z[W]) / back
    energy = swing_error(control.tolerance) * r.now[SWING]
    if not (0.5 * z[W] * z[W] < energy * min(1.0, 10.0 * back) and 0.0 < past <= h - tau):
        return False
    r.rules[GRAZES] += 1
    r.now[T] += past
    _state(b, m, order, tau + past, pivot, a, z)
    z[THETA] = math.copysign(max(abs(z[THETA]), 2.0 * NOISE[POSITION]), float(m[S]))
    return True


@inner_kernel
def _resolve(b, gh, gv, r, which, yields, records, a, stack):
    """An event: the impact at a gap that closes, or the change of mode at another guard."""
    z, m, t = r.z, r.m, r.now[T]
    before = mode_code(r)
    leave(m, r.tried, r.memory, t, GUARD_KIND[which])
    if which <= G_FAR_GAP:
        r.impulse[:] = 0.0
        resting = settling_speed(r.rattle, t, r.rules)
        struck, known = strike(b, m, z, which, gh, t, resting, r.impulse, r.gains, r.rules, stack)
        kind = WALL_IMPACT if struck == ON_WALL else (LANDS if struck == LANDING else FLOOR_IMPACT)
        if r.impulse[0] + r.impulse[1] > 0.0:
            forget(r.tried, r.memory, t)  # a new motion: all modes may be tried again
        elif yields is not None:
            slacken(r.memory)
    elif yields is None:
        kind, known = _release(b, m, z, which), False
    else:
        return bouc_wen.follow(b, gh, gv, r, which, before, yields, records.log, a)
    if which <= G_FAR_GAP and b.unilateral and r.impulse[0] + r.impulse[1] == 0.0:
        kind = NO_EVENT  # a block in flight passes theta = 0
    r.counts[WALL_IMPACTS] += kind == WALL_IMPACT
    if known and yields is None:
        _note_event(r, records.log, kind, before)
        return GOING
    return _change(r, kind, before)


@inner_kernel
def _lies_along_wall(m, z, which, rules):
    """Whether a block that turns over about a standing pivot meets the wall as it comes to lie.

    Its gap goes with the square of the angle that is left.
    """
    rest = math.cos(z[THETA])
    lies = (
        which == G_TIP_GAP
        and m[FAMILY] == TILT
        and m[FLOOR] == STICK
        and rest * rest < CLOSED
        and m[S] * z[W] > 0.0
    )
    rules[LANDS_ALONG] += lies
    return lies


@inner_kernel
def _release(b, m, z, which):
    """Prepares the state for a change of mode without impact, and names it."""
    if which == G_SLIP:
        if m[TIP] != 0 or m[FAR] != 0:
            stop(z)
        stand(b, z)
        return STICKS
    if not b.unilateral and m[FAMILY] == FLAT and m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0:
        return LEAVES_REST  # or hangs on, or lands again: the next mode says which
    if which == G_CONE_PLUS or which == G_CONE_MINUS:
        return SLIPS
    if which == G_UPLIFT_PLUS or which == G_UPLIFT_MINUS:
        return UPLIFT
    return LIFT_OFF if which == G_PUSH and b.unilateral else RELEASE
