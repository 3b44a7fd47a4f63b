"""What a suite plays and compares, and what each result depends on.

In: a `Suite`. Out: its cells and batches as tasks, each with the name of its kept result; for a
finished cell, the measures that are wanted and the key of its comparisons. `runs` calls it.
"""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

from rockcheck.scenes import NonNegative, Scene
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.discrepancy.figures import Measure, Stored
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, name_of
from rockcheck.validation.study import Task
from rockcheck.validation.suite import motions, results, tolerances
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.suite_file import SuiteFile
from rockcheck.validation.uncertainty import numerical


class CellRecord(Stored):
    """The kept record of a cell, beside its history."""

    outcome: str
    notes: tuple[str, ...]
    settings: dict[str, Any]
    uncertainty: dict[str, NonNegative]
    numerical: numerical.Numerical | None
    cost: results.CostRecord


class BatchRecord(Stored):
    """The kept record of a batch: peak |theta| in alpha and outcome of each scene.

    None and the reason where the model failed.
    """

    peaks: tuple[float | None, ...]
    outcomes: tuple[str, ...]
    cost: results.CostRecord


@dataclass(frozen=True)
class Planned(Task):
    """What one worker plays of a suite: a cell, or a batch of an ensemble.

    `scene_name` is the name of the scene, or of the ensemble. `key` is the hash of all that the
    result depends on, `kept_as` the name of its files, of the kind `store_kind`; the record there
    is a `record_type`.
    """

    kept_as: str = field()
    key: str = field(compare=False)
    scene_name: str = field(compare=False)
    scene: Scene = field(compare=False)
    variant: models.Work = field(compare=False)
    store_kind: ClassVar[str]
    record_type: ClassVar[type[Stored]]

    @property
    def label(self) -> str:
        """Scene and model."""
        return f"{self.scene_name}, {self.variant.label}"


@dataclass(frozen=True)
class PlannedCell(Planned):
    """A scene by a model; its numerical error is estimated if `uncertainty` asks for it."""

    uncertainty: bool = field(default=False, compare=False)
    store_kind = HISTORIES
    record_type = CellRecord

    def play(self) -> models.Played:
        """The history, and its record."""
        played = models.play(self.variant, self.scene, uncertainty=self.uncertainty)
        # validated: a user-defined model's history may say nonsense
        return replace(played, record=CellRecord(**played.record))


@dataclass(frozen=True)
class PlannedBatch(Planned):
    """The scenes `numbers` of an `ensemble` by a model; they are drawn from `scene`."""

    ensemble: motions.Ensemble = field(compare=False)
    numbers: range = field(compare=False)
    store_kind = COMPARISONS
    record_type = BatchRecord

    @property
    def label(self) -> str:
        """Ensemble, model and the number of the first scene."""
        return f"{super().label}, from {self.numbers.start}"

    def play(self) -> models.Played:
        """The peaks and outcomes of the scenes."""
        scenes = [self.ensemble.drawn(self.scene, number) for number in self.numbers]
        played = models.play_batch(self.variant, scenes)
        return replace(played, record=BatchRecord(**played.record))


@dataclass(frozen=True)
class Plan:
    """The cells of a suite by scene and model, and the batches by ensemble and model."""

    cells: Mapping[str, Mapping[str, PlannedCell]]
    batches: Mapping[str, Mapping[str, Sequence[PlannedBatch]]]

    def tasks(self) -> Iterator[Planned]:
        """All cells, scene by scene; then all batches."""
        for by_model in self.cells.values():
            yield from by_model.values()
        for batches_by_model in self.batches.values():
            for batches in batches_by_model.values():
                yield from batches

    def has(self, scene_name: str, model: str) -> bool:
        """Whether a model plays the scene or ensemble of that name."""
        by_model = self.cells.get(scene_name) or self.batches.get(scene_name) or {}
        return model in by_model


def plan(suite: Suite) -> Plan:
    """All that a suite plays."""
    cells: dict[str, dict[str, PlannedCell]] = {}
    batches: dict[str, dict[str, list[PlannedBatch]]] = {}
    owners = suite.owners
    for scene, variant, ensemble in suite.cells():
        if ensemble is None:
            config = owners[scene.name].config
            seconds = suite.seconds(scene.name, variant)
            cells.setdefault(scene.name, {})[variant.label] = _planned_cell(
                scene, variant, config, seconds
            )
        else:
            config = owners[ensemble.name].config
            batches.setdefault(ensemble.name, {})[variant.label] = [
                _planned_batch(scene, variant, config, ensemble, numbers)
                for numbers in ensemble.batches()
            ]
    return Plan(cells, batches)


