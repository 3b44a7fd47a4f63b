"""The measures, each defined once, in a table: name, label, unit, formula and source, function.

A *difference* is a function of a `Pair` (reference and candidate on one time axis), a *figure* one
of a `WindowedHistory`. Both return a number, or a number and a remark; they raise `Unavailable`
where the histories do not hold what is needed. In the formulas r is the reference, c the candidate,
d = c - r, and <.> the mean over the window, by the trapezoidal rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from operator import attrgetter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Block, Event, History, Scene, kinematics
from rockcheck.validation.discrepancy.figures import NOT_DEFINED

Array = NDArray[np.float64]
Value = float | tuple[float, str]
STANDARD_GRAVITY = 9.81
#: Impacts of two histories are the same impact if they lie within this time, s.
SAME_IMPACT = 0.020
#: Impacts weaker than this share of the history's strongest of their kind need no counterpart.
WEAK_IMPACT = 0.01
ISO_MOST_SAMPLES = 4000
IMPACTS = ("floor impact", "wall impact")
TURNS = ("overturned left", "overturned right")


class Unavailable(Exception):
    """The measure cannot be computed from these histories; the message says what is missing."""


class Undefined(Unavailable):
    """The measure asks nothing of these histories, as a ratio to nothing: no pass and no fail."""

    def __init__(self, why: str) -> None:
        super().__init__(f"{NOT_DEFINED}: {why}")


@dataclass(frozen=True)
class Measure:
    """A measure: its name in tolerances and tables, its label for people, its unit, definition and
    source, and what a perfect candidate scores.

    `unit` "angle" stands for alpha, or rad where the block is unknown. `sense` "at most": the
    distance from `ideal` is limited (`ideal` None: from the expected value); "at least": the value
    itself must reach the limit.
    """

    name: str
    label: str
    unit: str
    formula: str
    evaluate: Callable[[Any], Value]
    ideal: float | None = 0.0
    sense: Literal["at most", "at least"] = "at most"
    #: Computed only where a tolerance or a suite asks for it by name.
    on_request: bool = False
    #: The distance from a closed form.
    exact: bool = False
    #: 1 for yes, 0 for no: neither near a limit nor far from it.
    yes_no: bool = False
    #: Changes below this mean nothing (in the measure's unit); 0 for what is counted. The least
    #: floor.
    resolution: float = 1e-6

    @property
    def role(self) -> Literal["error", "quantity", "count"]:
        """What its values are: an error has a perfect value, and the nearer to it the better."""
        if self.ideal is not None or self.sense == "at least":
            return "error"
        return "quantity" if self.resolution else "count"


def by_name(*measures: Measure) -> dict[str, Measure]:
    """A book of measures."""
    return {measure.name: measure for measure in measures}


def between_rows(unit: str, frequency_parameter: float, gravity: float, step: float) -> float:
    """What rows `step` (s) apart cannot tell from nothing: how far a free block is from a chord.

    Of an angle (p h)^2/8, in alpha; of a length g h^2/8, in m; of a time h, in s. Other units have
    no such floor.
    """
    share = step**2 / 8.0
    return {"angle": frequency_parameter**2 * share, "m": gravity * share, "s": step}.get(unit, 0.0)


@dataclass(frozen=True)
class WindowedHistory:
    """One history as the figures see it: cut to a window, with the scene's gravity and walls where
    they are known."""

    history: History
    scene: Scene | None = None
    until: float = math.inf

    @property
    def block(self) -> Block:
        """The block, from the scene or from the history."""
        if self.scene is not None:
            return self.scene.block
        if self.history.block is None:
            raise Unavailable("the block's size is not known")
        return self.history.block

    @property
    def gravity(self) -> float:
        """The scene's gravity, or 9.81 m/s^2."""
        return STANDARD_GRAVITY if self.scene is None else self.scene.gravity

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """The rows within the window."""
        return self.history.channels["t"] <= self.until + 1e-9

    def channel(self, name: str) -> Array:
        """One column within the window."""
        if name not in self.history.channels:
            raise Unavailable(f"{self.history.model} has no column {name}")
        return np.asarray(self.history.channels[name][self.inside], dtype=float)

    def events(self, *kinds: str, start: float = -math.inf) -> list[Event]:
        """Events of these kinds within the window, from `start` (s) on. A landing that strikes is a
        floor impact, whichever name the model has for it."""
        return [
            event
            for event in map(_impact, self.history.event_list)
            if event.kind in kinds and start - 1e-9 <= event.t <= self.until + 1e-9
        ]

    def strong(self, kind: str) -> float:
        """The number of impacts that are not weak (`WEAK_IMPACT`)."""
        impulses = [abs(event.impulse) for event in self.events(kind)]
        return float(sum(impulse >= WEAK_IMPACT * max(impulses) for impulse in impulses))

    def heights(self) -> Array:
        """Height of the lowest corner above the floor, m."""
        return kinematics.pivot_height(self.block, self.channel("y"), self.channel("theta"))


