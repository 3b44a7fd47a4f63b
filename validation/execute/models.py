"""The models by the names that suites and the command line use, and how a worker plays them."""

import importlib
import inspect
import sys
import tempfile
import time
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from rockcheck.engines import registry
from rockcheck.scenes import Cost, History, InputError, ModelFailure, Scene, errors, printable
from rockcheck.scenes.base import MOST
from rockcheck.validation.execute import pool
from rockcheck.validation.uncertainty import numerical


class Model(Protocol):
    """The protocol of a model: a frozen, validated object with its settings as fields."""

    def simulate(self, scene: Scene) -> History:
        """The block's motion; raises `scenes.ModelFailure` where the model cannot finish."""


@dataclass(frozen=True)
class Family:
    """A named kind of model: its class, the settings that the name fixes, and its libraries.

    Its results depend on the versions of `libraries`, and of `NUMBERS`.
    """

    module: str
    class_name: str
    summary: str
    fixed: Mapping[str, Any] = field(default_factory=dict)
    libraries: tuple[str, ...] = ()
    #: Whether the block can leave the floor; a model that cannot differs in form from one that can.
    flies: bool = True
    #: The loop that is compiled for it, perhaps for others too: a run takes milliseconds.
    compiled: str = ""


#: The fair reference for engines, and the model that forbids flight.
REFERENCE, PAPER_MODEL = "ebm-unilateral", "ebm"
#: What every model calculates with; and the libraries of those whose loops are compiled.
NUMBERS = ("numpy", "scipy")
COMPILED = ("numba", "llvmlite", *NUMBERS)
#: Value of `time_step` for adaptive steps, whose compiled code the engines share.
ADAPTIVE = "adaptive"
#: The models that rockcheck computes itself.
EQUATIONS: dict[str, Family] = {
    "ebm": Family(
        "rockcheck.ebm",
        "EventBasedModel",
        "event-based model of the paper: exact stick-slip, no free flight",
        {"pivot": "bilateral", "friction": "coulomb"},
        COMPILED,
        flies=False,
        compiled="event loop",
    ),
    "ebm-unilateral": Family(
        "rockcheck.ebm",
        "EventBasedModel",
        "event-based model whose floor can only push: the block may hop",
        {"pivot": "unilateral", "friction": "coulomb"},
        COMPILED,
        compiled="event loop",
    ),
    "ebm-bouc-wen": Family(
        "rockcheck.ebm",
        "EventBasedModel",
        "event-based model with the paper's regularised friction",
        {"pivot": "bilateral", "friction": "bouc-wen"},
        COMPILED,
        flies=False,
        compiled="event loop, Bouc-Wen",
    ),
    "cm": Family(
        "rockcheck.cm",
        "ContinuousModel",
        "the paper's penalty-based continuous model",
        {},
        COMPILED,
        compiled="continuous model",
    ),
}
#: The model that plays back what others computed or measured.
MEASURED = {
    "measured": Family(
        "rockcheck.validation.discrepancy.measured",
        "Measured",
        "a CSV history from a shake table, or from any other program",
    ),
}
#: Names of the physics engines, installed or not.
ENGINE_NAMES = registry.names()


class _Families(Mapping[str, Family]):
    """The families by name; that of an engine is made from its record when it is first needed."""

    def __getitem__(self, name: str) -> Family:
        if name in ENGINE_NAMES:
            return _family_of_engine(name)
        if name in MEASURED:
            return MEASURED[name]
        return EQUATIONS[name]

    def __iter__(self) -> Iterator[str]:
        return iter((*EQUATIONS, *ENGINE_NAMES, *MEASURED))

    def __len__(self) -> int:
        return len(EQUATIONS) + len(ENGINE_NAMES) + len(MEASURED)


@cache
def _family_of_engine(name: str) -> Family:
    """An engine's family; the steps of one that can vary them are compiled."""
    facts = registry.facts_of(name)
    compiled = COMPILED if facts.steps_vary else ()
    return Family(
        facts.engine.__module__,
        facts.engine.__name__,
        facts.summary,
        libraries=(facts.distribution, *compiled),
    )


#: All models, in the order in which they are listed.
FAMILIES: Mapping[str, Family] = _Families()


