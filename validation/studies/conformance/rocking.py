"""Phenomena of rocking: uplift, impacts, periods, and what overturns a block.

In go scenes of slender blocks and a cube; out comes the table that `phenomena` joins.
"""

import math
from typing import Any

import numpy as np

from rockcheck.scenes import Block, Floor, Record, Scene, Sine
from rockcheck.validation.criteria import (
    critical_double_impulse,
    overturning_velocity,
    overturns_without_impact,
    quarter_period,
    rectangular_pulse_ratio,
    time_from_balance,
)
from rockcheck.validation.studies.conformance.phenomenon import (
    HOUSNER,
    SLENDER,
    G,
    Motion,
    Phenomenon,
    crossing_time,
    falls,
    worst,
    wrong_outcomes,
)

RAMP_TIME = 4.0  # s: from nothing to 0.4 g
UPLIFT = Scene(
    name="uplift",
    block=SLENDER,
    floor=Floor(friction=0.6),
    excitation=Record.from_samples([0.0, 0.4 * G], time_step=RAMP_TIME),
    duration=RAMP_TIME,
)
TILT = 0.5 * SLENDER.alpha
ROCK = Scene(
    name="rock",
    block=SLENDER,
    floor=Floor(friction=0.6),
    initial_rotation=TILT,
    duration=2.5,
    output_step=1e-3,
)
#: Angular velocity from rest that just reaches the balance point.
CRITICAL = math.sqrt(2.0 * (1.0 - math.cos(SLENDER.alpha))) * SLENDER.frequency_parameter
#: By name, a block that is set in motion so that it just falls, or just does not.
FLICKED = {
    name: Scene(
        name=name,
        block=SLENDER,
        floor=Floor(friction=0.6),
        initial_angular_velocity=share * CRITICAL,
        duration=6.0,
    )
    for name, share in (("tip", 1.03), ("return", 0.97))
}
#: A cube just before its balance and just beyond, in alpha from it.
CUBE, FROM_BALANCE = Block(half_width=0.5, half_height=0.5), 1e-3
BALANCED = tuple(
    Scene(
        name=f"balance-{share:g}",
        block=CUBE,
        floor=Floor(friction=1.0),
        initial_rotation=share * CUBE.alpha,
        duration=3.0,
        output_step=1e-3,
    )
    for share in (1.0 - FROM_BALANCE, 1.0 + FROM_BALANCE)
)

# Hand methods that are exact. Base motions 3 % below and 3 % above the threshold.

MARGINS = (0.97, 1.03)
KICK = 1e-3  # s: duration of a step of the base's velocity
#: The shape whose corner slips least under a step of velocity: not at all if friction is 4/3.
STUBBY = Block(half_width=0.5, half_height=1.0)
#: So slender that its motion is linear and its loss at an impact negligible.
NEEDLE = Block(half_width=0.02, half_height=1.0)
NEEDLE_P = NEEDLE.frequency_parameter
#: How long after the impact the second impulse comes, s, so that an engine's step between them
#: does not count; for that the threshold is higher by 1 %.
DELAY, LATE = 8e-3, 1.01


def pulsed(name: str, block: Block, pulse: Record | Sine, **changed: Any) -> Scene:
    """A block on a floor on which it does not slip, under a pulse."""
    scene = Scene(
        name=name, block=block, excitation=pulse, floor=Floor(friction=1.333), duration=6.0
    )
    return scene.replace(**changed)


STEPS = tuple(
    pulsed(
        f"step-{share:g}",
        STUBBY,
        Record.from_samples([share * overturning_velocity(STUBBY, G) / KICK] * 2, time_step=KICK),
    )
    for share in MARGINS
)
LENGTH = 0.4  # s
RECTANGLE = rectangular_pulse_ratio(LENGTH, NEEDLE_P) * G * NEEDLE.slope
RECTANGLES = tuple(
    pulsed(
        f"rectangle-{share:g}",
        NEEDLE,
        Record.from_samples([share * RECTANGLE] * 2, time_step=LENGTH),
    )
    for share in MARGINS
)
#: One sine of four times the block's frequency, just below the threshold amplitude and above.
SINES = tuple(
    pulsed(
        f"sine-{ratio:g}",
        NEEDLE,
        Sine(amplitude=ratio * G * NEEDLE.alpha, period=0.5 * math.pi / NEEDLE_P, cycles=1),
    )
    for ratio in (5.1, 5.4)
)
#: Towers of one shape under one sine, by R in m: the two small ones fall.
SIZES = {0.25: True, 0.5: True, 1.0: False, 2.0: False, 4.0: False}
TOWERS = tuple(
    pulsed(
        f"tower-{radius:g}",
        Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2)),
        Sine(amplitude=2.0 * 9.80665 * math.tan(0.2), period=0.5, cycles=1),
        gravity=9.80665,
    )
    for radius in SIZES
)