@dataclass(frozen=True)
class Pair:
    """Reference and candidate over their common time up to `until` (s), the candidate interpolated
    linearly.

    The time axis is the reference's; `start` and `end` bound the common time within the window.
    """

    reference: History
    candidate: History
    scene: Scene | None = None
    until: float = math.inf
    cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def start(self) -> float:
        """First common time, s."""
        return max(float(self.reference.channels["t"][0]), float(self.candidate.channels["t"][0]))

    @cached_property
    def end(self) -> float:
        """Last common time within the window, s."""
        return min(
            float(self.reference.channels["t"][-1]),
            float(self.candidate.channels["t"][-1]),
            self.until,
        )

    @cached_property
    def time(self) -> Array:
        """The reference's times within the common time."""
        t = np.asarray(self.reference.channels["t"], dtype=float)
        return t[(t >= self.start - 1e-9) & (t <= self.end + 1e-9)]

    def channels(self, name: str) -> tuple[Array, Array]:
        """One column of both on `time`: reference, candidate."""
        if name not in self.cache:
            for history in (self.reference, self.candidate):
                if name not in history.channels:
                    raise Unavailable(f"{history.model} has no column {name}")
            if len(self.time) == 0:
                raise Unavailable("the histories have no time in common")
            self.cache[name] = tuple(
                np.interp(
                    self.time,
                    np.asarray(h.channels["t"], dtype=float),
                    np.asarray(h.channels[name], dtype=float),
                )
                for h in (self.reference, self.candidate)
            )
        return self.cache[name]

    @cached_property
    def alpha(self) -> float | None:
        """Slenderness of the block, rad, wherever it is known from."""
        if self.scene is not None:
            return self.scene.block.alpha
        return self.reference.alpha if self.reference.alpha is not None else self.candidate.alpha

    @property
    def theta(self) -> tuple[Array, Array]:
        """theta of both, in alpha (in rad where the block is unknown)."""
        scale = self.alpha or 1.0
        reference, candidate = self.channels("theta")
        return reference / scale, candidate / scale

    @cached_property
    def known(self) -> WindowedHistory:
        """The one of the two whose block is known."""
        return WindowedHistory(
            self.reference if self.reference.alpha is not None else self.candidate, self.scene
        )

    @property
    def rocking(self) -> tuple[Array, Array]:
        """`theta` where there is something to have a ratio to: the reference's peak is no
        nothing."""
        floor = DIFFERENCES["theta_peak"].resolution
        if self.alpha is not None and len(self.time) > 1:
            g, step = self.known.gravity, float(self.time[-1] - self.time[0]) / (len(self.time) - 1)
            floor = max(
                floor,
                between_rows(
                    "angle", self.known.block.weaker_pivot.frequency_parameter(g), g, step
                ),
            )
        if np.max(np.abs(self.theta[0])) <= floor:
            raise Undefined("the reference does not rotate")
        return self.theta

    @cached_property
    def energies(self) -> tuple[Array, Array]:
        """Energy per unit mass of both, J/kg."""
        columns = [self.channels(name) for name in ("y", "theta", "x_dot", "y_dot", "theta_dot")]
        block, gravity = self.known.block, self.known.gravity
        first, second = (
            np.asarray(kinematics.energy(block, gravity, *(c[k] for c in columns))) for k in (0, 1)
        )
        return first, second

    def mean(self, values: Array) -> float:
        """Mean over time, by the trapezoidal rule."""
        if len(values) == 1:
            return float(values[0])
        steps = np.diff(self.time)
        return float(np.sum(steps * 0.5 * (values[1:] + values[:-1])) / np.sum(steps))

    def rms(self, columns: tuple[Array, Array]) -> float:
        """sqrt <d^2>."""
        return math.sqrt(self.mean((columns[1] - columns[0]) ** 2))

    @cached_property
    def sprague_geers(self) -> tuple[float, float]:
        """M and P of theta."""
        reference, candidate = self.rocking
        rr, cc, rc = (
            self.mean(product) for product in (reference**2, candidate**2, reference * candidate)
        )
        if cc == 0.0:
            raise Unavailable("only one of the two rotates")
        cosine = rc / math.sqrt(rr * cc)
        phase = math.acos(max(-1.0, min(1.0, cosine))) / math.pi
        return math.sqrt(cc / rr) - 1.0, phase if math.isfinite(cosine) else math.nan

    @cached_property
    def impacts(self) -> MatchedImpacts:
        """The impacts of both within the common time, matched; a history without any event, unlike
        the other's, does not know them."""
        both = [
            WindowedHistory(one, until=self.end).events(*IMPACTS, *TURNS, start=self.start)
            for one in (self.reference, self.candidate)
        ]
        for history, others in ((self.reference, both[1]), (self.candidate, both[0])):
            if others and not history.event_list:
                raise Unavailable(f"{history.model} has no events")
        return match_impacts(*both)


