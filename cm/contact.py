"""The contact law of the Continuous Model: scalar pure functions, usable from Python and from the compiled loop alike.

Forces and coefficients are per unit mass: stiffness in 1/s^2, damping in 1/s, force in m/s^2. A contact's effective mass is
the share of the block's mass that its corner feels, 1/m_eff = J M^-1 J^T, without unit.
"""

from __future__ import annotations

import math

#: A clamped Kelvin-Voigt contact reaches a restitution of zero only at infinite damping: this is the least one asked of it.
LEAST_RESTITUTION = 0.005


def normal_force(stiffness: float, damping: float, depth: float, rate: float) -> float:
    """Kelvin-Voigt force of a contact that can only push: k depth + c rate, never negative, zero where open.

    `depth` (m) is the penetration, `rate` (m/s) its rate of growth.
    """
    if depth <= 0.0:
        return 0.0
    return max(0.0, stiffness * depth + damping * rate)


def friction_force(
    stiffness: float, damping: float, mobility: float, mu_s: float, mu_k: float, normal: float, stretch: float, rate: float, slipping: bool
) -> tuple[float, bool]:
    """Stick-slip friction: a spring-damper whose force stays within Coulomb's cone. Returns force and whether it slips.

    `stretch` (m) is the spring's memory, `rate` (m/s) the corner's tangential velocity as it would be without this force, and
    `mobility` how much of that velocity a unit of force takes away: the damper acts on the velocity that is left (implicit, so
    that it may be stiff; then friction follows the normal force without lag). A sticking corner slips beyond mu_s `normal`; a
    slipping one is held at mu_k `normal` and sticks again when the spring-damper asks for less.
    """
    force = -(stiffness * stretch + damping * rate) / (1.0 + damping * mobility)
    if abs(force) <= (mu_k if slipping else mu_s) * normal:
        return force, False
    return math.copysign(mu_k * normal, force), True


def damping_ratio_of_paper(restitution: float) -> float:
    """Damping ratio xi for a restitution by the paper's (33), -ln e/sqrt(pi^2 + ln^2 e), 1 at e = 0.

    It holds for a contact that pulls until its penetration is gone; a clamped one then rebounds faster than asked.
    """
    if restitution == 0.0:
        return 1.0
    loss = abs(math.log(restitution))
    return loss / math.hypot(math.pi, loss)


def restitution_of(damping_ratio: float) -> float:
    """Restitution of a clamped Kelvin-Voigt contact with damping ratio xi (Schwager & Poschel 2007).

    The contact ends where its force vanishes: e = exp(-2 xi arccos(xi)/sqrt(1 - xi^2)), with arccosh and xi^2 - 1 beyond 1.
    """
    xi = damping_ratio
    if abs(xi - 1.0) < 1e-6:
        return math.exp(-2.0 * xi * (1.0 + (1.0 - xi) / 3.0))
    if xi < 1.0:
        return math.exp(-2.0 * xi * math.acos(xi) / math.sqrt(1.0 - xi * xi))
    return math.exp(-2.0 * xi * math.acosh(xi) / math.sqrt(xi * xi - 1.0))


def damping_ratio(restitution: float) -> float:
    """Damping ratio at which a clamped Kelvin-Voigt contact has this restitution: the inverse of `restitution_of`.

    Restitutions below `LEAST_RESTITUTION` get its damping ratio, about 7.
    """
    if restitution == 1.0:
        return 0.0
    aim = max(restitution, LEAST_RESTITUTION)
    low, high = 0.0, 16.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        if restitution_of(middle) > aim:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
