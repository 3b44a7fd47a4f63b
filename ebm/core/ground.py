"""Ground motion for compiled code: value, Taylor series, kinks, next passage of a level.

Natural units throughout: acceleration in g, time in sqrt(R/g).

A new kind of excitation is a member of `Shape` (`core.names`) and a branch in each of these:

| function | what it says of the shape |
|---|---|
| `ground_of` | its numbers, in natural units |
| `_with_rate` | the acceleration and its rate |
| `fill_series` | the Taylor series of the acceleration |
| `next_kink` | when the acceleration or its rate jumps next |
| `_next_extremum` | when the acceleration is largest or least next |
| `largest_ahead` | a bound of the acceleration from a time on |

A branch that is forgotten leaves the base at rest, or the bound infinite. The numbers c0 to c3 go
with that power of 1/time, `rate` with 1/time (of GAUSSIAN with 1/time^2): `packing` and `natural`
change units by this rule.
"""

import math
from typing import NamedTuple

import numpy as np

from rockcheck.ebm.core.names import Shape
from rockcheck.ebm.core.series import RECIPROCAL
from rockcheck.scenes import Excitation, Floats, Record, Rest, Ricker, Wave, Wavelet
from rockcheck.scenes.compiled import inner_kernel
from rockcheck.scenes.named_record import filled, record

NEVER = np.inf


#: One component of the base motion but for its samples. GAUSSIAN is (c0 + c1 tau + c2 tau^2 + c3
#: tau^3) exp(-rate tau^2), tau from `centre`; SINE is c0 sin(rate tau) up to `quiet`; SAMPLED is
#: linear between `scale` times the samples, every `step`, of which it has `count` from `first` on.
#: WAVELET is the sum of -share (c0 sin(w tau) + c1/rate cos(w tau)) over the angular rates w = rate
#: and rate +- pi/(quiet - centre), with the shares 1/2 and 1/4 times w/rate.
#: After `quiet` there is no motion.
FORM = record(
    kind="i8",
    c0="f8",
    c1="f8",
    c2="f8",
    c3="f8",
    rate="f8",
    centre="f8",
    quiet="f8",
    step="f8",
    scale="f8",
    first="i8",
    count="i8",
)


class Ground(NamedTuple):
    """One component of the base motion: its FORM, and its samples."""

    form: np.record
    samples: Floats


_NO_SAMPLES = np.zeros(1)
#: Times that differ by less than this share of a sample interval, or of a pulse's width, are the
#: same time. Rounding of a double.
_SAME, _EPSILON = 2.0**-30, 2.0**-52
#: Newton's method finds a root in fewer trials, or not at all.
_SOME = 30
#: The sign with which an acceleration leaves zero is read this much later.
_SOON = 1e-6


def ground_of(excitation: Excitation, gravity: float, time_unit: float) -> Ground:
    """The compiled form of an excitation, in units of `gravity` (m/s^2) and `time_unit` (s)."""
    samples, given = _NO_SAMPLES, {"kind": Shape.STILL, "quiet": 0.0}
    if isinstance(excitation, Ricker):
        given = {
            f"c{k}": c * time_unit**k / gravity for k, c in enumerate(excitation.polynomial)
        } | {
            "kind": Shape.GAUSSIAN,
            "rate": excitation.rate * time_unit**2,
            "centre": excitation.centre / time_unit,
        }
    elif isinstance(excitation, Wave):
        given = {
            "kind": Shape.SINE,
            "c0": excitation.amplitude / gravity,
            "rate": 2.0 * math.pi * time_unit / excitation.period,
            "centre": -excitation.lead / time_unit,
        }
    elif isinstance(excitation, Wavelet):
        rate = 2.0 * math.pi / excitation.period
        given = {
            "kind": Shape.WAVELET,
            "c0": excitation.amplitude * math.cos(excitation.phase) / gravity,
            "c1": excitation.amplitude * math.sin(excitation.phase) / gravity * rate * time_unit,
            "rate": rate * time_unit,
            "centre": 0.5 * excitation.quiet_after / time_unit,
        }
    elif isinstance(excitation, Record):
        taken = np.ascontiguousarray(excitation.samples / gravity)
        if taken.any():
            samples = taken
            given = {
                "kind": Shape.SAMPLED,
                "step": excitation.time_step / time_unit,
                "scale": 1.0,
            }
    elif not isinstance(excitation, Rest):
        raise NotImplementedError(f"{excitation.kind}: no shape of `ebm.core.ground` is its")
    quiet = {"quiet": excitation.quiet_after / time_unit}
    return Ground(filled(FORM, **quiet | given, count=len(samples)), samples)