def family(name: str) -> Family:
    """The family of that name, or of a user-defined model "module:Class".

    Raises `InputError`, suggesting the nearest name, for an unknown one.
    """
    module, colon, class_name = name.partition(":")
    if colon and module.isidentifier() and class_name.isidentifier():
        return Family(module, class_name, "a model of the user's own")
    return FAMILIES[errors.one_of("model", name, FAMILIES)]


def not_installed(name: str) -> str:
    """How to install the engine of that model; empty if it is installed, or none is needed."""
    if name not in ENGINE_NAMES:
        family(name)  # refuses a name that nobody knows
        return ""
    engine = registry.facts_of(name).engine
    return "" if engine.installed() else engine.hint()


def compiles(name: str, settings: Mapping[str, Any] | None = None) -> str:
    """Name of the code that a model's first run on a machine has to compile; empty for none.

    Models share code, as engines share that of their adaptive steps. Compiling takes up to a
    minute, and does not count for the run's time limit: see `execute.pool.Call`.
    """
    if name not in ENGINE_NAMES:
        return family(name).compiled
    return ADAPTIVE if getattr(build(name, settings), "time_step", None) == ADAPTIVE else ""


def unplayable(name: str, settings: Mapping[str, Any], scene: Scene) -> str:
    """Why a model of rockcheck cannot play a scene; empty if it can, as far as it checks before."""
    check = getattr(build(name, settings), "check", None)
    if check is None:
        return ""
    try:
        check(scene)
    except InputError as error:
        return str(error)
    return ""


def is_own(name: str) -> bool:
    """True for a user-defined model, "module:Class".

    Its code may lie beside the suite or in the working directory.
    """
    return ":" in name


def check_allowed(name: str, allow_code: Container[str]) -> None:
    """Raise `InputError` for a user-defined model that is not allowed, or cannot be a model.

    Allowed are the names in `allow_code`. Imports nothing. A suite is data: it may name code, but
    only the caller of rockcheck allows it to run.
    """
    if not is_own(name):
        return
    module = family(name).module
    if module in sys.stdlib_module_names:
        raise InputError(
            f"{printable(name)!r} is no model: {module} is part of Python's standard library"
        )
    if name not in allow_code:
        raise InputError(
            f"{printable(name)!r} is code of your own; it runs only if you allow it: --allow-code"
            f" {printable(name)}"
        )


def class_of(name: str) -> Any:
    """The class of the model of that name, imported. Raises `InputError` where there is none."""
    kind = family(name)
    try:
        return getattr(importlib.import_module(kind.module), kind.class_name)
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"model {name!r} is not available in this installation: {printable(error)}"
        ) from None


def build(
    name: str,
    settings: Mapping[str, Any] | None = None,
    search_path: Sequence[str] | None = None,
) -> Model:
    """The model of that name with these settings.

    Raises `InputError` naming the setting that is not usable, and for a user-defined model without
    a `search_path`. Its code, in one of these folders, is imported: give them only in the process
    that plays it, for code that was allowed.
    """
    if is_own(name) and search_path is None:
        raise InputError(
            f"model {printable(name)!r} is one of your own, which `validate` and `simulate` can"
            " play"
        )
    check_allowed(name, (name,))
    sys.path.extend(path for path in search_path or () if path not in sys.path)
    kind, model_class, settings = family(name), class_of(name), dict(settings or {})
    if not isinstance(model_class, type) or not callable(getattr(model_class, "simulate", None)):
        raise InputError(
            f"{printable(name)!r} is no model: it must be a class with a method `simulate`"
        )
    for key in kind.fixed.keys() & settings.keys():
        raise InputError(f"is fixed by the name of the model, {name}", f"{name}.{key}")
    try:
        model: Model = model_class(**kind.fixed, **settings)
    except InputError as error:
        raise InputError(error.reason, f"{name}.{error.key}" if error.key else name) from None
    except TypeError as error:
        if fault := _signature_fault(model_class, settings):
            raise InputError(
                f"{printable(name)} takes no such settings: {fault}; a model takes them as"
                " keywords, as in __init__(self, **settings)"
            ) from error
        raise
    return model


