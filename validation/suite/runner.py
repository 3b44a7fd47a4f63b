"""Runs a suite: plays the cells that are not up to date, compares, judges, and returns the `Run`."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import field_validator

from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.discrepancy.compare import compare, describe, evaluate, too_short
from rockcheck.validation.discrepancy.figures import Figure, MeasureRecord, Stored
from rockcheck.validation.discrepancy.impact_laws import LawFollowed
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES
from rockcheck.validation.discrepancy.statistics import STATISTICS, Sample, Samples
from rockcheck.validation.execute import provenance, workers
from rockcheck.validation.execute.models import is_own, not_installed
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, TABLE, Store, name_of
from rockcheck.validation.suite.confidence import explanations, inputs_of, key_of, numerical_of
from rockcheck.validation.suite.ensembles import Ensemble
from rockcheck.validation.suite.impact_laws import by_either, landing_of, under_the_other_law
from rockcheck.validation.suite.results import Cell, CostRecord, EnsembleRecord, Run
from rockcheck.validation.suite.suites import ModelVariant, Suite
from rockcheck.validation.suite.tolerances import HORIZON, MEASURES, OWN_FIGURES, Place, Windowed, judge
from rockcheck.validation.uncertainty.numerical import Numerical
from rockcheck.validation.uncertainty.population import Inputs

FAULTS = "faults"
#: Plays tasks somewhere: yields (index, result) as they end.
Executor = Callable[..., Iterator[tuple[int, workers.TaskResult]]]


@dataclass(frozen=True, eq=False)
class PlannedCell:
    """A cell of the suite before it is played: scene, model, and the key of all that it depends on."""

    scene: Scene
    variant: ModelVariant
    key: str

    @property
    def place(self) -> str:
        """Name of the scene."""
        return self.scene.name

    @property
    def name(self) -> str:
        """Name of its files."""
        return name_of(self.scene.name, self.variant.label, self.key)


@dataclass(frozen=True, eq=False)
class PlannedBatch:
    """Some scenes of an ensemble, for one model, before they are played."""

    ensemble: Ensemble
    base: Scene
    variant: ModelVariant
    numbers: range
    key: str

    @property
    def place(self) -> str:
        """Name of the ensemble."""
        return self.ensemble.name

    @property
    def name(self) -> str:
        """Name of its file."""
        return name_of(self.ensemble.name, self.variant.label, f"{self.numbers.start}", self.key)


Planned = PlannedCell | PlannedBatch
#: What a cell is compared with, None for its own figures; and the measures that are asked for over a window, or on request.
Asked = tuple[PlannedCell | None, list[Windowed]]


class CellRecord(Stored):
    """What is kept of a cell beside its history."""

    outcome: str
    notes: tuple[str, ...]
    settings: dict[str, Any]
    uncertainty: dict[str, Any]
    numerical: Numerical | None
    cost: CostRecord


class BatchRecord(Stored):
    """What is kept of a batch: peak |theta| in alpha and outcome of each scene, None and the reason where the model failed."""

    peaks: tuple[float | None, ...]
    outcomes: tuple[str, ...]
    cost: CostRecord


#: A figure as it is kept: measure, unit, value, window, until, note. Its label is the measure's.
FigureRow = tuple[str, str, float | None, str, float | None, str]


class ComparisonRecord(Stored):
    """The figures of a comparison; by window, what could not be compared, and whether because one block fell.

    What could not be compared is given by measure and window where a measure has its own. `impact_law` and `overturned_at` are those of
    a cell's own figures.
    """

    figures: tuple[FigureRow, ...]
    gaps: dict[str, tuple[str, bool]]
    impact_law: LawFollowed | None = None
    overturned_at: float | None = None

    @field_validator("figures")
    @classmethod
    def _known(cls, rows: tuple[FigureRow, ...]) -> tuple[FigureRow, ...]:
        if unknown := {row[0] for row in rows} - MEASURES.keys():
            raise ValueError(f"unknown measures: {', '.join(sorted(unknown))}")
        return rows

    def figures_against(self, name: str) -> list[Figure]:
        """The figures, `name` being the reference's or OWN_FIGURES."""
        against = "" if name == OWN_FIGURES else name
        return [
            Figure(
                measure=measure,
                label=MEASURES[measure].label,
                unit=unit,
                value=value,
                against=against,
                window=window,
                until=until,
                note=note,
            )
            for measure, unit, value, window, until, note in self.figures
        ]


class CellComparisons(Stored):
    """What is kept of a cell's comparisons: by the name of the reference, and by OWN_FIGURES its own figures."""

    of: dict[str, ComparisonRecord]


