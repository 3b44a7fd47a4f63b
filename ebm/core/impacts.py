"""The paper's impact laws, for the pivot that never leaves the floor.

They are the floor impact and the wall impact cascade of Fig. 3.

Natural units (lengths in R, accelerations in g, unit mass), base frame. S is the pivot (+1 lower
left), Sw the wall (+1 left), w the angular velocity, xdot the horizontal velocity of the mass's
centre, v the pivot's slip velocity, s and c the horizontal and vertical distance of the mass's
centre from the pivot, c' its vertical one from the corner on the wall: sin(alpha - |theta|),
cos(alpha - |theta|) and cos(alpha + |theta|) of a homogeneous block. k = 1/(I + R^2) is 3/4 then,
`spin` = 1/I is 3. Index 1 is before the impact, 2 after it; P and Q are the impulses of the floor
on the pivot.
"""

import math
from collections import namedtuple
from enum import IntEnum

from rockcheck.ebm.core.block import side_of
from rockcheck.ebm.core.contacts import CLOSED
from rockcheck.ebm.core.names import Kind
from rockcheck.ebm.core.series import NOISE
from rockcheck.scenes.compiled import inner_kernel

#: Forms of the paper's floor impact.
Landing = IntEnum("Landing", "HELD_FAST SLID FLAT_END", start=0)

#: Branches of the wall impact's cascade, as the paper's Fig. 3 letters them.
Branch = IntEnum("Branch", "A_STICK B_STICK C_STICK D_SLIP E_SLIP NO_BRANCH", start=0)


#: A corner that strikes a wall, and the pivot: S, Sw, s, c, C = S Sw c', the pivot's k, and `spin`.
Corner = namedtuple("Corner", "S Sw s c C share spin")


@inner_kernel
def floor_stick(b, S1, w1, v1):
    """Floor impact on the other corner, which sticks (e_g = 0): w2, P, Q.

    The angular momentum about the new pivot stays what it is: with v1 = 0, w2/w1 = 1 - k2 s2 (s1 +
    s2), Housner's ratio 1 - 1.5 s^2.
    """
    s1, s2, c, k2 = side_of(b, S1).arm, side_of(b, -S1).arm, b.height, side_of(b, -S1).share
    w2 = (1.0 - k2 * (s1 + s2) * s2) * w1 - k2 * c * v1
    return w2, -S1 * (s2 * (w1 + w2) + (s1 - s2) * w1), c * (w1 - w2) - v1


@inner_kernel
def floor_slip(b, S1, d, mu_k, w1, v1):
    """Floor impact on the other corner, which slips toward d (e_g = 0): w2, v2, P."""
    s1, s2, c, spin, S2 = side_of(b, S1).arm, side_of(b, -S1).arm, b.height, b.spin, -S1
    old, new = s1 * s2 + mu_k * d * S2 * s1 * c, s2 * s2 + mu_k * d * S2 * s2 * c
    w2 = w1 * (1.0 - spin * old) / (1.0 + spin * new)
    p = (s1 + s2) * abs(w1) / (1.0 + spin * new)
    return w2, v1 + c * (w2 - w1) - mu_k * d * p, p


@inner_kernel
def floor_impact(b, S1, w1, v1, mu_s, mu_k):
    """Floor impact as theta passes zero, from pivot S1 to -S1: form (a Landing), w2, v2, P.

    `b` is the block, a `Setting`. The new pivot sticks if it can, else slips against the friction.
    Where neither lets the block turn on, it stays flat (squat blocks, much friction), and v2 is
    then the velocity with which it slides.
    """
    S2 = -S1
    rounding = NOISE[Kind.POSITION] * (abs(w1) + abs(v1))
    w2, p, q = floor_stick(b, S1, w1, v1)
    if S2 * w2 >= 0.0 and p >= 0.0 and abs(q) <= mu_s * p + rounding:
        return Landing.HELD_FAST, w2, 0.0, p
    toward = -1.0 if q > 0.0 else 1.0
    for d in (toward, -toward):
        slips_w2, v2, push = floor_slip(b, S1, d, mu_k, w1, v1)
        if S2 * slips_w2 >= 0.0 and d * v2 >= -rounding:
            return Landing.SLID, slips_w2, v2, push
    p = side_of(b, S1).arm * abs(w1)
    xdot = v1 - b.height * w1
    return (
        Landing.FLAT_END,
        0.0,
        (0.0 if abs(xdot) <= mu_s * p else xdot - math.copysign(mu_k * p, xdot)),
        p,
    )


