"""`compare`: how far a candidate's history is from a reference's, by every measure."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rockcheck.scenes import Block, History, InputError, Scene
from rockcheck.scenes.base import Shown
from rockcheck.scenes.errors import check_kind
from rockcheck.validation.discrepancy.figures import (
    TURNS,
    Figure,
    Measure,
    Pair,
    Unavailable,
    WindowedHistory,
)
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES

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
    histories: tuple[History, History] | None = field(default=None, repr=False, compare=False)

    def __getitem__(self, measure: str) -> float:
        """The value of a measure; NaN where it could not be computed."""
        value = self.figure(measure).value
        return math.nan if value is None else value

    def figure(self, measure: str) -> Figure:
        """The figure of a measure; KeyError for an unknown one."""
        return {found.measure: found for found in self.figures}[measure]

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row a measure: measure, value (NaN where it could not be computed), unit, note."""
        import pandas as pd

        rows = [
            (f.measure, math.nan if f.value is None else f.value, f.unit, f.note)
            for f in self.figures
        ]
        return pd.DataFrame(rows, columns=["measure", "value", "unit", "note"])


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
    `on_request`. The candidate is interpolated linearly onto the reference's times. Both are
    measured with `scene`, which also gives the gravity (9.81 m/s^2 otherwise). A measure that
    cannot be computed is NaN, and its note says why. Raises `InputError` if a measure is unknown,
    the histories have no time in common, or, without a `scene`, two different blocks.
    """
    for key, history in (("reference", reference), ("candidate", candidate)):
        check_kind(history, History, "simulate or History.load", key)
    blocks = [one.block for one in (reference, candidate) if one.block is not None]
    if scene is None and len(blocks) == 2:
        _check_same(*blocks)
    if until is not None and not until > 0.0:
        raise InputError(f"{until:g} is not allowed: give a positive time in s", "until")
    pair = Pair(reference, candidate, scene, math.inf if until is None else until)
    if len(pair.time) == 0:
        raise InputError(f"{reference.model} and {candidate.model} have no time in common")
    angle = "rad" if pair.alpha is None else "alpha"
    return Discrepancy(
        reference.model,
        candidate.model,
        _figures(DIFFERENCES, measures, pair, angle, until, reference.model),
        pair.start,
        pair.end,
        *_gap(pair, until),
        histories=(reference, candidate),
    )


def _check_same(one: Block, other: Block) -> None:
    """Raise `InputError` if blocks differ by more than the digits of a hand-written file."""
    first, second = (
        (block.half_width, block.half_height, *block.offset, block.gyration_squared)
        for block in (one, other)
    )
    if not np.allclose(first, second, rtol=1e-6, atol=1e-9 * one.radius):
        said = (
            ", ".join(
                f"{name} = {value}" for name, value in block.model_dump(exclude_none=True).items()
            )
            for block in (one, other)
        )
        raise InputError(
            f"is needed: the histories are of two blocks, {' and '.join(said)}", "scene"
        )


def describe(
    history: History,
    *,
    until: float | None = None,
    scene: Scene | None = None,
    measures: Collection[str] | None = None,
) -> tuple[Figure, ...]:
    """The figures of one history, up to `until` (s): peak rotation, impacts, hop and so on."""
    motion = WindowedHistory(history, scene, math.inf if until is None else until)
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
    if unknown := [name for name in names if name not in known]:
        raise InputError(f"{unknown[0]!r} is not allowed: {', '.join(known)}", "measures")
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


def too_short(history: History, until: float | None) -> str:
    """Why a history does not reach `until`; empty where it does, or ended by overturning."""
    end = float(history.channels["t"][-1])
    if until is None or history.outcome in TURNS or end >= until - 1.5 * _step(history):
        return ""
    return f"{history.model} ends at {end:g} s, before {until:g} s"


def _gap(pair: Pair, until: float | None) -> tuple[str, bool]:
    """Missing part of the requested time, empty if none; True if one block's fall is the cause.

    Nothing is missing where both fell to the same side.
    """
    starts, ends = (
        [float(h.channels["t"][k]) for h in (pair.reference, pair.candidate)] for k in (0, -1)
    )
    step = 1.5 * float(max(_step(pair.reference), _step(pair.candidate)))
    if max(starts) - min(starts) > step:
        late = pair.reference if starts[0] > starts[1] else pair.candidate
        return f"{late.model} starts only at {max(starts):g} s", False
    fell_alike = pair.reference.outcome == pair.candidate.outcome in TURNS
    asked = max(ends) if until is None else until
    if fell_alike or asked - min(ends) <= step:
        return "", False
    short = pair.reference if ends[0] < ends[1] else pair.candidate
    fall = short.outcome in TURNS
    return (
        f"{short.model} {'falls' if fall else 'ends'} at {min(ends):g} s, before {asked:g} s",
        fall,
    )


def _step(history: History) -> float:
    t = history.channels["t"]
    return float(t[-1] - t[0]) / (len(t) - 1) if len(t) > 1 else 0.0
