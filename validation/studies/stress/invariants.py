"""Invariants: conditions that hold for every history, whatever the scene.

Each invariant gives a figure, which must stay below its bound.

Figures are in natural units (lengths in R, accelerations in g, times in sqrt(R/g)), energies
relative to the energy at play.

The histories of `ebm` are checked against Newton-Euler for a block with given contacts, solved by
other means than in `ebm`. The mass is 1; xi and y are those of its centre. As in `ebm.core.motion`,
a tilted block is seen in the frame of its pivot, which is then the lower-left corner: with S = sign
theta and phi = |theta|, that corner is s to the left of the mass's centre and c below it. The top
corner is s' to the left and c' above, the lifted bottom corner s' to the right and c' below. Four
contact forces can act: P and Q of the floor on the pivot, N of the wall that the top corner
touches, M of the wall that the lifted bottom corner touches. The gap of each contact, its row J
(xi, y, phi) and the part of its acceleration that the velocities alone give:

    P  y - c             (0, 1, -s)      c w^2
    Q  xi - s            (1, 0, c)       s w^2
    N  xi + delta - s'   (1, 0, -c')     s' w^2
    M  delta - xi - s'   (-1, 0, -c')    s' w^2
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, batch
from rockcheck.ebm.core.settle import SETTLE
from rockcheck.scenes import (
    Block,
    Excitation,
    Floats,
    History,
    InputError,
    ModelFailure,
    Record,
    Ricker,
    Scene,
    Side,
    Sine,
    Wall,
    kinematics,
)

Mask = NDArray[np.bool_]
#: A contact is closed, R, and a pivot slips, sqrt(g R), beyond these.
CLOSED, SLIPS = 1e-8, 1e-9


def tilted_forces(
    block: Block,
    tilt: tuple[Floats, Floats],
    mu: float,
    w: Floats,
    felt: tuple[Floats, Floats],
    touching: tuple[Mask, Mask, Mask],
    slip: NDArray[np.int8],
) -> tuple[Floats, Floats]:
    """Forces P, Q, N, M of a tilted block per unit weight (4, ...), and what P and Q turn it by.

    The second is the part of phi's acceleration that the floor's forces give. `tilt`: sign and size
    of the rotation; `w`: its rate; `felt`: base acceleration and gravity felt; all but the sign in
    the pivot's frame. `touching`: pivot on the floor, top corner on its wall, bottom corner on its
    wall; no force where there is no contact. `slip`: direction in which the pivot slips, 0 where it
    sticks. A slipping pivot has Q = -mu d |P|: where P would pull, the sign of its friction turns
    with it. Near Painleve's limit both signs of P can solve this; it is then the pull that is
    returned where only with it the walls push.
    """
    (sign, phi), unit = tilt, block.radius
    left, right = block.pivot("left"), block.pivot("right")
    near = np.where(sign > 0.0, left.arm, right.arm) / unit
    other = (left.arm + right.arm) / unit - near
    low, top = left.height / unit, (2.0 * block.half_height - left.height) / unit
    sine, cosine = np.sin(phi), np.cos(phi)
    s, c = near * cosine - low * sine, near * sine + low * cosine
    tip_s, tip_c = near * cosine + top * sine, top * cosine - near * sine
    far_s, far_c = other * cosine + low * sine, low * cosine - other * sine
    spin = unit**2 / block.gyration_squared
    zero, one = np.zeros_like(w), np.ones_like(w)
    jacobian = (zero, one, -s), (one, zero, c), (one, zero, -tip_c), (-one, zero, -far_c)
    rows = np.stack([np.stack(row, axis=1) for row in jacobian], axis=1)
    bias = np.stack([c, s, tip_s, far_s], axis=1) * (w * w)[:, None]
    floor, tip, far = touching
    closed = np.stack([floor, floor & (slip == 0), tip, far], axis=1)
    # J M^-1 J^T lambda = -(J a0 + bias), with an open contact's row replaced by "no force".
    matrix = np.einsum("nik,k,njk->nij", rows, np.array([1.0, 1.0, spin]), rows)
    free = np.stack([-felt[0], -felt[1], zero], axis=1)
    given = np.where(closed, -(np.einsum("nik,nk->ni", rows, free) + bias), 0.0)
    matrix = np.where(closed[:, :, None], matrix, np.eye(4))
    slipping = floor & (slip != 0)
    matrix[slipping, 1, 0] = mu * slip[slipping]
    forces = _solved(matrix, given)
    asked = slipping & ((forces[:, 0] < 0.0) | (forces[:, 2:].min(axis=1) < 0.0))
    matrix[asked, 1, 0] *= -1.0
    other_sign = forces.copy()
    other_sign[asked] = _solved(matrix[asked], given[asked])
    pulls = asked & (
        (forces[:, 0] < 0.0) | ((other_sign[:, 0] < 0.0) & (other_sign[:, 2:].min(axis=1) >= 0.0))
    )
    forces[pulls] = other_sign[pulls]
    return forces.T, spin * (c * forces[:, 1] - s * forces[:, 0])


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solves one system for each row.

    Where contacts are parallel to rounding (a corner just off its wall), takes the least forces.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(matrix) @ right[:, :, None])[:, :, 0])


#: Weights of the closed Newton-Cotes rule with nine nodes, which is exact up to degree 9.
NEWTON_COTES = (
    np.array([989.0, 5888.0, -928.0, 10496.0, -4540.0, 10496.0, -928.0, 5888.0, 989.0])
    * 4.0
    / 14175.0
)
GROUP = len(NEWTON_COTES) - 1
#: The same interval by Boole's rule twice, exact up to degree 5. The difference of the two rules
#: estimates the error.
BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 14.0, 32.0, 12.0, 32.0, 7.0]) * 2.0 / 45.0


def integrals(step: float, values: Floats, rule: Floats = NEWTON_COTES) -> Floats:
    """Integrals of `values`, at multiples of `step`, over each group of eight steps.

    Steps beyond the last whole group are left out.
    """
    groups = (len(values) - 1) // GROUP
    nodes = values[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return np.asarray(step * (nodes @ rule))


def not_finite(history: History) -> float:
    """The number of values that are not finite."""
    return float(
        sum(
            np.sum(~np.isfinite(column))
            for column in history.channels.values()
            if column.dtype.kind == "f"
        )
    )


class Motion:
    """A history of finite values as the invariants see it, one value a row, in natural units.

    Only `channels`, those of the history, keep its units. `radius` (m) and `unit` (s) are the units
    of length and time. `u` and `vertical` accelerate the base; `w` is the rate of rotation, `slip`
    that of slip. `sign` is the sign of theta in each row; where theta is zero, the sign in the next
    row, as a block that is about to tilt has its pivot already. `energy` (J/kg) is kinetic plus
    potential; the mass's centre moves at `across` and `up`, m/s. `height` is the lowest corner's
    over the floor, `gaps` are those to the walls, `deepest` is how deep a corner is in either.
    `tip` tells where the top corner touches the wall it tips to, `far` where the lifted bottom
    corner touches the other.
    """

    def __init__(self, scene: Scene, history: History) -> None:
        block, gravity, channels = scene.block, scene.gravity, history.channels
        t, theta = channels["t"], channels["theta"]
        self.scene, self.history, self.channels = scene, history, channels
        self.radius, self.unit = block.radius, math.sqrt(block.radius / gravity)
        self.u: Floats = scene.excitation.acceleration(t) / gravity
        self.vertical: Floats = scene.vertical.acceleration(t) / gravity
        self.w: Floats = channels["theta_dot"] * self.unit
        self.slip: Floats = channels["slip_rate"] * self.unit / self.radius
        sign = np.sign(theta)
        standing = np.flatnonzero(sign[:-1] == 0.0)
        sign[standing] = sign[standing + 1]
        self.sign = np.where(sign < 0.0, -1.0, 1.0)
        state = [channels[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot")]
        self.energy: Floats = kinematics.energy(block, gravity, *state)
        self.across, self.up = kinematics.mass_motion(block, *state)[1:]
        self.height: Floats = kinematics.pivot_height(block, channels["y"], theta) / self.radius
        self.gaps: dict[str, Floats] = {
            wall.side: kinematics.clearance(scene.block, wall.side, wall.gap, channels["x"], theta)
            / self.radius
            for wall in scene.walls
        }
        self.deepest = max(float(np.max(-gap)) for gap in (self.height, *self.gaps.values()))
        left, right = (
            self.gaps.get(side, np.full(len(t), np.inf)) < CLOSED for side in ("left", "right")
        )
        self.tip, self.far = np.where(sign < 0.0, (right, left), (left, right))

    def within(self, *modes: str) -> Mask:
        """The rows in these modes of motion."""
        return np.isin(self.channels["mode"], modes)

    def forces(
        self, rows: Mask, slip: Floats, *, later: float = 0.0, faster: float = 0.0
    ) -> tuple[Floats, Floats]:
        """What `tilted_forces` says of these rows, in which the block is tilted.

        `slip` is as there. The block is turned on by its rate for the time `later`; for the forces,
        `faster` is added to the rate.
        """
        sign, walls, on = self.sign, self.within("lean", "ladder"), np.ones(int(rows.sum()), bool)
        w = (sign * self.w)[rows]
        tip, far = ((contact & walls)[rows] for contact in (self.tip, self.far))
        return tilted_forces(
            self.scene.block,
            (sign[rows], np.abs(self.channels["theta"])[rows] + later * w),
            self.scene.floor.friction,
            w + faster,
            ((sign * self.u)[rows], (1.0 + self.vertical)[rows]),
            (on, tip, far),
            slip[rows].astype(np.int8),
        )


class Invariant(NamedTuple):
    """A condition: what its figure means, and the largest value that is allowed."""

    words: str
    bound: float


INVARIANTS = {
    name: Invariant(words, bound)
    for name, words, bound in (
        ("ends", "the run ends within its caps, in a mode of motion (1: it does not)", 0.0),
        ("finite", "values that are not finite", 0.0),
        ("outcome", "rows, last event and outcome contradict each other (1: they do)", 0.0),
        ("penetration", "depth of a corner in floor or wall, R", 1e-9),
        ("floor", "height of the pivot over the floor in modes that have it there, R", 1e-9),
        ("stick", "slip rate of a pivot that stands, sqrt(g R)", 1e-9),
        (
            "coulomb",
            "friction beyond the cone of a pivot that stands, of the acceleration at play",
            1e-7,
        ),
        (
            "push",
            "tension in a contact that can only push, of the acceleration at play",
            1e-7,
        ),
        (
            "energy",
            "energy less the work of base and friction, between events, of the energy at play",
            1e-9,
        ),
        (
            "impacts",
            "relative energy that an impact without restitution, or with the energy cap, adds",
            0.0,
        ),
        ("mirror", "bits that differ in the mirror image", 0.0),
        ("similarity", "rotation of the scene at another scale, within the horizon, rad", 1e-6),
        ("tolerance", "rotation at tolerance/100, within the horizon, rad", 1e-6),
        (
            "clearance",
            "a wall just out of the reach of the block without walls is struck, or one just within"
            " is not (1: so it is)",
            0.0,
        ),
        (
            "decided",
            "peak of a run that ends once it is certain, against the whole run's and its rows', rad"
            " (pi: another side)",
            1e-6,
        ),
        # of models that approximate contact
        (
            "depth",
            "penetration over twice the way that a step, or the contact's spring, takes at this"
            " motion",
            1.0,
        ),
        (
            "source",
            "energy beyond that of the start and the work of the base, of all work done",
            0.05,
        ),
    )
}
#: The horizon of predictability of a run is the first of three times: a relative disturbance of the
#: scene's data by DISTURBANCE turns the block by SEEN rad (half the bound of the invariants that
#: end there); answers at tolerances finer than EXACT, a hundred times apart, differ by a tenth of
#: SEEN; friction near Painleve's limit lets a difference of EXACT grow to SEEN (`_amplified`).
DISTURBANCE, SEEN, DISTURBED, EXACT = 1e-7, 5e-7, 6, 1e-10
#: Rows of an audited history: this fraction of the shortest time in the scene, and at most this
#: many.
FINE, MOST_ROWS = 64, 4000
#: A whole run goes on for this time (sqrt(R/g)) after the base, and ends in at most so many steps.
SETTLED, MOST_STEPS = 300.0, 50_000
#: No condition is checked within this time (sqrt(R/g)) of an event or a jump.
NEAR = 1e-9
#: The reach of a block is known where it is this many times the largest change between two rows.
RESOLVES = 4.0
#: An integral is used where rules of order 6 and 10 agree to this, relatively: the error of order
#: 10 is then far smaller.
RESOLVED = 1e-10
SWAPPED = {"overturned left": "overturned right", "overturned right": "overturned left"}


@dataclass(frozen=True, kw_only=True)
class CheckedRun:
    """One checked run: the figure of each invariant that was checked, and its failure, if any."""

    figures: dict[str, float]
    failure: str = ""
    outcome: str = ""
    #: "events"; "gaining": 1 where impacts added energy, as their law is known to do (see `rules`);
    #: "horizons": 1 where the horizon of predictability had to be computed.
    counts: Mapping[str, int] = field(default_factory=dict)
    #: The most energy that an impact added.
    largest_gain: float = 0.0
    #: How often each modelling choice was made.
    rules: Mapping[str, int] = field(default_factory=dict)
    #: Invariants that could not be judged.
    unjudged: tuple[str, ...] = ()

    @property
    def broken(self) -> list[str]:
        """Names of the invariants that do not hold."""
        return [name for name, value in self.figures.items() if not value <= INVARIANTS[name].bound]


def check_run(
    model: EventBasedModel, scene: Scene, *, seed: int = 0, audit: bool = False, only: str = ""
) -> CheckedRun:
    """Plays a scene and checks every invariant, or only one.

    With `audit` also those that ask for many rows or a long run: energy, clearance, decided.
    """
    played = audited(scene) if audit else scene
    try:
        history = model.simulate(played)
    except ModelFailure as error:
        return CheckedRun(figures={"ends": 1.0}, failure=str(error))
    figures = {"ends": 0.0, "finite": not_finite(history)}
    if figures["finite"]:
        return CheckedRun(figures=figures, outcome=history.outcome)
    motion, cost = Motion(played, history), history.cost
    figures |= {"outcome": float(_contradicts(played, history)), **conditions(model, motion)}
    if audit:  # at the finer tolerance, whose error does not disturb the balance
        with suppress(ModelFailure):
            energy = _energy(model.finer(), played)
            figures |= {"energy": energy} if energy is not None else {}
        with suppress(ModelFailure):
            figures["clearance"] = float(_wrong_clearance(model, played, seed))
        figures["decided"] = _decided_apart(model, scene)
    bounces = max([scene.floor.restitution, *(wall.restitution for wall in scene.walls)]) > 0.0
    if model.pivot == "unilateral":
        figures["impacts"] = (
            cost.largest_energy_gain
            if cost.energy_gains and (model.energy_cap or not bounces)
            else 0.0
        )
    horizon = _Horizon(model, motion, seed)
    later = {
        "mirror": lambda: _mirror(model, motion),
        "similarity": lambda: horizon.apart(similar(played, seed)),
        "tolerance": lambda: horizon.apart(played, model.finer()),
    }
    figures |= {name: figure() for name, figure in later.items() if only in ("", name)}
    return CheckedRun(
        figures={name: figure for name, figure in figures.items() if only in ("", name)},
        outcome=history.outcome,
        counts={
            "events": len(history.event_list),
            "gaining": int(cost.energy_gains > 0),
            "horizons": horizon.found,
        },
        largest_gain=cost.largest_energy_gain,
        rules=cost.rules,
        failure=horizon.failure,
        unjudged=("energy",) if audit and "energy" not in figures else (),
    )


def _wrong_clearance(model: EventBasedModel, scene: Scene, seed: int) -> bool:
    """Whether a wall just out of reach is struck, or one just within reach is not.

    The distance to the reach is the largest change of the clearance between two rows, and what the
    model does not resolve. False for a block that falls, or hardly moves. A strike may be part of
    a landing (the choice "lands along a wall").
    """
    side: Side = "left" if seed % 2 else "right"
    rows = scene.output_times
    if len(rows) < 2:
        return False
    scene = scene.replace(duration=float(rows[-1]))  # what follows has no row
    history = model.simulate(scene.replace(walls=()))
    if history.overturned_at is not None:
        return False
    gaps = kinematics.clearance(
        scene.block, side, 0.0, history.channels["x"], history.channels["theta"]
    )
    reach = float(np.max(-gaps))
    # A contact that parts at the settling speed stays closed: what is smaller is not resolved.
    room = float(np.max(np.abs(np.diff(gaps)))) + 2.0 * SETTLE * scene.block.radius
    if reach - max(0.0, -float(gaps[0])) < RESOLVES * room:
        return False
    return [
        "lands along a wall" in one.cost.rules
        or any(event.kind == "wall impact" for event in one.event_list)
        for one in (
            model.simulate(scene.replace(walls=(Wall(side=side, gap=gap),)))
            for gap in (reach + room, reach - room)
        )
    ] != [False, True]


def _decided_apart(model: EventBasedModel, scene: Scene) -> float:
    """How far the peak of a run that ends once it is certain is from the whole run's, rad.

    Or, if more, how far a row of the whole run is above its peak. Pi where they overturn to other
    sides. 0 where no run ends so (Bouc-Wen), or the whole one has not ended `SETTLED` after the
    base.
    """
    if not model.decides:
        return 0.0
    rows, capped = batch.pack([scene], model), model.model_copy(update={"most_steps": MOST_STEPS})
    quiet = max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    ends = rows.given["duration"] / scene.duration * quiet + SETTLED
    rows.given["duration"], rows.given["output_step"] = ends, ends / MOST_ROWS
    early, whole = (
        batch.run_batch(rows, capped, until_decided=not count, rows=count, strict=False, jobs=1)
        for count in (0, MOST_ROWS)
    )
    decided, run = early.runs[0], whole.runs[0]
    if early.failed[0] or not (whole.side[0] or run.at_rest):
        return 0.0
    seen = np.max(np.abs(whole.out[0, : run.rows, 2])) - run.peak
    apart = max(abs(decided.peak - run.peak), seen)
    return float(apart) if early.side == whole.side else math.pi


def _energy(model: EventBasedModel, scene: Scene) -> float | None:
    """The energy's error, or None where it cannot be judged.

    If it is too large, or cannot be judged, it is computed again from rows four times as dense.
    That removes an error of the integral, but not one of the motion.
    """
    error = energy_error(model, Motion(scene, model.simulate(scene)))
    if error is None or error > INVARIANTS["energy"].bound:
        near = scene.replace(output_step=scene.output_step / 4.0)
        closer = energy_error(model, Motion(near, model.simulate(near)))
        error = error if closer is None else closer
    return error


def audited(scene: Scene) -> Scene:
    """The scene with rows so dense that integrals over them are exact to 1e-10.

    It is cut after `MOST_ROWS` rows.
    """
    bases = scene.excitation, scene.vertical
    step = min(
        [
            0.03 * math.sqrt(scene.block.radius / scene.gravity),
            *(one.period / FINE for one in bases if isinstance(one, Ricker | Sine)),
        ]
    )
    if records := [one.time_step for one in bases if isinstance(one, Record)]:
        step = records[0] / (GROUP * max(1, math.ceil(records[0] / (GROUP * step))))
    return scene.replace(output_step=step, duration=min(scene.duration, MOST_ROWS * step))


def _contradicts(scene: Scene, history: History) -> bool:
    falls = [one.kind for one in history.event_list if one.kind.startswith("overturned")]
    times = [event.t for event in history.event_list] + [scene.duration * (1.0 + 1e-12)]
    backward = bool(np.any(np.diff(times) < 0.0))
    if history.outcome.startswith("overturned"):
        return backward or not falls == [history.outcome] == [history.event_list[-1].kind]
    whole = len(history.channels["t"]) == len(scene.output_times)
    upright = np.all(np.abs(history.channels["theta"]) < math.pi / 2)
    return backward or bool(falls) or not (whole and upright)


def conditions(model: EventBasedModel, motion: Motion) -> dict[str, float]:
    """Contacts, Coulomb's law and the signs of forces in every row, away from events."""
    # Rounding of x does not count as depth.
    rounding = 4e-16 * np.abs(motion.channels["x"]) / motion.radius
    depth = np.max([-motion.height, *(-gap - rounding for gap in motion.gaps.values())])
    found = {
        "penetration": max(0.0, float(depth)),
        "floor": _largest(np.abs(motion.height), ~motion.within("flight", "overturned")),
    }
    if model.friction == "bouc-wen":  # its pivot creeps, and its friction is not in a history
        return found
    drift = 1e-6 * np.abs(motion.channels["x_dot"]) * motion.unit / motion.radius
    speed = np.abs(motion.slip) / (1.0 + drift + np.abs(motion.w))
    friction, push = _force_conditions(model, motion)
    return found | {
        "stick": _largest(speed, motion.within("rest", "rock", "lean")),
        "coulomb": friction,
        "push": push,
    }


