"""Phenomena that hold whatever the motion: energy, symmetry, rest, and a base that moves.

In go scenes; out comes the table that `phenomena` joins.
"""

import math

import numpy as np

from rockcheck.scenes import Block, Floor, Record, Scene, Sine, kinematics
from rockcheck.validation.studies.conformance.phenomenon import (
    SLENDER,
    SQUAT,
    G,
    Motion,
    Phenomenon,
    largest_difference,
)
from rockcheck.validation.studies.conformance.rocking import ROCK

TUMBLE = Scene(
    name="tumble",
    block=Block(half_width=0.3, half_height=0.5),
    floor=Floor(friction=0.3),
    initial_height=0.05,
    initial_rotation=0.2,
    initial_velocity=1.0,
    duration=3.0,
)
REST = Scene(
    name="rest",
    block=SLENDER,
    floor=Floor(friction=0.5),
    duration=10.0,
    output_step=0.05,
)
SHAKE = Sine(amplitude=2.0, period=0.5, cycles=4)
#: A block that nothing holds on a base that shakes; half the gravity, and a base that falls.
LOOSE = Scene(name="loose", block=SQUAT, floor=Floor(friction=0.0), excitation=SHAKE, duration=2.0)
LIGHT = ROCK.replace(name="light", gravity=0.5 * G)
FALLING = ROCK.replace(
    name="falling-base", vertical=Record.from_samples([-0.5 * G, -0.5 * G], time_step=2.5)
)


def energy_gained(motion: Motion) -> float:
    """Largest rise of the energy above its lowest value before, over its first value.

    Velocities are differences of positions.
    """
    rates = [np.diff(each) / np.diff(motion.t) for each in (motion.x, motion.y, motion.theta)]
    y, theta = (0.5 * (each[1:] + each[:-1]) for each in (motion.y, motion.theta))
    total = kinematics.energy(TUMBLE.block, G, y, theta, *rates)
    return float(np.max(total - np.minimum.accumulate(total)) / total[0])


def asymmetry(motion: Motion, mirrored: Motion) -> float:
    """How far a motion is from its mirror image, alpha."""
    return largest_difference(motion.theta, -mirrored.theta) / TUMBLE.block.alpha


def unrest(motion: Motion) -> float:
    """The largest displacement of any corner of a block at rest, mm."""
    away = (
        np.abs(motion.x)
        + np.abs(motion.y - SLENDER.half_height)
        + SLENDER.radius * np.abs(motion.theta)
    )
    return 1e3 * float(np.max(away))


def moving_base(loose: Motion, light: Motion, falling: Motion) -> float:
    """The larger of two errors, both shares.

    How far a loose block leaves its place in space; how far the motion on a base that falls with
    g/2 differs from the motion under g/2.
    """
    t, x, pulse = loose.t, loose.x, 2.0 * math.pi / SHAKE.period
    base = SHAKE.amplitude / pulse * (t - np.sin(pulse * t) / pulse)
    return max(
        float(np.max(np.abs(x - x[0] + base))) / float(np.max(np.abs(base))),
        largest_difference(light.theta, falling.theta) / SLENDER.alpha,
    )


INVARIANCE = (
    Phenomenon(
        "RC-14",
        "energy never rises",
        (TUMBLE,),
        energy_gained,
        0.0,
        0.02,
        "of the first",
        "first law, e = 0 and a base at rest",
        "Things jump, and stacks explode.",
        "correction of penetration apart from velocity; a shorter step",
        theme="penetration",
    ),
    Phenomenon(
        "RC-15",
        "mirror image",
        (TUMBLE, TUMBLE.mirrored().replace(name="tumble-mirrored")),
        asymmetry,
        0.0,
        0.01,
        "α",
        "symmetry",
        "Left and right differ: results depend on the order of bodies.",
        "more iterations of the solver; no random order",
        theme="solver",
    ),
    Phenomenon(
        "RC-16",
        "rest stays rest",
        (REST,),
        unrest,
        0.0,
        0.1,
        "mm",
        "statics",
        "What stands sinks, jitters or wanders.",
        "stiffer contacts; slop; correction of penetration",
        theme="penetration",
    ),
    Phenomenon(
        "RC-17",
        "the same from a moving base",
        (LOOSE, LIGHT, FALLING),
        moving_base,
        0.0,
        0.01,
        "of the way; α",
        "Galilei, d'Alembert",
        "A shaken floor is not an inertia force: earthquakes are wrong.",
        "how the base is driven: contacts have to see its velocity",
        theme="damping",
    ),
)
