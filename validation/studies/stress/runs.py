"""Runs of a model as tasks, what they add up to, and the scene files of failures.

In: a label of `PLAYERS`, a seed and numbers of runs. Out: `RunTotals`, scene files. Called by the
study.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from rockcheck.scenes import (
    Scene,
    files,
    printable,
)
from rockcheck.validation.execute import models, pool
from rockcheck.validation.studies.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.studies.stress.shrinking import shrink
from rockcheck.validation.study import Task

#: Time limit (s) of a run on average, and of a slow player's, and its ratio to the usual time; then
#: the time (s) that a task may take in addition.
A_RUN, A_SLOW_RUN, AMPLE, PATIENCE = 0.2, 2.0, 50.0, 20.0
#: Failures of a model and an invariant that are written as scenes.
MOST_FILES = 20


@dataclass(frozen=True)
class Broken:
    """A run that breaks an invariant."""

    model: str
    invariant: str
    seed: int
    number: int
    figure: float
    words: str = ""

    @property
    def scene(self) -> Scene:
        """The run's scene as it was played."""
        return PLAYERS[self.model].scene(self.seed, self.number)

    @property
    def name(self) -> str:
        """The name of the run's scene file."""
        return f"{self.model.replace(' ', '-')}-{self.invariant}-{self.seed}-{self.number}.toml"

    def text(self, scene: Scene, remark: str) -> str:
        """Its scene file with a scene that shows it."""
        settings = PLAYERS[self.model].settings(scene, self.number)
        options = [
            f"--set {key}={value if isinstance(value, str) else repr(value).lower()}"
            for key, value in settings.items()
        ]
        words = (
            f"{self.invariant}: {INVARIANTS[self.invariant].words}",
            printable(self.words, 200),
            remark,
            # No model's name has Housner's block, which never slips.
            'python -c "import rockcheck as rc;'
            f" rc.EventBasedModel(friction='no-slip').simulate(rc.load_scene('{self.name}'))"
            ".save('history.csv')\""
            if "friction" in settings
            else " ".join(
                [f"rockcheck simulate {self.name} --model {self.model.split()[0]}", *options]
            ),
        )
        # the name is the file's own
        tables = {key: part for key, part in files.tables_of(scene).items() if key != "name"}
        return files.scene_text(tables, "\n".join(filter(None, words)))


@dataclass(kw_only=True)
class RunTotals:
    """Totals of some runs of one model."""

    model: str
    cpu_seconds: float = 0.0
    #: Number of runs that checked an invariant, and in which it could not be judged; its worst
    #: figure, and the run of that figure.
    looked_at: Counter[str] = field(default_factory=Counter)
    unjudged: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int]] = field(default_factory=dict)
    failures: list[Broken] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    #: How often each modelling choice of the model was made, by its name.
    rules: Counter[str] = field(default_factory=Counter)
    #: "runs", "events", runs in which an impact added energy, as its law is known to do
    #: ("gaining"), and whose comparison ended at the horizon of predictability ("horizons").
    counts: Counter[str] = field(default_factory=Counter)
    #: Largest energy that an impact added, as a share of the energy before it.
    largest_gain: float = 0.0

    def see(self, played: CheckedRun, seed: int, number: int) -> None:
        """Count one more run."""
        self.add(
            RunTotals(
                model=self.model,
                looked_at=Counter(played.figures.keys()),
                unjudged=Counter(played.unjudged),
                worst={
                    name: (math.inf if math.isnan(figure) else figure, number)
                    for name, figure in played.figures.items()
                },
                failures=[
                    Broken(self.model, name, seed, number, played.figures[name], played.failure)
                    for name in played.broken
                ],
                outcomes=Counter([played.outcome or "failed"]),
                rules=Counter(played.rules),
                counts=Counter({"runs": 1, **played.counts}),
                largest_gain=played.largest_gain,
            )
        )

    def add(self, other: RunTotals) -> None:
        """Add the totals of other runs."""
        for name, worst in other.worst.items():
            self.worst[name] = max(worst, self.worst.get(name, worst))
        self.largest_gain = max(self.largest_gain, other.largest_gain)
        for key in vars(self).keys() - {"model", "worst", "largest_gain"}:
            setattr(self, key, getattr(self, key) + getattr(other, key))

    @property
    def shown(self) -> list[Broken]:
        """The first runs that break each invariant: their scenes are written."""
        ordered = sorted(self.failures, key=lambda failure: failure.number)
        shown = []
        for name in INVARIANTS:
            shown += [failure for failure in ordered if failure.invariant == name][:MOST_FILES]
        return shown


