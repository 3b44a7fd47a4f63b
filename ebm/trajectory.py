"""The event loop: series, first root of the guards, impact or selection, until the end. Natural units (see ebm.motion)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rockcheck.ebm import impacts
from rockcheck.ebm.contact_impacts import CONTACTS, FAR_BOTTOM, FAR_TOP, TIP_BOTTOM, TIP_TOP, E, F, contact_impact
from rockcheck.ebm.ground import GAUSSIAN, STILL, acceleration, impulse_ahead, largest_ahead, next_exceedance, next_kink
from rockcheck.ebm.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    HEIGHT,
    MODE_SIZE,
    OFF,
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
    delta,
    flat_series,
    flat_state,
    tilt_series,
    tilt_state,
)
from rockcheck.ebm.series import FORCE_NOISE, INSTANT, NO_ROOT, POSITION_NOISE, first_root, slope, value
from rockcheck.ebm.transitions import (
    CLOSED_RATE,
    CREEP,
    G_CONE_MINUS,
    G_CONE_PLUS,
    G_FAR_GAP,
    G_LANDING,
    G_PHI,
    G_PUSH,
    G_SLIP,
    G_TIP_GAP,
    G_TOPPLE,
    G_UPLIFT_MINUS,
    G_UPLIFT_PLUS,
    GUARDS,
    closed_floor,
    consistent,
    guard,
    guards_of,
    noise_of,
    rock_guards_hold,
    select,
    slip_velocity,
    tips_first,
)
from rockcheck.scenes.compiled import inner_kernel, kernel

#: Names of the mode codes that `mode_code` gives, and of the event codes.
MODE_NAMES = ("rest", "slide", "rock", "slide-rock", "lean", "ladder", "flight")
EVENT_NAMES = (
    "uplift",
    "slip",
    "stick",
    "floor impact",
    "wall impact",
    "lift-off",
    "landing",
    "release",
    "settled",
    "overturned left",
    "overturned right",
)
(UPLIFT, SLIPS, STICKS, FLOOR_IMPACT, WALL_IMPACT, LIFT_OFF, LANDS, RELEASE, SETTLED, LEFT, RIGHT) = range(11)

# How a run ended.
DONE, OVERTURNED, TOO_MANY_STEPS, TOO_MANY_EVENTS, NO_MODE, NO_IMPACT, NOT_FINITE = range(7)
FAILURES = {
    TOO_MANY_STEPS: "the cap on steps was reached",
    TOO_MANY_EVENTS: "the cap on events was reached",
    NO_MODE: "no mode of motion is consistent",
    NO_IMPACT: "no impact is consistent",
    NOT_FINITE: "the motion is not finite",
}

# A block that lands more slowly than this lies flat (Zeno: impacts accumulate), and a corner that rebounds from a wall more
# slowly than this stays on it. Natural units; 5e-8 is 1e-7 rad/s for the paper's block.
SETTLE_SPIN = 5e-8
_REST_BILATERAL, _REST_UNILATERAL = 2.5e-8, 2.5e-7
# Rattling: this many impacts within this time raise the settling speed tenfold, up to a bound, until it is quiet. What rattles on
# for this many times more (a block between two walls that hardly fits) ends plastic.
_RATTLE_IMPACTS, _RATTLE_TIME, _RATTLE_BOUND, _QUIET_TIME, _RATTLES = 100, 5e-3, 2.5e-3, 2.5e-2, 50
# With the bilateral pivot a block that rattles flush against a wall is settled below these.
_FLUSH_SPIN, _FLUSH_SPEED, _FLUSH_GAP = 2e-4, 2.5e-4, 6e-7
# This far beyond the limits of rest, g, the guards of what follows are above their noise.
_BEYOND = 4.0 * FORCE_NOISE
_TOUCH = 1e-11
# A block that lands this near to a wall lands flush against it: the root of its far gap says no more (see _LANDED).
_FLUSH = 1e-9
# Near phi = 0 the far gap goes with phi^2, so that its root says phi to the square root of rounding only.
_LANDED = 1e-7
# After so many events without a step the modes hand over to each other for rounding; after so many more the run fails.
_HANDED_OVER, _MOST_ZERO_STEPS = 20, 54
# A step as long as this shows that they no longer do.
_PASSED = 1e-6
# The guards of open contacts, which hold even then.
_OPEN_CONTACTS = (1 << G_FAR_GAP + 1) - 1


class Control(NamedTuple):
    """What a run is asked for."""

    tolerance: float
    order: int
    most_steps: int
    most_events: int
    #: Stop as soon as the outcome and the peak are decided.
    until_decided: bool
    #: Spacing of the rows of `out`; with no rows nothing is sampled.
    output_step: float


class Tally(NamedTuple):
    """What a run reports besides its samples."""

    ending: int
    t: float
    peak: float
    at_rest: bool
    steps: int
    events: int
    wall_impacts: int
    gains: int
    largest_gain: float
    rows: int
    t_rest: float


@inner_kernel
def mode_code(m):
    """Index into MODE_NAMES."""
    if m[FLOOR] == OFF:
        return 6
    if m[FAMILY] == FLAT:
        return 0 if m[FLOOR] == STICK else 1
    wall = m[TIP] != 0 or m[FAR] != 0
    if m[FLOOR] == STICK:
        return 4 if wall else 2
    return 5 if wall else 3


@kernel
def run(b, gh, gv, z, t_end, control, out, out_mode, log, a, stack):
    """Simulates from state z (changed in place) at t = 0 to t_end; returns a Tally.

    Row i of `out` (n x 6) is the state at i * output_step, `out_mode` its mode; `log` (n x 5) takes one row an event: time,
    kind, mode before, mode after, impulse. `a` and `stack` are a `workspace()`.
    """
    m = np.zeros(MODE_SIZE, dtype=np.int64)
    left = np.full(MODE_SIZE, -9, dtype=np.int64)
    gains = np.zeros(2)
    impulse = np.zeros(2)
    still = gv.kind == STILL
    smooth = still and (gh.kind == STILL or gh.kind == GAUSSIAN)
    for k in range(a.shape[1]):  # the series of 1 + vertical acceleration: of a still base it stays as it is
        a[G, k] = 0.0
    a[G, 0] = 1.0
    quiet = max(gh.quiet, gv.quiet)
    if control.until_decided and smooth:
        # A pulse is over when less than the tolerance is left of it.
        quiet = gh.centre + math.sqrt(-math.log(1e-3 * control.tolerance) / gh.rate) if gh.kind == GAUSSIAN else 0.0
    base_rest = _REST_UNILATERAL if b.unilateral else _REST_BILATERAL
    rattle = np.array([base_rest, -1.0, -1.0, 0.0, 0.0])
    t = 0.0
    rows = steps = events = wall_impacts = zero_steps = 0
    peak, t_rest, waits = abs(z[THETA]), np.nan, False
    ending = DONE
    m[FAMILY], m[S], m[FLOOR], m[PULL] = FLAT, 1, STICK, 1  # most often it stands
    corner = 0  # the one that it last stood on
    swing = 0.0  # largest rate of rotation since the last event
    stands = z[THETA] == 0.0 and z[VX] == 0.0 and z[W] == 0.0 and z[HEIGHT] == b.cos_alpha and not b.walls
    stands = stands and consistent(b, m, z, gh, gv, t, a, False)
    m[S] = 1 if stands else 0
    if not stands and not select(b, z, gh, gv, t, left, m, a):
        return Tally(NO_MODE, t, peak, False, 0, 0, 0, 0, 0.0, 0, t_rest)
    if z[THETA] == 0.0 and z[W] == 0.0 and z[VX] == 0.0 and z[VY] == 0.0 and closed_floor(b, z) and mode_code(m) != 0:
        events += 1  # it cannot stay at rest
        if log.shape[0] >= events:
            _note(log, events, t, SLIPS if m[FAMILY] == FLAT else UPLIFT, 0, mode_code(m), 0.0)
    while True:
        # --- rest: straight to the next uplift or slip
        if m[FAMILY] == FLAT and m[FLOOR] == STICK and still:
            limit = b.sin_alpha / b.cos_alpha
            if not b.no_slip:
                limit = min(limit, b.mu_s)
            if zero_steps > 0:  # rest goes on: what exceeds its limit is noise
                limit += _BEYOND
            # After an exceedance that is over within an instant it looks from there on.
            after = t if zero_steps == 0 else t + INSTANT
            until = next_exceedance(gh, after, -np.inf if m[FAR] != 0 else -limit, np.inf if m[TIP] != 0 else limit)
            if math.isnan(t_rest):
                t_rest = t
            stop = min(until, t_end)
            while rows < out.shape[0] and (rows * control.output_step <= stop):
                out[rows] = z
                out_mode[rows] = 0
                rows += 1
            if until >= t_end:
                t = t_end if not control.until_decided else t
                break
            if zero_steps > _MOST_ZERO_STEPS:
                ending = NO_MODE
                break
            zero_steps = zero_steps + 1 if until <= t + 2.0 * INSTANT else 0
            t = until
            left[:] = m
            m[:] = 0  # most often it rocks
            m[FAMILY], m[S], m[FLOOR], m[PULL] = TILT, 1 if acceleration(gh, t) > 0.0 else -1, STICK, 1
            if not consistent(b, m, z, gh, gv, t, a, False):
                m[FAMILY], m[S] = FLAT, corner
                if not select(b, z, gh, gv, t, left, m, a):
                    ending = NO_MODE
                    break
            t_rest = np.nan
            events += 1
            if log.shape[0] >= events:
                _note(log, events, t, SLIPS if m[FAMILY] == FLAT else UPLIFT, 0, mode_code(m), 0.0)
            continue
        if t >= t_end:
            break
        if control.until_decided:
            ahead = 0.0 if t >= quiet else (impulse_ahead(gh, t) if still else math.inf)
            verdict = _decided(b, m, z, ahead, peak)
            if verdict <= 0.0 and ahead > 0.0 and abs(z[THETA]) > b.alpha:
                verdict = _falls(b, m, z, gh, t, still)
            if verdict > 0.0:
                peak = verdict
                if peak >= 0.5 * math.pi:
                    ending = OVERTURNED
                    z[THETA] = math.copysign(peak, z[THETA])
                break
        if steps >= control.most_steps:
            ending = TOO_MANY_STEPS
            break
        # --- one step of the series, to its end or to the first event in it
        steps += 1
        end = min(min(next_kink(gh, t), next_kink(gv, t)), t_end)
        reach = end - t
        order, pivot, h = _expand(b, m, z, gh, gv, t, reach, control, a)
        tau, which = _first_event(b, m, order, pivot, h, guards_of(b, m), a, stack)
        waits = zero_steps >= _HANDED_OVER and tau <= 0.0 and which > G_FAR_GAP and not waits
        if waits:
            # Modes that hand over to each other at one instant differ by rounding: any will do for a little while.
            zero_steps += 1
            h = min(h, INSTANT * 2.0 ** (0.5 * (zero_steps - _HANDED_OVER)))
            tau, which = _first_event(b, m, order, pivot, h, guards_of(b, m) & _OPEN_CONTACTS, a, stack)
        if not math.isfinite(tau) or zero_steps > _MOST_ZERO_STEPS:
            ending = NO_MODE if math.isfinite(tau) else NOT_FINITE
            break
        until = t + tau if which >= 0 or tau < reach else end
        while rows < out.shape[0] and rows * control.output_step < until:
            if m[FAMILY] == FLAT:
                flat_state(b, m, order, rows * control.output_step - t, a, out[rows])
            else:
                tilt_state(b, m, order, rows * control.output_step - t, pivot, a, out[rows])
            out_mode[rows] = mode_code(m)
            rows += 1
        if m[FAMILY] == FLAT:
            flat_state(b, m, order, tau, a, z)
        else:
            if a[OMEGA, 0] > 0.0 and value(a, OMEGA, order - 1, tau) < 0.0:
                top = first_root(a, OMEGA, order - 1, tau, POSITION_NOISE, stack)
                if top > 0.0:
                    peak = max(peak, value(a, PHI, order, top))
            tilt_state(b, m, order, tau, pivot, a, z)
        if which < 0 and tau >= reach:
            t = end
        else:
            t += tau
        peak = max(peak, abs(z[THETA]))
        swing = max(swing, abs(z[W]))
        if which < 0:
            zero_steps = zero_steps if waits or tau < _PASSED else 0
            continue
        # --- an event
        if which > G_FAR_GAP and m[FAMILY] == TILT and abs(z[THETA]) < 1e-13 and m[S] * z[W] < -CLOSED_RATE:
            which = G_PHI  # whatever else happens at that instant, the block lands
        zero_steps = zero_steps + 1 if tau <= 0.0 else 0
        if which == G_PHI and gv.kind != STILL and not b.unilateral:
            past = _grazes(b, m, z, order, tau, h, 10.0 * control.tolerance * swing * swing, a)
            if past > 0.0:
                t += past
                tilt_state(b, m, order, tau + past, pivot, a, z)
                z[THETA] = math.copysign(max(abs(z[THETA]), 2.0 * POSITION_NOISE), float(m[S]))
                continue
        swing = 0.0
        events += 1
        if zero_steps > _MOST_ZERO_STEPS:
            ending = NO_MODE
            break
        if events >= control.most_events:
            ending = TOO_MANY_EVENTS
            break
        if which == G_TOPPLE:
            ending = OVERTURNED
            z[THETA] = math.copysign(0.5 * math.pi, z[THETA])
            peak = 0.5 * math.pi
            if log.shape[0] >= events:
                _note(log, events, t, LEFT if m[S] > 0 else RIGHT, mode_code(m), mode_code(m), 0.0)
            break
        before = mode_code(m)
        left[:] = m
        if m[FAMILY] == FLAT:
            m[S] = corner
        else:
            corner = m[S]
        impulse[:] = 0.0
        strikes = which == G_TIP_GAP or which == G_FAR_GAP or which == G_LANDING or which == G_PHI
        if strikes:
            resting = resting_speed(rattle, t, base_rest, zero_steps)
            kind, found, known = _impact(b, m, z, which, gh, t, resting, impulse, gains)
            wall_impacts += kind == WALL_IMPACT
            if not known:
                left[:] = -9
                found = found and select(b, z, gh, gv, t, left, m, a)
        else:
            kind = _release(b, m, z, which)
            found = select(b, z, gh, gv, t, left, m, a)
            if not found and zero_steps < _MOST_ZERO_STEPS:
                m[:] = left  # none follows, but for rounding: it goes on for a little while
                zero_steps, found = max(zero_steps, _HANDED_OVER), True
        if not found:
            ending = NO_IMPACT if strikes else NO_MODE
            break
        if strikes and b.unilateral and impulse[0] + impulse[1] == 0.0:
            events -= 1  # nothing was struck: a block in flight passes theta = 0
        elif log.shape[0] >= events:
            _note(log, events, t, kind, before, mode_code(m), impulse[0] + impulse[1])
            if strikes and mode_code(m) == 0 and log.shape[0] > events:
                events += 1
                _note(log, events, t, SETTLED, before, 0, 0.0)
    at_rest = m[FAMILY] == FLAT and m[FLOOR] == STICK
    if ending == DONE and not math.isfinite(z[THETA]):
        ending = NOT_FINITE
    if ending == DONE and not control.until_decided:
        while rows < out.shape[0]:
            out[rows] = z
            out_mode[rows] = mode_code(m)
            rows += 1
    return Tally(ending, t, peak, at_rest, steps, events, wall_impacts, int(gains[0]), gains[1], rows, t_rest)


@inner_kernel
def _expand(b, m, z, gh, gv, t, reach, control, a):
    """Series of the mode's motion about t: their order, the place of a sticking pivot, and the step they are good for."""
    if m[FAMILY] == FLAT:
        order = flat_series(b, m, z, gh, gv, t, control.order, a)
        return order, 0.0, _step_size(a, U, G, order, control.tolerance, reach)
    # A motion that is still tiny, and may grow, keeps its digits.
    enough = 1e-2 * control.tolerance * min(1.0, 1e2 * (abs(z[THETA]) + abs(z[W])))
    order = tilt_series(b, m, z, gh, gv, t, control.order, enough, reach, a)
    h = reach
    if order == control.order:
        h = _step_size(a, PHI, COS, order, control.tolerance, reach)
        if m[FLOOR] != STICK or m[TIP] != 0 or m[FAR] != 0:
            h = _step_size(a, XI, Y, order, control.tolerance, h)
        if m[FLOOR] != STICK or m[TIP] != 0 or m[FAR] != 0 or gv.kind != STILL:
            h = _step_size(a, U, G, order, control.tolerance, h)  # forces follow the base acceleration
    return order, m[S] * z[X] - a[SIN, 0], h


