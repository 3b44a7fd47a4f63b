"""The phenomena: tiny scenes, the figure read off their histories, and its certain value.

All figures are read off positions (t, x, y, theta), so that any simulator that writes those can be
judged.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from rockcheck.scenes import (
    PAPER_BLOCK as SLENDER,
    Block,
    Floats,
    Floor,
    History,
    InputError,
    Record,
    Scene,
    Sine,
    Wall,
    kinematics,
)
from rockcheck.validation.criteria import (
    newmark_slip,
    overturning_velocity,
    overturns_without_impact,
    quarter_period,
    rectangular_pulse_ratio,
)

G = 9.81
#: Wider than tall: it slides, drops and bounces without tipping.
SQUAT = Block(half_width=1.0, half_height=0.5)
RESTITUTIONS = (0.25, 0.5, 0.75, 1.0)
DROP = 0.2  # m


@dataclass(frozen=True)
class Motion:
    """A history with its channels as attributes; raises `InputError` for a channel it lacks."""

    history: History

    def __getattr__(self, name: str) -> Floats:
        if name not in self.history.channels:
            raise InputError(f"the history of {self.history.name} has no column {name}")
        return np.asarray(self.history.channels[name], dtype=float)


@dataclass(frozen=True)
class Phenomenon:
    """One row of a card: a value read off motions, its target and its limit.

    `value` takes the motions of `scenes`, in their order. Its result should be `target` and may be
    off by `limit`; without a limit it is reported only. `means` is what a failure means for a user
    of the engine, `cure` what to look at. `needs` names what an engine may declare to lack.
    """

    id: str
    name: str
    scenes: tuple[Scene, ...]
    value: Callable[..., float]
    target: float
    limit: float | None
    unit: str
    source: str
    means: str
    cure: str
    needs: str = ""

    def judge(self, value: float) -> tuple[str, str]:
        """The verdict ("pass", "fail", or "reported"), and why."""
        if self.limit is None:
            return "reported", "reported, not judged"
        if abs(value - self.target) <= self.limit:
            return "pass", ""
        digits = 6 if 0.0 < self.limit < 1e-3 else 4
        seen = "never seen" if math.isnan(value) else f"{value:.{digits}g}"
        return "fail", (
            f"{seen}, {self.target:g} ± {self.limit:g} {self.unit} is right."
            f" {self.means} Look at: {self.cure}."
        )


def _when(t: Floats, values: Floats, level: float) -> float:
    """When `values` first pass `level` upward, linear between rows; NaN if never."""
    above = np.flatnonzero(values >= level)
    if not above.size:
        return math.nan
    i = int(above[0])
    near = slice(i - 1, i + 1)
    return float(t[i]) if i == 0 else float(np.interp(level, values[near], t[near]))


def _apart(one: Floats, other: Floats) -> float:
    rows = min(len(one), len(other))
    return float(np.max(np.abs(one[:rows] - other[:rows])))


# Sliding.

SLIDE = Scene(
    name="slide", block=SQUAT, floor=Floor(friction=0.3), initial_velocity=1.5, duration=1.0
)
RAMP_TIME = 4.0  # s: from nothing to two and a half times the cone


def cone(m: Motion) -> float:
    """Coefficient of friction at which slip begins, over mu.

    The base's acceleration is j t, so a slip from t0 on is j (t - t0)^3/6.
    """
    rate, slipped = G / RAMP_TIME, 0.01
    # Once slipping, friction stays mu g: x = j (t - t0)^3 / 6.
    since = _when(m.t, m.x - m.x[0], slipped) - (6.0 * slipped / rate) ** (1.0 / 3.0)
    return rate * since / (0.4 * G)


# Bouncing.


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


def _rebound(m: Motion) -> float:
    after = m.t > math.sqrt(2.0 * DROP / G) + 0.01
    return math.sqrt(max(float(np.max(m.y[after])) - 0.5, 0.0) / DROP)


def _speed_back(m: Motion) -> float:
    """Speed to the right in the last 0.1 s, over that of the approach, 1 m/s."""
    return float((m.x[-1] - np.interp(m.t[-1] - 0.1, m.t, m.x)) / 0.1)


def _worst(seen: Callable[[Motion], float], *motions: Motion) -> float:
    return max((seen(m) - e for m, e in zip(motions, RESTITUTIONS, strict=True)), key=abs)


# Rocking.

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
        initial_angular_velocity=part * CRITICAL,
        duration=6.0,
    )
    for name, part in (("tip", 1.03), ("return", 0.97))
}


def uplift(m: Motion) -> float:
    """The acceleration of uplift over g tan(alpha).

    From there theta'' = p^2 theta + K (t - t0) for small angles, K = 3 cos(alpha) j/(4 R): theta =
    K/p^2 (sinh(p s)/p - s).
    """
    from scipy.optimize import brentq

    rate, level = 0.4 * G / RAMP_TIME, 0.02 * SLENDER.alpha
    p, push = SLENDER.frequency_parameter, 0.75 * math.cos(SLENDER.alpha) * rate / SLENDER.radius
    since = brentq(lambda s: push / p**2 * (math.sinh(p * s) / p - s) - level, 1e-6, 5.0)
    return rate * (_when(m.t, np.abs(m.theta), level) - since) / (G * math.tan(SLENDER.alpha))


def housner(m: Motion) -> float:
    """Ratio of angular velocities over the first impact, over Housner's 1 - 1.5 sin^2(alpha).

    The velocities follow from the turning points, by energy.
    """
    alpha = SLENDER.alpha
    swing = float(np.max(-m.theta[(m.t > _when(m.t, -m.theta, 0.0)) & (m.t < 2.2)]))
    after, before = (math.cos(alpha - tilt) - math.cos(alpha) for tilt in (swing, TILT))
    return math.sqrt(max(after, 0.0) / before) / (1.0 - 1.5 * math.sin(alpha) ** 2)


def falls(m: Motion) -> float:
    """1 if the block overturns, else 0."""
    return float(m.history.outcome.startswith("overturned"))


# Forbidden by mechanics.

TUMBLE = Scene(
    name="tumble",
    block=Block(half_width=0.3, half_height=0.5),
    floor=Floor(friction=0.3),
    initial_height=0.05,
    initial_rotation=0.2,
    initial_velocity=1.0,
    duration=3.0,
)
SHAKE = Sine(amplitude=2.0, period=0.5, cycles=4)
#: When it lands, s.
LANDS = math.sqrt(2.0 * 0.1 / G)


def energy_gained(m: Motion) -> float:
    """Largest rise of the energy above its lowest value before, over its first value.

    Velocities are differences of positions.
    """
    rates = [np.diff(channel) / np.diff(m.t) for channel in (m.x, m.y, m.theta)]
    y, theta = (0.5 * (channel[1:] + channel[:-1]) for channel in (m.y, m.theta))
    total = kinematics.energy(TUMBLE.block, G, y, theta, *rates)
    return float(np.max(total - np.minimum.accumulate(total)) / total[0])


def moving_base(loose: Motion, light: Motion, falling: Motion) -> float:
    """The larger of two errors, both shares.

    How far a loose block leaves its place in space; how far the motion on a base that falls with
    g/2 differs from the motion under g/2.
    """
    t, x, pulse = loose.t, loose.x, 2.0 * math.pi / SHAKE.period
    base = SHAKE.amplitude / pulse * (t - np.sin(pulse * t) / pulse)
    return max(
        float(np.max(np.abs(x - x[0] + base))) / float(np.max(np.abs(base))),
        _apart(light.theta, falling.theta) / SLENDER.alpha,
    )


# Hand methods that are exact. Base motions 3 % below and 3 % above the threshold.

MARGINS = (0.97, 1.03)
KICK, RESTED = 1e-3, 2.0  # s: duration of a step of the base's velocity; rest before it
#: The shape whose corner slips least under a step of velocity: not at all if friction is 4/3.
STUBBY = Block(half_width=0.5, half_height=1.0)
#: So slender that its motion is linear and its loss at an impact negligible.
NEEDLE = Block(half_width=0.02, half_height=1.0)
NEEDLE_P = NEEDLE.frequency_parameter
PUSH, PUSHED = 6.0, 0.25  # a rectangular pulse, m/s^2 and s
PUSH_SLIP = newmark_slip(PUSH * PUSHED, PUSH, 0.3 * G)


def _pulsed(name: str, block: Block, pulse: Record | Sine, **more: Any) -> Scene:
    return Scene(
        name=name,
        block=block,
        excitation=pulse,
        **{"floor": Floor(friction=1.333), "duration": 6.0, **more},
    )


LENGTH = 0.4  # s
#: One sine of four times the block's frequency, just below the threshold amplitude and above.
SINES = tuple(
    _pulsed(
        f"sine-{ratio:g}",
        NEEDLE,
        Sine(amplitude=ratio * G * NEEDLE.alpha, period=0.5 * math.pi / NEEDLE_P, cycles=1),
    )
    for ratio in (5.1, 5.4)
)
#: Towers of one shape under one sine: the two small ones fall.
SIZES = {0.25: True, 0.5: True, 1.0: False, 2.0: False, 4.0: False}  # R, m


def _wrong(must: Iterable[bool], seen: Callable[[Motion], float], *motions: Motion) -> float:
    return float(sum(seen(m) != one for m, one in zip(motions, must, strict=True)))


def _integral(scene: Scene) -> bool:
    """Whether the sine overturns the needle before its first impact."""
    t = np.linspace(0.0, scene.excitation.quiet_after, 20001)
    return overturns_without_impact(
        NEEDLE_P * t, scene.excitation.acceleration(t) / (G * NEEDLE.alpha)
    )


COULOMB, NEWTON, HOUSNER = "Coulomb 1785; momentum", "Newton's law of impact", "Housner 1963"

#: By their names.
PHENOMENA: dict[str, Phenomenon] = {
    one.id: one
    for one in (
        Phenomenon(
            "RC-01",
            "sliding distance",
            (SLIDE,),
            lambda m: (m.x[-1] - m.x[0]) / (1.5**2 / (2.0 * 0.3 * G)),
            1.0,
            0.02,
            "of v²/(2 μ g)",
            COULOMB,
            "What slides stops too early or too late.",
            "friction of both bodies, and how the engine combines them",
        ),
        Phenomenon(
            "RC-02",
            "friction cone: where slip begins",
            (
                Scene(
                    name="cone",
                    block=SQUAT,
                    floor=Floor(friction=0.4),
                    excitation=Record.from_samples([0.0, -G], time_step=RAMP_TIME),
                    duration=RAMP_TIME,
                ),
            ),
            cone,
            1.0,
            0.02,
            "of μ g",
            COULOMB,
            "Things hold, or slip, at another slope than you set.",
            "combination of two frictions; pyramidal against elliptic cone",
        ),
        Phenomenon(
            "RC-03",
            "static creep at 0.9 of the cone",
            (
                Scene(
                    name="creep",
                    block=SQUAT,
                    floor=Floor(friction=0.4),
                    excitation=Record.from_samples([-0.36 * G, -0.36 * G], time_step=10.0),
                    duration=10.0,
                    output_step=0.05,
                ),
            ),
            lambda m: 3.6e6 * np.diff(np.interp([5.0, 10.0], m.t, m.x))[0] / 5.0,
            0.0,
            1.0,
            "mm an hour",
            COULOMB,
            "What friction holds drifts away slowly.",
            "regularisation of friction: impratio and noslip in MuJoCo, stiction tolerance in"
            " Drake",
        ),
        Phenomenon(
            "RC-04",
            "no lift while sliding",
            (SLIDE,),
            lambda m: 1e3 * (np.max(m.y) - 0.5),
            0.0,
            0.1,
            "mm",
            "De Saxcé & Feng 1998: the cone is not associated",
            "What slides flies: friction of later contacts is lost.",
            "a solver whose friction is not convex (associated), or a correction of the cone",
        ),
        Phenomenon(
            "RC-05",
            "nothing slows what nothing holds",
            (
                Scene(
                    name="coast",
                    block=SQUAT,
                    floor=Floor(friction=0.0),
                    initial_velocity=5.0,
                    duration=10.0,
                    output_step=0.05,
                ),
            ),
            lambda m: (m.x[-1] - m.x[0]) / (5.0 * (m.t[-1] - m.t[0])),
            1.0,
            1e-5,
            "of v t",
            "Newton's first law",
            "Hidden damping, or too few digits: long runs slow down.",
            "linear and angular damping 0; double precision",
        ),
        Phenomenon(
            "RC-06",
            "rebound from the floor at e = 0.25 … 1",
            tuple(DROPS[e] for e in RESTITUTIONS),
            partial(_worst, _rebound),
            0.0,
            0.03,
            "in e",
            NEWTON,
            "Restitution is not what you set, or there is none.",
            "rockcheck conformance --tune finds the engine's own parameters",
            needs="restitution",
        ),
        Phenomenon(
            "RC-07",
            "rebound from a wall at e = 0.25 … 1",
            tuple(HITS[e] for e in RESTITUTIONS),
            partial(_worst, _speed_back),
            0.0,
            0.03,
            "in e",
            NEWTON,
            "Restitution is not what you set, or there is none.",
            "rockcheck conformance --tune finds the engine's own parameters; thresholds of speed",
            needs="restitution",
        ),
        Phenomenon(
            "RC-08",
            "no bounce at e = 0",
            (DROPS[0.0], HITS[0.0]),
            lambda drop, hit: max(_rebound(drop), abs(_speed_back(hit))),
            0.0,
            0.03,
            "of the approach",
            NEWTON,
            "Things hop that should stay where they land.",
            "correction of penetration apart from velocity; slop; damping of the contact",
        ),
        Phenomenon(
            "RC-09",
            "uplift at g tan α",
            (
                Scene(
                    name="uplift",
                    block=SLENDER,
                    floor=Floor(friction=0.6),
                    excitation=Record.from_samples([0.0, 0.4 * G], time_step=RAMP_TIME),
                    duration=RAMP_TIME,
                ),
            ),
            uplift,
            1.0,
            0.02,
            "of g tan α",
            f"{HOUSNER}; moments about the corner",
            "A block starts to rock too early or too late.",
            "contact points at the very corners: margins, rounded edges, soft contacts",
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
        ),
        Phenomenon(
            "RC-11",
            "free-rocking period",
            (ROCK,),
            # up to the first impact, over Housner's without small angles
            lambda m: _when(m.t, -m.theta, 0.0) / quarter_period(SLENDER.weaker_pivot, G, TILT),
            1.0,
            0.01,
            "of the quarter period",
            HOUSNER,
            "Amplification is found at another frequency.",
            "inertia of the block; contact points at the very corners; hidden damping",
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
        ),
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
        ),
        Phenomenon(
            "RC-15",
            "mirror image",
            (TUMBLE, TUMBLE.mirrored().replace(name="tumble-mirrored")),
            lambda one, other: _apart(one.theta, -other.theta) / TUMBLE.block.alpha,
            0.0,
            0.01,
            "α",
            "symmetry",
            "Left and right differ: results depend on the order of bodies.",
            "more iterations of the solver; no random order",
        ),
        Phenomenon(
            "RC-16",
            "rest stays rest",
            (
                Scene(
                    name="rest",
                    block=SLENDER,
                    floor=Floor(friction=0.5),
                    duration=10.0,
                    output_step=0.05,
                ),
            ),
            # the largest displacement of any corner
            lambda m: (
                1e3
                * np.max(
                    np.abs(m.x)
                    + np.abs(m.y - SLENDER.half_height)
                    + SLENDER.radius * np.abs(m.theta)
                )
            ),
            0.0,
            0.1,
            "mm",
            "statics",
            "What stands sinks, jitters or wanders.",
            "stiffer contacts; slop; correction of penetration",
        ),
        Phenomenon(
            "RC-17",
            "the same from a moving base",
            (
                Scene(
                    name="loose",
                    block=SQUAT,
                    floor=Floor(friction=0.0),
                    excitation=SHAKE,
                    duration=2.0,
                ),
                ROCK.replace(name="light", gravity=0.5 * G),
                ROCK.replace(
                    name="falling-base",
                    vertical=Record.from_samples([-0.5 * G, -0.5 * G], time_step=2.5),
                ),
            ),
            moving_base,
            0.0,
            0.01,
            "of the way; α",
            "Galilei, d'Alembert",
            "A shaken floor is not an inertia force: earthquakes are wrong.",
            "how the base is driven: contacts have to see its velocity",
        ),
        Phenomenon(
            "RC-18",
            "flush landing: which law",
            (
                Scene(
                    name="flush",
                    block=SLENDER,
                    floor=Floor(friction=0.6),
                    initial_height=0.1,
                    initial_velocity=1.0,
                    duration=0.25,
                    output_step=1e-3,
                ),
            ),
            lambda m: np.diff(np.interp([LANDS + 0.01, LANDS + 0.03], m.t, m.theta))[0] / 0.02,
            0.0,
            None,
            "rad/s",
            "several answers: not judged",
            "Not a fault: two corners that land at one instant may share the impulse in several"
            " ways.",
            "nothing",
        ),
        Phenomenon(
            "RC-19",
            "a step of the base's velocity overturns",
            tuple(
                _pulsed(
                    f"step-{part:g}",
                    STUBBY,
                    Record.from_samples(
                        np.full(2, part * overturning_velocity(STUBBY, G) / KICK), time_step=KICK
                    ),
                )
                for part in MARGINS
            ),
            partial(_wrong, (False, True), falls),
            0.0,
            0.0,
            "wrong outcomes",
            "Housner 1963: energy after the step",
            "A blow topples what should stand, or not what should fall.",
            "contact points at the very corners; how the base is driven",
        ),
        Phenomenon(
            "RC-20",
            "slip under a pulse of the base",
            (
                _pulsed(
                    "newmark",
                    SQUAT,
                    Record.from_samples([PUSH, PUSH], time_step=PUSHED),
                    floor=Floor(friction=0.3),
                    duration=1.5,
                ),
            ),
            lambda m: abs(m.x[-1] - m.x[0]) / PUSH_SLIP,
            1.0,
            0.02,
            "of V²/(2N) (1 − N/A)",
            "Newmark 1965",
            "What slides in an earthquake ends up elsewhere.",
            "friction, and how the base is driven",
        ),
        Phenomenon(
            "RC-21",
            "a rectangular pulse overturns a slender block",
            tuple(
                _pulsed(
                    f"rectangle-{part:g}",
                    NEEDLE,
                    Record.from_samples(
                        np.full(
                            2,
                            part * rectangular_pulse_ratio(LENGTH, NEEDLE_P) * G * NEEDLE.slope,
                        ),
                        time_step=LENGTH,
                    ),
                )
                for part in MARGINS
            ),
            partial(_wrong, (False, True), falls),
            0.0,
            0.0,
            "wrong outcomes",
            "Housner 1963: 1/(1 − exp(−p t))",
            "Towers fall too early or too late.",
            "contact points at the very corners; inertia; hidden damping",
        ),
        Phenomenon(
            "RC-22",
            "overturning without impact",
            SINES,
            lambda *ms: _wrong(
                map(_integral, SINES),
                # whether it overturns without having tipped to the other side
                lambda m: (
                    falls(m) * float(min(-np.min(m.theta), np.max(m.theta)) < 0.01 * NEEDLE.alpha)
                ),
                *ms,
            ),
            0.0,
            0.0,
            "wrong outcomes",
            "integral of a exp(−p t) from uplift on",
            "Towers fall too early or too late.",
            "contact points at the very corners; inertia; hidden damping",
        ),
        Phenomenon(
            "RC-23",
            "of five sizes the two small ones fall",
            tuple(
                _pulsed(
                    f"tower-{radius:g}",
                    Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2)),
                    Sine(amplitude=2.0 * 9.80665 * math.tan(0.2), period=0.5, cycles=1),
                    gravity=9.80665,
                )
                for radius in SIZES
            ),
            partial(_wrong, SIZES.values(), falls),
            0.0,
            0.0,
            "wrong outcomes",
            "size effect: Housner 1963; two event-based programs",
            "Large and small are confused.",
            "absolute tolerances: slop, margins and thresholds in m and m/s",
        ),
        Phenomenon(
            "RC-24",
            "what rests wakes when the base moves",
            (
                _pulsed(
                    "wake",
                    SQUAT,
                    Record.from_samples(
                        PUSH * (np.arange(0.0, RESTED + PUSHED, 5e-4) >= RESTED), time_step=5e-4
                    ),
                    floor=Floor(friction=0.3),
                    duration=RESTED + 1.5,
                ),
            ),
            lambda m: abs(m.x[-1] - m.x[0]) / PUSH_SLIP,
            1.0,
            0.05,
            "of V²/(2N) (1 − N/A)",
            "Newmark 1965",
            "What has come to rest sleeps through the earthquake.",
            "sleeping: switch it off; a changed gravity wakes nothing",
        ),
        Phenomenon(
            "RC-25",
            "almost flush: nothing is thrown up",
            tuple(
                Scene(
                    name=f"almost-flush-{tilt:g}",
                    block=SLENDER,
                    floor=Floor(friction=0.6),
                    initial_rotation=tilt,
                    duration=1.0,
                )
                for tilt in (1e-5, 1e-4, 1e-3)
            ),
            lambda *ms: 1e3 * max(float(np.max(m.y) - m.y[0]) for m in ms),
            0.0,
            0.05,
            "mm",
            "first law",
            "A box that lies almost flat jumps: two faces make contacts that are not there.",
            "collision of box on box: a plane as floor, or points as corners",
        ),
    )
}
SCENES: dict[str, Scene] = {scene.name: scene for one in PHENOMENA.values() for scene in one.scenes}
