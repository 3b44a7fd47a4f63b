"""Which corners rest on floor and walls, and how a block is put exactly onto a contact that it
reaches.

Natural units. A contact is closed where its gap and the gap's rate are zero; there is one zero of
position, one of velocity.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.motion import HEIGHT, THETA, VX, VY, W, X, side_of
from rockcheck.scenes.compiled import inner_kernel

#: The zero of position (R) and of velocity (sqrt(g R)): a contact nearer and slower than this is
#: closed, a pivot that slips more slowly stands, a block tilted and turning by less is upright.
CLOSED = 1e-10
SLOW = 1e-9


@inner_kernel
def lower(b, z):
    """The side of the lower corner, the pivot: that to which the block tips, or begins to tip.

    Upright and at rest both are equally low, to rounding. It is the weaker one then: its distance
    is the unit of length, so its height is right to the bit, and a mirror image has the mirrored
    corner.
    """
    sense = z[THETA] if z[THETA] != 0.0 else z[W]
    return side_of(b, sense if sense != 0.0 else b.right.arm - b.left.arm)


@inner_kernel
def slip_velocity(b, z):
    """V of the lower corner."""
    side = lower(b, z)
    return z[VX] + side.radius * math.cos(side.alpha - abs(z[THETA])) * z[W]


@inner_kernel
def stand(b, z):
    """Stops the pivot: the velocity is that of a rotation about it."""
    side = lower(b, z)
    z[VX] = -side.radius * math.cos(side.alpha - abs(z[THETA])) * z[W]


@inner_kernel
def stop(z):
    """Sets all velocities to zero."""
    z[W] = z[VX] = z[VY] = 0.0


@inner_kernel
def wall_gap(b, z, side):
    """The clear gap between the wall on `side` (+1 left, -1 right) and the corner that faces it;
    infinite without a wall."""
    gap, faces = b.gap_left if side > 0 else b.gap_right, side_of(b, side)
    if gap == math.inf:
        return gap
    radius, alpha = (
        (faces.top_radius, faces.top_alpha)
        if side * z[THETA] > 0.0
        else (faces.radius, faces.alpha)
    )
    return side * z[X] + faces.arm + gap - radius * math.sin(alpha + abs(z[THETA]))


@inner_kernel
def closed_wall(b, z, side, bottom):
    """Whether the corner facing the wall on `side` rests on it.

    A tilted block has one such corner; `bottom` picks, at theta = 0, the corner that keeps touching
    while it tilts away.
    """
    if not abs(wall_gap(b, z, side)) < CLOSED:
        return False
    phi, faces = side * z[THETA], side_of(b, side)  # positive: tips toward that wall, top corner
    if phi < 0.0 or (phi == 0.0 and bottom):
        arm = -faces.radius * math.cos(faces.alpha + abs(phi))
    else:
        arm = faces.top_radius * math.cos(faces.top_alpha + abs(phi))
    return abs(z[VX] - arm * z[W]) < SLOW


@inner_kernel
def floor_gap(b, z):
    """Height of the lower corner over the floor."""
    side = lower(b, z)
    return z[HEIGHT] - side.radius * math.cos(side.alpha - abs(z[THETA]))


@inner_kernel
def closed_floor(b, z):
    """Whether the lower corner rests on the floor."""
    turns, side = z[W] if z[THETA] > 0.0 or (z[THETA] == 0.0 and z[W] > 0.0) else -z[W], lower(b, z)
    rate = z[VY] - side.radius * math.sin(side.alpha - abs(z[THETA])) * turns
    return abs(floor_gap(b, z)) < CLOSED and abs(rate) < SLOW


@inner_kernel
def closed_gap(gap, rate):
    """A gap and its rate; both zero where it touches and closes slowly enough to rest. Then its
    acceleration decides."""
    if abs(gap) < CLOSED:
        if -SLOW < rate < 0.0:
            return 0.0, 0.0
        if gap < 0.0:
            return 0.0, rate
    return gap, rate


@inner_kernel
def upright(b, z):
    """Sets a tilt and a rotation that are rounding to zero, and a slip with them."""
    if (z[THETA] != 0.0 or z[W] != 0.0) and abs(z[THETA]) < CLOSED and abs(z[W]) < SLOW:
        v, side = slip_velocity(b, z), lower(b, z)
        z[HEIGHT] += b.height - side.radius * math.cos(side.alpha - abs(z[THETA]))
        z[THETA] = z[W] = 0.0
        z[VX] = v if abs(v) > SLOW else 0.0


@inner_kernel
def land_upright(b, z, sign, on_floor):
    """Sets a theta near zero to exactly zero and keeps the pivot's place. A side that then touches
    a wall touches it exactly."""
    side = side_of(b, sign)
    z[X] += sign * (side.arm - side.radius * math.sin(side.alpha - sign * z[THETA]))
    if on_floor:
        z[HEIGHT] = b.height
    z[THETA] = 0.0
    left, right = abs(wall_gap(b, z, 1)), abs(wall_gap(b, z, -1))
    if left < CLOSED and left < right:
        z[X] = -b.gap_left
    elif right < CLOSED and right < left:
        z[X] = b.gap_right


@inner_kernel
def between_walls(b, z):
    """Whether the block touches both walls at once."""
    return (
        b.gap_left < np.inf
        and b.gap_right < np.inf
        and wall_gap(b, z, 1) + wall_gap(b, z, -1) < CLOSED
    )
