"""`compare`: how far a candidate's history is from a reference's, by every measure.

And how far a block moves: the four figures of a history that an engineer reads first.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rockcheck.scenes import (
    Block,
    History,
    Scene,
    Shown,
    Side,
    errors,
)
from rockcheck.validation.discrepancy.figures import (
    Figure,
    Measure,
    Pair,
    Unavailable,
    WindowedHistory,
    extremes_in,
)
from rockcheck.validation.discrepancy.impacts import TURNS
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES
from rockcheck.validation.finding import Column

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Discrepancy(Shown):
    """The figures of one comparison.

    `start` and `end` (s) bound the time that was compared. `gap` says which part of the requested
    time could not be compared, empty where all was; a comparison with a gap never passes a
    tolerance. `fall`: the gap is there because one of the two blocks fell. The models then give
    different answers, which a difference of model form may explain.
    """

    reference: str
    candidate: str
    figures: tuple[Figure, ...]
    start: float
    end: float
    gap: str = ""
    fall: bool = False
    #: The reference's history and the candidate's.
    histories: tuple[History, History] = field(kw_only=True, repr=False, compare=False)

    def __getitem__(self, measure: str) -> float:
        """The value of a measure; NaN where it could not be computed. Raises as `figure`."""
        value = self.figure(measure).value
        return math.nan if value is None else value

    def __contains__(self, measure: object) -> bool:
        """Whether there is a figure of that measure."""
        return any(figure.measure == measure for figure in self.figures)

    def figure(self, measure: str) -> Figure:
        """The figure of a measure; raises `InputError` for one that is unknown, or not here."""
        figures = {figure.measure: figure for figure in self.figures}
        if measure in figures:
            return figures[measure]
        if measure in DIFFERENCES:
            raise errors.InputError(
                f"{measure} was not computed: name it in compare(..., measures=[{measure!r}])"
            )
        raise errors.unknown_name("measure", str(measure), figures)

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row a measure: measure, value (NaN where it could not be computed), unit, note."""
        import pandas as pd

        return pd.DataFrame(
            [(f.measure, self[f.measure], f.unit, f.note) for f in self.figures],
            columns=["measure", "value", "unit", "note"],
        )


def compare(
    reference: History,
    candidate: History,
    *,
    until: float | None = None,
    scene: Scene | None = None,
    measures: Collection[str] | None = None,
) -> Discrepancy:
    """Compare two histories over their common time, up to `until` (s).

    `measures` are names from `validation.discrepancy.measures`; by default all but those that are
    `on_request`. The candidate is interpolated onto the reference's times, with its rates. Both are
    measured with `scene`, which also gives the gravity (9.81 m/s^2 otherwise). A measure that
    cannot be computed is NaN, and its note says why. Raises `InputError` if a measure is unknown,
    the histories have no time in common, two different blocks without a `scene`, or others than it.
    """
    for key, value, kind, how in (
        ("reference", reference, History, "simulate or History.load"),
        ("candidate", candidate, History, "simulate or History.load"),
        *([("scene", scene, Scene, "load_scene")] if scene is not None else []),
    ):
        errors.check_kind(value, kind, how, key)
    blocks = [one.block for one in (reference, candidate) if one.block is not None]
    said = (
        ", ".join(f"{key} = {value}" for key, value in one.model_dump(exclude_none=True).items())
        for one in blocks
    )
    if scene is None and len(blocks) == 2 and not _same(*blocks):
        raise errors.InputError(
            f"is needed: the histories are of two blocks, {' and '.join(said)}", "scene"
        )
    if scene is not None and blocks and not any(_same(scene.block, one) for one in blocks):
        raise errors.InputError("its block is none of the histories'", "scene")
    end = math.inf if until is None else until
    if not end > 0.0:
        raise errors.InputError(f"{end:g} is not allowed: give a positive time in s", "until")
    pair = Pair(reference, candidate, scene, end)
    if len(pair.time) == 0:
        raise errors.InputError(f"{reference.model} and {candidate.model} have no time in common")
    return Discrepancy(
        reference.model,
        candidate.model,
        _figures(
            DIFFERENCES,
            measures,
            pair,
            "rad" if pair.alpha is None else "alpha",
            until,
            reference.model,
        ),
        pair.start,
        pair.end,
        *gap_of((candidate, reference), until),
        histories=(reference, candidate),
    )


def _same(one: Block, other: Block) -> bool:
    """Whether blocks differ by no more than the digits of a hand-written file."""
    first, second = (
        (block.half_width, block.half_height, *block.offset, block.gyration_squared)
        for block in (one, other)
    )
    return np.allclose(first, second, rtol=1e-6, atol=1e-9 * one.radius)


def describe(
    history: History,
    *,
    until: float | None = None,
    scene: Scene | None = None,
    measures: Collection[str] | None = None,
) -> tuple[Figure, ...]:
    """The figures of one history, up to `until` (s): peak rotation, impacts, hop and so on.

    Raises `InputError` if a measure is unknown, or the history begins only after `until`.
    """
    motion = WindowedHistory(history, scene, math.inf if until is None else until)
    if len(motion.channel("t")) == 0:
        raise errors.InputError(f"{history.model} has no row up to {motion.until:g} s")
    return _figures(FIGURES, measures, motion, "alpha", until)


