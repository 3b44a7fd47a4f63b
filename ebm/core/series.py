"""Taylor polynomials: evaluation and the first root.

A polynomial is a row of a two-dimensional array: the coefficients a[row, 0..n] of 1, tau, tau^2,
..., n <= ORDER. (Rows are addressed in place; views of them would cost more than the sums.) They
are worked on in two halves of eight, each at once (see ebm.core.lanes). What stands behind a[row,
n] does not matter.

Everything that the event-based model follows in time (rotation, position, contact forces, gaps) is
one such polynomial a step, so an event is the root of a polynomial and can be located to rounding,
with a proof that no earlier one was missed.
"""

import math

import numpy as np

from rockcheck.ebm.core import lanes
from rockcheck.ebm.core.names import Kind
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: Order of the series. From 14 to 20 the same error costs about the same, at all tolerances; 16
#: terms are two registers.
ORDER = 2 * lanes.LANES - 1
#: Width of the rows that hold a polynomial, and behind it what else is kept with it.
WIDTH = 32
#: 1/k.
RECIPROCAL = np.array([np.inf] + [1.0 / k for k in range(1, WIDTH + 2)])
#: Natural time at which the first coefficients of a guard are compared.
AHEAD = 2e-2
#: Error bounds of a position, a velocity and a force: a coefficient below its bound is rounding.
#: They are one bound, seen after AHEAD: a velocity or a force of this size moves a position by its
#: bound. So a contact that pulls by more than noise opens by more, too.
_ERROR = 1e-13
NOISE = np.array([_ERROR, _ERROR / AHEAD, 2.0 * _ERROR / AHEAD**2])
#: The zero in time: an event's time is not known better, so what happens within it is one event.
INSTANT = 1e-9
NO_ROOT = -1.0
_NARROWEST, _EPSILON, _SMALL = 2.0**-44, 2.0**-52, 2.0**-10
_SPAN, _START = 30, 31  # where the root search keeps an interval's width and left end


@inner_kernel
def halves(a, row, n):
    """The coefficients of 1 to tau^7 and of tau^8 to tau^15 of a polynomial of degree n."""
    return lanes.upto(lanes.load(a, row, 0), n), lanes.upto(
        lanes.load(a, row, lanes.LANES), n - lanes.LANES
    )


@inner_kernel
def eighth(tau):
    """tau^8, by which the terms of the second half exceed those of the first one."""
    square = tau * tau
    return (square * square) * (square * square)


@inner_kernel
def product(a, x, y, k):
    """Coefficient k of the product of two rows."""
    total = 0.0
    for j in range(k + 1):
        total += a[x, j] * a[y, k - j]
    return total


@inner_kernel
def value(a, row, n, tau):
    """c(tau) for a polynomial of degree n."""
    low, high = halves(a, row, n)
    return lanes.total((low + high * eighth(tau)) * lanes.powers(tau))


@inner_kernel
def _rates(a, row, n):
    """The halves of the slope of c."""
    return (
        lanes.upto(lanes.load(a, row, 1), n - 1) * (lanes.ramp() + 1.0),
        lanes.upto(lanes.load(a, row, lanes.LANES + 1), n - 1 - lanes.LANES) * (lanes.ramp() + 9.0),
    )


@inner_kernel
def slope(a, row, n, tau):
    """dc/dtau at tau for a polynomial of degree n >= 1."""
    low, high = _rates(a, row, n)
    return lanes.total((low + high * eighth(tau)) * lanes.powers(tau))


@inner_kernel
def least_change(low, high, h):
    """A bound from below on c(tau) - c(0) for 0 <= tau <= h, at most 0.

    `low` and `high` are the halves of c. Negative terms count in full. Positive terms may only
    cancel negative terms of higher order: c_1 those of c_2 and all others, c_2 those of the others.
    NaN in the input gives no bound.
    """
    low, high = low * lanes.powers(h), high * (eighth(h) * lanes.powers(h))
    least = lanes.total(lanes.above(lanes.falls(low), 2) + lanes.falls(high))
    once = lanes.shifted(low)
    for term in (lanes.first(lanes.shifted(once)), lanes.first(once)):
        least = min(least + term, 0.0)
    return least


@inner_kernel
def only_falls(a, row, n, tau):
    """Whether c is known to fall from 0 to tau."""
    low, high = _rates(a, row, n)
    return lanes.first(low) < least_change(low * -1.0, high * -1.0, tau)


@inner_kernel
def may_top(a, row, rate, n, tau, level):
    """Whether c may turn back above a level between 0 and tau; `rate` is the row of its slope."""
    low, high = halves(a, row, n)
    if not a[row, 0] - least_change(low * -1.0, high * -1.0, tau) > level:
        return False
    low, high = halves(a, rate, n - 1)
    return a[rate, 0] + least_change(low, high, tau) < 0.0


@inner_kernel
def differentiate(a, row, rate, n):
    """Writes the slope of c, a polynomial of degree n, as a row."""
    low, high = _rates(a, row, n)
    lanes.store(a, rate, 0, low)
    lanes.store(a, rate, lanes.LANES, high)


