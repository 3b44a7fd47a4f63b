"""Hand methods for a block: closed forms, and estimates that engineers use.

They stand beside a simulation and do not judge it: from a few figures of the base motion, a
criterion says whether the block uplifts, slides or overturns, and may estimate how far it moves.
`rockcheck assess` shows how often that agrees with the simulation.

Symbols: g gravity, b and h the block's half width and height, R the distance of the pivot from the
mass's centre, alpha its slenderness angle, p the frequency parameter, mu_s and mu the static and
kinetic friction. SI units, frequencies in Hz.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rockcheck.scenes import Block, Excitation, Pivot, Record, Scene
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, Recording, intensity

#: Samples in one period of a pulse.
_PER_PERIOD = 400
#: Frequencies (Hz) at which the sliding estimate looks for its capacity: ends, how many at first
#: (the spectrum's peaks are wider than these are apart), and again between the two around it, which
#: gives f_es within 0.02 %.
_SLOWEST, _FASTEST, _COUNTS = 0.05, 20.0, (100, 25, 25)
#: Angles, in parts of the last one, at which the rocking estimate compares capacity and demand.
_ANGLES = 20
#: Nodes of Gauss's rule.
_NODES = 64
#: The restitution of a block so wide that Housner's is none: its damping is nearly critical.
_LEAST_RESTITUTION = 1e-6
#: Damping of the spectrum that the sliding estimate uses.
_SLIDING_DAMPING = 0.10


def overturning_velocity(block: Block, gravity: float) -> float:
    """Step of the base's velocity (m/s) that just overturns a block that does not slip.

    sqrt(8 g R (1 - cos alpha)/3)/cos alpha of a homogeneous block: the energy after the step
    equals that of the balance point (Housner 1963).
    """
    pivot = block.weaker_pivot
    energy = 2.0 * gravity * pivot.radius * (1.0 - math.cos(pivot.alpha))
    return math.sqrt(energy / pivot.share) / math.cos(pivot.alpha)


def critical_double_impulse(block: Block, gravity: float) -> float:
    """Velocity (m/s) of two opposite steps of the base in the worst rhythm that just overturn.

    sqrt(8 g R (1 - cos alpha)/3)/cos alpha/(1 + r), r = 1 - 1.5 sin^2 alpha, of a homogeneous
    block that does not slip: the second step comes as the block is back from the swing of the
    first, just after its impact, and adds to r times the velocity that the first gave (after
    Nabeshima and others 2016).
    """
    pivot = block.weaker_pivot
    ratio = 1.0 - 2.0 * pivot.share * math.sin(pivot.alpha) ** 2
    return overturning_velocity(block, gravity) / (1.0 + ratio)


def time_from_balance(pivot: Pivot, gravity: float, start: float, end: float) -> float:
    """Time (s) in which a block that rocks without a slip goes from rest to another angle.

    `start` and `end` are angles from its balance point towards that side (rad); inf where it rests
    at the balance or beyond, from where it does not come. The pivot is that of a pendulum upside
    down, phi'' = p^2 sin(phi), so that phi' = 2 p sin(start/2) sinh(v) with sin(phi/2) =
    sin(start/2) cosh(v), and p t is the integral of 1/cos(phi/2) over v. It is smooth: Gauss's rule
    gives all digits, also near the balance.
    """
    if start <= 0.0:
        return math.inf
    half = math.sin(0.5 * start)
    last = math.acosh(max(math.sin(0.5 * end) / half, 1.0))
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    sines = half * np.cosh(0.5 * last * (1.0 + nodes))  # sin(phi/2)
    turn = 0.5 * last * np.sum(weights / np.sqrt(1.0 - sines**2))
    return float(turn / pivot.frequency_parameter(gravity))


def quarter_period(pivot: Pivot, gravity: float, tilt: float) -> float:
    """Time (s) in which a block that rocks without a slip falls back from a tilt (rad) at rest.

    Without small angles (Housner 1963 for these).
    """
    return time_from_balance(pivot, gravity, pivot.alpha - tilt, pivot.alpha)


def newmark_slip(velocity: float, acceleration: float, resistance: float) -> float:
    """Slip (m) of a sliding block under a rectangular pulse of the base.

    V^2/(2 N) (1 - N/A) for a pulse of `acceleration` A that reaches `velocity` V, against
    `resistance` N = mu g; 0 where A <= N (Newmark 1965).
    """
    if acceleration <= resistance:
        return 0.0
    if resistance <= 0.0:
        return math.inf
    return velocity**2 / (2.0 * resistance) * (1.0 - resistance / acceleration)


def rectangular_pulse_ratio(length: float, frequency_parameter: float) -> float:
    """Least acceleration/(g tan alpha) of a rectangular pulse that overturns a slender block.

    1/(1 - exp(-p t)) for a pulse of `length` t (s) (Housner 1963).
    """
    return 1.0 / -math.expm1(-frequency_parameter * length)


def overturns_without_impact(times: ArrayLike, ratios: ArrayLike) -> bool:
    """Whether a motion of the base overturns a slender block before its first impact.

    `ratios` are a/(g alpha) at `times` in 1/p. From the uplift s0 on, where the ratio first
    exceeds 1: the integral of f(s) exp(-(s - s0)) reaches 1 (linearised equation of motion).
    """
    s, f = np.asarray(times, dtype=float), np.asarray(ratios, dtype=float)
    above = np.flatnonzero(f > 1.0)
    if not above.size:
        return False
    first = int(above[0])
    if first:  # where the line between two samples reaches 1
        part = (1.0 - f[first - 1]) / (f[first] - f[first - 1])
        start = s[first - 1] + part * (s[first] - s[first - 1])
        s, f = np.concatenate([[start], s[first:]]), np.concatenate([[1.0], f[first:]])
    return bool(np.trapezoid(f * np.exp(s[0] - s), s) >= 1.0)


@dataclass(frozen=True)
class Base:
    """A base motion as hand methods see it.

    A and V are its largest horizontal `acceleration` (m/s^2) and `velocity` (m/s); `vertical` is
    its largest vertical acceleration (m/s^2).
    """

    motion: Recording
    acceleration: float
    velocity: float
    vertical: float

    def spectral(self, frequency: float, damping: float) -> float:
        """Pseudo-spectral acceleration (m/s^2) at a frequency."""
        return (
            intensity.spectral_acceleration(self.motion, 1.0 / frequency, damping)
            * GRAVITY_OF_RECORDS
        )


def base_of(scene: Scene) -> Base:
    """The base motion of a scene, up to the scene's end."""
    across, up = (
        replace(one, samples=one.samples[: int(scene.duration / one.time_step * (1 + 1e-12)) + 1])
        for one in (sampled(each, scene.duration) for each in (scene.excitation, scene.vertical))
    )
    return Base(
        motion=across,
        acceleration=intensity.peak_acceleration(across) * GRAVITY_OF_RECORDS,
        velocity=intensity.peak_velocity(across),
        vertical=float(np.max(np.abs(up.samples))),
    )


