"""A finished run as data: the `run.json` that `rockcheck validate` writes.

Reports, CI and `rockcheck accept` read it. A run's folder holds

    run.json
        one `Run` (this module), a line a field, a scene or a cell; run.schema.json beside it
        describes it
    histories/<scene>--<model>--<key>.csv.gz
        one history a cell, `scenes.History.save` (path in `Cell.history`)
    histories/<scene>--<model>--<key>.events.csv.gz
        its events

This module does not know how a cell is simulated, compared or shown.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError, field_validator

from rockcheck.scenes import Cost, InputError, Scene, errors, printable, reading, writing
from rockcheck.validation.discrepancy import impact_laws
from rockcheck.validation.discrepancy.ensemble import Sample
from rockcheck.validation.discrepancy.figures import Figure, Stored
from rockcheck.validation.finding import Verdict
from rockcheck.validation.suite.verdict_scale import (
    FAILS,
    FOR_MACHINES,
    SEVERITY,
    WEIGHTS,
    CheckVerdict,
    CheckWeight,
    Strict,
    VerdictWords,
)
from rockcheck.validation.uncertainty import input_spread
from rockcheck.validation.uncertainty.numerical import Explanation, Numerical

RUN_FILE = "run.json"
SCHEMA_FILE = "run.schema.json"
FORMAT = 1
Status = Literal["done", "failed", "absent", "unavailable"]
#: The statuses of a cell whose model is not installed.
MISSING = ("absent", "unavailable")
#: "numerical": two solutions of the same equations. "model form": the reference forbids free
#: flight, the candidate does not. "measured": one of the two was measured. "exact": against a
#: closed form. "absolute": a figure of the cell itself against its expected value.
Kind = Literal["numerical", "model form", "measured", "exact", "absolute"]
#: What a run tells of a measure.
MeasureField = Literal["name", "label", "unit", "formula", "source"]


class Check(Stored):
    """A figure and the tolerance that it was judged by.

    The figure's distance from `ideal` (0 for differences, 1 for ratios, `expected` for absolute
    figures) may be at most `limit`; a value further than `drift` from `expected` is "better" or
    "changed". `limit` is None where the file has no tolerance; such a check never passes. `reason`
    says in one line why a check is no plain pass, `gap` what part of the window could not be
    compared. A value below `floor` means nothing; `beside` is the reference's figure, where that
    says which value is better.
    """

    figure: Figure
    kind: Kind
    verdict: CheckVerdict
    reason: str = ""
    ideal: float | None = None
    expected: float | None = None
    limit: float | None = None
    drift: float | None = None
    why: str = ""
    gap: str = ""
    floor: float = 0.0
    beside: float | None = None

    @property
    def weight(self) -> CheckWeight:
        """What the check counts as in the verdict on its cell."""
        return WEIGHTS[self.verdict]

    @property
    def waits_for_tolerance(self) -> bool:
        """Whether it fails for nothing but a tolerance, which its figure has not yet."""
        return self.limit is None and not self.gap and self.figure.value is not None

    def fails(self, strict: Strict) -> bool:
        """Whether the check is out of tolerance in a run of that strictness."""
        return self.verdict in FAILS[strict]

    @property
    def verdict_words(self) -> str:
        """The verdict for people: a figure without a tolerance has not failed."""
        return "no tolerance yet" if self.waits_for_tolerance else self.verdict


@dataclass(frozen=True, kw_only=True)
class CostRecord(Cost):
    """The cost of a cell's run; `worker_seconds` covers set-up, simulation and writing."""

    worker_seconds: float = 0.0