@dataclass(frozen=True)
class MatchedImpacts:
    """Impacts of two histories: pairs (reference, candidate), and those of either that have no
    counterpart."""

    pairs: Sequence[tuple[Event, Event]]
    only_reference: Sequence[Event]
    only_candidate: Sequence[Event]


def match_impacts(reference: Sequence[Event], candidate: Sequence[Event]) -> MatchedImpacts:
    """Match impacts of one kind within `SAME_IMPACT`, nearest first; weak ones (`WEAK_IMPACT`) need
    no counterpart.

    A falling block's end counts as an event of its own kind.
    """
    pairs: list[tuple[Event, Event]] = []
    alone: tuple[list[Event], list[Event]] = ([], [])
    for kind in IMPACTS + TURNS:
        both = [[e for e in events if e.kind == kind] for events in (reference, candidate)]
        times = np.array([e.t for e in both[1]])
        near = [
            (abs(times[j] - first.t), i, j)
            for i, first in enumerate(both[0])
            for j in range(*np.searchsorted(times, [first.t - SAME_IMPACT, first.t + SAME_IMPACT]))
        ]
        taken: tuple[set[int], set[int]] = (set(), set())
        for _, i, j in sorted(near):
            if i not in taken[0] and j not in taken[1]:
                taken[0].add(i)
                taken[1].add(j)
                pairs.append((both[0][i], both[1][j]))
        for left, events, matched in zip(alone, both, taken, strict=True):
            weak = WEAK_IMPACT * max((abs(e.impulse) for e in events), default=0.0)
            left += [e for n, e in enumerate(events) if n not in matched and abs(e.impulse) >= weak]
    in_time = attrgetter("t")
    return MatchedImpacts(
        sorted(pairs, key=lambda two: two[0].t), *(sorted(some, key=in_time) for some in alone)
    )


def _impact(event: Event) -> Event:
    strikes = event.kind == "landing" and event.impulse != 0.0
    return replace(event, kind="floor impact") if strikes else event


# Differences


def _peak(columns: tuple[Array, Array]) -> float:
    return float(np.max(np.abs(columns[1] - columns[0])))


def _peak_ratio(pair: Pair) -> float:
    reference, candidate = (float(np.max(np.abs(column))) for column in pair.rocking)
    return candidate / reference


