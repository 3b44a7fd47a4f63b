"""`rockcheck warm`: compiles the models' code ahead, in several processes.

A user then waits for no compiler.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial

from rockcheck.commands import JobsOption, answer, console, progress
from rockcheck.scenes import load_scene
from rockcheck.scenes.progress import announcing
from rockcheck.validation.execute.models import build
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.finding import Column, Finding, Table, text


def _play(*names: str) -> None:
    for name in names:
        build(name).simulate(load_scene("fig5a").replace(duration=0.1))


def _engine_steps() -> None:
    from rockcheck.engines.steps import adaptive_march, in_units_of

    scene = load_scene("fig5a").replace(duration=0.1)
    scene = in_units_of(scene.block.radius, scene)
    adaptive_march(scene, lambda pose, velocity, dt, felt, bouncing: velocity, longest=1e-3)


#: The parts that are compiled, the longest first. The event loops of both kinds of friction share
#: functions, so that one process compiles them in two thirds of the time.
PARTS: Mapping[str, Callable[[], object]] = {
    "the event-based models": partial(_play, "ebm", "ebm-bouc-wen"),
    "the continuous model": partial(_play, "cm"),
    "the physics engines: their adaptive steps": _engine_steps,
}


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
    from rockcheck.reports.document import show

    console().print(f"compiling {len(PARTS)} parts, what is compiled already is only looked up")
    taken: dict[str, float] = {}
    pool = Pool(min(jobs or os.cpu_count() or 1, len(PARTS)))
    with progress("compiling") as on_progress, announcing(None), pool:
        on_progress(0, len(PARTS), "")
        for ended in pool.run(deque(Call(compile_part, (name,), key=name) for name in PARTS)):
            if ended.error is not None:
                raise ended.error
            taken[ended.call.key] = ended.result
            on_progress(len(taken), len(PARTS), ended.call.key)
    seconds = {name: taken[name] for name in PARTS}
    columns = [text("compiled code for"), Column("s", digits=2)]
    show(Finding("warm", "", "", [Table("compiled", columns, list(seconds.items()))]), console())
    answer({"seconds": seconds})