class Cell(Stored):
    """One scene played by one model.

    `status` "failed": no history (`reason` says why: a model's failure, a crash, a hang, memory);
    "absent": the model is not installed (`reason` says what to install); "unavailable": it has no
    wheel for this Python, either, or nobody named it and it cannot play the scene, or not in time;
    it does not count in the run. `history` is the path of its CSV
    relative to the run's folder. `read_back`: nothing that the cell depends on had changed, so that
    it was not run. `figures` are all measures, judged or not; `checks` those with a tolerance or in
    need of one.

    `numerical` is the run's numerical uncertainty, if the suite asks for it; `explanations` are the
    verdicts on the differences that follow from it. `impact_law` is the law of impacts that the
    history followed at the scene's first landing where laws part; it is not judged. `overturned_at`
    is the time (s) at which the block lay, None for one that stays. `traceback` is the path of a
    file in the run's folder, for an exception that no model may raise; it is `unexpected` in one of
    rockcheck's own models.
    """

    scene: str
    model: str
    settings: dict[str, Any] = Field(default_factory=dict)
    key: str = ""
    status: Status
    reason: str = ""
    traceback: str = ""
    unexpected: bool = False
    read_back: bool = False
    history: str | None = None
    outcome: str = ""
    overturned_at: float | None = None
    notes: tuple[str, ...] = ()
    cost: CostRecord = CostRecord()
    figures: tuple[Figure, ...] = ()
    checks: tuple[Check, ...] = ()
    numerical: Numerical | None = None
    explanations: tuple[Explanation, ...] = ()
    impact_law: impact_laws.LawFollowed | None = None

    @field_validator("history")
    @classmethod
    def _inside(cls, history: str | None) -> str | None:
        if history is not None and (
            PurePath(history).is_absolute()
            or ".." in PurePath(history).parts
            or not history.isprintable()
        ):
            raise InputError(
                f"{printable(history)} is not allowed: it must be a path within the run's folder"
            )
        return history

    @property
    def fate(self) -> str:
        """The outcome in words, with the time of overturning: "overturned left at 3.21 s"."""
        return (
            self.outcome
            if self.overturned_at is None
            else f"{self.outcome} at {self.overturned_at:.3g} s"
        )

    @property
    def converged(self) -> bool | None:
        """Whether the numerical error is known; None if not asked for, or the model has no step."""
        return None if self.numerical is None else self.numerical.converged

    @property
    def verdict_words(self) -> VerdictWords:
        """The worst of the cell's checks; "error" if the model failed, "incomplete" if missing."""
        if self.status != "done":
            return "error" if self.status == "failed" else "incomplete"
        weights: list[VerdictWords] = [
            "no tolerance yet" if check.waits_for_tolerance else check.weight
            for check in self.checks
        ]
        return max(weights, key=SEVERITY.index, default="pass")

    @property
    def verdict(self) -> Verdict:
        """The verdict for machines: a figure without a tolerance does not pass."""
        return FOR_MACHINES[self.verdict_words]


class EnsembleRecord(Stored):
    """The results of an ensemble: by model, peak |theta| in alpha and outcome of each scene.

    None and the reason where the model failed. The statistics are in the figures of the ensemble's
    cells, whose `scene` is the ensemble's name. `definition` is the table that the scenes are drawn
    from.
    """

    name: str
    description: str = ""
    definition: dict[str, Any]
    peaks: dict[str, tuple[float | None, ...]]
    outcomes: dict[str, tuple[str, ...]]

    @cached_property
    def samples(self) -> dict[str, Sample]:
        """By model: peaks (alpha, NaN where it failed) and outcomes of all scenes."""
        return {
            model: Sample(np.array(peaks, dtype=float), self.outcomes[model])
            for model, peaks in self.peaks.items()
        }

    @property
    def finished(self) -> dict[str, Sample]:
        """The `samples` of the models that have a result in every scene."""
        return {model: sample for model, sample in self.samples.items() if not sample.failures}