def _figures(
    known: Mapping[str, Measure],
    names: Collection[str] | None,
    what: object,
    angle: str,
    until: float | None,
    against: str = "",
) -> tuple[Figure, ...]:
    """The figures of the measures of these names; None: of all but those that are `on_request`."""
    if names is None:
        names = [name for name, measure in known.items() if not measure.on_request]
    for one in names:
        if one not in known:
            raise errors.InputError(f"{one!r} is not allowed: {', '.join(known)}", "measures")
    return tuple(evaluate(known[name], what, angle, against=against, until=until) for name in names)


def evaluate(
    measure: Measure,
    what: object,
    angle: str,
    *,
    against: str = "",
    until: float | None = None,
) -> Figure:
    """One measure as a figure; a value that is not finite becomes None with a note."""
    try:
        result = measure.evaluate(what)
    except Unavailable as error:
        result = math.nan, str(error)
    value, note = result if isinstance(result, tuple) else (result, "")
    if not math.isfinite(value):
        note = note or ("infinite" if math.isinf(value) else "not a number")
    return Figure(
        measure=measure.name,
        label=measure.label,
        unit=angle if measure.unit == "angle" else measure.unit,
        value=float(value) if math.isfinite(value) else None,
        against=against,
        window="" if until is None else f"{until:g}s",
        until=until,
        note=note,
    )


def gap_of(histories: Sequence[History], until: float | None) -> tuple[str, bool]:
    """Missing part of the requested time, empty if none; True if one block's fall is all its cause.

    Nothing is missing after all fell to one side. Of two that end together the first is named.
    """
    starts, ends = ([float(h.channels["t"][k]) for h in histories] for k in (0, -1))
    step = 1.5 * max(map(_step, histories))
    outcomes = {history.outcome for history in histories}
    fell_alike = len(outcomes) == 1 and outcomes <= {*TURNS}
    asked = max(ends) if until is None else until
    late, short = histories[int(np.argmax(starts))], histories[int(np.argmin(ends))]
    is_late, is_short = max(starts) - min(starts) > step, asked - min(ends) > step
    fall = short.outcome in TURNS
    gaps = {
        f"{late.model} starts only at {max(starts):g} s": is_late,
        f"{short.model} {'falls' if fall else 'ends'} at {min(ends):g} s, before {asked:g} s": (
            is_short and not fell_alike
        ),
    }
    found = [gap for gap, there in gaps.items() if there]
    return " and ".join(found), fall and found == [*gaps][1:]


def _step(history: History) -> float:
    t = history.channels["t"]
    return float(t[-1] - t[0]) / (len(t) - 1) if len(t) > 1 else 0.0


# How far a block moves.

#: The four figures: name, what readers call it, unit and meaning.
QUANTITIES = (
    Column(
        "peak_rotation", "peak rotation", "alpha", help="largest |θ|, over the slenderness angle"
    ),
    Column("slip", "slip", "m", help="largest |slip| of the pivot corner along the floor"),
    Column(
        "top_displacement",
        "top displacement",
        "m",
        help="largest horizontal distance of a top corner from where it began, relative to the"
        " floor",
    ),
    Column(
        "wall_speed",
        "speed at the wall",
        "m/s",
        help="largest speed with which the block strikes a wall",
    ),
)


def motion_of(history: History, scene: Scene | None = None) -> dict[str, float | None]:
    """How far a block moves: the four figures of a history, by their names.

    None where unknown and, except `wall_speed`, for a fallen block; `wall_speed` is None where the
    block struck no wall. `scene` gives the block and the walls.
    """
    block = scene.block if scene else history.block
    extremes = extremes_in(history, scene)
    struck = [wall.speed for wall in extremes.walls.values() if wall.strikes]
    motion: dict[str, float | None] = {quantity.name: None for quantity in QUANTITIES}
    motion["wall_speed"] = max(struck, default=None)
    if history.outcome.startswith("overturned"):
        return motion
    if block is not None:
        motion["peak_rotation"] = extremes.peak_rotation / block.alpha
    motion["slip"] = _where_known(extremes.slip)
    motion["top_displacement"] = _where_known(extremes.top_displacement)
    return motion


def _where_known(value: float) -> float | None:
    return None if math.isnan(value) else value


def motion_words(motion: Mapping[str, float | None]) -> list[str]:
    """The known figures of how far a block moves, with their units."""
    values = ((q, motion[q.name]) for q in QUANTITIES)
    return [f"{q.label} {value:.4g} {q.unit}" for q, value in values if value is not None]


def largest_slip(history: History) -> float:
    """Largest |slip|, m, also of a block that falls; 0 if it is rounding of the pivot's place."""
    return history.extremes.slip


def wall_speeds(history: History, scene: Scene) -> Iterator[tuple[float, Side]]:
    """The largest speed (m/s) with which the block struck each wall, and that wall's side."""
    for side, wall in extremes_in(history, scene).walls.items():
        if wall.strikes:
            yield wall.speed, side


def largest_reach(history: History, scene: Scene, side: Side) -> float:
    """Farthest reach (m) of the block beyond its first place on `side`; 0 if it is rounding.

    A wall at a smaller clear gap there would be struck.
    """
    extremes = extremes_in(history, scene)
    return extremes.reach_left if side == "left" else extremes.reach_right


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Median, 16 and 84 % quantiles and maximum of `values`; each None if there are none."""
    if not len(values):
        return dict.fromkeys(("median", "p16", "p84", "largest"))
    low, median, high = np.quantile(values, (0.16, 0.5, 0.84)).tolist()
    return {"median": median, "p16": low, "p84": high, "largest": float(np.max(values))}
