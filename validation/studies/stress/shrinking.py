"""The smallest scene that still shows a failure: parts are dropped, shortened or rounded as long as
it stays."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import tomlkit

from rockcheck.scenes import InputError, Scene

Shows = Callable[[Scene], bool]
Path = tuple[str | int, ...]
#: Most scenes that are tried.
MOST_TRIALS = 400
#: In lists of at most so many values each is tried on its own.
SHORT = 8
#: What is dropped first, since a block that nothing moves is told soonest.
FIRST: dict[str | int, int] = {"vertical": 0, "excitation": 1}
#: What is never dropped or rounded.
KEPT = ("name", "output_step")


def shrink(
    scene: Scene,
    shows: Shows,
    *,
    trials: int = MOST_TRIALS,
    seconds: float = math.inf,
) -> tuple[Scene, bool]:
    """A scene that `shows` the failure as `scene` does, and from which no single simplification can
    be taken without losing it.

    Ends after so many `trials` or `seconds` with what it has then; the second value is then false.
    """
    until = time.monotonic() + seconds
    again = True
    while again:
        again = False
        for simpler in simplifications(scene):
            if trials == 0 or time.monotonic() > until:
                return scene, False
            trials -= 1
            if shows(simpler):
                scene, again = simpler, True
                break
    return scene, True


def simplifications(scene: Scene) -> Iterator[Scene]:
    """Valid scenes that are simpler in one respect, the greatest simplification first."""
    for tables in _changes(scene):
        try:
            simpler = Scene(**tables)
        except InputError:
            continue
        if simpler != scene:
            yield simpler


def _changes(scene: Scene) -> Iterator[dict[str, Any]]:
    """The scene's tables with a part left out, a shorter run or list, another scale, and at last
    one number that is zero or has fewer digits."""
    tables = _tables(scene)
    places = sorted(_places(tables), key=lambda place: (len(place[0]), FIRST.get(place[0][0], 2)))
    for path, _ in places:
        yield _with(tables, path)
    unit = math.sqrt(scene.block.radius / scene.gravity)
    for factor in (0.25, 0.5, 0.9):
        if factor * scene.duration > 0.01 * unit:
            shorter = {key: factor * getattr(scene, key) for key in ("duration", "output_step")}
            yield tables | shorter
    for path, value in places:
        if isinstance(value, list):
            yield _with(tables, path, value[: len(value) // 2])
            yield _with(tables, path, value[:-1])
    if not 0.5 < scene.block.radius < 2.0:  # rounding would change it again
        yield tables | {"block": scene.block.scaled(1.0 / scene.block.radius)}
    numbers = [(path, value) for path, value in places if isinstance(value, float)]
    for path, _ in numbers:
        yield _with(tables, path, 0.0)
    for digits in (1, 2, 4, 8):
        for path, value in numbers:
            yield _with(tables, path, float(f"{value:.{digits}g}"))


def _tables(scene: Scene) -> dict[str, Any]:
    """All that is not as it would be without a word, as a scene file has it."""
    tables: dict[str, Any] = scene.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    for key in {"excitation", "vertical"} & tables.keys():
        tables[key] = {"kind": getattr(scene, key).kind} | tables[key]
    return tables


def _places(part: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Where the values are, tables and lists among them."""
    if path:
        yield path, part
    if isinstance(part, dict):
        inner: list[tuple[Any, Any]] = [(key, part[key]) for key in part if key not in KEPT]
    else:
        inner = list(enumerate(part)) if isinstance(part, list) and len(part) <= SHORT else []
    for key, value in inner:
        yield from _places(value, (*path, key))


def _with(tables: dict[str, Any], path: Path, *value: Any) -> dict[str, Any]:
    """The tables with another value at that place, or without it."""
    changed = deepcopy(tables)
    part: Any = changed
    for key in path[:-1]:
        part = part[key]
    if value:
        part[path[-1]] = value[0]
    else:
        del part[path[-1]]
    return changed


def scene_text(scene: Scene, remarks: str) -> str:
    """A scene file that `load_scene` reads back to the bit (samples stand in the file itself), with
    remarks on top."""
    tables = {
        key: value for key, value in _tables(scene).items() if key != "name"
    }  # the file's own
    # Plain values come before tables.
    ordered = sorted(tables.items(), key=lambda item: isinstance(item[1], dict | list))
    lines = "".join(f"# {line}\n" for line in remarks.splitlines())
    return lines + tomlkit.dumps(dict(ordered))
