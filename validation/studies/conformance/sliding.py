"""Phenomena of friction: how far a block slides, when it slips, whether it creeps or sleeps.

In go scenes of a squat block; out comes the table that `phenomena` joins.
"""

import numpy as np

from rockcheck.scenes import Floor, Record, Scene
from rockcheck.validation.criteria import newmark_slip
from rockcheck.validation.studies.conformance.phenomenon import (
    COULOMB,
    SQUAT,
    G,
    Motion,
    Phenomenon,
    crossing_time,
    worst,
)

SLIDE = Scene(
    name="slide", block=SQUAT, floor=Floor(friction=0.3), initial_velocity=1.5, duration=1.0
)
RAMP_TIME = 4.0  # s: from nothing to two and a half times the cone
CONE = Scene(
    name="cone",
    block=SQUAT,
    floor=Floor(friction=0.4),
    excitation=Record.from_samples([0.0, -G], time_step=RAMP_TIME),
    duration=RAMP_TIME,
)
#: Of creep: coefficients of friction, pushes in shares of the cone, and the time (s) that is
#: looked at, after as long a time to settle.
CREEP_FRICTION, CREEP_PUSH, CREEP_TIME = (0.2, 0.4, 0.6), (0.3, 0.6, 0.9), 2.0
CREEPS = tuple(
    Scene(
        name=f"creep-{friction:g}-{share:g}",
        block=SQUAT,
        floor=Floor(friction=friction),
        excitation=Record.from_samples([-share * friction * G] * 2, time_step=2.0 * CREEP_TIME),
        duration=2.0 * CREEP_TIME,
        output_step=0.05,
    )
    for friction in CREEP_FRICTION
    for share in CREEP_PUSH
)
COAST = Scene(
    name="coast",
    block=SQUAT,
    floor=Floor(friction=0.0),
    initial_velocity=5.0,
    duration=10.0,
    output_step=0.05,
)
#: A rectangular pulse of the base, m/s^2 and s, and how far the block slides under it, m.
PUSH, PUSH_TIME = 6.0, 0.25
PUSH_SLIP = newmark_slip(PUSH * PUSH_TIME, PUSH, 0.3 * G)
NEWMARK = Scene(
    name="newmark",
    block=SQUAT,
    floor=Floor(friction=0.3),
    excitation=Record.from_samples([PUSH, PUSH], time_step=PUSH_TIME),
    duration=1.5,
)
#: The same after a rest (s) in which an engine may put the block to sleep.
REST_TIME, WAKE_STEP = 2.0, 5e-4
WAKE_TIMES = np.arange(0.0, REST_TIME + PUSH_TIME, WAKE_STEP)
WAKE = NEWMARK.replace(
    name="wake",
    excitation=Record.from_samples(PUSH * (WAKE_TIMES >= REST_TIME), time_step=WAKE_STEP),
    duration=REST_TIME + 1.5,
)


def sliding_distance(motion: Motion) -> float:
    """The way of a block that slides to rest, over v^2/(2 mu g)."""
    return float((motion.x[-1] - motion.x[0]) / (1.5**2 / (2.0 * 0.3 * G)))


def cone(motion: Motion) -> float:
    """Coefficient of friction at which slip begins, over mu.

    The base's acceleration is j t, so a slip from t0 on is j (t - t0)^3/6.
    """
    rate, slip = G / RAMP_TIME, 0.01
    # Once slipping, friction stays mu g: x = j (t - t0)^3 / 6.
    since = crossing_time(motion.t, motion.x - motion.x[0], slip)
    return rate * (since - (6.0 * slip / rate) ** (1.0 / 3.0)) / (0.4 * G)


def creep(motion: Motion) -> float:
    """How fast a block moves that friction holds, mm an hour."""
    before, after = np.interp([CREEP_TIME, 2.0 * CREEP_TIME], motion.t, motion.x)
    return float(3.6e6 * (after - before) / CREEP_TIME)


def largest_creep(*motions: Motion) -> float:
    """Over the grid of friction and push, mm an hour."""
    return worst(map(creep, motions), 0.0)


def lift(motion: Motion) -> float:
    """How high a sliding block rises, mm."""
    return float(1e3 * (np.max(motion.y) - SQUAT.half_height))


def coasting(motion: Motion) -> float:
    """The way of a block that nothing holds, over v t."""
    return float((motion.x[-1] - motion.x[0]) / (5.0 * (motion.t[-1] - motion.t[0])))


def pushed_slip(motion: Motion) -> float:
    """Slip under the rectangular pulse, over Newmark's."""
    return float(abs(motion.x[-1] - motion.x[0]) / PUSH_SLIP)


SLIDING = (
    Phenomenon(
        "RC-01",
        "sliding distance",
        (SLIDE,),
        sliding_distance,
        1.0,
        0.02,
        "of v²/(2 μ g)",
        COULOMB,
        "What slides stops too early or too late.",
        "friction of both bodies, and how the engine combines them",
        theme="friction",
    ),
    Phenomenon(
        "RC-02",
        "friction cone: where slip begins",
        (CONE,),
        cone,
        1.0,
        0.02,
        "of μ g",
        COULOMB,
        "Things hold, or slip, at another slope than you set.",
        "combination of two frictions; pyramidal against elliptic cone",
        theme="friction",
    ),
    Phenomenon(
        "RC-03",
        "static creep, 3 frictions by 3 pushes",
        CREEPS,
        largest_creep,
        0.0,
        1.0,
        "mm an hour",
        COULOMB,
        "What friction holds drifts away slowly.",
        "regularisation of friction; how penetration is corrected",
        theme="creep",
    ),
    Phenomenon(
        "RC-04",
        "no lift while sliding",
        (SLIDE,),
        lift,
        0.0,
        0.1,
        "mm",
        "De Saxcé & Feng 1998: the cone is not associated",
        "What slides flies: friction of later contacts is lost.",
        "a solver whose friction is not convex (associated), or a correction of the cone",
        theme="lift",
    ),
    Phenomenon(
        "RC-05",
        "nothing slows what nothing holds",
        (COAST,),
        coasting,
        1.0,
        1e-5,
        "of v t",
        "Newton's first law",
        "Hidden damping, or too few digits: long runs slow down.",
        "linear and angular damping 0; double precision",
        theme="damping",
        means_above="Too few digits: what coasts gains way.",
    ),
    Phenomenon(
        "RC-20",
        "slip under a pulse of the base",
        (NEWMARK,),
        pushed_slip,
        1.0,
        0.02,
        "of V²/(2N) (1 − N/A)",
        "Newmark 1965",
        "What slides in an earthquake ends up elsewhere.",
        "friction, and how the base is driven",
        theme="friction",
    ),
    Phenomenon(
        "RC-24",
        "what rests wakes when the base moves",
        (WAKE,),
        pushed_slip,
        1.0,
        0.05,
        "of V²/(2N) (1 − N/A)",
        "Newmark 1965",
        "What has come to rest sleeps through the earthquake, or wakes late.",
        "sleeping: switch it off; a changed gravity wakes nothing",
        theme="sleep",
        means_above="What has come to rest slides too far: friction, or how the base is driven.",
    ),
)