@inner_kernel
def _first_event(b, m, order, pivot, h, mask, a, stack):
    """The first time within the step at which a guard among `mask` ends the mode, and which; h and -1 where none does."""
    rocks = m[FAMILY] == TILT and m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0
    if rocks and m[PULL] > 0 and rock_guards_hold(b, order, b.walls, h, a):
        tau = first_root(a, PHI, order, h, POSITION_NOISE, stack)
        return (h, -1) if tau == NO_ROOT else (tau, G_PHI)
    tau, which = h, -1
    for k in range(GUARDS):
        degree = guard(b, m, k, order, pivot, a) if mask >> k & 1 else -1
        if degree >= 0:
            root = first_root(a, GUARD, degree, h, noise_of(m, k), stack)  # in h, not tau: the mirror image has another order
            if root != NO_ROOT and root < tau:
                tau, which = root, k
    if which >= G_PUSH and which != G_SLIP and tau > 0.25 * h:
        # A force is the second derivative of a truncated series: its zero is found to rounding from nearby only.
        return 0.9 * tau, -1
    return tau, which


@inner_kernel
def resting_speed(rattle, t, base, zero_steps):
    """The speed below which a contact that is struck at time t stays closed: `base`, unless it rattles, or did all at once.

    `rattle` keeps that speed, when the count of impacts began, the last impact, the count, and how often it was full.
    """
    resting, since, last, count, full = rattle
    if t - last > _QUIET_TIME:
        resting, full = base, 0.0
    if t - since > _RATTLE_TIME:
        since, count = t, 0.0
    count += 1.0
    if count >= _RATTLE_IMPACTS:
        count, full = 0.0, full + 1.0
        resting = min(10.0 * resting, _RATTLE_BOUND) if full < _RATTLES else np.inf
    rattle[0], rattle[1], rattle[2], rattle[3], rattle[4] = resting, since, t, count, full
    return resting if zero_steps < _HANDED_OVER else np.inf


