"""The friction of the floor: a spring and a damper whose force stays within Coulomb's cone.

In: the velocity without the floor, its two corners, their normal forces as if nothing moved.
Out: the floor's forces (m/s^2) and the velocity with friction; the record FRICTION moves on.
Called by `cm.surface_forces` (forces) and `cm.integrate` (the spring).
"""

import math
from typing import NamedTuple

import numpy as np

from rockcheck.cm.contact_law import normal_forces
from rockcheck.cm.geometry import FLOOR, Pair, Step, Velocity, apply_impulse, lower_corner
from rockcheck.cm.state import Parameters
from rockcheck.scenes.compiled import inner_kernel

#: More than any force (m/s^2), so that friction holds.
ENDLESS = 1e300


class Pushes(NamedTuple):
    """What the contacts of a pair do as if their forces did not move the corners.

    Forces, m/s^2, and the loss of each for a unit of velocity gained within the step.
    """

    force1: float
    force2: float
    loss1: float
    loss2: float


class FloorForces(NamedTuple):
    """Normal forces of the floor; the velocity with friction, and what that adds to both rates."""

    force1: float
    force2: float
    v: Velocity
    gain1: float
    gain2: float


@inner_kernel
def friction_force(
    stiffness: float,
    damping: float,
    mobility: float,
    holds: float,
    mu_k: float,
    normal: float,
    stretch: float,
    rate: float,
) -> tuple[float, bool]:
    """Stick-slip friction: a spring-damper whose force stays within Coulomb's cone.

    Returns force and whether it slips.

    `stretch` (m) is the spring's memory, `rate` (m/s) the corner's tangential velocity as it would
    be without this force, and `mobility` how much of that velocity a unit of force takes away: the
    damper acts on the velocity that is left (implicit, so that it may be stiff; then friction
    follows the normal force without lag). A corner sticks up to `holds` `normal`: mu_s where it
    stuck before, mu_k where it slipped. Else it is held at mu_k `normal`.
    """
    force = -(stiffness * stretch + damping * rate) / (1.0 + damping * mobility)
    if abs(force) <= holds * normal:
        return force, False
    return math.copysign(mu_k * normal, force), True


@inner_kernel
def floor_forces(
    friction: np.record, parameters: Parameters, step: Step, v: Velocity, pair: Pair, pushes: Pushes
) -> FloorForces:
    """The normal forces of the floor with its friction, which the record remembers.

    Friction acts at the lower corner, within the cone of both: they slip together or not at all. It
    is first solved as if it stuck.
    """
    first, second, coupling = pair
    f1, f2, d1, d2 = pushes
    length = step.length
    inverse_inertia = parameters.inverse_inertia
    stiffness = parameters.stiffness
    damping = parameters.friction_damping
    height, slip = lower_corner(step, v)
    # What a unit of friction gives to the rates of both corners, and to the slip.
    kt1 = -inverse_inertia * height * first.lever
    kt2 = -inverse_inertia * height * second.lever
    ktt = 1.0 + inverse_inertia * height * height
    # Friction that sticks takes away this share of what the normal forces give to the slip.
    stop = damping * length / (1.0 + damping * length * ktt)
    sticking, _ = friction_force(
        stiffness, damping, length * ktt, ENDLESS, ENDLESS, 1.0, friction.stretch, slip
    )
    force1, force2 = normal_forces(
        f1 - d1 * kt1 * sticking,
        f2 - d2 * kt2 * sticking,
        d1,
        d2,
        first.mobility - stop * kt1 * kt1,
        coupling - stop * kt1 * kt2,
        coupling - stop * kt2 * kt1,
        second.mobility - stop * kt2 * kt2,
    )
    shear, slips = friction_force(
        stiffness,
        damping,
        length * ktt,
        parameters.mu_k if friction.slipped else parameters.mu_s,
        parameters.mu_k,
        force1 + force2,
        friction.stretch,
        slip + length * (kt1 * force1 + kt2 * force2),
    )
    if slips:
        mu = math.copysign(parameters.mu_k, shear)
        force1, force2 = normal_forces(
            f1,
            f2,
            d1,
            d2,
            first.mobility + mu * kt1,
            coupling + mu * kt1,
            coupling + mu * kt2,
            second.mobility + mu * kt2,
        )
        shear = mu * (force1 + force2)
    friction.force = shear
    friction.slips = slips
    v = apply_impulse(v, inverse_inertia, (1.0, 0.0), -height, length * shear)
    return FloorForces(force1, force2, v, length * kt1 * shear, length * kt2 * shear)


@inner_kernel
def floor_load(state: np.record) -> float:
    """What the floor pushes with at both corners, m/s^2."""
    return state.contacts[FLOOR, 0].force + state.contacts[FLOOR, 1].force


@inner_kernel
def move_spring(state: np.record, parameters: Parameters, step: Step, v: Velocity) -> float:
    """Moves the friction spring with the lower corner over a step; returns the slip rate, m/s.

    A spring that slips keeps the length of its largest force: slip leaves no other memory. Where
    nothing is on the floor, nothing is remembered, and the slip rate is 0.
    """
    friction = state.friction
    load = floor_load(state)
    if not load > 0.0:
        friction.force = 0.0
        friction.stretch = 0.0
        friction.slips = False
        friction.slipped = False
        return 0.0
    _, slip_rate = lower_corner(step, v)
    friction.slipped = friction.slips
    friction.stretch += step.length * slip_rate
    if friction.slips:
        longest = parameters.mu_k * load / parameters.stiffness
        friction.stretch = min(max(friction.stretch, -longest), longest)
    return slip_rate
