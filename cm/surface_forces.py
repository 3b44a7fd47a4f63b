"""The forces of all surfaces over a step.

In: the state, a step, and the velocity (m/s, rad/s) that the block would have without forces.
Out: the velocity with them; the contacts' records; what the next steps need (s).
Called by `cm.integrate`, once a step.

Springs are explicit (they conserve energy) while a contact is young, implicit once it has settled:
`lookahead` (s) is then the step, and zero before.
"""

import math
from typing import NamedTuple

import numpy as np

from rockcheck.cm.contact_law import felt_share, normal_forces
from rockcheck.cm.friction import Pushes, floor_forces
from rockcheck.cm.geometry import (
    FLOOR,
    LEFT_WALL,
    RIGHT_WALL,
    Corner,
    Corners,
    Step,
    Velocity,
    apply_impulse,
    facing,
    lever_of,
    pair_at,
)
from rockcheck.cm.impacts import GENTLE, close_contact, closing_time
from rockcheck.cm.state import Parameters
from rockcheck.scenes.compiled import inner_kernel

#: Sweeps over surfaces and friction end when the forces change by less than this share, or after
#: MOST_SWEEPS.
SWEPT = 1e-5
MOST_SWEEPS = 50


class SurfaceStep(NamedTuple):
    """What surfaces did in a step: the velocity with their forces, and what comes next.

    `closing_time` is the time until an open contact closes, `contact_step` the step that a contact
    needs that has just closed, s; both infinite where there is none.
    """

    v: Velocity
    closing_time: float
    contact_step: float


@inner_kernel
def push(
    contact: np.record,
    parameters: Parameters,
    step: Step,
    surface: int,
    corner: Corner,
    other: Corner,
    coupling: float,
    lookahead: float,
) -> tuple[float, float, float]:
    """Force of a contact as if its own forces did not move it, and the loss of force.

    The loss is for a unit of velocity gained. Third is the step that the contact needs, infinite
    unless it has just closed. A settled contact stays closed while it would close again within the
    step. The contact remembers whether it is closed; an open one, when it was last, or as near as
    the block's weight sinks it, and too slow for an impact.
    """
    contact_step = math.inf
    stays = contact.closed and corner.gap + lookahead * corner.rate < 0.0
    if not (corner.gap < 0.0 or stays):
        gravity = parameters.gravity
        is_near = corner.gap * parameters.stiffness < gravity
        is_slow = abs(corner.rate) * math.sqrt(parameters.stiffness) < GENTLE * gravity
        if contact.closed or (is_near and is_slow):
            contact.closed = False
            contact.last_closed = step.t
        return 0.0, 0.0, contact_step
    if not contact.closed:
        contact_step = close_contact(contact, parameters, surface, corner, other, coupling, step.t)
    stiffness = contact.stiffness
    damping = contact.damping
    share = felt_share(damping * corner.mobility * step.length)
    felt_rate = corner.before + share * (corner.rate - corner.before)
    force = -stiffness * (corner.gap + lookahead * corner.rate) - damping * felt_rate
    return force, step.length * (share * damping + stiffness * lookahead), contact_step


