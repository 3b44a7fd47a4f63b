"""The phenomena: tiny scenes, what is read off their histories, and what is certain about it.

All figures are read off positions (t, x, y, theta), so that any simulator that writes those can be
judged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Block, Floor, History, InputError, Record, Scene, Sine, Wall
from rockcheck.scenes.kinematics import energy
from rockcheck.scenes.scene import PAPER_BLOCK

FloatArray = NDArray[np.float64]
Histories = Mapping[str, History]
G = 9.81
#: Wider than tall: it slides, drops and bounces without tipping.
SQUAT = Block(half_width=1.0, half_height=0.5)
SLENDER = PAPER_BLOCK
RESTITUTIONS = (0.25, 0.5, 0.75, 1.0)
DROP = 0.2  # m
HOUR = 3600.0  # s


@dataclass(frozen=True)
class Phenomenon:
    """One card: `value` of the histories of its scenes should be `target`, and is allowed to be off
    by `limit`.

    `means` is what a failure means for a user of the engine, `cure` what to look at. One with
    `judged` False is reported only. `needs` names what an engine may declare to lack.
    """

    id: str
    name: str
    scenes: tuple[Scene, ...]
    value: Callable[[Histories], float]
    target: float
    limit: float
    unit: str
    source: str
    means: str
    cure: str
    needs: str = ""
    judged: bool = True

    def verdict(self, value: float) -> str:
        """ "pass" or "fail", "reported" where nothing is judged."""
        if not self.judged:
            return "reported"
        return "pass" if abs(value - self.target) <= self.limit else "fail"


def _pushed(acceleration: list[float], duration: float) -> Record:
    """A base acceleration, linear between values at equal intervals, m/s^2."""
    return Record.from_samples(acceleration, time_step=duration / (len(acceleration) - 1))


def _column(history: History, name: str) -> FloatArray:
    if name not in history.channels:
        raise InputError(f"the history of {history.name} has no column {name}")
    return np.asarray(history.channels[name], dtype=float)


def _when(t: FloatArray, values: FloatArray, level: float) -> float:
    """When `values` first pass `level` upward, linear between rows; NaN if never."""
    above = np.flatnonzero(values >= level)
    if not above.size:
        return math.nan
    i = int(above[0])
    return (
        float(t[i]) if i == 0 else float(np.interp(level, values[i - 1 : i + 1], t[i - 1 : i + 1]))
    )


# Sliding.

SLIDE = Scene(
    name="slide", block=SQUAT, floor=Floor(friction=0.3), initial_velocity=1.5, duration=1.0
)
COAST = Scene(
    name="coast",
    block=SQUAT,
    floor=Floor(friction=0.0),
    initial_velocity=5.0,
    duration=10.0,
    output_step=0.05,
)
RAMP_TIME = 4.0  # s: from nothing to two and a half times the cone
CONE = Scene(
    name="cone",
    block=SQUAT,
    floor=Floor(friction=0.4),
    excitation=_pushed([0.0, -G], RAMP_TIME),
    duration=RAMP_TIME,
)
CREEP = Scene(
    name="creep",
    block=SQUAT,
    floor=Floor(friction=0.4),
    excitation=_pushed([-0.36 * G, -0.36 * G], 10.0),
    duration=10.0,
    output_step=0.05,
)


def sliding_distance(found: Histories) -> float:
    """The distance in which a sliding block stops, over v^2/(2 mu g)."""
    x = _column(found["slide"], "x")
    return float((x[-1] - x[0]) / (1.5**2 / (2.0 * 0.3 * G)))


def cone(found: Histories) -> float:
    """The coefficient at which slip begins over mu: the base's acceleration grows by j t, so a free
    slip by j (t - t0)^3/6."""
    t, x = found["cone"].channels["t"], _column(found["cone"], "x")
    rate, slipped = G / RAMP_TIME, 0.01
    # Once slipping, friction stays mu g: x = j (t - t0)^3 / 6.
    return rate * (_when(t, x - x[0], slipped) - (6.0 * slipped / rate) ** (1.0 / 3.0)) / (0.4 * G)


def creep(found: Histories) -> float:
    """mm in an hour, from the drift of the last five seconds."""
    t, x = found["creep"].channels["t"], _column(found["creep"], "x")
    return 1e3 * HOUR * float(np.interp(10.0, t, x) - np.interp(5.0, t, x)) / 5.0


def lift(found: Histories) -> float:
    """Largest rise of the centroid of a block that slides flat, mm."""
    y = _column(found["slide"], "y")
    return 1e3 * float(np.max(y) - 0.5)


def coasting(found: Histories) -> float:
    """The distance that a block slides without friction, over v t."""
    t, x = found["coast"].channels["t"], _column(found["coast"], "x")
    return float((x[-1] - x[0]) / (5.0 * (t[-1] - t[0])))


# Bouncing.


def _drop(e: float) -> Scene:
    return Scene(
        name=f"drop, e {e:g}",
        block=SQUAT,
        floor=Floor(friction=0.3, restitution=e),
        initial_height=DROP,
        duration=0.65,
        output_step=1e-3,
    )


def _hit(e: float) -> Scene:
    wall = Wall(side="left", gap=0.1003, restitution=e)
    floor = Floor(friction=0.0)
    return Scene(
        name=f"wall, e {e:g}",
        block=SQUAT,
        floor=floor,
        walls=(wall,),
        initial_velocity=-1.0,
        duration=0.3,
        output_step=1e-3,
    )


DROPS, HITS = (tuple(make(e) for e in RESTITUTIONS) for make in (_drop, _hit))


def _rebound(history: History) -> float:
    """Root of the bounce's height over the drop's."""
    t, y = history.channels["t"], _column(history, "y")
    after = t > math.sqrt(2.0 * DROP / G) + 0.01
    return math.sqrt(max(float(np.max(y[after])) - 0.5, 0.0) / DROP)


def _speed_back(history: History) -> float:
    """Speed to the right in the last 0.1 s, over that of the approach, 1 m/s."""
    t, x = history.channels["t"], _column(history, "x")
    return float((x[-1] - np.interp(t[-1] - 0.1, t, x)) / 0.1)


def _worst(errors: list[float]) -> float:
    return max(errors, key=abs)


def floor_restitution(found: Histories) -> float:
    """The worst difference between the restitution seen in a drop's bounce and e."""
    return _worst([_rebound(found[f"drop, e {e:g}"]) - e for e in RESTITUTIONS])


