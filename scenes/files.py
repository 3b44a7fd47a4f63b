"""Scene files (TOML), the scenes of the package, and uncertain numbers.

An uncertain number is a table, such as `friction = { value = 0.3, sd = 0.03 }`:

| written | meaning |
|---|---|
| `{ value = 0.3, sd = 0.03 }` | normal: mean and standard deviation |
| `{ value = 0.3, sd = 0.03, distribution = "lognormal" }` | lognormal of that mean and sd, > 0 |
| `{ value = 0.3, sd = 0.03, distribution = "uniform" }` | uniform of that mean and sd |
| `{ low = 0.0, high = 0.1 }` | uniform between these; `value` is the middle unless it is given |

Any number of a scene may be uncertain. `load_scene` takes the values; `load_uncertain_scene` also
returns the distributions. Numbers are independent unless a table `[correlation]` says otherwise:
`"block.half_width, block.half_height" = 0.8`.

A table `[building]` puts the block on a storey, which the excitation moves (see `buildings`):
`storeys`, `storey`, `period`, `damping`, or `modes`.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from pydantic import model_validator

from rockcheck.scenes import buildings
from rockcheck.scenes.base import DATA, Finite, Floats, Frozen, Positive
from rockcheck.scenes.buildings import Building
from rockcheck.scenes.errors import InputError, printable, suggestion, unknown_name
from rockcheck.scenes.excitations import Excitation
from rockcheck.scenes.reading import read_text
from rockcheck.scenes.recordings.sets import record_path
from rockcheck.scenes.scene import Scene

Place = tuple[str | int, ...]
#: Keys that mark a table of a scene file as an uncertain number.
_KEYS = {"value", "sd", "low", "high"}
CORRELATION = "correlation"
#: A building's free vibration is played until it is below this part of the least acceleration that
#: moves a block at rest.
QUIET_SHARE = 0.1


def named_scenes() -> dict[str, Path]:
    """Names and files of the scenes that come with the package."""
    return {path.stem: path for path in sorted((DATA / "scenes").glob("*.toml"))}


def load_scene(source: str | Path) -> Scene:
    """A scene from a TOML file, or by the name of one that comes with the package.

    Raises `InputError` naming the file, the key, the value and what is allowed.
    """
    return load_uncertain_scene(source).scene


def load_uncertain_scene(source: str | Path) -> UncertainScene:
    """A scene with the distributions of its uncertain numbers (see the module).

    Raises as `load_scene`.
    """
    if not isinstance(source, str | Path):
        raise InputError("give a name, or the path of a .toml file", "source")
    known = named_scenes()
    path = known.get(str(source), Path(source))
    if path.suffix.lower() != ".toml":
        raise InputError(
            f"{unknown_name('scene', str(source), known)}; or the path of a .toml file"
        )
    data = read_toml(path)
    try:
        return uncertain_scene_from(data, folder=path.parent, default_name=path.stem)
    except InputError as error:
        raise InputError(f"{printable(path)}: {error}", file=path) from None


def uncertain_scene_from(
    data: Mapping[str, Any], *, folder: Path, default_name: str
) -> UncertainScene:
    """A scene with its uncertain numbers, from the tables of a scene file."""
    spreads: dict[str, Spread] = {}
    plain = _plain({key: value for key, value in data.items() if key != CORRELATION}, (), spreads)
    building = buildings.building_of(plain.pop("building")) if "building" in plain else None
    scene = scene_from(plain, folder=folder, default_name=default_name)
    given = uncertain_scene(scene, spreads, data.get(CORRELATION, {}))
    return given if building is None else on_storey(given, building)


def scene_from(data: dict[str, Any], *, folder: Path, default_name: str) -> Scene:
    """A scene from the tables of a scene file, but for its building.

    Record files are looked up in `folder`, then among the package's records.
    """
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
        raise InputError(f"{printable(path)}: a key of more than 50 parts", file=path)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # an integer may have too many digits to read
        raise InputError(
            f"{printable(path)}: not valid TOML: {printable(error)}", file=path
        ) from None


def tables_of(scene: Scene) -> dict[str, Any]:
    """All settings that differ from their defaults, as in a scene file."""
    tables: dict[str, Any] = scene.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    for key in {"excitation", "vertical"} & tables.keys():
        tables[key] = {"kind": getattr(scene, key).kind} | tables[key]
    return tables


def scene_text(tables: Mapping[str, Any], remarks: str = "") -> str:
    """A scene file of these tables that `load_scene` reads back to the bit, with remarks on top."""
    import tomlkit

    ordered = sorted(tables.items(), key=lambda one: isinstance(one[1], dict | list))
    return "".join(f"# {line}\n" for line in remarks.splitlines()) + tomlkit.dumps(dict(ordered))


class Spread(Frozen):
    """An uncertain number: its value and its distribution.

    See the module for the forms.
    """

    value: Finite | None = None
    sd: Positive | None = None
    low: Finite | None = None
    high: Finite | None = None
    distribution: Literal["normal", "lognormal", "uniform"] = "normal"

    @model_validator(mode="after")
    def _one_form(self) -> Spread:
        normal, (low, high) = self.sd is not None, self._ends
        if normal and (low, high) != (None, None):
            raise InputError("cannot be given together with low and high", "sd")
        if normal and self.value is None:
            raise InputError("is missing beside sd", "value")
        if not normal and None in (low, high):
            raise InputError(
                "is missing: give value and sd, or low and high", "low" if low is None else "high"
            )
        if (
            not normal
            and "distribution" in self.model_fields_set
            and self.distribution != "uniform"
        ):
            raise InputError(
                f"{self.distribution} is not allowed with low and high: such a number is uniform",
                "distribution",
            )
        if not normal and not low < high:
            raise InputError(f"{high:g} is not allowed: must be more than low, {low:g}", "high")
        if normal and self.distribution == "lognormal" and self.nominal <= 0.0:
            raise InputError(
                f"{self.nominal:g} is not allowed: a lognormal number is positive", "value"
            )
        return self

    @property
    def nominal(self) -> float:
        """The value used in the scene: `value`, else the middle between `low` and `high`."""
        return 0.5 * sum(self._ends) if self.value is None else self.value

    @property
    def _ends(self) -> tuple[float, float]:
        return cast(tuple[float, float], (self.low, self.high))

    @property
    def law(self) -> Any:
        """The frozen distribution of scipy.stats."""
        from scipy import stats

        mean, (low, high) = self.nominal, self._ends
        if self.sd is None:
            return stats.uniform(low, high - low)
        if self.distribution == "uniform":
            half = math.sqrt(3.0) * self.sd
            return stats.uniform(mean - half, 2.0 * half)
        if self.distribution == "lognormal":
            log_variance = math.log1p((self.sd / mean) ** 2)
            return stats.lognorm(
                math.sqrt(log_variance), scale=mean * math.exp(-0.5 * log_variance)
            )
        return stats.norm(mean, self.sd)


@dataclass(frozen=True)
class UncertainScene:
    """A scene and the distributions of its uncertain numbers.

    `spreads` is keyed by the place of the number, such as "floor.friction" or "walls.left.gap".
    `correlation` is their matrix in this order, the unit matrix if all are independent. Where the
    block stands in a `building`, the scene's excitation is that of the storey, and `ground` moves
    the building.
    """

    scene: Scene
    spreads: Mapping[str, Spread]
    correlation: Floats
    building: Building | None = None
    ground: Excitation | None = None

    @property
    def ground_motion(self) -> Excitation:
        """The horizontal motion of the ground: without a building that of the block's base."""
        return self.scene.excitation if self.ground is None else self.ground

    @property
    def names(self) -> tuple[str, ...]:
        """The places of the uncertain numbers."""
        return tuple(self.spreads)

    @property
    def independent(self) -> bool:
        """Whether no two numbers are correlated."""
        return bool(np.array_equal(self.correlation, np.eye(len(self.spreads))))

    def values(self, uniform: Floats) -> Floats:
        """The uncertain numbers (n x count) at points of the unit cube (n x count).

        The correlation enters by a Gaussian copula.
        """
        from scipy import stats

        if not self.independent:
            uniform = stats.norm.cdf(
                stats.norm.ppf(uniform) @ np.linalg.cholesky(self.correlation).T
            )
        return np.column_stack(
            [spread.law.ppf(uniform[:, k]) for k, spread in enumerate(self.spreads.values())]
        )

    def at(self, values: Sequence[float]) -> Scene:
        """The scene with these values of its uncertain numbers.

        Raises `InputError` where one is not allowed.
        """
        try:
            return with_numbers(
                self.scene, dict(zip(self.names, (float(value) for value in values), strict=True))
            )
        except InputError as error:
            raise InputError(
                f"{error}; a sample of the scene's inputs:"
                ' distribution = "lognormal" or bounds keep it inside'
            ) from None