class Run(Stored):
    """All of one run of a suite.

    `scenes` holds each scene's `model_dump(mode="json")` by name, in the suite's order, `models`
    the models' names in order; a cell's `scene` may also be one of `ensembles`. `reference` is the
    model that judges numerical differences, `model_form` the one whose missing physics is shown
    beside it. `faults` are checks without a cell in the run (a tolerance whose cell is missing).
    """

    format: int = FORMAT
    suite: str
    description: str = ""
    created: str
    reference: str
    model_form: str = ""
    scenes: dict[str, dict[str, Any]]
    models: tuple[str, ...]
    cells: tuple[Cell, ...]
    faults: tuple[str, ...] = ()
    #: How each measure is defined, for the pages: see `validation.discrepancy.measures`.
    measures: tuple[Annotated[dict[MeasureField, str], Field(min_length=5)], ...] = ()
    versions: dict[str, str] = Field(default_factory=dict)
    hardware: dict[str, str] = Field(default_factory=dict)
    wall_seconds: float = 0.0
    strict: Strict = False
    #: False where nothing was to be judged, as by `rockcheck validate SCENE`.
    judged: bool = True
    tolerances_file: str = ""
    ensembles: tuple[EnsembleRecord, ...] = ()
    #: By scene, the effect of the spread of its inputs on its figures.
    inputs: dict[str, input_spread.Inputs] = Field(default_factory=dict)
    #: Scenes whose figure for a paper is drawn.
    printed: tuple[str, ...] = ()

    @property
    def wrong(self) -> tuple[str, ...]:
        """Why it does not pass, besides its cells: its faults, and where nothing was judged."""
        judged = any(check.verdict != "not defined" for _, check in self.checks())
        nothing = (
            "nothing was judged: no cell that finished has a figure that is defined here and is"
            " required or has a tolerance"
        )
        return self.faults if judged or not self.judged else (*self.faults, nothing)

    @property
    def verdict_words(self) -> VerdictWords:
        """The worst cell's verdict; at least "fail" where something is `wrong`.

        "not judged" if a run without judgement passes.
        """
        words: list[VerdictWords] = ["fail" if self.wrong else "pass"]
        words += [cell.verdict_words for cell in self.cells if cell.status != "unavailable"]
        worst = max(words, key=SEVERITY.index)
        return "not judged" if worst == "pass" and not self.judged else worst

    @property
    def verdict(self) -> Verdict:
        """The verdict for machines, as that of a cell."""
        return FOR_MACHINES[self.verdict_words]

    @property
    def exit_code(self) -> int:
        """0 pass, 1 out of tolerance (see `Strict`), 3 a model failed, else `errors.FAULT`."""
        if any(cell.unexpected for cell in self.cells):
            return errors.FAULT
        if self.verdict == "error":
            return 3
        return int(
            self.verdict == "fail"
            or any(check.fails(self.strict) for _, check in self.checks())
            or (bool(self.strict) and any(cell.status == "absent" for cell in self.cells))
        )

    @property
    def up_to_date(self) -> int:
        """How many cells were read back."""
        return sum(cell.read_back for cell in self.cells)

    @property
    def by_scene(self) -> dict[str, dict[str, Cell]]:
        """All cells by scene or ensemble, and by model, in the suite's order."""
        found: dict[str, dict[str, Cell]] = {}
        for cell in self.cells:
            found.setdefault(cell.scene, {})[cell.model] = cell
        return found

    @property
    def without_tolerance(self) -> int:
        """Number of figures that need a tolerance and have none yet; none of them passes."""
        return sum(check.waits_for_tolerance for _, check in self.checks())

    def checks(self) -> Iterator[tuple[Cell, Check]]:
        """All checks with their cells."""
        return ((cell, check) for cell in self.cells for check in cell.checks)

    def load_scene(self, name: str) -> Scene:
        """The scene of that name, rebuilt."""
        return Scene(**self.scenes[name])

    def save(self, folder: Path) -> Path:
        """Write `run.json` and its schema into `folder`, each whole or not at all.

        Makes the folder if need be. Returns the path of `run.json`.
        """
        writing.write_whole(
            writing.made(folder) / SCHEMA_FILE,
            json.dumps(self.model_json_schema(), indent=1, sort_keys=True) + "\n",
        )
        return writing.write_whole(
            folder / RUN_FILE, _by_line(json.loads(self.model_dump_json())) + "\n"
        )

    @classmethod
    def load(cls, folder: str | Path) -> Run:
        """The run in `folder`; raises `InputError` if there is none, or it has another format."""
        path = Path(folder) / RUN_FILE
        if not path.exists():
            raise InputError(f"{printable(path)}: no finished run here")
        data = reading.read_json(reading.within(path.parent, RUN_FILE))
        if isinstance(data, dict) and data.get("format") != FORMAT:
            found = (
                f"format {printable(data['format'])}; this version reads {FORMAT}"
                if "format" in data
                else "not the run of a suite"
            )
            raise InputError(f"{printable(path)}: {found}")
        try:
            run = cls.model_validate(data)
        except ValidationError as error:
            raise InputError(f"{printable(path)}: {errors.from_validation(error)}") from None
        for key, names, allowed in (
            ("reference", {run.reference}, {*run.models}),
            ("cells.model", {cell.model for cell in run.cells}, {*run.models}),
            (
                "cells.scene",
                {cell.scene for cell in run.cells},
                {*run.scenes, *(one.name for one in run.ensembles)},
            ),
        ):
            if unknown := sorted(names - allowed):
                raise InputError(
                    f"{printable(path)}: {key}: {printable(unknown[0])!r} is not in the"
                    f" run{errors.suggestion(unknown[0], allowed)}"
                )
        return run


def value_of(
    figures: Iterable[Figure], measure: str, against: str = "", window: str = ""
) -> float | None:
    """The value of a measure among some figures, None without one."""
    return next(
        (
            f.value
            for f in figures
            if (f.measure, f.against, f.window) == (measure, against, window)
        ),
        None,
    )


def _by_line(value: Any, depth: int = 2) -> str:
    """JSON with a line per value, and per element of a list or object, down to `depth`.

    It takes two thirds of the size of indented JSON.
    """
    if not depth or not value or not isinstance(value, dict | list):
        return json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    if isinstance(value, list):
        return "[\n" + ",\n".join(_by_line(one, depth - 1) for one in value) + "\n]"
    lines = (f"{json.dumps(key)}: {_by_line(one, depth - 1)}" for key, one in value.items())
    return "{\n" + ",\n".join(lines) + "\n}"
