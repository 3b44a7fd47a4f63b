"""A suite is run: its cells are read back or played, compared, judged.

In: a `Suite` and a folder that keeps results. Out: a `results.Run`. `rockcheck validate`, the
pytest plugin and the tests call `run_suite`.
"""

import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from rockcheck.scenes import errors, progress
from rockcheck.validation.discrepancy.figures import Measure
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.study import play_tasks
from rockcheck.validation.suite import (
    ensembles,
    explain,
    judging,
    results,
    scene_results,
    tolerances,
    verdict_scale,
)
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.playing import SuiteTasks
from rockcheck.validation.uncertainty import input_spread


def run_suite(
    suite: Suite,
    folder: str | Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    strict: verdict_scale.Strict = False,
    scheduler: str | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> results.Run:
    """Play, compare and judge every cell of a suite; see `validation.study.play_tasks`.

    A cell that fails is a failed cell of the run, never an exception. Raises `InputError` where
    `folder` cannot be used, and, when interrupted, `KeyboardInterrupt` after all results are kept.
    """
    began = time.monotonic()
    tasks = SuiteTasks(suite, Path(folder))
    played = play_tasks(
        tasks, Path(folder), jobs=jobs, force=force, scheduler=scheduler, on_progress=on_progress
    )
    if not played.complete:
        raise KeyboardInterrupt
    finished = judged_run(tasks)
    tasks.store.prune()
    return finished.model_copy(update={"strict": strict, "wall_seconds": time.monotonic() - began})


def judged_run(tasks: SuiteTasks) -> results.Run:
    """The run of a suite of which all tasks have ended."""
    suite, plan = tasks.suite, tasks.plan
    inputs = {
        name: scene_results.input_effects_of(tasks.store, uncertain)
        for name, uncertain in suite.uncertain.items()
        if name in plan.cells
    }
    cells: list[results.Cell] = []
    for scene_name in plan.cells:
        judged_cells = _judged_cells(tasks, scene_name)
        cells += _explained(tasks, scene_name, judged_cells, inputs.get(scene_name))
    records: list[results.EnsembleRecord] = []
    for name, batches in plan.batches.items():
        ensemble, _ = suite.ensembles[name]
        judged = ensembles.judged_ensemble(tasks.owners[name], ensemble, batches, tasks.outcomes)
        records.append(judged.record)
        cells += judged.cells
    return results.Run(
        suite=suite.name,
        description=suite.config.description,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        reference=suite.config.reference,
        model_form=suite.config.model_form,
        scenes={name: scene.model_dump(mode="json") for name, scene in suite.scenes.items()},
        models=tuple(suite.models),
        cells=tuple(cells),
        ensembles=tuple(records),
        inputs=inputs,
        printed=tuple(name for name in suite.scenes if tasks.owners[name].config.print_figures),
        faults=tuple(_tolerances_without_cell(tasks)),
        measures=tuple(_definition(measure) for measure in tolerances.MEASURES.values()),
        versions=provenance.versions(),
        hardware=provenance.hardware(),
        judged=suite.judged,
        tolerances_file=errors.inert(str(suite.tolerances_path)),
    )


def _judged_cells(tasks: SuiteTasks, scene_name: str) -> list[results.Cell]:
    """The cells of a scene with their checks; the reference is judged before the others."""
    owner, planned = tasks.owners[scene_name], tasks.plan.cells[scene_name]
    reference_name = owner.config.reference
    judged: dict[str, results.Cell] = {}
    for model in sorted(planned, key=lambda model: model != reference_name):
        cell = planned[model]
        outcome = tasks.outcomes[cell]
        if isinstance(outcome, models.Played):
            comparison = tasks.comparisons[cell]
            reference = judged.get(reference_name)
            judged[model] = judging.judged_cell(owner, cell, outcome, comparison, reference)
        else:
            judged[model] = judging.cell_of([cell], [outcome], outcome.reason, owner.unnamed)
    return [judged[model] for model in planned]


def _explained(
    tasks: SuiteTasks,
    scene_name: str,
    cells: list[results.Cell],
    inputs: input_spread.Inputs | None,
) -> Iterator[results.Cell]:
    """The cells of a scene with the verdicts on their differences from the references.

    Only of those that finished, and whose numerical error is known.
    """
    owner = tasks.owners[scene_name]
    finished = [cell for cell in cells if cell.status == "done"]
    scatters = {cell.model: tasks.scatter(scene_name, cell.model) for cell in finished}
    for cell in cells:
        names = {owner.config.reference, owner.config.model_form} - {cell.model}
        references = [other for other in finished if other.model in names]
        verdicts = explain.explanations(
            owner.scenes[scene_name], cell, references, scatters, inputs
        )
        yield cell.model_copy(update={"explanations": tuple(verdicts)})


def _tolerances_without_cell(tasks: SuiteTasks) -> Iterator[str]:
    for key in tasks.suite.tolerances:
        if not tasks.plan.has(key.scene, key.model):
            table = ".".join((key.scene, key.model, key.against))
            yield f"tolerance [{table}: {key.windowed}] has no cell in the suite"


def _definition(measure: Measure) -> dict[results.MeasureField, str]:
    """How a measure is defined, for the pages."""
    return {
        "name": measure.name,
        "label": measure.label,
        "unit": measure.unit,
        "formula": measure.formula,
        "source": "",
    }
