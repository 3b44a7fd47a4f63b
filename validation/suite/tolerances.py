"""Tolerances: the expected value of each figure and its limits, as tolerance files hold them.

In go the tables of a tolerance file; out come the tolerances by scene, model, reference and
measure. Suites are read with them, `verdicts` judges by them, `accepting` writes them.

A tolerance file is TOML; a table a scene, model and reference, a line a measure:

    [fig5a.mujoco.ebm-unilateral]
    "theta_rms@8s" = { expected = 2.3e-4, limit = 2e-3, drift = 1e-4, why = "first-order error" }

The third name is the reference model, or "figures" for a figure of the cell itself, its distance
from a closed form among them. The first may be "*", every scene that the model plays: such a line
holds where a scene has no line for the measure, and completes a scene's own line:

    ["*".mujoco.ebm-unilateral]
    outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the same outcome" }
    "theta_rms@8s" = { why = "first-order step error" }

`@` bounds the window: seconds, or `@horizon`. `limit` bounds the distance from the perfect value
(from `expected` for figures of the cell itself; for "at least" measures the value itself). All in
the measure's unit.
"""

import re
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from rockcheck.scenes import Finite, Frozen, InputError, NonNegative, errors, printable
from rockcheck.validation.discrepancy import figures, measures

MEASURES: Mapping[str, figures.Measure] = ChainMap(
    measures.DIFFERENCES, measures.FIGURES, measures.STATISTICS
)
#: In place of a measure that only another version has: nothing is known of it.
UNKNOWN = figures.Measure("", "", "", "", float, resolution=0.0)
#: The third name of a table of a cell's own figures, in place of a reference model.
CELL_FIGURES = "figures"
HORIZON = "horizon"
#: The first name of a table that holds for every scene.
EVERY = "*"


def measure_of(windowed: str) -> figures.Measure:
    """The measure of "theta_rms", "theta_rms@8s" or "theta_rms@horizon".

    Raises `InputError` for an unknown measure or bad window.
    """
    name, separator, window = windowed.partition("@")
    errors.one_of("measure", name, MEASURES)
    if separator and window != HORIZON and not re.fullmatch(r"(?=.*[1-9])\d+(\.\d+)?s", window):
        raise InputError(
            f"window {printable(window)!r} of {name}: give seconds such as 8s, or {HORIZON}"
        )
    return MEASURES[name]


def known(name: str) -> figures.Measure:
    """The measure of a figure of any run; `UNKNOWN` where this version has none of that name."""
    return MEASURES.get(name, UNKNOWN)


class Tolerance(Frozen):
    """One line of a tolerance file; see the module."""

    limit: NonNegative
    expected: Finite | None = None
    drift: NonNegative | None = None
    why: str = ""


class ToleranceKey(NamedTuple):
    """What a tolerance is for: scene, model, reference or "figures", and "measure@window"."""

    scene: str
    model: str
    against: str
    windowed: str

    @property
    def measure(self) -> str:
        """The name of the measure."""
        return self.windowed.partition("@")[0]

    @property
    def window(self) -> str:
        """The window, such as "8s"; empty for the whole time."""
        return self.windowed.partition("@")[2]

    def __str__(self) -> str:
        return f"[{self.scene}.{self.model}.{self.against}] {self.windowed}"


Tolerances = dict[ToleranceKey, Tolerance]


def parse_tolerances(
    tables: Mapping[str, Any], cells: Iterable[tuple[str, str]] = ()
) -> Tolerances:
    """The tolerances in the tables of a file.

    A line for every scene becomes one for each of `cells` (scene, model). Raises `InputError`
    naming the place of an unusable line.
    """
    tolerances: Tolerances = {}
    for key, line in _spread(dict(_lines(tables)), list(cells)):
        try:
            tolerances[key] = _tolerance(key, line)
        except InputError as error:
            raise InputError(f"{printable(key)}: {error}") from None
    return tolerances


def _tolerance(key: ToleranceKey, line: Mapping[str, Any]) -> Tolerance:
    """A validated line."""
    measure = measure_of(key.windowed)
    tolerance = Tolerance(**line)
    if (measure.name in measures.FIGURES) != (key.against == CELL_FIGURES):
        raise InputError(f"figures of a cell itself, and only they, stand under {CELL_FIGURES!r}")
    if tolerance.expected is None and not measure.is_error:
        raise InputError("is missing", "expected")
    return tolerance


def _spread(
    lines: Mapping[ToleranceKey, Mapping[str, Any]], cells: Sequence[tuple[str, str]]
) -> Iterator[tuple[ToleranceKey, Mapping[str, Any]]]:
    """The lines, with those for every scene repeated for each cell of the model.

    A scene's own line takes precedence; what it leaves out comes from the line for every scene.
    """
    of_a_scene = {key: line for key, line in lines.items() if key.scene != EVERY}
    for key, line in of_a_scene.items():
        yield key, {**lines.get(key._replace(scene=EVERY), {}), **line}
    completed = {key[1:] for key in of_a_scene}
    for key, line in lines.items():
        if key.scene != EVERY or (key[1:] in completed and "limit" not in line):
            continue
        # Without a cell the line stays as it is, and is reported as a tolerance without a cell.
        scenes = [scene for scene, model in cells if model == key.model] or [EVERY]
        for scene in scenes:
            cell_key = key._replace(scene=scene)
            if cell_key not in of_a_scene:
                yield cell_key, line


def _lines(
    tables: Mapping[str, Any], *outer_names: str
) -> Iterator[tuple[ToleranceKey, Mapping[str, Any]]]:
    """The lines of nested tables; `outer_names` are those of the tables that these lie in."""
    for name, inner in tables.items():
        path = (*outer_names, str(name))
        is_line = len(path) == len(ToleranceKey._fields)
        if not isinstance(inner, Mapping):
            if is_line:
                key = printable(ToleranceKey(*path))
                raise InputError(f"{key}: must be a table {{ expected, limit, drift, why }}")
            table = printable(".".join(path))
            raise InputError(f"{table}: must be tables [scene.model.reference]")
        if is_line:
            yield ToleranceKey(*path), inner
        else:
            yield from _lines(inner, *path)
