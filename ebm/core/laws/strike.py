"""What an impact does to a block: the floor impact, a wall impact, or all contacts that touch at
one instant.

The bilateral pivot follows the paper's laws (`impacts`), one impact at a time. With the unilateral
one every contact that touches takes part (`contact_impacts`). Either way slow rebounds end by the
Zeno rule (ebm.core.settle). Natural units.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.contacts import (
    CLOSED,
    SLOW,
    between_walls,
    closed_floor,
    floor_gap,
    land_upright,
    lower,
    slip_velocity,
    stand,
    stop,
    wall_gap,
)
from rockcheck.ebm.core.guards import G_FAR_GAP, G_LANDING, G_PHI, G_TIP_GAP
from rockcheck.ebm.core.laws import impacts
from rockcheck.ebm.core.laws.contact_impacts import (
    FAR_BOTTOM,
    FAR_TOP,
    FITS,
    LEAST_WRONG,
    TIP_BOTTOM,
    TIP_TOP,
    WORK,
    E,
    F,
    contact_impact,
)
from rockcheck.ebm.core.modes import tips_first
from rockcheck.ebm.core.motion import (
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    HEIGHT,
    OFF,
    PULL,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    VY,
    S,
    W,
    X,
    side_of,
)
from rockcheck.ebm.core.rules import (
    ENDLESS_STAGES,
    FLAT_LANDING,
    FLUSH_LANDING,
    LANDS_ALONG,
    LEAST_CONTRADICTION,
    SETTLES,
    WEDGED,
)
from rockcheck.ebm.core.series import NOISE, POSITION
from rockcheck.ebm.core.settle import SETTLE
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: What an impact was.
ON_FLOOR, ON_WALL, LANDING = range(3)


@inner_kernel
def rocks(m, sense):
    """Makes m the mode ROCK on the pivot of `sense`."""
    m[:] = 0
    m[FAMILY], m[S], m[FLOOR], m[PULL] = TILT, sense, STICK, 1


@inner_kernel
def strike(b, m, z, which, gh, t, resting, impulse, gains, rules, work):
    """Resolves the impact at the closing of gap `which`: what it was, and whether m is already the
    mode that follows. `work` is scratch."""
    touch(b, m, z, which)
    # Near phi = 0 the far gap goes with phi^2, so that its root says phi to the square root of
    # rounding only.
    if (
        which == G_FAR_GAP
        and m[FAMILY] == TILT
        and z[THETA] * z[THETA] < CLOSED
        and m[S] * z[W] < 0.0
        and closed_floor(b, z)
    ):
        rules[LANDS_ALONG] += 1
        which = G_PHI
    if which == G_PHI:
        land_upright(b, z, float(m[S]), m[FLOOR] != OFF or closed_floor(b, z))
    wall = which == G_TIP_GAP or which == G_FAR_GAP
    known = False
    if b.unilateral:
        _strike_by(b.law, b, m, z, gh, t, resting, impulse, gains, rules, work)
    elif wall:
        known = _wall_impact(b, m, z, which == G_TIP_GAP, resting, impulse, gains, rules)
    else:
        known = _floor_impact(b, m, z, resting, impulse, rules)
    if not known and not b.unilateral and abs(slip_velocity(b, z)) < SLOW:
        stand(b, z)
    if z[THETA] == 0.0 and abs(z[W]) < SETTLE:
        _settle_flat(b, z, resting, rules)
        known = False
    return ON_WALL if wall else (LANDING if which == G_LANDING else ON_FLOOR), known


@inner_kernel
def touch(b, m, z, which):
    """Puts the block onto the contact whose gap has just closed: the series knows the gap to the
    tolerance only.

    A standing pivot keeps its place if the rotation can take up the correction. Otherwise the pivot
    would creep, impact by impact. It stands after it, too: else it would approach the floor, or
    leave it, by as much as the correction.
    """
    phi = abs(z[THETA])
    if which == G_LANDING:
        side = lower(b, z)
        z[HEIGHT] = side.radius * math.cos(side.alpha - phi)
    elif which == G_TIP_GAP and m[FAMILY] == TILT and m[FLOOR] == STICK:
        sign, side = float(m[S]), side_of(b, m[S])
        pivot = sign * z[X] - side.radius * math.sin(side.alpha - phi)
        arms = side.radius * math.cos(side.alpha - phi) + side.top_radius * math.cos(
            side.top_alpha + phi
        )
        turned = phi + wall_gap(b, z, m[S]) / arms
        if turned > 0.0:
            s, c = (
                side.radius * math.sin(side.alpha - turned),
                side.radius * math.cos(side.alpha - turned),
            )
            z[X], z[HEIGHT], z[THETA] = sign * (pivot + s), c, sign * turned
            z[VX], z[VY] = -c * z[W], s * sign * z[W]
        else:  # past upright it would stand on its other corner, without an impact
            z[X] -= sign * wall_gap(b, z, m[S])
    elif which == G_TIP_GAP or which == G_FAR_GAP:
        side = 1 if (which == G_TIP_GAP) == (m[FAMILY] == FLAT or m[S] > 0) else -1
        z[X] -= side * wall_gap(b, z, side)


@inner_kernel
def _settle_flat(b, z, resting, rules):
    """An upright block with a spin below the settling speed lies flat. Along a wall such a spin is
    a slip, too, and is dropped with it."""
    rules[SETTLES] += 1
    v = slip_velocity(b, z)
    z[VX] = v if abs(v) > max(resting, 4.0 * SETTLE) else 0.0
    z[W] = 0.0
    if abs(floor_gap(b, z)) < CLOSED and z[VY] < resting:
        z[VY] = 0.0


@inner_kernel
def _floor_impact(b, m, z, resting, impulse, rules):
    """Bilateral pivot: the block lands at theta = 0. Returns whether it is already known to rock on
    in m."""
    w1, v1 = z[W], slip_velocity(b, z)
    S1, c = m[S], b.height
    s1, s2 = side_of(b, S1).arm, side_of(b, -S1).arm
    if m[TIP] != 0 or m[FAR] != 0:  # from LADDER: every contact plastic, flush rest
        impulse[0] = abs(z[VY])
        stop(z)
        return False
    if wall_gap(b, z, -S1) < CLOSED:
        # Flush with the wall toward which it would rock: the closed branch of "moreau" (the paper
        # is silent).
        rules[FLUSH_LANDING] += 1
        e = b.e_right if S1 > 0 else b.e_left
        impulse[0] = (1.0 + e) * s1 * abs(w1)
        z[W] = -e * w1 if e * abs(w1) > resting else 0.0
        z[VX] = (-e * v1 if S1 * v1 > 0.0 else v1) - c * z[W]
        z[VY] = S1 * s1 * z[W]
        return False
    form, w2, v2, p = impacts.floor_impact(
        b, S1, w1, v1, b.mu_s if not b.no_slip else np.inf, b.mu_k
    )
    impulse[0] = p
    z[W], z[VX], z[VY] = w2, v2 - c * w2, -S1 * s2 * w2
    if form == impacts.STICK and abs(w2) > SETTLE:
        rocks(m, -S1)
        return True
    return False


@inner_kernel
def _wall_impact(b, m, z, tip, resting, impulse, gains, rules):
    """Bilateral pivot: a corner (case I, II) or the side (case III) strikes a wall. Returns whether
    m is already right."""
    if (
        between_walls(b, z) or m[TIP] != 0 or m[FAR] != 0
    ):  # wedged: between both walls at once nothing rebounds
        rules[WEDGED] += 1
        impulse[1] = abs(z[VX])
        stop(z)
        return False
    left = tip if m[FAMILY] == FLAT else (m[S] > 0) == tip
    e = b.e_left if left else b.e_right
    if m[FAMILY] == FLAT:
        impulse[1] = (1.0 + e) * abs(z[VX])
        z[VX] = -e * z[VX] if e * abs(z[VX]) > resting else 0.0
        return False
    return _corner_impact(b, m, z, 1.0 if tip else -1.0, e, resting, impulse, gains)


@inner_kernel
def _corner_impact(b, m, z, sw, e, resting, impulse, gains):
    """The paper's cascade for the corner at the tip wall (sw = 1) or the far wall (-1), in the
    pivot's frame."""
    phi, sign = abs(z[THETA]), float(m[S])
    side, other = side_of(b, m[S]), side_of(b, -m[S])
    s, c = side.radius * math.sin(side.alpha - phi), side.radius * math.cos(side.alpha - phi)
    cp = (
        side.top_radius * math.cos(side.top_alpha + phi)
        if sw > 0.0
        else other.radius * math.cos(other.alpha + phi)
    )
    w1, xdot1 = sign * z[W], sign * z[VX]
    before = xdot1 * xdot1 + (s * w1) ** 2 + w1 * w1 / b.spin
    branch, w2, xdot2, n, p, v2 = impacts.wall_impact(
        1.0, sw, s, c, cp, side.share, b.spin, w1, xdot1, e, b.mu_s, b.mu_k, b.no_slip
    )
    impulse[0], impulse[1] = abs(p), n
    count_gain(before, xdot2 * xdot2 + (s * w2) ** 2 + w2 * w2 / b.spin, gains)
    C = sw * cp
    stays = e == 0.0 and branch != impacts.B_STICK and branch != impacts.E_SLIP
    stays = stays or sw * (xdot2 - C * w2) < resting
    if stays:
        xdot2 = C * w2
    if abs(xdot2 + c * w2) < SLOW:
        xdot2 = -c * w2
    z[W], z[VX], z[VY] = sign * w2, sign * xdot2, s * w2
    flush = (
        phi == 0.0 and stays and -resting < sw * xdot2 + c * w2 < 0.0
    )  # its side: the other corner follows
    if (b.no_slip and stays) or flush:
        stop(z)
    if not stays and v2 == 0.0:
        rocks(m, m[S])
        return True
    return False


