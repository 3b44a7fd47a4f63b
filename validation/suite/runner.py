"""Run a suite: play the cells that are not up to date, compare, judge, return the `Run`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from rockcheck.scenes import Scene
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import made, write_whole
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.discrepancy.figures import Figure, Measure, MeasureRecord, Stored
from rockcheck.validation.discrepancy.statistics import STATISTICS, Sample, Samples
from rockcheck.validation.execute import provenance, workers
from rockcheck.validation.execute.models import compiles, family, has_wheel, is_own, not_installed
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, TABLE, Store
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import FAULTS, Study, run
from rockcheck.validation.suite.comparing import (
    Asked,
    CellRecord,
    Planned,
    compared,
    explanations,
    inputs_of,
)
from rockcheck.validation.suite.motions import Ensemble
from rockcheck.validation.suite.results import Cell, Check, CostRecord, EnsembleRecord, Run, Strict
from rockcheck.validation.suite.suites import Suite
from rockcheck.validation.suite.tolerances import (
    MEASURES,
    OWN_FIGURES,
    Place,
    Windowed,
    floor_of,
    judge,
)
from rockcheck.validation.uncertainty import numerical
from rockcheck.validation.uncertainty.population import Inputs

#: Parts of the cost that add up over the batches of an ensemble.
ADDED = ("wall_seconds", "cpu_seconds", "set_up", "steps", "evaluations", "worker_seconds")
#: Remark on a gap in a measured history.
SHIFTS = (
    "; `offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
)


class BatchRecord(Stored):
    """The kept record of a batch: peak |theta| in alpha and outcome of each scene.

    None and the reason where the model failed.
    """

    peaks: tuple[float | None, ...]
    outcomes: tuple[str, ...]
    cost: CostRecord


def run_suite(
    suite: Suite,
    folder: Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    strict: Strict = False,
    scheduler: str | None = None,
    on_progress: OnProgress = unheard,
) -> Run:
    """Play, compare and judge every cell of a suite; see `validation.study.run`.

    A cell that fails is a failed cell of the run, never an exception. Raises `InputError` where
    `folder` cannot be used, and, when interrupted, `KeyboardInterrupt` after all results are kept.
    """
    study = SuiteStudy(suite, folder)
    found = run(study, folder, jobs=jobs, force=force, scheduler=scheduler, on_progress=on_progress)
    if not found.complete:
        raise KeyboardInterrupt
    finished: Run = found.data["run"]
    return finished.model_copy(
        update={
            "strict": strict,
            "wall_seconds": found.made.wall_seconds if found.made else 0.0,
        }
    )


class SuiteStudy(Study):
    """A suite: tasks are its cells and its ensembles' batches.

    Results are kept and read back in `folder`.
    """

    name = "suite"
    kinds = (HISTORIES, COMPARISONS)

    def __init__(self, suite: Suite, folder: Path) -> None:
        self.suite, self.store = suite, Store(folder)
        limits = [suite.suite_of(name).given.limits for name in (*suite.scenes, *suite.ensembles)]
        self.memory_mb = max((limit.memory_mb for limit in limits), default=None)
        asked = {"uncertainty": provenance.code_digest(numerical.__name__)}
        self.cells = [
            self._planned(
                scene, variant, asked if suite.suite_of(scene.name).given.uncertainty else {}
            )
            for scene, variant in suite.cells()
        ]
        self.batches = [
            batch for found in suite.ensemble_cells() for batch in self._batches(*found)
        ]
        self.items: list[Planned] = [*self.cells, *self.batches]
        self.by_scene: dict[str, dict[str, Planned]] = {}
        for cell in self.cells:
            self.by_scene.setdefault(cell.place, {})[cell.variant.label] = cell
        self.read_back: set[Planned] = set()
        self.records: dict[Planned, Any] = {}  # `CellRecord`, `BatchRecord`
        self.failures = {
            item: missing for item in self.items if (missing := not_installed(item.variant.family))
        }
        self.traces: set[Planned] = set()
        self.compared: dict[str, list[Cell]] = {}

    def _planned(
        self, scene: Scene, variant: workers.Work, depends: Mapping[str, Any], **of: Any
    ) -> Planned:
        own, settings = self.suite.suite_of(scene.name), {**variant.settings, **depends}
        if "ensemble" in of:
            own = self.suite.suite_of(of["ensemble"].name)
        kind = variant.family
        return Planned(
            scene,
            variant,
            variant.label,
            provenance.cell_key(scene, kind, settings, variant.search_path),
            own.given.uncertainty,
            **of,
            seconds=own.given.limits.seconds,
            compiles=compiles(kind, variant.settings),
        )

    def _batches(self, ensemble: Ensemble, base: Scene, variant: workers.Work) -> Iterator[Planned]:
        """An ensemble in batches.

        A batch's key covers how its scenes are drawn, so it can be looked up without drawing them.
        """
        drawing = {
            "ensemble": ensemble.model_dump(mode="json", exclude={"count", "batch", "description"}),
            "code": provenance.code_digest("rockcheck.validation.suite.motions"),
        }
        for start in range(0, ensemble.count, ensemble.batch):
            numbers = range(start, min(start + ensemble.batch, ensemble.count))
            drawn = {**drawing, "numbers": [numbers.start, numbers.stop]}
            yield self._planned(base, variant, {"drawn": drawn}, ensemble=ensemble, numbers=numbers)

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Planned]:
        """All cells and batches of models that are installed."""
        return in_order([item for item in self.items if item in done or item not in self.failures])

    def file(self, task: Any) -> str:
        """Name of the cell's files."""
        return str(task.name)

    def find(self, store: Store, task: Any) -> workers.Played | None:
        """The kept record of a batch, or of a cell whose history is whole; else None."""
        whole = task.ensemble is None
        found = store.get(task.name) if whole else store.get_record(COMPARISONS, task.name)
        # a kept record may lack fields that it must have
        with suppress(ValueError):
            self.records[task] = _record_of(task).model_validate(found)
            self.read_back.add(task)
            return workers.Played(found or {})
        return None

    def keep(self, store: Store, task: Any, record: workers.Played) -> None:
        """Keep a history or a batch; compare a scene's cells once the last of them is kept.

        So scenes are compared while others are still played.
        """
        self.records[task] = _record_of(task).model_validate(record.record)
        if record.traceback:  # some scenes of a batch failed: not to be read back
            self.traces.add(task)
            write_whole(made(self.store.folder, FAULTS) / f"{task.name}.txt", record.traceback)
        elif task.ensemble is None:
            self.store.put(task.name, record.files, record.record, record.history)
            self._compare(task.place)
        else:
            self.store.put_record(COMPARISONS, task.name, record.record)

    def _compare(self, scene: str) -> None:
        """Compare and judge the cells of a scene, once all are there."""
        cells, found = self.by_scene[scene], dict[str, Cell]()
        if scene in self.compared or not all(
            cell in self.records or cell in self.failures for cell in cells.values()
        ):
            return
        reference = self.suite.suite_of(scene).reference
        for label in sorted(cells, key=lambda label: label != reference):
            found[label] = self._cell(cells[label], found.get(reference))
        self.compared[scene] = [found[label] for label in cells]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The run, as the data of a finding."""
        suite = self.suite
        failed = {task: one for task, one in done.items() if isinstance(one, Failure)}
        self.failures |= {task: one.reason for task, one in failed.items()}
        self.traces |= {task for task, one in failed.items() if one.traceback}
        if any(item not in done and item not in self.failures for item in self.items):
            return Finding(self.name, suite.name, "interrupted", complete=False)
        inputs = {name: inputs_of(self.store, given) for name, given in suite.uncertain.items()}
        cells: list[Cell] = []
        for scene in self.by_scene:
            self._compare(scene)
            cells += self._explained(scene, inputs.get(scene))
        ensembles: list[EnsembleRecord] = []
        for ensemble, batches in groupby(self.batches, key=lambda batch: batch.ensemble):
            if ensemble is not None:
                record, of_ensemble = self._ensemble(ensemble, list(batches))
                ensembles.append(record)
                cells += of_ensemble
        there = {(cell.scene, cell.model) for cell in cells}
        finished = Run(
            suite=suite.name,
            description=suite.given.description,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            reference=suite.reference,
            model_form=suite.model_form,
            scenes={name: scene.model_dump(mode="json") for name, scene in suite.scenes.items()},
            models=tuple(suite.models),
            cells=tuple(cells),
            ensembles=tuple(ensembles),
            inputs=inputs,
            printed=tuple(
                name for name in suite.scenes if suite.suite_of(name).given.print_figures
            ),
            faults=tuple(
                f"tolerance [{place}] has no cell in the suite"
                for place in suite.tolerances
                if (place.scene, place.model) not in there
            ),
            measures=tuple(
                MeasureRecord(name=m.name, label=m.label, unit=m.unit, formula=m.formula)
                for m in MEASURES.values()
            ),
            versions=provenance.versions(),
            hardware=provenance.hardware(),
            judged=suite.judged,
            tolerances_file=str(suite.tolerances_path),
        )
        return Finding(
            self.name,
            suite.name,
            finished.words,
            data={"run": finished},
            exit_code=finished.exit_code,
        )

    def _about(self, parts: Sequence[Planned], key: str, reason: str = "") -> dict[str, Any]:
        """The fields of every cell, made of a history or of batches; `reason`: why it failed."""
        place, variant = parts[0].place, parts[0].variant
        status = "failed" if reason else "done"
        if missing := not_installed(variant.family):
            status = "absent" if has_wheel(variant.family) else "unavailable"
        traced = [f"{FAULTS}/{part.name}.txt" for part in parts if part in self.traces]
        return {
            "scene": place,
            "model": variant.label,
            "settings": dict(variant.settings),
            "key": key,
            "status": status,
            "reason": missing or reason,
            "read_back": all(part in self.read_back for part in parts),
            "traceback": traced[0] if traced else "",
            # in a user's own model an exception is that model's fault, not rockcheck's
            "unexpected": bool(traced) and not is_own(variant.family),
        }

    def _cell(self, planned: Planned, reference: Cell | None) -> Cell:
        """The cell, compared and judged; `reference` is the reference's cell of that scene."""
        about = self._about([planned], planned.key, self.failures.get(planned, ""))
        if planned in self.failures:
            return Cell(**about)
        scene, label, record = planned.scene, planned.variant.label, self.records[planned]
        own, found = (
            self.suite.suite_of(scene.name),
            compared(self.store, scene, planned, self._asked(planned)),
        )
        figures = [figure for one in found.values() for figure in one.figures]
        gaps = {
            (name, window): gap for name, one in found.items() for window, gap in one.gaps.items()
        }
        floor = partial(floor_of, scene=scene, numerical=record.numerical)
        checks = list(self._checks(scene.name, label, figures, gaps, floor))
        moved = [one for one in checks if one.kind == "absolute" and one.weighs != "pass"]
        same_equations = Place(scene.name, label, own.reference, Windowed("theta_rms"))
        if moved and reference and own.kind(same_equations) == "numerical":
            beside = as_expected(reference)
            checks = list(self._checks(scene.name, label, figures, gaps, floor, beside))
        return Cell(
            **about
            | {
                "settings": record.settings,
                "history": f"{HISTORIES}/{planned.name}{TABLE}",
                "outcome": record.outcome,
                "overturned_at": found[OWN_FIGURES].overturned_at,
                "notes": record.notes,
                "cost": record.cost,
                "figures": tuple(figures),
                "checks": tuple(checks),
                "numerical": record.numerical,
                "impact_law": found[OWN_FIGURES].impact_law,
            }
        )

    def _asked(self, planned: Planned) -> dict[str, Asked]:
        """What a cell is compared with: its own figures, and the references that finished."""
        required = self.suite.required(planned.place, planned.variant.label)
        there: dict[str, Planned | None] = {
            name: one
            for name, one in self.by_scene[planned.place].items()
            if one is not planned and one in self.records
        }
        there[OWN_FIGURES] = None
        return {
            name: (
                there[name],
                sorted(
                    p.what
                    for p in required
                    if p.against == name and (p.what.window or p.what.definition.on_request)
                ),
            )
            for name in self.suite.yardsticks(planned.place, required)
            if name in there
        }

    def _checks(
        self,
        scene: str,
        model: str,
        figures: Sequence[Figure],
        gaps: Mapping[tuple[str, str], tuple[str, bool]],
        floor: Callable[[Measure], float | None],
        beside: Mapping[tuple[str, str], float | None] = MappingProxyType({}),
    ) -> Iterator[Check]:
        """The judged figures of a cell; `gaps` by reference and window, or measure and window.

        `beside` has the reference's own figures, by measure and window, where these are yardsticks.
        """
        own = self.suite.suite_of(scene)
        for place, kind in self.suite.required(scene, model).items() if own.judged else ():
            what, line = place.what, own.tolerances.get(place)
            of_window = gaps.get((place.against, what.window), ("", False))
            text, fall = gaps.get((place.against, str(what)), of_window)
            gap = "" if fall and kind == "model form" else text
            yield judge(
                _figure(figures, place),
                line,
                kind=kind,
                measure=what.definition,
                gap=gap + SHIFTS if gap and kind == "measured" and not fall else gap,
                floor=floor(what.definition),
                beside=beside.get((what.measure, what.window))
                if line and kind == "absolute"
                else None,
            )

    def _explained(self, scene: str, inputs: Inputs | None) -> Iterator[Cell]:
        """The cells of a scene with the verdicts on their differences from the references.

        Only of those that finished, and whose numerical error is known.
        """
        own, cells = self.suite.suite_of(scene), self.compared[scene]
        records: dict[str, Any] = {
            label: self.records.get(one) for label, one in self.by_scene[scene].items()
        }
        for cell in cells:
            references = {
                other.model: (other.figures, records[other.model])
                for other in cells
                if other.model in {own.reference, own.model_form} - {cell.model}
                and other.status == "done"
            }
            mine = records[cell.model]
            found = mine and explanations(own.scenes[scene], cell.figures, mine, references, inputs)
            yield cell.model_copy(update={"explanations": tuple(found or ())})

    def _ensemble(
        self, ensemble: Ensemble, batches: Sequence[Planned]
    ) -> tuple[EnsembleRecord, list[Cell]]:
        by_model = {
            label: list(found)
            for label, found in groupby(batches, key=lambda batch: batch.variant.label)
        }
        played = {label: self._together(parts) for label, parts in by_model.items()}
        samples = {
            label: Sample(np.array(one.peaks, dtype=float), one.outcomes)
            for label, one in played.items()
        }
        whole = EnsembleRecord(
            name=ensemble.name,
            description=ensemble.description,
            definition=ensemble.model_dump(mode="json", exclude_none=True),
            peaks={label: one.peaks for label, one in played.items()},
            outcomes={label: one.outcomes for label, one in played.items()},
        )
        cells = [
            self._ensemble_cell(parts, samples, played[label].cost)
            for label, parts in by_model.items()
        ]
        return whole, cells

    def _together(self, batches: Sequence[Planned]) -> BatchRecord:
        """Batches as one; each scene of a batch that failed has its reason."""
        found: list[BatchRecord] = [
            self.records.get(batch)
            or BatchRecord(
                peaks=(None,) * len(batch.numbers),
                outcomes=(self.failures.get(batch, ""),) * len(batch.numbers),
                cost=CostRecord(),
            )
            for batch in batches
        ]
        return BatchRecord(
            peaks=tuple(peak for one in found for peak in one.peaks),
            outcomes=tuple(outcome for one in found for outcome in one.outcomes),
            cost=CostRecord(
                **{name: sum(getattr(one.cost, name) for one in found) for name in ADDED}
            ),
        )

    def _ensemble_cell(
        self, batches: Sequence[Planned], samples: Mapping[str, Sample], cost: CostRecord
    ) -> Cell:
        place, label = batches[0].place, batches[0].variant.label
        own, reason = samples[label], ""
        if own.failures:
            first = own.outcomes[int(np.argmin(np.isfinite(own.peaks)))]
            reason = f"{own.failures} of {len(own.peaks)} scenes failed; the first: {first}"
        key = provenance.digest("".join(batch.key for batch in batches))
        about = self._about(batches, key, reason)
        about["cost"] = cost
        if about["status"] != "done":
            return Cell(**about)
        required = self.suite.required(place, label)
        figures = [
            evaluate(measure, Samples(samples[name], own), "alpha", against=name)
            for name in self.suite.yardsticks(place, required)
            if name in samples and name != label
            for measure in STATISTICS.values()
        ]
        checks = self._checks(place, label, figures, {}, lambda measure: None)
        return Cell(
            **about,
            outcome=f"{int(np.sum(own.fallen))} of {len(own.peaks)} overturned",
            figures=tuple(figures),
            checks=tuple(checks),
        )


