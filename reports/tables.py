"""What the pages list: checks by how far they are out, run times as ratios, all measures of a
scene, a scene in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import geometric_mean

from rockcheck.reports.show import words as display
from rockcheck.reports.view import SceneView
from rockcheck.reports.words import number
from rockcheck.scenes.history import events_path
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.suite.results import Cell, Check, Run


def worst_first(run: Run) -> list[tuple[Cell, Check | None]]:
    """What is not within tolerance: cells without a history, then checks by how far they are out,
    then those that changed.

    A figure that has no tolerance yet is not out of one; the page counts these.
    """
    failed: list[tuple[Cell, Check | None]] = [
        (cell, None) for cell in run.cells if cell.status != "done"
    ]
    checks = [
        (cell, check)
        for cell, check in run.checks()
        if check.weighs != "pass" and check.words != "no tolerance yet"
    ]
    return failed + sorted(checks, key=lambda pair: (pair[1].verdict != "fail", -overrun(pair[1])))


def overrun(check: Check) -> float:
    """How many times its limit a check uses, infinite where that cannot be said."""
    value, limit = check.figure.value, check.limit
    if value is None or not limit:
        return float("inf") if check.verdict == "fail" else 0.0
    if check.ideal is None:
        return limit / value if value > 0.0 else float("inf")
    return abs(value - check.ideal) / limit


@dataclass(frozen=True)
class RunTime:
    """A model's run times: by scene, s, and relative to the reference of the run; `ratio` is the
    geometric mean of these."""

    model: str
    seconds: Mapping[str, float]
    ratios: Mapping[str, float]
    ratio: float | None


def run_times(run: Run) -> list[RunTime]:
    """Run times of all models; a ratio needs the reference to have run in the same scene."""
    base = {
        cell.scene: cell.cost.wall_seconds
        for cell in run.cells
        if cell.model == run.reference and cell.status == "done"
    }
    found = []
    for model in run.models:
        seconds = {
            cell.scene: cell.cost.wall_seconds
            for cell in run.cells
            if cell.model == model and cell.status == "done"
        }
        ratios = {
            scene: taken / base[scene]
            for scene, taken in seconds.items()
            if base.get(scene, 0.0) > 0.0 and taken > 0.0
        }
        found.append(
            RunTime(model, seconds, ratios, geometric_mean(ratios.values()) if ratios else None)
        )
    return found


@dataclass(frozen=True)
class TableEntry:
    """One figure of one model, with the check that it was held to, if any."""

    figure: Figure
    check: Check | None


@dataclass(frozen=True)
class MeasureRow:
    """A measure of all models: one that stands for its name and window, and what each model
    gave."""

    figure: Figure
    cells: tuple[TableEntry | None, ...]


@dataclass(frozen=True)
class MeasureTable:
    """All measures of a scene against one reference."""

    models: tuple[str, ...]
    rows: tuple[MeasureRow, ...]


def measure_table(view: SceneView, against: str) -> MeasureTable:
    """All figures of a scene that are held against `against`, a row a measure and window, a column
    a model."""
    found: dict[tuple[str, str], dict[str, TableEntry]] = {}
    for cell in view.cells:
        for check in cell.checks:
            _enter(found, cell.model, check.figure, check, against)
        for figure in cell.figures:
            _enter(found, cell.model, figure, None, against)
    models = tuple(
        cell.model for cell in view.cells if any(cell.model in row for row in found.values())
    )
    rows = (
        MeasureRow(next(iter(row.values())).figure, tuple(row.get(model) for model in models))
        for row in found.values()
    )
    return MeasureTable(
        models,
        tuple(sorted(rows, key=lambda row: (row.figure.measure, row.figure.until or float("inf")))),
    )


def _enter(
    found: dict[tuple[str, str], dict[str, TableEntry]],
    model: str,
    figure: Figure,
    check: Check | None,
    against: str,
) -> None:
    if figure.against == against:
        found.setdefault((figure.measure, figure.window), {}).setdefault(
            model, TableEntry(figure, check)
        )


def scene_facts(view: SceneView) -> list[tuple[str, str]]:
    """A scene in a few words: block, floor, walls, excitation, duration."""
    return display.scene_facts(view.scene)


def summary(view: SceneView) -> str:
    """The figure of a scene in words: each model's peak rotation, impacts and outcome."""
    said = []
    for model, history in view.histories.items():
        impacts = sum(event.kind in ("floor impact", "wall impact") for event in history.event_list)
        reached = (
            f"peak {number(history.peak_rotation / view.scene.block.alpha)} α, "
            if history.overturned_at is None
            else ""
        )
        said.append(f"{model}: {reached}{impacts} impacts, {history.fate}")
    return "; ".join(said) + "."


def events_of(history: str) -> str:
    """The address of the events beside a history's."""
    return events_path(Path(history)).as_posix()
