"""Run a suite: play the cells that are not up to date, compare, judge, return the `Run`."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from rockcheck.scenes import Scene, progress
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.discrepancy.figures import Figure, Measure, MeasureRecord
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, TABLE, Store
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import FAULTS, Study, run
from rockcheck.validation.suite import comparing, motions, results, suites, tolerances
from rockcheck.validation.uncertainty import numerical, population

#: Remark on a gap in a measured history.
SHIFTS = (
    "; `offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
)


def run_suite(
    suite: suites.Suite,
    folder: Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    strict: results.Strict = False,
    scheduler: str | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> results.Run:
    """Play, compare and judge every cell of a suite; see `validation.study.run`.

    A cell that fails is a failed cell of the run, never an exception. Raises `InputError` where
    `folder` cannot be used, and, when interrupted, `KeyboardInterrupt` after all results are kept.
    """
    found = run(
        SuiteStudy(suite, folder),
        folder,
        jobs=jobs,
        force=force,
        scheduler=scheduler,
        on_progress=on_progress,
    )
    if not found.complete:
        raise KeyboardInterrupt
    finished: results.Run = found.data["run"]
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

    def __init__(self, suite: suites.Suite, folder: Path) -> None:
        self.suite, self.store, self.own = suite, Store(folder), suite.owners
        self.memory_mb = max((part.given.limits.memory_mb for part in suite.parts), default=None)
        #: By scene or ensemble, and by model: the cell, or the batches of it.
        self.planned: dict[str, dict[str, list[comparing.Planned]]] = {}
        for scene, variant, ensemble in suite.cells():
            found = list(self._planned(scene, variant, ensemble))
            self.planned.setdefault(found[0].place, {})[variant.label] = found
        self.items = [
            item
            for by_model in self.planned.values()
            for found in by_model.values()
            for item in found
        ]
        #: The record of each that has ended, or why it has none.
        self.ended: dict[comparing.Planned, Any] = {
            item: pool.Failure(missing)
            for item in self.items
            if (missing := models.not_installed(item.variant.family))
        }
        self.playable = [item for item in self.items if item not in self.ended]
        self.read_back: set[comparing.Planned] = set()
        #: Batches of which some scenes failed without a result.
        self.traces: set[comparing.Planned] = set()
        self.compared: dict[str, list[results.Cell]] = {}

    def _planned(
        self, scene: Scene, variant: models.Work, ensemble: motions.Ensemble | None
    ) -> Iterator[comparing.Planned]:
        """A cell, or the batches of an ensemble.

        A batch's key covers how its scenes are drawn, so it can be looked up without drawing them.
        """
        place = ensemble.name if ensemble else scene.name
        own, kind = self.own[place], variant.family
        asked = {"uncertainty": provenance.code_digest(numerical.__name__)}
        parts: list[tuple[range, dict[str, Any]]] = [
            (range(0), asked if own.given.uncertainty else {})
        ]
        if ensemble:
            how = ensemble.model_dump(mode="json", exclude={"count", "batch", "description"})
            code = provenance.code_digest("rockcheck.validation.suite.motions")
            every = range(ensemble.count)
            parts = [
                (n, {"drawn": {"ensemble": how, "code": code, "numbers": [n.start, n.stop]}})
                for n in (every[k : k + ensemble.batch] for k in every[:: ensemble.batch])
            ]
        for numbers, depends in parts:
            yield comparing.Planned(
                place,
                scene,
                variant,
                variant.label,
                provenance.cell_key(
                    scene, kind, {**variant.settings, **depends}, variant.search_path
                ),
                own.given.uncertainty,
                ensemble,
                numbers,
                seconds=own.given.limits.seconds,
                compiles=models.compiles(kind, variant.settings),
            )

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[comparing.Planned]:
        """All cells and batches of models that are installed, in the order in which they begin.

        First one cell for each compiled code, since the others with that code wait for it; then the
        cells that take long, the longest scenes with the most walls first; cells of models that are
        compiled as a whole are quick, and fill the processes up to the end.
        """
        first = {item.compiles: item for item in reversed(self.playable)}
        return sorted(
            self.playable,
            key=lambda item: (
                not item.compiles or first[item.compiles] is not item,
                models.family(item.variant.family).compiled != "",
                -item.scene.duration * (1 + len(item.scene.walls)),
            ),
        )

    def file(self, task: Any) -> str:
        """Name of the cell's files."""
        return str(task.name)

    def find(self, store: Store, task: Any) -> Any:
        """The kept record of a batch, or of a cell whose history is whole; else None."""
        found = store.get_record(COMPARISONS, task.name) if task.ensemble else store.get(task.name)
        # a kept record may lack fields that it must have
        with suppress(ValueError):
            self.ended[task] = task.record(found or {})
            self.read_back.add(task)
        return self.ended.get(task)

    def keep(self, store: Store, task: Any, record: models.Played) -> None:
        """Keep a history or a batch; compare a scene's cells once the last of them is kept.

        So scenes are compared while others are still played.
        """
        self.ended[task] = task.record(record.record)
        if record.traceback:  # some scenes of a batch failed: not to be read back
            self.traces.add(task)
        elif task.ensemble is None:
            self.store.put(task.name, record.files, record.record, record.history)
            self._compare(task.place)
        else:
            self.store.put_record(COMPARISONS, task.name, record.record)

    def _compare(self, scene: str) -> None:
        cells, found = self.planned[scene], dict[str, results.Cell]()
        if scene in self.compared or not all(cell in self.ended for (cell,) in cells.values()):
            return
        reference = self.own[scene].given.reference
        for label in sorted(cells, key=lambda label: label != reference):
            found[label] = self._cell(cells[label], found.get(reference))
        self.compared[scene] = [found[label] for label in cells]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The run, as the data of a finding."""
        suite = self.suite
        self.ended |= {task: one for task, one in done.items() if isinstance(one, pool.Failure)}
        if any(item not in self.ended for item in self.items):
            return Finding(self.name, suite.name, "interrupted", complete=False)
        inputs = {
            name: comparing.inputs_of(self.store, given) for name, given in suite.uncertain.items()
        }
        cells: list[results.Cell] = []
        ensembles: list[results.EnsembleRecord] = []
        for place in self.planned:
            if place in suite.ensembles:
                record, of_ensemble = self._ensemble(place)
                ensembles.append(record)
                cells += of_ensemble
            else:
                self._compare(place)
                cells += self._explained(place, inputs.get(place))
        there = {(cell.scene, cell.model) for cell in cells}
        finished = results.Run(
            suite=suite.name,
            description=suite.given.description,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            reference=suite.given.reference,
            model_form=suite.given.model_form,
            scenes={name: scene.model_dump(mode="json") for name, scene in suite.scenes.items()},
            models=tuple(suite.models),
            cells=tuple(cells),
            ensembles=tuple(ensembles),
            inputs=inputs,
            printed=tuple(name for name in suite.scenes if self.own[name].given.print_figures),
            faults=tuple(
                f"tolerance [{place}] has no cell in the suite"
                for place in suite.tolerances
                if (place.scene, place.model) not in there
            ),
            measures=tuple(
                MeasureRecord(name=m.name, label=m.label, unit=m.unit, formula=m.formula)
                for m in tolerances.MEASURES.values()
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

    def _about(self, parts: Sequence[comparing.Planned], reason: str = "") -> dict[str, Any]:
        """The fields of every cell, made of a history or of batches; `reason`: why it failed."""
        first, variant = parts[0], parts[0].variant
        status = "failed" if reason else "done"
        if missing := models.not_installed(variant.family):
            status = "absent" if models.has_wheel(variant.family) else "unavailable"
        traced = [
            f"{FAULTS}/{part.name}.txt"
            for part in parts
            if part in self.traces or getattr(self.ended[part], "traceback", None)
        ]
        return {
            "scene": first.place,
            "model": variant.label,
            "settings": dict(variant.settings),
            "key": provenance.digest("".join(part.key for part in parts))
            if first.ensemble
            else first.key,
            "status": status,
            "reason": missing or reason,
            "read_back": all(part in self.read_back for part in parts),
            "traceback": traced[0] if traced else "",
            # in a user's own model an exception is that model's fault, not rockcheck's
            "unexpected": bool(traced) and not models.is_own(variant.family),
        }

    def _cell(
        self, parts: Sequence[comparing.Planned], reference: results.Cell | None
    ) -> results.Cell:
        (planned,), record = parts, self.ended[parts[0]]
        if isinstance(record, pool.Failure):
            return results.Cell(**self._about(parts, record.reason))
        scene, own = planned.scene, self.own[planned.place]
        required = own.required(scene.name, planned.model)
        found = comparing.compared(self.store, planned, self._asked(planned, required))
        floor = partial(tolerances.floor_of, scene=scene, numerical=record.numerical)
        checks = list(_checks(own, required, found.figures, floor))
        moved = [one for one in checks if one.kind == "absolute" and one.weighs != "pass"]
        same_equations = tolerances.Place(
            scene.name, planned.model, own.given.reference, "theta_rms"
        )
        if moved and reference and own.kind(same_equations) == "numerical":
            # the reference's own figures; one that is not as expected itself is no yardstick
            odd = {
                check.figure.windowed
                for check in reference.checks
                if check.verdict != "pass" and not check.figure.against
            }
            beside = {
                one.windowed: one.value
                for one in reference.figures
                if not one.against and one.windowed not in odd
            }
            checks = list(_checks(own, required, found.figures, floor, beside))
        return results.Cell(
            **self._about(parts)
            | {
                "settings": record.settings,
                "history": f"{HISTORIES}/{planned.name}{TABLE}",
                "outcome": record.outcome,
                "overturned_at": found.overturned_at,
                "notes": record.notes,
                "cost": record.cost,
                "figures": tuple(one.figure for one in found.figures),
                "checks": tuple(checks),
                "numerical": record.numerical,
                "impact_law": found.impact_law,
            }
        )

    def _asked(
        self, planned: comparing.Planned, required: Iterable[tolerances.Place]
    ) -> dict[str, comparing.Asked]:
        """What a cell is compared with: its own figures, and the references that finished."""
        there: dict[str, comparing.Planned | None] = {tolerances.OWN_FIGURES: None} | {
            name: one
            for name, (one,) in self.planned[planned.place].items()
            if one is not planned and not isinstance(self.ended[one], pool.Failure)
        }
        return {
            name: (
                there[name],
                sorted(
                    p.what
                    for p in required
                    if p.against == name
                    and ("@" in p.what or tolerances.measure_of(p.what).on_request)
                ),
            )
            for name in self.own[planned.place].yardsticks(required)
            if name in there
        }

    def _explained(self, scene: str, inputs: population.Inputs | None) -> Iterator[results.Cell]:
        """The cells of a scene with the verdicts on their differences from the references.

        Only of those that finished, and whose numerical error is known.
        """
        own, done = self.own[scene], [one for one in self.compared[scene] if one.status == "done"]
        scatters = {
            one.model: self.ended[self.planned[scene][one.model][0]].uncertainty for one in done
        }
        for cell in self.compared[scene]:
            against = {own.given.reference, own.given.model_form} - {cell.model}
            references = [other for other in done if other.model in against]
            found = comparing.explanations(own.scenes[scene], cell, references, scatters, inputs)
            yield cell.model_copy(update={"explanations": tuple(found)})

    def _ensemble(self, name: str) -> tuple[results.EnsembleRecord, list[results.Cell]]:
        planned, (ensemble, _) = self.planned[name], self.suite.ensembles[name]
        played = {label: list(map(self._batch, batches)) for label, batches in planned.items()}
        whole = results.EnsembleRecord(
            name=name,
            description=ensemble.description,
            definition=ensemble.model_dump(mode="json", exclude_none=True),
            peaks={at: tuple(p for one in some for p in one.peaks) for at, some in played.items()},
            outcomes={
                at: tuple(o for one in some for o in one.outcomes) for at, some in played.items()
            },
        )
        return whole, [
            self._ensemble_cell(planned[label], [one.cost for one in some], whole.samples)
            for label, some in played.items()
        ]

    def _batch(self, planned: comparing.Planned) -> comparing.BatchRecord:
        """The record of a batch; of one that failed, each scene has its reason."""
        found, count = self.ended[planned], len(planned.numbers)
        if isinstance(found, pool.Failure):
            found = comparing.BatchRecord(
                peaks=(None,) * count, outcomes=(found.reason,) * count, cost=results.CostRecord()
            )
        return found

    def _ensemble_cell(
        self,
        batches: Sequence[comparing.Planned],
        costs: Sequence[results.CostRecord],
        samples: Mapping[str, measures.Sample],
    ) -> results.Cell:
        name, label = batches[0].place, batches[0].model
        mine, reason = samples[label], ""
        if mine.failures:
            first = mine.outcomes[int(np.argmin(np.isfinite(mine.peaks)))]
            reason = f"{mine.failures} of {len(mine.peaks)} scenes failed; the first: {first}"
        about = self._about(batches, reason) | {
            "cost": results.CostRecord(
                **{
                    key: sum(getattr(one, key) for one in costs)
                    for key in (*models.SUMMED, "worker_seconds")
                }
            )
        }
        if about["status"] != "done":
            return results.Cell(**about)
        own = self.own[name]
        required = own.required(name, label)
        figures = [
            comparing.Compared(
                evaluate(measure, measures.Samples(samples[other], mine), "alpha", against=other)
            )
            for other in own.yardsticks(required)
            if other in samples and other != label
            for measure in measures.STATISTICS.values()
        ]
        return results.Cell(
            **about,
            outcome=f"{int(np.sum(mine.fallen))} of {len(mine.peaks)} overturned",
            figures=tuple(one.figure for one in figures),
            checks=tuple(_checks(own, required, figures, attrgetter("resolution"))),
        )


def _checks(
    own: suites.Suite,
    required: Mapping[tolerances.Place, results.Kind],
    figures: Sequence[comparing.Compared],
    floor: Callable[[Measure], float],
    beside: Mapping[str, float | None] = MappingProxyType({}),
) -> Iterator[results.Check]:
    """The judged figures of a cell; none if its suite judges nothing.

    `beside` has the reference's own figures, by "measure@window", where these are yardsticks.
    """
    known = {
        (one.figure.against or tolerances.OWN_FIGURES, one.figure.windowed): one for one in figures
    }
    for place, kind in required.items() if own.judged else ():
        line, measure = own.tolerances.get(place), tolerances.measure_of(place.what)
        itself = place.against == tolerances.OWN_FIGURES
        nothing = Figure(  # without a value, so that the check cannot pass
            measure=measure.name,
            label=measure.label,
            unit=measure.unit,
            value=None,
            against="" if itself else place.against,
            window=place.what.partition("@")[2],
            note="not computed" if itself else f"{place.against} failed in this scene",
        )
        found = known.get((place.against, place.what), comparing.Compared(nothing))
        gap = "" if found.fall and kind == "model form" else found.gap
        yield tolerances.judge(
            found.figure,
            line,
            kind=kind,
            measure=measure,
            gap=gap + SHIFTS if gap and kind == "measured" and not found.fall else gap,
            floor=floor(measure),
            beside=beside.get(place.what) if line and kind == "absolute" else None,
        )