@inner_kernel
def surface_force(
    state: np.record,
    parameters: Parameters,
    surface: int,
    step: Step,
    v: Velocity,
    lookahead: float,
) -> SurfaceStep:
    """Applies the forces of one surface over a step.

    `v` is the velocity that the block would have without them, `step.v0` the velocity before the
    step.
    """
    inverse_inertia = parameters.inverse_inertia
    length = step.length
    contact1 = state.contacts[surface, 0]
    contact2 = state.contacts[surface, 1]
    normal, pair = pair_at(step, v, surface, parameters.distance[surface], inverse_inertia)
    first, second, coupling = pair
    rate1 = first.rate
    rate2 = second.rate
    f1, d1, step1 = push(contact1, parameters, step, surface, first, second, coupling, lookahead)
    f2, d2, step2 = push(contact2, parameters, step, surface, second, first, coupling, lookahead)
    force1 = force2 = 0.0
    if contact1.closed or contact2.closed:
        k11 = first.mobility
        k22 = second.mobility
        if surface != FLOOR:
            force1, force2 = normal_forces(f1, f2, d1, d2, k11, coupling, coupling, k22)
        else:
            pushes = Pushes(f1, f2, d1, d2)
            forces = floor_forces(state.friction, parameters, step, v, pair, pushes)
            force1, force2, v, gain1, gain2 = forces
            rate1 = rate1 + gain1
            rate2 = rate2 + gain2
        v = apply_impulse(v, inverse_inertia, normal, first.lever, length * force1)
        v = apply_impulse(v, inverse_inertia, normal, second.lever, length * force2)
        rate1 += length * (k11 * force1 + coupling * force2)
        rate2 += length * (coupling * force1 + k22 * force2)
    elif surface == FLOOR:
        state.friction.force = 0.0
        state.friction.slips = False
    contact1.force = force1
    contact2.force = force2
    closing = math.inf
    if not contact1.closed:
        closing = closing_time(parameters, first, rate1, length)
    if not contact2.closed:
        closing = min(closing, closing_time(parameters, second, rate2, length))
    return SurfaceStep(v, closing, min(step1, step2))


@inner_kernel
def with_forces(
    state: np.record,
    parameters: Parameters,
    surface: int,
    corners: Corners,
    v: Velocity,
    length: float,
) -> Velocity:
    """Velocity after the remembered forces of a surface have acted for `length` s."""
    inverse_inertia = parameters.inverse_inertia
    force1 = state.contacts[surface, 0].force
    force2 = state.contacts[surface, 1].force
    normal, offset1, offset2 = facing(surface, corners)
    v = apply_impulse(v, inverse_inertia, normal, lever_of(offset1, normal), length * force1)
    v = apply_impulse(v, inverse_inertia, normal, lever_of(offset2, normal), length * force2)
    if surface == FLOOR:
        height = min(offset1[1], offset2[1])
        shear = state.friction.force
        v = apply_impulse(v, inverse_inertia, (1.0, 0.0), -height, length * shear)
    return v


@inner_kernel
def walls_push(state: np.record) -> bool:
    """Whether a wall has a force."""
    for wall in (LEFT_WALL, RIGHT_WALL):
        if state.contacts[wall, 0].force != 0.0 or state.contacts[wall, 1].force != 0.0:
            return True
    return False


@inner_kernel
def apply_surfaces(
    state: np.record, parameters: Parameters, step: Step, v: Velocity, settled: bool
) -> SurfaceStep:
    """Applies the forces of all surfaces over a step.

    `v` is the velocity that the block would have without them, `step.v0` the velocity before the
    step. One surface alone is solved at once. Where a wall touches too, each surface in turn takes
    back its force (first the one of the last step) and replaces it, until they agree. Counts the
    sweeps over the surfaces.
    """
    length = step.length
    surfaces = parameters.surfaces
    touching = walls_push(state)
    if touching:
        for surface in surfaces:
            v = with_forces(state, parameters, surface, step.corners, v, length)
    lookahead = length if settled else 0.0
    contact_step = math.inf
    closing = math.inf
    for _ in range(MOST_SWEEPS):
        state.sweeps += 1
        closing = math.inf
        change = 0.0
        whole = 0.0
        for surface in surfaces:
            contact1 = state.contacts[surface, 0]
            contact2 = state.contacts[surface, 1]
            if touching:
                v = with_forces(state, parameters, surface, step.corners, v, -length)
            before1 = contact1.force
            before2 = contact2.force
            v, closes_next, asked = surface_force(state, parameters, surface, step, v, lookahead)
            closing = min(closing, closes_next)
            contact_step = min(contact_step, asked)
            change += abs(contact1.force - before1) + abs(contact2.force - before2)
            whole += contact1.force + contact2.force
        if not (touching or walls_push(state)) or change <= SWEPT * whole:
            break
        touching = True
    return SurfaceStep(v, closing, contact_step)
