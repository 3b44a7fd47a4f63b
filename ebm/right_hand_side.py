"""The unit in which the cost of a run is told: one evaluation of the equation of rocking.

In: the ground motion of a scene, in natural units. Out: a number that depends on each evaluation,
so that none is left out. Called by the benchmark, which times it.
"""

import math

from rockcheck.ebm.core.ground import Ground, acceleration
from rockcheck.scenes.compiled import kernel


@kernel
def right_hand_sides(ground: Ground, alpha: float, step: float, count: int) -> float:
    """(3) in natural units, `count` times, a `step` apart, each at a place that the last one moves.

    Under a Ricker pulse it has sin, cos, exp and a polynomial.
    """
    theta = 0.1 * alpha
    for k in range(count):
        turn = 0.75 * (
            acceleration(ground, step * k) * math.cos(alpha - theta) - math.sin(alpha - theta)
        )
        theta += step * step * turn
    return theta
