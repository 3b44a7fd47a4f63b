"""The guards of a mode: what must not turn negative as long as it lasts.

Contact forces that push, friction inside the cone, slip that keeps its direction, open contacts
that stay open. A guard is a linear combination of the series of a step (positions and forces) or of
their rates; GUARDS lists them, and a table in the workspace holds the weights that a mode gives
them. The first root of a guard is an event; the signs with which they leave zero select the mode
(see ebm.core.modes).

How to add a guard:

1. `ebm.core.names`: a member of `Guard`. Its place is its priority at one instant, and up to
   FAR_GAP a guard is a gap, whose end is an impact. No other name in `ebm` may be the same.
2. A line in `GUARDS`, and in `fill_guards` its constant and weights, positive as long as the mode
   may last.
3. `rock_guards_hold`: ROCK takes a short cut past the table, so that a guard of ROCK is bounded
   there, too.
4. `ebm.core.coulomb._change` names the event by the modes before and after it. A new one is a
   member of `Event` with a line in `EVENT_NAMES`, and stands in the glossary.

A guard ends its mode, and takes part in the choice of the next one (`modes.constraint_violation`):
it is not negative in a mode that may begin. What only tells, as the passing of an angle, is no
guard: `ebm.core.steps.advance` finds the top of a swing so, by a root of its own, and `note` writes
it.
"""

import math

import numpy as np

from rockcheck.ebm.core import contacts, lanes, series
from rockcheck.ebm.core.block import LEAST_FRICTION, side_of, wall_turn
from rockcheck.ebm.core.names import Family, Guard, Kind, Pivot, Row
from rockcheck.ebm.core.state import on_wall, rocks
from rockcheck.scenes.compiled import inner_kernel

#: Each guard: what it is, how many terms fewer than the order it has, and the series that it
#: combines, in the order of its weights. A rate is that of its combination.
GUARDS: dict[int, tuple[int, ...]] = {
    Guard.PHI: (Kind.POSITION, 0, Row.PHI),
    Guard.TOPPLE: (Kind.POSITION, 0, Row.PHI),
    Guard.LANDING: (Kind.POSITION, 0, Row.COS, Row.Y),
    Guard.TIP_GAP: (Kind.POSITION, 0, Row.SIN, Row.COS, Row.XI),
    Guard.FAR_GAP: (Kind.POSITION, 0, Row.SIN, Row.COS, Row.XI),
    Guard.FLOOR_PUSH: (Kind.FORCE, 2, Row.P),
    Guard.TIP_PUSH: (Kind.FORCE, 2, Row.Q, Row.NA),
    Guard.FAR_PUSH: (Kind.FORCE, 2, Row.NB),
    Guard.CONE_PLUS: (Kind.FORCE, 2, Row.P, Row.Q),
    Guard.CONE_MINUS: (Kind.FORCE, 2, Row.P, Row.Q),
    Guard.SLIP: (Kind.RATE, 1, Row.PHI, Row.SIN, Row.XI),
    Guard.UPLIFT_PLUS: (Kind.FORCE, 2, Row.P, Row.Q),
    Guard.UPLIFT_MINUS: (Kind.FORCE, 2, Row.P, Row.Q),
    Guard.LOADS: (Kind.POSITION, 1, Row.Z),
}
KIND, _SHORTER = np.array([GUARDS[which][:2] for which in range(len(GUARDS))]).T.copy()
_MOST = max(map(len, GUARDS.values())) - 2
# The series that a guard combines. The guard itself fills the empty places: it has no weight.
_COMBINES = np.array(
    [[*GUARDS[which][2:], *[Row.GUARD] * _MOST][:_MOST] for which in range(len(GUARDS))]
)
# The columns of the table: the weight of each series, and a constant.
_CONSTANT = Row.GUARD + 1
#: A force is the second derivative of a truncated series: its zero is found to rounding from nearby
#: only, within this share of a step.
_NEARBY = 0.25
#: The weight with which the noise of forces hides no base acceleration: nothing is rounded in it.
#: Its square is finite, too.
_ANY = 2.0**400