@inner_kernel
def _impact(b, m, z, which, gh, t, resting, impulse, gains):
    """Resolves the impact at the closing of a gap: the event's kind, whether a law fits, and whether m is already right."""
    wall = which == G_TIP_GAP or which == G_FAR_GAP
    _touch(b, m, z, which)
    if which == G_FAR_GAP and m[FAMILY] == TILT and abs(z[THETA]) < _LANDED and m[S] * z[W] < 0.0 and closed_floor(b, z):
        which, wall = G_PHI, False  # the corner meets the wall as the block lands: a floor event
    if which == G_PHI:
        _upright(b, m, z)
    found, known = True, False
    if b.unilateral:
        found = _strike(b, m, z, gh, t, resting, impulse, gains)
    elif wall:
        known = _wall_impact(b, m, z, which == G_TIP_GAP, gh, t, resting, impulse, gains)
    else:
        known = _floor_impact(b, m, z, impulse)
    if not known and not b.unilateral and abs(slip_velocity(b, z)) < CREEP:
        z[VX] = -math.cos(b.alpha - abs(z[THETA])) * z[W]
    if z[THETA] == 0.0 and abs(z[W]) < SETTLE_SPIN:
        v = slip_velocity(b, z)
        z[VX] = v if abs(v) > max(resting, 4.0 * SETTLE_SPIN) else 0.0  # along a wall the spin that does not count slips too
        z[W] = 0.0
        if abs(z[HEIGHT] - b.cos_alpha) < _TOUCH and z[VY] < resting:
            z[VY] = 0.0
        known = False
    return WALL_IMPACT if wall else (LANDS if which == G_LANDING else FLOOR_IMPACT), found, known