def _largest(values: Floats, rows: Mask) -> float:
    return float(np.max(values[rows], initial=0.0))


def _free(times: Sequence[float], first: Floats, last: Floats) -> Mask:
    """Where none of the times lies between `first` and `last`."""
    before, until = np.searchsorted(np.sort(times), (first, last))
    return np.asarray(before == until)


def _force_conditions(model: EventBasedModel, motion: Motion) -> tuple[float, float]:
    """Largest friction beyond the cone, and largest tension, relative to 1 + |u| + |vg| + w^2."""
    scene, t, theta = motion.scene, motion.channels["t"], motion.channels["theta"]
    bases = [one for one in (scene.excitation, scene.vertical) if one.kind != "rest"]
    breaks = [
        *(event.t for event in motion.history.event_list),
        *(time for one in bases for time in (0.0, one.quiet_after)),
    ]
    near = NEAR * motion.unit + 1e-12 * np.abs(t)
    clear = _free(breaks, t - near, t + near)
    u, g, w, mu_s = motion.u, 1.0 + motion.vertical, motion.w, motion.scene.floor.mu_s
    scale = 1.0 + np.abs(u) + np.abs(g) + w * w
    unilateral = model.pivot == "unilateral"
    pivots = scene.block.pivot("left"), scene.block.pivot("right")
    # A base that accelerates to the right tips the block to the left.
    tips = np.where(u > 0.0, *(pivot.arm / pivot.height for pivot in pivots))
    limit = tips if model.friction == "no-slip" else np.minimum(tips, max(mu_s, 1e-9))
    rest = clear & motion.within("rest") & ~(motion.tip | motion.far)
    excess = _largest((np.abs(u) - limit * np.abs(g)) / scale, rest)
    tension = _largest(-g / scale, clear & motion.within("rest", "slide") & unilateral)
    slides = motion.within("slide-rock", "ladder")
    tilted = (
        clear
        & motion.within("rock", "slide-rock", "lean", "ladder")
        & (theta != 0.0)
        & ~(motion.within("lean", "ladder") & (motion.tip == motion.far))
        & ~(slides & (np.abs(motion.slip) < SLIPS))
    )
    direction = np.where(slides, np.sign(motion.sign * motion.slip), 0.0)
    beyond, pulls = [], []
    # What happens within NEAR is one event, in the core and here: a spinning block passes through
    # its friction cone in less time. So a condition is broken only where it is broken for that long
    # before and after.
    for moment in (0.0, -NEAR, NEAR):
        (normal, friction, tip, far), _ = motion.forces(tilted, direction, later=moment)
        beyond.append(np.abs(friction) - mu_s * np.abs(normal))
        pulls.append(np.maximum(np.maximum(-tip, -far), -normal if unilateral else -math.inf))
    over, pull = (np.min(one, axis=0) / scale[tilted] for one in (beyond, pulls))
    if model.friction != "no-slip":
        excess = max(excess, _largest(over, direction[tilted] == 0))
    return excess, max(tension, float(np.max(pull, initial=0.0)))