@inner_kernel
def _enter(a, which, constant, *weights):
    """Enters a guard into the table: its constant, and the weights of its series (see GUARDS)."""
    row = Row.TABLE + which
    for k in range(_MOST):
        a[row, _COMBINES[which, k]] = weights[k] if k < len(weights) else 0.0
    a[row, _CONSTANT], a[Row.THERE, which] = constant, 1.0


@inner_kernel
def drop(a, which):
    """Removes a guard from the table."""
    a[Row.THERE, which] = 0.0


@inner_kernel
def fill_guards(block, state, a):
    """Writes the guards of the mode into the table."""
    mode = state.mode
    a[Row.THERE, :] = 0.0
    _fill_gap(block, state, a, True)
    _fill_gap(block, state, a, False)
    if mode.family == Family.FLAT:
        _fill_flat(block, state, a)
        return
    _enter(a, Guard.PHI, 0.0, 1.0)
    # Else no step on the floor is long enough to turn the block over.
    if a[Row.PHI, 0] >= 0.5 or mode.pivot == Pivot.OFF:
        _enter(a, Guard.TOPPLE, 0.5 * math.pi, -1.0)
    if mode.pivot == Pivot.OFF:
        _enter(a, Guard.LANDING, 0.0, -1.0, 1.0)
    else:
        _fill_friction(block, state, block.mu_s * mode.pull, 0.0, a)
    slip = float(mode.slip)
    if mode.pivot == Pivot.SLIPPING and on_wall(mode):
        # Along a wall V = (c + C) dtheta/dt, and C = -c at theta = 0: the rotation tells the sense
        # of slip everywhere.
        _enter(a, Guard.SLIP, 0.0, slip, 0.0, 0.0)
    elif mode.pivot == Pivot.SLIPPING:
        _enter(a, Guard.SLIP, 0.0, 0.0, -slip, slip)
    if mode.tip != 0:
        _enter(a, Guard.TIP_PUSH, 0.0, 0.0, 1.0)
    if mode.far != 0:
        _enter(a, Guard.FAR_PUSH, 0.0, 1.0)


@inner_kernel
def _fill_friction(block, state, mu, constant, a):
    """The floor's push, and the two sides of the friction cone |Q| <= mu P + constant.

    Where a pivot that winds (Bouc-Wen's) unloads, z comes to the sense of slip.
    """
    mode, flat = state.mode, state.mode.family == Family.FLAT
    # The paper's floor holds a flat block that no wall holds.
    pushes = on_wall(mode) or mode.pull < 0 if flat else mode.pivot == Pivot.SLIPPING
    if block.unilateral or pushes:
        _enter(a, Guard.FLOOR_PUSH, 0.0, float(mode.pull))
    if mode.pivot == Pivot.STICK and not block.no_slip:
        _enter(a, Guard.CONE_PLUS, constant, mu, -1.0)
        _enter(a, Guard.CONE_MINUS, constant, mu, 1.0)
    if state.winds and mode.slip * a[Row.Z, 0] <= -series.NOISE[Kind.POSITION]:
        _enter(a, Guard.LOADS, 0.0, -float(mode.slip))


@inner_kernel
def _fill_gap(block, state, a, tip):
    """The clear gap of the corner that faces the tip wall, +-xi + delta - s', or the far wall.

    For a flat block the tip wall is the left one.
    """
    mode, pivot = state.mode, state.place
    which, sense = (Guard.TIP_GAP, 1.0) if tip else (Guard.FAR_GAP, -1.0)
    faces = side_of(block, sense * mode.sense)
    if (mode.tip if tip else mode.far) != 0 or faces.gap == np.inf:
        return
    if mode.family == Family.FLAT:
        _enter(a, which, faces.gap, 0.0, 0.0, sense)
        return
    distance = faces.arm + faces.gap
    along, across = wall_turn(side_of(block, mode.sense), tip)
    if not rocks(mode):
        _enter(a, which, distance, across, -along, sense)
        return
    # About a fixed pivot the far gap shrinks with phi, down to this value as the block lands: it
    # cannot close before.
    landed = distance - pivot - (block.left.arm + block.right.arm)
    if tip or not landed > -contacts.CLOSED:
        # xi is s and a constant.
        _enter(a, which, distance + sense * pivot, across + sense, -along, 0.0)


