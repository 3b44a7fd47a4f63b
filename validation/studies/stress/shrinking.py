"""Smaller scenes that still fail: parts are dropped, shortened or rounded while the failure stays.

In: a scene and a test for its failure. Out: a minimal scene. Called by `runs`.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import deepcopy
from functools import reduce
from itertools import chain
from operator import getitem
from typing import Any

from rockcheck.scenes import (
    InputError,
    Scene,
    files,
)

KeyPath = tuple[str | int, ...]
#: Most scenes that are tried.
MOST_TRIALS = 400
#: Lists of at most this many values are simplified value by value.
SHORT = 8
#: What is dropped first, since a block that nothing moves is told soonest.
FIRST: dict[str | int, int] = {"vertical": 0, "excitation": 1}


def shrink(
    scene: Scene, shows: Callable[[Scene], bool], trials: int = MOST_TRIALS
) -> tuple[Scene, bool]:
    """A minimal scene that `shows` the failure as `scene` does.

    No single simplification can be made without losing the failure. Ends after this many `trials`
    with the scene found by then; the second value is then false.
    """
    simpler = _simpler(scene)
    while True:
        candidate = next(simpler, None)
        if candidate is None:
            return scene, True
        if trials == 0:
            return scene, False
        trials -= 1
        if shows(candidate):
            scene, simpler = candidate, _simpler(candidate)


def _simpler(scene: Scene) -> Iterator[Scene]:
    """The scene with one simplification each, the greatest first, where it is valid.

    A part is left out, a run or list is shorter, the scale is another; at last one number is zero
    or has fewer digits.
    """
    tables = files.tables_of(scene)
    entries = sorted(_entries(tables), key=lambda entry: (len(entry[0]), FIRST.get(entry[0][0], 2)))
    numbers = [(path, value) for path, value in entries if isinstance(value, float)]
    unit, radius = math.sqrt(scene.block.radius / scene.gravity), scene.block.radius
    for changed in chain(
        (_with(tables, path) for path, _ in entries),
        (
            tables | {key: factor * getattr(scene, key) for key in ("duration", "output_step")}
            for factor in (0.25, 0.5, 0.9)
            if factor * scene.duration > 0.01 * unit
        ),
        (
            _with(tables, path, value[:count])
            for path, value in entries
            if isinstance(value, list)
            for count in (len(value) // 2, -1)
        ),
        # near 1 m rounding would change it again
        [tables | {"block": scene.block.scaled(1.0 / radius)}] if not 0.5 < radius < 2.0 else [],
        (_with(tables, path, 0.0) for path, _ in numbers),
        (
            _with(tables, path, float(f"{value:.{digits}g}"))
            for digits in (1, 2, 4, 8)
            for path, value in numbers
        ),
    ):
        with suppress(InputError):
            simpler = Scene(**changed)
            if simpler != scene:
                yield simpler


def _entries(table: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    if path:
        yield path, table
    short = isinstance(table, list) and len(table) <= SHORT
    for key, value in (
        table.items() if isinstance(table, dict) else enumerate(table if short else ())
    ):
        if key not in ("name", "output_step"):  # these are never dropped or rounded
            yield from _entries(value, (*path, key))


def _with(tables: dict[str, Any], path: KeyPath, *value: Any) -> dict[str, Any]:
    changed: Any = deepcopy(tables)
    table = reduce(getitem, path[:-1], changed)
    if value:
        table[path[-1]] = value[0]
    else:
        del table[path[-1]]
    return changed
