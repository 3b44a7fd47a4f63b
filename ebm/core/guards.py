"""The guards of a mode: what must not turn negative as long as it lasts.

Contact forces that push, friction inside the cone, slip that keeps its direction, open contacts
that stay open. A guard is a linear combination of the series of a step (positions and forces) or of
their rates; GUARDS lists them, and a table in the workspace holds the weights that a mode gives
them. The first root of a guard is an event; the signs with which they leave zero select the mode
(see ebm.core.modes).
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.contacts import CLOSED, SLOW, closed_gap
from rockcheck.ebm.core.lanes import (
    LANES,
    above,
    falls,
    load,
    powers,
    ramp,
    store,
    total,
    upto,
    zeros,
)
from rockcheck.ebm.core.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    LEAST_FRICTION,
    NA,
    NB,
    OFF,
    PHI,
    PULL,
    SIN,
    SLIP,
    SLIPPING,
    STICK,
    TABLE,
    TIP,
    XI,
    P,
    Q,
    S,
    Y,
    delta,
    side_of,
)
from rockcheck.ebm.core.series import (
    AHEAD,
    FORCE,
    INSTANT,
    NO_ROOT,
    NOISE,
    POSITION,
    RATE,
    eighth,
    first_root,
    halves,
    leads_up,
    least_change,
    slope,
    value,
)
from rockcheck.scenes.compiled import inner_kernel

# In order of priority at one instant: floor before walls, contacts before friction.
(
    G_PHI,
    G_TOPPLE,
    G_LANDING,
    G_TIP_GAP,
    G_FAR_GAP,
    G_PUSH,
    G_TIP_PUSH,
    G_FAR_PUSH,
    G_CONE_PLUS,
    G_CONE_MINUS,
    G_SLIP,
    G_UPLIFT_PLUS,
    G_UPLIFT_MINUS,
    G_LOADS,
) = range(14)
GUARDS = 14
# What a guard is; a rate is the rate of its combination.
KIND = np.array((POSITION,) * 5 + (FORCE,) * 5 + (RATE,) + (FORCE,) * 2 + (POSITION,))
# The series that a guard can combine. The guard itself fills the empty places: it has no weight.
_COMBINES = np.array(
    [(PHI, GUARD, GUARD)] * 2
    + [(COS, Y, GUARD)]
    + [(SIN, COS, XI)] * 2
    + [(P, GUARD, GUARD), (Q, NA, GUARD), (NB, GUARD, GUARD)]
    + [(P, Q, GUARD)] * 2
    + [(PHI, SIN, XI)]
    + [(P, Q, GUARD)] * 2
    + [(GUARD, GUARD, GUARD)]
)
_MOST = 3
# The columns of the table: the weight of each series, a constant, and how many terms fewer than the
# order the guard has (-1: no guard).
_CONSTANT, _SHORTER = 30, 31
#: A force is the second derivative of a truncated series: its zero is found to rounding from nearby
#: only, within this share of a step.
_NEARBY = 0.25
#: The weight with which the noise of forces hides no base acceleration: nothing is rounded in it.
#: Its square is a number, too.
_ANY = 2.0**400


@inner_kernel
def _has(a, which, shorter):
    """Enters a guard into the table: so many terms shorter than the series, its weights and its
    constant still zero."""
    row = TABLE + which
    for k in range(_MOST):
        a[row, _COMBINES[which, k]] = 0.0
    a[row, _CONSTANT], a[row, _SHORTER] = 0.0, shorter


@inner_kernel
def drop(a, which):
    """Removes a guard from the table."""
    a[TABLE + which, _SHORTER] = -1.0


@inner_kernel
def fill_guards(b, m, pivot, a):
    """Writes the guards of mode m into the table; `pivot` is the place of a sticking pivot."""
    for which in range(GUARDS):
        drop(a, which)
    if m[FAMILY] == FLAT:
        _fill_flat(b, m, a)
        return
    _has(a, G_PHI, 0)
    a[TABLE + G_PHI, PHI] = 1.0
    if (
        a[PHI, 0] >= 0.5 or m[FLOOR] == OFF
    ):  # else no step on the floor is long enough to turn the block over
        _has(a, G_TOPPLE, 0)
        a[TABLE + G_TOPPLE, PHI], a[TABLE + G_TOPPLE, _CONSTANT] = -1.0, 0.5 * math.pi
    if m[FLOOR] == OFF:
        _has(a, G_LANDING, 0)
        a[TABLE + G_LANDING, Y], a[TABLE + G_LANDING, COS] = 1.0, -1.0
    else:
        _fill_friction(b, m, b.mu_s * m[PULL], a)
    if m[FLOOR] == SLIPPING:
        _has(a, G_SLIP, 1)
        along_wall = m[TIP] != 0 or m[FAR] != 0
        # Along a wall V = (c + C) dtheta/dt, and C = -c at theta = 0: the rotation tells the sense
        # of slip everywhere.
        a[TABLE + G_SLIP, PHI if along_wall else XI] = m[SLIP]
        a[TABLE + G_SLIP, SIN] = 0.0 if along_wall else -m[SLIP]
    if b.walls:
        _fill_gap(b, m, True, pivot, a)
        _fill_gap(b, m, False, pivot, a)
        if m[TIP] != 0:
            _has(a, G_TIP_PUSH, 2)
            a[TABLE + G_TIP_PUSH, NA] = 1.0
        if m[FAR] != 0:
            _has(a, G_FAR_PUSH, 2)
            a[TABLE + G_FAR_PUSH, NB] = 1.0


@inner_kernel
def _fill_friction(b, m, mu, a):
    """The floor's push, and the two sides of the friction cone |Q| <= mu P."""
    if b.unilateral or m[FLOOR] == SLIPPING:
        _has(a, G_PUSH, 2)
        a[TABLE + G_PUSH, P] = m[PULL]
    if m[FLOOR] == STICK and not b.no_slip:
        _has(a, G_CONE_PLUS, 2)
        _has(a, G_CONE_MINUS, 2)
        a[TABLE + G_CONE_PLUS, P] = a[TABLE + G_CONE_MINUS, P] = mu
        a[TABLE + G_CONE_PLUS, Q], a[TABLE + G_CONE_MINUS, Q] = -1.0, 1.0