def _hausdorff(pair: Pair) -> float:
    if pair.alpha is None:
        raise Unavailable("the block's size is not known")
    p = pair.known.block.weaker_pivot.frequency_parameter(pair.known.gravity)
    first, second = (np.column_stack([p * pair.time, column]) for column in pair.theta)
    if not (np.all(np.isfinite(first)) and np.all(np.isfinite(second))):
        return math.nan
    return max(_farthest(first, second), _farthest(second, first))


def _farthest(points: Array, line: Array) -> float:
    """Largest distance from `points` to the broken line through `line`, both of shape (n, 2).

    The nearest vertex is looked up in a tree, then the two segments that meet there are measured.
    """
    from scipy.spatial import cKDTree

    if len(line) == 1:
        return float(np.max(np.linalg.norm(points - line[0], axis=1)))
    nearest = cKDTree(line).query(points)[1]
    best = np.full(len(points), math.inf)
    for shift in (-1, 0):
        start = np.clip(nearest + shift, 0, len(line) - 2)
        a, along = line[start], line[start + 1] - line[start]
        share = np.clip(np.sum((points - a) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - share[:, None] * along, axis=1))
    return float(np.max(best))


def _agree_until(pair: Pair) -> tuple[float, str]:
    matched = pair.impacts
    alone = (pair.reference, matched.only_reference), (pair.candidate, matched.only_candidate)
    found = [(e.t, f"{e.kind} only in {h.model}") for h, events in alone for e in events]
    return min(found, default=(pair.end, "all events agree"))


def _unmatched(pair: Pair) -> tuple[float, str]:
    matched = pair.impacts
    alone = len(matched.only_reference) + len(matched.only_candidate)
    return float(alone), f"{len(matched.pairs)} impacts matched"


def _impact_time(pair: Pair) -> tuple[float, str]:
    pairs = pair.impacts.pairs
    if not pairs:
        return 0.0, "no impact has a counterpart"
    first, second = max(pairs, key=lambda two: abs(two[1].t - two[0].t))
    return abs(second.t - first.t), f"{first.kind} at {first.t:.3f} s"


def _overturning_time(pair: Pair) -> float:
    first, second = (
        next((e.t for e in h.event_list if e.kind in TURNS), math.inf)
        for h in (pair.reference, pair.candidate)
    )
    return 0.0 if first == second else abs(second - first)


def _outcome(pair: Pair) -> tuple[float, str]:
    first, second = pair.reference.outcome, pair.candidate.outcome
    fates = {outcome if outcome in TURNS else "stays" for outcome in (first, second)}
    return float(len(fates) == 1), first if first == second else f"{first} / {second}"


def _iso_18571(pair: Pair) -> float:
    try:
        from objective_rating_metrics.rating import ISO18571
    except ImportError:
        raise Unavailable(
            "needs the package objective-rating-metrics: pip install objective-rating-metrics"
        ) from None
    curves = pair.rocking
    if len(pair.time) < 20 or not all(
        np.all(np.isfinite(curve)) and np.ptp(curve) > 0.0 for curve in curves
    ):
        raise Unavailable("too short, constant or not finite")
    grid = np.linspace(pair.time[0], pair.time[-1], min(len(pair.time), ISO_MOST_SAMPLES))
    reference, candidate = (
        np.column_stack([grid, np.interp(grid, pair.time, curve)]) for curve in curves
    )
    rating = ISO18571(reference, candidate, dt=float(grid[1] - grid[0]))
    return float(rating.overall_rating(ndigits=-1))


