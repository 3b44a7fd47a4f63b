"""What must hold of every history, whatever the scene. Each invariant gives a figure, which must
stay below its bound.

Figures are in natural units (lengths in R, accelerations in g, times in sqrt(R/g)), energies
relative to what was at play.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    History,
    InputError,
    ModelFailure,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    kinematics,
)
from rockcheck.validation.studies.stress.mechanics import (
    BOOLE,
    GROUP,
    arms,
    integrals,
    tilted_forces,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Invariant:
    """A condition: its name, what its figure means, and the largest value that is allowed."""

    name: str
    words: str
    bound: float


INVARIANTS = {
    one.name: one
    for one in (
        Invariant(
            "ends", "the run ends within its caps, in a mode of motion (1: it does not)", 0.0
        ),
        Invariant("finite", "values that are not finite", 0.0),
        Invariant(
            "outcome", "rows, last event and outcome contradict each other (1: they do)", 0.0
        ),
        Invariant("penetration", "depth of a corner in floor or wall, R", 1e-9),
        Invariant(
            "floor", "height of the pivot over the floor in modes that have it there, R", 1e-9
        ),
        Invariant("stick", "slip rate of a pivot that stands, sqrt(g R)", 1e-9),
        Invariant(
            "coulomb",
            "friction beyond the cone of a pivot that stands, of the acceleration at play",
            1e-7,
        ),
        Invariant(
            "push", "tension in a contact that can only push, of the acceleration at play", 1e-7
        ),
        Invariant(
            "energy",
            "energy less the work of base and friction, between events, of the energy at play",
            1e-9,
        ),
        Invariant(
            "impacts",
            "relative energy that an impact without restitution, or with the energy cap, adds",
            0.0,
        ),
        Invariant("mirror", "bits that differ in the mirror image", 0.0),
        Invariant(
            "similarity", "rotation of the scene at another scale, within the horizon, rad", 1e-6
        ),
        Invariant("tolerance", "rotation at tolerance/100, within the horizon, rad", 1e-6),
        # of models that approximate contact
        Invariant(
            "depth",
            "penetration over twice the way that a step, or the contact's spring, takes at this"
            " motion",
            1.0,
        ),
        Invariant(
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
#: Thresholds of a closed contact and of slip; no condition is checked within this time of an event
#: or a jump.
CLOSED, SLIPS, NEAR = 1e-8, 1e-9, 1e-9
#: An integral is used where rules of order 6 and 10 agree to this, relatively: the error of order
#: 10 is then far smaller.
RESOLVED = 1e-10
#: Kinds of motion by the contacts they have.
ON_FLOOR = ("rest", "slide", "rock", "slide-rock", "lean", "ladder")
STANDS = ("rest", "rock", "lean")

EVEN = ("t", "y", "y_dot", "mode")
ODD = ("x", "theta", "x_dot", "theta_dot", "slip", "slip_rate")
SWAPPED = {"overturned left": "overturned right", "overturned right": "overturned left"}


@dataclass(frozen=True, kw_only=True)
class CheckedRun:
    """What was found of one run: the figure of each invariant that was looked at, and how it failed
    to end."""

    figures: dict[str, float]
    failure: str = ""
    outcome: str = ""
    events: int = 0
    #: Impacts that added energy where the impact law is known to do so (see `rules`), and the most
    #: that one added.
    gains: int = 0
    largest_gain: float = 0.0
    #: How often each modelling choice was made.
    rules: Mapping[str, int] = field(default_factory=dict)
    #: Whether the horizon of predictability had to be computed.
    horizons: int = 0
    #: Invariants that could not be judged.
    unjudged: tuple[str, ...] = ()

    @property
    def broken(self) -> list[str]:
        """Names of the invariants that do not hold."""
        return [name for name, value in self.figures.items() if not value <= INVARIANTS[name].bound]


def check_run(
    model: EventBasedModel, scene: Scene, *, seed: int = 0, audit: bool = False, only: str = ""
) -> CheckedRun:
    """Plays a scene and checks every invariant, or only one. With `audit` also those that ask for
    many rows: energy."""
    played = audited(scene) if audit else scene
    figures: dict[str, float] = {}
    try:
        history = model.simulate(played)
    except ModelFailure as error:
        return CheckedRun(figures={"ends": 1.0}, failure=str(error))
    figures["ends"] = 0.0
    figures["finite"] = _not_finite(history)
    if figures["finite"]:
        return CheckedRun(figures=figures, outcome=history.outcome)
    figures["outcome"] = float(_contradicts(played, history))
    figures |= conditions(model, played, history)
    if audit:  # at the finer tolerance, whose error does not disturb the balance
        with suppress(ModelFailure):
            energy = _energy(finer(model), played)
            figures |= {"energy": energy} if energy is not None else {}
    capped = model.energy_cap or not _bounces(scene)
    gains = history.cost.energy_gains
    if model.pivot == "unilateral":
        figures["impacts"] = history.cost.largest_energy_gain if capped and gains else 0.0
    horizon = _Horizon(model, played, seed)
    if only in ("", "mirror"):
        figures["mirror"] = _mirror(model, played, history)
    if only in ("", "similarity"):
        figures["similarity"] = horizon.apart(history, similar(played, seed))
    if only in ("", "tolerance"):
        figures["tolerance"] = horizon.apart(history, played, finer(model))
    return CheckedRun(
        figures=figures
        if not only
        else {name: figure for name, figure in figures.items() if name == only},
        outcome=history.outcome,
        events=len(history.event_list),
        gains=gains,
        largest_gain=history.cost.largest_energy_gain,
        rules=history.cost.rules,
        horizons=horizon.found,
        failure=horizon.failure,
        unjudged=("energy",) if audit and "energy" not in figures else (),
    )


def _energy(model: EventBasedModel, scene: Scene) -> float | None:
    """The energy's error, or None where it cannot be judged.

    If it is too large, or cannot be judged, it is computed again from rows four times as dense.
    That removes an error of the integral, but not one of the motion.
    """
    error = energy_error(model, scene, model.simulate(scene))
    if error is None or error > INVARIANTS["energy"].bound:
        near = scene.replace(output_step=scene.output_step / 4.0)
        closer = energy_error(model, near, model.simulate(near))
        error = error if closer is None else closer
    return error


def finer(model: EventBasedModel, times: float = 100.0) -> EventBasedModel:
    """The same model at a tolerance so many times finer."""
    return model.model_copy(update={"tolerance": model.tolerance / times})


def audited(scene: Scene) -> Scene:
    """The scene with rows so dense that integrals over them are exact to 1e-10, and no longer than
    can be afforded."""
    unit = math.sqrt(scene.block.radius / scene.gravity)
    step = 0.03 * unit
    for excitation in (scene.excitation, scene.vertical):
        if isinstance(excitation, Ricker | Sine):
            step = min(step, excitation.period / FINE)
    for excitation in (scene.excitation, scene.vertical):
        if isinstance(excitation, Record):
            step = excitation.time_step / (
                GROUP * max(1, math.ceil(excitation.time_step / (GROUP * step)))
            )
            break
    return scene.replace(output_step=step, duration=min(scene.duration, MOST_ROWS * step))


def _bounces(scene: Scene) -> bool:
    return scene.floor.restitution > 0.0 or any(wall.restitution > 0.0 for wall in scene.walls)


def _not_finite(history: History) -> float:
    return float(
        sum(
            np.sum(~np.isfinite(column))
            for column in history.channels.values()
            if column.dtype.kind == "f"
        )
    )


def _contradicts(scene: Scene, history: History) -> bool:
    """Whether the run's end contradicts its outcome."""
    falls = [event for event in history.event_list if event.kind.startswith("overturned")]
    rows, theta = len(history.channels["t"]), history.channels["theta"]
    times = [event.t for event in history.event_list]
    if any(b < a for a, b in itertools.pairwise(times)) or (
        times and times[-1] > scene.duration * (1.0 + 1e-12)
    ):
        return True
    if history.outcome.startswith("overturned"):
        return [event.kind for event in falls] != [history.outcome] or history.event_list[
            -1
        ] is not falls[0]
    return (
        bool(falls) or rows != len(scene.output_times) or bool(np.any(np.abs(theta) >= math.pi / 2))
    )