def _correlated_pair(key: str, names: list[str]) -> tuple[int, int]:
    """The places, among these names, of the two uncertain numbers of a key "a, b"."""
    pair, where = [part.strip() for part in key.split(",")], f"{CORRELATION}.{key}"
    if len(pair) != 2 or pair[0] == pair[1]:
        raise InputError(
            "give two uncertain numbers, as in 'floor.friction, walls.left.gap'", where
        )
    for name in pair:
        if name not in names:
            raise InputError(
                f"{name!r} is not an uncertain number of the scene{suggestion(name, names)}", where
            )
    return names.index(pair[0]), names.index(pair[1])


def uncertain_scene(
    scene: Scene, spreads: Mapping[str, Spread], correlations: Mapping[str, Any]
) -> UncertainScene:
    """A scene with its uncertain numbers and their correlation.

    `correlations` maps "a, b" to a number between -1 and 1. Raises `InputError` for an unknown
    place, a number out of range, or a matrix that is not positive definite.
    """
    names = list(spreads)
    matrix = np.eye(len(names))
    for key, value in correlations.items():
        i, j = _correlated_pair(key, names)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not -1.0 < value < 1.0:
            raise InputError(
                f"{value!r} is not allowed: give a number between -1 and 1",
                f"{CORRELATION}.{key}",
            )
        matrix[i, j] = matrix[j, i] = float(value)
    if names and np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise InputError(
            "these correlations contradict each other: the matrix is not positive definite",
            CORRELATION,
        )
    return UncertainScene(scene, dict(spreads), matrix)


