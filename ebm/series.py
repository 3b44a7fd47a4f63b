"""Taylor polynomials: evaluation and the first root. A polynomial is an array of coefficients c[0..n] of 1, tau, tau^2, ...

Everything that the event-based model follows in time (rotation, position, contact forces, gaps) is one such polynomial a
step, so an event is the root of a polynomial and can be located to rounding, with a proof that no earlier one was missed.
"""

from __future__ import annotations

import numpy as np

from scenes.compiled import kernel

#: Longest polynomial: orders above this are not used.
MOST_TERMS = 32
#: A coefficient below this (in natural units, scaled to the step) is rounding noise; forces and gaps.
NOISE = 1e-14
#: The same for slip velocities, which start from friction forces that cancel.
SLIP_NOISE = 1e-12
NO_ROOT = -1.0
_DEEPEST = 44


@kernel
def value(c, n, tau):
    """c(tau) for a polynomial of degree n."""
    total = c[n]
    for k in range(n - 1, -1, -1):
        total = total * tau + c[k]
    return total


@kernel
def slope(c, n, tau):
    """dc/dtau at tau for a polynomial of degree n >= 1."""
    total = n * c[n]
    for k in range(n - 1, 0, -1):
        total = total * tau + k * c[k]
    return total


@kernel
def leading(c, n, h, floor):
    """The sign with which c leaves tau = 0 on a step h: +1, -1, or 0 where it is zero throughout.

    Coefficients that are rounding noise on the scale of the step (below `floor`, see NOISE) are taken as zero, so that a guard that has just fired
    (and is zero by construction) does not fire again.
    """
    largest = 0.0
    scale = 1.0
    for k in range(n + 1):
        largest = max(largest, abs(c[k]) * scale)
        scale *= h
    noise = max(floor, 1e-13 * largest)
    scale = 1.0
    for k in range(n + 1):
        if abs(c[k]) * scale > noise:
            return 1 if c[k] > 0.0 else -1
        scale *= h
    return 0


@kernel
def first_root(c, n, h, floor, stack):
    """The first tau in [0, h] at which c turns negative, or NO_ROOT.

    A zero at tau = 0 (within `floor`) is divided out: 0.0 comes back only where c leaves it downward. `stack` is scratch of shape
    (>= 48, MOST_TERMS). The search is complete: an interval is dropped only where a bound on the polynomial, or on its
    slope and end value, shows that it holds no root. Touching zero without crossing is no root.
    """
    q = stack[0]
    scale = 1.0
    low = 0.0
    largest = 0.0
    for k in range(n + 1):
        q[k] = c[k] * scale
        scale *= h
        low += min(q[k], 0.0)
        largest = max(largest, abs(q[k]))
    noise = max(floor, 1e-13 * largest)
    if q[0] > noise and low + q[0] > 0.0:
        return NO_ROOT
    zeros = 0
    while zeros <= n and abs(q[zeros]) <= noise:
        zeros += 1
    if zeros > n:
        return NO_ROOT
    if q[zeros] < 0.0:
        return 0.0
    for k in range(n + 1 - zeros):
        q[k] = q[k + zeros]
    z = _isolate(stack, n - zeros)
    return NO_ROOT if z < 0.0 else z * h


@kernel
def _isolate(stack, n):
    """First root on [0, 1] of the polynomial in stack[0], positive at 0; halves intervals, left ones first."""
    depth = np.zeros(stack.shape[0], dtype=np.int64)
    start = np.zeros(stack.shape[0])
    top = 0
    while top >= 0:
        q = stack[top]
        level = depth[top]
        a = start[top]
        low = q[0]
        high_slope = q[1] if n >= 1 else 0.0
        end = q[0]
        for k in range(1, n + 1):
            low += min(q[k], 0.0)
            end += q[k]
            if k > 1:
                high_slope += k * max(q[k], 0.0)
        if q[0] <= 0.0:
            return a
        if low > 0.0 or (high_slope < 0.0 and end > 0.0):
            top -= 1
            continue
        if high_slope < 0.0:
            return a + 0.5**level * _falling_root(q, n)
        if level == _DEEPEST or top + 2 >= stack.shape[0]:
            top -= 1
            continue
        right = stack[top]
        left = stack[top + 1]
        half = 1.0
        for k in range(n + 1):
            left[k] = right[k] * half
            half *= 0.5
        for k in range(n + 1):
            right[k] = left[k]
        for i in range(n):  # Taylor shift by one half-interval
            for k in range(n - 1, i - 1, -1):
                right[k] += right[k + 1]
        start[top] = a + 0.5 ** (level + 1)
        start[top + 1] = a
        depth[top] = level + 1
        depth[top + 1] = level + 1
        top += 1
    return NO_ROOT


@kernel
def _falling_root(q, n):
    """The root in [0, 1] of a polynomial that falls from positive to not positive: Newton, kept inside its bracket."""
    a, b = 0.0, 1.0
    z = 0.5
    for _ in range(100):
        f = value(q, n, z)
        if f > 0.0:
            a = z
        else:
            b = z
        gradient = slope(q, n, z)
        new = z - f / gradient if gradient < 0.0 else 0.5 * (a + b)
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - z) <= 2e-16 * (abs(z) + 1e-3 * b):
            return new
        z = new
    return z