def double_impulse(velocity: float, step: float, delay: float) -> Record:
    """Two opposite steps of the base's velocity, each in two time steps (m/s, s, s).

    The second one comes `delay` after `STUBBY` is back from the swing of the first.
    """
    spin = velocity * STUBBY.weaker_pivot.share * math.cos(STUBBY.alpha) / STUBBY.radius
    # of the swing's top from the balance, by energy
    top = math.acos(math.cos(STUBBY.alpha) + 0.5 * (spin / STUBBY.frequency_parameter) ** 2)
    swing = 2.0 * quarter_period(STUBBY.weaker_pivot, G, STUBBY.alpha - top)
    second = round((swing + delay) / step) + 1
    samples = np.zeros(second + 2)
    samples[1], samples[second] = velocity / step, -velocity / step
    return Record.from_samples(samples, time_step=step)


DOUBLE_IMPULSES = tuple(
    pulsed(
        f"double-impulse-{share:g}",
        STUBBY,
        double_impulse(share * LATE * critical_double_impulse(STUBBY, G), KICK, DELAY),
    )
    for share in MARGINS
)


def uplift(motion: Motion) -> float:
    """The acceleration of uplift over g tan(alpha).

    From there theta'' = p^2 theta + K (t - t0) for small angles, K = 3 cos(alpha) j/(4 R): theta =
    K/p^2 (sinh(p s)/p - s).
    """
    from scipy.optimize import brentq

    rate, level = 0.4 * G / RAMP_TIME, 0.02 * SLENDER.alpha
    p, push = SLENDER.frequency_parameter, 0.75 * math.cos(SLENDER.alpha) * rate / SLENDER.radius
    since = brentq(lambda s: push / p**2 * (math.sinh(p * s) / p - s) - level, 1e-6, 5.0)
    lifted = crossing_time(motion.t, np.abs(motion.theta), level)
    return rate * (lifted - since) / (G * math.tan(SLENDER.alpha))


def first_return(motion: Motion) -> float:
    """When a block that was tilted to the left stands upright, s; NaN if never."""
    return crossing_time(motion.t, -motion.theta, 0.0)


def housner(motion: Motion) -> float:
    """Ratio of angular velocities over the first impact, over Housner's 1 - 1.5 sin^2(alpha).

    The velocities follow from the turning points, by energy.
    """
    alpha = SLENDER.alpha
    after_impact = (motion.t > first_return(motion)) & (motion.t < 2.2)
    swing = float(np.max(-motion.theta[after_impact]))
    after, before = (math.cos(alpha - tilt) - math.cos(alpha) for tilt in (swing, TILT))
    return math.sqrt(max(after, 0.0) / before) / (1.0 - 1.5 * math.sin(alpha) ** 2)


def period(motion: Motion) -> float:
    """Time up to the first impact, over Housner's without small angles."""
    return first_return(motion) / quarter_period(SLENDER.weaker_pivot, G, TILT)


def leaving(before: Motion, beyond: Motion) -> float:
    """Times in which the cube leaves its balance, over the closed form: the worse of both.

    Back to upright, and as far down as 1.5 alpha.
    """
    pivot, start = CUBE.weaker_pivot, FROM_BALANCE * CUBE.alpha
    back = first_return(before) / time_from_balance(pivot, G, start, pivot.alpha)
    down = crossing_time(beyond.t, beyond.theta, 1.5 * CUBE.alpha)
    return worst([back, down / time_from_balance(pivot, G, start, 0.5 * pivot.alpha)], 1.0)


def below_and_above(below: Motion, above: Motion) -> float:
    """Wrong outcomes of two scenes: the first must stand, the second fall."""
    return wrong_outcomes((False, True), (falls(below), falls(above)))


def falls_without_impact(motion: Motion) -> float:
    """1 if the block overturns without having tipped to the other side, else 0."""
    extremes = motion.history.extremes
    other_side = min(extremes.rotation_left, extremes.rotation_right)
    return falls(motion) * float(other_side < 0.01 * NEEDLE.alpha)