def as_expected(reference: Cell) -> dict[tuple[str, str], float | None]:
    """The reference's own figures, by measure and window, but for those not as expected.

    One that is not as expected itself is no yardstick.
    """
    moved = {
        (check.figure.measure, check.figure.window)
        for check in reference.checks
        if check.verdict != "pass" and not check.figure.against
    }
    return {
        (one.measure, one.window): one.value
        for one in reference.figures
        if not one.against and (one.measure, one.window) not in moved
    }


def in_order(items: Sequence[Planned]) -> list[Planned]:
    """The order in which cells begin.

    First one cell for each compiled code, since the others with that code wait for it; then the
    cells that take long, the longest scenes with the most walls first; cells of models that are
    compiled as a whole are quick, and fill the processes up to the end.
    """
    first = {item.compiles: item for item in reversed(items)}

    def turn(item: Planned) -> tuple[bool, bool, float]:
        quick, scene = family(item.variant.family).compiled, item.scene
        waits = not item.compiles or first[item.compiles] is not item
        return waits, quick, -scene.duration * (1 + len(scene.walls))

    return sorted(items, key=turn)


def _record_of(task: Planned) -> type[CellRecord] | type[BatchRecord]:
    return CellRecord if task.ensemble is None else BatchRecord


def _figure(figures: Sequence[Figure], place: Place) -> Figure:
    """The figure of a check; if missing, one without a value, so that the check cannot pass."""
    against = "" if place.against == OWN_FIGURES else place.against
    for figure in figures:
        if (figure.measure, figure.against, figure.window) == (
            place.what.measure,
            against,
            place.what.window,
        ):
            return figure
    measure = place.what.definition
    reason = f"{place.against} failed in this scene" if against else "not computed"
    return Figure(
        measure=measure.name,
        label=measure.label,
        unit=measure.unit,
        value=None,
        against=against,
        window=place.what.window,
        note=reason,
    )
