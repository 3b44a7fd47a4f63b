"""`rockcheck warm`: compiles the models' code ahead, in several processes.

A user then waits for no compiler.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rich.table import Table

from rockcheck.commands import JobsOption, answer, console, progress
from rockcheck.scenes import Scene, load_scene
from rockcheck.scenes.progress import OnProgress, announcing, unheard
from rockcheck.validation.execute.models import build
from rockcheck.validation.execute.pool import Call, Pool


def _played(name: str) -> tuple[Any, Scene]:
    model, scene = build(name), load_scene("fig5a").replace(duration=0.1)
    model.simulate(scene)
    return model, scene


def _batches(name: str) -> None:
    from rockcheck.ebm.batch import pack, play_ensemble, run_batch

    model, scene = _played(name)
    run_batch(pack([scene], model), model, jobs=1)
    play_ensemble([scene], model)


def _engine_steps() -> None:
    from rockcheck.engines.adaptive import march_adaptively
    from rockcheck.engines.base_motion import BaseMotion
    from rockcheck.engines.marching import in_units_of

    scene = load_scene("fig5a").replace(duration=0.1)
    scene = in_units_of(scene.block.radius, scene)
    march_adaptively(
        scene, BaseMotion(scene), lambda pose, velocity, dt, felt, bouncing: velocity, longest=1e-3
    )


#: The parts that are compiled, the longest first. Batches share the loop of histories, so they come
#: after it and in one process with it.
PARTS: Mapping[str, Callable[[], object]] = {
    "the event-based models with the unilateral pivot": partial(_batches, "ebm-unilateral"),
    "the event-based models: histories, batches, ensembles": partial(_batches, "ebm"),
    "the event-based model with Bouc-Wen friction": partial(_played, "ebm-bouc-wen"),
    "the continuous model": partial(_played, "cm"),
    "the physics engines: their adaptive steps": _engine_steps,
}


def warm(jobs: int, *, on_progress: OnProgress = unheard) -> dict[str, float]:
    """Compile what is not in the cache, in up to `jobs` processes.

    Returns the time of each part of `PARTS`, s. Raises the error of a part.
    """
    taken: dict[str, float] = {}
    on_progress(0, len(PARTS), "")
    with Pool(max(1, min(jobs, len(PARTS)))) as pool:
        for ended in pool.run(deque(Call(compile_part, (name,), key=name) for name in PARTS)):
            if ended.error is not None:
                raise ended.error
            taken[ended.call.key] = ended.result
            on_progress(len(taken), len(PARTS), ended.call.key)
    return {name: taken[name] for name in PARTS}


def compile_part(name: str) -> float:
    """Compile one part of `PARTS`, or find it in the cache; returns how long that took, s."""
    began = time.perf_counter()
    PARTS[name]()
    return time.perf_counter() - began


def run(jobs: JobsOption = None) -> None:
    """Compile the models' code ahead.

    Models compile their code on their first run on a machine, and once more after an update of
    rockcheck; what is compiled already is only looked up. Afterwards no command waits for a
    compiler.
    """
    screen = console()
    screen.print(f"compiling {len(PARTS)} parts, what is compiled already is only looked up")
    with progress("compiling") as on_progress, announcing(None):
        taken = warm(jobs or os.cpu_count() or 1, on_progress=on_progress)
    table = Table(box=None, pad_edge=False)
    table.add_column("compiled code for")
    table.add_column("s", justify="right")
    for name, seconds in taken.items():
        table.add_row(name, f"{seconds:.1f}")
    screen.print(table)
    answer({"seconds": taken})