def sine_overturns(scene: Scene) -> bool:
    """Whether the sine overturns the needle before its first impact."""
    t = np.linspace(0.0, scene.excitation.quiet_after, 20001)
    return overturns_without_impact(
        NEEDLE_P * t, scene.excitation.acceleration(t) / (G * NEEDLE.alpha)
    )


def sine_outcomes(*motions: Motion) -> float:
    """Wrong outcomes under the sines."""
    return wrong_outcomes(map(sine_overturns, SINES), map(falls_without_impact, motions))


def size_outcomes(*motions: Motion) -> float:
    """Wrong outcomes of the towers."""
    return wrong_outcomes(SIZES.values(), map(falls, motions))


ROCKING = (
    Phenomenon(
        "RC-09",
        "uplift at g tan α",
        (UPLIFT,),
        uplift,
        1.0,
        0.02,
        "of g tan α",
        f"{HOUSNER}; moments about the corner",
        "A block starts to rock too early or too late.",
        "contact points at the very corners: margins, rounded edges, soft contacts",
        theme="corners",
    ),
    Phenomenon(
        "RC-10",
        "Housner's ratio",
        (ROCK,),
        housner,
        1.0,
        0.01,
        "of 1 − 1.5 sin² α",
        HOUSNER,
        "Rocking dies too fast or too slowly.",
        "one step for an impact: stiffness and damping of the contact; corner contacts",
        theme="penetration",
    ),
    Phenomenon(
        "RC-11",
        "free-rocking period",
        (ROCK,),
        period,
        1.0,
        0.01,
        "of the quarter period",
        HOUSNER,
        "Amplification is found at another frequency.",
        "inertia of the block; contact points at the very corners; hidden damping",
        theme="corners",
    ),
    Phenomenon(
        "RC-12",
        "what must tip, tips",
        (FLICKED["tip"],),
        falls,
        1.0,
        0.0,
        "1 if it does",
        "energy up to the balance point",
        "A tower that falls is shown as safe.",
        "hidden damping; sleeping; rounded edges",
        theme="damping",
    ),
    Phenomenon(
        "RC-13",
        "what must not tip, does not",
        (FLICKED["return"],),
        falls,
        0.0,
        0.0,
        "1 if it does",
        "energy up to the balance point",
        "A tower that stands is shown as fallen.",
        "energy added by contacts; contact points inside of the corners",
        theme="penetration",
    ),
    Phenomenon(
        "RC-19",
        "a step of the base's velocity overturns",
        STEPS,
        below_and_above,
        0.0,
        0.0,
        "wrong outcomes",
        "Housner 1963: energy after the step",
        "A blow topples what should stand, or not what should fall.",
        "contact points at the very corners; how the base is driven",
        theme="corners",
    ),
    Phenomenon(
        "RC-21",
        "a rectangular pulse overturns a slender block",
        RECTANGLES,
        below_and_above,
        0.0,
        0.0,
        "wrong outcomes",
        "Housner 1963: 1/(1 − exp(−p t))",
        "Towers fall too early or too late.",
        "contact points at the very corners; inertia; hidden damping",
        theme="corners",
    ),
    Phenomenon(
        "RC-22",
        "overturning without impact",
        SINES,
        sine_outcomes,
        0.0,
        0.0,
        "wrong outcomes",
        "integral of a exp(−p t) from uplift on",
        "Towers fall too early or too late.",
        "contact points at the very corners; inertia; hidden damping",
        theme="corners",
    ),
    Phenomenon(
        "RC-23",
        "of five sizes the two small ones fall",
        TOWERS,
        size_outcomes,
        0.0,
        0.0,
        "wrong outcomes",
        "size effect: Housner 1963; two event-based programs",
        "Large and small are confused.",
        "absolute tolerances: slop, margins and thresholds in m and m/s",
        theme="penetration",
    ),
    Phenomenon(
        "RC-27",
        "leaves its balance, on either side",
        BALANCED,
        leaving,
        1.0,
        0.02,
        "of the time",
        "pendulum upside down: an elliptic integral",
        "What is about to fall stands on an edge, or falls too soon.",
        "sleeping near the balance: switch it off; digits of the first pose",
        theme="sleep",
    ),
    Phenomenon(
        "RC-28",
        "the critical double impulse overturns",
        DOUBLE_IMPULSES,
        below_and_above,
        0.0,
        0.0,
        "wrong outcomes",
        "after Nabeshima and others 2016",
        "Two blows in the worst rhythm topple what should stand, or not what should fall.",
        "energy lost at an impact; contact points at the very corners",
        theme="penetration",
    ),
)