@inner_kernel
def _fill_flat(block, state, a):
    """The guards of a translating block; tip means the left wall, far the right one."""
    mode = state.mode
    hangs = mode.pivot != Pivot.OFF and mode.pull < 0  # a floor that pulls at what a wall holds
    if mode.tip != mode.far and (mode.pivot == Pivot.OFF or hangs):
        # On the floor, Q is the base acceleration that the wall takes; off it there is none.
        _enter(a, Guard.TIP_PUSH, 0.0, float(mode.tip - mode.far), 1.0)
    if mode.pivot == Pivot.OFF:
        _enter(a, Guard.LANDING, -block.height, 0.0, 1.0)
        return
    if mode.pivot == Pivot.SLIPPING:
        _enter(a, Guard.SLIP, 0.0, 0.0, 0.0, float(mode.slip))
    # A force below rounding is to stay what it is where P vanishes.
    least = block.mu_s == LEAST_FRICTION
    mu, constant = (0.0, block.mu_s) if least else (block.mu_s, 0.0)
    _fill_friction(block, state, mu, constant, a)
    _fill_uplift(block, mode, hangs, True, a)
    _fill_uplift(block, mode, hangs, False, a)


@inner_kernel
def _fill_uplift(block, mode, hangs, plus, a):
    """The guard against a tilt to one side, unless a wall holds the block there."""
    held = (mode.tip if plus else mode.far) != 0
    if mode.pivot != Pivot.STICK or not held:
        # A block that hangs by both corners tips as soon as anything favours one side, however
        # little.
        hangs_flat = hangs and not on_wall(mode)
        arm = block.left.arm if plus else block.right.arm
        moment = (-block.height if plus else block.height) * (_ANY if hangs_flat else 1.0)
        uplift = Guard.UPLIFT_PLUS if plus else Guard.UPLIFT_MINUS
        _enter(a, uplift, 0.0, 0.0 if hangs_flat else arm, moment)
    if held or hangs:
        drop(a, Guard.CONE_PLUS if plus else Guard.CONE_MINUS)


@inner_kernel
def _coefficients(which, half, a):
    """Eight coefficients, from `half` on, of a guard of the table, without its constant.

    A series without weight need not be there.
    """
    row, sum, rate = Row.TABLE + which, lanes.zeros(), KIND[which] == Kind.RATE
    for part in range(_MOST):
        source = _COMBINES[which, part]
        if a[row, source] != 0.0:
            sum = sum + a[row, source] * lanes.load(a, source, half + rate)
    return sum * (lanes.ramp() + (half + 1.0)) if rate else sum


@inner_kernel
def guard(which, order, a):
    """Writes a guard that the mode has into the workspace; returns its degree."""
    for half in range(0, order + 1, lanes.LANES):
        lanes.store(a, Row.GUARD, half, _coefficients(which, half, a))
    a[Row.GUARD, 0] += a[Row.TABLE + which, _CONSTANT]
    if Guard.LANDING <= which <= Guard.FAR_GAP:
        a[Row.GUARD, 0], a[Row.GUARD, 1] = contacts.closed_gap(a[Row.GUARD, 0], a[Row.GUARD, 1])
    return order - _SHORTER[which]


@inner_kernel
def _with_slack(which, slack, a):
    """The noise allowed to the guard in the workspace, in a mode with this slack.

    An open contact is not noise.

    A gap that touches without speed may close by the noise. That takes time, so that the events of
    one instant come to an end.
    """
    if KIND[which] != Kind.POSITION:
        return slack * series.NOISE[KIND[which]]
    if (
        slack == 1.0
        or which == Guard.PHI
        or abs(a[Row.GUARD, 0]) > contacts.CLOSED
        or a[Row.GUARD, 1] < -contacts.SLOW
    ):
        return min(slack * series.NOISE[Kind.POSITION], contacts.CLOSED)
    a[Row.GUARD, 0] += contacts.CLOSED
    return series.NOISE[Kind.POSITION]


@inner_kernel
def seen(kind, smooth):
    """How far ahead a guard of this kind is judged, the base motion being smooth for `smooth`.

    Forces follow the base acceleration at once, and the series does not know it beyond its next
    kink. Positions change little at one.
    """
    return min(series.AHEAD, smooth) if kind == Kind.FORCE else series.AHEAD