DIFFERENCES = by_name(
    Measure(
        "theta_rms",
        "RMS difference of rotation",
        "angle",
        "sqrt <d^2> of theta, in alpha.",
        lambda pair: pair.rms(pair.theta),
    ),
    Measure(
        "theta_peak",
        "peak difference of rotation",
        "angle",
        "max |d| of theta, in alpha.",
        lambda pair: _peak(pair.theta),
    ),
    Measure(
        "x_rms",
        "RMS difference of x",
        "m",
        "sqrt <d^2> of the centroid's x, m.",
        lambda pair: pair.rms(pair.channels("x")),
    ),
    Measure(
        "x_peak",
        "peak difference of x",
        "m",
        "max |d| of the centroid's x, m.",
        lambda pair: _peak(pair.channels("x")),
    ),
    Measure(
        "slip_rate_rms",
        "RMS difference of slip rate",
        "m/s",
        "sqrt <d^2> of the pivot corner's horizontal velocity V, m/s.",
        lambda pair: pair.rms(pair.channels("slip_rate")),
    ),
    Measure(
        "slip_rate_peak",
        "peak difference of slip rate",
        "m/s",
        "max |d| of the pivot corner's horizontal velocity V, m/s; where the pivot changes it"
        " jumps, see `theta_hausdorff`.",
        lambda pair: _peak(pair.channels("slip_rate")),
    ),
    Measure(
        "energy_rms",
        "RMS difference of energy",
        "J/kg",
        "sqrt <d^2> of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: pair.rms(pair.energies),
    ),
    Measure(
        "energy_peak",
        "peak difference of energy",
        "J/kg",
        "max |d| of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: _peak(pair.energies),
    ),
    Measure(
        "sprague_geers_m",
        "Sprague-Geers M (magnitude)",
        "1",
        "M = sqrt(<c^2>/<r^2>) - 1 of theta: error of magnitude, blind to phase.\n\nSprague &"
        " Geers, Commun. Numer. Meth. Engng 20 (2004) 467; Schwer, Engng Comput. 23 (2007) 295.",
        lambda pair: pair.sprague_geers[0],
    ),
    Measure(
        "sprague_geers_p",
        "Sprague-Geers P (phase)",
        "1",
        "P = acos(<r c>/sqrt(<r^2><c^2>))/pi of theta: error of phase, blind to magnitude; 0 in"
        " phase, 1 in opposition.\n\nSource as for M.",
        lambda pair: pair.sprague_geers[1],
    ),
    Measure(
        "sprague_geers_c",
        "Sprague-Geers C (both)",
        "1",
        "C = sqrt(M^2 + P^2) of theta. Source as for M.",
        lambda pair: math.hypot(*pair.sprague_geers),
    ),
    Measure(
        "peak_ratio",
        "ratio of peak rotations",
        "1",
        "max |c| / max |r| of theta.",
        _peak_ratio,
        ideal=1.0,
    ),
    Measure(
        "theta_hausdorff",
        "Hausdorff distance of rotation's graphs",
        "1",
        "Hausdorff distance of the graphs of theta in the plane (p t, theta/alpha); p is of"
        " the scene's gravity, else of 9.81 m/s^2.\n\nThe largest distance from a sample of one"
        " graph to the other graph, a broken line, either way. An impact that comes a millisecond"
        " late counts as a millisecond, not as the jump that it delays; used so for nonsmooth"
        " mechanics by the authors of cardillo.",
        _hausdorff,
    ),
    Measure(
        "events_agree_until",
        "events agree until",
        "s",
        "Time up to which each impact (and fall) of either has its counterpart in the other;"
        " the remark says what comes then.\n\nCounterparts are of one kind and within 20 ms;"
        " impacts below 1 % of the strongest need none. The window's end if all agree.",
        _agree_until,
        ideal=None,
        sense="at least",
    ),
    Measure(
        "unmatched_impacts",
        "impacts without counterpart",
        "1",
        "Number of impacts of either that have no counterpart in the other, matched as in"
        " `events_agree_until`.",
        _unmatched,
        resolution=0.0,
    ),
    Measure(
        "impact_time",
        "largest impact-time error",
        "s",
        "max |t_c - t_r| over the impacts that have a counterpart, matched as in"
        " `events_agree_until`, s.",
        _impact_time,
    ),
    Measure(
        "overturning_time",
        "difference of overturning time",
        "s",
        "|t_c - t_r| of |theta| = pi/2, s; 0 if neither overturns, infinite if only one does.",
        _overturning_time,
    ),
    Measure(
        "outcome_agrees",
        "outcome agrees",
        "1",
        "1 if both overturn to the same side or neither overturns, else 0; of the whole"
        " histories, whatever the window.",
        _outcome,
        ideal=1.0,
        resolution=0.0,
        yes_no=True,
    ),
    Measure(
        "iso_18571",
        "ISO/TS 18571 rating",
        "1",
        "ISO/TS 18571 overall rating of theta, 0 to 1 (corridor 0.4, phase 0.2, magnitude 0.2,"
        " slope 0.2), not rounded.\n\nBy the package objective-rating-metrics, which takes the"
        " square of the samples in time and memory, does not look at their times and answers NaN"
        " where it has no answer; so both curves are put on one uniform grid of at most 4,000"
        " samples, and curves that are constant or shorter than 20 samples have no rating.",
        _iso_18571,
        ideal=1.0,
        on_request=True,
    ),
)


