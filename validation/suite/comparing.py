"""A suite's planned cells, their comparisons and the uncertainty of their figures.

Figures are taken against references under any law of impacts. Computed once and kept: the horizon,
the landing at which laws part, and the effect of a spread of inputs on figures. The uncertainty
sets a cell's difference from each reference against u_num, u_input and u_D (ASME V&V 20).
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

from pydantic import TypeAdapter

from rockcheck.ebm import EventBasedModel, predictability_horizon
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.scenes import History, InputError, ModelFailure, NonNegative, Scene, files
from rockcheck.validation.discrepancy import impact_laws
from rockcheck.validation.discrepancy.compare import compare, describe, too_short
from rockcheck.validation.discrepancy.figures import Figure, Measure, Stored
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.execute.store import COMPARISONS, Store, name_of
from rockcheck.validation.study import Task
from rockcheck.validation.suite import motions, results, tolerances
from rockcheck.validation.uncertainty import population
from rockcheck.validation.uncertainty.numerical import INPUTS, Explanation, Numerical, explain

T = TypeVar("T")
#: Measures judged by the nearest law. Histories are judged up to the horizon, which ends where the
#: laws part.
BY_ANY = ("outcome_agrees", "peak_ratio")


@dataclass(frozen=True)
class Planned(Task):
    """A cell to be played: a scene, or the scenes `numbers` of an `ensemble`, by a model.

    An ensemble's scenes are drawn from `scene`. `place` is the name of the scene, or of the
    ensemble. `key` is the hash of all that the result depends on.
    """

    place: str = field(compare=False)
    scene: Scene = field(compare=False)
    variant: models.Work = field(compare=False)
    model: str
    key: str
    uncertainty: bool = field(default=False, compare=False)
    ensemble: motions.Ensemble | None = field(default=None, compare=False)
    numbers: range = field(default=range(0), compare=False)

    @property
    def name(self) -> str:
        """Name of its files."""
        part = [f"{self.numbers.start}"] if self.ensemble else []
        return name_of(self.place, self.variant.label, *part, self.key)

    @property
    def label(self) -> str:
        """Scene and model; of an ensemble the first scene, too."""
        part = f", from {self.numbers.start}" if self.ensemble else ""
        return f"{self.place}, {self.variant.label}{part}"

    def play(self) -> models.Played:
        """The history, or the peaks of a batch."""
        if self.ensemble is None:
            played = models.play(self.variant, self.scene, uncertainty=self.uncertainty)
        else:
            played = models.play_batch(
                self.variant, [self.ensemble.drawn(self.scene, n) for n in self.numbers]
            )
        self.record(played.record)  # a user-defined model's history may say nonsense
        return played

    def record(self, given: Mapping[str, Any]) -> "CellRecord | BatchRecord":
        """The record of what was played or kept; raises `InputError` where it is none."""
        return BatchRecord(**given) if self.ensemble else CellRecord(**given)


#: Reference cell, or None for a cell's own measures; and extra measures, over a window or on
#: request.
Asked = tuple[Planned | None, list[str]]


class CellRecord(Stored):
    """The kept record of a cell, beside its history."""

    outcome: str
    notes: tuple[str, ...]
    settings: dict[str, Any]
    uncertainty: dict[str, NonNegative]
    numerical: Numerical | None
    cost: results.CostRecord


class BatchRecord(Stored):
    """The kept record of a batch: peak |theta| in alpha and outcome of each scene.

    None and the reason where the model failed.
    """

    peaks: tuple[float | None, ...]
    outcomes: tuple[str, ...]
    cost: results.CostRecord


class Compared(NamedTuple):
    """A figure, and what of its window could not be compared: `fall` if because one block fell."""

    figure: Figure
    gap: str = ""
    fall: bool = False


class ComparisonRecord(Stored):
    """All figures of a cell, its own and those against each reference."""

    figures: tuple[Compared, ...]
    impact_law: impact_laws.LawFollowed | None = None
    overturned_at: float | None = None


def kept(store: Store, name: str, kind: Any, compute: Callable[[], T]) -> T:
    """The store's value of type `kind` under that name; computed and kept if missing or invalid."""
    adapter: TypeAdapter[T] = TypeAdapter(kind)
    with suppress(KeyError, TypeError, ValueError):
        return adapter.validate_python((store.get_record(COMPARISONS, name) or {})["kept"])
    found = compute()
    store.put_record(COMPARISONS, name, {"kept": adapter.dump_python(found, mode="json")})
    return found