def sampled(motion: Excitation, duration: float) -> Recording:
    """An excitation as a recording; pulses at `_PER_PERIOD` samples a period."""
    if isinstance(motion, Record):
        samples, step = motion.samples, motion.time_step
    elif motion.kind == "rest":
        samples, step = np.zeros(2), duration
    else:
        step = motion.period / _PER_PERIOD
        samples = motion.acceleration(np.arange(0.0, motion.quiet_after + step, step))
    return Recording(samples=samples, time_step=step, unit="m/s2", form=motion.kind)


def reserve_sliding(scene: Scene, base: Base) -> float:
    """Slip (m) by the reserve-energy estimate of sliding, after ASCE 43-05, Appendix A.

    c_s = 2 mu_e g with mu_e = mu (1 - 0.4 A_v/g). At f_es, the lowest frequency at which the 10 %
    damped spectrum reaches c_s, the slip is c_s/(2 pi f_es)^2; 0 where it never does. The last
    expression was derived, not read: check it against your copy.
    """
    capacity = 2.0 * scene.floor.friction * (scene.gravity - 0.4 * base.vertical)
    if capacity <= 0.0:
        return math.inf
    slower, found = _SLOWEST, _FASTEST
    for count in _COUNTS:
        frequencies = np.geomspace(slower, found, count).tolist()
        reached = (base.spectral(one, _SLIDING_DAMPING) >= capacity for one in frequencies)
        first = next((k for k, above in enumerate(reached) if above), None)
        if first is None:
            return 0.0
        slower, found = frequencies[max(first - 1, 0)], frequencies[first]
    return capacity / (2.0 * math.pi * found) ** 2