@inner_kernel
def interval(g, t):
    """Index of the sample interval that holds t; its right end belongs to the next one."""
    return int(math.floor(t / g.form.step + _SAME))


@inner_kernel
def acceleration(g, t):
    """Acceleration at time t; where it jumps (at the end of some) that just after."""
    return _with_rate(g, t)[0]


@inner_kernel
def _with_rate(g, t):
    """Acceleration at time t, and its rate; where they jump those just after."""
    if g.form.kind == Shape.GAUSSIAN:
        tau = t - g.form.centre
        bell, fall = math.exp(-g.form.rate * tau * tau), -2.0 * g.form.rate * tau
        shape = g.form.c0 + tau * (g.form.c1 + tau * (g.form.c2 + tau * g.form.c3))
        return shape * bell, (
            g.form.c1 + tau * (2.0 * g.form.c2 + tau * 3.0 * g.form.c3) + shape * fall
        ) * bell
    if g.form.kind == Shape.SINE and t < g.form.quiet:
        phase = g.form.rate * (t - g.form.centre)
        return g.form.c0 * math.sin(phase), g.form.c0 * g.form.rate * math.cos(phase)
    if g.form.kind == Shape.WAVELET and t < g.form.quiet:
        return _wavelet(g.form, t)
    if g.form.kind == Shape.SAMPLED:
        i = interval(g, t)
        if i + 1 < g.samples.size:
            here = g.form.scale * g.samples[i]
            rise = g.form.scale * g.samples[i + 1] - here
            return here + (t / g.form.step - i) * rise, rise / g.form.step
    return 0.0, 0.0


@inner_kernel
def _component_of_wavelet(f, k):
    """The angular rate of component k of a wavelet, and the size of its acceleration by c0."""
    w = f.rate + (k - 1.0) * math.pi / (f.quiet - f.centre)
    return w, -(0.5 if k == 1 else 0.25) * w / f.rate


@inner_kernel
def _wavelet(f, t):
    """Acceleration of a wavelet at time t, and its rate."""
    value, slope = 0.0, 0.0
    for k in range(3):
        w, share = _component_of_wavelet(f, k)
        sine, cosine = math.sin(w * (t - f.centre)), math.cos(w * (t - f.centre))
        value += share * (f.c0 * sine + f.c1 / f.rate * cosine)
        slope += share * w * (f.c0 * cosine - f.c1 / f.rate * sine)
    return value, slope


@inner_kernel
def _fill_wavelet(g, t, sign, n, a, row):
    f = g.form
    for k in range(n + 1):
        a[row, k] = 0.0
    for component in range(3):
        w, share = _component_of_wavelet(f, component)
        sine, cosine = math.sin(w * (t - f.centre)), math.cos(w * (t - f.centre))
        here = sign * share * (f.c0 * sine + f.c1 / f.rate * cosine)
        after = sign * share * w * (f.c0 * cosine - f.c1 / f.rate * sine)
        for k in range(n + 1):
            a[row, k] += here
            here, after = after, -w * w * here * RECIPROCAL[k + 1] * RECIPROCAL[k + 2]