def _of_scene(
    store: Store,
    scene: Scene,
    what: str,
    module: str,
    kind: Any,
    compute: Callable[[], T],
    **more: Any,
) -> T:
    """A result of type `kind` on a scene, by the code of a module; kept in the store."""
    depends = {"of": what, "code": provenance.code_digest(f"rockcheck.{module}"), **more}
    key = provenance.cell_key(scene, models.REFERENCE, depends)
    return kept(store, name_of(scene.name, what, key), kind, compute)


def inputs_of(store: Store, given: files.UncertainScene) -> population.Inputs:
    """The effect of the spread of a scene's inputs on its figures; kept in the store."""
    return _of_scene(
        store,
        given.scene,
        "inputs",
        "validation.uncertainty.population",
        population.Inputs,
        lambda: population.propagate(given),
        spreads={name: spread.model_dump() for name, spread in given.spreads.items()},
        correlation=given.correlation.tolist(),
    )


def landing_of(store: Store, scene: Scene) -> impact_laws.Landing | None:
    """The first landing of a scene at which the laws part, None without one; kept in the store."""

    def landing() -> impact_laws.Landing | None:
        with suppress(InputError, ModelFailure):  # it is not a scene for that model
            return impact_laws.parting_landing(scene)
        return None

    if not may_fly(scene):
        return None
    return _of_scene(
        store,
        scene,
        "impact-laws",
        "validation.discrepancy.impact_laws",
        impact_laws.Landing | None,
        landing,
    )


def under_other_laws(scene: Scene, variant: models.Work) -> dict[str, History]:
    """A reference's histories under the other laws of impacts, by law.

    Laws under which it fails are left out. Empty for a model without a choice of law.
    """
    model = (
        None if models.is_own(variant.family) else models.build(variant.family, variant.settings)
    )
    found: dict[str, History] = {}
    if isinstance(model, EventBasedModel):
        for law in other_laws(model, walls=bool(scene.walls), flat=True):
            with suppress(ModelFailure):
                found[law] = model.model_copy(update={"impacts": law}).simulate(scene)
    return found


def by_any(
    candidate: History,
    reference: History | None,
    others: Mapping[str, History],
    scene: Scene,
    measures: Sequence[str],
    window: str = "",
    until: float | None = None,
) -> Iterator[Compared]:
    """A history's figures against `reference`, those of BY_ANY against it under the nearest law.

    `others` are the reference's histories under other laws. The note of a figure names the law if
    it is another one. Without a reference, the history's own figures. Of a window, as tolerances
    name it, that ends at `until` (s; None: the whole time).
    """
    if reference is None:
        gap = too_short(candidate, until)
        for one in describe(candidate, until=until, scene=scene, measures=measures):
            yield Compared(one.model_copy(update={"window": window}), gap)
        return
    wanted = [measure for measure in measures if measure in BY_ANY]
    found = {"": compare(reference, candidate, until=until, scene=scene, measures=measures)} | {
        f'impacts = "{law}"': compare(history, candidate, until=until, scene=scene, measures=wanted)
        for law, history in others.items()
    }
    for first in found[""].figures:
        rivals = {law: one for law, one in found.items() if not law or first.measure in BY_ANY}
        law = min(rivals, key=lambda law: _away(rivals[law].figure(first.measure)))
        nearest = found[law].figure(first.measure)
        change = {
            "against": first.against,
            "note": "; ".join(filter(None, (nearest.note, law))),
            "window": window,
        }
        yield Compared(nearest.model_copy(update=change), found[law].gap, found[law].fall)


def _away(figure: Figure) -> float:
    ideal = DIFFERENCES[figure.measure].ideal
    return math.inf if figure.value is None or ideal is None else abs(figure.value - ideal)


def compared(store: Store, planned: Planned, asked: Mapping[str, Asked]) -> ComparisonRecord:
    """The comparisons of a cell; `asked` by name of the reference, OWN_FIGURES for its own figures.

    Kept in the store. Each has all figures over the whole time, and those `asked` over a window.
    """
    horizon = None  # s; up to it, histories can be compared point by point
    if any(
        what.endswith(f"@{tolerances.HORIZON}") for _, extra in asked.values() for what in extra
    ):
        horizon = _of_scene(
            store,
            planned.scene,
            tolerances.HORIZON,
            "ebm.horizon",
            float,
            lambda: predictability_horizon(planned.scene),
        )
    against = [
        [name, reference.key if reference else "", extra]
        for name, (reference, extra) in asked.items()
    ]
    # with the code of this module and of `compare`
    depends = [planned.key, against, horizon, provenance.code_digest(__name__)]
    name = name_of(planned.place, planned.model, provenance.digest(json.dumps(depends)))
    return kept(store, name, ComparisonRecord, lambda: _compute(store, planned, asked, horizon))


