"""The measures: each defined once, by a function whose docstring is its formula and source.

A *difference* is a function of a `Pair` (reference and candidate on one time axis), a *figure* one
of a single history. Both return a number, or a number and a remark; they raise `Unavailable` where
the histories do not hold what is needed. In the formulas r is the reference, c the candidate, d = c
- r, and <.> the mean over the window, by the trapezoidal rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import cleandoc
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
    """A measure: its name in tolerances and tables, its label for people, its unit and what a
    perfect candidate scores.

    `unit` "angle" stands for alpha, or rad where the block is unknown. `sense` "at most": the
    distance from `ideal` is limited (`ideal` None: from the expected value); "at least": the value
    itself must reach the limit.
    """

    name: str
    label: str
    unit: str
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

    @property
    def formula(self) -> str:
        """Definition and source, from the function's docstring."""
        return cleandoc(self.evaluate.__doc__ or "")


DIFFERENCES: dict[str, Measure] = {}
FIGURES: dict[str, Measure] = {}

Definition = Callable[[Callable[[Any], Value]], Callable[[Any], Value]]


def register(book: dict[str, Measure], label: str, unit: str, **settings: Any) -> Definition:
    """A decorator that puts a function into a book of measures, under the function's name."""

    def register(function: Callable[[Any], Value]) -> Callable[[Any], Value]:
        name = function.__name__
        book[name] = Measure(name=name, label=label, unit=unit, evaluate=function, **settings)
        return function

    return register


def difference(label: str, unit: str, **settings: Any) -> Definition:
    """Register a function of a `Pair` as a measure of difference."""
    return register(DIFFERENCES, label, unit, **settings)