def conditions(model: EventBasedModel, scene: Scene, history: History) -> dict[str, float]:
    """Contacts, Coulomb's law and the signs of forces in every row, away from events."""
    block, radius, gravity = scene.block, scene.block.radius, scene.gravity
    unit = math.sqrt(radius / gravity)
    channels = history.channels
    t, theta, mode = channels["t"], channels["theta"], channels["mode"]
    height = kinematics.pivot_height(block, channels["y"], theta) / radius
    gaps = _gaps(scene, channels["x"], theta)
    # Rounding of x does not count as depth.
    rounding = 4e-16 * np.abs(channels["x"]) / radius
    depth = [float(np.max(-height)), *(float(np.max(-gap - rounding)) for gap in gaps.values())]
    on_floor, stands = np.isin(mode, ON_FLOOR), np.isin(mode, STANDS)
    speed = np.abs(channels["slip_rate"]) * unit / radius
    scale = (
        1.0
        + 1e-6 * np.abs(channels["x_dot"]) * unit / radius
        + np.abs(channels["theta_dot"]) * unit
    )
    found = {
        "penetration": max(0.0, *depth),
        "floor": float(np.max(np.abs(height[on_floor]), initial=0.0)),
    }
    if model.friction == "bouc-wen":  # its pivot creeps, and its friction is not in a history
        return found
    found["stick"] = float(np.max((speed / scale)[stands], initial=0.0))
    clear = _clear(scene, history, t)
    friction, push = _force_conditions(model, scene, history, gaps, clear)
    return found | {"coulomb": friction, "push": push}