@inner_kernel
def count_gain(before, after, gains):
    """Counts an impact that added energy; `gains` keeps their number and the largest relative
    gain."""
    if after > before * (1.0 + 10.0 * NOISE[POSITION]):
        gains[0] += 1.0
        gains[1] = max(gains[1], after / before - 1.0)


@inner_kernel
def _strike_by(law, b, m, z, gh, t, resting, impulse, gains, rules, work):
    """Resolves all contacts. Where there is no law for them the code for it is not even compiled:
    numba looks at arguments only."""
    if law is not None:
        _strike_all(b, m, z, gh, t, resting, impulse, gains, rules, work)


@called_kernel
def _strike_all(b, m, z, gh, t, resting, impulse, gains, rules, work):
    """Unilateral pivot: resolves all contacts touched at this instant."""
    sign = float(tips_first(b, z, gh, t) if m[FAMILY] == FLAT else m[S])
    phi = abs(z[THETA])
    flat = z[THETA] == 0.0
    floor, tip, far = (
        abs(floor_gap(b, z)) < CLOSED,
        abs(wall_gap(b, z, sign)) < CLOSED,
        abs(wall_gap(b, z, -sign)) < CLOSED,
    )
    touching, v = work[WORK], work[WORK + 1]
    touching[F], touching[TIP_TOP], touching[FAR_BOTTOM] = floor, tip, far
    touching[E], touching[TIP_BOTTOM], touching[FAR_TOP] = (
        flat and floor,
        flat and tip,
        flat and far,
    )
    v[0], v[1], v[2] = sign * z[VX], z[VY], sign * z[W]
    slower = v[1] + max(side_of(b, -sign).arm * v[2], -side_of(b, sign).arm * v[2])
    rules[FLAT_LANDING] += flat and floor and slower < -SLOW
    e_tip = b.e_left if sign > 0 else b.e_right
    e_far = b.e_right if sign > 0 else b.e_left
    if tip and far:
        rules[WEDGED] += 1
        e_tip = e_far = 0.0
    found = contact_impact(b, sign, phi, touching, e_tip, e_far, resting, v, impulse, gains, work)
    if found != FITS:
        rules[LEAST_CONTRADICTION if found == LEAST_WRONG else ENDLESS_STAGES] += 1
    z[VX], z[VY], z[W] = sign * v[0], v[1], sign * v[2]
    if floor and abs(slip_velocity(b, z)) < SLOW:
        stand(b, z)
