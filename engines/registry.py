"""The engines of this folder: each module NAME_engine.py is one, and nothing else lists them.

In: a name. Out: the record with which that module ends. Names cost a look into the folder. A record
imports its module, but not the engine's library.
"""

import importlib
import pkgutil
from functools import cache
from typing import TYPE_CHECKING

import rockcheck.engines

if TYPE_CHECKING:
    from rockcheck.engines.facts import EngineFacts

#: The order of engines in tables and figures. Engines that are not listed come last, by name.
ORDER = ("mujoco", "pybullet", "pymunk", "dart", "drake", "box2d", "physx", "jolt")
ENDING = "_engine"


@cache
def names() -> tuple[str, ...]:
    """The names of all engines, installed or not, in their order."""
    modules = [module.name for module in pkgutil.iter_modules(rockcheck.engines.__path__)]
    found = {name.removesuffix(ENDING) for name in modules if name.endswith(ENDING)}
    listed = [name for name in ORDER if name in found]
    return (*listed, *sorted(found.difference(ORDER)))


@cache
def facts_of(name: str) -> "EngineFacts":
    """The record of the engine of that name; raises `KeyError` for one that is not of `names`."""
    if name not in names():
        raise KeyError(name)
    facts: EngineFacts = importlib.import_module(f"{__package__}.{name}{ENDING}").FACTS
    return facts


def every() -> "list[EngineFacts]":
    """The records of all engines, in their order."""
    return [facts_of(name) for name in names()]
