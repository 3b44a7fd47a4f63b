"""The compiled response of an oscillator to a recorded motion."""

import math
from typing import Any

from rockcheck.scenes.compiled import kernel


@kernel
def largest_response(
    samples: Any, parts: int, tail: int, step: float, rate: float, damping: float
) -> float:
    """Largest |y| of y'' + 2 D w y' + w^2 y = w^2 a, from rest, at times a `step` (s) apart.

    The ground a (any unit, that of y) is straight between the `samples`, which are `parts` steps
    apart; it rises from 0 in a step before the first, and is 0 from a step after the last on, for
    `tail` steps. `rate` w in rad/s, `damping` D below 1.

    Exact, as Nigam and Jennings (1969) have it: on a straight line y = a - 2 D a'/w plus a free
    vibration (p, q), which a step turns by a constant matrix.
    """
    turning = rate * math.sqrt(1.0 - damping * damping)
    decay, lag = math.exp(-damping * rate * step), 2.0 * damping / rate
    cosine, sine = decay * math.cos(turning * step), decay * math.sin(turning * step) / turning
    pp, pq = cosine + damping * rate * sine, sine
    qp, qq = -rate * rate * sine, cosine - damping * rate * sine
    y = v = before = largest = 0.0
    last = len(samples)
    for n in range(last + 2):
        after = samples[n] if n < last else 0.0
        count = tail - 1 if n > last else 1 if n in (0, last) else parts
        slope = (after - before) / (step * max(count, 1))
        p, q = y - before + lag * slope, v - slope
        for k in range(1, count + 1):
            p, q = pp * p + pq * q, qp * p + qq * q
            y = before + slope * (k * step) - lag * slope + p
            largest = max(largest, abs(y))
        v, before = q + slope, after
    return largest