@inner_kernel
def size_of(a, one, other, k):
    """The size of two series' coefficients of order k."""
    return abs(a[one, k]) + abs(a[other, k])


@inner_kernel
def step_size(a, one, other, order, last_term, reach):
    """The step, at most `reach`, whose last two terms of two series stay below `last_term`."""
    return longest_step(
        size_of(a, one, other, order), size_of(a, one, other, order - 1), order, last_term, reach
    )


@inner_kernel
def longest_step(last, before, order, last_term, reach):
    """The step, at most `reach`, at which the last two terms of a series stay below `last_term`.

    `last` and `before` are the sizes of these terms. The term before the last one bounds the step,
    as long as terms fall: the logarithm of the other is then not needed.
    """
    longest = _step_of_term(before, order - 1, last_term)
    if not last * longest <= before:
        longest = min(longest, _step_of_term(last, order, last_term))
    return min(reach, longest)


@inner_kernel
def _step_of_term(size, k, last_term):
    """The step at which the term of order k, of this size, is `last_term`.

    In a step shorter than the unit of time the error of the velocity, h times fewer, is the larger
    one.
    """
    if not size > 0.0:
        return math.inf
    spare = math.log(last_term / size)
    return math.exp(spare / k if spare > 0.0 else spare / (k - 1))


@inner_kernel
def force_step(a, row, order, tolerance, reach):
    """The step at which the last two terms of a force stay below the tolerance, at most `reach`.

    An error of its rate moves nothing.

    Friction that winds up under a constant acceleration is a series of every fourth power. So the
    two terms before count, too. Limit of term k: tolerance^(k/(order-1)), for geometric decay.
    """
    longest, bound = math.inf, math.log(tolerance)  # logarithms
    for k in range(max(order - 3, 1), order + 1):
        if a[row, k] != 0.0:
            longest = min(
                longest, (bound * min(k / (order - 1), 1.0) - math.log(abs(a[row, k]))) / k
            )
    return min(reach, math.exp(longest))


@inner_kernel
def leading(a, row, n, floor, ahead):
    """The sign with which c leaves tau = 0: +1 or -1; 0 where c is zero throughout `ahead`.

    `ahead` is at most AHEAD.
    """
    k = _order_of_zero(a, row, n, floor, ahead)
    if k > n:
        return 0
    return 1 if a[row, k] > 0.0 else -1


@inner_kernel
def _order_of_zero(a, row, n, floor, ahead):
    """The index of the first coefficient of c that counts; n + 1 where there is none.

    A coefficient counts as zero if it is rounding (below `floor`, see NOISE), alone or with the
    noise before it, or if the sign turns within an INSTANT. So a guard that has just fired, and is
    zero by construction, does not fire again.
    """
    noise = floor
    scale = _ERROR
    # Later terms may grow without bound where friction nearly jams the pivot (Painleve).
    for k in range(min(n, 2) + 1):
        noise = max(noise, abs(a[row, k]) * scale)
        scale *= ahead
    scale = 1.0
    total = 0.0
    for k in range(n + 1):
        total += a[row, k] * scale
        if abs(a[row, k]) * scale > noise and math.copysign(total, total * a[row, k]) > noise:
            soon = a[row, k] + (k + 1) * a[row, k + 1] * INSTANT if k < n else a[row, k]
            # A gap that a rebound opens ends in an impact, however soon.
            turns = a[row, k] * soon < 0.0 and (k > 1 or soon > 0.0)
            if not turns:
                return k
        scale *= ahead
    return n + 1


@called_kernel
def first_root(a, row, n, h, until, floor, ahead, stack):
    """The first tau in [0, h] at which c turns negative, or NO_ROOT.

    A root after `until` may also be NO_ROOT. A zero at tau = 0 (within `floor`) is divided out: 0.0
    comes back only where c leaves it downward. `stack` is scratch of shape (>= 48, WIDTH). The
    search is complete: an interval is dropped only where a bound on the polynomial, or on its slope
    and end value, shows that it holds no root. Touching zero without crossing is no root.
    """
    if a[row, 0] > floor:
        low, high = halves(a, row, n)
        if a[row, 0] + least_change(low, high, until) > _ERROR * a[row, 0]:
            return NO_ROOT
    zeros = _order_of_zero(a, row, n, floor, ahead)
    lift = 0.0
    if zeros > n:
        # Noise within AHEAD may grow beyond noise in a long step.
        low, high = halves(a, row, n)
        if a[row, 0] + least_change(low, high, h) > -floor:
            return NO_ROOT
        zeros, lift = 0, floor if a[row, 0] > -floor else floor - a[row, 0]
    elif a[row, zeros] < 0.0:
        return 0.0
    terms = lanes.powers(h)
    lanes.store(stack, 0, 0, lanes.load(a, row, zeros) * terms)
    lanes.store(
        stack, 0, lanes.LANES, lanes.load(a, row, zeros + lanes.LANES) * (terms * eighth(h))
    )
    stack[0, 0] += lift
    z = _isolate(stack, n - zeros)
    return NO_ROOT if z < 0.0 else z * h


