"""Phenomena of impacts with floor and walls: rebounds, no rebounds, flush hits.

In go scenes of blocks that drop or fly; out comes the table that `phenomena` joins.
"""

import math

import numpy as np

from rockcheck.scenes import Block, Floor, Scene, Wall
from rockcheck.validation.studies.conformance.phenomenon import (
    NEWTON,
    SLENDER,
    SQUAT,
    G,
    Motion,
    Phenomenon,
    worst,
)

RESTITUTIONS = (0.25, 0.5, 0.75, 1.0)
DROP = 0.2  # m
#: By restitution: a drop onto the floor, and a hit on the wall.
DROPS = {
    e: Scene(
        name=f"drop-e-{e:g}",
        block=SQUAT,
        floor=Floor(friction=0.3, restitution=e),
        initial_height=DROP,
        duration=0.65,
        output_step=1e-3,
    )
    for e in (0.0, *RESTITUTIONS)
}
HITS = {
    e: Scene(
        name=f"wall-e-{e:g}",
        block=SQUAT,
        floor=Floor(friction=0.0),
        walls=(Wall(side="left", gap=0.1003, restitution=e),),
        initial_velocity=-1.0,
        duration=0.3,
        output_step=1e-3,
    )
    for e in (0.0, *RESTITUTIONS)
}
FLUSH = Scene(
    name="flush",
    block=SLENDER,
    floor=Floor(friction=0.6),
    initial_height=0.1,
    initial_velocity=1.0,
    duration=0.25,
    output_step=1e-3,
)
#: When it lands, s.
LANDS = math.sqrt(2.0 * 0.1 / G)
CUBE = Block(half_width=0.5, half_height=0.5)
#: A cube that flies to and fro: it hits a wall at 0.1, 0.3 and 0.5 s.
TO_AND_FRO = Scene(
    name="to-and-fro",
    block=CUBE,
    floor=Floor(friction=0.0),
    walls=tuple(Wall(side=side, gap=0.1003, restitution=1.0) for side in ("left", "right")),
    initial_velocity=-1.0,
    duration=0.6,
    output_step=1e-3,
)
#: A block that turns in the air, its centre in the middle: both walls are struck at 0.13 s.
TURNING = 0.5  # rad/s
BOTH_WALLS = Scene(
    name="both-walls",
    block=SLENDER,
    floor=Floor(friction=0.6),
    walls=tuple(Wall(side=side, gap=0.1, restitution=0.0) for side in ("left", "right")),
    initial_height=0.3,
    initial_angular_velocity=TURNING,
    initial_velocity=TURNING * SLENDER.half_height,
    duration=0.25,
    output_step=1e-3,
)
ALMOST_FLUSH = tuple(
    Scene(
        name=f"almost-flush-{tilt:g}",
        block=SLENDER,
        floor=Floor(friction=0.6),
        initial_rotation=tilt,
        duration=1.0,
    )
    for tilt in (1e-5, 1e-4, 1e-3)
)


def rebound(motion: Motion) -> float:
    """The restitution that the height of a rebound from the floor shows."""
    after = motion.t > math.sqrt(2.0 * DROP / G) + 0.01
    return math.sqrt(max(float(np.max(motion.y[after])) - 0.5, 0.0) / DROP)


def speed_back(motion: Motion) -> float:
    """Speed to the right in the last 0.1 s, over that of the approach, 1 m/s."""
    return float((motion.x[-1] - np.interp(motion.t[-1] - 0.1, motion.t, motion.x)) / 0.1)


def floor_restitution(*motions: Motion) -> float:
    """How far the worst rebound from the floor is from the restitution of its scene."""
    return worst((rebound(m) - e for m, e in zip(motions, RESTITUTIONS, strict=True)), 0.0)


def wall_restitution(*motions: Motion) -> float:
    """How far the worst rebound from a wall is from the restitution of its scene."""
    return worst((speed_back(m) - e for m, e in zip(motions, RESTITUTIONS, strict=True)), 0.0)


def bounce(drop: Motion, hit: Motion) -> float:
    """The larger share of the approach that comes back though e = 0."""
    return max(rebound(drop), abs(speed_back(hit)))


def turning_after_landing(motion: Motion) -> float:
    """Angular velocity after a flush landing, rad/s."""
    before, after = np.interp([LANDS + 0.01, LANDS + 0.03], motion.t, motion.theta)
    return float((after - before) / 0.02)


def turning_left(motion: Motion) -> float:
    """The share of the angular velocity that a strike of both walls leaves."""
    before, after = np.interp([0.16, 0.2], motion.t, motion.theta)
    return float((after - before) / 0.04 / TURNING)


def tipping(motion: Motion) -> float:
    """How far any corner of the cube leaves its height, mm."""
    lift = np.abs(motion.y - CUBE.half_height) + CUBE.radius * np.abs(motion.theta)
    return 1e3 * float(np.max(lift))


def thrown_up(*motions: Motion) -> float:
    """How high a block rises that lies almost flat, mm."""
    return 1e3 * max(float(np.max(motion.y) - motion.y[0]) for motion in motions)


IMPACTS = (
    Phenomenon(
        "RC-06",
        "rebound from the floor at e = 0.25 … 1",
        tuple(DROPS[e] for e in RESTITUTIONS),
        floor_restitution,
        0.0,
        0.03,
        "in e",
        NEWTON,
        "Restitution is not what you set, or there is none.",
        "rockcheck conformance --tune finds the engine's own parameters",
        theme="restitution",
        needs="restitution",
    ),
    Phenomenon(
        "RC-07",
        "rebound from a wall at e = 0.25 … 1",
        tuple(HITS[e] for e in RESTITUTIONS),
        wall_restitution,
        0.0,
        0.03,
        "in e",
        NEWTON,
        "Restitution is not what you set, or there is none.",
        "rockcheck conformance --tune finds the engine's own parameters; thresholds of speed",
        theme="restitution",
        needs="restitution",
    ),
    Phenomenon(
        "RC-08",
        "no bounce at e = 0",
        (DROPS[0.0], HITS[0.0]),
        bounce,
        0.0,
        0.03,
        "of the approach",
        NEWTON,
        "Things hop that should stay where they land.",
        "correction of penetration apart from velocity; slop; damping of the contact",
        theme="penetration",
    ),
    Phenomenon(
        "RC-18",
        "flush landing: which law",
        (FLUSH,),
        turning_after_landing,
        0.0,
        None,
        "rad/s",
        "a tie, several answers: not judged",
        "Not a fault: two corners that land at one instant may share the impulse in several ways.",
        "nothing",
    ),
    Phenomenon(
        "RC-25",
        "almost flush: nothing is thrown up",
        ALMOST_FLUSH,
        thrown_up,
        0.0,
        0.05,
        "mm",
        "first law",
        "A box that lies almost flat jumps: two faces make contacts that are not there.",
        "collision of box on box: a plane as floor, or points as corners",
        theme="corners",
    ),
    Phenomenon(
        "RC-26",
        "second and third flush hit: stays flat",
        (TO_AND_FRO,),
        tipping,
        0.0,
        0.1,
        "mm",
        "Newton's law at both corners",
        "What slides into a wall face on tips, and loses speed.",
        "a solver that solves both corners of a face together; more iterations",
        theme="solver",
        needs="restitution",
    ),
    Phenomenon(
        "RC-29",
        "both walls at one instant: which law",
        (BOTH_WALLS,),
        turning_left,
        0.0,
        None,
        "of the turning",
        "a tie, several answers: not judged",
        "Not a fault: a wall that is nearer by any little is struck first.",
        "nothing",
    ),
)