@inner_kernel
def _fill_gaussian(g, t, sign, n, a, row):
    tau = t - g.form.centre
    size = sign * math.exp(-g.form.rate * tau * tau)
    q0 = size * (g.form.c0 + tau * (g.form.c1 + tau * (g.form.c2 + tau * g.form.c3)))
    q1 = size * (g.form.c1 + tau * (2.0 * g.form.c2 + 3.0 * tau * g.form.c3))
    q2 = size * (g.form.c2 + 3.0 * tau * g.form.c3)
    q3 = size * g.form.c3
    # Coefficients k to k-3 of the bell by its value, which obeys bell' = -2 rate tau bell.
    bell, e1, e2, e3 = 1.0, 0.0, 0.0, 0.0
    spread = -2.0 * g.form.rate
    fall = spread * tau
    for k in range(n + 1):
        a[row, k] = q0 * bell + q1 * e1 + q2 * e2 + q3 * e3
        r = RECIPROCAL[k + 1]
        # Two operations from one coefficient to the next.
        bell, e1, e2, e3 = (fall * r) * bell + (spread * r) * e1, bell, e1, e2


@inner_kernel
def fill_series(g, t, sign, n, a, row):
    """Taylor coefficients 0..n of sign * acceleration about t, to the right of t, into a[row]."""
    if g.form.kind == Shape.GAUSSIAN:
        _fill_gaussian(g, t, sign, n, a, row)
        return
    if g.form.kind == Shape.WAVELET and t < g.form.quiet:
        _fill_wavelet(g, t, sign, n, a, row)
        return
    value, rate = _with_rate(g, t)
    a[row, 0], a[row, 1] = sign * value, sign * rate
    for k in range(2, n + 1):
        a[row, k] = 0.0
        if g.form.kind == Shape.SINE:
            a[row, k] = -g.form.rate * g.form.rate * a[row, k - 2] / (k * (k - 1))


@inner_kernel
def next_kink(g, t):
    """The next time after t at which the motion is not smooth, or its series not to be trusted.

    In the rise of a pulse exp(-rate tau^2) the terms of a series still grow where it is cut off,
    unless the step is short.
    """
    if g.form.kind == Shape.GAUSSIAN:
        tau = t - g.form.centre
        if tau >= 0.0 or g.form.rate * tau * tau < 4.0:
            return NEVER
        return (
            g.form.centre - 6.0 / math.sqrt(g.form.rate)
            if g.form.rate * tau * tau > 36.0001
            else t - 4.0 / (g.form.rate * tau)
        )
    if g.form.kind == Shape.SAMPLED:
        i = interval(g, t)
        return (i + 1) * g.form.step if i + 1 < g.samples.size else NEVER
    ends = g.form.kind == Shape.SINE or g.form.kind == Shape.WAVELET
    return g.form.quiet if ends and t < g.form.quiet else NEVER


@inner_kernel
def smooth_until(base, t):
    """The next kink after t of either component of the base motion."""
    return min(next_kink(base.horizontal, t), next_kink(base.vertical, t))


@inner_kernel
def acceleration_after(g, t):
    """Acceleration soon after t, before the next kink: its sign tells how it leaves a zero at t."""
    return acceleration(g, _soon(g, t))


@inner_kernel
def _soon(g, t):
    return min(t + _SOON, 0.5 * (t + next_kink(g, t)))


@inner_kernel
def weightless_at(g, t):
    """The time at which vertical base motion begins to fall away with more than 1 g.

    Only if it does so between t and soon after t; else t.
    """
    now, after = 1.0 + acceleration(g, t), 1.0 + acceleration_after(g, t)
    return t + (_soon(g, t) - t) * now / (now - after) if now > 0.0 > after else t


@inner_kernel
def _root_of_square(a, b, c, branch):
    """One root of a q^2 + b q + c; -1 where it is none."""
    if a == 0.0:
        return -c / b if b != 0.0 else -1.0
    return (-b + branch * math.sqrt(max(b * b - 4.0 * a * c, 0.0))) / (2.0 * a)


