"""The law of impacts in a suite: where a scene's motion depends on it, and figures held against the reference under either law."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import other_law
from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.validation.discrepancy.compare import Discrepancy, compare
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.impact_laws import FlushLanding, flush_landing
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build, is_own
from rockcheck.validation.execute.store import COMPARISONS, Store, name_of
from rockcheck.validation.suite.suites import ModelVariant

#: What is judged by the nearer law. Histories are judged up to the horizon, which ends where the laws part.
BY_EITHER = ("outcome_agrees", "peak_ratio")


def landing_of(store: Store, scene: Scene) -> FlushLanding | None:
    """The first landing of a scene at which the laws part, None without one; kept in the store."""
    if not any(wall.restitution > 0.0 for wall in scene.walls):
        return None
    code = provenance.code_digest("rockcheck.validation.discrepancy.impact_laws")
    name = name_of(scene.name, "impact-laws", provenance.cell_key(scene, "ebm-unilateral", {"of": "impact laws", "code": code}))
    found = store.get_record(COMPARISONS, name)
    try:
        if found is not None:
            return None if found["landing"] is None else FlushLanding.model_validate(found["landing"])
    except (KeyError, ValueError):
        pass  # what is kept is not trusted to have the fields that it must have
    try:
        landing = flush_landing(scene)
    except (InputError, ModelFailure):  # it is not a scene for that model
        landing = None
    store.put_record(COMPARISONS, name, {"landing": None if landing is None else landing.model_dump(mode="json")})
    return landing


def under_the_other_law(scene: Scene, variant: ModelVariant) -> tuple[str, History] | None:
    """The other law and what a reference does under it; None where the variant has no law of impacts to choose, or fails."""
    model = None if is_own(variant.family_name) else build(variant.family_name, variant.settings)
    if not (isinstance(model, EventBasedModel) and model.pivot == "unilateral"):
        return None
    law = other_law(model)
    try:
        return law, model.model_copy(update={"impacts": law}).simulate(scene)
    except ModelFailure:
        return None


def by_either(
    found: Discrepancy, law: str, reference: History, candidate: History, scene: Scene, until: float | None, measures: Iterable[str]
) -> tuple[tuple[Figure, ...], dict[str, tuple[str, bool]]]:
    """The figures of a comparison, those of BY_EITHER against the nearer of its reference and the one under the other `law`.

    A figure says so if its nearer law is the other one. The second value says, by measure, what could not be compared under that
    law, and whether the reason is that one block fell.
    """
    wanted = [measure for measure in measures if measure in BY_EITHER]
    other = compare(reference, candidate, until=until, scene=scene, measures=wanted)
    figures: list[Figure] = []
    gaps: dict[str, tuple[str, bool]] = {}
    for figure in found.figures:
        rival = _of(figure.measure, other.figures)
        if rival is not None and _away(rival) < _away(figure):
            note = f'{rival.note}; impacts = "{law}"' if rival.note else f'impacts = "{law}"'
            figure = rival.model_copy(update={"against": figure.against, "window": figure.window, "note": note})
            gaps[figure.measure] = other.gap, other.fall
        figures.append(figure)
    return tuple(figures), gaps


def _of(measure: str, figures: Sequence[Figure]) -> Figure | None:
    return next((figure for figure in figures if figure.measure == measure), None)


def _away(figure: Figure) -> float:
    """How far a figure is from its ideal; infinity where it has no value."""
    ideal = DIFFERENCES[figure.measure].ideal
    return float("inf") if figure.value is None or ideal is None else abs(figure.value - ideal)