def _planned_cell(
    scene: Scene, variant: models.Work, config: SuiteFile, seconds: float
) -> PlannedCell:
    settings = dict(variant.settings)
    if config.uncertainty:
        settings["uncertainty"] = provenance.code_digest(numerical.__name__)
    key = provenance.cell_key(scene, variant.family, settings, variant.search_path)
    return PlannedCell(
        kept_as=name_of(scene.name, variant.label, key),
        key=key,
        scene_name=scene.name,
        scene=scene,
        variant=variant,
        uncertainty=config.uncertainty,
        seconds=seconds,
        compiles=models.compiles(variant.family, variant.settings),
    )


def _planned_batch(
    scene: Scene,
    variant: models.Work,
    config: SuiteFile,
    ensemble: motions.Ensemble,
    numbers: range,
) -> PlannedBatch:
    """A batch, whose key covers how its scenes are drawn: no scene is drawn to look it up."""
    how_drawn = {
        "ensemble": ensemble.model_dump(mode="json", exclude={"count", "batch", "description"}),
        "code": provenance.code_digest(motions.__name__),
        "numbers": [numbers.start, numbers.stop],
    }
    settings = {**variant.settings, "drawn": how_drawn}
    key = provenance.cell_key(scene, variant.family, settings, variant.search_path)
    return PlannedBatch(
        kept_as=name_of(ensemble.name, variant.label, str(numbers.start), key),
        key=key,
        scene_name=ensemble.name,
        scene=scene,
        variant=variant,
        ensemble=ensemble,
        numbers=numbers,
        seconds=config.limits.seconds,
        compiles=models.compiles(variant.family, variant.settings),
    )


def in_order_of_play(tasks: Sequence[Planned]) -> list[Planned]:
    """The tasks in the order in which they begin.

    First one for each compiled code, since the others with that code wait for it; then those that
    take long, the longest scenes with the most walls first. Tasks of models that are compiled as a
    whole are quick, and fill the processes up to the end.
    """
    first_of_code: dict[str, Planned] = {}
    for task in tasks:
        first_of_code.setdefault(task.compiles, task)

    def rank(task: Planned) -> tuple[bool, bool, float]:
        compiles_first = bool(task.compiles) and first_of_code[task.compiles] is task
        is_quick = models.family(task.variant.family).compiled != ""
        effort = task.scene.duration * (1 + len(task.scene.walls))
        return not compiles_first, is_quick, -effort

    return sorted(tasks, key=rank)


#: Names of measures by window ("" is the whole time).
MeasuresByWindow = Mapping[str, Sequence[str]]


def wanted_measures(
    yardsticks: Iterable[str],
    required: Collection[tolerances.ToleranceKey],
    finished: Collection[str],
) -> dict[str, MeasuresByWindow]:
    """The measures of a cell, by the reference that they are taken against.

    `yardsticks` are the references (`tolerances.CELL_FIGURES`: the history itself); only models
    that have `finished` serve. Over the whole time all measures are wanted that are not on request,
    else the `required` ones.
    """
    wanted: dict[str, MeasuresByWindow] = {}
    for yardstick in yardsticks:
        if yardstick == tolerances.CELL_FIGURES:
            wanted[yardstick] = _by_window(yardstick, measures.FIGURES, required)
        elif yardstick in finished:
            wanted[yardstick] = _by_window(yardstick, measures.DIFFERENCES, required)
    return wanted


def _by_window(
    yardstick: str,
    book: Mapping[str, Measure],
    required: Collection[tolerances.ToleranceKey],
) -> MeasuresByWindow:
    windows = {"": [name for name, measure in book.items() if not measure.on_request]}
    for key in sorted(required):
        if key.against != yardstick:
            continue
        if key.window or tolerances.MEASURES[key.measure].on_request:
            windows.setdefault(key.window, []).append(key.measure)
    return windows


def window_ends(
    wanted: Mapping[str, MeasuresByWindow], horizon: Callable[[], float]
) -> dict[str, float]:
    """The end of each window, s; `horizon` is asked only where a window ends there."""
    ends: dict[str, float] = {}
    for windows in wanted.values():
        for window in windows:
            if window and window not in ends:
                ends[window] = (
                    horizon() if window == tolerances.HORIZON else float(window.removesuffix("s"))
                )
    return ends


@dataclass(frozen=True)
class ComparedKey:
    """A reference in a `ComparisonKey`: its history, as there, and what is measured."""

    against: str
    history: str
    measures: MeasuresByWindow


@dataclass(frozen=True)
class ComparisonKey:
    """All that the comparisons of a cell depend on.

    `history` is the hash of the history that the cell has, `window_ends` are in s, `code` is the
    hash of the code that compares.
    """

    history: str
    references: tuple[ComparedKey, ...]
    window_ends: Mapping[str, float]
    code: str

    def name(self, cell: PlannedCell) -> str:
        """The name of the kept comparisons."""
        text = json.dumps(asdict(self), sort_keys=True)
        return name_of(cell.scene_name, cell.variant.label, provenance.digest(text))