@inner_kernel
def _next_extremum_of_pulse(f, t):
    # Extrema within _SAME pulse widths of t count as passed, or rounding would find the same one
    # for ever.
    past = t - f.centre + _SAME / math.sqrt(f.rate)
    best = NEVER
    # (c0 + c2 tau^2) bell: at 0 and where c2 = rate (c0 + c2 tau^2).
    if f.c1 == 0.0 and f.c3 == 0.0:
        a, b, c = 0.0, -f.rate * f.c2, f.c2 - f.rate * f.c0
        if past < 0.0:
            best = 0.0
    else:  # (c1 tau + c3 tau^3) bell: c1 + (3 c3 - 2 rate c1) q - 2 rate c3 q^2 = 0 with q = tau^2
        a, b, c = (
            -2.0 * f.rate * f.c3,
            3.0 * f.c3 - 2.0 * f.rate * f.c1,
            f.c1,
        )
    for branch in (-1.0, 1.0):
        square = _root_of_square(a, b, c, branch)
        place = math.sqrt(max(square, 0.0))
        for root in (-place, place):
            if square > 0.0 and root > past:
                best = min(best, root)
    return best + f.centre if best < NEVER else NEVER


@inner_kernel
def _next_extremum_of_wavelet(f, t):
    """The next extremum of a wavelet after t, or its end.

    No step is so long that its rate, which changes at most by `curvature` a time, could pass zero
    within it, but for the shortest ones.
    """
    if t >= f.quiet:
        return NEVER
    size, curvature, fastest = math.hypot(f.c0, f.c1 / f.rate), 0.0, 0.0
    for k in range(3):
        w, share = _component_of_wavelet(f, k)
        curvature += abs(share) * size * w * w
        fastest = max(fastest, w)
    shortest = _SOON / fastest
    a = t + _SAME / fastest
    slope = _wavelet(f, a)[1]
    while a < f.quiet:
        b = min(a + max(abs(slope) / curvature, shortest), f.quiet)
        there = _wavelet(f, b)[1]
        if slope * there < 0.0:
            for _ in range(_SOME):
                middle = 0.5 * (a + b)
                if slope * _wavelet(f, middle)[1] > 0.0:
                    a = middle
                else:
                    b = middle
            return b
        a, slope = b, there
    return f.quiet


@inner_kernel
def _next_extremum(g, t):
    """The next time after t up to which the motion is monotone.

    NEVER where it is monotone (and dying out) for good.
    """
    if g.form.kind == Shape.GAUSSIAN:
        return _next_extremum_of_pulse(g.form, t)
    if g.form.kind == Shape.WAVELET:
        return _next_extremum_of_wavelet(g.form, t)
    end = next_kink(g, t)
    if g.form.kind != Shape.SINE or end == NEVER:
        return end
    quarter = 0.5 * math.pi / g.form.rate
    k = math.floor(((t - g.form.centre) / quarter + 1.0) / 2.0 + _SAME)
    return min((2.0 * k + 1.0) * quarter + g.form.centre, end)


@inner_kernel
def largest_ahead(g, t):
    """A bound on |acceleration| from time t on.

    The largest of its value now and at the extrema to come; of a record the largest sample.
    """
    if t > g.form.quiet or g.form.kind == Shape.STILL:
        return 0.0
    if g.form.kind == Shape.SINE:
        return abs(g.form.c0)
    if g.form.kind == Shape.WAVELET:  # the shares add up to at most 1.5 in size
        return 1.5 * math.hypot(g.form.c0, g.form.c1 / g.form.rate)
    largest = 0.0
    if g.form.kind == Shape.SAMPLED:
        for i in range(max(interval(g, t), 0), g.samples.size):
            largest = max(largest, abs(g.samples[i]))
        return abs(g.form.scale) * largest
    while t < NEVER:
        largest = max(largest, abs(acceleration(g, t)))
        t = _next_extremum(g, t)
    return largest


