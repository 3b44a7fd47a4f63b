"""The scenes of a suite: named, in files, written out, and combined by grids.

In go the keys of a suite file and its folder; out come validated scenes by name, perhaps with
uncertain numbers. `suites` calls it.
"""

import itertools
from collections.abc import Iterator, Sequence
from functools import reduce
from pathlib import Path
from typing import Any

from rockcheck.scenes import errors, files
from rockcheck.validation.suite.suite_file import SuiteFile


def scenes_of(config: SuiteFile, folder: Path) -> dict[str, files.UncertainScene]:
    """The scenes of a suite by name: named or in files, written out, and of grids."""
    scenes: dict[str, files.UncertainScene] = {}
    for scene in _all_scenes(config, folder):
        name = scene.scene.name
        if name in scenes:
            raise errors.InputError(f"scene {name!r} is named twice", "scenes")
        scenes[name] = scene
    return scenes


def _all_scenes(config: SuiteFile, folder: Path) -> Iterator[files.UncertainScene]:
    for name in config.scenes:
        is_file = Path(name).suffix == ".toml" and name not in files.named_scenes()
        yield files.load_uncertain_scene(folder / name if is_file else name)
    for number, table in enumerate(config.scene, 1):
        yield files.uncertain_scene_from(table, folder=folder, default_name=f"scene {number}")
    for grid in config.grid:
        for choice in itertools.product(*grid.axes):
            table = _combined(grid.scene, choice)
            yield files.uncertain_scene_from(table, folder=folder, default_name="scene")


def _combined(base: dict[str, Any], choice: Sequence[dict[str, Any]]) -> dict[str, Any]:
    if not all(isinstance(alternative.get("name"), str) for alternative in choice):
        raise errors.InputError("each alternative needs a name", "grid.axes")
    names = [str(table["name"]) for table in (base, *choice) if "name" in table]
    return {**reduce(_merged, choice, base), "name": "-".join(names)}


def _merged(base: Any, change: Any) -> Any:
    """`change` over `base`: tables by key, lists of tables one by one, anything else replaced.

    An empty list leaves none.
    """
    if isinstance(base, dict) and isinstance(change, dict):
        return {**base, **{key: _merged(base.get(key), value) for key, value in change.items()}}
    if isinstance(base, list) and isinstance(change, list) and change:
        return [
            old if new is None else _merged(old, new)
            for old, new in itertools.zip_longest(base, change)
        ]
    return change
