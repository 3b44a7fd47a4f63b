"""Measured histories: a CSV from a shake table, or from any other program, played back as if it
were a model.

Its columns are named as a history's (`scenes.history.COLUMNS`), each with its unit: `t_s` or
`time_ms`, `theta_deg`, `x_mm`, `slip_rate_mm_s` and so on; a name without unit is in SI units.
Angles and lengths count as in the scene: theta counterclockwise positive, x the centroid relative
to the base.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rockcheck.scenes import History, InputError, Scene
from rockcheck.scenes.base import Finite, Frozen
from rockcheck.scenes.errors import printable
from rockcheck.scenes.history import block_fields, outcome_of
from rockcheck.scenes.reading import read_table
from rockcheck.validation.discrepancy.repeats import mean_history, shifted, time_shift

TIMES = {"s": 1.0, "ms": 1e-3}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
UNITS: Mapping[str, Mapping[str, float]] = {
    "t": TIMES,
    "theta": ANGLES,
    "theta_dot": {f"{unit}_s": factor for unit, factor in ANGLES.items()},
    **dict.fromkeys(("x", "y", "slip"), LENGTHS),
    **{
        name: {f"{unit}_s": factor for unit, factor in LENGTHS.items()}
        for name in ("x_dot", "y_dot", "slip_rate")
    },
}


class Measured(Frozen):
    """Plays back the file of each scene it knows; `offset` (s) is added to the file's times, to
    align it with the scene's.

    `files` maps names of scenes to CSV files; several files are repeats of one test, whose mean is
    played back with its scatter (`History.uncertainty`). `align` shifts the repeats to the first
    one by cross-correlation, and says by how much.
    """

    name: ClassVar[str] = "measured"
    files: dict[str, str | tuple[str, ...]]
    offset: Finite = 0.0
    align: bool = False

    def simulate(self, scene: Scene) -> History:
        """The measured history of the scene, from its t = 0 to its end. Raises `InputError` for a
        file that is not usable."""
        if scene.name not in self.files:
            raise InputError(f"no measured history of scene {scene.name!r}", "files")
        given = self.files[scene.name]
        paths = (given,) if isinstance(given, str) else given
        history = self._mean(paths)
        t = history.channels["t"]
        inside = (t >= -1e-9) & (t <= scene.duration + 1e-9)
        if not np.any(inside):
            raise InputError(
                f"nothing of {', '.join(map(printable, paths))} lies within the scene's 0 to"
                f" {scene.duration:g} s",
                "offset",
            )
        return dataclasses.replace(
            history,
            name=scene.name,
            channels={key: column[inside] for key, column in history.channels.items()},
            **block_fields(scene.block),
            settings={"file": ", ".join(Path(path).name for path in paths), "offset": self.offset},
        )

    def _mean(self, paths: Sequence[str]) -> History:
        if not paths:
            raise InputError("no file is given", "files")
        tests = [read_measured(path, offset=self.offset) for path in paths]
        said: list[str] = []
        if self.align:
            offsets = [0.0, *(time_shift(tests[0], test) for test in tests[1:])]
            tests = [shifted(test, offset) for test, offset in zip(tests, offsets, strict=True)]
            said = [
                f"{Path(path).name} is shifted by {offset:+.4g} s"
                for path, offset in zip(paths[1:], offsets[1:], strict=True)
            ]
        mean = mean_history(tests)
        return dataclasses.replace(mean, notes=(*mean.notes, *said))


def read_measured(path: str | Path, *, offset: float = 0.0) -> History:
    """A history from a CSV whose columns name their units, or that rockcheck wrote; `offset` (s) is
    added to its times.

    Raises `InputError`, naming file and column, for whatever is missing, unknown, doubled or not
    finite.
    """
    shown = printable(path)
    columns: dict[str, tuple[str, float]] = {}
    for column in _heading(Path(path), shown):
        name, factor = _meaning(column, shown)
        if name in (known for known, _ in columns.values()):
            raise InputError(
                f"{shown}: column {printable(column)!r} gives {printable(name)} a second time"
            )
        columns[column] = (name, factor)
    history = History.load(path, columns={column: name for column, (name, _) in columns.items()})
    channels: dict[str, Any] = {}
    for name, factor in columns.values():
        if name in history.channels:
            channels[name] = (
                history.channels[name] if factor == 1.0 else factor * history.channels[name]
            )
    channels["t"] = channels["t"] + offset
    si = all(factor == 1.0 for _, factor in columns.values())
    return dataclasses.replace(
        history, channels=channels, outcome=history.outcome if si else outcome_of(channels)
    )


def _heading(path: Path, shown: str) -> list[str]:
    """Names of the columns, with quotes and remarks read as those of the rows are."""
    row = read_table(path, header=None, nrows=1, dtype=str, keep_default_na=False)
    if row.empty:
        raise InputError(f"{shown}: empty")
    return [column.strip() for column in row.iloc[0]]


def _meaning(column: str, shown: str) -> tuple[str, float]:
    """A column's name in a history, and the factor to SI units."""
    plain = (
        "t" + column.removeprefix("time")
        if column == "time" or column.startswith("time_")
        else column
    )
    for name in sorted(UNITS, key=len, reverse=True):
        if plain == name:
            return name, 1.0
        if plain.startswith(f"{name}_") and plain.removeprefix(f"{name}_") in UNITS[name]:
            return name, UNITS[name][plain.removeprefix(f"{name}_")]
    for name in sorted(UNITS, key=len, reverse=True):
        if plain.startswith(f"{name}_"):
            units = ", ".join(UNITS[name])
            raise InputError(
                f"{shown}: column {printable(column)!r}: give a unit of {name}: {units}"
            )
    return column, 1.0
