"""A cell's history compared with its references: the figures of each measure and window.

In: a history, the references' histories, and a `Request`. Out: a `ComparisonRecord`. Nothing here
knows a store; `runs` calls `compare_cell`, and keeps what it returns.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import other_laws
from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.validation.discrepancy import hints, impact_laws
from rockcheck.validation.discrepancy.compare import Discrepancy, compare, describe, gap_of
from rockcheck.validation.discrepancy.figures import Figure, Stored
from rockcheck.validation.execute import models

#: Measures judged by the nearest law of impacts. Histories are judged up to the horizon, which ends
#: where the laws part.
BY_NEAREST_LAW = ("outcome_agrees", "peak_ratio")


@dataclass(frozen=True)
class Reference:
    """A reference's history, and by law those under the other laws of impacts.

    `offset` (s) is what a measured history's model adds to its times; None of a model that plays.
    """

    history: History
    under_other_laws: Mapping[str, History] = field(default_factory=dict)
    offset: float | None = None


@dataclass(frozen=True)
class Request:
    """What a cell's comparison computes.

    `wanted` holds the names of measures by reference (`tolerances.CELL_FIGURES`: the history
    itself) and by window, `window_ends` the end of each window (s; "", the whole time, has none).
    `landing` is the scene's first at which the laws of impacts part, None without one. `offset` is
    that of `Reference`, of the cell's own history.
    """

    scene: Scene
    wanted: Mapping[str, Mapping[str, Sequence[str]]]
    window_ends: Mapping[str, float]
    landing: impact_laws.Landing | None
    offset: float | None = None


class ComparedFigure(NamedTuple):
    """A figure, and what of its window could not be compared: `fall` if because one block fell."""

    figure: Figure
    gap: str = ""
    fall: bool = False


class ComparisonRecord(Stored):
    """All figures of a cell: of its history itself, and against each reference.

    `hints` say what explains a large difference from a measured history.
    """

    figures: tuple[ComparedFigure, ...]
    hints: tuple[str, ...] = ()
    impact_law: impact_laws.LawFollowed | None = None
    overturned_at: float | None = None


def compare_cell(
    history: History, references: Mapping[str, Reference], request: Request
) -> ComparisonRecord:
    """The figures that a request wants of a history.

    A window without a row, or without one in common with the reference, has no figures.
    """
    figures: list[ComparedFigure] = []
    for against, windows in request.wanted.items():
        reference = references.get(against)
        for window in windows:
            with suppress(InputError):  # no row within the window, or none in common
                figures += _figures_in(history, reference, request, against, window)
    landing = request.landing
    return ComparisonRecord(
        figures=tuple(figures),
        hints=tuple(_hints(history, references, request)),
        impact_law=None if landing is None else landing.followed_by(history, request.scene),
        overturned_at=history.overturned_at,
    )


def _hints(
    history: History, references: Mapping[str, Reference], request: Request
) -> Iterator[str]:
    """What explains large differences between a measured history and another, one line each."""
    for against, reference in references.items():
        if request.offset is not None:
            measured, other, offset = history, reference.history, request.offset
        elif reference.offset is not None:
            measured, other, offset = reference.history, history, reference.offset
        else:
            continue
        with suppress(InputError):  # none in common
            hint = hints.hint(other, measured, scene=request.scene)
            if hint is not None:
                advice = f"offset = {offset + hint.shift:.4g}"
                yield f"against {against}: {hint.sentence('the measured history', advice)}"


def _figures_in(
    history: History, reference: Reference | None, request: Request, against: str, window: str
) -> list[ComparedFigure]:
    """The figures of one window; without a reference, those of the history itself."""
    measures = request.wanted[against][window]
    until = request.window_ends.get(window)
    if reference is None:
        return figures_of_history(history, request.scene, measures, window, until)
    if not _laws_matter(request.landing, until):
        reference = Reference(reference.history)
    return figures_against(history, reference, request.scene, measures, window, until)


def _laws_matter(landing: impact_laws.Landing | None, until: float | None) -> bool:
    """Whether the laws of impacts part before the end of a window (s; None: the whole time)."""
    if landing is None:
        return False
    return until is None or until > landing.t


def figures_of_history(
    history: History,
    scene: Scene,
    measures: Sequence[str],
    window: str = "",
    until: float | None = None,
) -> list[ComparedFigure]:
    """The measures of one history.

    The window, as tolerances name it, ends at `until` (s; None: the whole time). Raises
    `InputError` where the history has no row in it.
    """
    gap, fall = gap_of((history,), until)
    return [
        ComparedFigure(figure.model_copy(update={"window": window}), gap, fall)
        for figure in describe(history, until=until, scene=scene, measures=measures)
    ]


def figures_against(
    history: History,
    reference: Reference,
    scene: Scene,
    measures: Sequence[str],
    window: str = "",
    until: float | None = None,
) -> list[ComparedFigure]:
    """The measures of a history against a reference, `BY_NEAREST_LAW` ones under the nearest law.

    The note of a figure names the law if it is another than the reference's own. The window is that
    of `figures_of_history`. Raises `InputError` where the two have no time in common in it.
    """
    under_usual_law = compare(
        reference.history, history, until=until, scene=scene, measures=measures
    )
    by_law = [measure for measure in measures if measure in BY_NEAREST_LAW]
    under_laws = {
        f'impacts = "{law}"': compare(other, history, until=until, scene=scene, measures=by_law)
        for law, other in reference.under_other_laws.items()
    }
    compared = []
    for figure in under_usual_law.figures:
        law, nearest = "", under_usual_law
        if figure.measure in BY_NEAREST_LAW:
            law, nearest = _nearest_law(figure.measure, {"": under_usual_law, **under_laws})
        under_law = nearest.figure(figure.measure)
        notes = [note for note in (under_law.note, law) if note]
        change = {"against": figure.against, "note": "; ".join(notes), "window": window}
        compared.append(
            ComparedFigure(under_law.model_copy(update=change), nearest.gap, nearest.fall)
        )
    return compared


def _nearest_law(measure: str, under_laws: Mapping[str, Discrepancy]) -> tuple[str, Discrepancy]:
    """The law under which a measure is nearest to 1, the perfect value; the first of equal ones."""

    def distance(law: str) -> float:
        value = under_laws[law][measure]
        return math.inf if math.isnan(value) else abs(value - 1.0)

    law = min(under_laws, key=distance)
    return law, under_laws[law]


def histories_under_other_laws(scene: Scene, variant: models.Work) -> dict[str, History]:
    """A reference's histories under the other laws of impacts, by law.

    Laws under which it fails are left out. Empty for a model without a choice of law.
    """
    if models.is_own(variant.family):
        return {}
    model = models.build(variant.family, variant.settings)
    if not isinstance(model, EventBasedModel):
        return {}
    histories: dict[str, History] = {}
    for law in other_laws(model, walls=bool(scene.walls), flat=True):
        with suppress(ModelFailure):
            histories[law] = model.model_copy(update={"impacts": law}).simulate(scene)
    return histories
