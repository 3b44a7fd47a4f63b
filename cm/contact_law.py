"""The contact law: what a spring and a damper that can only push do.

In: restitutions, damping ratios; stiffness (1/s^2), damping (1/s), gaps (m) and rates (m/s).
Out: damping ratios, restitutions; forces per unit mass (m/s^2).
Called by `cm.start` (the closed forms), `cm.surface_forces` and `cm.friction` (the forces).
"""

import math

from rockcheck.scenes.compiled import inner_kernel


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

    The contact ends where its force vanishes (Schwager & Poschel 2007):
    e = exp(-2 xi arccos(xi)/sqrt(1 - xi^2)), with arccosh and xi^2 - 1 beyond 1.
    """
    xi = damping_ratio
    if abs(xi - 1.0) < 1e-6:
        return math.exp(-2.0 * xi * (1.0 + (1.0 - xi) / 3.0))
    angle = math.acos(xi) if xi < 1.0 else math.acosh(xi)
    return math.exp(-2.0 * xi * angle / math.sqrt(abs(1.0 - xi * xi)))


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


@inner_kernel
def felt_share(x: float) -> float:
    """Share of a step's change of speed that a damper feels within that step.

    The argument is x = c K step (damping, mobility, step).

    The Kelvin-Voigt force is k depth - c (rate + share change), change = K step force: the speed
    then decays by 1/(1 + x + x^2/2), of second order and without overshoot however large x is, and
    at rest the spring alone carries the load.
    """
    return (1.0 + x) / (2.0 + x)


@inner_kernel
def normal_forces(
    f1: float, f2: float, d1: float, d2: float, k11: float, k12: float, k21: float, k22: float
) -> tuple[float, float]:
    """Forces of two Kelvin-Voigt contacts that can only push, coupled within the step.

    Here f is the force k depth - c rate that a contact would have if neither force acted, and d the
    loss of force for a unit of velocity gained within the step. K_ij is the velocity (over the
    step's length) that a unit of force j gives to corner i. So F_i + d_i (K F)_i = f_i, but F_i >=
    0. An open contact has f = d = 0.
    """
    a11 = 1.0 + d1 * k11
    a12 = d1 * k12
    a21 = d2 * k21
    a22 = 1.0 + d2 * k22
    determinant = a11 * a22 - a12 * a21
    force1 = (a22 * f1 - a12 * f2) / determinant
    force2 = (a11 * f2 - a21 * f1) / determinant
    if force1 <= 0.0:
        return 0.0, max(0.0, f2 / a22)
    if force2 <= 0.0:
        return max(0.0, f1 / a11), 0.0
    return force1, force2