def on_storey(given: UncertainScene, building: Building) -> UncertainScene:
    """The scene with its block on a storey of a building, which its excitation moves.

    Raises `InputError` where a number of the building or of the motion is uncertain.
    """
    for place in given.spreads:
        if place.partition(".")[0] in ("building", "excitation"):
            raise InputError("no number of a building or of its ground motion is uncertain", place)
    scene = given.scene
    quiet = QUIET_SHARE * scene.moving_acceleration
    try:
        motion = buildings.storey_motion(building, scene.excitation, quiet)
    except InputError as error:
        raise InputError(error.reason, "building") from None
    return replace(
        given,
        scene=scene.replace(excitation=motion),
        building=building,
        ground=scene.excitation,
    )


def with_numbers(scene: Scene, numbers: Mapping[str, float]) -> Scene:
    """The scene with some of its numbers changed, by their places; validated.

    Raises `InputError`.
    """
    parts: dict[str, Any] = {wall.side: wall for wall in scene.walls}
    for place, value in numbers.items():
        table, _, name = place.removeprefix("walls.").partition(".")
        if not name:
            parts[table] = value
            continue
        whole, (name, _, at) = parts.get(table) or getattr(scene, table), name.partition(".")
        listed = enumerate(getattr(whole, name)) if at else ()
        new = [value if str(k) == at else one for k, one in listed] or value
        try:
            parts[table] = whole.replace(**{name: new})
        except InputError as error:
            raise InputError(error.reason, place.removesuffix(name) + error.key) from None
    return scene.replace(walls=tuple(parts.pop(wall.side) for wall in scene.walls), **parts)


def _plain(value: Any, place: Place, spreads: dict[str, Spread]) -> Any:
    if isinstance(value, list):
        return [
            # a wall goes by its side, any other table by its number
            _plain(item, (*place, item.get("side", k) if isinstance(item, Mapping) else k), spreads)
            for k, item in enumerate(value)
        ]
    if not isinstance(value, Mapping):
        return value
    if not value.keys() & _KEYS:
        return {key: _plain(item, (*place, key), spreads) for key, item in value.items()}
    name = ".".join(map(str, place))
    try:
        spreads[name] = Spread(**value)
    except InputError as error:
        raise InputError(error.reason, f"{name}.{error.key}" if error.key else name) from None
    return spreads[name].nominal