def _compute(
    store: Store, planned: Planned, asked: Mapping[str, Asked], horizon: float | None
) -> ComparisonRecord:
    candidate, scene = store.load(planned.name), planned.scene
    landing = landing_of(store, scene)
    parted = landing.t if landing else math.inf
    figures: list[Compared] = []
    for reference, extra in asked.values():
        yardstick = store.load(reference.name) if reference else None
        others = under_other_laws(scene, reference.variant) if reference and landing else {}
        known = DIFFERENCES if reference else FIGURES
        for window, until, measures in _windows(known, extra, horizon):
            rivals = others if until is None or until > parted else {}
            figures += by_any(candidate, yardstick, rivals, scene, measures, window, until)
    return ComparisonRecord(
        figures=tuple(figures),
        impact_law=landing.followed_by(candidate, scene) if landing else None,
        overturned_at=candidate.overturned_at,
    )


def _windows(
    known: Mapping[str, Measure], extra: Iterable[str], horizon: float | None
) -> list[tuple[str, float | None, list[str]]]:
    """The whole time with all measures but those on request, and the windows of `extra`."""
    found = {"": [name for name, measure in known.items() if not measure.on_request]}
    for what in extra:
        name, _, window = what.partition("@")
        found.setdefault(window, []).append(name)
    ends = {"": None, tolerances.HORIZON: horizon}
    return [
        (window, ends[window] if window in ends else float(window[:-1]), measures)
        for window, measures in found.items()
    ]


#: Quantities whose differences are explained, with their units.
QUANTITIES = {"theta_rms": "alpha", "peak_rotation": "alpha", "last_slip": "m"}


def explanations(
    scene: Scene,
    cell: results.Cell,
    references: Iterable[results.Cell],
    scatters: Mapping[str, Mapping[str, float]],
    inputs: population.Inputs | None,
) -> Iterator[Explanation]:
    """The verdict on each quantity of a cell against each reference.

    `scatters` is, by model, the scatter of the repeats of a measured history: rotations in rad,
    slips in m. There is no verdict for a model whose numerical error is unknown. Where the outcomes
    differ and a block falls, the only verdict is on the outcome.
    """
    if cell.numerical is None:
        return
    sizes = {"alpha": scene.block.alpha, "m": 1.0}
    u_inputs = {name: inputs.u_input(name) or 0.0 for name in QUANTITIES} if inputs else {}
    for other in references:
        if cell.outcome != other.outcome and "overturned" in cell.outcome + other.outcome:
            yield _other_outcome(other.model, cell.numerical, other.numerical, inputs)
            continue
        for name, unit in QUANTITIES.items():
            error = _difference(name, cell.figures, other)
            if error is None:
                continue
            u_num, reason = _both(name, cell.numerical, other.numerical)
            own, theirs = scatters[cell.model].get(name, 0.0), scatters[other.model].get(name, 0.0)
            yield explain(
                name,
                unit,
                error,
                u_num,
                u_inputs.get(name, 0.0),
                math.hypot(own / sizes[unit], theirs / sizes[unit]),
                reason=reason,
                against=other.model,
            )


def _difference(name: str, figures: Sequence[Figure], other: results.Cell) -> float | None:
    if name == "theta_rms":
        return results.value_of(figures, name, other.model)
    mine, theirs = results.value_of(figures, name), results.value_of(other.figures, name)
    return None if mine is None or theirs is None else abs(mine - theirs)


def _other_outcome(
    against: str, mine: Numerical, other: Numerical | None, inputs: population.Inputs | None
) -> Explanation:
    """The verdict on two different outcomes; a falling block's peaks and slips do not compare."""
    reasons = [reason for found in (mine, other) if found for reason in found.reasons]
    if reasons:
        return explain("outcome", "", None, None, reason="; ".join(reasons), against=against)
    both_occur = inputs is not None and 0.0 < inputs.overturns.value < 1.0  # among the draws
    verdict = INPUTS if both_occur else "not explained: model form or set-up, another outcome"
    return Explanation(
        quantity="outcome", unit="", against=against, error=1.0, u_num=0.0, verdict=verdict
    )


def _both(name: str, mine: Numerical, other: Numerical | None) -> tuple[float | None, str]:
    """The combined numerical uncertainty of both runs; None and the reason if one is unknown."""
    known = [found for found in (mine, other) if found]
    parts = [found.u_num(name) for found in known]
    if None in parts:
        return None, known[parts.index(None)].reason(name)
    return math.hypot(*(u for u in parts if u is not None)), ""
