"""When a mode ends, and which mode follows.

A mode is consistent as long as its *guards* are not negative: contact forces that push, friction inside the cone, slip
that keeps its direction, open contacts that stay open. The same guards, as Taylor polynomials, are the events of a step
(their first root) and the test that selects the next mode (the sign with which they leave zero), so that a selected mode
can never end at once. Applied to the bilateral pivot this selection is the paper's: its rules for uplift and slip
(Shenton's map among them), for the tilted block and for the corner that stays on the wall come out as the one consistent
candidate; tests hold the closed forms against it.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.ground import acceleration
from rockcheck.ebm.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    HEIGHT,
    LEAST_FRICTION,
    LOOSE,
    NA,
    NB,
    OFF,
    OMEGA,
    PHI,
    PULL,
    SIN,
    SLIP,
    SLIPPING,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    VY,
    XI,
    P,
    Q,
    S,
    W,
    X,
    Y,
    delta,
    flat_series,
    tilt_series,
)
from rockcheck.ebm.series import FORCE_NOISE, MOST_TERMS, POSITION_NOISE, RATE_NOISE, leading
from rockcheck.scenes.compiled import inner_kernel

# The guards, in the order in which ties are decided: floor before walls, contacts before friction.
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
) = range(13)
GUARDS = 13

# A contact is closed if its gap and its gap's rate are below these (natural units).
CLOSED_GAP = 1e-10
CLOSED_RATE = 1e-9
# A pivot that slips more slowly than this stands, if it can: so little is rounding of an impact, or of a mode that just began.
CREEP = 1e-10
# So soon a base acceleration that is zero shows where it goes (samples of a record may be much nearer than AHEAD).
SOON = 1e-6


@inner_kernel
def guards_of(b, m):
    """The guards that mode m may have, as bits: what a scene or a mode does not need is not looked at."""
    walls = 1 << G_TIP_GAP | 1 << G_FAR_GAP | 1 << G_TIP_PUSH | 1 << G_FAR_PUSH if b.walls else 0
    push = 1 << G_PUSH if b.unilateral or m[FLOOR] == SLIPPING or m[FAMILY] == FLAT else 0
    if m[FLOOR] == OFF:
        floor = 1 << G_LANDING
    elif m[FLOOR] == SLIPPING:
        floor = push | 1 << G_SLIP
    else:
        floor = push if b.no_slip else push | 1 << G_CONE_PLUS | 1 << G_CONE_MINUS
    if m[FAMILY] == FLAT:
        return walls | floor | 1 << G_UPLIFT_PLUS | 1 << G_UPLIFT_MINUS
    return walls | floor | 1 << G_PHI | 1 << G_TOPPLE


@inner_kernel
def guard(b, m, which, order, pivot, a):
    """Writes guard `which` of mode m into the workspace and returns its degree, or -1 where the mode has no such guard."""
    if m[FAMILY] == FLAT:
        return _flat_guard(b, m, which, order, a)
    if which == G_PHI:
        for k in range(order + 1):
            a[GUARD, k] = a[PHI, k]
        return order
    if which == G_TOPPLE:
        if a[PHI, 0] < 0.5 and m[FLOOR] != OFF:  # no step on the floor is long enough to turn the block over from here
            return -1
        for k in range(order + 1):
            a[GUARD, k] = -a[PHI, k]
        a[GUARD, 0] += 0.5 * math.pi
        return order
    if which == G_LANDING:
        if m[FLOOR] != OFF:
            return -1
        for k in range(order + 1):
            a[GUARD, k] = a[Y, k] - a[COS, k]
        _settle_touch(a)
        return order
    if which == G_TIP_GAP or which == G_FAR_GAP:
        return _gap(b, m, which == G_TIP_GAP, order, pivot, a)
    if which == G_PUSH:
        if m[FLOOR] == OFF or not (b.unilateral or m[FLOOR] == SLIPPING):
            return -1
        for k in range(order - 1):
            a[GUARD, k] = m[PULL] * a[P, k]
        return order - 2
    if which == G_TIP_PUSH or which == G_FAR_PUSH:
        if m[TIP if which == G_TIP_PUSH else FAR] == 0:
            return -1
        for k in range(order - 1):
            a[GUARD, k] = a[NA if which == G_TIP_PUSH else NB, k]
        return order - 2
    if which == G_CONE_PLUS or which == G_CONE_MINUS:
        if m[FLOOR] != STICK or b.no_slip:
            return -1
        sense = 1.0 if which == G_CONE_PLUS else -1.0
        for k in range(order - 1):
            a[GUARD, k] = b.mu_s * m[PULL] * a[P, k] - sense * a[Q, k]
        return order - 2
    if which == G_SLIP:
        if m[FLOOR] != SLIPPING:
            return -1
        for k in range(order):
            # Along a wall V = (c + C) dtheta/dt, and C = -c at theta = 0: the rotation tells the sense of slip everywhere.
            v = (k + 1) * (a[XI, k + 1] - a[SIN, k + 1]) if m[TIP] == 0 and m[FAR] == 0 else a[OMEGA, k]
            a[GUARD, k] = m[SLIP] * v
        return order - 1
    return -1


@inner_kernel
def _gap(b, m, tip, order, pivot, a):
    """The clear gap of the corner that faces the tip wall, or the far wall."""
    if m[TIP if tip else FAR] != 0:
        return -1
    distance = delta(b, m, tip)
    if distance == np.inf:
        return -1
    sense = 1.0 if tip else -1.0
    rock = m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0
    if rock and not tip and distance - pivot - 2.0 * b.sin_alpha > -CLOSED_GAP:
        # About a fixed pivot the far gap shrinks with phi, down to this value as the block lands: it cannot close before.
        return -1
    xi = SIN if rock else XI
    for k in range(order + 1):
        a[GUARD, k] = sense * a[xi, k] - (b.sin_2alpha * a[COS, k] - b.cos_2alpha * a[SIN, k])
    a[GUARD, 0] += distance + (sense * pivot if rock else 0.0)
    _settle_touch(a)
    return order


@inner_kernel
def _settle_touch(a):
    """A contact that touches and closes more slowly than CLOSED_RATE counts as resting: its acceleration decides."""
    if a[GUARD, 0] <= -CLOSED_GAP or a[GUARD, 0] >= 1e-12:
        return
    if -CLOSED_RATE < a[GUARD, 1] < 0.0:
        a[GUARD, 0] = a[GUARD, 1] = 0.0
    elif a[GUARD, 0] < 0.0:
        a[GUARD, 0] = 0.0


@inner_kernel
def _flat_guard(b, m, which, order, a):
    """The guards of a translating block; the tip wall is the left one, the far wall the right one."""
    if which == G_LANDING:
        if m[FLOOR] != OFF:
            return -1
        for k in range(order + 1):
            a[GUARD, k] = a[Y, k]
        a[GUARD, 0] -= b.cos_alpha
        return order
    if which == G_TIP_GAP or which == G_FAR_GAP:
        gap = b.gap_left if which == G_TIP_GAP else b.gap_right
        if gap == np.inf or m[TIP if which == G_TIP_GAP else FAR] != 0:
            return -1
        sense = 1.0 if which == G_TIP_GAP else -1.0
        for k in range(order + 1):
            a[GUARD, k] = sense * a[XI, k]
        a[GUARD, 0] += gap
        return order
    if which == G_TIP_PUSH:
        if (m[FLOOR] != OFF and m[PULL] > 0) or m[TIP] == m[FAR]:
            return -1
        for k in range(order - 1):  # on the floor, Q is the base acceleration that the wall takes
            a[GUARD, k] = a[NA, k] if m[FLOOR] == OFF else (m[TIP] - m[FAR]) * a[Q, k]
        return order - 2
    if m[FLOOR] == OFF:
        return -1
    if which == G_PUSH:
        if not b.unilateral and m[TIP] == 0 and m[FAR] == 0:
            return -1
        for k in range(order - 1):
            a[GUARD, k] = m[PULL] * a[P, k]
        return order - 2
    if which == G_CONE_PLUS or which == G_CONE_MINUS:
        if m[FLOOR] != STICK or b.no_slip or m[PULL] < 0 or m[TIP if which == G_CONE_PLUS else FAR] != 0:
            return -1
        sense = 1.0 if which == G_CONE_PLUS else -1.0
        for k in range(order - 1):
            a[GUARD, k] = b.mu_s * a[P, k] - sense * a[Q, k]
        if b.mu_s == LEAST_FRICTION:  # a force below rounding, which is to stay what it is where P vanishes
            for k in range(order - 1):
                a[GUARD, k] = (b.mu_s if k == 0 else 0.0) - sense * a[Q, k]
        return order - 2
    if which == G_UPLIFT_PLUS or which == G_UPLIFT_MINUS:
        if m[FLOOR] == STICK and m[TIP if which == G_UPLIFT_PLUS else FAR] != 0:
            return -1
        sense = 1.0 if which == G_UPLIFT_PLUS else -1.0
        for k in range(order - 1):
            a[GUARD, k] = b.sin_alpha * a[P, k] - sense * b.cos_alpha * a[Q, k]
        return order - 2
    if which == G_SLIP:
        if m[FLOOR] != SLIPPING:
            return -1
        for k in range(order):
            a[GUARD, k] = m[SLIP] * (k + 1) * a[XI, k + 1]
        return order - 1
    return -1


@inner_kernel
def rock_guards_hold(b, order, pivot_walls, h, a):
    """A cheap proof that a rocking block keeps every guard of ROCK but G_PHI through a step h, or False where it is open.

    Each guard is bounded from below by its value now less the sum of its other terms.
    """
    if pivot_walls or a[PHI, 0] > 0.5:
        return False
    if b.no_slip and not b.unilateral:
        return True
    spread = 0.0
    push = 0.0
    for k in range(order - 2, 0, -1):
        spread = (spread + b.mu_s * abs(a[P, k]) + abs(a[Q, k])) * h
        push = (push + abs(a[P, k])) * h
    return b.mu_s * a[P, 0] - abs(a[Q, 0]) > spread and a[P, 0] > push


@inner_kernel
def noise_of(m, which):
    """The rounding noise of a guard of mode m: it is a position, a velocity or a force."""
    times = _LOOSER if m[LOOSE] != 0 else 1.0
    if which <= G_FAR_GAP:
        return times * POSITION_NOISE
    return times * (RATE_NOISE if which == G_SLIP else FORCE_NOISE)


_OTHER, _SAME, _CREEPING, _STANDING, _LOOSE = range(5)  # attempts of a selection
_LOOSER = 10.0  # times their noise that the guards of a loose mode may be negative
_LOOK = 6  # order of the series that a selection looks at


@inner_kernel
def consistent(b, m, z, gh, gv, t, a, creeping):
    """Whether mode m can begin at state z: every guard leaves zero upward, and what must begin to move does."""
    look = min(_LOOK, MOST_TERMS)  # the plain constant would make numba compile all series once more, for it alone
    if m[FAMILY] == FLAT:
        order = flat_series(b, m, z, gh, gv, t, look, a)
        pivot = 0.0
    else:
        order = tilt_series(b, m, z, gh, gv, t, look, 0.0, 0.0, a)
        pivot = m[S] * z[X] - a[SIN, 0]
    mask = guards_of(b, m)
    for which in range(GUARDS):
        degree = guard(b, m, which, order, pivot, a) if mask >> which & 1 else -1
        if degree < 0:
            continue
        if which <= G_FAR_GAP and a[GUARD, 1] < -CLOSED_RATE:
            continue  # not this mode's fault: an impact comes next
        sign = leading(a, GUARD, degree, noise_of(m, which))
        if sign < 0 or not math.isfinite(a[GUARD, 0]):
            return False
        if sign == 0 and ((which == G_SLIP and not creeping) or (which == G_PHI and m[FLOOR] != OFF)):
            return False
    return True


@inner_kernel
def slip_velocity(b, z):
    """V of the lower corner."""
    return z[VX] + math.cos(b.alpha - abs(z[THETA])) * z[W]


@inner_kernel
def closed_wall(b, z, side, lower):
    """Whether the corner facing the wall on `side` (+1 left, -1 right) rests on it.

    A tilted block has one such corner; `lower` picks, at theta = 0, the corner that keeps touching while it tilts away.
    """
    gap = b.gap_left if side > 0 else b.gap_right
    if gap == np.inf:
        return False
    phi = side * z[THETA]  # positive: tips toward that wall, top corner
    clear = side * z[X] + b.sin_alpha + gap - math.sin(b.alpha + abs(phi))
    arm = math.cos(b.alpha + abs(phi))
    if phi < 0.0 or (phi == 0.0 and lower):
        arm = -arm
    rate = side * (z[VX] - arm * z[W])
    return abs(clear) < CLOSED_GAP and abs(rate) < CLOSED_RATE


@inner_kernel
def closed_floor(b, z):
    """Whether the lower corner rests on the floor."""
    phi = abs(z[THETA])
    rate = z[VY] - math.sin(b.alpha - phi) * (z[W] if z[THETA] > 0.0 or (z[THETA] == 0.0 and z[W] > 0.0) else -z[W])
    return abs(z[HEIGHT] - math.cos(b.alpha - phi)) < CLOSED_GAP and abs(rate) < CLOSED_RATE


@inner_kernel
def select(b, z, gh, gv, t, left, m, a):
    """Writes into m the mode that is consistent at state z, and returns whether there is one.

    Larger contact sets come first, sticking before slipping. `left`, the mode that has just ended, is taken again only where no
    other one fits, a slip that does not begin only where that does not either, and what fits but for ten times the noise last.
    """
    if abs(z[THETA]) < 1e-13 and abs(z[W]) < CLOSED_RATE and z[THETA] != 0.0:
        v = slip_velocity(b, z)
        z[THETA] = z[W] = 0.0  # upright and still but for rounding
        z[VX] = v if abs(v) > CLOSED_RATE else 0.0
    flat = z[THETA] == 0.0 and z[W] == 0.0
    floor = closed_floor(b, z) or not b.unilateral
    if floor and abs(slip_velocity(b, z)) < CREEP:
        z[VX] = -math.cos(b.alpha - abs(z[THETA])) * z[W]
    stands = floor and b.walls and z[THETA] != 0.0 and abs(z[W]) < CLOSED_RATE
    if stands and (closed_wall(b, z, 1, False) or closed_wall(b, z, -1, False)):
        z[W] = z[VX] = z[VY] = 0.0  # on floor and wall a block that does not turn stands
    first = tips_first(b, m, z, gh, t) if flat else 0
    for attempt in (_OTHER, _SAME, _CREEPING, _STANDING, _LOOSE):
        if attempt == _STANDING:
            # So slow a slip, which fits in neither sense, is noise of forces that change fast: the pivot stands.
            if flat or not floor or abs(slip_velocity(b, z)) > CLOSED_RATE:
                continue
            z[VX] = -math.cos(b.alpha - abs(z[THETA])) * z[W]
        if flat:
            if floor and z[VX] == 0.0 and not b.walls:
                # Static friction above kinetic can leave both rocking and sliding consistent: it holds as long as it can.
                m[:] = 0
                m[FLOOR], m[PULL], m[LOOSE] = STICK, 1, attempt == _LOOSE
                for family in (FLAT, TILT):
                    m[FAMILY], m[S] = family, 1 if family == FLAT else first
                    if _accept(b, m, z, gh, gv, t, left, a, attempt):
                        return True
            if _select_flat(b, z, gh, gv, t, first, floor, left, m, a, attempt):
                return True
            for sense in (first, -first):
                if _select_tilt(b, z, gh, gv, t, sense, floor, left, m, a, attempt):
                    return True
        else:
            lean = z[THETA] if z[THETA] != 0.0 else z[W]
            if _select_tilt(b, z, gh, gv, t, 1 if lean > 0.0 else -1, floor, left, m, a, attempt):
                return True
    return False


@inner_kernel
def tips_first(b, m, z, gh, t):
    """The side to which a flat block is first asked to tip, +1 left or -1 right: the sense in which all of it is calculated.

    Both fit only for rounding, or where the floor falls away faster than g under a pivot that cannot let go: then the base
    acceleration decides, now or soon, or the friction, its place between walls, the corner m[S] on which it last stood (0 where
    there was none): a mirror image does alike.
    """
    toward = acceleration(gh, t)
    if toward == 0.0:
        toward = acceleration(gh, t + SOON)
    if toward == 0.0:
        toward = -z[VX]
    if toward == 0.0 and abs(z[X]) > CLOSED_GAP:
        toward = z[X]
    if toward == 0.0 and b.gap_left != b.gap_right:
        toward = b.gap_left - b.gap_right
    if toward == 0.0:
        toward = float(-m[S])
    return 1 if toward >= 0.0 else -1


@inner_kernel
def _accept(b, m, z, gh, gv, t, left, a, attempt):
    same = True
    for k in range(m.size):
        same = same and m[k] == left[k]
    return (attempt == _LOOSE or same == (attempt == _SAME)) and consistent(b, m, z, gh, gv, t, a, attempt == _CREEPING)


@inner_kernel
def _select_flat(b, z, gh, gv, t, first, floor, left, m, a, attempt):
    m[:] = 0  # `first` is the side to which the base acceleration tips the block; it presses on that wall, slips that way
    m[FAMILY], m[S], m[PULL], m[LOOSE] = FLAT, 1, 1, attempt == _LOOSE
    at_left = b.walls and closed_wall(b, z, 1, False)
    at_right = b.walls and closed_wall(b, z, -1, False)
    if floor:
        for slip in (0, -first, first):
            if (slip == 0 and z[VX] != 0.0) or slip * z[VX] < 0.0 or (slip != 0 and b.no_slip):
                continue
            m[FLOOR], m[SLIP] = STICK if slip == 0 else SLIPPING, slip
            m[TIP], m[FAR] = at_left and slip == 0, at_right and slip == 0
            for pull in (1, -1):  # what a wall holds a floor can pull at
                m[PULL] = pull
                if pull < 0 and (b.unilateral or (m[TIP] == 0 and m[FAR] == 0)):
                    continue
                if _accept(b, m, z, gh, gv, t, left, a, attempt):
                    return True
    if b.unilateral or not floor:
        m[FLOOR], m[SLIP], m[PULL] = OFF, 0, 1
        if at_left and at_right:  # it fills the space between its walls
            m[TIP] = m[FAR] = 1
            return _accept(b, m, z, gh, gv, t, left, a, attempt)
        for press in (first, -first, 0):
            m[TIP], m[FAR] = press == 1, press == -1
            if (press == 1 and not at_left) or (press == -1 and not at_right):
                continue
            if _accept(b, m, z, gh, gv, t, left, a, attempt):
                return True
    return False


@inner_kernel
def _select_tilt(b, z, gh, gv, t, sense, floor, left, m, a, attempt):
    m[:] = 0
    m[FAMILY], m[S], m[LOOSE] = TILT, sense, attempt == _LOOSE
    tip_closed = b.walls and closed_wall(b, z, sense, False)
    far_closed = b.walls and closed_wall(b, z, -sense, True)
    for walls in (3, 1, 2, 0):
        if (walls & 1 and not tip_closed) or (walls & 2 and not far_closed):
            continue
        m[TIP], m[FAR] = walls & 1, walls >> 1
        v = sense * (slip_velocity(b, z) if walls == 0 else z[W])  # along a wall the pivot slips as the block turns
        for pull in (1, -1):  # a floor that pulls is rare
            if pull < 0 and b.unilateral:
                continue
            m[PULL] = pull
            for slip in (0, 1, -1):
                if not floor or (slip == 0 and v != 0.0) or slip * v < 0.0 or (b.no_slip and (slip != 0 or pull < 0)):
                    continue
                m[FLOOR] = STICK if slip == 0 else SLIPPING
                m[SLIP] = slip
                if _accept(b, m, z, gh, gv, t, left, a, attempt):
                    return True
        if b.unilateral or not floor:
            m[FLOOR], m[SLIP], m[PULL] = OFF, 0, 1
            if _accept(b, m, z, gh, gv, t, left, a, attempt):
                return True
    return False
