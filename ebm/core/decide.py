"""When the outcome and the peak of a run are certain before its end. Only spectra ask for it."""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.ground import GAUSSIAN, STILL, acceleration, impulse_ahead, largest_ahead
from rockcheck.ebm.core.motion import (
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    HEIGHT,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    VY,
    S,
    W,
    side_of,
)
from rockcheck.ebm.core.running import PIVOT, QUIET, SWUNG, T
from rockcheck.ebm.core.series import NOISE, POSITION
from rockcheck.scenes.compiled import inner_kernel

# A pulse is over when its acceleration is below this share of the tolerance. The second is the
# energy bound's margin where impacts may add energy.
_LEFT, _MARGIN = 1e-3, 0.9
#: Steps of a swing, from one impact to the next.
_STEPS = 4.0
_TINIEST = math.ulp(0.0)


@inner_kernel
def quiet_from(gh, gv, tolerance):
    """The time from which the base stands still as far as an outcome can tell."""
    if gv.kind == STILL and gh.kind == GAUSSIAN:
        return gh.centre + math.sqrt(-math.log(_LEFT * tolerance) / gh.rate)
    return 0.0 if gv.kind == STILL and gh.kind == STILL else max(gh.quiet, gv.quiet)


@inner_kernel
def decided(b, m, z, gh, gv, t, quiet, peak):
    """The final peak rotation (>= pi/2: overturns) if the rest of the motion is certain, else
    -1."""
    still = gv.kind == STILL
    ahead = 0.0
    if t < quiet:
        at_its_peak = (
            t <= gh.quiet and abs(z[THETA]) >= peak
        )  # which is not certain, however little is to come
        ahead = math.inf if at_its_peak or not still else impulse_ahead(gh, t)
    verdict = _by_energy(b, m, z, ahead, peak)
    if verdict <= 0.0 and still and abs(z[THETA]) > side_of(b, z[THETA]).alpha:
        verdict = _falls(b, m, z, gh, t)
    return verdict


@inner_kernel
def _by_energy(b, m, z, ahead, peak):
    """What the energy that the block has and can still gain says of its outcome.

    `ahead` bounds the integral of |u| to come, I. The energy E of block and floor, counted from
    standing, grows by no other work: dE/dt <= |u| sqrt(2 E), so that sqrt(2 E) grows by at most I.
    A block that can never reach the energy of standing on its lower corner cannot overturn: it is
    safe once that energy cannot lift it, on either corner, above the peak it has had. After the
    excitation a block that only rocks conserves its energy up to its next impact, so that its peak
    is known at once, unless with as much it would turn farther on its other corner.
    """
    phi = abs(z[THETA])
    if ahead > 0.0 and phi >= peak:
        return -1.0
    energy = energy_of(b, z)
    side, other = side_of(b, m[S]), side_of(b, -m[S])
    corner = min(side.radius, other.radius) - b.height
    most = 0.5 * (math.sqrt(2.0 * max(energy, 0.0)) + ahead) ** 2
    margin = _MARGIN if b.walls else 1.0
    rocks = (
        m[FAMILY] == TILT
        and m[FLOOR] == STICK
        and m[TIP] == 0
        and m[FAR] == 0
        and not b.walls
        and ahead == 0.0
    )
    rocks = rocks and (b.no_slip or _sticks_for_good(b, energy))
    if most < corner and phi < side.alpha:
        highest = _highest(b, side, most)
        beyond = _highest(b, other, most)
        if rocks and beyond <= max(peak, highest):
            return max(peak, highest if m[S] * z[W] > 0.0 else phi)
        return (
            max(peak, _TINIEST) if max(highest, beyond) <= peak and most < margin * corner else -1.0
        )
    if rocks and m[S] * z[W] >= 0.0 and (phi > side.alpha or energy > side.radius - b.height):
        return 0.5 * math.pi
    return -1.0


@inner_kernel
def energy_of(b, z):
    """The block's energy relative to the floor, counted from standing."""
    return 0.5 * (z[VX] * z[VX] + z[VY] * z[VY] + z[W] * z[W] / b.spin) + z[HEIGHT] - b.height


@inner_kernel
def swings_again(b, m, energy, pivot, tolerance, now):
    """Whether this swing, which turns back in a step that starts now with this energy, is the last
    one again: then so are all to come.

    After the excitation the energy and the place of the pivot are all that a swing depends on.
    Beside a wall that takes no energy a block may rock so for ever, however near its balance it
    turns back. Only what sticks to the floor and touches no wall swings.
    """
    if now[T] < now[QUIET] or m[FLOOR] != STICK or m[TIP] != 0 or m[FAR] != 0:
        return False
    place = m[S] * pivot
    error = swing_error(tolerance)
    again = (
        abs(energy - now[SWUNG]) <= error * math.sqrt(2.0 * max(energy, 0.0))
        and abs(place - now[PIVOT]) <= error
    )
    now[SWUNG], now[PIVOT] = energy, place
    return again


@inner_kernel
def swing_error(tolerance):
    """The error of rotation and speed after a swing: a step errs by the tolerance, or by rounding.
    Energy errs by that times the speed."""
    return _STEPS * (tolerance + NOISE[POSITION])


@inner_kernel
def _highest(b, side, energy):
    """The rotation on this side to which so much energy lifts the block."""
    return side.alpha - math.acos(min((b.height + energy) / side.radius, 1.0))


@inner_kernel
def _falls(b, m, z, gh, t):
    """pi/2 if a block past its balance point falls whatever the rest of the excitation does, else
    -1.

    Turning outward, beyond tan(phi - alpha) > mu and > |u| for all time to come, it is accelerated
    outward in every mode: sticking by (3), slipping by (7), by an impulse of the floor, or not at
    all in flight. Walls it could meet are left out.
    """
    if m[FAMILY] == FLAT or m[S] * z[W] < 0.0 or (b.gap_left if m[S] > 0 else b.gap_right) < np.inf:
        return -1.0
    steepness = math.tan(abs(z[THETA]) - side_of(b, m[S]).alpha)
    if (
        (not b.no_slip and steepness <= b.mu_s)
        or steepness <= abs(acceleration(gh, t))
        or steepness <= largest_ahead(gh, t)
    ):
        return -1.0
    return 0.5 * math.pi


@inner_kernel
def _sticks_for_good(b, energy):
    """Whether neither pivot can slip in free rocking of this energy (up to its balance point),
    impacts included."""
    return _pivot_sticks(b, b.left, energy) and _pivot_sticks(b, b.right, energy)


@inner_kernel
def _pivot_sticks(b, side, energy):
    """Whether this pivot sticks while the block rocks about it, and as it lands on it.

    With k = 1/(I + R^2): |Q| <= max(k s c, s w^2) and P >= 1 - k s^2 - R w^2, with w^2 <= 2 k
    energy; the landing sticks if mu >= k s c/(1 - k s^2), for a homogeneous block 3 t/(4 + t^2), t
    = tan alpha.
    """
    s, c = side.arm, b.height
    square = 2.0 * side.share * energy
    push = 1.0 - side.share * s * s - side.radius * square
    # s c rises with s only up to 45 degrees.
    pull = side.share * (s * c if side.alpha < 0.25 * math.pi else 0.5 * side.radius * side.radius)
    lands = side.share * s * c / (1.0 - side.share * s * s)
    return push > 0.0 and b.mu_s * push >= max(pull, s * square) and b.mu_s >= lands