def figure(label: str, unit: str, **settings: Any) -> Definition:
    """Register a function of one `WindowedHistory` as a figure; without an ideal value, so held
    against an expected one."""
    return register(FIGURES, label, unit, **{"ideal": None, **settings})


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

    @property
    def energy(self) -> Array:
        """Kinetic plus potential energy per unit mass, J/kg (`scenes.kinematics.energy`)."""
        motion = (self.channel(name) for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
        return np.asarray(kinematics.energy(self.block, self.gravity, *motion))

    def events(self, *kinds: str) -> list[Event]:
        """Events of these kinds within the window."""
        return [
            event
            for event in _as_impacts(self.history.event_list)
            if event.kind in kinds and event.t <= self.until + 1e-9
        ]


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
    def impacts(self) -> MatchedImpacts:
        """The impacts of both within the common time, matched; a history without any event, unlike
        the other's, does not know them."""
        both = [self._within(history) for history in (self.reference, self.candidate)]
        for history, others in ((self.reference, both[1]), (self.candidate, both[0])):
            if others and not history.event_list:
                raise Unavailable(f"{history.model} has no events")
        return match_impacts(*both)

    def _within(self, history: History) -> list[Event]:
        return [
            e
            for e in _as_impacts(history.event_list)
            if e.kind in IMPACTS + TURNS and self.start - 1e-9 <= e.t <= self.end + 1e-9
        ]


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
    left: list[Event] = []
    right: list[Event] = []
    for kind in IMPACTS + TURNS:
        first, second = ([e for e in events if e.kind == kind] for events in (reference, candidate))
        times = np.array([e.t for e in first]), np.array([e.t for e in second])
        near = [
            (abs(times[1][j] - times[0][i]), i, j)
            for i in range(len(first))
            for j in range(
                *np.searchsorted(times[1], [times[0][i] - SAME_IMPACT, times[0][i] + SAME_IMPACT])
            )
        ]
        taken_first: set[int] = set()
        taken_second: set[int] = set()
        for _, i, j in sorted(near):
            if i not in taken_first and j not in taken_second:
                taken_first.add(i)
                taken_second.add(j)
                pairs.append((first[i], second[j]))
        weak = _weak(first), _weak(second)
        left += [
            e for i, e in enumerate(first) if i not in taken_first and abs(e.impulse) >= weak[0]
        ]
        right += [
            e for j, e in enumerate(second) if j not in taken_second and abs(e.impulse) >= weak[1]
        ]
    in_time = attrgetter("t")
    return MatchedImpacts(
        sorted(pairs, key=lambda two: two[0].t),
        sorted(left, key=in_time),
        sorted(right, key=in_time),
    )


def _as_impacts(events: Sequence[Event]) -> list[Event]:
    """A landing that strikes is a floor impact, whichever name the model has for it."""
    return [
        replace(event, kind="floor impact")
        if event.kind == "landing" and event.impulse != 0.0
        else event
        for event in events
    ]


def _weak(events: Sequence[Event]) -> float:
    """The impulse below which one of these is weak beside the strongest."""
    return WEAK_IMPACT * max((abs(event.impulse) for event in events), default=0.0)


# --- differences


@difference("RMS difference of rotation", "angle")
def theta_rms(pair: Pair) -> float:
    """sqrt <d^2> of theta, in alpha."""
    return pair.rms(pair.theta)


@difference("peak difference of rotation", "angle")
def theta_peak(pair: Pair) -> float:
    """max |d| of theta, in alpha."""
    return _largest(pair.theta)


@difference("RMS difference of x", "m")
def x_rms(pair: Pair) -> float:
    """sqrt <d^2> of the centroid's x, m."""
    return pair.rms(pair.channels("x"))


@difference("peak difference of x", "m")
def x_peak(pair: Pair) -> float:
    """max |d| of the centroid's x, m."""
    return _largest(pair.channels("x"))


@difference("RMS difference of slip rate", "m/s")
def slip_rate_rms(pair: Pair) -> float:
    """sqrt <d^2> of the pivot corner's horizontal velocity V, m/s."""
    return pair.rms(pair.channels("slip_rate"))


@difference("peak difference of slip rate", "m/s")
def slip_rate_peak(pair: Pair) -> float:
    """max |d| of the pivot corner's horizontal velocity V, m/s; where the pivot changes it jumps,
    see `theta_hausdorff`."""
    return _largest(pair.channels("slip_rate"))


@difference("RMS difference of energy", "J/kg")
def energy_rms(pair: Pair) -> float:
    """sqrt <d^2> of kinetic plus potential energy per unit mass, J/kg."""
    return pair.rms(pair.energies)


@difference("peak difference of energy", "J/kg")
def energy_peak(pair: Pair) -> float:
    """max |d| of kinetic plus potential energy per unit mass, J/kg."""
    return _largest(pair.energies)


@difference("Sprague-Geers M (magnitude)", "1")
def sprague_geers_m(pair: Pair) -> float:
    """M = sqrt(<c^2>/<r^2>) - 1 of theta: error of magnitude, blind to phase.

    Sprague & Geers, Commun. Numer. Meth. Engng 20 (2004) 467; Schwer, Engng Comput. 23 (2007) 295.
    """
    return _sprague_geers(pair)[0]


@difference("Sprague-Geers P (phase)", "1")
def sprague_geers_p(pair: Pair) -> float:
    """P = acos(<r c>/sqrt(<r^2><c^2>))/pi of theta: error of phase, blind to magnitude; 0 in phase,
    1 in opposition.

    Source as for M.
    """
    return _sprague_geers(pair)[1]


@difference("Sprague-Geers C (both)", "1")
def sprague_geers_c(pair: Pair) -> float:
    """C = sqrt(M^2 + P^2) of theta. Source as for M."""
    return math.hypot(*_sprague_geers(pair))


@difference("ratio of peak rotations", "1", ideal=1.0)
def peak_ratio(pair: Pair) -> float:
    """max |c| / max |r| of theta."""
    reference, candidate = (float(np.max(np.abs(column))) for column in pair.rocking)
    return candidate / reference


@difference("Hausdorff distance of rotation's graphs", "1")
def theta_hausdorff(pair: Pair) -> float:
    """Hausdorff distance of the graphs of theta in the plane (p t, theta/alpha); p is of the
    scene's gravity, else of 9.81 m/s^2.

    The largest distance from a sample of one graph to the other graph, a broken line, either way.
    An impact that comes a millisecond late counts as a millisecond, not as the jump that it delays;
    used so for nonsmooth mechanics by the authors of cardillo.
    """
    if pair.alpha is None:
        raise Unavailable("the block's size is not known")
    p = pair.known.block.weaker_pivot.frequency_parameter(pair.known.gravity)
    first, second = (np.column_stack([p * pair.time, column]) for column in pair.theta)
    if not (np.all(np.isfinite(first)) and np.all(np.isfinite(second))):
        return math.nan
    return max(_farthest(first, second), _farthest(second, first))


@difference("events agree until", "s", ideal=None, sense="at least")
def events_agree_until(pair: Pair) -> tuple[float, str]:
    """Time up to which each impact (and fall) of either has its counterpart in the other; the
    remark says what comes then.

    Counterparts are of one kind and within 20 ms; impacts below 1 % of the strongest need none. The
    window's end if all agree.
    """
    matched = pair.impacts
    alone = [
        (e.t, f"{e.kind} only in {h.model}")
        for h, found in _unmatched(pair, matched)
        for e in found
    ]
    return min(alone, default=(pair.end, "all events agree"))


@difference("impacts without counterpart", "1", resolution=0.0)
def unmatched_impacts(pair: Pair) -> tuple[float, str]:
    """Number of impacts of either that have no counterpart in the other, matched as in
    `events_agree_until`."""
    matched = pair.impacts
    alone = len(matched.only_reference) + len(matched.only_candidate)
    return float(alone), f"{len(matched.pairs)} impacts matched"


@difference("largest impact-time error", "s")
def impact_time(pair: Pair) -> tuple[float, str]:
    """max |t_c - t_r| over the impacts that have a counterpart, matched as in `events_agree_until`,
    s."""
    pairs = pair.impacts.pairs
    if not pairs:
        return 0.0, "no impact has a counterpart"
    worst = max(pairs, key=lambda two: abs(two[1].t - two[0].t))
    return abs(worst[1].t - worst[0].t), f"{worst[0].kind} at {worst[0].t:.3f} s"


@difference("difference of overturning time", "s")
def overturning_time(pair: Pair) -> float:
    """|t_c - t_r| of |theta| = pi/2, s; 0 if neither overturns, infinite if only one does."""
    first, second = (
        next((e.t for e in h.event_list if e.kind in TURNS), math.inf)
        for h in (pair.reference, pair.candidate)
    )
    return 0.0 if first == second else abs(second - first)


@difference("outcome agrees", "1", resolution=0.0, ideal=1.0, yes_no=True)
def outcome_agrees(pair: Pair) -> tuple[float, str]:
    """1 if both overturn to the same side or neither overturns, else 0; of the whole histories,
    whatever the window."""
    first, second = pair.reference.outcome, pair.candidate.outcome
    fates = {outcome if outcome in TURNS else "stays" for outcome in (first, second)}
    return float(len(fates) == 1), first if first == second else f"{first} / {second}"


@difference("ISO/TS 18571 rating", "1", ideal=1.0, on_request=True)
def iso_18571(pair: Pair) -> float:
    """ISO/TS 18571 overall rating of theta, 0 to 1 (corridor 0.4, phase 0.2, magnitude 0.2, slope
    0.2), not rounded.

    By the package objective-rating-metrics, which takes the square of the samples in time and
    memory, does not look at their times and answers NaN where it has no answer; so both curves are
    put on one uniform grid of at most 4,000 samples, and curves that are constant or shorter than
    20 samples have no rating.
    """
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


def _largest(columns: tuple[Array, Array]) -> float:
    return float(np.max(np.abs(columns[1] - columns[0])))


def _sprague_geers(pair: Pair) -> tuple[float, float]:
    reference, candidate = pair.rocking
    rr, cc, rc = (
        pair.mean(product) for product in (reference**2, candidate**2, reference * candidate)
    )
    if cc == 0.0:
        raise Unavailable("only one of the two rotates")
    cosine = rc / math.sqrt(rr * cc)
    return math.sqrt(cc / rr) - 1.0, math.acos(
        max(-1.0, min(1.0, cosine))
    ) / math.pi if math.isfinite(cosine) else math.nan


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


def _unmatched(pair: Pair, matched: MatchedImpacts) -> list[tuple[History, Sequence[Event]]]:
    return [(pair.reference, matched.only_reference), (pair.candidate, matched.only_candidate)]


# --- figures of one history


@figure("peak rotation", "angle")
def peak_rotation(motion: WindowedHistory) -> Value:
    """max |theta|, in alpha; of a block that has overturned it is no peak, and a note says so."""
    at = motion.history.overturned_at
    fell = "" if at is None or at > motion.until else f"the block overturned at {at:.3g} s"
    return float(np.max(np.abs(motion.channel("theta")))) / motion.block.alpha, fell


@figure("last rotation", "angle")
def last_rotation(motion: WindowedHistory) -> float:
    """theta in the window's last row, in alpha: sees a shift in time that a peak does not."""
    return float(motion.channel("theta")[-1]) / motion.block.alpha


@figure("last x", "m")
def last_x(motion: WindowedHistory) -> float:
    """The centroid's x in the window's last row, m."""
    return float(motion.channel("x")[-1])


@figure("last slip", "m")
def last_slip(motion: WindowedHistory) -> float:
    """Where the pivot corner stands along the floor in the window's last row, m from its first
    place."""
    return float(motion.channel("slip")[-1])


@figure("end of motion", "s")
def end_time(motion: WindowedHistory) -> float:
    """Time of the window's last row, s; before the scene's duration where the block overturned."""
    return float(motion.channel("t")[-1])


@figure("floor impacts", "1", resolution=0.0)
def floor_impacts(motion: WindowedHistory) -> float:
    """Number of floor impacts stronger than 1 % of the strongest."""
    return _strong_count(motion, "floor impact")


@figure("wall impacts", "1", resolution=0.0)
def wall_impacts(motion: WindowedHistory) -> float:
    """Number of wall impacts stronger than 1 % of the strongest."""
    return _strong_count(motion, "wall impact")


@figure("highest hop", "m")
def highest_hop(motion: WindowedHistory) -> float:
    """Largest height of the lowest corner above the floor, m; 0 for a model without free flight."""
    return float(np.maximum(_extreme(motion, np.max), 0.0))


@figure("deepest penetration", "m", ideal=0.0)
def deepest_penetration(motion: WindowedHistory) -> float:
    """Largest depth of a corner below the floor or behind a wall (walls where the scene is known),
    m."""
    deepest = -_extreme(motion, np.min)
    if motion.scene is not None:
        for wall in motion.scene.walls:
            gap = kinematics.wall_gap(
                motion.scene, wall.side, motion.channel("x"), motion.channel("theta")
            )
            deepest = float(np.maximum(deepest, -np.min(gap)))
    return float(np.maximum(deepest, 0.0))


@figure("largest energy gain at an impact", "1", ideal=0.0)
def energy_gain(motion: WindowedHistory) -> float:
    """Most kinetic energy that the impact law added at one impact, relative to that before it
    (`Cost.largest_energy_gain`)."""
    return motion.history.cost.largest_energy_gain


def _strong_count(motion: WindowedHistory, kind: str) -> float:
    events = motion.events(kind)
    weak = _weak(events)
    return float(sum(abs(event.impulse) >= weak for event in events))


def _extreme(motion: WindowedHistory, choose: Callable[[Array], Any]) -> float:
    heights = kinematics.pivot_height(motion.block, motion.channel("y"), motion.channel("theta"))
    return float(choose(heights))