@inner_kernel
def _release(b, m, z, which):
    """Prepares the state for a change of mode without impact, and names it."""
    if which == G_SLIP:
        if m[TIP] != 0 or m[FAR] != 0:
            z[W] = z[VX] = z[VY] = 0.0
        z[VX] = -math.cos(b.alpha - abs(z[THETA])) * z[W] if m[FAMILY] == TILT else 0.0
        return STICKS
    if which == G_CONE_PLUS or which == G_CONE_MINUS:
        return SLIPS
    if which == G_UPLIFT_PLUS or which == G_UPLIFT_MINUS:
        return UPLIFT
    return LIFT_OFF if which == G_PUSH and b.unilateral else RELEASE


@inner_kernel
def _note(log, count, t, kind, before, after, impulse):
    row = log[count - 1]
    row[0], row[1], row[2], row[3], row[4] = t, kind, before, after, impulse


@inner_kernel
def _step_size(a, first, second, order, tolerance, reach):
    """The step at which the last two terms of the series stay below the tolerance, at most `reach`.

    In a step shorter than the unit of time the error of the velocity, h times fewer, is the larger one.
    """
    longest = math.inf  # its logarithm
    for k in (order, order - 1):
        size = abs(a[first, k]) + abs(a[second, k])
        if size > 0.0:
            spare = math.log(tolerance / size)
            longest = min(longest, spare / k if spare > 0.0 else spare / (k - 1))
    return min(reach, math.exp(longest))