@inner_kernel
def _stays_positive(which, order, until, slack, a):
    """A cheap proof, without writing the guard, that it is positive up to a time.

    It starts higher than it falls.
    """
    row = Row.TABLE + which
    if a[Row.THERE, which] == 0.0:
        return True
    if KIND[which] == Kind.RATE:
        return False
    degree = order - _SHORTER[which]
    low = lanes.upto(_coefficients(which, 0, a), degree)
    high = lanes.upto(_coefficients(which, lanes.LANES, a), degree - lanes.LANES)
    begin = a[row, _CONSTANT] + lanes.first(low)
    return (
        begin > max(slack * series.NOISE[KIND[which]], contacts.CLOSED)
        and -series.least_change(low, high, until) < 0.999999 * begin
    )


@inner_kernel
def _past_a_touch(which, degree, times, noise, a):
    """Where a force in the workspace that dips below zero by less than the noise is positive again.

    By its parabola; where it does not only touch, its root. `times` are that root and the step. The
    two roots of a touch are known less well than an INSTANT apart.
    """
    root, h = times
    if KIND[which] != Kind.FORCE or not 0.0 < root <= _NEARBY * h:
        return root
    begin = series.value(a, Row.GUARD, degree, root)
    fall = series.slope(a, Row.GUARD, degree, root)
    half_bend, power = 0.0, 1.0
    for k in range(2, degree + 1):
        half_bend += 0.5 * k * (k - 1) * a[Row.GUARD, k] * power
        power *= root
    touches = fall < 0.0 and fall * fall < 4.0 * half_bend * (begin + noise)
    return root + max(-fall / half_bend, series.INSTANT) if touches else root


@inner_kernel
def first_event(run):
    """The first time within the step at which a guard ends the mode, and which guard.

    Where none does, the step's length and Guard.NONE. A gap that closes within an INSTANT of the
    event replaces it: contacts before forces.
    """
    state, a = run.state, run.a
    order, h, slack = state.order, state.length, state.slack
    tau, which = h, Guard.NONE
    for k in range(len(KIND)):
        if _stays_positive(k, order, tau, slack, a):
            continue
        degree = guard(k, order, a)
        noise = _with_slack(k, slack, a)
        # Compared in h, not tau: a mirror image has its guards in another order.
        root = series.first_root(a, Row.GUARD, degree, h, tau, noise, seen(KIND[k], h), run.stack)
        if math.isnan(root):
            tau, which = root, k
            break
        gap = 0 <= which <= Guard.FAR_GAP < k
        if root == series.NO_ROOT or root >= (tau - series.INSTANT if gap else tau):
            continue
        past = _past_a_touch(k, degree, (root, h), noise, a)
        if past < tau:
            tau, which = past, k if past == root else Guard.NONE
    if which >= 0 and KIND[which] == Kind.FORCE and tau > _NEARBY * h:
        tau, which = 0.9 * tau, Guard.NONE
    state.tau, state.guard = tau, which


@inner_kernel
def rock_guards_hold(block, run):
    """A cheap proof that a rocking block keeps every guard of ROCK but Guard.PHI through a step h.

    False where it proves nothing.

    The floor's guards are bounded as the others are. Inside the cone the floor pushes.
    """
    order, h, a = run.state.order, run.state.length, run.a
    if a[Row.PHI, 0] > 0.5:
        return False
    for which in (Guard.TIP_GAP, Guard.FAR_GAP):
        drop(a, which)
        _fill_gap(block, run.state, a, which == Guard.TIP_GAP)
        if not _stays_positive(which, order, h, 1.0, a):
            return False
    if block.no_slip and not block.unilateral:
        return True
    mu, share = (1.0, 0.0) if block.no_slip else (block.mu_s, 1.0)
    p_low, p_high = series.halves(a, Row.P, order - 2)
    q_low, q_high = series.halves(a, Row.Q, order - 2)
    plus = series.least_change(mu * p_low + -share * q_low, mu * p_high + -share * q_high, h)
    minus = series.least_change(mu * p_low + share * q_low, mu * p_high + share * q_high, h)
    push, pull = mu * a[Row.P, 0], share * a[Row.Q, 0]
    return min(push - pull + plus, push + pull + minus) > series.NOISE[Kind.FORCE]
