"""A stress study whose workers fail: one run kills its process, another never ends."""

import os
import time
from collections import Counter
from typing import Any

from rockcheck.validation.studies.stress.runs import RunTotals
from rockcheck.validation.studies.stress.study import Stress


class Deadly(Stress):
    """Run 3 kills its process, run 13 hangs."""

    @staticmethod
    def play(task: Any) -> Any:
        runs = range(task.first, task.first + task.count)
        if 3 in runs:
            os._exit(9)
        if 13 in runs:
            time.sleep(600.0)
        return RunTotals(model=task.model, counts=Counter(runs=task.count))