def _gaps(scene: Scene, x: Floats, theta: Floats) -> dict[str, Floats]:
    """Clear distance to each wall, R."""
    return {
        wall.side: kinematics.wall_gap(scene, wall.side, x, theta) / scene.block.radius
        for wall in scene.walls
    }


def _touches(gaps: dict[str, Floats], rows: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """In which rows the block touches the left wall, and the right one."""
    nowhere = np.full(rows, math.inf)
    return gaps.get("left", nowhere) < CLOSED, gaps.get("right", nowhere) < CLOSED


def _clear(scene: Scene, history: History, t: Floats) -> NDArray[np.bool_]:
    """Rows that are neither at an event nor at a jump of the base acceleration."""
    jumps = [event.t for event in history.event_list]
    for excitation in (scene.excitation, scene.vertical):
        if excitation.kind != "rest":
            jumps += [0.0, excitation.quiet_after]
    places = np.sort(np.array([*jumps, -math.inf, math.inf]))
    after = np.searchsorted(places, t)
    unit = math.sqrt(scene.block.radius / scene.gravity)
    near = NEAR * unit + 1e-12 * np.abs(t)
    return np.asarray((t - places[after - 1] > near) & (places[after] - t > near))


def _force_conditions(
    model: EventBasedModel,
    scene: Scene,
    history: History,
    gaps: dict[str, Floats],
    clear: NDArray[np.bool_],
) -> tuple[float, float]:
    """Largest friction beyond the cone, and largest tension, relative to 1 + |u| + |vg| + w^2."""
    channels = history.channels
    unit = math.sqrt(scene.block.radius / scene.gravity)
    u = scene.excitation.acceleration(channels["t"]) / scene.gravity
    g = 1.0 + scene.vertical.acceleration(channels["t"]) / scene.gravity
    mode, theta = channels["mode"], channels["theta"]
    w = channels["theta_dot"] * unit
    slip = channels["slip_rate"] * unit / scene.block.radius
    scale = 1.0 + np.abs(u) + np.abs(g) + w * w
    mu_s = scene.floor.mu_s
    excess = tension = 0.0
    left, right = _touches(gaps, len(theta))
    unilateral = model.pivot == "unilateral"

    rest = clear & (mode == "rest") & ~left & ~right
    pivots = scene.block.pivot("left"), scene.block.pivot("right")
    # A base that accelerates to the right tips the block to the left.
    tips = np.where(u > 0.0, *(pivot.arm / pivot.height for pivot in pivots))
    limit = tips if model.friction == "no-slip" else np.minimum(tips, max(mu_s, 1e-9))
    excess = max(
        excess, float(np.max(((np.abs(u) - limit * np.abs(g)) / scale)[rest], initial=0.0))
    )
    flat = clear & np.isin(mode, ("rest", "slide"))
    if unilateral:
        tension = max(tension, float(np.max((-g / scale)[flat], initial=0.0)))

    sign = _pivots(theta)
    tip, far = np.where(sign > 0, left, right), np.where(sign > 0, right, left)
    walls = np.isin(mode, ("lean", "ladder"))
    tilted = (
        clear
        & np.isin(mode, ("rock", "slide-rock", "lean", "ladder"))
        & (theta != 0.0)
        & ~(walls & (tip == far))
    )
    slides = np.isin(mode, ("slide-rock", "ladder"))
    tilted &= ~(slides & (np.abs(slip) < SLIPS))
    if not tilted.any():
        return excess, tension
    direction = np.where(slides, np.sign(sign * slip), 0.0).astype(np.int8)[tilted]
    on = np.ones(int(tilted.sum()), dtype=bool)
    touching = on, (tip & walls)[tilted], (far & walls)[tilted]
    over, pulls = np.full(len(on), math.inf), np.full(len(on), math.inf)
    # What happens within NEAR is one event, in the core and here: a spinning block passes through
    # its friction cone in less time. So a condition is broken only where it is broken for that long
    # before and after.
    for moment in (0.0, -NEAR, NEAR):
        turned = np.abs(theta)[tilted] + moment * (sign * w)[tilted]
        at = arms(scene.block, sign[tilted], turned)
        forces = tilted_forces(
            at,
            scene.floor.friction,
            (sign * w)[tilted],
            (sign * u)[tilted],
            g[tilted],
            touching,
            direction,
        )
        over = np.minimum(
            over, (np.abs(forces.friction) - mu_s * np.abs(forces.normal)) / scale[tilted]
        )
        floor = -forces.normal if unilateral else -math.inf
        pulls = np.minimum(
            pulls, np.maximum(np.maximum(-forces.tip, -forces.far), floor) / scale[tilted]
        )
    if model.friction != "no-slip":
        excess = max(excess, float(np.max(over[direction == 0], initial=0.0)))
    return excess, max(tension, float(np.max(pulls, initial=0.0)))


def energy_error(model: EventBasedModel, scene: Scene, history: History) -> float | None:
    """Largest change of energy, over eight rows without event or kink, that the work of base and
    friction does not account for.

    Relative to the energy and the work at play in the run, at least g R. Where friction is not
    known (Bouc-Wen): what energy gains beyond the work of the base and what the friction spring can
    hold. None where no eight rows can be judged: the history has fewer, events or kinks lie in all
    of them, or the work is not resolved in any.
    """
    channels, radius, gravity = history.channels, scene.block.radius, scene.gravity
    if len(channels["t"]) <= GROUP:
        return None
    unit = math.sqrt(radius / gravity)
    t = channels["t"]
    motion = [channels[c] for c in ("y", "theta", "x_dot", "y_dot", "theta_dot")]
    energy = kinematics.energy(scene.block, gravity, *motion) / (gravity * radius)
    _, right, up = kinematics.mass_motion(scene.block, *motion)
    u = scene.excitation.acceleration(t) / gravity
    vg = scene.vertical.acceleration(t) / gravity
    speed = radius / unit
    power = -(u * right + vg * up) / speed
    if model.friction != "bouc-wen":
        power = power + _friction_power(scene, history, u, 1.0 + vg)
    whole, quiet = _whole_groups(scene, history)
    if not whole.any():
        return None
    step = scene.output_step / unit
    work, moved = integrals(step, power), integrals(step, np.abs(power))
    rough = integrals(step, power, BOOLE)
    change = energy[GROUP::GROUP][: len(work)] - energy[:-1:GROUP][: len(work)]
    size = 1.0 + np.maximum(energy[GROUP::GROUP][: len(work)], moved)
    off = (change - work) / size
    doubt = np.where(whole, np.abs(work - rough) / size, 0.0)
    # Checked in the groups before and after, too: the difference of the two rules says nothing
    # where it changes its sign.
    whole &= (
        np.maximum(doubt, np.maximum(np.append(doubt[1:], 0.0), np.append(0.0, doubt[:-1])))
        < RESOLVED
    )
    if model.friction == "bouc-wen":
        rise = np.abs(np.diff(up)) / speed / step  # per row; with gravity it is the floor's force
        force = 2.0 + np.max(np.abs(vg)) + rise[: len(work) * GROUP].reshape(-1, GROUP).max(axis=1)
        held = scene.floor.friction * model.yield_displacement / radius * force
        return float(np.max((off - held / size)[whole], initial=0.0)) if whole.any() else None
    judged = whole & quiet
    return float(np.max(np.abs(off)[judged])) if judged.any() else None


def _pivots(theta: Floats) -> Floats:
    """The sign of theta in each row; of the next row where it is zero, as a block that is about to
    tilt has its pivot already."""
    sign = np.sign(theta)
    standing = np.flatnonzero(sign[:-1] == 0.0)
    sign[standing] = sign[standing + 1]
    return np.where(sign < 0.0, -1.0, 1.0)


def _friction_power(scene: Scene, history: History, u: Floats, g: Floats) -> Floats:
    """Power of the floor's friction, natural units."""
    channels = history.channels
    unit = math.sqrt(scene.block.radius / scene.gravity)
    mode, theta = channels["mode"], channels["theta"]
    slip = channels["slip_rate"] * unit / scene.block.radius
    w = channels["theta_dot"] * unit
    mu = scene.floor.friction
    power = np.where(mode == "slide", -mu * np.abs(g) * np.abs(slip), 0.0)
    tilted = np.isin(mode, ("slide-rock", "ladder"))
    if tilted.any():
        sign = _pivots(theta)
        gaps = {
            wall.side: kinematics.wall_gap(scene, wall.side, channels["x"], theta)
            / scene.block.radius
            < CLOSED
            for wall in scene.walls
        }
        nowhere = np.zeros(len(theta), dtype=bool)
        left, right = gaps.get("left", nowhere), gaps.get("right", nowhere)
        ladder = mode == "ladder"
        tip, far = (
            np.where(sign > 0, left, right) & ladder,
            np.where(sign > 0, right, left) & ladder,
        )
        forces = tilted_forces(
            arms(scene.block, sign[tilted], np.abs(theta)[tilted]),
            mu,
            (sign * w)[tilted],
            (sign * u)[tilted],
            g[tilted],
            (np.ones(int(tilted.sum()), dtype=bool), tip[tilted], far[tilted]),
            np.where(sign * slip >= 0.0, 1, -1).astype(np.int8)[tilted],
        )
        power[tilted] = forces.friction * (sign * slip)[tilted]
    return power


def _whole_groups(scene: Scene, history: History) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which groups of eight steps have neither event nor kink inside, and in which the mode of
    motion is the same in all rows."""
    t, mode = history.channels["t"], history.channels["mode"]
    groups = (len(t) - 1) // GROUP
    edges = t[: groups * GROUP + 1 : GROUP]
    breaks = [event.t for event in history.event_list]
    for excitation in (scene.excitation, scene.vertical):
        if isinstance(excitation, Record):
            breaks += list(excitation.time_step * np.arange(len(excitation.unscaled)))
        elif not isinstance(excitation, Rest):
            breaks.append(excitation.quiet_after)
    near = 1e-9 * scene.output_step
    places = np.sort(np.array([*breaks, math.inf]))
    whole = np.searchsorted(places, edges[:-1] + near) == np.searchsorted(places, edges[1:] - near)
    # An event at an edge itself: the row there is from before or after it.
    events = np.sort(np.array([event.t for event in history.event_list] + [math.inf]))
    whole &= np.searchsorted(events, edges[:-1] - 1e3 * near) == np.searchsorted(
        events, edges[1:] + 1e3 * near
    )
    for excitation in (
        scene.excitation,
        scene.vertical,
    ):  # the base acceleration jumps where a record ends
        if isinstance(excitation, Record):
            end = excitation.quiet_after
            whole &= ~((edges[:-1] - 1e3 * near <= end) & (end <= edges[1:] + 1e3 * near))
    nodes = mode[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return whole, np.all(nodes == nodes[:, :1], axis=1)


def _mirror(model: EventBasedModel, scene: Scene, history: History) -> float:
    """How many values differ from those of the mirror image, to the bit; infinitely many where it
    is longer."""
    try:
        image = model.simulate(scene.mirrored())
    except ModelFailure:
        return math.inf
    if len(image.channels["t"]) != len(history.channels["t"]) or len(image.event_list) != len(
        history.event_list
    ):
        return math.inf
    differ = sum(int(np.sum(history.channels[name] != image.channels[name])) for name in EVEN)
    differ += sum(int(np.sum(history.channels[name] != -image.channels[name])) for name in ODD)
    differ += sum(
        replace(a, kind=SWAPPED.get(a.kind, a.kind)) != b
        for a, b in zip(history.event_list, image.event_list, strict=True)
    )
    return float(differ + (image.outcome != SWAPPED.get(history.outcome, history.outcome)))


def similar(scene: Scene, seed: int) -> Scene:
    """The scene at another scale: lengths times k, times sqrt(k), accelerations the same; k is
    random in 0.01 to 100."""
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
    """Compares histories of a scene up to the time at which a small disturbance of its data shows;
    that time is computed only if needed."""

    def __init__(self, model: EventBasedModel, scene: Scene, seed: int) -> None:
        self.model, self.scene, self.seed = model, scene, seed
        self._row: int | None = None
        self.found, self.failure = 0, ""

    def apart(self, history: History, scene: Scene, model: EventBasedModel | None = None) -> float:
        """Largest |difference of theta| in rad within the horizon; infinite where the other run
        fails within it."""
        played = model or self.model
        if played.friction == "bouc-wen" and scene.block.radius != self.scene.block.radius:
            size = played.yield_displacement * scene.block.radius / self.scene.block.radius
            played = played.model_copy(update={"yield_displacement": size})
        try:
            other = played.simulate(scene)
        except ModelFailure as error:
            self.failure = f"{self.failure}; {error}".strip("; ")
            return math.inf
        rows, difference = _differences(history, other)
        if rows == len(history.channels["t"]) == len(other.channels["t"]) and not np.any(
            difference > SEEN
        ):
            return float(np.max(difference, initial=0.0))
        return float(np.max(difference[: self.row(history)], initial=0.0))

    def row(self, history: History) -> int:
        """The first row in which the scene and a disturbed one, or two finer tolerances, part (see
        `SEEN`)."""
        if self._row is None:
            self.found = 1
            self._row = len(history.channels["t"])
            exact = self.model.model_copy(
                update={"tolerance": EXACT}
            )  # the horizon belongs to the scene, however coarse the model is
            for by in (
                10.0,
                100.0,
            ):  # rounding is a disturbance, too: finer tolerances must agree on the answer
                with suppress(ModelFailure):
                    a, b = (finer(exact, times).simulate(self.scene) for times in (by, 100.0 * by))
                    self._row = min(self._row, _agree(a, b, 0.1 * SEEN))
            for disturbed in _disturbed(self.scene, self.seed):
                try:
                    other = self.model.simulate(disturbed)
                except ModelFailure:
                    continue
                self._row = min(self._row, _agree(history, other, SEEN))
            grown = np.flatnonzero(_amplified(self.scene, history) > math.log(SEEN / EXACT))
            self._row = min(self._row, int(grown[0]) if grown.size else self._row)
        return self._row


def _amplified(scene: Scene, history: History) -> Floats:
    """The logarithm, by each row, of how much sliding friction has amplified a small difference of
    the rotation rate.

    With P = N/D a slipping pivot has theta'' = -(s + k c)/I N/D, in which N falls with w^2: near
    Painleve's limit, where D is small, a difference of w grows or decays faster than all else. A
    disturbance of the scene's data may have decayed before, and then does not show this growth; a
    rounding error of the moment grows all the same. So the sum starts anew wherever it is negative.
    """
    channels, step = history.channels, 1e-4
    unit = math.sqrt(scene.block.radius / scene.gravity)
    theta, w = channels["theta"], channels["theta_dot"] * unit
    sign, slip = _pivots(theta), channels["slip_rate"] * unit / scene.block.radius
    slides = (channels["mode"] == "slide-rock") & (theta != 0.0) & (np.abs(slip) > SLIPS)
    rate = np.zeros(len(theta))
    if slides.any():
        at = arms(scene.block, sign[slides], np.abs(theta)[slides])
        u = (sign * scene.excitation.acceleration(channels["t"]) / scene.gravity)[slides]
        g = 1.0 + scene.vertical.acceleration(channels["t"])[slides] / scene.gravity
        on, off = np.ones(len(g), dtype=bool), np.zeros(len(g), dtype=bool)
        direction = np.sign(sign * slip).astype(np.int8)[slides]
        turns = []
        for change in (step, -step):
            forces = tilted_forces(
                at,
                scene.floor.friction,
                (sign * w)[slides] + change,
                u,
                g,
                (on, off, off),
                direction,
            )
            turns.append(at.spin * (at.pivot[1] * forces.friction - at.pivot[0] * forces.normal))
        rate[slides] = (turns[0] - turns[1]) / (2.0 * step)
    grown = np.zeros(len(theta))
    for k in range(1, len(theta)):
        time = (channels["t"][k] - channels["t"][k - 1]) / unit
        grown[k] = (
            max(0.0, grown[k - 1] + 0.5 * (rate[k - 1] + rate[k]) * time) if slides[k] else 0.0
        )
    return grown


def _differences(a: History, b: History) -> tuple[int, Floats]:
    rows = min(len(a.channels["t"]), len(b.channels["t"]))
    return rows, np.abs(a.channels["theta"][:rows] - b.channels["theta"][:rows])


def _agree(a: History, b: History, seen: float) -> int:
    """In how many rows, from the first on, two histories differ by no more than `seen`, rad."""
    rows, difference = _differences(a, b)
    apart = np.flatnonzero(difference > seen)
    return int(apart[0]) if apart.size else rows


def _disturbed(scene: Scene, seed: int) -> Iterable[Scene]:
    """The scene with all its data changed by up to a relative `DISTURBANCE`, in random
    directions."""
    r = np.random.default_rng([seed, 2])

    def by(value: float) -> float:
        return value * (
            1.0 + DISTURBANCE * float(r.choice([-1.0, 1.0])) * float(r.uniform(0.5, 1.0))
        )

    def stronger(excitation: Rest | Ricker | Sine | Record) -> Rest | Ricker | Sine | Record:
        return excitation if excitation.kind == "rest" else excitation.scaled(by(1.0))

    block, floor = scene.block, scene.floor
    for _ in range(DISTURBED):
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
                "excitation": stronger(scene.excitation),
                "vertical": stronger(scene.vertical),
            }
            change |= {
                name: by(getattr(scene, name))
                for name in ("initial_angular_velocity", "initial_velocity", "initial_height")
            }
            tilt = by(scene.initial_rotation)
            try:
                yield scene.replace(**change, initial_rotation=tilt)
            except InputError:  # it would start inside a wall
                yield scene.replace(
                    **change, initial_rotation=scene.initial_rotation * (1.0 - DISTURBANCE)
                )