def energy_error(model: EventBasedModel, motion: Motion) -> float | None:
    """Largest change of energy that the work of base and friction does not account for.

    The change is over eight rows without event or kink, relative to the energy and the work at play
    in the run, at least g R. Where friction is not known (Bouc-Wen): the gain of energy beyond the
    work of the base and what the friction spring can hold. None where no eight rows can be judged:
    the history has fewer, events or kinks lie in all of them, or the work is not resolved in any.
    """
    scene, radius, vg = motion.scene, motion.radius, motion.vertical
    energy = motion.energy / (scene.gravity * radius)
    speed = radius / motion.unit
    power = -(motion.u * motion.across + vg * motion.up) / speed
    if model.friction != "bouc-wen":  # the floor's friction, too
        along, mu = motion.sign * motion.slip, scene.floor.friction
        power = power - np.where(motion.within("slide"), mu * np.abs(1.0 + vg) * np.abs(along), 0.0)
        tilted = motion.within("slide-rock", "ladder")
        forces, _ = motion.forces(tilted, np.where(along >= 0.0, 1.0, -1.0))
        power[tilted] += forces[1] * along[tilted]
    whole, quiet = _whole_groups(scene, motion.history)
    step = scene.output_step / motion.unit
    work, moved = integrals(step, power), integrals(step, np.abs(power))
    before, after = energy[:-1:GROUP][: len(work)], energy[GROUP::GROUP][: len(work)]
    size = 1.0 + np.maximum(after, moved)
    off = (after - before - work) / size
    doubt = np.where(whole, np.abs(work - integrals(step, power, BOOLE)) / size, 0.0)
    # Checked in the groups before and after, too: the difference of the two rules says nothing
    # where it changes its sign.
    beside = np.append(doubt[1:], 0.0), np.append(0.0, doubt[:-1])
    whole &= np.maximum(doubt, np.maximum(*beside)) < RESOLVED
    if model.friction == "bouc-wen":
        # Of `up`, per row; with gravity it is the floor's force.
        rise = np.abs(np.diff(motion.up)) / speed / step
        force = 2.0 + np.max(np.abs(vg)) + rise[: len(work) * GROUP].reshape(-1, GROUP).max(axis=1)
        held = scene.floor.friction * model.yield_displacement / radius * force
        return _largest(off - held / size, whole) if whole.any() else None
    whole &= quiet
    return _largest(np.abs(off), whole) if whole.any() else None