@inner_kernel
def _touch(b, m, z, which):
    """Puts the block onto the contact whose gap has just closed: the series knows the gap to the tolerance only.

    A standing pivot keeps its place where the rotation can give way (else it would creep, impact by impact).
    """
    phi = abs(z[THETA])
    if which == G_LANDING:
        z[HEIGHT] = math.cos(b.alpha - phi)
    elif which == G_TIP_GAP and m[FAMILY] == TILT and m[FLOOR] == STICK:
        sign = float(m[S])
        pivot = sign * z[X] - math.sin(b.alpha - phi)
        gap = sign * z[X] + delta(b, m, True) - math.sin(b.alpha + phi)
        phi += gap / (math.cos(b.alpha - phi) + math.cos(b.alpha + phi))
        z[X], z[HEIGHT], z[THETA] = sign * (pivot + math.sin(b.alpha - phi)), math.cos(b.alpha - phi), sign * phi
    elif which == G_TIP_GAP or which == G_FAR_GAP:
        left = (which == G_TIP_GAP) == (m[FAMILY] == FLAT or m[S] > 0)
        gap = b.gap_left if left else b.gap_right
        x = math.sin(b.alpha + phi) - b.sin_alpha - gap
        z[X] = x if left else -x


@inner_kernel
def _grazes(b, m, z, order, tau, h, energy, a):
    """Time after which a block that comes down hanging, with less energy than is known, has turned back; 0 if it lands.

    Left at rest as the floor falls away, a block swings back to just where it started, which nothing tells from a touch.
    """
    if m[TIP] != 0 or m[FAR] != 0 or value(a, G, order, tau) >= 0.0:
        return 0.0
    back = slope(a, OMEGA, order - 1, tau)
    past = 2.0 * abs(z[W]) / back
    return past if z[W] * z[W] < energy * min(1.0, 10.0 * back) and 0.0 < past <= h - tau else 0.0