@inner_kernel
def _fill_gap(b, m, tip, pivot, a):
    """The clear gap of the corner that faces the tip wall, +-xi + delta - s', or the far wall."""
    which = G_TIP_GAP if tip else G_FAR_GAP
    distance = delta(b, m, tip)
    if m[TIP if tip else FAR] != 0 or distance == np.inf:
        return
    sense = 1.0 if tip else -1.0
    rock = m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0
    if rock and not tip and distance - pivot - (b.left.arm + b.right.arm) > -CLOSED:
        # About a fixed pivot the far gap shrinks with phi, down to this value as the block lands:
        # it cannot close before.
        return
    _has(a, which, 0)
    row, side = TABLE + which, side_of(b, m[S])
    along, across = (side.tip_sin, side.tip_cos) if tip else (side.far_sin, side.far_cos)
    a[row, COS], a[row, SIN], a[row, _CONSTANT] = -along, across, distance
    if rock:  # xi is s and a constant
        a[row, SIN] += sense
        a[row, _CONSTANT] += sense * pivot
    else:
        a[row, XI] = sense


@inner_kernel
def _fill_flat(b, m, a):
    """The guards of a translating block; the tip wall is the left one, the far wall the right
    one."""
    on_wall = m[TIP] != 0 or m[FAR] != 0
    hangs = m[FLOOR] != OFF and m[PULL] < 0  # a floor that pulls at what a wall holds
    for wall in (G_TIP_GAP, G_FAR_GAP):
        gap = b.gap_left if wall == G_TIP_GAP else b.gap_right
        if gap < np.inf and m[TIP if wall == G_TIP_GAP else FAR] == 0:
            _has(a, wall, 0)
            a[TABLE + wall, XI] = 1.0 if wall == G_TIP_GAP else -1.0
            a[TABLE + wall, _CONSTANT] = gap
    if m[TIP] != m[FAR] and (
        m[FLOOR] == OFF or hangs
    ):  # on the floor, Q is the base acceleration that the wall takes
        _has(a, G_TIP_PUSH, 2)
        a[TABLE + G_TIP_PUSH, NA if m[FLOOR] == OFF else Q] = (
            1.0 if m[FLOOR] == OFF else m[TIP] - m[FAR]
        )
    if m[FLOOR] == OFF:
        _has(a, G_LANDING, 0)
        a[TABLE + G_LANDING, Y], a[TABLE + G_LANDING, _CONSTANT] = 1.0, -b.height
        return
    if m[FLOOR] == SLIPPING:
        _has(a, G_SLIP, 1)
        a[TABLE + G_SLIP, XI] = m[SLIP]
    if (
        b.mu_s == LEAST_FRICTION
    ):  # a force below rounding, which is to stay what it is where P vanishes
        _fill_friction(b, m, 0.0, a)
        a[TABLE + G_CONE_PLUS, _CONSTANT] = a[TABLE + G_CONE_MINUS, _CONSTANT] = b.mu_s
    else:
        _fill_friction(b, m, b.mu_s, a)
    drop(a, G_PUSH)
    if b.unilateral or on_wall or hangs:  # otherwise the paper's floor holds what no wall does
        _has(a, G_PUSH, 2)
        a[TABLE + G_PUSH, P] = m[PULL]
    for plus in (True, False):
        held = m[TIP if plus else FAR] != 0
        uplift = G_UPLIFT_PLUS if plus else G_UPLIFT_MINUS
        if m[FLOOR] != STICK or not held:
            # A block that hangs by both corners tips as soon as anything favours one side, however
            # little.
            hangs_flat = hangs and not on_wall
            _has(a, uplift, 2)
            a[TABLE + uplift, P] = 0.0 if hangs_flat else (b.left.arm if plus else b.right.arm)
            a[TABLE + uplift, Q] = (-b.height if plus else b.height) * (_ANY if hangs_flat else 1.0)
        if held or hangs:
            drop(a, G_CONE_PLUS if plus else G_CONE_MINUS)