def _is(kind: type[Stored], found: Mapping[str, Any] | None) -> bool:
    """Whether what was read back has the fields that it must have."""
    try:
        return found is not None and bool(kind.model_validate(found))
    except ValueError:
        return False


def run_suite(
    suite: Suite,
    folder: Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    strict: bool = False,
    play: Executor = workers.local,
    on_progress: OnProgress = unheard,
) -> Run:
    """Play, compare and judge every cell of a suite; results are kept in `folder` and read back while up to date.

    A cell that fails is a failed cell of the run, never an exception. Raises `InputError` where `folder` cannot be used.
    """
    began = time.perf_counter()
    try:
        store = Store(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be used as the output folder: {error.strerror}") from None
    planned_cells = [
        PlannedCell(scene, variant, _key(scene, replace(variant, settings={**variant.settings, **key_of(_asks(suite, scene))})))
        for scene, variant in suite.cells()
    ]
    batches = [batch for found in suite.ensemble_cells() for batch in _batches(*found)]
    items: list[Planned] = [*planned_cells, *batches]
    records: dict[Planned, dict[str, Any]] = {}
    failures: dict[Planned, str] = {}
    faults: dict[tuple[str, str], dict[str, Any]] = {}
    if not force:
        for item in items:
            found = store.get(item.name) if isinstance(item, PlannedCell) else store.get_record(COMPARISONS, item.name)
            if _is(CellRecord if isinstance(item, PlannedCell) else BatchRecord, found):
                records[item] = found or {}
    read_back = set(records)
    failures |= {item: missing for item in items if (missing := not_installed(item.variant.family_name))}
    waiting = [item for item in items if item not in records and item not in failures]
    on_progress(len(records), len(items), f"{len(records)} up to date")
    limits = [suite.suite_of(item.place).limits for item in waiting]
    by_place = {(planned.scene.name, planned.variant.label): planned for planned in planned_cells}
    compared: dict[PlannedCell, Cell] = {}
    by_scene = {scene: list(of) for scene, of in groupby(planned_cells, key=lambda planned: planned.scene.name)}
    for index, result in play(
        [_task(item, suite) for item in waiting],
        jobs=jobs or os.cpu_count() or 1,
        seconds=[limit.seconds for limit in limits],
        memory_mb=max((limit.memory_mb for limit in limits), default=0.0),
    ):
        item = waiting[index]
        if result.traceback:
            faults[item.place, item.variant.label] = _fault(item, result.traceback, folder)
        if result.failure:
            failures[item] = result.failure
        elif result.traceback:
            records[item] = result.record  # some scenes of a batch: not to be read back
        else:
            records[item] = result.record
            if isinstance(item, PlannedCell):
                store.put(item.name, result.files, result.record, result.history)
            else:
                store.put_record(COMPARISONS, item.name, result.record)
        on_progress(len(records) + len(failures), len(items), f"{item.place}, {item.variant.label}")
        of_scene = by_scene.get(item.place, [])
        if all(planned in records or planned in failures for planned in of_scene):  # compared while others play
            for planned in of_scene:
                compared[planned] = _cell(suite, planned, by_place, records, failures, store, planned in read_back)
    inputs = {name: inputs_of(store, given) for name, given in suite.uncertain.items()}
    cells = [
        compared.get(planned) or _cell(suite, planned, by_place, records, failures, store, planned in read_back)
        for planned in planned_cells
    ]
    ensembles, ensemble_cells = _ensembles(suite, batches, records, failures, read_back)
    beside = {name: list(of) for name, of in groupby(cells, key=lambda cell: cell.scene)}
    cells = [_explained(suite, cell, beside[cell.scene], by_place, records, inputs.get(cell.scene)) for cell in cells] + ensemble_cells
    cells = [cell.model_copy(update=faults.get((cell.scene, cell.model), {})) for cell in cells]
    store.prune()
    return Run(
        suite=suite.name,
        description=suite.description,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        reference=suite.reference,
        model_form=suite.model_form,
        scenes={name: scene.model_dump(mode="json") for name, scene in suite.scenes.items()},
        models=tuple(suite.models),
        cells=tuple(cells),
        ensembles=tuple(ensembles),
        inputs=inputs,
        printed=tuple(name for name in suite.scenes if suite.suite_of(name).print_figures),
        faults=_without_cell(suite, {(cell.scene, cell.model) for cell in cells}),
        measures=tuple(MeasureRecord(name=m.name, label=m.label, unit=m.unit, formula=m.formula) for m in MEASURES.values()),
        versions=provenance.versions(),
        hardware=provenance.hardware(),
        wall_seconds=time.perf_counter() - began,
        strict=strict,
        judged=suite.judged,
        tolerances_file=str(suite.tolerances_path),
    )


def _fault(item: Planned, traceback: str, folder: Path) -> dict[str, Any]:
    """Keeps the traceback of an exception that no model may raise; returns what the cell says of it. In a user's own model it is that
    model's fault, not rockcheck's."""
    (folder / FAULTS).mkdir(exist_ok=True)
    path = write_whole(folder / FAULTS / f"{item.name}.txt", traceback)
    return {"traceback": f"{FAULTS}/{path.name}", "unexpected": not is_own(item.variant.family_name)}


def _key(scene: Scene, variant: ModelVariant) -> str:
    return provenance.cell_key(scene, variant.family_name, variant.settings, variant.search_path)


def _batches(ensemble: Ensemble, base: Scene, variant: ModelVariant) -> Iterator[PlannedBatch]:
    """An ensemble in batches. A batch's key covers how its scenes are drawn, so it can be looked up without drawing them."""
    drawing = {
        "ensemble": ensemble.model_dump(mode="json", exclude={"count", "batch", "description"}),
        "code": provenance.code_digest("rockcheck.validation.suite.ensembles"),
    }
    for start in range(0, ensemble.count, ensemble.batch):
        numbers = range(start, min(start + ensemble.batch, ensemble.count))
        settings = {**variant.settings, "drawn": {**drawing, "numbers": [numbers.start, numbers.stop]}}
        yield PlannedBatch(ensemble, base, variant, numbers, _key(base, replace(variant, settings=settings)))


def _asks(suite: Suite, scene: Scene) -> bool:
    """Whether the suite that a scene comes from asks for numerical uncertainties."""
    return suite.suite_of(scene.name).uncertainty


def _task(item: Planned, suite: Suite) -> workers.Task | workers.BatchTask:
    variant = item.variant
    model: dict[str, Any] = {
        "label": variant.label,
        "family": variant.family_name,
        "settings": dict(variant.settings),
        "search_path": variant.search_path,
    }
    if isinstance(item, PlannedCell):
        return workers.Task(scene=item.scene, uncertainty=_asks(suite, item.scene), **model)
    return workers.BatchTask(scenes=tuple(item.ensemble.drawn(item.base, n) for n in item.numbers), **model)


def _ensembles(
    suite: Suite,
    batches: Sequence[PlannedBatch],
    records: Mapping[Planned, Mapping[str, Any]],
    failures: Mapping[Planned, str],
    read_back: Container[Planned],
) -> tuple[list[EnsembleRecord], list[Cell]]:
    """The ensembles with all peaks and outcomes, and a cell for each of them and each model."""
    ensembles: list[EnsembleRecord] = []
    cells: list[Cell] = []
    for ensemble, of_ensemble in groupby(batches, key=lambda batch: batch.ensemble):
        by_model = {label: list(found) for label, found in groupby(of_ensemble, key=lambda batch: batch.variant.label)}
        samples: dict[str, Sample] = {}
        for label, parts in by_model.items():
            got = [records.get(b) or {"peaks": [None] * len(b.numbers), "outcomes": [failures[b]] * len(b.numbers)} for b in parts]
            peaks = [math.nan if peak is None else peak for record in got for peak in record["peaks"]]
            samples[label] = Sample(np.array(peaks), tuple(outcome for record in got for outcome in record["outcomes"]))
        ensembles.append(
            EnsembleRecord(
                name=ensemble.name,
                description=ensemble.description,
                definition=ensemble.model_dump(mode="json", exclude_none=True),
                peaks={label: tuple(peak if math.isfinite(peak) else None for peak in sample.peaks) for label, sample in samples.items()},
                outcomes={label: tuple(sample.outcomes) for label, sample in samples.items()},
            )
        )
        cells += [_ensemble_cell(suite, ensemble, by_model[label], samples, records, read_back) for label in samples]
    return ensembles, cells


def _ensemble_cell(
    suite: Suite,
    ensemble: Ensemble,
    batches: Sequence[PlannedBatch],
    samples: Mapping[str, Sample],
    records: Mapping[Planned, Mapping[str, Any]],
    read_back: Container[Planned],
) -> Cell:
    variant = batches[0].variant
    own, origin = samples[variant.label], suite.suite_of(ensemble.name)
    costs = [records[batch]["cost"] for batch in batches if batch in records]
    about: dict[str, Any] = {
        "scene": ensemble.name,
        "model": variant.label,
        "key": provenance.digest("".join(batch.key for batch in batches)),
        "settings": dict(variant.settings),
        "read_back": all(batch in read_back for batch in batches),
        "cost": CostRecord(**{key: sum(cost[key] for cost in costs) for key in (costs[0] if costs else ())}),
    }
    if missing := not_installed(variant.family_name):
        return Cell(**about, status="absent", reason=missing)
    if own.failures:
        reason = next(outcome for peak, outcome in zip(own.peaks, own.outcomes, strict=True) if not math.isfinite(peak))
        return Cell(**about, status="failed", reason=f"{own.failures} of {len(own.peaks)} scenes failed; the first: {reason}")
    required = origin.required(ensemble.name, variant.label)
    figures = [
        evaluate(measure, Samples(samples[name], own), "alpha", against=name)
        for name in dict.fromkeys([origin.reference, origin.model_form, *(place.against for place in required)])
        if name in samples and name != variant.label
        for measure in STATISTICS.values()
    ]
    checks = [
        judge(_figure(figures, place), origin.tolerances.get(place), kind=kind, measure=place.what.definition)
        for place, kind in required.items()
    ]
    outcome = f"{int(np.sum(own.fallen))} of {len(own.peaks)} overturned"
    return Cell(**about, status="done", outcome=outcome, figures=tuple(figures), checks=tuple(checks))


def _without_cell(suite: Suite, cells: Container[tuple[str, str]]) -> tuple[str, ...]:
    """Tolerances that nothing in the suite can meet."""
    return tuple(f"tolerance [{place}] has no cell in the suite" for place in suite.tolerances if (place.scene, place.model) not in cells)


def _cell(
    suite: Suite,
    planned: PlannedCell,
    planned_cells: Mapping[tuple[str, str], PlannedCell],
    records: Mapping[Planned, Mapping[str, Any]],
    failures: Mapping[Planned, str],
    store: Store,
    read_back: bool,
) -> Cell:
    """The finished cell: its figures, compared with each reference, and the verdicts on them."""
    scene, label = planned.scene, planned.variant.label
    about: dict[str, Any] = {"scene": scene.name, "model": label, "key": planned.key, "read_back": read_back}
    if planned in failures:
        about["status"] = "absent" if not_installed(planned.variant.family_name) else "failed"
        return Cell(**about, reason=failures[planned], settings=dict(planned.variant.settings))
    record = records[planned]
    required = suite.required(scene.name, label)
    own = suite.suite_of(scene.name)
    asked: dict[str, Asked] = {}
    for name in dict.fromkeys([OWN_FIGURES, own.reference, own.model_form, *(place.against for place in required)]):
        reference = None if name == OWN_FIGURES else planned_cells.get((scene.name, name))
        if name == OWN_FIGURES or (reference is not None and reference is not planned and reference in records):
            extra = sorted(p.what for p in required if p.against == name and (p.what.window or p.what.definition.on_request))
            asked[name] = reference, extra
    found = _compared(store, scene, planned, asked)
    figures = [figure for name, one in found.items() for figure in one.figures_against(name)]
    gaps = {(name, window): gap for name, one in found.items() for window, gap in one.gaps.items()}
    checks = []
    for place, kind in required.items() if suite.judged else ():
        figure = _figure(figures, place)
        of_window = gaps.get((place.against, place.what.window), ("", False))
        text, fall = gaps.get((place.against, str(place.what)), of_window)
        gap = "" if fall and kind == "model form" else text
        if gap and kind == "measured" and not fall:
            gap += "; `offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
        checks.append(judge(figure, own.tolerances.get(place), kind=kind, measure=place.what.definition, gap=gap))
    return Cell(
        **about,
        status="done",
        settings=record["settings"],
        history=f"{HISTORIES}/{planned.name}{TABLE}",
        outcome=record["outcome"],
        overturned_at=found[OWN_FIGURES].overturned_at,
        notes=tuple(record["notes"]),
        cost=CostRecord(**record["cost"]),
        figures=tuple(figures),
        checks=tuple(checks),
        numerical=numerical_of(record),
        impact_law=found[OWN_FIGURES].impact_law,
    )


def _explained(
    suite: Suite,
    cell: Cell,
    cells: Sequence[Cell],
    planned: Mapping[tuple[str, str], PlannedCell],
    records: Mapping[Planned, Mapping[str, Any]],
    inputs: Inputs | None,
) -> Cell:
    """The cell with the verdicts on its differences from the references among `cells`, of its scene, that finished; unchanged where
    nothing is known."""
    own = suite.suite_of(cell.scene)
    if cell.numerical is None:
        return cell
    others = {
        other.model: other
        for other in cells
        if other.model in (own.reference, own.model_form) and other.model != cell.model and other.status == "done"
    }
    found = explanations(
        own.scenes[cell.scene],
        cell.figures,
        {name: other.figures for name, other in others.items()},
        {name: records[planned[cell.scene, name]] for name in others},
        records[planned[cell.scene, cell.model]],
        inputs,
    )
    return cell.model_copy(update={"explanations": tuple(found)})


def _figure(figures: Sequence[Figure], place: Place) -> Figure:
    """The figure that a check is about; one without value where it is missing, so that the check cannot pass."""
    against = "" if place.against == OWN_FIGURES else place.against
    for figure in figures:
        if (figure.measure, figure.against, figure.window) == (place.what.measure, against, place.what.window):
            return figure
    measure = place.what.definition
    reason = f"{place.against} failed in this scene" if against else "not computed"
    return Figure(
        measure=measure.name, label=measure.label, unit=measure.unit, value=None, against=against, window=place.what.window, note=reason
    )


def _horizon(store: Store, scene: Scene) -> float:
    """The time up to which histories of this scene can be compared point by point (`ebm.horizon`), s; kept in the store."""
    key = provenance.cell_key(scene, "ebm-unilateral", {"of": "horizon"})
    name = name_of(scene.name, HORIZON, key)
    found = store.get_record(COMPARISONS, name)
    if found is None or not isinstance(found.get("horizon"), float | int):
        from rockcheck.ebm.horizon import predictability_horizon

        found = {"horizon": predictability_horizon(scene)}
        store.put_record(COMPARISONS, name, found)
    return float(found["horizon"])


def _compared(store: Store, scene: Scene, planned: PlannedCell, asked: Mapping[str, Asked]) -> dict[str, ComparisonRecord]:
    """The comparisons that are asked of a cell, by name of the reference, and by OWN_FIGURES its own figures; kept in the store.

    Each has all figures over the whole time, and those asked for over a window.
    """
    horizon = _horizon(store, scene) if any(what.window == HORIZON for _, extra in asked.values() for what in extra) else None
    code = provenance.code_digest("rockcheck.validation.suite.impact_laws")  # with `compare`
    against = [[name, reference.key if reference else "", list(map(str, extra))] for name, (reference, extra) in asked.items()]
    name = name_of(scene.name, planned.variant.label, provenance.digest(json.dumps([planned.key, against, horizon, code])))
    with suppress(ValueError):  # what is kept is not trusted to have the fields that it must have
        kept = CellComparisons.model_validate(store.get_record(COMPARISONS, name))
        if kept.of.keys() == asked.keys():
            return {one: kept.of[one] for one in asked}
    found = {one: _compute(store, scene, planned, reference, extra, horizon) for one, (reference, extra) in asked.items()}
    store.put_record(COMPARISONS, name, CellComparisons(of=found).model_dump(mode="json"))
    return found


def _compute(
    store: Store, scene: Scene, planned: PlannedCell, reference: PlannedCell | None, windowed: Sequence[Windowed], horizon: float | None
) -> ComparisonRecord:
    """The figures of the cell itself where `reference` is None, with the law of impacts that it followed."""
    candidate = store.load(planned.name)
    yardstick = store.load(reference.name) if reference else None
    figures: list[Figure] = []
    gaps: dict[str, tuple[str, bool]] = {}
    by_window: dict[str, list[str]] = {"": [m.name for m in (DIFFERENCES if reference else FIGURES).values() if not m.on_request]}
    for what in windowed:
        by_window.setdefault(what.window, []).append(what.measure)
    landing = landing_of(store, scene)
    other = under_the_other_law(scene, reference.variant) if landing and reference else None
    for window, measures in by_window.items():
        until = horizon if window == HORIZON else float(window[:-1]) if window else None
        if yardstick is None:
            found = describe(candidate, until=until, scene=scene, measures=measures)
            gaps[window] = too_short(candidate, until), False
        else:
            discrepancy = compare(yardstick, candidate, until=until, scene=scene, measures=measures)
            found, gaps[window] = discrepancy.figures, (discrepancy.gap, discrepancy.fall)
            if other and landing and (until is None or until > landing.t):
                found, own = by_either(discrepancy, *other, candidate, scene, until, measures)
                gaps |= {str(Windowed(measure, window)): gap for measure, gap in own.items()}
        figures += [figure.model_copy(update={"window": window}) for figure in found] if window else found
    law = landing.followed_by(candidate, scene) if landing and yardstick is None else None
    return ComparisonRecord(
        figures=tuple((f.measure, f.unit, f.value, f.window, f.until, f.note) for f in figures),
        gaps=gaps,
        impact_law=law,
        overturned_at=None if yardstick else candidate.overturned_at,
    )