# Figures of one history


def _peak_rotation(motion: WindowedHistory) -> Value:
    at = motion.history.overturned_at
    fell = "" if at is None or at > motion.until else f"the block overturned at {at:.3g} s"
    return float(np.max(np.abs(motion.channel("theta")))) / motion.block.alpha, fell


def _deepest(motion: WindowedHistory) -> float:
    gaps, scene = [motion.heights()], motion.scene
    if scene is not None:
        place = motion.channel("x"), motion.channel("theta")
        gaps += [kinematics.wall_gap(scene, wall.side, *place) for wall in scene.walls]
    return float(np.maximum(np.max([-np.min(gap) for gap in gaps]), 0.0))


#: A figure without an ideal value is held against an expected one.
_quantity = partial(Measure, ideal=None)
FIGURES = by_name(
    _quantity(
        "peak_rotation",
        "peak rotation",
        "angle",
        "max |theta|, in alpha; of a block that has overturned it is no peak, and a note says so.",
        _peak_rotation,
    ),
    _quantity(
        "last_rotation",
        "last rotation",
        "angle",
        "theta in the window's last row, in alpha: sees a shift in time that a peak does not.",
        lambda motion: float(motion.channel("theta")[-1]) / motion.block.alpha,
    ),
    _quantity(
        "last_x",
        "last x",
        "m",
        "The centroid's x in the window's last row, m.",
        lambda motion: float(motion.channel("x")[-1]),
    ),
    _quantity(
        "last_slip",
        "last slip",
        "m",
        "Where the pivot corner stands along the floor in the window's last row, m from its"
        " first place.",
        lambda motion: float(motion.channel("slip")[-1]),
    ),
    _quantity(
        "end_time",
        "end of motion",
        "s",
        "Time of the window's last row, s; before the scene's duration where the block overturned.",
        lambda motion: float(motion.channel("t")[-1]),
    ),
    _quantity(
        "floor_impacts",
        "floor impacts",
        "1",
        "Number of floor impacts stronger than 1 % of the strongest.",
        lambda motion: motion.strong("floor impact"),
        resolution=0.0,
    ),
    _quantity(
        "wall_impacts",
        "wall impacts",
        "1",
        "Number of wall impacts stronger than 1 % of the strongest.",
        lambda motion: motion.strong("wall impact"),
        resolution=0.0,
    ),
    _quantity(
        "highest_hop",
        "highest hop",
        "m",
        "Largest height of the lowest corner above the floor, m; 0 for a model without free"
        " flight.",
        lambda motion: float(np.maximum(np.max(motion.heights()), 0.0)),
    ),
    Measure(
        "deepest_penetration",
        "deepest penetration",
        "m",
        "Largest depth of a corner below the floor or behind a wall (walls where the scene is"
        " known), m.",
        _deepest,
    ),
    Measure(
        "energy_gain",
        "largest energy gain at an impact",
        "1",
        "Most kinetic energy that the impact law added at one impact, relative to that before"
        " it (`Cost.largest_energy_gain`).",
        lambda motion: motion.history.cost.largest_energy_gain,
    ),
)