@inner_kernel
def wall_stick(corner, e, w1, xdot1):
    """(25), (26): the corner rebounds with e, the pivot sticks: w2, xdot2, P, Q."""
    S, s, c, C = corner.S, corner.s, corner.c, corner.C
    w2 = e * (xdot1 - C * w1) / (C + c)
    xdot2 = -c * w2
    p = S * s * (w2 - w1)
    return w2, xdot2, p, (S * s * p + C * (xdot2 - xdot1) + (w2 - w1) / corner.spin) / (c + C)


@inner_kernel
def wall_slip(corner, e, w1, xdot1, kappa):
    """(30): the corner rebounds with e, the pivot slips: w2, xdot2, P, Q = -kappa P.

    It slips toward Sr under a P of sign sy, with kappa = mu_k Sr sy.
    """
    S, s, c, C, spin = corner.S, corner.s, corner.c, corner.C, corner.spin
    k = S * s + (c + C) * kappa
    w2 = (w1 / spin + k * S * s * w1 - e * C * C * w1 + (1.0 + e) * C * xdot1) / (
        1.0 / spin + k * S * s + C * C
    )
    p = S * s * (w2 - w1)
    return w2, C * w2 - e * (xdot1 - C * w1), p, -kappa * p


@inner_kernel
def _stops(branch, corner, w1, xdot1):
    """The block stops, by what impulses of wall and floor that takes."""
    return branch, 0.0, 0.0, max(0.0, -corner.Sw * xdot1), -corner.S * corner.s * w1, 0.0


@inner_kernel
def wall_impact(b, corner, e, w1, xdot1):
    """A corner strikes the wall, by the cascade of Fig. 3: branch, w2, xdot2, N, P, v2.

    Case I is the top corner (S = Sw), case II the bottom one. N >= 0 is the wall's impulse. (31) is
    the identity map while the pivot is on the floor, so it does not appear. Of `b` (a SETTING)
    friction is used.
    """
    Sw = corner.Sw
    rounding = NOISE[Kind.POSITION] * (abs(w1) + abs(xdot1))
    w2, xdot2, p, q = wall_stick(corner, e, w1, xdot1)
    if math.isfinite(w2) and (b.no_slip or abs(q) <= b.mu_s * abs(p) + rounding):
        n = Sw * (xdot2 - xdot1 - q)
        if n >= 0.0:  # (21)
            return Branch.A_STICK, w2, xdot2, n, p, 0.0
        return _without_wall(corner, w1, xdot1)
    for Sr in (1.0, -1.0):
        for sy in (1.0, -1.0):
            kappa = b.mu_k * Sr * sy
            w2, xdot2, p, q = wall_slip(corner, e, w1, xdot1, kappa)
            v2 = xdot2 + corner.c * w2
            if p * sy < -rounding or v2 * Sr < -rounding:
                continue
            n = Sw * (xdot2 - xdot1 - q)
            if n >= 0.0:
                return Branch.D_SLIP, w2, xdot2, n, p, v2
            return _slips_without_wall(corner, w1, xdot1, -kappa)
    return _stops(Branch.NO_BRANCH, corner, w1, xdot1)


@inner_kernel
def _without_wall(corner, w1, xdot1):
    """(27), (28): the pivot sticks without an impulse from the wall, or the block stops."""
    S, s, c, C = corner.S, corner.s, corner.c, corner.C
    w2 = corner.share * (w1 / corner.spin - c * xdot1 + S * s * (S * s * w1))
    xdot2 = -c * w2
    if corner.Sw * (xdot2 - C * w2) >= 0.0:  # (22)
        return Branch.B_STICK, w2, xdot2, 0.0, S * s * (w2 - w1), 0.0
    return _stops(Branch.C_STICK, corner, w1, xdot1)


@inner_kernel
def _slips_without_wall(corner, w1, xdot1, k):
    """(32): the pivot slips without an impulse from the wall."""
    S, s, C = corner.S, corner.s, corner.C
    # Friction and wall have one lever: no speed meets both.
    if abs(k * S * s - C) <= CLOSED:
        return _stops(Branch.NO_BRANCH, corner, w1, xdot1)
    w2 = (k * S * s * w1 - xdot1) / (k * S * s - C)
    xdot2 = C * w2
    return Branch.E_SLIP, w2, xdot2, 0.0, S * s * (w2 - w1), xdot2 + corner.c * w2