def wall_restitution(found: Histories) -> float:
    """The worst difference between the restitution seen at a wall and e."""
    return _worst([_speed_back(found[f"wall, e {e:g}"]) - e for e in RESTITUTIONS])


def no_bounce(found: Histories) -> float:
    """The larger of the restitutions seen on floor and wall at e = 0."""
    return max(_rebound(found["drop, e 0"]), abs(_speed_back(found["wall, e 0"])))


# Rocking.

UPLIFT = Scene(
    name="uplift",
    block=SLENDER,
    floor=Floor(friction=0.6),
    excitation=_pushed([0.0, 0.4 * G], RAMP_TIME),
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


def _flicked(name: str, part: float) -> Scene:
    spin = part * CRITICAL
    return Scene(
        name=name,
        block=SLENDER,
        floor=Floor(friction=0.6),
        initial_angular_velocity=spin,
        duration=6.0,
    )


TIP, RETURN = _flicked("tip", 1.03), _flicked("return", 0.97)


def uplift(found: Histories) -> float:
    """The acceleration of uplift over g tan(alpha).

    From there theta'' = p^2 theta + K (t - t0) for small angles, K = 3 cos(alpha) j/(4 R): theta =
    K/p^2 (sinh(p s)/p - s).
    """
    from scipy.optimize import brentq

    t, theta = found["uplift"].channels["t"], np.abs(_column(found["uplift"], "theta"))
    rate, level = 0.4 * G / RAMP_TIME, 0.02 * SLENDER.alpha
    p, push = SLENDER.frequency_parameter, 0.75 * math.cos(SLENDER.alpha) * rate / SLENDER.radius
    since = brentq(lambda s: push / p**2 * (math.sinh(p * s) / p - s) - level, 1e-6, 5.0)
    return rate * (_when(t, theta, level) - since) / (G * math.tan(SLENDER.alpha))


def _first_impact(history: History) -> float:
    return _when(history.channels["t"], -_column(history, "theta"), 0.0)


def housner(found: Histories) -> float:
    """The ratio of angular velocities over the first impact, from the turning points, over 1 - 1.5
    sin^2(alpha)."""
    t, theta = found["rock"].channels["t"], _column(found["rock"], "theta")
    alpha = SLENDER.alpha
    swing = float(np.max(-theta[(t > _first_impact(found["rock"])) & (t < 2.2)]))
    after, before = (math.cos(alpha - tilt) - math.cos(alpha) for tilt in (swing, TILT))
    return math.sqrt(max(after, 0.0) / before) / (1.0 - 1.5 * math.sin(alpha) ** 2)


def period(found: Histories) -> float:
    """The quarter period over Housner's, without his small angles."""
    alpha, p = SLENDER.alpha, SLENDER.frequency_parameter
    nodes, weights = np.polynomial.legendre.leggauss(60)
    root = (
        0.5 * math.sqrt(TILT) * (nodes + 1.0)
    )  # theta = tilt - root^2 takes the singularity at the start away
    speed = np.sqrt(2.0 * (np.cos(alpha - TILT) - np.cos(alpha - TILT + root**2))) * p
    quarter = 0.5 * math.sqrt(TILT) * float(np.sum(weights * 2.0 * root / speed))
    return _first_impact(found["rock"]) / quarter


def tips(found: Histories) -> float:
    """1 if a block with 1.03 of the spin that reaches the balance point overturns, else 0."""
    return float(found["tip"].outcome.startswith("overturned"))


def returns(found: Histories) -> float:
    """1 if a block with 0.97 of that spin overturns, else 0."""
    return float(found["return"].outcome.startswith("overturned"))


# What no mechanics does.

TUMBLE = Scene(
    name="tumble",
    block=Block(half_width=0.3, half_height=0.5),
    floor=Floor(friction=0.3),
    initial_height=0.05,
    initial_rotation=0.2,
    initial_velocity=1.0,
    duration=3.0,
)
MIRRORED = TUMBLE.mirrored().replace(name="tumble, mirrored")
REST = Scene(name="rest", block=SLENDER, floor=Floor(friction=0.5), duration=10.0, output_step=0.05)
SHAKE = Sine(amplitude=2.0, period=0.5, cycles=4)
LOOSE = Scene(name="loose", block=SQUAT, floor=Floor(friction=0.0), excitation=SHAKE, duration=2.0)
LIGHT = ROCK.replace(name="light", gravity=0.5 * G)
FALLING = ROCK.replace(name="falling base", vertical=_pushed([-0.5 * G, -0.5 * G], 2.5))
FLUSH = Scene(
    name="flush",
    block=SLENDER,
    floor=Floor(friction=0.6),
    initial_height=0.1,
    initial_velocity=1.0,
    duration=0.25,
    output_step=1e-3,
)


def energy_gained(found: Histories) -> float:
    """The largest rise of the energy above its lowest before, over its first, from differences of
    positions."""
    history = found["tumble"]
    t, x, y, theta = (_column(history, name) for name in ("t", "x", "y", "theta"))
    rates = [np.diff(channel) / np.diff(t) for channel in (x, y, theta)]
    middle = 0.5 * (y[1:] + y[:-1])
    total = energy(TUMBLE.block, G, middle, 0.5 * (theta[1:] + theta[:-1]), *rates)
    return float(np.max(total - np.minimum.accumulate(total)) / total[0])


def asymmetry(found: Histories) -> float:
    """Largest |theta + theta of the mirror image|, alpha."""
    one, other = (_column(found[name], "theta") for name in ("tumble", "tumble, mirrored"))
    rows = min(len(one), len(other))
    return float(np.max(np.abs(one[:rows] + other[:rows]))) / TUMBLE.block.alpha


def restlessness(found: Histories) -> float:
    """How far any corner strays from its place, mm."""
    history = found["rest"]
    x, y, theta = (_column(history, name) for name in ("x", "y", "theta"))
    return 1e3 * float(
        np.max(np.abs(x) + np.abs(y - SLENDER.half_height) + SLENDER.radius * np.abs(theta))
    )


def moving_base(found: Histories) -> float:
    """The larger of two errors, both shares.

    How far a loose block leaves its place in space; how far the motion on a base that falls with
    g/2 is from that under g/2.
    """
    t, x = found["loose"].channels["t"], _column(found["loose"], "x")
    pulse = 2.0 * math.pi / SHAKE.period
    base = SHAKE.amplitude / pulse * (t - np.sin(pulse * t) / pulse)
    strayed = float(np.max(np.abs(x - x[0] + base))) / float(np.max(np.abs(base)))
    one, other = (_column(found[name], "theta") for name in ("light", "falling base"))
    rows = min(len(one), len(other))
    return max(strayed, float(np.max(np.abs(one[:rows] - other[:rows]))) / SLENDER.alpha)


def flush_landing(found: Histories) -> float:
    """Angular velocity after a flat landing at 1.4 m/s that slips at 1 m/s, rad/s; 0 where both
    corners share the impulse evenly."""
    t, theta = found["flush"].channels["t"], _column(found["flush"], "theta")
    lands = math.sqrt(2.0 * 0.1 / G)
    return float(np.interp(lands + 0.03, t, theta) - np.interp(lands + 0.01, t, theta)) / 0.02


COULOMB = "Coulomb 1785; momentum"
NEWTON = "Newton's law of impact"
HOUSNER = "Housner 1963"

_ALL = (
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
    ),
    Phenomenon(
        "RC-03",
        "static creep at 0.9 of the cone",
        (CREEP,),
        creep,
        0.0,
        1.0,
        "mm an hour",
        COULOMB,
        "What friction holds drifts away slowly.",
        "regularisation of friction: impratio and noslip in MuJoCo, stiction tolerance in Drake",
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
    ),
    Phenomenon(
        "RC-06",
        "rebound from the floor at e = 0.25 … 1",
        DROPS,
        floor_restitution,
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
        HITS,
        wall_restitution,
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
        (_drop(0.0), _hit(0.0)),
        no_bounce,
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
        (UPLIFT,),
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
        period,
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
        (TIP,),
        tips,
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
        (RETURN,),
        returns,
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
        (TUMBLE, MIRRORED),
        asymmetry,
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
        (REST,),
        restlessness,
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
        (LOOSE, LIGHT, FALLING),
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
        (FLUSH,),
        flush_landing,
        0.0,
        math.inf,
        "rad/s",
        "several answers: not judged",
        "Not a fault: two corners that land at one instant may share the impulse in several ways.",
        "nothing",
        judged=False,
    ),
)
PHENOMENA: dict[str, Phenomenon] = {phenomenon.id: phenomenon for phenomenon in _ALL}
SCENES: dict[str, Scene] = {scene.name: scene for phenomenon in _ALL for scene in phenomenon.scenes}
