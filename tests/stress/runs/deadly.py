"""Stands in for `validation.stress.study.play_some`, in worker processes: some runs kill their process, or never end."""

from __future__ import annotations

import os
import time
from collections import Counter

from validation.stress.study import Batch


def play_some(label: str, seed: int, first: int, count: int) -> Batch:
    """Run 3 kills its process, run 13 hangs."""
    for number in range(first, first + count):
        if number == 3:
            os._exit(9)
        if number == 13:
            time.sleep(600.0)
    return Batch(model=label, runs=count, looked_at=Counter({"ends": count}))