def energy_without_source(motion: Motion) -> float:
    """Largest energy beyond the initial one and the work of the base, relative to that at play.

    At play are g R, the initial energy and all work done by then.

    The base's acceleration acts on the block as a force. Its work between two rows is its impulse
    times the mean of the velocities before and after. It is exact however the acceleration changes
    between the rows (a record can be finer than they are) where the block stands, and where nothing
    but the base changes its velocity.
    """
    scene, energy, t = motion.scene, motion.energy, motion.channels["t"]
    work, moved = np.zeros(len(energy)), np.zeros(len(energy))
    for excitation, velocity in (
        (scene.excitation, motion.across),
        (scene.vertical, motion.up),
    ):
        # The velocity of the base: the integral, exact for a record, which is linear between its
        # samples and zero after the last one.
        times = t
        if isinstance(excitation, Record):
            kinks = excitation.time_step * np.arange(len(excitation.unscaled))
            kinks = np.append(kinks, np.nextafter(kinks[-1], np.inf))
            times = np.union1d(t, kinks[kinks < t[-1]])
        acceleration = excitation.acceleration(times)
        gained = np.cumsum(0.5 * np.diff(times) * (acceleration[1:] + acceleration[:-1]))
        impulse = -np.diff(np.append(0.0, gained)[np.searchsorted(times, t)])
        part = 0.5 * (velocity[1:] + velocity[:-1]) * impulse
        work[1:] += np.cumsum(part)
        moved[1:] += np.cumsum(np.abs(part))
    size = scene.gravity * motion.radius + np.abs(energy[0]) + moved
    return float(np.max((energy - energy[0] - work) / size))