@inner_kernel
def _upright(b, m, z):
    """Sets theta from nearly to exactly zero, the pivot keeping its place; a side that then touches a wall touches it exactly."""
    sign = float(m[S])
    phi = sign * z[THETA]
    z[X] += sign * (b.sin_alpha - math.sin(b.alpha - phi))
    if m[FLOOR] != OFF or closed_floor(b, z):
        z[HEIGHT] = b.cos_alpha
    z[THETA] = 0.0
    left, right = abs(z[X] + b.gap_left), abs(b.gap_right - z[X])
    if left < _FLUSH and left < right:
        z[X] = -b.gap_left
    elif right < _FLUSH and right < left:
        z[X] = b.gap_right


@inner_kernel
def _floor_impact(b, m, z, impulse):
    """Bilateral pivot: the block lands at theta = 0. Returns whether it is already known to rock on in m."""
    w1, v1 = z[W], slip_velocity(b, z)
    s, c = b.sin_alpha, b.cos_alpha
    S1 = m[S]
    if m[TIP] != 0 or m[FAR] != 0:  # from LADDER: every contact plastic, flush rest
        z[W] = z[VX] = z[VY] = 0.0
        return False
    ahead = b.gap_right if S1 > 0 else b.gap_left
    e = b.e_right if S1 > 0 else b.e_left
    if ahead < np.inf and -S1 * z[X] + ahead < 1e-9:
        # Flush with the wall toward which it would rock: it keeps its pivot (the paper is silent).
        z[W] = -e * (1.0 - 1.5 * s * s) * w1
        v2 = -e * v1 if -S1 * v1 < 0.0 else v1
        z[VX] = v2 - c * z[W]
        z[VY] = S1 * s * z[W]
        return False
    form, w2, v2, p = impacts.floor_impact(s, c, S1, w1, v1, b.mu_s if not b.no_slip else np.inf, b.mu_k)
    impulse[0] = p
    z[W] = w2
    z[VX] = v2 - c * w2
    z[VY] = -S1 * s * w2
    if form == impacts.STICK and abs(w2) > SETTLE_SPIN:
        m[:] = 0
        m[FAMILY], m[S], m[FLOOR], m[PULL] = TILT, -S1, STICK, 1
        return True
    return False


