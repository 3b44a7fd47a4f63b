"""Scene files (TOML) and the scenes that come with the package."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from rockcheck.scenes.errors import InputError, printable, unknown_name
from rockcheck.scenes.reading import read_text
from rockcheck.scenes.recordings.sets import record_path
from rockcheck.scenes.scene import Scene
from rockcheck.scenes.trust.inputs import UncertainScene, split, uncertain_scene

DATA = Path(str(resources.files("rockcheck.scenes"))) / "data"


def named_scenes() -> dict[str, Path]:
    """Names and files of the scenes that come with the package."""
    return {path.stem: path for path in sorted((DATA / "scenes").glob("*.toml"))}


def load_scene(source: str | Path) -> Scene:
    """A scene from a TOML file, or by the name of one that comes with the package.

    Raises `InputError` naming the file, the key, the value and what is allowed.
    """
    return _read(_path_of(source)).scene


def load_uncertain_scene(source: str | Path) -> UncertainScene:
    """A scene with what its file says of the numbers that are not known exactly (see
    `scenes.trust.inputs`). Raises as `load_scene`."""
    return _read(_path_of(source))


def _path_of(source: str | Path) -> Path:
    known = named_scenes()
    if str(source) in known:
        return known[str(source)]
    path = Path(source)
    if path.suffix.lower() != ".toml":
        raise InputError(
            f"{unknown_name('scene', str(source), known)}; or the path of a .toml file"
        )
    return path


def _read(path: Path) -> UncertainScene:
    data = read_toml(path)
    try:
        return uncertain_scene_from(data, folder=path.parent, default_name=path.stem)
    except InputError as error:
        raise InputError(f"{printable(path)}: {error}") from None


def uncertain_scene_from(
    data: Mapping[str, Any], *, folder: Path, default_name: str
) -> UncertainScene:
    """A scene from the tables of a scene file, with what they say of numbers that are not known
    exactly."""
    plain, spreads, correlations = split(data)
    return uncertain_scene(
        scene_from(plain, folder=folder, default_name=default_name), spreads, correlations
    )


def scene_from(data: dict[str, Any], *, folder: Path, default_name: str) -> Scene:
    """A scene from the tables of a scene file; record files are looked up in `folder`, then among
    the package's records."""
    data = {"name": default_name, **data}
    if isinstance(data.get("walls"), dict):
        raise InputError("must be a list of tables: write [[walls]], not [walls]", "walls")
    for key in ("excitation", "vertical"):
        table = data.get(key)
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            data[key] = {**table, "file": record_path(table["file"], folder)}
    return Scene(**data)


#: Largest TOML file, bytes.
MOST_BYTES = 10_000_000
#: A key with too many parts: the parser's memory grows with the square of their number. The search
#: takes linear time, since a match begins only at a part, and no part can match in two ways.
_PART = r"""(?:"[^"\n]*+"|'[^'\n]*+'|[^\s.,=\[\]"']++)"""
_DEEP_KEY = re.compile(rf"(?<![^\s.,=\[\]]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{49}}")


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file, or an `InputError` that names file and line."""
    text = read_text(path, MOST_BYTES)
    if _DEEP_KEY.search(text):
        raise InputError(f"{printable(path)}: a key of more than 50 parts")
    try:
        return tomllib.loads(text)
    except (
        ValueError,
        RecursionError,
    ) as error:  # such as an integer of more digits than Python reads
        raise InputError(f"{printable(path)}: not valid TOML: {printable(error)}") from None
