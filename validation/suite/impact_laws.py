"""The law of impacts in a suite: where a scene's motion depends on it, and figures held against the
reference under any law."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.validation.discrepancy.compare import Discrepancy, compare
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.impact_laws import Landing, parting_landing
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build, is_own
from rockcheck.validation.execute.store import COMPARISONS, Store, name_of
from rockcheck.validation.suite.suites import ModelVariant

#: What is judged by the nearest law. Histories are judged up to the horizon, which ends where the
#: laws part.
BY_ANY = ("outcome_agrees", "peak_ratio")


def landing_of(store: Store, scene: Scene) -> Landing | None:
    """The first landing of a scene at which the laws part, None without one; kept in the store."""
    if not may_fly(scene):
        return None
    code = provenance.code_digest("rockcheck.validation.discrepancy.impact_laws")
    name = name_of(
        scene.name,
        "impact-laws",
        provenance.cell_key(scene, "ebm-unilateral", {"of": "impact laws", "code": code}),
    )
    found = store.get_record(COMPARISONS, name)
    try:
        if found is not None:
            return None if found["landing"] is None else Landing.model_validate(found["landing"])
    except (KeyError, ValueError):
        pass  # what is kept is not trusted to have the fields that it must have
    try:
        landing = parting_landing(scene)
    except (InputError, ModelFailure):  # it is not a scene for that model
        landing = None
    store.put_record(
        COMPARISONS, name, {"landing": None if landing is None else landing.model_dump(mode="json")}
    )
    return landing


def under_other_laws(scene: Scene, variant: ModelVariant) -> dict[str, History]:
    """What a reference does under the other laws, by law; those under which it fails, or has no law
    to choose, are left out."""
    model = None if is_own(variant.family_name) else build(variant.family_name, variant.settings)
    found: dict[str, History] = {}
    if isinstance(model, EventBasedModel):
        for law in other_laws(model, walls=bool(scene.walls), flat=True):
            with suppress(ModelFailure):
                found[law] = model.model_copy(update={"impacts": law}).simulate(scene)
    return found


def by_any(
    found: Discrepancy,
    references: Mapping[str, History],
    candidate: History,
    scene: Scene,
    until: float | None,
    measures: Iterable[str],
) -> tuple[tuple[Figure, ...], dict[str, tuple[str, bool]]]:
    """The figures of a comparison, those of BY_ANY against the nearest of its reference and the
    `references` under other laws.

    A figure says so if its nearest law is another one. The second value says, by measure, what
    could not be compared under that law, and whether the reason is that one block fell.
    """
    figures = {figure.measure: figure for figure in found.figures}
    gaps: dict[str, tuple[str, bool]] = {}
    wanted = [measure for measure in measures if measure in BY_ANY]
    for law, reference in references.items():
        other = compare(reference, candidate, until=until, scene=scene, measures=wanted)
        for rival in other.figures:
            own = figures.get(rival.measure)
            if own is not None and _away(rival) < _away(own):
                note = f'{rival.note}; impacts = "{law}"' if rival.note else f'impacts = "{law}"'
                figures[rival.measure] = rival.model_copy(
                    update={"against": own.against, "window": own.window, "note": note}
                )
                gaps[rival.measure] = other.gap, other.fall
    return tuple(figures.values()), gaps


def _away(figure: Figure) -> float:
    """How far a figure is from its ideal; infinity where it has no value."""
    ideal = DIFFERENCES[figure.measure].ideal
    return float("inf") if figure.value is None or ideal is None else abs(figure.value - ideal)
