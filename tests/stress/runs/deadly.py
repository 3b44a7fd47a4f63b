"""Stands in for functions of `validation.studies.stress.study`, in worker processes: some runs kill their process, or never end."""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path

from rockcheck.scenes import Scene
from rockcheck.validation.studies.stress import study
from rockcheck.validation.studies.stress.invariants import CheckedRun
from rockcheck.validation.studies.stress.players import EventBased
from rockcheck.validation.studies.stress.results import Failure, RunTotals


def play_some(label: str, seed: int, first: int, count: int) -> RunTotals:
    """Run 3 kills its process, run 13 hangs."""
    for number in range(first, first + count):
        if number == 3:
            os._exit(9)
        if number == 13:
            time.sleep(600.0)
    return RunTotals(model=label, runs=count, looked_at=Counter({"ends": count}))


def shrink_file(failure: Failure, folder: Path, seconds: float) -> None:
    """Every scene fails. Run 13 kills its process, run 4 takes its time, run 3 never ends once it has no walls."""

    def check(self: EventBased, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        if number == 13:
            os._exit(9)
        if number == 4:
            time.sleep(0.5)
        if number == 3 and not scene.walls:
            time.sleep(600.0)
        return CheckedRun(figures={"mirror": 1.0})

    # The players are frozen, and a process that dies can be shown only by one that does.
    EventBased.check = check  # type: ignore[method-assign]
    study.shrink_file(failure, folder, seconds)
