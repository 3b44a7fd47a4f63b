"""Where the corners of the block are, how they move, and what an impulse at one does.

In: reach of the block (m), rotation (rad), a step and a velocity.
Out: offsets, gaps, levers and rates of corners; the velocity after an impulse.
Called by all compiled modules of the model; numba compiles it into them.

Three surfaces (left wall, right wall, floor) face two corners of the block each. A contact is known
by the unit normal n of its surface (into the free space) and by the offset r of its corner from the
mass's centre c: its gap is n.(c + r) + distance, its lever the third entry of J = (n_x, n_y, r x
n), its rate J.(vx, vy, w), its mobility K = J M^-1 J^T. All per unit mass. A contact's effective
mass is the share of the block's mass that its corner feels, 1/m_eff = K, without unit.
"""

import math
from typing import NamedTuple

from rockcheck.scenes.compiled import inner_kernel

#: Across the plane, right and up.
Vector = tuple[float, float]
#: Velocity of the block: vx and vy of its mass's centre, w.
Velocity = tuple[float, float, float]
#: Offsets (x, y) of the corners from the mass's centre: bottom left, bottom right, top left, top
#: right.
Corners = tuple[float, float, float, float, float, float, float, float]
#: Distances of the block's sides from its mass's centre where it stands: left, right, bottom, top.
Reach = tuple[float, float, float, float]

SURFACES = LEFT_WALL, RIGHT_WALL, FLOOR = 0, 1, 2


class Step(NamedTuple):
    """A step, seen from its middle.

    `x`, `y` and `corners` place the mass's centre and the corners at the middle, which is at `t`;
    `v0` is the velocity before the step.
    """

    x: float
    y: float
    corners: Corners
    v0: Velocity
    length: float
    t: float


class Corner(NamedTuple):
    """A corner in a step, and how it meets a surface: gap, rate before and after the step, slip.

    The rates are those at the step's middle, as they would be without the surface's forces.
    """

    rx: float
    ry: float
    lever: float
    mobility: float
    gap: float
    before: float
    rate: float
    slip: float


class Pair(NamedTuple):
    """The two corners that face a surface: on a wall the lower, on the floor the left one first.

    `coupling` is the velocity that one corner gets from a unit impulse at the other.
    """

    first: Corner
    second: Corner
    coupling: float


@inner_kernel
def corners_at(reach: Reach, theta: float) -> Corners:
    """Offsets of the corners from the mass's centre."""
    left, right, bottom, top = reach
    s = math.sin(theta)
    c = math.cos(theta)
    return (
        -left * c + bottom * s,
        -left * s - bottom * c,
        right * c + bottom * s,
        right * s - bottom * c,
        -left * c - top * s,
        -left * s + top * c,
        right * c - top * s,
        right * s + top * c,
    )


@inner_kernel
def facing(surface: int, corners: Corners) -> tuple[Vector, Vector, Vector]:
    """Normal of a surface and offsets of the two corners that face it."""
    if surface == FLOOR:
        return (0.0, 1.0), corners[0:2], corners[2:4]
    if surface == LEFT_WALL:
        return (1.0, 0.0), corners[0:2], corners[4:6]
    return (-1.0, 0.0), corners[2:4], corners[6:8]


@inner_kernel
def lever_of(offset: Vector, normal: Vector) -> float:
    """Lever of a force along the normal at a corner, m: counterclockwise positive."""
    return offset[0] * normal[1] - offset[1] * normal[0]


@inner_kernel
def corner_over(
    step: Step, v: Velocity, normal: Vector, offset: Vector, away: float, inverse_inertia: float
) -> Corner:
    """The corner at an offset over a surface that is `away` from the mass's centre."""
    nx, ny = normal
    rx, ry = offset
    v0 = step.v0
    lever = lever_of(offset, normal)
    # J belongs to the middle of the step, v to its end and v0 to its start: J changes by -w^2 (n.r)
    # a unit of time.
    turn = 0.5 * step.length * v0[2] ** 2 * (nx * rx + ny * ry)
    return Corner(
        rx,
        ry,
        lever,
        1.0 + inverse_inertia * lever * lever,
        away + nx * rx + ny * ry,
        nx * v0[0] + ny * v0[1] + lever * v0[2] + turn,
        nx * v[0] + ny * v[1] + lever * v[2] - turn,
        v[0] - v[2] * ry,
    )


@inner_kernel
def pair_at(
    step: Step, v: Velocity, surface: int, distance: float, inverse_inertia: float
) -> tuple[Vector, Pair]:
    """Normal of a surface and its two corners; `distance` as in `Parameters`."""
    normal, offset1, offset2 = facing(surface, step.corners)
    away = normal[0] * step.x + normal[1] * step.y + distance
    first = corner_over(step, v, normal, offset1, away, inverse_inertia)
    second = corner_over(step, v, normal, offset2, away, inverse_inertia)
    coupling = 1.0 + inverse_inertia * first.lever * second.lever
    return normal, Pair(first, second, coupling)


@inner_kernel
def lower_corner(step: Step, v: Velocity) -> Vector:
    """Height of the floor's lower corner from the mass's centre, m, and its slip, m/s."""
    left_x, left_y, right_x, right_y = step.corners[0:4]
    height, place = (left_y, left_x) if left_y < right_y else (right_y, right_x)
    return height, v[0] - v[2] * height - 0.5 * step.length * step.v0[2] ** 2 * place


@inner_kernel
def apply_impulse(
    v: Velocity, inverse_inertia: float, direction: Vector, lever: float, impulse: float
) -> Velocity:
    """Velocity after an impulse (m/s) along a direction with that lever (m)."""
    return (
        v[0] + direction[0] * impulse,
        v[1] + direction[1] * impulse,
        v[2] + inverse_inertia * lever * impulse,
    )
