"""A figure is the value of one measure: how measures are defined, and how figures are stored.

Measures see one history (`WindowedHistory`) or two on one time axis (`Pair`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from rockcheck.scenes import (
    Block,
    Event,
    Extremes,
    Floats,
    Frozen,
    History,
    Scene,
    history,
    interpolation,
    kinematics,
)
from rockcheck.validation.discrepancy.impacts import (
    IMPACTS,
    SAME_IMPACT,
    TURNS,
    MatchedImpacts,
    joined,
    match_impacts,
)

#: Start of the note of a figure that is undefined here, such as a ratio to zero.
NOT_DEFINED = "not defined here"


#: A value of `run.json`; pydantic writes a float that is not finite as null.
Stored = Frozen


def value_words(value: float | None, *, yes_no: bool) -> str:
    """A figure's value for people: "-" without a value, "yes" or "no" for a `yes_no` measure."""
    if value is None:
        return "-"
    return ("yes" if value else "no") if yes_no else f"{value:.6g}"


class Figure(Stored):
    """The value of one measure of one cell.

    `against` names the reference model, "closed form" or, for a figure of the cell itself, is
    empty. `until` is the end of the window in s, None for the whole common time; `window` names the
    window as the tolerances do ("", "8s", "horizon"). `value` is None where it could not be
    computed; `note` then says why. Otherwise `note` may add a remark, such as the event that the
    value belongs to.
    """

    measure: str
    label: str
    unit: str
    value: float | None
    against: str = ""
    window: str = ""
    until: float | None = None
    note: str = ""

    @property
    def windowed(self) -> str:
        """Measure and window, as tolerances name them."""
        return f"{self.measure}@{self.window}" if self.window else self.measure

    @property
    def title(self) -> str:
        """Measure, window and reference, as tolerances name them."""
        return f"{self.windowed} against {self.against}" if self.against else self.windowed

    @property
    def undefined(self) -> bool:
        """Whether the measure is undefined here, so that nothing is judged; the note says why."""
        return self.value is None and self.note.startswith(NOT_DEFINED)

    @property
    def of_a_fall(self) -> bool:
        """Whether it is the peak rotation of a fallen block, which is no peak; its note says so."""
        return self.measure == "peak_rotation" and self.value is not None and bool(self.note)


Value = float | tuple[float, str]
STANDARD_GRAVITY = 9.81


class Unavailable(Exception):
    """The measure cannot be computed from these histories; the message says what is missing.

    One that begins with `NOT_DEFINED`: it is undefined for them, neither a pass nor a fail.
    """


