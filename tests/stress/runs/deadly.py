"""Stress studies whose workers fail: some runs kill their process, or never end."""

import os
import time
from collections import Counter
from typing import Any

from rockcheck.scenes import Scene
from rockcheck.validation.studies.stress.invariants import CheckedRun
from rockcheck.validation.studies.stress.runs import Broken, Chunk, EventBased, RunTotals
from rockcheck.validation.studies.stress.study import Stress

FAILING = (3, 4, 5, 13)


class Stubborn(Stress):
    """Every scene fails. As they shrink, run 13 kills its process, run 4 takes its time, run 3
    never ends once it has no walls."""

    @staticmethod
    def play(task: Any) -> Any:
        if isinstance(task, Chunk):
            failures = [Broken("ebm", "mirror", 1, number, 1.0) for number in FAILING]
            return RunTotals(model=task.model, counts=Counter(runs=task.count), failures=failures)

        def check(
            self: EventBased, scene: Scene, seed: int, number: int, only: str = ""
        ) -> CheckedRun:
            if number == 13:
                os._exit(9)
            if number == 4:
                time.sleep(0.5)
            if number == 3 and not scene.walls:
                time.sleep(600.0)
            return CheckedRun(figures={"mirror": 1.0})

        # The players are frozen, and a process that dies can be shown only by one that does.
        EventBased.check = check  # type: ignore[method-assign]
        return task.play()
