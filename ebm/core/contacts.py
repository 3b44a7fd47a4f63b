"""Which corners rest on floor and walls, and how a block is put exactly onto a contact.

Natural units. A contact is closed where its gap and the gap's rate are zero; there is one zero of
position, one of velocity.
"""

import math

from rockcheck.ebm.core.block import arm_of, height_of, side_of, wall_corner
from rockcheck.ebm.core.series import INSTANT
from rockcheck.scenes.compiled import inner_kernel

#: The zero of position (R) and of velocity (sqrt(g R)): a contact nearer and slower than this is
#: closed, a pivot that slips more slowly stands, a block tilted and turning by less is upright.
CLOSED = 1e-10
SLOW = 1e-9


@inner_kernel
def lean(motion):
    """Positive where the block tips to the left, or begins to; 0 upright and at rest."""
    return motion.theta if motion.theta != 0.0 else motion.w


@inner_kernel
def lower(block, motion):
    """The side of the lower corner, the pivot: that to which the block tips, or begins to tip.

    Upright and at rest both are equally low, to rounding. It is the weaker one then: its distance
    is the unit of length, so its height is right to the bit, and a mirror image has the mirrored
    corner.
    """
    sense = lean(motion)
    return side_of(block, sense if sense != 0.0 else block.right.arm - block.left.arm)


@inner_kernel
def height(block, motion):
    """Height of the mass's centre over the lower corner."""
    return height_of(lower(block, motion), abs(motion.theta))


@inner_kernel
def slip_velocity(block, motion):
    """V of the lower corner."""
    return motion.vx + height(block, motion) * motion.w


@inner_kernel
def stand(block, motion):
    """Stops the pivot: the velocity is that of a rotation about it."""
    motion.vx = -height(block, motion) * motion.w


@inner_kernel
def stand_if_slow(block, motion):
    """Stops a pivot whose slip is zero but for rounding."""
    if abs(slip_velocity(block, motion)) < slowest(motion.w):
        stand(block, motion)


@inner_kernel
def slowest(w):
    """The zero of a corner's velocity: within an INSTANT the block turns by w INSTANT."""
    return max(SLOW, INSTANT * w * w)


@inner_kernel
def stop(motion):
    """Sets all velocities to zero."""
    motion.w = motion.vx = motion.vy = 0.0


@inner_kernel
def wall_gap(block, motion, side):
    """Clear gap between the wall on `side` (+1 left, -1 right) and its corner; inf if no wall."""
    faces = side_of(block, side)
    if faces.gap == math.inf:
        return faces.gap
    reach = faces.arm
    if motion.theta != 0.0:
        radius, alpha = wall_corner(faces, side * motion.theta > 0.0)
        reach = radius * math.sin(alpha + abs(motion.theta))
    return side * motion.x + faces.arm + faces.gap - reach


@inner_kernel
def closed_wall(block, motion, side, bottom):
    """Whether the corner facing the wall on `side` rests on it.

    A tilted block has one such corner; `bottom` picks, at theta = 0, the corner that keeps touching
    while it tilts away.
    """
    if not abs(wall_gap(block, motion, side)) < CLOSED:
        return False
    phi = side * motion.theta
    tips = phi > 0.0 or (phi == 0.0 and not bottom)
    radius, alpha = wall_corner(side_of(block, side), tips)
    arm = (radius if tips else -radius) * math.cos(alpha + abs(phi))
    return abs(motion.vx - arm * motion.w) < slowest(motion.w)


@inner_kernel
def floor_gap(block, motion):
    """Height of the lower corner over the floor."""
    return motion.y - height(block, motion)


@inner_kernel
def closed_floor(block, motion):
    """Whether the lower corner rests on the floor."""
    turns = motion.w if lean(motion) > 0.0 else -motion.w
    side = lower(block, motion)
    rate = motion.vy - arm_of(side, abs(motion.theta)) * turns
    return abs(floor_gap(block, motion)) < CLOSED and abs(rate) < slowest(motion.w)


@inner_kernel
def closed_gap(gap, rate):
    """A gap and its rate; both zero where it touches and closes slowly enough to rest.

    Then its acceleration decides.
    """
    touches = abs(gap) < CLOSED
    rests = touches and -SLOW < rate < 0.0
    return 0.0 if rests or (touches and gap < 0.0) else gap, 0.0 if rests else rate


@inner_kernel
def upright(block, motion):
    """Sets a tilt and a rotation that are rounding to zero, and a slip with them."""
    if (
        (motion.theta != 0.0 or motion.w != 0.0)
        and abs(motion.theta) < CLOSED
        and abs(motion.w) < SLOW
    ):
        v = slip_velocity(block, motion)
        motion.y += block.height - height(block, motion)
        motion.theta = motion.w = 0.0
        motion.vx = v if abs(v) > SLOW else 0.0


@inner_kernel
def land_upright(block, motion, sign, on_floor):
    """Sets a theta near zero to exactly zero and keeps the pivot's place.

    A side that then touches a wall touches it exactly.
    """
    side = side_of(block, sign)
    motion.x += sign * (side.arm - arm_of(side, sign * motion.theta))
    if on_floor:
        motion.y = block.height
    motion.theta = 0.0
    left, right = abs(wall_gap(block, motion, 1)), abs(wall_gap(block, motion, -1))
    if left < CLOSED and left < right:
        motion.x = -block.left.gap
    elif right < CLOSED and right < left:
        motion.x = block.right.gap