@inner_kernel
def _wall_impact(b, m, z, tip, gh, t, resting, impulse, gains):
    """Bilateral pivot: a corner (case I, II) or the side (case III) strikes a wall. Returns whether m is already right."""
    phi = abs(z[THETA])
    space = b.gap_left + b.gap_right - 2.0 * (math.sin(b.alpha + phi) - b.sin_alpha)
    if space < _TOUCH or m[TIP] != 0 or m[FAR] != 0:  # wedged: between both walls at once nothing rebounds
        z[W] = z[VX] = z[VY] = 0.0
        return False
    if m[FAMILY] == FLAT:
        e = b.e_left if tip else b.e_right
        impulse[1] = (1.0 + e) * abs(z[VX])
        z[VX] = -e * z[VX] if e * abs(z[VX]) > resting else 0.0
        return False
    sign = float(m[S])
    e = b.e_left if (m[S] > 0) == tip else b.e_right
    sw = 1.0 if tip else -1.0
    s, c, cp = math.sin(b.alpha - phi), math.cos(b.alpha - phi), math.cos(b.alpha + phi)
    w1, xdot1 = sign * z[W], sign * z[VX]
    before = xdot1 * xdot1 + (s * w1) ** 2 + w1 * w1 / 3.0
    branch, w2, xdot2, n, p, v2 = impacts.wall_impact(1.0, sw, s, c, cp, w1, xdot1, e, b.mu_s, b.mu_k, b.no_slip)
    after = xdot2 * xdot2 + (s * w2) ** 2 + w2 * w2 / 3.0
    if after > before * (1.0 + 1e-12) + 1e-18:
        gains[0] += 1.0
        gains[1] = max(gains[1], after / before - 1.0)
    impulse[0], impulse[1] = abs(p), n
    C = sw * cp
    rebound = sw * (xdot2 - C * w2)
    stays = e == 0.0 and branch != impacts.B_STICK and branch != impacts.E_SLIP
    stays = stays or rebound < resting
    if stays:
        xdot2 = C * w2
    if abs(xdot2 + c * w2) < CREEP:
        xdot2 = -c * w2
    z[W], z[VX], z[VY] = sign * w2, sign * xdot2, s * w2
    flush = phi == 0.0 and stays and -resting < sw * xdot2 + c * w2 < 0.0  # its side: the other corner follows
    if (b.no_slip and stays) or flush:
        z[W] = z[VX] = z[VY] = 0.0
    gap = sign * sw * z[X] + (b.gap_left if sign * sw > 0 else b.gap_right)
    if abs(w2) < _FLUSH_SPIN and abs(v2) < _FLUSH_SPEED and abs(gap) < _FLUSH_GAP and _presses(b, gh, t, sign * sw):
        z[THETA] = z[W] = z[VX] = z[VY] = 0.0
        z[HEIGHT] = b.cos_alpha
        z[X] = -b.gap_left if sign * sw > 0 else b.gap_right
        return False
    if not stays and v2 == 0.0:
        m[:] = 0
        m[FAMILY], m[S], m[FLOOR], m[PULL] = TILT, int(sign), STICK, 1
        return True
    return False


@inner_kernel
def _presses(b, gh, t, side):
    """Whether the base acceleration holds a flush block against the wall on `side` beyond what would lift or slide it."""
    level = side * acceleration(gh, t)
    return level > min(b.sin_alpha / b.cos_alpha, b.mu_s)


@kernel
def _strike(b, m, z, gh, t, resting, impulse, gains):
    """Unilateral: resolves all contacts touched at this instant. Returns False where no impact law fits."""
    sign = float(tips_first(b, m, z, gh, t) if m[FAMILY] == FLAT else m[S])
    phi = abs(z[THETA])
    c, reach = math.cos(b.alpha - phi), math.sin(b.alpha + phi)
    flat = z[THETA] == 0.0
    touching = np.zeros(CONTACTS, dtype=np.bool_)
    touching[F] = abs(z[HEIGHT] - c) < _TOUCH
    touching[E] = flat and touching[F]
    tip = b.gap_left if sign > 0 else b.gap_right
    far = b.gap_right if sign > 0 else b.gap_left
    touching[TIP_TOP] = tip < np.inf and abs(sign * z[X] + b.sin_alpha + tip - reach) < _TOUCH
    touching[TIP_BOTTOM] = flat and touching[TIP_TOP]
    touching[FAR_BOTTOM] = far < np.inf and abs(b.sin_alpha + far - sign * z[X] - reach) < _TOUCH
    touching[FAR_TOP] = flat and touching[FAR_BOTTOM]
    v = np.zeros(3)
    v[0], v[1], v[2] = sign * z[VX], z[VY], sign * z[W]
    e_tip = b.e_left if sign > 0 else b.e_right
    e_far = b.e_right if sign > 0 else b.e_left
    if touching[TIP_TOP] and touching[FAR_BOTTOM]:
        e_tip = e_far = 0.0  # between both walls at once nothing rebounds
    found = contact_impact(b, phi, touching, e_tip, e_far, resting, v, impulse, gains)
    z[VX], z[VY], z[W] = sign * v[0], v[1], sign * v[2]
    if touching[F] and abs(slip_velocity(b, z)) < CREEP:
        z[VX] = -c * z[W]
    return found