@dataclass(frozen=True)
class Measure:
    """A measure: its name, unit, definition and source, and the value of a perfect candidate.

    `name` serves tolerances and tables, `label` people. `unit` "angle" stands for alpha, or rad
    where the block is unknown. `sense` "at most": the distance from `ideal` is limited (`ideal`
    None: from the expected value); "at least": the value itself must reach the limit.
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
    #: Changes below this mean nothing (in the measure's unit); 0 for counts. The least
    #: floor.
    resolution: float = 1e-6

    @property
    def is_error(self) -> bool:
        """Whether it has a perfect value, the nearer to it the better; else it is a quantity."""
        return self.ideal is not None or self.sense == "at least"


def by_name(*measures: Measure) -> dict[str, Measure]:
    """Measures by their names."""
    return {measure.name: measure for measure in measures}


def between_rows(unit: str, frequency_parameter: float, gravity: float, step: float) -> float:
    """Largest distance of a free block from a chord between rows `step` (s) apart.

    Smaller values cannot be told from zero. Of an angle (p h)^2/8, in alpha; of a length g h^2/8,
    in m; of a time h, in s. Other units have no such floor.
    """
    share = step**2 / 8.0
    return {"angle": frequency_parameter**2 * share, "m": gravity * share, "s": step}.get(unit, 0.0)


def extremes_in(history: History, scene: Scene | None) -> Extremes:
    """The extremes of a history, with the walls of its scene where the model did not keep any."""
    if scene is None or history.model_extremes is not None:
        return history.extremes
    return interpolation.from_rows(
        history.channels,
        history.event_list,
        scene.block,
        history.outcome,
        scene.walls,
        scene.gravity,
    )


def end_of(history: History) -> float:
    """When a block is down, or else its history ends, s."""
    fallen = history.overturned_at
    return float(history.channels["t"][-1]) if fallen is None else fallen


def last_slip_of(history: History) -> float:
    """The slip at the end of a run, m: from the model, or in the last row; NaN where unknown."""
    if history.model_extremes is not None:
        return history.model_extremes.last_slip
    return float(history.channels["slip"][-1]) if "slip" in history.channels else math.nan


@dataclass(frozen=True)
class WindowedHistory:
    """One history as the figures see it: cut to a window, with the scene if it is known.

    The scene gives the block, gravity and walls. The window is from `since` to `until` (s).
    """

    history: History
    scene: Scene | None = None
    until: float = math.inf
    since: float = -math.inf

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

    def channel(self, name: str) -> Floats:
        """One column within the window."""
        if name not in self.history.channels:
            raise Unavailable(f"{self.history.model} has no column {name}")
        t = self.history.channels["t"]
        inside = (t >= self.since - 1e-9) & (t <= self.until + 1e-9)
        return np.asarray(self.history.channels[name][inside], dtype=float)

    @property
    def end(self) -> float:
        """When the window ends, or before that the history or the fall of its block, s."""
        return min(self.until, end_of(self.history))

    def at_end(self, name: str) -> float:
        """A column's value at the end of the window; in the last row where that is earlier."""
        last = min(self.until, float(self.history.channels["t"][-1]))
        return float(self.at(name, np.array([last]))[0])

    def at(self, name: str, times: Floats) -> Floats:
        """A column at times (s) inside the history, with its rates."""
        channels = self.history.channels
        if name not in channels:
            raise Unavailable(f"{self.history.model} has no column {name}")
        return interpolation.column_at(channels, self.history.event_list, name, times)

    @property
    def is_whole(self) -> bool:
        """Whether the window holds the whole run."""
        begins = self.since <= float(self.history.channels["t"][0]) + 1e-9
        return begins and self.until >= end_of(self.history) - 1e-9

    @cached_property
    def extremes(self) -> Extremes:
        """The extremes of the whole run, or between the rows in the window."""
        if self.is_whole:
            return extremes_in(self.history, self.scene)
        inside = [event for event in self.history.event_list if self.since <= event.t <= self.until]
        falls = [event.kind for event in inside if event.kind in TURNS]
        track = interpolation.track_of(self.history.channels, self.history.event_list)
        return interpolation.extremes_of(
            track.since(self.since).until(self.until),
            self.history.block if self.scene is None else self.scene.block,
            () if self.scene is None else self.scene.walls,
            inside,
            falls[0] if falls else "moving",
            source="rows",
            gravity=self.gravity,
        )

    def events(self, *kinds: str, start: float = -math.inf) -> list[Event]:
        """Events of these kinds within the window, from `start` (s) on.

        A landing with an impulse counts as a floor impact, whatever the model calls it.
        """
        named = [
            replace(event, kind="floor impact")
            if event.kind == "landing" and event.impulse != 0.0
            else event
            for event in sorted(self.history.event_list, key=lambda event: event.t)
        ]
        selected: list[Event] = []
        for kind in kinds:
            of_kind = joined([event for event in named if event.kind == kind])
            selected += [event for event in of_kind if start - 1e-9 <= event.t <= self.until + 1e-9]
        return selected

    @property
    def silent(self) -> bool:
        """Whether impacts were not recorded: it rocks to both sides without any event."""
        theta, still = self.history.channels["theta"], history.STILL
        return not self.history.event_list and bool(theta.min() < -still < still < theta.max())

    def heights(self) -> Floats:
        """Height of the lowest corner above the floor, m."""
        return kinematics.pivot_height(self.block, self.channel("y"), self.channel("theta"))