@inner_kernel
def _coefficients(which, half, a):
    """Eight coefficients, from `half` on, of a guard of the table, without its constant. A series
    without weight need not be there."""
    row, sum, rate = TABLE + which, zeros(), KIND[which] == RATE
    for part in range(_MOST):
        series = _COMBINES[which, part]
        if a[row, series] != 0.0:
            sum = sum + a[row, series] * load(a, series, half + rate)
    return sum * (ramp() + (half + 1.0)) if rate else sum


@inner_kernel
def guard(which, order, a):
    """Writes a guard of the table into the workspace and returns its degree, or -1 where the mode
    has no such guard."""
    row = TABLE + which
    if a[row, _SHORTER] < 0.0:
        return -1
    for half in (0, LANES):
        store(a, GUARD, half, _coefficients(which, half, a))
    a[GUARD, 0] += a[row, _CONSTANT]
    if G_LANDING <= which <= G_FAR_GAP:
        a[GUARD, 0], a[GUARD, 1] = closed_gap(a[GUARD, 0], a[GUARD, 1])
    return order - int(a[row, _SHORTER])


@inner_kernel
def _with_slack(which, slack, a):
    """The noise allowed to the guard in the workspace, in a mode with this slack. An open contact
    is not noise.

    A gap that touches without speed may close by the noise. That takes time, so that the events of
    one instant come to an end.
    """
    if KIND[which] != POSITION:
        return slack * NOISE[KIND[which]]
    if slack == 1.0 or which == G_PHI or abs(a[GUARD, 0]) > CLOSED or a[GUARD, 1] < -SLOW:
        return min(slack * NOISE[POSITION], CLOSED)
    a[GUARD, 0] += CLOSED
    return NOISE[POSITION]


@inner_kernel
def seen(kind, smooth):
    """How far ahead a guard of this kind is judged where the base motion is smooth for the time
    `smooth`.

    Forces follow the base acceleration at once, and the series does not know it beyond its next
    kink. Positions change little at one.
    """
    return min(AHEAD, smooth) if kind == FORCE else AHEAD


@inner_kernel
def _coefficient(which, k, a):
    """Coefficient k of a guard of the table that is no rate, without its constant."""
    row, one, two, three = (
        TABLE + which,
        _COMBINES[which, 0],
        _COMBINES[which, 1],
        _COMBINES[which, 2],
    )
    return a[row, one] * a[one, k] + a[row, two] * a[two, k] + a[row, three] * a[three, k]


@inner_kernel
def starts_positive(which, ahead, a):
    """A cheap proof, without writing the guard, that it leaves zero upward, seen so far ahead; a
    mode without it has nothing to prove."""
    row = TABLE + which
    if a[row, _SHORTER] < 0.0:
        return True
    if KIND[which] == RATE:
        return False
    begin = _coefficient(which, 0, a) + a[row, _CONSTANT]
    floor = (
        max(NOISE[KIND[which]], CLOSED) if G_LANDING <= which <= G_FAR_GAP else NOISE[KIND[which]]
    )
    return leads_up(begin, _coefficient(which, 1, a), _coefficient(which, 2, a), floor, ahead)


