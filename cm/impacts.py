"""Contacts that close: spring and damper of an impact, and its strike.

In: a corner that arrives (gap in m, rates in m/s) and its contact's record.
Out: the contact's stiffness and damping; the step it needs, the time until it closes (s); strikes.
Called by `cm.surface_forces` (closing) and `cm.integrate` (strikes).
"""

import math

import numpy as np

from rockcheck.cm.geometry import FLOOR, SURFACES, Corner
from rockcheck.cm.state import Parameters, Strikes
from rockcheck.scenes.compiled import inner_kernel

#: A contact that was open for longer than this (s), and than a contact is young, strikes when it
#: closes, and its impulse is gathered for as long.
STRIKE_TIME = 2e-3
#: A new contact is young for this many contact times 1/sqrt(k/m), longer than an undamped one lasts
#: (pi).
YOUNG = 4.0
#: Steps while a contact is young: this share of the contact time, or of the time in which its
#: damper stops the corner.
FINE = 0.02
FINE_DAMPER = 1.0
#: No step is cut for a contact that would close by less than this share of the depth under the
#: block's weight.
SHALLOW = 0.1
#: A contact that closes more slowly than this share of g/sqrt(k/m) is no impact.
GENTLE = 0.01
#: A corner that strikes does not slip if it arrives with less than this share of its normal speed.
STUCK = 1e-3
#: Two corners strike at once where the other one comes at least at this share of the speed.
TOGETHER = 0.1


@inner_kernel
def effective_mass(
    k_n: float,
    k_t: float,
    k_c: float,
    normal: float,
    tangential: float,
    mu_s: float,
    mu_k: float,
    restitution: float,
) -> float:
    """Share of the block's mass that a corner brings to an impact with friction.

    It arrives at `normal` (< 0) and `tangential` speed.

    A unit impulse along the normal changes the corner's velocity by k_n = 1 + 3 r_t^2/R^2 along the
    normal and by k_c = -3 r_n r_t/R^2 along the surface, a tangential one by k_c and k_t = 1 + 3
    r_n^2/R^2 (r_n, r_t: offset of the corner from the centroid). Friction that holds the corner
    makes it heavier, 1/m = k_n - k_c^2/k_t; friction mu N that it slips against gives 1/m = k_n +
    mu k_c, signed as it acts. The rigid impact decides which of the two holds, with static friction
    where the corner does not slip as it arrives. Slip that stops or reverses within the impact is
    left out.
    """
    held = k_n - k_c * k_c / k_t
    push = (-(1.0 + restitution) * normal + k_c * tangential / k_t) / held
    shear = -(tangential + k_c * push) / k_t
    sticks = abs(tangential) <= STUCK * abs(normal)
    mu = mu_s if sticks else mu_k
    if push > 0.0 and abs(shear) <= mu * push:
        return 1.0 / held
    return 1.0 / (k_n + math.copysign(mu_k, shear) * k_c)


@inner_kernel
def close_contact(
    contact: np.record,
    parameters: Parameters,
    surface: int,
    corner: Corner,
    other: Corner,
    coupling: float,
    t: float,
) -> float:
    """A contact closes at `t`: begin a strike if it was open long, choose spring and damper.

    Returns the step that it needs, s. `other` is the surface's other corner, and `coupling` their
    mobility.
    """
    contact_time = 1.0 / math.sqrt(parameters.stiffness)
    contact.closed = True
    if corner.rate > -GENTLE * parameters.gravity * contact_time:
        return math.inf
    if t - contact.last_closed > parameters.strike:
        contact.strike_time = t
        contact.impulse = 0.0
        contact.speed = -corner.rate
    if parameters.calibrated:
        calibrate(contact, parameters, surface, corner, other, coupling, contact_time)
    stopping_time = FINE_DAMPER / (contact.damping * corner.mobility + 1e-300)
    return min(FINE * contact_time, stopping_time)


@inner_kernel
def calibrate(
    contact: np.record,
    parameters: Parameters,
    surface: int,
    corner: Corner,
    other: Corner,
    coupling: float,
    contact_time: float,
) -> None:
    """Gives a contact the spring and damper with which its corner has the scene's restitution.

    When the other corner arrives within the contact's own time, the two share the block's mass as
    their speeds say. Where the mass lies nearer to one of them, equal springs would turn the block,
    and neither corner would leave with the scene's restitution: there each spring is as stiff as
    its share is large.
    """
    inverse_inertia = parameters.inverse_inertia
    left, right, bottom, top = parameters.reach
    is_lopsided = left != right if surface == FLOOR else bottom != top
    ratio = other.rate / corner.rate
    both = other.rate < TOGETHER * corner.rate and other.gap < -other.rate * contact_time
    # Its share of the block's mass in a frictionless impact of both, of which the other comes
    # `ratio` times as fast. Negative where the other's impact throws this one off.
    mass = (other.mobility - coupling * ratio) / (
        corner.mobility * other.mobility - coupling * coupling
    )
    spring = 1.0
    if both and is_lopsided and mass > 0.0:
        spring = 2.0 * mass
    elif both:
        mass = 1.0 / (corner.mobility + coupling * min(1.0, ratio))
    elif surface == FLOOR:
        mass = effective_mass(
            corner.mobility,
            1.0 + inverse_inertia * corner.ry * corner.ry,
            -inverse_inertia * corner.rx * corner.ry,
            corner.rate,
            corner.slip,
            parameters.mu_s,
            parameters.mu_k,
            parameters.restitution[surface],
        )
    else:
        mass = 1.0 / corner.mobility
    contact.stiffness = spring * parameters.stiffness
    contact.damping = (
        2.0 * parameters.damping_ratio[surface] * math.sqrt(spring * mass) / contact_time
    )


@inner_kernel
def closing_time(parameters: Parameters, corner: Corner, rate: float, length: float) -> float:
    """Time from the end of a step of this `length` until an open contact closes, s.

    Infinite if that is not soon or too gentle to matter. The corner's gap is that at the middle of
    the step, over which its rate went from `before` to `rate`.
    """
    gap = corner.gap
    lookahead = 0.5 * length + parameters.time_step
    pull = min(0.0, (rate - corner.before) / length)
    shallow = SHALLOW * parameters.gravity / parameters.stiffness
    if gap + lookahead * (rate + 0.5 * pull * lookahead) > -shallow:
        return math.inf
    arrival = math.sqrt(rate * rate - 2.0 * pull * gap)
    if rate < 0.0:
        since_middle = 2.0 * gap / (arrival - rate)
    else:
        since_middle = (arrival + rate) / -pull
    return since_middle - 0.5 * length


@inner_kernel
def record_strikes(
    state: np.record, length: float, until: float, strikes: Strikes, count: int
) -> int:
    """Adds a step's forces to the impulses, and writes the strikes that began by `until` s.

    They go into `strikes`, behind the first `count`; returns how many there are then. The state
    keeps when the first of the other strikes began.
    """
    first = math.inf
    for surface in range(len(SURFACES)):
        for side in range(2):
            contact = state.contacts[surface, side]
            contact.impulse += length * contact.force
            if contact.strike_time <= until:
                strike = strikes[count]
                strike.t = contact.strike_time
                strike.contact = 2 * surface + side
                strike.impulse = contact.impulse
                strike.speed = contact.speed
                count += 1
                contact.strike_time = math.inf
            first = min(first, contact.strike_time)
    state.first_strike = first
    return count
