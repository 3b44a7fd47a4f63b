"""Run a suite: play the cells that are not up to date, compare, judge, return the `Run`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import made, write_whole
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.discrepancy.figures import Figure, MeasureRecord, Stored
from rockcheck.validation.discrepancy.statistics import STATISTICS, Sample, Samples
from rockcheck.validation.execute import provenance, workers
from rockcheck.validation.execute.models import compiles, has_wheel, is_own, not_installed
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
from rockcheck.validation.suite.results import Cell, CostRecord, EnsembleRecord, Run, Strict
from rockcheck.validation.suite.suites import ModelVariant, Suite
from rockcheck.validation.suite.tolerances import (
    MEASURES,
    OWN_FIGURES,
    Place,
    Windowed,
    floor_of,
    judge,
    judged_beside,
)
from rockcheck.validation.uncertainty import numerical
from rockcheck.validation.uncertainty.population import Inputs


class BatchRecord(Stored):
    """What is kept of a batch: peak |theta| in alpha and outcome of each scene, None and the reason
    where the model failed.
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
    `folder` cannot be used, and `KeyboardInterrupt` once what was played is kept.
    """
    study = SuiteStudy(suite, folder)
    found = run(study, folder, jobs=jobs, force=force, scheduler=scheduler, on_progress=on_progress)
    if not found.complete:
        raise KeyboardInterrupt
    finished: Run = found.data["run"]
    seconds = found.made.wall_seconds if found.made else 0.0
    return finished.model_copy(update={"strict": strict, "wall_seconds": seconds})


class SuiteStudy(Study):
    """A suite: tasks are its cells and its ensembles' batches.

    Results are kept and read back in `folder`.
    """

    name = "suite"
    kinds = (HISTORIES, COMPARISONS)

    def __init__(self, suite: Suite, folder: Path) -> None:
        self.suite = suite
        try:
            self.store = Store(folder)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be used as the output folder: {error.strerror}"
            ) from None
        limits = [suite.suite_of(name).limits for name in (*suite.scenes, *suite.ensembles)]
        self.memory_mb = max((limit.memory_mb for limit in limits), default=None)
        asked = {"uncertainty": provenance.code_digest(numerical.__name__)}
        self.cells = [
            self._planned(scene, variant, asked if suite.suite_of(scene.name).uncertainty else {})
            for scene, variant in suite.cells()
        ]
        self.batches = [
            batch for found in suite.ensemble_cells() for batch in self._batches(*found)
        ]
        self.read_back: set[Planned] = set()
        self.records: dict[Planned, Any] = {}  # `CellRecord`, `BatchRecord`
        self.failures: dict[Planned, str] = {}
        self.traces: set[Planned] = set()
        self.compared: dict[Planned, Cell] = {}
        self.by_place = {(cell.place, cell.variant.label): cell for cell in self.cells}
        self.by_scene = {
            scene: list(of) for scene, of in groupby(self.cells, key=lambda cell: cell.place)
        }
        self.items: list[Planned] = [*self.cells, *self.batches]
        for item in self.items:
            if missing := not_installed(item.variant.family_name):
                self.failures[item] = missing

    def _planned(
        self, scene: Scene, variant: ModelVariant, depends: Mapping[str, Any], **of: Any
    ) -> Planned:
        own, settings = self.suite.suite_of(scene.name), {**variant.settings, **depends}
        if "ensemble" in of:
            own = self.suite.suite_of(of["ensemble"].name)
        kind = variant.family_name
        return Planned(
            scene,
            variant,
            variant.label,
            provenance.cell_key(scene, kind, settings, variant.search_path),
            own.uncertainty,
            **of,
            seconds=own.limits.seconds,
            compiles=compiles(kind, variant.settings),
        )

    def _batches(self, ensemble: Ensemble, base: Scene, variant: ModelVariant) -> Iterator[Planned]:
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
            of = {"ensemble": ensemble, "numbers": numbers}
            yield self._planned(base, variant, {"drawn": drawn}, **of)

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Planned]:
        """All cells and batches of models that are installed."""
        return in_order([item for item in self.items if item in done or item not in self.failures])

    @staticmethod
    def play(task: Planned) -> workers.Played:
        """The history, or the peaks of a batch."""
        return workers.play(task.work)

    def file(self, task: Any) -> str:
        """As the files of the cell are named."""
        return str(task.name)

    def find(self, store: Store, task: Any) -> workers.Played | None:
        """A cell's record where its history is whole, a batch's."""
        whole = task.ensemble is None
        found = store.get(task.name) if whole else store.get_record(COMPARISONS, task.name)
        # what is kept is not trusted to have the fields that it must have
        with suppress(ValueError):
            if found is not None:
                self.records[task] = _record_of(task).model_validate(found)
                self.read_back.add(task)
                return workers.Played(found)
        return None

    def keep(self, store: Store, task: Any, record: workers.Played) -> None:
        """Keep a history or a batch, and compare its scene where that is the last of it: while
        others play.
        """
        self.records[task] = _record_of(task).model_validate(record.record)
        if record.traceback:  # some scenes of a batch: not to be read back
            self.traces.add(task)
            write_whole(made(self.store.folder, FAULTS) / f"{task.name}.txt", record.traceback)
        elif task.ensemble is None:
            self.store.put(task.name, record.files, record.record, record.history)
            self._compare(task.place)
        else:
            self.store.put_record(COMPARISONS, task.name, record.record)

    def _compare(self, scene: str) -> None:
        """The cells of a scene, once all are there."""
        cells = self.by_scene[scene]
        if all(cell in self.records or cell in self.failures for cell in cells):
            for cell in cells:
                self.compared.setdefault(cell, self._cell(cell))

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The run, as the data of a finding."""
        suite = self.suite
        for task, result in done.items():
            if isinstance(result, Failure):
                self.failures[task] = result.reason
                if result.traceback:
                    self.traces.add(task)
        if any(item not in done and item not in self.failures for item in self.items):
            return Finding(self.name, suite.name, "interrupted", complete=False)
        for scene in self.by_scene:
            self._compare(scene)
        inputs = {name: inputs_of(self.store, given) for name, given in suite.uncertain.items()}
        found = [self.compared[planned] for planned in self.cells]
        beside = {name: list(of) for name, of in groupby(found, key=lambda cell: cell.scene)}
        found = [self._judged_beside(cell, beside[cell.scene]) for cell in found]
        cells = [
            self._explained(cell, beside[cell.scene], inputs.get(cell.scene)) for cell in found
        ]
        ensembles: list[EnsembleRecord] = []
        for ensemble, batches in groupby(self.batches, key=lambda batch: batch.ensemble):
            if ensemble is not None:
                record, of_ensemble = self._ensemble(ensemble, list(batches))
                ensembles.append(record)
                cells += of_ensemble
        # in a user's own model an exception is that model's fault, not rockcheck's
        faults = {
            (task.place, task.variant.label): {
                "traceback": f"{FAULTS}/{task.name}.txt",
                "unexpected": not is_own(task.variant.family_name),
            }
            for task in self.traces
        }
        cells = [cell.model_copy(update=faults.get((cell.scene, cell.model), {})) for cell in cells]
        there = {(cell.scene, cell.model) for cell in cells}
        finished = Run(
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

    def _cell(self, planned: Planned) -> Cell:
        scene, label, suite = planned.scene, planned.variant.label, self.suite
        about: dict[str, Any] = {
            "scene": scene.name,
            "model": label,
            "key": planned.key,
            "read_back": planned in self.read_back,
        }
        if planned in self.failures:
            missing = not_installed(planned.variant.family_name)
            absent = "absent" if has_wheel(planned.variant.family_name) else "unavailable"
            about["status"] = absent if missing else "failed"
            return Cell(
                **about, reason=self.failures[planned], settings=dict(planned.variant.settings)
            )
        record = self.records[planned]
        required = suite.required(scene.name, label)
        own = suite.suite_of(scene.name)
        asked: dict[str, Asked] = {}
        for name in dict.fromkeys(
            [OWN_FIGURES, own.reference, own.model_form, *(place.against for place in required)]
        ):
            reference = None if name == OWN_FIGURES else self.by_place.get((scene.name, name))
            if name == OWN_FIGURES or (
                reference is not None and reference is not planned and reference in self.records
            ):
                extra = sorted(
                    p.what
                    for p in required
                    if p.against == name and (p.what.window or p.what.definition.on_request)
                )
                asked[name] = reference, extra
        found = compared(self.store, scene, planned, asked)
        figures = [figure for name, one in found.items() for figure in one.figures_against(name)]
        gaps = {
            (name, window): gap for name, one in found.items() for window, gap in one.gaps.items()
        }
        checks = []
        for place, kind in required.items() if suite.judged else ():
            figure = _figure(figures, place)
            of_window = gaps.get((place.against, place.what.window), ("", False))
            text, fall = gaps.get((place.against, str(place.what)), of_window)
            gap = "" if fall and kind == "model form" else text
            if gap and kind == "measured" and not fall:
                gap += (
                    "; `offset` of the measured model shifts its times,"
                    " a window such as theta_rms@8s ends sooner"
                )
            measure = place.what.definition
            floor = floor_of(measure, scene, record.numerical)
            checks.append(
                judge(
                    figure,
                    own.tolerances.get(place),
                    kind=kind,
                    measure=measure,
                    gap=gap,
                    floor=floor,
                )
            )
        return Cell(
            **about,
            status="done",
            settings=record.settings,
            history=f"{HISTORIES}/{planned.name}{TABLE}",
            outcome=record.outcome,
            overturned_at=found[OWN_FIGURES].overturned_at,
            notes=record.notes,
            cost=record.cost,
            figures=tuple(figures),
            checks=tuple(checks),
            numerical=record.numerical,
            impact_law=found[OWN_FIGURES].impact_law,
        )

    def _judged_beside(self, cell: Cell, cells: Sequence[Cell]) -> Cell:
        """The cell with its own figures judged beside the reference's, where one is not as
        expected.

        Both must solve the same equations. A figure of the reference that is itself not as expected
        is no yardstick.
        """
        own = self.suite.suite_of(cell.scene)
        moved = next(
            (check for check in cell.checks if check.kind == "absolute" and check.weighs != "pass"),
            None,
        )
        reference = next(
            (other for other in cells if other.model == own.reference and other is not cell), None
        )
        if moved is None or reference is None:
            return cell
        if (
            own.kind(Place(cell.scene, cell.model, own.reference, Windowed(moved.figure.measure)))
            != "numerical"
        ):
            return cell
        known = {(f.measure, f.window): f.value for f in reference.figures if not f.against}
        for check in reference.checks:
            if check.verdict != "pass" and not check.figure.against:
                known.pop((check.figure.measure, check.figure.window), None)
        checks = (
            judged_beside(check, known.get((check.figure.measure, check.figure.window)))
            if check.kind == "absolute"
            else check
            for check in cell.checks
        )
        return cell.model_copy(update={"checks": tuple(checks)})

    def _explained(self, cell: Cell, cells: Sequence[Cell], inputs: Inputs | None) -> Cell:
        """The cell with the verdicts on its differences from the references among `cells`, of its
        scene, that finished; unchanged where nothing is known.
        """
        own = self.suite.suite_of(cell.scene)
        if cell.numerical is None:
            return cell
        references = {
            other.model: (other.figures, self.records[self.by_place[cell.scene, other.model]])
            for other in cells
            if other.model in {own.reference, own.model_form} - {cell.model}
            and other.status == "done"
        }
        mine, scene = self.records[self.by_place[cell.scene, cell.model]], own.scenes[cell.scene]
        found = explanations(scene, cell.figures, mine, references, inputs)
        return cell.model_copy(update={"explanations": tuple(found)})

    def _ensemble(
        self, ensemble: Ensemble, batches: Sequence[Planned]
    ) -> tuple[EnsembleRecord, list[Cell]]:
        by_model = {
            label: list(found)
            for label, found in groupby(batches, key=lambda batch: batch.variant.label)
        }
        samples: dict[str, Sample] = {}
        for label, parts in by_model.items():
            peaks: list[float | None] = []
            outcomes: list[str] = []
            for part in parts:
                record, count = self.records.get(part), len(part.numbers)
                peaks += record.peaks if record else [None] * count
                outcomes += record.outcomes if record else [self.failures[part]] * count
            samples[label] = Sample(np.array(peaks, dtype=float), tuple(outcomes))
        whole = EnsembleRecord(
            name=ensemble.name,
            description=ensemble.description,
            definition=ensemble.model_dump(mode="json", exclude_none=True),
            peaks={
                label: tuple(peak if math.isfinite(peak) else None for peak in sample.peaks)
                for label, sample in samples.items()
            },
            outcomes={label: tuple(sample.outcomes) for label, sample in samples.items()},
        )
        return whole, [self._ensemble_cell(parts, samples) for parts in by_model.values()]

    def _ensemble_cell(self, batches: Sequence[Planned], samples: Mapping[str, Sample]) -> Cell:
        variant, place = batches[0].variant, batches[0].place
        own, origin = samples[variant.label], self.suite.suite_of(place)
        played = (self.records[batch] for batch in batches if batch in self.records)
        costs = [record.cost.model_dump(exclude_unset=True) for record in played]
        about: dict[str, Any] = {
            "scene": place,
            "model": variant.label,
            "key": provenance.digest("".join(batch.key for batch in batches)),
            "settings": dict(variant.settings),
            "read_back": all(batch in self.read_back for batch in batches),
            "cost": CostRecord(
                **{key: sum(cost[key] for cost in costs) for key in (costs[0] if costs else ())}
            ),
        }
        if missing := not_installed(variant.family_name):
            about["status"] = "absent" if has_wheel(variant.family_name) else "unavailable"
            return Cell(**about, reason=missing)
        if own.failures:
            reason = next(
                outcome
                for peak, outcome in zip(own.peaks, own.outcomes, strict=True)
                if not math.isfinite(peak)
            )
            return Cell(
                **about,
                status="failed",
                reason=f"{own.failures} of {len(own.peaks)} scenes failed; the first: {reason}",
            )
        required = origin.required(place, variant.label)
        figures = [
            evaluate(measure, Samples(samples[name], own), "alpha", against=name)
            for name in dict.fromkeys(
                [origin.reference, origin.model_form, *(place.against for place in required)]
            )
            if name in samples and name != variant.label
            for measure in STATISTICS.values()
        ]
        checks = [
            judge(
                _figure(figures, place),
                origin.tolerances.get(place),
                kind=kind,
                measure=place.what.definition,
            )
            for place, kind in required.items()
        ]
        outcome = f"{int(np.sum(own.fallen))} of {len(own.peaks)} overturned"
        return Cell(
            **about, status="done", outcome=outcome, figures=tuple(figures), checks=tuple(checks)
        )


def in_order(items: Sequence[Planned]) -> list[Planned]:
    """The order in which cells begin.

    One of each package that compiles goes first, since the others of it wait for that one; then
    what is not compiled, which takes longest; the quick rest fills the processes up to the end.
    """
    first = {item.compiles: n for n, item in reversed(list(enumerate(items)))}
    turn = [
        1 if not item.compiles else 0 if first[item.compiles] == n else 2
        for n, item in enumerate(items)
    ]
    return [items[n] for n in sorted(range(len(items)), key=turn.__getitem__)]


def _record_of(task: Planned) -> type[CellRecord] | type[BatchRecord]:
    return CellRecord if task.ensemble is None else BatchRecord


def _figure(figures: Sequence[Figure], place: Place) -> Figure:
    """The figure that a check is about; one without value where it is missing, so that the check
    cannot pass.
    """
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
