"""The contact law of the Continuous Model: scalar functions for Python and the compiled loop.

Forces and coefficients are per unit mass: stiffness in 1/s^2, damping in 1/s, force in m/s^2. A
contact's effective mass is the share of the block's mass that its corner feels, 1/m_eff = J M^-1
J^T, without unit.
"""

import math


def felt_share(x: float) -> float:
    """Share of a step's change of speed that a damper feels within that step.

    The argument is x = c K step (damping, mobility, step).

    The Kelvin-Voigt force is k depth - c (rate + share change), change = K step force: the speed
    then decays by 1/(1 + x + x^2/2), of second order and without overshoot however large x is, and
    at rest the spring alone carries the load.
    """
    return (1.0 + x) / (2.0 + x)


def normal_forces(
    f1: float, f2: float, d1: float, d2: float, k11: float, k12: float, k21: float, k22: float
) -> tuple[float, float]:
    """Forces of two Kelvin-Voigt contacts that can only push, coupled within the step.

    Here f is the force k depth - c rate that a contact would have if neither force acted, and d the
    loss of force for a unit of velocity gained within the step. K_ij is the velocity (over the
    step's length) that a unit of force j gives to corner i. So F_i + d_i (K F)_i = f_i, but F_i >=
    0. An open contact has f = d = 0.
    """
    a11, a12, a21, a22 = 1.0 + d1 * k11, d1 * k12, d2 * k21, 1.0 + d2 * k22
    determinant = a11 * a22 - a12 * a21
    force1, force2 = (a22 * f1 - a12 * f2) / determinant, (a11 * f2 - a21 * f1) / determinant
    if force1 <= 0.0:
        return 0.0, max(0.0, f2 / a22)
    if force2 <= 0.0:
        return max(0.0, f1 / a11), 0.0
    return force1, force2


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


def effective_mass(
    k_n: float,
    k_t: float,
    k_c: float,
    normal: float,
    tangential: float,
    friction: float,
    restitution: float,
) -> float:
    """Share of the block's mass that a corner brings to an impact with friction.

    It arrives at `normal` (< 0) and `tangential` speed.

    A unit impulse along the normal changes the corner's velocity by k_n = 1 + 3 r_t^2/R^2 along the
    normal and by k_c = -3 r_n r_t/R^2 along the surface, a tangential one by k_c and k_t = 1 + 3
    r_n^2/R^2 (r_n, r_t: offset of the corner from the centroid). Friction that holds the corner
    makes it heavier, 1/m = k_n - k_c^2/k_t; friction mu N that it slips against gives 1/m = k_n +
    mu k_c, signed as it acts. The rigid impact decides which of the two holds. Slip that stops or
    reverses within the impact is left out.
    """
    held = k_n - k_c * k_c / k_t
    push = (-(1.0 + restitution) * normal + k_c * tangential / k_t) / held
    shear = -(tangential + k_c * push) / k_t
    if push > 0.0 and abs(shear) <= friction * push:
        return 1.0 / held
    return 1.0 / (k_n + math.copysign(friction, shear) * k_c)


def shared_mass(own: float, other: float, coupling: float, ratio: float) -> float:
    """Share of the block's mass that a corner brings to a frictionless impact of two corners.

    The other corner arrives `ratio` times as fast. A unit impulse at a corner changes its own
    velocity by `own` (by `other` at that one) and the other corner's by `coupling`. Negative where
    the other corner's impact throws this one off.
    """
    return (other - coupling * ratio) / (own * other - coupling * coupling)


def damping_ratio_of_paper(restitution: float) -> float:
    """Damping ratio xi for a restitution by (33): -ln e/sqrt(pi^2 + ln^2 e), 1 at e = 0.

    It holds for a contact that pulls until its penetration is gone; a clamped one rebounds faster
    than e says.
    """
    if restitution == 0.0:
        return 1.0
    loss = abs(math.log(restitution))
    return loss / math.hypot(math.pi, loss)


def restitution_of(damping_ratio: float) -> float:
    """Restitution of a clamped Kelvin-Voigt contact with damping ratio xi.

    The contact ends where its force vanishes (Schwager & Poschel 2007): e = exp(-2 xi
    arccos(xi)/sqrt(1
    - xi^2)), with arccosh and xi^2 - 1 beyond 1.
    """
    xi = damping_ratio
    if abs(xi - 1.0) < 1e-6:
        return math.exp(-2.0 * xi * (1.0 + (1.0 - xi) / 3.0))
    if xi < 1.0:
        return math.exp(-2.0 * xi * math.acos(xi) / math.sqrt(1.0 - xi * xi))
    return math.exp(-2.0 * xi * math.acosh(xi) / math.sqrt(xi * xi - 1.0))


def least_restitution(stiffness: float, frequency_parameter: float) -> float:
    """Restitution that stands for zero: p/sqrt(k/m), with p in 1/s and k/m in 1/s^2.

    A clamped contact reaches zero only at infinite damping. This value vanishes with the duration
    of a contact, so that runs with softer contacts show its effect.
    """
    return min(frequency_parameter / math.sqrt(stiffness), 1.0)


def damping_ratio(restitution: float, least: float) -> float:
    """Damping ratio of a clamped Kelvin-Voigt contact: the inverse of `restitution_of`.

    Restitutions below `least` (> 0) get its damping ratio.
    """
    aim = max(restitution, least)
    if aim >= 1.0:
        return 0.0
    low, high = 0.0, 1.0 / math.sqrt(aim)
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        if restitution_of(middle) > aim:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