@called_kernel
def highest(a, row, rate, scratch, n, tau, stack):
    """The largest value of c at its start and at its tops up to tau, and where that is.

    `rate` is the row of its slope, `scratch` a free one. The slope is followed from one of its
    roots to the next: where it turns negative, c is at a top.
    """
    top, at, t, once = a[row, 0], 0.0, 0.0, only_falls(a, rate, n - 1, tau)
    for k in range(n):
        a[scratch, k] = a[rate, k]
    for turn in range(n):
        noise = NOISE[Kind.POSITION]
        root = first_root(a, scratch, n - 1, tau - t, tau - t, noise, AHEAD, stack)
        if not root >= 0.0:  # none, or not finite
            break
        t += root
        if turn % 2 == 0:
            here = value(a, row, n, t)
            if here > top:
                top, at = here, t
        if once:
            break
        _turn_over(a, scratch, n, root)
    return top, at


@inner_kernel
def _turn_over(a, row, n, t):
    """A polynomial of n terms as it is seen from t, and with the other sign."""
    for i in range(n):
        for k in range(n - 2, i - 1, -1):
            a[row, k] += t * a[row, k + 1]
        a[row, i] *= -1.0


@inner_kernel
def _isolate(stack, n):
    """First root on [0, 1] of the polynomial in stack[0], positive at 0; NaN if not finite.

    Halves intervals, left ones first. Below the top, the stack holds left halves whose right halves
    are still to be searched.
    """
    top = 0
    stack[0, _SPAN], stack[0, _START] = 1.0, 0.0
    while top >= 0:
        width, begin = stack[top, _SPAN], stack[top, _START]
        if stack[top, 0] <= 0.0:
            return begin
        low, high_slope, end = _bounds(stack, top, n)
        if not math.isfinite(end):  # no halving would end
            return np.nan
        rootless = low > 0.0 or (high_slope < 0.0 and end > 0.0)
        if not rootless and high_slope < 0.0:
            return begin + width * _falling_root(stack, top, n, end)
        if rootless or width == _NARROWEST or top + 2 >= stack.shape[0]:
            top -= 1
            _to_right_half(stack, top, n)
        else:
            _halve(stack, top, n)
            top += 1
    return NO_ROOT


@inner_kernel
def _bounds(stack, top, n):
    """A bound from below on [0, 1], one of the slope from above, and the end value."""
    low, high_slope, end = 0.0, 0.0, 0.0
    for k in range(n, 0, -1):
        low = min(low, 0.0) + stack[top, k]
        high_slope = max(high_slope, 0.0) + k * stack[top, k]
        end += stack[top, k]
    return stack[top, 0] + min(low, 0.0), high_slope, stack[top, 0] + end


@inner_kernel
def _to_right_half(stack, top, n):
    """The Taylor shift of a left half by one interval."""
    if top < 0:
        return
    for i in range(n):
        for k in range(n - 1, i - 1, -1):
            stack[top, k] += stack[top, k + 1]
    stack[top, _START] += stack[top, _SPAN]


@inner_kernel
def _halve(stack, top, n):
    """Halves an interval: its left half in place, once more above it."""
    half = 1.0
    for k in range(n + 1):
        stack[top, k] *= half
        stack[top + 1, k] = stack[top, k]
        half *= 0.5
    stack[top, _SPAN] = stack[top + 1, _SPAN] = 0.5 * stack[top, _SPAN]
    stack[top + 1, _START] = stack[top, _START]


@inner_kernel
def _falling_root(stack, row, n, end):
    """The root in [0, 1] of a polynomial that falls from positive to `end` <= 0.

    Newton's method from the root of a parabola, kept inside its bracket. It ends where the step
    after the next one, if they go on shrinking quadratically, would be below rounding.
    """
    low, high = halves(stack, row, n)
    low_slope, high_slope = _rates(stack, row, n)
    a, b = 0.0, 1.0
    begin, fall = stack[row, 0], -stack[row, 1]
    z = min(
        2.0
        * begin
        / (fall + math.sqrt(max(fall * fall - 4.0 * begin * (end - begin + fall), 0.0))),
        1.0,
    )
    last = 0.0
    for _ in range(100):
        terms, far = lanes.powers(z), eighth(z)
        f = lanes.total((low + high * far) * terms)
        gradient = lanes.total((low_slope + high_slope * far) * terms)
        if f > 0.0:
            a = z
        else:
            b = z
        new = z - f / gradient
        newton = a <= new <= b
        if not newton:
            new = 0.5 * (a + b)
        step = abs(new - z)
        rounding = _EPSILON * (abs(new) + _SMALL * b)
        if step <= rounding or step * step * step <= rounding * last * last:
            return new
        z, last = new, step if newton else 0.0
    return z