def _signature_fault(model_class: Any, settings: Mapping[str, Any]) -> str:
    """Why a class cannot be made with these settings; "" where its signature takes them."""
    try:
        inspect.signature(model_class).bind(**settings)
    except TypeError as error:
        return printable(error)
    return ""


#: What a batch sums of the cost of its runs.
SUMMED = ("wall_seconds", "cpu_seconds", "set_up", "steps", "evaluations")


@dataclass(frozen=True, kw_only=True)
class Work:
    """A model that is to play: its label, the name of its family, and its settings.

    `search_path` holds folders in which a user-defined model may lie.
    """

    label: str
    family: str
    settings: dict[str, Any] = field(default_factory=dict, hash=False)
    search_path: tuple[str, ...] = ()


@dataclass(frozen=True)
class Played:
    """The result of a worker: the record, and the history's files by suffix.

    `read_back`: it was not played, but kept by an earlier run. `history` is the content of the
    files, None for a batch. `traceback` is that of an exception in a scene of a batch.
    """

    record: Any
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    history: History | None = field(default=None, repr=False)
    traceback: str = ""
    read_back: bool = False


def play(work: Work, scene: Scene, *, uncertainty: bool = False) -> Played:
    """The history of a scene, with its numerical error if `uncertainty` asks for it.

    Raises the model's errors.
    """
    began = time.perf_counter()
    history = history_of(work, scene)
    found = (
        numerical.numerical_uncertainty(
            build(work.family, work.settings, work.search_path), scene, history
        )
        if uncertainty
        else None
    )
    return Played(
        {
            "outcome": history.outcome,
            "notes": list(history.notes),
            "settings": {  # as plain JSON values, sorted as the store returns them
                errors.inert(str(key)): value
                if isinstance(value, int | float | bool | None)
                else errors.inert(str(value))
                for key, value in sorted(history.settings.items(), key=lambda item: str(item[0]))
            },
            "uncertainty": dict(history.uncertainty),
            "numerical": found,
            "cost": {**vars(history.cost), "worker_seconds": time.perf_counter() - began},
        },
        history.packed(),
        history,
    )


def history_of(work: Work, scene: Scene) -> History:
    """The history of a scene; that of a user-defined model, which may be anything, is read back.

    Raises the model's errors, and `ModelFailure` where it returns what cannot be used.
    """
    returned = _simulate(work, scene)
    return _read_back(returned) if is_own(work.family) else returned


def _read_back(history: History) -> History:
    """The history as its files hold it; raises `ModelFailure` where these would be unusable."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "history.csv.gz"
        history.save(path)
        try:
            return History.load_with_extremes(path)
        except InputError as error:
            raise ModelFailure(
                f"its history cannot be read back: {str(error).partition(': ')[2]}"
            ) from None


def play_batch(work: Work, scenes: Sequence[Scene]) -> Played:
    """Peak |theta| (alpha) and outcome of each scene; None and the reason where it failed."""
    began = time.perf_counter()
    found = [pool.guarded(_end_of, work, scene) for scene in scenes]
    costs = [one[2] for one in found if not isinstance(one, pool.Failure)]
    ends = [(None, one.reason) if isinstance(one, pool.Failure) else one[:2] for one in found]
    record = {
        "peaks": [peak for peak, _ in ends],
        "outcomes": [outcome for _, outcome in ends],
        "cost": {key: sum(getattr(one, key) for one in costs) for key in SUMMED}
        | {"worker_seconds": time.perf_counter() - began},
    }
    traces = (one.traceback for one in found if isinstance(one, pool.Failure) and one.traceback)
    return Played(record, traceback=next(traces, ""))


def _end_of(work: Work, scene: Scene) -> tuple[float, str, Cost]:
    history = _simulate(work, scene)
    return history.peak_rotation / scene.block.alpha, history.outcome, history.cost


def _simulate(work: Work, scene: Scene) -> History:
    """The history; raises `ModelFailure` for what is none, is empty or has a value not finite."""
    returned: object = build(work.family, work.settings, work.search_path).simulate(scene)
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
    return replace(returned, model=work.label, block=scene.block.per_unit_mass)
