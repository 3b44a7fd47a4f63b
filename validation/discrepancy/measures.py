"""The measures, each defined once, in a table: name, label, unit, formula and source, function.

A *difference* is a function of a `Pair` (reference and candidate on one time axis), a *figure* one
of a `WindowedHistory`, a *statistic* one of `Samples` (two models' results for an ensemble). All
return a number, or a number and a remark; they raise `Unavailable` where the histories lack a
column or event that they need. In the formulas r is the reference, c the
candidate, d = c - r, and <.> the mean over the window, by the trapezoidal rule.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy  # it loads its parts as they are used
from numpy.typing import NDArray

from rockcheck.scenes import Event, Floats, Pivot, Scene, interpolation, kinematics
from rockcheck.validation.criteria import quarter_period
from rockcheck.validation.discrepancy import figures

ISO_MOST_SAMPLES = 4000


# Differences


def _peak(columns: Floats) -> float:
    return float(np.max(np.abs(columns[1] - columns[0])))


def _hausdorff(pair: figures.Pair) -> float:
    p = pair.known.block.weaker_pivot.frequency_parameter(pair.known.gravity)
    first, second = (np.column_stack([p * pair.time, column]) for column in pair.theta)
    if not (np.all(np.isfinite(first)) and np.all(np.isfinite(second))):
        return math.nan
    return max(_farthest(first, second), _farthest(second, first))


def _farthest(points: Floats, line: Floats) -> float:
    """Largest distance from `points` to the broken line through `line`, both of shape (n, 2).

    The two segments at the vertex nearest to a point, looked up in a tree, bound its distance from
    above. The point with the largest bound is measured to the whole line, until that is its bound.
    """
    if len(line) == 1:
        return float(np.max(np.linalg.norm(points - line[0], axis=1)))
    nearest = scipy.spatial.cKDTree(line).query(points)[1]
    starts = (np.clip(nearest + shift, 0, len(line) - 2) for shift in (-1, 0))
    most = np.min([_apart(points, line[k], line[k + 1]) for k in starts], axis=0)
    while True:
        farthest = np.argmax(most)
        exact = np.min(_apart(points[farthest], line[:-1], line[1:]))
        if exact >= most[farthest]:
            return float(exact)
        most[farthest] = exact


def _apart(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distances of points from segments."""
    along, away = end - start, points - start
    share = np.clip(np.sum(away * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(away - share[:, None] * along, axis=1))


def _agree_until(pair: figures.Pair) -> tuple[float, str]:
    _, only_reference, only_candidate = pair.impacts
    alone = (pair.reference, only_reference), (pair.candidate, only_candidate)
    found = [(e.t, f"{e.kind} only in {h.model}") for h, events in alone for e in events]
    return min(found, default=(pair.end, "all events agree"))


def _impact_time(pair: figures.Pair) -> tuple[float, str]:
    pairs, *_ = pair.impacts
    if not pairs:
        return 0.0, "no impact has a counterpart"
    first, second = max(pairs, key=lambda two: abs(two[1].t - two[0].t))
    return abs(second.t - first.t), f"{first.kind} at {first.t:.3f} s"


def _impulse(pair: figures.Pair) -> figures.Value:
    pairs, *_ = pair.impacts
    of_reference, of_candidate = (
        figures.WindowedHistory(history).events(*figures.IMPACTS)
        for history in (pair.reference, pair.candidate)
    )
    strongest = dict.fromkeys(figures.IMPACTS, 0.0)
    for impact, _ in pairs:
        strongest[impact.kind] = max(strongest.get(impact.kind, 0.0), abs(impact.impulse))
    errors = [
        (abs(other.impulse - impact.impulse) / strongest[impact.kind], impact)
        for impact, other in pairs
        if strongest[impact.kind] > 0.0
        and _strikes_alone(impact, of_reference)
        and _strikes_alone(other, of_candidate)
    ]
    if not errors:
        return 0.0, "no impact of one contact alone has a counterpart"
    largest, impact = max(errors, key=lambda error: error[0])
    return largest, f"{impact.kind} at {impact.t:.3f} s"


def _strikes_alone(impact: Event, impacts: Sequence[Event]) -> bool:
    """Whether no contact of another kind is struck at that instant.

    How several contacts share an impulse the motion does not say.
    """
    return not any(
        other.kind != impact.kind and abs(other.t - impact.t) <= figures.ONE_IMPACT
        for other in impacts
    )


def _overturning_time(pair: figures.Pair) -> float:
    first, second = (
        math.inf if one.overturned_at is None else one.overturned_at
        for one in (pair.reference, pair.candidate)
    )
    return 0.0 if first == second else abs(second - first)


def _outcome(pair: figures.Pair) -> tuple[float, str]:
    first, second = pair.reference.outcome, pair.candidate.outcome
    fates = {outcome if outcome in figures.TURNS else "stays" for outcome in (first, second)}
    return float(len(fates) == 1), first if first == second else f"{first} / {second}"


def _iso_18571(pair: figures.Pair) -> float:
    try:
        from objective_rating_metrics.rating import ISO18571
    except ImportError:
        raise figures.Unavailable(
            "needs the package objective-rating-metrics: pip install objective-rating-metrics"
        ) from None
    curves = pair.rocking
    if len(pair.time) < 20 or not all(
        np.all(np.isfinite(curve)) and np.ptp(curve) > 0.0 for curve in curves
    ):
        raise figures.Unavailable("too short, constant or not finite")
    grid = np.linspace(pair.time[0], pair.time[-1], min(len(pair.time), ISO_MOST_SAMPLES))
    reference, candidate = (
        np.column_stack([grid, np.interp(grid, pair.time, curve)]) for curve in curves
    )
    return float(
        ISO18571(reference, candidate, dt=float(grid[1] - grid[0])).overall_rating(ndigits=-1)
    )


def _column_rms(name: str, label: str, column: str, unit: str, formula: str) -> figures.Measure:
    """The RMS difference of a column; computed where a suite asks for it."""
    return figures.Measure(
        name,
        f"RMS difference of {label}",
        unit,
        f"sqrt <d^2> of {formula}, {unit}.",
        lambda pair: pair.rms(pair.channels(column)),
        on_request=True,
    )


DIFFERENCES = figures.by_name(
    figures.Measure(
        "theta_rms",
        "RMS difference of rotation",
        "angle",
        "sqrt <d^2> of theta, in alpha.",
        lambda pair: pair.rms(pair.theta),
    ),
    figures.Measure(
        "theta_peak",
        "peak difference of rotation",
        "angle",
        "max |d| of theta, in alpha.",
        lambda pair: _peak(pair.theta),
    ),
    figures.Measure(
        "x_rms",
        "RMS difference of x",
        "m",
        "sqrt <d^2> of the centroid's x, m.",
        lambda pair: pair.rms(pair.channels("x")),
    ),
    figures.Measure(
        "x_peak",
        "peak difference of x",
        "m",
        "max |d| of the centroid's x, m.",
        lambda pair: _peak(pair.channels("x")),
    ),
    figures.Measure(
        "slip_rate_rms",
        "RMS difference of slip rate",
        "m/s",
        "sqrt <d^2> of the pivot corner's horizontal velocity V, m/s.",
        lambda pair: pair.rms(pair.channels("slip_rate")),
    ),
    figures.Measure(
        "slip_rate_peak",
        "peak difference of slip rate",
        "m/s",
        "max |d| of the pivot corner's horizontal velocity V, m/s; where the pivot changes it"
        " jumps, see `theta_hausdorff`.",
        lambda pair: _peak(pair.channels("slip_rate")),
    ),
    _column_rms("rotation_rate_rms", "rotation rate", "theta_dot", "rad/s", "the rate of rotation"),
    _column_rms(
        "x_velocity_rms",
        "horizontal velocity",
        "x_dot",
        "m/s",
        "the centroid's horizontal velocity",
    ),
    _column_rms(
        "y_velocity_rms", "vertical velocity", "y_dot", "m/s", "the centroid's vertical velocity"
    ),
    _column_rms("y_rms", "y", "y", "m", "the centroid's y"),
    _column_rms("slip_rms", "slip", "slip", "m", "the pivot corner's place along the floor"),
    figures.Measure(
        "energy_rms",
        "RMS difference of energy",
        "J/kg",
        "sqrt <d^2> of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: pair.rms(pair.energies),
    ),
    figures.Measure(
        "energy_peak",
        "peak difference of energy",
        "J/kg",
        "max |d| of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: _peak(pair.energies),
    ),
    figures.Measure(
        "sprague_geers_m",
        "Sprague-Geers M (magnitude)",
        "1",
        "M = sqrt(<c^2>/<r^2>) - 1 of theta: error of magnitude, blind to phase.\n\nSprague &"
        " Geers, Commun. Numer. Meth. Engng 20 (2004) 467; Schwer, Engng Comput. 23 (2007) 295.",
        lambda pair: pair.sprague_geers[0],
    ),
    figures.Measure(
        "sprague_geers_p",
        "Sprague-Geers P (phase)",
        "1",
        "P = acos(<r c>/sqrt(<r^2><c^2>))/pi of theta: error of phase, blind to magnitude; 0 in"
        " phase, 1 in opposition.\n\nSource as for M.",
        lambda pair: pair.sprague_geers[1],
    ),
    figures.Measure(
        "sprague_geers_c",
        "Sprague-Geers C (both)",
        "1",
        "C = sqrt(M^2 + P^2) of theta. Source as for M.",
        lambda pair: math.hypot(*pair.sprague_geers),
    ),
    figures.Measure(
        "peak_ratio",
        "ratio of peak rotations",
        "1",
        "max |c| / max |r| of theta.",
        lambda pair: pair.peaks[1] / pair.peaks[0],
        ideal=1.0,
    ),
    figures.Measure(
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
    figures.Measure(
        "events_agree_until",
        "events agree until",
        "s",
        "Time up to which each impact (and fall) of either has its counterpart in the other;"
        " the remark says what comes then.\n\nCounterparts are of one kind and within 20 ms;"
        " impacts below 1 % of the strongest need none, and those within 2 ms are one. The window's"
        " end if all agree.",
        _agree_until,
        ideal=None,
        sense="at least",
    ),
    figures.Measure(
        "unmatched_impacts",
        "impacts without counterpart",
        "1",
        "Number of impacts of either that have no counterpart in the other, matched as in"
        " `events_agree_until`.",
        lambda pair: (
            float(sum(map(len, pair.impacts[1:]))),
            f"{len(pair.impacts[0])} impacts matched",
        ),
        resolution=0.0,
    ),
    figures.Measure(
        "impact_time",
        "largest impact-time error",
        "s",
        "max |t_c - t_r| over the impacts that have a counterpart, matched as in"
        " `events_agree_until`, s.",
        _impact_time,
    ),
    figures.Measure(
        "impulse_error",
        "largest error of impulse",
        "1",
        "max |J_c - J_r| over the impacts that have a counterpart, over the strongest of them of"
        " its kind; matched as in `events_agree_until`.\n\nWithout those at which floor and wall"
        " are struck within 2 ms: how the two share an impulse the motion does not say.",
        _impulse,
        on_request=True,
    ),
    figures.Measure(
        "overturning_time",
        "difference of overturning time",
        "s",
        "|t_c - t_r| of |theta| = pi/2, s; 0 if neither overturns, infinite if only one does.",
        _overturning_time,
    ),
    figures.Measure(
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
    figures.Measure(
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


def _peak_rotation(motion: figures.WindowedHistory) -> figures.Value:
    at = motion.history.overturned_at
    fell = "" if at is None or at > motion.until else f"the block overturned at {at:.3g} s"
    return motion.extremes.peak_rotation / motion.block.alpha, fell


def _last_slip(motion: figures.WindowedHistory) -> float:
    motion.channel("slip")  # a history without it has none
    return figures.last_slip_of(motion.history) if motion.is_whole else motion.at_end("slip")


def _highest_hop(motion: figures.WindowedHistory) -> float:
    motion.channel("y")  # a history without it has no heights
    return motion.extremes.hop if motion.block else math.nan


def _deepest(motion: figures.WindowedHistory) -> float:
    gaps, scene = [motion.heights()], motion.scene
    if scene is not None:
        place = motion.channel("x"), motion.channel("theta")
        gaps += [
            kinematics.clearance(scene.block, wall.side, wall.gap, *place) for wall in scene.walls
        ]
    return float(np.maximum(np.max([-np.min(gap) for gap in gaps]), 0.0))


def _impacts(motion: figures.WindowedHistory, kind: str) -> tuple[float, str]:
    count = float(sum(figures.strong(motion.events(kind))))
    return (math.nan, f"{motion.history.model} has no events") if motion.silent else (count, "")


#: A figure without an ideal value is judged by its expected value.
_quantity = partial(figures.Measure, ideal=None)
FIGURES = figures.by_name(
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
        "theta at the window's end, in alpha: sees a shift in time that a peak does not.",
        lambda motion: motion.at_end("theta") / motion.block.alpha,
    ),
    _quantity(
        "last_x",
        "last x",
        "m",
        "The centroid's x at the window's end, m.",
        lambda motion: motion.at_end("x"),
    ),
    _quantity(
        "last_slip",
        "last slip",
        "m",
        "Where the pivot corner stands along the floor at the window's end, m from its first"
        " place.",
        _last_slip,
    ),
    _quantity(
        "end_time",
        "end of motion",
        "s",
        "End of the window or the run, s; where the block overturned, when it did.",
        lambda motion: motion.end,
    ),
    _quantity(
        "floor_impacts",
        "floor impacts",
        "1",
        "Number of floor impacts stronger than 1 % of the strongest.",
        partial(_impacts, kind="floor impact"),
        resolution=0.0,
    ),
    _quantity(
        "wall_impacts",
        "wall impacts",
        "1",
        "Number of wall impacts stronger than 1 % of the strongest.",
        partial(_impacts, kind="wall impact"),
        resolution=0.0,
    ),
    _quantity(
        "highest_hop",
        "highest hop",
        "m",
        "Largest height of the lowest corner above the floor, m; 0 for a model without free"
        " flight.",
        _highest_hop,
    ),
    figures.Measure(
        "deepest_penetration",
        "deepest penetration",
        "m",
        "Largest depth of a corner below the floor or behind a wall (walls where the scene is"
        " known) in a row, m.",
        _deepest,
    ),
    figures.Measure(
        "energy_gain",
        "largest energy gain at an impact",
        "1",
        "Most kinetic energy that the impact law added at one impact, relative to that before"
        " it (`Cost.largest_energy_gain`).",
        lambda motion: motion.history.cost.largest_energy_gain,
    ),
)


# Scenes with a closed form: distance of a history from it. Figures whose perfect value is 0,
# computed on request.


def _sliding_distance(motion: figures.WindowedHistory) -> float:
    scene, braking = _flat_start(motion, "a block that starts sliding flat", walls=0)
    _stopped(motion, scene, abs(scene.initial_velocity))
    x = motion.channel("x")
    return abs(float(x[-1] - x[0])) - scene.initial_velocity**2 / braking


def _wall_rebound(motion: figures.WindowedHistory) -> float:
    scene, braking = _flat_start(motion, "a block that slides flat into a wall", walls=1)
    wall, away = scene.walls[0], kinematics.OUTWARD[scene.walls[0].side]
    speed2 = scene.initial_velocity**2 - braking * wall.gap
    _need(speed2 > 0.0 > away * scene.initial_velocity, "a block that reaches the wall")
    lost = (1.0 - wall.restitution) * math.sqrt(speed2)
    _stopped(motion, scene, abs(scene.initial_velocity) - lost)
    from_wall = wall.gap + away * float(motion.channel("x")[-1])
    return from_wall - wall.restitution**2 * speed2 / braking


def _bounce_height(motion: figures.WindowedHistory) -> float:
    scene = _scene(motion)
    height, e = scene.initial_height, scene.floor.restitution
    turned = scene.initial_rotation or scene.initial_angular_velocity
    _need(height > 0.0 and not turned, "a block that drops flat")
    t = motion.channel("t")
    strikes = math.sqrt(2.0 * height / scene.gravity)
    lands = strikes * (1.0 + 2.0 * e)
    hops = (t > strikes) & (t < lands)
    _need(bool(np.any(hops)), "rows after the first bounce")
    highest = _largest(motion, "y", hops) - motion.block.half_height
    return highest - e**2 * height


def _quarter_period(motion: figures.WindowedHistory) -> float:
    scene, pivot, _ = _released(motion)
    impacts = motion.events("floor impact")
    _need(bool(impacts), "a floor impact")
    return impacts[0].t - quarter_period(pivot, scene.gravity, abs(scene.initial_rotation))


def _impact_ratio(motion: figures.WindowedHistory) -> float:
    scene, old, new = _released(motion)
    impacts = [event.t for event in motion.events("floor impact")]
    _need(len(impacts) >= 2, "two floor impacts")
    t = motion.channel("t")
    swings = (t > impacts[0]) & (t < impacts[1])
    _need(bool(np.any(swings)), "rows between the first two floor impacts")
    swing = max(_largest(motion, "theta", swings), _largest(motion, "theta", swings, sense=-1.0))
    before, after = (
        pivot.frequency_parameter(scene.gravity)
        * math.sqrt(math.cos(pivot.alpha - tilt) - math.cos(pivot.alpha))
        for pivot, tilt in ((old, abs(scene.initial_rotation)), (new, swing))
    )
    return after / before - (1.0 - new.share * new.arm * (new.arm + old.arm) / new.radius**2)


def _largest(
    motion: figures.WindowedHistory, name: str, rows: NDArray[np.bool_], sense: float = 1.0
) -> float:
    """Largest value of a place in these rows and between them, or of its negative."""
    columns = motion.history.channels
    place = sense * motion.channel(name)[rows]
    rate = np.full(len(place), math.nan)
    if interpolation.RATES[name] in columns:
        rate = sense * motion.channel(interpolation.RATES[name])[rows]
    return interpolation.largest(motion.channel("t")[rows], place, rate, np.empty(0))[0]


def _scene(motion: figures.WindowedHistory) -> Scene:
    if motion.scene is None or {motion.scene.excitation.kind, motion.scene.vertical.kind} != {
        "rest"
    }:
        raise figures.Unavailable("closed forms need a known scene with a base at rest")
    return motion.scene


def _flat_start(motion: figures.WindowedHistory, what: str, *, walls: int) -> tuple[Scene, float]:
    """The scene, and the loss of speed squared by friction on the way, m/s^2.

    Raises `Unavailable` unless its block starts sliding flat with `walls` walls.
    """
    scene = _scene(motion)
    moving = scene.initial_rotation, scene.initial_angular_velocity, scene.initial_height
    slides = scene.initial_velocity != 0.0 and not any(moving)
    _need(slides and len(scene.walls) == walls, what)
    return scene, 2.0 * scene.floor.friction * scene.gravity


def _stopped(motion: figures.WindowedHistory, scene: Scene, speed: float) -> None:
    """Raises `Unavailable` if the window ends before friction has taken `speed` (m/s)."""
    reached = scene.floor.friction * scene.gravity * float(motion.channel("t")[-1])
    if motion.history.overturned_at is None and reached <= speed:
        raise figures.Unavailable(
            f"{figures.NOT_DEFINED}: the window ends before the block has stopped"
        )


def _released(motion: figures.WindowedHistory) -> tuple[Scene, Pivot, Pivot]:
    """The scene, the pivot on which its block, released from a tilt, rocks first, and the other."""
    scene = _scene(motion)
    left, right = scene.block.pivot("left"), scene.block.pivot("right")
    old, new = (left, right) if scene.initial_rotation > 0.0 else (right, left)
    moving = scene.initial_velocity, scene.initial_angular_velocity, scene.initial_height
    _need(
        0.0 < abs(scene.initial_rotation) < old.alpha and not any(moving) and not scene.walls,
        "a block released at rest from a tilt",
    )
    return scene, old, new


def _need(holds: bool, what: str) -> None:
    if not holds:
        raise figures.Unavailable(f"{what} is needed")


_error = partial(figures.Measure, on_request=True, exact=True)
FIGURES |= figures.by_name(
    _error(
        "sliding_distance_error",
        "error of sliding distance",
        "m",
        "|x at the end - x at the start| - v0^2/(2 mu g): a block that slides flat to a stop on a"
        " base at rest, m.",
        _sliding_distance,
    ),
    _error(
        "wall_rebound_error",
        "error of wall rebound",
        "m",
        "Place where a block that slides flat into a wall stops, less e^2 (v0^2 - 2 mu g gap)/(2 mu"
        " g) from the wall, m.\n\nCase III: it leaves the wall at e times the speed that friction"
        " has left it.",
        _wall_rebound,
    ),
    _error(
        "bounce_height_error",
        "error of bounce height",
        "m",
        "Highest point after the first bounce, less e_g^2 h: a block that drops flat from h, m.",
        _bounce_height,
    ),
    _error(
        "quarter_period_error",
        "error of quarter period",
        "s",
        "Time of the first floor impact, less Housner's quarter period: a block released at theta_0"
        " that does not slip, s.\n\nT/4 = int_0^theta_0 d theta / sqrt(2 p^2 [cos(alpha - theta_0)"
        " - cos(alpha - theta)]), without his small angles, with p and alpha of the pivot on the"
        " side to which it is tilted.",
        _quarter_period,
    ),
    _error(
        "impact_ratio_error",
        "error of impact ratio",
        "1",
        "Ratio of angular velocities over the first floor impact, less Housner's 1 - 1.5 sin^2"
        " alpha, for a block released at rest.\n\nFrom the turning points before and after it,"
        " between which energy is kept: dtheta/dt at the impact is p sqrt(2 [cos(alpha - |theta|) -"
        " cos alpha]) with p and alpha of the pivot. A block that is not homogeneous keeps its"
        " angular momentum about the new pivot: 1 - a (a + a')/(I/m + R^2), where a is the new"
        " pivot's distance from the mass's centre along the floor and a' the old one's.",
        _impact_ratio,
    ),
)


# Ensembles: differences between two samples of scenes. Distributions of the peaks, agreement on
# overturning, bias and scatter.

#: Peaks below this (alpha) have no ratio worth a logarithm.
SMALLEST_PEAK = 1e-3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Sample:
    """One model's results for an ensemble: peak rotation (alpha) and outcome of each scene.

    NaN and "" where it failed.
    """

    peaks: Floats
    outcomes: Sequence[str]

    @property
    def fallen(self) -> NDArray[np.bool_]:
        """Which scenes end overturned."""
        return np.array([outcome.startswith("overturned") for outcome in self.outcomes])

    @property
    def failures(self) -> int:
        """Scenes without a result."""
        return int(np.sum(~np.isfinite(self.peaks)))


@dataclass(frozen=True)
class Samples:
    """Reference and candidate of one ensemble."""

    reference: Sample
    candidate: Sample

    def log_ratios(self) -> Floats:
        """ln(c/r) of the peaks where neither falls and both rock; at least two."""
        r, c = self.reference, self.candidate
        rocks, too = (~sample.fallen & (sample.peaks > SMALLEST_PEAK) for sample in (r, c))
        if np.sum(rocks) < 2:
            raise figures.Unavailable(
                f"{figures.NOT_DEFINED}: fewer than two scenes in which the reference rocks and"
                " does not fall"
            )
        usable = rocks & too
        if np.sum(usable) < 2:
            raise figures.Unavailable("fewer than two scenes in which both rock and neither falls")
        return np.log(c.peaks[usable] / r.peaks[usable])


def _distributions(samples: Samples, fallen: float) -> tuple[Floats, Floats]:
    """The peaks of both (alpha), limited to `fallen`, which is also the value of fallen blocks."""
    r, c = (
        np.where(one.fallen, fallen, np.minimum(one.peaks, fallen))
        for one in (samples.reference, samples.candidate)
    )
    if np.any(np.isnan(r)) or np.any(np.isnan(c)):
        raise figures.Unavailable("a model failed in some of the scenes")
    return r, c


def _ks_distance(samples: Samples) -> tuple[float, str]:
    r, c = (
        np.where(peaks < SMALLEST_PEAK, 0.0, peaks) for peaks in _distributions(samples, math.inf)
    )
    # The test takes no infinities, but only order counts.
    ranks = np.unique(np.concatenate([r, c]), return_inverse=True)[1]
    with warnings.catch_warnings(action="ignore"):  # where the exact test fails it takes the usual
        found = scipy.stats.ks_2samp(ranks[: len(r)], ranks[len(r) :])
    return float(found.statistic), f"p = {found.pvalue:.2g}"


def _share(hits: NDArray[np.bool_], of: int) -> tuple[float, str]:
    if of == 0:
        return 1.0, "none fall"
    count = int(np.sum(hits))
    interval = scipy.stats.binomtest(count, of).proportion_ci(CONFIDENCE, method="wilson")
    return count / of, f"[{interval.low:.3f}, {interval.high:.3f}], {count} of {of}"


def _peak_bias(samples: Samples) -> tuple[float, str]:
    ratios = samples.log_ratios()
    most = scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(ratios) - 1)
    half = float(most * np.std(ratios, ddof=1) / math.sqrt(len(ratios)))
    mean = float(np.mean(ratios))
    return mean, f"[{mean - half:.2g}, {mean + half:.2g}], {len(ratios)} scenes"


def _peak_scatter(samples: Samples) -> tuple[float, str]:
    ratios = samples.log_ratios()
    scatter, free = float(np.std(ratios, ddof=1)), len(ratios) - 1
    low, high = (
        scatter * math.sqrt(free / scipy.stats.chi2.ppf(0.5 + sign * 0.5 * CONFIDENCE, free))
        for sign in (1.0, -1.0)
    )
    return scatter, f"[{low:.2g}, {high:.2g}]"


_agreement = partial(figures.Measure, ideal=1.0, resolution=1e-3)
#: The measures of ensembles: functions of `Samples`.
STATISTICS = figures.by_name(
    figures.Measure(
        "ks_distance",
        "Kolmogorov-Smirnov distance",
        "1",
        "max |F_c - F_r| of the distributions of peak |theta|/alpha, the fallen beyond all others,"
        " peaks below 1e-3 alike; the remark gives its p-value.\n\n"
        "Two-sample Kolmogorov-Smirnov test: the probability of such a distance between two"
        " samples of one distribution.",
        _ks_distance,
        resolution=1e-3,
    ),
    figures.Measure(
        "area_metric",
        "area between the distributions",
        "1",
        "Area between the distribution functions of peak |theta|/alpha (ASME V&V 10-2006; Ferson"
        " 2008), the fallen at 1, the balance point.",
        lambda two: (float(scipy.stats.wasserstein_distance(*_distributions(two, 1.0))), ""),
        resolution=1e-4,
    ),
    _agreement(
        "overturning_accuracy",
        "agreement on overturning",
        "1",
        "Share of scenes in which both fall or both stay; the remark gives its 95 % confidence"
        " interval (Wilson 1927).",
        lambda two: _share(two.reference.fallen == two.candidate.fallen, len(two.reference.fallen)),
    ),
    _agreement(
        "overturning_precision",
        "precision of overturning",
        "1",
        "Share of the scenes in which the candidate falls that the reference falls in too; 1 if it"
        " falls in none.",
        lambda two: _share(
            two.reference.fallen & two.candidate.fallen, int(np.sum(two.candidate.fallen))
        ),
    ),
    _agreement(
        "overturning_recall",
        "recall of overturning",
        "1",
        "Share of the scenes in which the reference falls that the candidate falls in too; 1 if it"
        " falls in none.",
        lambda two: _share(
            two.reference.fallen & two.candidate.fallen, int(np.sum(two.reference.fallen))
        ),
    ),
    figures.Measure(
        "peak_bias",
        "bias of peak rotation",
        "1",
        "Mean of ln(c/r) of the peaks where neither falls; the remark gives its 95 % confidence"
        " interval (Student).",
        _peak_bias,
        resolution=1e-4,
    ),
    figures.Measure(
        "peak_scatter",
        "scatter of peak rotation",
        "1",
        "Standard deviation of ln(c/r) of the peaks where neither falls; the remark gives its 95 %"
        " interval (chi-squared).",
        _peak_scatter,
        resolution=1e-4,
    ),
)