def reserve_rocking(scene: Scene, base: Base) -> float:
    """Peak rotation (rad) by the reserve-energy estimate of rocking; infinite: the block overturns.

    In the manner of ASCE 43-05, Appendix A. With a = b/h, per angle th: capacity 2 g (cos th + a
    sin th - 1)/th, inertia C_I = 4/3 (1 + a^2), frequency f = sqrt(2 g (cos th + a sin th - 1)/(C_I
    th^2 h))/(2 pi). Damping from Housner's restitution C_R = 1 - 2 a^2/C_I: gamma = -2 ln C_R,
    gamma/sqrt(4 pi^2 + gamma^2). The smallest th up to alpha whose capacity reaches the spectrum's
    demand. All of it was derived, the standard's text unread: check it against your copy.
    """
    pivot, gravity = scene.block.weaker_pivot, scene.gravity
    a, height = pivot.arm / pivot.height, pivot.height
    inertia = 4.0 / 3.0 * (1.0 + a * a)
    gamma = -2.0 * math.log(max(1.0 - 2.0 * a * a / inertia, _LEAST_RESTITUTION))
    damping = gamma / math.hypot(2.0 * math.pi, gamma)
    for angle in (pivot.alpha * np.arange(1, _ANGLES + 1) / _ANGLES).tolist():
        # cos th - 1 without cancellation
        work = a * math.sin(angle) - 2.0 * math.sin(0.5 * angle) ** 2
        frequency = math.sqrt(2.0 * gravity * work / (inertia * height)) / (2.0 * math.pi * angle)
        if 2.0 * gravity * work / angle >= base.spectral(frequency, damping):
            return float(angle)
    return math.inf


@dataclass(frozen=True)
class Criterion:
    """A hand method.

    `event` is what it predicts: the block "uplifts", "slides" or "overturns". `says` returns
    whether that happens, and the estimated motion, or None without an estimate: in m for a method
    that predicts sliding, in alpha for others.
    """

    name: str
    formula: str
    event: str
    source: str
    holds: str
    says: Callable[[Scene, Base], tuple[bool, float | None]]


def _sliding(estimate: Callable[[Scene, Base], float]) -> Callable[..., tuple[bool, float | None]]:
    return lambda scene, base: ((slip := estimate(scene, base)) > 0.0, slip)


def _rocking(scene: Scene, base: Base) -> tuple[bool, float | None]:
    if base.acceleration <= scene.gravity * scene.block.slope:
        return False, 0.0
    angle = reserve_rocking(scene, base)
    return math.isinf(angle), angle / scene.block.alpha


CRITERIA = (
    Criterion(
        "uplift",
        "a > g tan α",
        "uplifts",
        "statics",
        "exact for a block at rest that does not slide first, without vertical motion",
        # a base that moves to the right tips it over its left corner
        lambda scene, base: (
            any(
                np.max(way * base.motion.samples) > scene.gravity * pivot.arm / pivot.height
                for pivot, way in (
                    (scene.block.pivot("left"), 1.0),
                    (scene.block.pivot("right"), -1.0),
                )
            ),
            None,
        ),
    ),
    Criterion(
        "sliding",
        "a > μ_s g",
        "slides",
        "Coulomb",
        "exact for a block at rest that does not uplift first, without vertical motion",
        lambda scene, base: (base.acceleration > scene.floor.mu_s * scene.gravity, None),
    ),
    Criterion(
        "step of velocity",
        "V ≥ √(8 g R (1 - cos α)/3)/cos α",
        "overturns",
        "Housner 1963",
        "exact for a step of velocity; necessary for a pulse",
        lambda scene, base: (
            base.velocity >= overturning_velocity(scene.block, scene.gravity),
            None,
        ),
    ),
    Criterion(
        "sliding block",
        "V²/(2N) (1 - N/A), N = μ g",
        "slides",
        "Newmark 1965",
        "exact for one rectangular pulse; A and V are the record's peaks",
        _sliding(
            lambda scene, base: newmark_slip(
                base.velocity, base.acceleration, scene.floor.friction * scene.gravity
            )
        ),
    ),
    Criterion(
        "reserve sliding",
        "c_s/(2π f_es)², c_s = 2 μ_e g",
        "slides",
        "after ASCE 43-05, App. A; check against your copy",
        "an estimate; the block slides and does not rock",
        _sliding(reserve_sliding),
    ),
    Criterion(
        "reserve rocking",
        "2g (cos θ + a sin θ - 1)/θ ≥ Sa(f(θ))",
        "overturns",
        "in the manner of ASCE 43-05, App. A; check against your copy",
        "an estimate; the block rocks, does not slide, meets no wall",
        _rocking,
    ),
)
