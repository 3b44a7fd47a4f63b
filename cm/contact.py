"""The damping of the Continuous Model's contacts, and the restitution that follows from it."""

import math


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
        low, high = (middle, high) if restitution_of(middle) > aim else (low, middle)
    return 0.5 * (low + high)