@dataclass(frozen=True)
class Chunk(Task):
    """Runs `first` to `first + count - 1` of a model under a seed."""

    model: str
    seed: int
    first: int
    count: int

    @property
    def label(self) -> str:
        """For progress and failures."""
        return f"{self.model}, runs {self.first} to {self.first + self.count - 1}"

    def play(self) -> RunTotals:
        """The totals of the runs."""
        began, totals = time.process_time(), RunTotals(model=self.model)
        for number in range(self.first, self.first + self.count):
            totals.see(
                checked(
                    self.model, PLAYERS[self.model].scene(self.seed, number), self.seed, number
                ),
                self.seed,
                number,
            )
        totals.cpu_seconds = time.process_time() - began
        return totals


def checked(label: str, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
    """One checked run; an exception of the program counts as a failure like any other."""
    result: CheckedRun | pool.Failure = pool.guarded(
        PLAYERS[label].check, scene, seed, number, only
    )
    if isinstance(result, pool.Failure):  # the other runs go on
        return CheckedRun(figures={"ends": math.inf}, failure=result.reason)
    return result


@dataclass(frozen=True)
class Shrinking(Task):
    """The search for a smaller scene that fails in the same way, in so many trials."""

    broken: Broken
    trials: int

    @property
    def label(self) -> str:
        """For progress and failures."""
        return f"smallest scene of {self.broken.name}, {self.trials} trials"

    def play(self) -> str:
        """The file of the smallest scene that was found."""
        broken, name = self.broken, self.broken.invariant
        most = math.inf if name == "ends" else 100.0 * INVARIANTS[name].bound

        def shows(scene: Scene) -> bool:
            played = checked(broken.model, scene, broken.seed, broken.number, name)
            return (
                name in played.broken
                and played.figures[name] >= min(broken.figure, most)
                # A fault of the program: the same one.
                and (
                    broken.figure < math.inf
                    or played.failure.partition(":")[0] == broken.words.partition(":")[0]
                )
            )

        if not shows(broken.scene):
            return broken.text(broken.scene, "as it was found: it does not fail again")
        scene, complete = shrink(broken.scene, shows, self.trials)
        return broken.text(
            scene, "" if complete else "not the smallest: not all that is simpler was tried"
        )


def limits(model: str, runs: int) -> dict[str, Any]:
    """For a `Task`: time limit and usual time (s) of so many runs, and what they compile.

    The limit is far more than they take, and short enough for a hang to be found soon.
    """
    a_run = A_SLOW_RUN if PLAYERS[model].slow else A_RUN
    return {
        "seconds": PATIENCE + runs * a_run,
        "expected": runs * a_run / AMPLE,
        "compiles": models.compiles(model.split()[0]),
    }


def parts(task: Task) -> Sequence[Task]:
    """Smaller tasks in place of one whose process hangs or dies."""
    if isinstance(task, Chunk) and task.count > 1:
        half = task.count // 2
        return [
            replace(task, first=first, count=count, **limits(task.model, count))
            for first, count in ((task.first, half), (task.first + half, task.count - half))
        ]
    if isinstance(task, Shrinking) and task.trials > 1:
        fewer = task.trials // 4
        return [replace(task, trials=fewer, **limits(task.broken.model, fewer))]
    return []