@inner_kernel
def _decided(b, m, z, ahead, peak):
    """The final peak rotation (>= pi/2: overturns) if the rest of the motion is certain, else -1.

    `ahead` bounds the integral of |u| to come, I. The energy E of block and floor, counted from standing, grows by no other
    work: dE/dt <= |u| sqrt(2 E), so that sqrt(2 E) grows by at most I. A block that can never reach the energy of standing on
    its corner cannot overturn: it is safe once that energy cannot lift it above the peak it has had. After the excitation a
    block that only rocks conserves its energy up to its next impact, so that its peak is known at once.
    """
    phi = abs(z[THETA])
    if ahead > 0.0 and (b.walls or phi >= peak):
        return -1.0
    energy = 0.5 * (z[VX] * z[VX] + z[VY] * z[VY] + z[W] * z[W] / 3.0) + z[HEIGHT] - b.cos_alpha
    corner = 1.0 - b.cos_alpha
    most = 0.5 * (math.sqrt(2.0 * max(energy, 0.0)) + ahead) ** 2
    margin = 0.9 if b.walls else 1.0  # the wall cascade may add a little energy
    rocks = m[FAMILY] == TILT and m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0 and not b.walls and ahead == 0.0
    rocks = rocks and (b.no_slip or _sticks_for_good(b, energy))
    if most < corner and phi < b.alpha:
        highest = b.alpha - math.acos(min(b.cos_alpha + most, 1.0))
        if rocks:
            return max(peak, highest if m[S] * z[W] > 0.0 else phi)
        return max(peak, 1e-300) if highest <= peak and most < margin * corner else -1.0
    if rocks and m[S] * z[W] >= 0.0 and (phi > b.alpha or energy > corner):
        return 0.5 * math.pi
    return -1.0


@inner_kernel
def _falls(b, m, z, gh, t, still):
    """pi/2 if a block past its balance point falls whatever the rest of the excitation does, else -1.

    Turning outward, beyond tan(phi - alpha) > mu and > |u| for all time to come, it is accelerated outward in every mode:
    sticking by (3), slipping by (7), by an impulse of the floor, or not at all in flight. Walls it could meet are left out.
    """
    phi = abs(z[THETA])
    if not still or m[FAMILY] == FLAT or m[S] * z[W] < 0.0 or (b.gap_left if m[S] > 0 else b.gap_right) < np.inf:
        return -1.0
    steepness = math.tan(phi - b.alpha)
    if (not b.no_slip and steepness <= b.mu_s) or steepness <= abs(acceleration(gh, t)) or steepness <= largest_ahead(gh, t):
        return -1.0
    return 0.5 * math.pi


@inner_kernel
def _sticks_for_good(b, energy):
    """Whether a pivot cannot slip in free rocking of this energy (up to its balance point), impacts included.

    |Q| <= max(3/4 s c, s w^2) and P >= 1 - 3/4 s^2 - w^2, with w^2 <= 3/2 energy; the landing sticks if
    mu >= 3 t/(4 + t^2), t = tan alpha.
    """
    s, c = b.sin_alpha, b.cos_alpha
    square = 1.5 * energy
    push = 1.0 - 0.75 * s * s - square
    # s c rises with s only up to 45 degrees.
    pull = 0.75 * (s * c if b.alpha < 0.25 * math.pi else 0.5)
    t = s / c
    return push > 0.0 and b.mu_s * push >= max(pull, s * square) and b.mu_s >= 3.0 * t / (4.0 + t * t)
