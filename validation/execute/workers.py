"""How a worker plays a cell or a batch of scenes."""

import dataclasses
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import Cost, History, InputError, ModelFailure, Scene
from rockcheck.scenes.base import MOST
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build_own, is_own
from rockcheck.validation.execute.pool import Failure, guarded
from rockcheck.validation.uncertainty.numerical import failed, numerical_uncertainty

#: What a batch sums of the cost of its runs.
SUMMED = ("wall_seconds", "cpu_seconds", "set_up", "steps", "evaluations")


@dataclass(frozen=True, kw_only=True)
class Work:
    """The model that a worker plays: its label in the suite, the name of its family, its settings.

    `search_path` holds folders in which a user-defined model may lie.
    """

    label: str
    family: str
    settings: dict[str, Any]
    search_path: tuple[str, ...] = ()


@dataclass(frozen=True)
class Played:
    """The result of a worker: the record, and the history's files by suffix.

    `history` is the content of the files, None for a batch and for a user-defined model, which may
    return anything. `traceback` is that of an exception in a scene of a batch.
    """

    record: dict[str, Any]
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    history: History | None = field(default=None, repr=False)
    traceback: str = ""


def play(work: Work, scene: Scene, *, uncertainty: bool = False) -> Played:
    """The history of a scene, with its numerical error if `uncertainty` asks for it.

    Raises the model's errors.
    """
    began = time.perf_counter()
    history = _simulate(work, scene)
    cost = {key: value for key, value in vars(history.cost).items() if value is not None}
    record = {
        "outcome": history.outcome,
        "notes": list(history.notes),
        "settings": {  # as plain JSON values, sorted as the store returns them
            str(key): value if isinstance(value, str | int | float | bool | None) else str(value)
            for key, value in sorted(history.settings.items(), key=lambda item: str(item[0]))
        },
        "uncertainty": dict(history.uncertainty),
        "numerical": _numerical(work, scene, history) if uncertainty else None,
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    return Played(record, history.packed(), None if is_own(work.family) else history)


def play_batch(work: Work, scenes: Sequence[Scene]) -> Played:
    """Peak |theta| (alpha) and outcome of each scene; None and the reason where it failed."""
    began = time.perf_counter()
    found = [guarded(_end_of, work, scene) for scene in scenes]
    costs = [one[2] for one in found if not isinstance(one, Failure)]
    ends = [(None, one.reason) if isinstance(one, Failure) else one[:2] for one in found]
    cost = {key: sum(getattr(one, key) for one in costs) for key in SUMMED}
    record = {
        "peaks": [peak for peak, _ in ends],
        "outcomes": [outcome for _, outcome in ends],
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    traces = (one.traceback for one in found if isinstance(one, Failure) and one.traceback)
    return Played(record, traceback=next(traces, ""))


def _end_of(work: Work, scene: Scene) -> tuple[float, str, Cost]:
    history = _simulate(work, scene)
    return history.peak_rotation / scene.block.alpha, history.outcome, history.cost


def _simulate(work: Work, scene: Scene) -> History:
    """The history; raises `ModelFailure` for what is none, is empty or has a value not finite."""
    sys.path.extend(path for path in work.search_path if path not in sys.path)
    returned: object = build_own(work.family, work.settings).simulate(scene)
    if not isinstance(returned, History):
        raise ModelFailure(
            f"{work.family} returned {type(returned).__name__}; `simulate` must return a"
            " rockcheck.History"
        )
    for name, column in returned.channels.items():
        if column.dtype.kind == "f" and not np.all(np.abs(column) <= MOST):  # NaN, too
            row = int(np.flatnonzero(~(np.abs(column) <= MOST))[0])
            raise ModelFailure(f"{name} is {column[row]} at t = {returned.channels['t'][row]:g} s")
    if not len(returned.channels["t"]):
        raise ModelFailure("the history is empty")
    return dataclasses.replace(returned, model=work.label)


def _numerical(work: Work, scene: Scene, history: History) -> dict[str, Any] | None:
    """Numerical uncertainty of a run; None for a model without a step.

    If a coarser run fails, the result is not converged.
    """
    try:
        found = numerical_uncertainty(build_own(work.family, work.settings), scene, history)
    except (ModelFailure, InputError) as error:
        found = failed(history, f"a coarser run failed: {printable(error)}")
    return None if found is None else found.model_dump(mode="json")