@inner_kernel
def impulse_ahead(g, t):
    """A bound on the integral of |acceleration| from time t on.

    Exact in a pulse's last lobe, infinite before it.
    """
    if t > g.form.quiet or g.form.kind == Shape.STILL:
        return 0.0
    tau = t - g.form.centre
    # The last zero, which a symmetric pulse has before it.
    if g.form.kind != Shape.GAUSSIAN or tau < 0.0 or g.form.rate * tau * tau < 1.5:
        return NEVER
    # The velocity of the base is (v0 + v1 tau + v2 tau^2) exp(-rate tau^2).
    v2 = -g.form.c3 / (2.0 * g.form.rate)
    v0 = (2.0 * v2 - g.form.c1) / (2.0 * g.form.rate)
    return abs(v0 + tau * (g.form.c0 + tau * v2)) * math.exp(-g.form.rate * tau * tau)


@inner_kernel
def _passage(g, a, b, fa, fb, level):
    """Where the acceleration, monotone between a and b, passes the level.

    It is inside the level by fa at a and beyond it by fb at b. Newton's method, aimed a little past
    the root so that the bracket closes on it from both sides, and halving where that leads nowhere;
    returns the bracket's outer end.
    """
    rising = fb > 0.0
    close = 2.0 * _EPSILON * abs(b)
    guess = a - fa * (b - a) / (fb - fa)
    for trial in range(200):
        if b - a <= close:
            break
        if not a < guess < b or trial > _SOME:
            guess = 0.5 * (a + b)
            if not a < guess < b:
                break
        here, rate = _with_rate(g, guess)
        beyond = (here > level) == rising and here != level
        past = -close if beyond else close
        if beyond:
            b = guess
        else:
            a = guess
        guess += past - (here - level) / rate
    return b


@inner_kernel
def _leaves(g, times, values, level, beyond, ahead):
    """The time between two `times` at which the acceleration passes the level.

    It is at most `ahead` before the acceleration passes `beyond`. In between the acceleration is
    monotone; `values` are its values at the ends.
    """
    (t, end), (here, there) = times, values
    passed = t
    if (here - level) * (there - level) <= 0.0:
        passed = _passage(g, t, end, here - level, there - level, level)
    soon = passed + ahead
    if soon < end and (acceleration(g, soon) - beyond) * (there - beyond) > 0.0:
        return passed  # it passes the limit by the noise sooner than `ahead`
    left = _passage(g, passed, end, acceleration(g, passed) - beyond, there - beyond, beyond)
    return max(passed, left - ahead)


@inner_kernel
def _just_before(g, t):
    """Acceleration at time t; where a motion ends that just before."""
    if g.form.kind == Shape.SAMPLED:
        return g.form.scale * g.samples[interval(g, t)]
    if g.form.kind == Shape.SINE and t == g.form.quiet:
        return g.form.c0 * math.sin(g.form.rate * (t - g.form.centre))
    return acceleration(g, t)


@inner_kernel
def next_exceedance(g, t, low, high, noise, ahead):
    """The time from t on at which the acceleration leaves [low, high] by `noise`; else NEVER.

    This is when it passes the limit itself, but at most `ahead` before it passes the limit by the
    noise: an acceleration that stays near its limit has not exceeded it.
    """
    here = acceleration(g, t)
    while True:
        if here < low - noise or here > high + noise:
            return t
        end = _next_extremum(g, t)
        if end == NEVER:
            return NEVER
        there = _just_before(g, end)
        if there < low - noise or there > high + noise:
            level, beyond = (low, low - noise) if there < low else (high, high + noise)
            return _leaves(g, (t, end), (here, there), level, beyond, ahead)
        if end <= t:
            return NEVER
        t, here = end, acceleration(g, end)