def _whole_groups(scene: Scene, history: History) -> tuple[Mask, Mask]:
    """Which groups of eight steps have no event or kink inside; which have one mode in all rows."""
    t, mode = history.channels["t"], history.channels["mode"]
    groups = (len(t) - 1) // GROUP
    edges = t[: groups * GROUP + 1 : GROUP]
    events = [event.t for event in history.event_list]
    bases = scene.excitation, scene.vertical
    records = [one for one in bases if isinstance(one, Record)]
    kinks = [time for one in records for time in one.time_step * np.arange(len(one.unscaled))]
    ends = [one.quiet_after for one in bases if isinstance(one, Ricker | Sine)]
    near = 1e-9 * scene.output_step

    # An event at an edge itself: the row there is from before or after it. The base acceleration
    # jumps where a record ends.
    whole = _free([*events, *kinks, *ends], edges[:-1] + near, edges[1:] - near) & _free(
        [*events, *(one.quiet_after for one in records)],
        edges[:-1] - 1e3 * near,
        edges[1:] + 1e3 * near,
    )
    nodes = mode[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return whole, np.all(nodes == nodes[:, :1], axis=1)


def _mirror(model: EventBasedModel, motion: Motion) -> float:
    """Number of values that differ in any bit from those of the mirror image.

    Infinite where the lengths differ, or the mirrored run fails.
    """
    history = motion.history
    try:
        image = model.simulate(motion.scene.mirrored())
    except ModelFailure:
        return math.inf
    ours, theirs = ((len(one.channels["t"]), len(one.event_list)) for one in (history, image))
    if ours != theirs:
        return math.inf
    odd = ("x", "theta", "x_dot", "theta_dot", "slip", "slip_rate")
    mirrored = {
        name: -image.channels[name] if name in odd else image.channels[name]
        for name in ("t", "y", "y_dot", "mode", *odd)
    }
    differ = [
        *(np.sum(motion.channels[name] != values) for name, values in mirrored.items()),
        *(
            replace(a, kind=SWAPPED.get(a.kind, a.kind)) != b
            for a, b in zip(history.event_list, image.event_list, strict=True)
        ),
    ]
    return float(sum(differ) + (image.outcome != SWAPPED.get(history.outcome, history.outcome)))


def similar(scene: Scene, seed: int) -> Scene:
    """The scene at another scale, with the same accelerations.

    Lengths are multiplied by k, times by sqrt(k); k is random in 0.01 to 100.
    """
    k = float(np.exp(np.random.default_rng([seed, 1]).uniform(math.log(1e-2), math.log(1e2))))
    root = math.sqrt(k)
    return scene.replace(
        block=scene.block.scaled(k),
        walls=tuple(wall.replace(gap=k * wall.gap) for wall in scene.walls),
        excitation=scene.excitation.stretched(root),
        vertical=scene.vertical.stretched(root),
        duration=root * scene.duration,
        output_step=root * scene.output_step,
        initial_angular_velocity=scene.initial_angular_velocity / root,
        initial_velocity=root * scene.initial_velocity,
        initial_height=k * scene.initial_height,
    )


class _Horizon:
    """Compares histories of a scene within its horizon of predictability.

    That is the time at which a small disturbance of the scene's data shows; it is computed only if
    needed.
    """

    def __init__(self, model: EventBasedModel, motion: Motion, seed: int) -> None:
        self.model, self.motion, self.seed = model, motion, seed
        self.found, self.failure = 0, ""

    def apart(self, scene: Scene, model: EventBasedModel | None = None) -> float:
        """Largest |difference of theta| in rad within the horizon.

        Infinite where the other run fails.
        """
        played, history = model or self.model, self.motion.history
        if played.friction == "bouc-wen" and scene.block.radius != self.motion.radius:
            size = played.yield_displacement * scene.block.radius / self.motion.radius
            played = played.model_copy(update={"yield_displacement": size})
        try:
            other = played.simulate(scene)
        except ModelFailure as error:
            self.failure = f"{self.failure}; {error}".strip("; ")
            return math.inf
        difference = _differences(history, other)
        if len(history.channels["t"]) != len(other.channels["t"]) or np.any(difference > SEEN):
            difference = difference[: self.row]
        return float(np.max(difference, initial=0.0))

    @cached_property
    def row(self) -> int:
        """The first row beyond the horizon of predictability (see `DISTURBANCE`)."""
        self.found, scene, history = 1, self.motion.scene, self.motion.history
        compared: list[tuple[History, History, float]] = []
        # The horizon belongs to the scene, however coarse the model is. Rounding is a disturbance,
        # too: finer tolerances must agree on the answer.
        for by in (10.0, 100.0):
            with suppress(ModelFailure):
                a, b = (
                    self.model.model_copy(update={"tolerance": EXACT / times}).simulate(scene)
                    for times in (by, 100.0 * by)
                )
                compared.append((a, b, 0.1 * SEEN))
        for disturbed in _disturbed(scene, self.seed):
            with suppress(ModelFailure):
                compared.append((history, self.model.simulate(disturbed), SEEN))
        # the rows, from the first on, in which theta differs by no more than is seen, rad
        rows = [
            int(np.argmax(np.append(_differences(a, b) > seen, True))) for a, b, seen in compared
        ]
        grown = np.flatnonzero(_amplified(self.motion) > math.log(SEEN / EXACT))
        return min([len(history.channels["t"]), *rows, *map(int, grown[:1])])


def _amplified(motion: Motion) -> Floats:
    """Logarithm, by row, of how much sliding friction has amplified a small rate difference.

    The rate is that of rotation, w. With P = N/D a slipping pivot has theta'' = -(s + k c)/I N/D,
    in which N falls with w^2: near Painleve's limit, where D is small, a difference of w grows or
    decays faster than all else. A disturbance of the scene's data may have decayed before, and then
    does not show this growth; a rounding error of the moment grows all the same. So the sum starts
    anew wherever it is negative.
    """
    theta, slip, step = motion.channels["theta"], motion.slip, 1e-4
    slides = motion.within("slide-rock") & (theta != 0.0) & (np.abs(slip) > SLIPS)
    rate = np.zeros(len(theta))
    direction = np.sign(motion.sign * slip)
    faster, slower = (motion.forces(slides, direction, faster=by)[1] for by in (step, -step))
    rate[slides] = (faster - slower) / (2.0 * step)
    grown, times = np.zeros(len(theta)), np.diff(motion.channels["t"]) / motion.unit
    for k in np.flatnonzero(slides[1:]).tolist():
        grown[k + 1] = max(0.0, grown[k] + 0.5 * (rate[k] + rate[k + 1]) * times[k])
    return grown


def _differences(a: History, b: History) -> Floats:
    rows = min(len(a.channels["t"]), len(b.channels["t"]))
    return np.abs(a.channels["theta"][:rows] - b.channels["theta"][:rows])


def _disturbed(scene: Scene, seed: int) -> Iterable[Scene]:
    """The scene with all its data changed at random, by up to a relative `DISTURBANCE`.

    Each sample of a record is changed by itself: else nothing would add energy to a block that
    bounces without loss. Every other scene is changed to the other side: a scene at a limit is to
    be seen on both.
    """

    def by(value: float) -> float:
        return value * (
            1.0 + side * DISTURBANCE * float(r.choice([-1.0, 1.0])) * float(r.uniform(0.5, 1.0))
        )

    def shaken(base: Excitation) -> Excitation:
        if isinstance(base, Record):
            return base.replace(unscaled=tuple(map(by, base.unscaled)))
        return base if base.kind == "rest" else base.scaled(by(1.0))

    block, floor = scene.block, scene.floor
    for number in range(DISTURBED):
        r, side = np.random.default_rng([seed, 2, number // 2]), (-1.0) ** number
        kinetic = by(floor.friction)
        static = None if floor.static_friction is None else max(by(floor.static_friction), kinetic)
        bounce = min(by(floor.restitution), 1.0)
        with suppress(InputError):  # a value at its limit is past it now
            change: dict[str, object] = {
                "block": block.replace(
                    half_width=by(block.half_width),
                    centre_of_mass=block.centre_of_mass and tuple(map(by, block.offset)),
                    moment_of_inertia=block.moment_of_inertia and by(block.moment_of_inertia),
                ),
                "floor": floor.replace(
                    friction=kinetic, static_friction=static, restitution=bounce
                ),
                "walls": tuple(
                    wall.replace(gap=by(wall.gap), restitution=min(by(wall.restitution), 1.0))
                    for wall in scene.walls
                ),
                "excitation": shaken(scene.excitation),
                "vertical": shaken(scene.vertical),
                **{
                    name: by(getattr(scene, name))
                    for name in ("initial_angular_velocity", "initial_velocity", "initial_height")
                },
            }
            try:
                yield scene.replace(**change, initial_rotation=by(scene.initial_rotation))
            except InputError:  # it would start inside a wall
                yield scene.replace(
                    **change, initial_rotation=scene.initial_rotation * (1.0 - DISTURBANCE)
                )