@inner_kernel
def _stays_positive(which, order, until, slack, a):
    """A cheap proof, without writing the guard, that it is positive up to a time: more so than the
    sum of all its terms that fall."""
    row = TABLE + which
    if a[row, _SHORTER] < 0.0:
        return True
    if KIND[which] == RATE:
        return False
    begin, degree = a[row, _CONSTANT] + _coefficient(which, 0, a), order - int(a[row, _SHORTER])
    low, high = (
        upto(_coefficients(which, 0, a), degree),
        upto(_coefficients(which, LANES, a), degree - LANES),
    )
    fallen = total((above(falls(low), 0) + falls(high) * eighth(until)) * powers(until))
    return begin > max(slack * NOISE[KIND[which]], CLOSED) and -fallen < 0.999999 * begin


@inner_kernel
def _past_a_touch(degree, root, noise, a):
    """Where the guard in the workspace is positive again if it falls below zero by less than the
    noise, by its parabola; else the root.

    The two roots of a touch are known less well than an INSTANT apart.
    """
    begin, fall, half_bend, power = (
        value(a, GUARD, degree, root),
        slope(a, GUARD, degree, root),
        0.0,
        1.0,
    )
    for k in range(2, degree + 1):
        half_bend += 0.5 * k * (k - 1) * a[GUARD, k] * power
        power *= root
    touches = fall < 0.0 and fall * fall < 4.0 * half_bend * (begin + noise)
    return root + max(-fall / half_bend, INSTANT) if touches else root


@inner_kernel
def first_event(order, h, slack, a, stack):
    """The first time within the step at which a guard ends the mode, and which; h and -1 where none
    does.

    A gap that closes within an INSTANT of it is the event: contacts before forces.
    """
    tau, which = h, -1
    for k in range(GUARDS):
        if _stays_positive(k, order, tau, slack, a):
            continue
        degree = guard(k, order, a)
        if degree >= 0:
            noise = _with_slack(k, slack, a)
            # Compared in h, not tau: a mirror image has its guards in another order.
            root = first_root(a, GUARD, degree, h, tau, noise, seen(KIND[k], h), stack)
            if math.isnan(root):
                return root, k
            closes = 0 <= which <= G_FAR_GAP < k
            if root != NO_ROOT and root < tau - (INSTANT if closes else 0.0):
                past = (
                    _past_a_touch(degree, root, noise, a)
                    if KIND[k] == FORCE and 0.0 < root <= _NEARBY * h
                    else root
                )
                if past == root:
                    tau, which = root, k
                elif past < tau:
                    tau, which = past, -1
    if which >= 0 and KIND[which] == FORCE and tau > _NEARBY * h:
        return 0.9 * tau, -1
    return tau, which


@inner_kernel
def rock_guards_hold(b, m, pivot, order, h, a):
    """A cheap proof that a rocking block keeps every guard of ROCK but G_PHI through a step h.
    False where it proves nothing.

    Each guard is bounded from below as in `first_root`, without being written. Inside the cone the
    floor pushes.
    """
    if a[PHI, 0] > 0.5:
        return False
    if b.walls:
        for which in (G_TIP_GAP, G_FAR_GAP):
            drop(a, which)
            _fill_gap(b, m, which == G_TIP_GAP, pivot, a)
            if a[TABLE + which, _SHORTER] == 0.0 and not _rock_gap_holds(
                TABLE + which, order, h, a
            ):
                return False
    if b.no_slip and not b.unilateral:
        return True
    mu, share = (1.0, 0.0) if b.no_slip else (b.mu_s, 1.0)
    p_low, p_high = halves(a, P, order - 2)
    q_low, q_high = halves(a, Q, order - 2)
    plus = least_change(mu * p_low + -share * q_low, mu * p_high + -share * q_high, h)
    minus = least_change(mu * p_low + share * q_low, mu * p_high + share * q_high, h)
    push, pull = mu * a[P, 0], share * a[Q, 0]
    return min(push - pull + plus, push + pull + minus) > NOISE[FORCE]


@inner_kernel
def _rock_gap_holds(row, order, h, a):
    """Whether a bound on the gap that this row of the table gives to ROCK shows it open through a
    step h."""
    along, across = a[row, COS], a[row, SIN]
    cos_low, cos_high = halves(a, COS, order)
    sin_low, sin_high = halves(a, SIN, order)
    low = least_change(along * cos_low + across * sin_low, along * cos_high + across * sin_high, h)
    return along * a[COS, 0] + across * a[SIN, 0] + a[row, _CONSTANT] + low > CLOSED