class Pair:
    """Reference and candidate over their common time up to `until` (s).

    `time` are the reference's times within it; the candidate is interpolated, with its rates.
    `start` and `end` bound the common time within the window. `known` is the history whose block is
    known, the reference's where both are. `alpha` is that block's slenderness angle, rad; None if
    unknown.
    """

    def __init__(
        self,
        reference: History,
        candidate: History,
        scene: Scene | None = None,
        until: float = math.inf,
    ) -> None:
        self.reference, self.candidate = reference, candidate
        t = np.asarray(reference.channels["t"], float)
        candidate_t = np.asarray(candidate.channels["t"], float)
        self.start = max(float(t[0]), float(candidate_t[0]))
        self.end = min(float(t[-1]), float(candidate_t[-1]), until)
        self.scene = scene
        self.time: Floats = t[(t >= self.start - 1e-9) & (t <= self.end + 1e-9)]
        known = candidate if reference.alpha is None else reference
        self.known = WindowedHistory(known, scene)
        self.alpha = scene.block.alpha if scene else known.alpha

    def channels(self, name: str) -> Floats:
        """One column of both on `time`: reference and candidate, a row each."""
        return np.array(
            [
                WindowedHistory(self.reference).at(name, self.time),
                WindowedHistory(self.candidate).at(name, self.time),
            ]
        )

    @cached_property
    def theta(self) -> Floats:
        """Theta of both, in alpha (in rad where the block is unknown)."""
        return self.channels("theta") / (self.alpha or 1.0)

    @property
    def rocking(self) -> Floats:
        """`theta`; raises `Unavailable` where the reference's peak is too small to divide by."""
        if np.max(np.abs(self.theta[0])) * (self.alpha or 1.0) <= history.STILL:
            raise Unavailable(f"{NOT_DEFINED}: the reference does not rotate")
        return self.theta

    @property
    def peaks(self) -> tuple[float, float]:
        """Largest |theta| of both, rad; raises `Unavailable` as `rocking`."""
        reference, candidate = (
            WindowedHistory(model_history, self.scene, until=self.end, since=self.start)
            for model_history in (self.reference, self.candidate)
        )
        reference_peak = reference.extremes.peak_rotation
        if reference_peak <= history.STILL:
            raise Unavailable(f"{NOT_DEFINED}: the reference does not rotate")
        return reference_peak, candidate.extremes.peak_rotation

    @cached_property
    def energies(self) -> Floats:
        """Energy per unit mass of both, J/kg."""
        return np.asarray(
            kinematics.energy(
                self.known.block,
                self.known.gravity,
                self.channels("y"),
                self.channels("theta"),
                self.channels("x_dot"),
                self.channels("y_dot"),
                self.channels("theta_dot"),
            )
        )

    def mean(self, values: Floats) -> float:
        """Mean over time, by the trapezoidal rule."""
        if len(values) == 1:
            return float(values[0])
        steps = np.diff(self.time)
        return float(np.sum(steps * 0.5 * (values[1:] + values[:-1])) / np.sum(steps))

    def rms(self, columns: Floats) -> float:
        """RMS difference over time, sqrt(mean (candidate - reference)^2)."""
        return math.sqrt(self.mean((columns[1] - columns[0]) ** 2))

    @cached_property
    def sprague_geers(self) -> tuple[float, float]:
        """Magnitude and phase errors M and P of theta (Sprague and Geers)."""
        reference, candidate = self.rocking
        rr = self.mean(reference**2)
        cc = self.mean(candidate**2)
        rc = self.mean(reference * candidate)
        if cc == 0.0:
            raise Unavailable("only one of the two rotates")
        cosine = rc / math.sqrt(rr * cc)
        phase = math.acos(max(-1.0, min(1.0, cosine))) / math.pi
        return math.sqrt(cc / rr) - 1.0, phase if math.isfinite(cosine) else math.nan

    @cached_property
    def impacts(self) -> MatchedImpacts:
        """The impacts of both within the common time, matched.

        A counterpart may lie just beyond it. A history without any event, unlike the other's, does
        not record them: raises `Unavailable`; so does one that is `silent`.
        """
        reference_events = self._events_near(self.reference)
        candidate_events = self._events_near(self.candidate)
        _check_records_events(self.reference, candidate_events)
        _check_records_events(self.candidate, reference_events)
        matched, only_reference, only_candidate = match_impacts(reference_events, candidate_events)
        return (
            [match for match in matched if self._is_inside(match[0]) or self._is_inside(match[1])],
            [event for event in only_reference if self._is_inside(event)],
            [event for event in only_candidate if self._is_inside(event)],
        )

    def _events_near(self, model_history: History) -> list[Event]:
        """Impacts and falls within the common time, or so near that they may have counterparts."""
        windowed = WindowedHistory(model_history, until=self.end + SAME_IMPACT)
        start = self.start - SAME_IMPACT
        return windowed.events(*IMPACTS, *TURNS, start=start)

    def _is_inside(self, event: Event) -> bool:
        return self.start - 1e-9 <= event.t <= self.end + 1e-9


def _check_records_events(model_history: History, others: list[Event]) -> None:
    """Raises `Unavailable` for a history without events, where the other history has `others`."""
    no_events = others and not model_history.event_list
    if no_events or WindowedHistory(model_history).silent:
        raise Unavailable(f"{model_history.model} has no events")
