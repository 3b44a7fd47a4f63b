"""The tasks of a suite: found in the store or played, kept, and compared scene by scene.

In: a `Suite` and the folder that keeps its results. Out: what each task gave, and the comparisons
of each cell. `runner` has them played.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, Store
from rockcheck.validation.study import TaskSource
from rockcheck.validation.suite import comparing, planning, scene_results
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.planning import Planned, PlannedCell


class SuiteTasks(TaskSource):
    """The cells and batches of a suite, which are kept and read back in `folder`.

    A scene's cells are compared as soon as the last of them has ended, while others are played.
    """

    name = "suite"
    kinds = (HISTORIES, COMPARISONS)

    def __init__(self, suite: Suite, folder: Path) -> None:
        self.suite, self.store = suite, Store(folder)
        self.owners = suite.owners
        self.memory_mb = max(
            (member.config.limits.memory_mb for member in suite.members), default=None
        )
        self.plan = planning.plan(suite)
        #: What each task that has ended gave, without files, or why it gave nothing.
        self.outcomes: dict[Planned, models.Played | pool.Failure] = {}
        self.comparisons: dict[PlannedCell, comparing.ComparisonRecord] = {}
        for task in self.plan.tasks():
            missing = models.not_installed(task.variant.family)
            if missing:
                self.outcomes[task] = pool.Failure(missing)
        self.playable = [task for task in self.plan.tasks() if task not in self.outcomes]

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Planned]:
        """All cells and batches of models that are installed, in the order in which they begin."""
        return planning.in_order_of_play(self.playable)

    def find(self, store: Store, task: Any) -> models.Played | None:
        """The kept record of a batch, or of a cell whose history is whole; else None."""
        content = store.get(task.store_kind, task.kept_as)
        with suppress(ValueError):  # a kept record may lack fields that it must have
            return models.Played(task.record_type(**(content or {})), read_back=True)
        return None

    def keep(self, store: Store, task: Any, record: models.Played) -> None:
        """Keep a history or a batch; not a batch of which a scene failed unexpectedly."""
        if record.traceback:
            return
        content = record.record.model_dump(mode="json")
        store.put(task.store_kind, task.kept_as, content, record.files, record.history)

    def on_end(self, task: Any, outcome: Any) -> None:
        """Compare the cells of a scene once all of them have ended."""
        if isinstance(outcome, models.Played):
            outcome = replace(outcome, files={}, history=None)
        self.outcomes[task] = outcome
        if not isinstance(task, PlannedCell):
            return
        cells = self.plan.cells[task.scene_name].values()
        if any(cell not in self.outcomes for cell in cells):
            return
        for cell in cells:
            if self._is_played(cell):
                self.comparisons[cell] = self._comparison(cell)

    def scatter(self, scene_name: str, model: str) -> Mapping[str, float]:
        """The scatter of the repeats of a measured history that was played, by quantity."""
        outcome = self.outcomes[self.plan.cells[scene_name][model]]
        assert isinstance(outcome, models.Played)
        scatter: Mapping[str, float] = outcome.record.uncertainty
        return scatter

    def _is_played(self, cell: PlannedCell) -> bool:
        return isinstance(self.outcomes[cell], models.Played)

    def _comparison(self, cell: PlannedCell) -> comparing.ComparisonRecord:
        """The comparisons of a cell with its references that finished, kept in the store."""
        owner, label = self.owners[cell.scene_name], cell.variant.label
        required = owner.required(cell.scene_name, label)
        references = {
            model: other
            for model, other in self.plan.cells[cell.scene_name].items()
            if other is not cell and self._is_played(other)
        }
        wanted = planning.wanted_measures(owner.yardsticks(required), required, references)
        ends = planning.window_ends(
            wanted, lambda: scene_results.horizon_of(self.store, cell.scene)
        )
        key = planning.ComparisonKey(
            history=self._seal_of(cell),
            references=tuple(
                planning.ComparedKey(
                    against,
                    self._seal_of(references[against]) if against in references else "",
                    windows,
                )
                for against, windows in wanted.items()
            ),
            window_ends=ends,
            code=provenance.code_digest(comparing.__name__),
        )

        def compared() -> comparing.ComparisonRecord:
            landing = scene_results.landing_of(self.store, cell.scene)
            request = comparing.Request(
                cell.scene, wanted, ends, landing, offset=_offset_of(cell.variant)
            )
            histories = {
                against: self._reference(references[against], with_laws=landing is not None)
                for against in wanted
                if against in references
            }
            return comparing.compare_cell(self.store.load(cell.kept_as), histories, request)

        return self.store.once(COMPARISONS, key.name(cell), comparing.ComparisonRecord, compared)

    def _seal_of(self, cell: PlannedCell) -> str:
        """What was played, not what was to be: a cell that is played again may differ.

        A user's own model need not play alike, and no key knows the processor or a library's build.
        """
        return self.store.seal_of(HISTORIES, cell.kept_as)

    def _reference(self, cell: PlannedCell, *, with_laws: bool) -> comparing.Reference:
        history, offset = self.store.load(cell.kept_as), _offset_of(cell.variant)
        if not with_laws:
            return comparing.Reference(history, offset=offset)
        others = comparing.histories_under_other_laws(cell.scene, cell.variant)
        return comparing.Reference(history, others, offset)


def _offset_of(variant: models.Work) -> float | None:
    """What a measured history's model adds to its times, s; None of a model that plays."""
    if variant.family != "measured":
        return None
    return float(variant.settings.get("offset", 0.0))
