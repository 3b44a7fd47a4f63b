"""The view of one scene: histories on one time axis, differences, tolerances and horizon."""

from __future__ import annotations

import math
import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import History, InputError, Scene, experience, kinematics
from rockcheck.scenes.history import events_path
from rockcheck.scenes.reading import within
from rockcheck.validation.discrepancy.motion import QUANTITIES, motion_of
from rockcheck.validation.suite.results import Cell, Run
from rockcheck.validation.uncertainty.population import Inputs

Array = NDArray[np.float64]
#: A block that falls is drawn up to this rotation (alpha). Beyond 1 a block in free rocking does
#: not come back.
FALL = 1.5
#: The opening window: a model turns or slides by at least this share of the largest motion; the
#: margin beside it; and the share of the whole time from which on the whole is shown.
STILL, ROOM, NEARLY_ALL = 0.01, 0.05, 0.85
#: Settings that only a measured history has (`validation.discrepancy.measured`).
MEASURED = {"file", "offset"}


@dataclass(frozen=True)
class Channel:
    """A quantity over time: name, label, symbol (for an axis), unit, and the stem of its measures.

    These measures limit its difference.

    `scale` turns the unit of its measures into `unit` (1000: from m to mm).
    """

    name: str
    label: str
    symbol: str
    unit: str
    measured_by: str = ""
    scale: float = 1.0

    @property
    def axis(self) -> str:
        """Label of an axis, plain text."""
        return f"{self.label} ({self.unit})" if self.unit != "1" else self.label


#: The quantities of the paper's Figs. 4 and 5, then energy and hop.
CHANNELS = (
    Channel("theta", "rotation θ/α", "θ/α", "1", "theta"),
    Channel("theta_dot", "rotation rate", "dθ/dt\n(rad/s)", "rad/s", "theta_dot"),
    Channel("slip", "pivot position", "pivot position\n(mm)", "mm", "slip", 1e3),
    Channel("slip_rate", "pivot velocity", "pivot velocity\n(m/s)", "m/s", "slip_rate"),
    Channel("energy", "energy per mass", "energy\n(J/kg)", "J/kg", "energy"),
    Channel("hop", "height of the lowest corner", "lowest corner\n(mm)", "mm", "hop", 1e3),
)
PAPER_CHANNELS = CHANNELS[:4]


@dataclass(frozen=True)
class Band:
    """A tolerance on the difference of one channel of one model.

    Its difference |d| (or its RMS) is at most `limit` from 0 to `until` s.
    """

    channel: str
    model: str
    against: str
    kind: str
    limit: float
    until: float


@dataclass(frozen=True)
class Hop:
    """How the block leaves the floor.

    Its lowest corner's greatest height (m), by which model, and its longest flight (s).
    """

    height: float
    model: str
    longest: float


@dataclass(frozen=True)
class SceneView:
    """One scene of a finished run, ready to be drawn.

    `t` is every `stride`-th output time (s). Histories are read from the run's `folder` when they
    are asked for.
    """

    run: Run
    name: str
    slug: str
    scene: Scene
    folder: Path
    stride: int

    @property
    def histories(self) -> dict[str, History]:
        """By model, in the run's order: the histories that could be read."""
        return self._read[0]

    @cached_property
    def moved(self) -> list[dict[str, Any]]:
        """Slip, top displacement, speed at the wall by model: (label, unit, values) where known."""
        motions = {model: motion_of(one, self.scene) for model, one in self.histories.items()}
        rows: list[dict[str, Any]] = [
            {
                "label": q.label,
                "unit": q.unit,
                "by_model": {model: getattr(one, q.name) for model, one in motions.items()},
            }
            for q in QUANTITIES[1:]
        ]
        return [row for row in rows if any(v is not None for v in row["by_model"].values())]

    @property
    def printed(self) -> bool:
        """Whether the run asks for the scene's figures for a paper."""
        return self.name in self.run.printed

    @property
    def missing(self) -> dict[str, str]:
        """By model: why there is no history."""
        return self._read[1]

    @cached_property
    def _read(self) -> tuple[dict[str, History], dict[str, str]]:
        return _read(self.cells, self.folder)

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """The scene's cells, in the models' order."""
        return self.run.of_scene(self.name)

    @property
    def inputs(self) -> Inputs | None:
        """What the spread of the scene's inputs makes of its figures."""
        return self.run.inputs.get(self.name)

    @cached_property
    def outside(self) -> list[str]:
        """The axes on which the scene lies outside of what the suites cover.

        Empty where nothing is known of them.
        """
        return experience.outside(self.scene) if experience.known().domain else []

    @cached_property
    def t(self) -> Array:
        """The common time axis, s."""
        return self.scene.output_times[:: self.stride]

    @cached_property
    def ground(self) -> Array:
        """Horizontal base acceleration on `t`, m/s^2."""
        return np.asarray(self.scene.excitation.acceleration(self.t))

    @cached_property
    def values(self) -> dict[str, dict[str, Array]]:
        """By model and channel (also x and y, m): values on `t`, NaN where the history has none."""
        return {model: self._channels(history) for model, history in self.histories.items()}

    def _channels(self, history: History) -> dict[str, Array]:
        block = self.scene.block
        column = {
            name: self._on_axis(history, name)
            for name in ("x", "y", "theta", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate")
        }
        x, y, theta = column["x"], column["y"], column["theta"]
        motion = (column[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
        found = {
            "theta": theta / block.alpha,
            "theta_dot": column["theta_dot"],
            "slip": column["slip"],
            "slip_rate": column["slip_rate"],
            "energy": np.asarray(kinematics.energy(block, self.scene.gravity, *motion)),
            "hop": np.asarray(kinematics.pivot_height(block, y, theta)),
        }
        return {c.name: c.scale * found[c.name] for c in CHANNELS} | {"x": x, "y": y}

    def _on_axis(self, history: History, name: str) -> Array:
        """A column on `t`, linear between its rows.

        NaN outside them and where there is no such column.
        """
        if name not in history.channels:
            return np.full(len(self.t), math.nan)
        times = np.asarray(history.channels["t"], dtype=float)
        values = np.asarray(history.channels[name], dtype=float)
        inside = (self.t >= times[0] - 1e-9) & (self.t <= times[-1] + 1e-9)
        return np.where(inside, np.interp(self.t, times, values), math.nan)

    @cached_property
    def falls(self) -> dict[str, float]:
        """By model: when the rotation passes `FALL`, s; only those that fall."""
        beyond = {
            model: np.flatnonzero(np.abs(columns["theta"]) > FALL)
            for model, columns in self.values.items()
        }
        return {model: float(self.t[rows[0]]) for model, rows in beyond.items() if len(rows)}

    @property
    def measured(self) -> dict[str, list[int]]:
        """By model that was measured: the rows of `t` that lie next to one of its samples."""
        found = {}
        for model, history in self.histories.items():
            if set(history.settings) >= MEASURED:
                near = np.searchsorted(
                    self.t,
                    np.asarray(history.channels["t"], dtype=float)
                    - 0.5 * float(self.t[1] - self.t[0]),
                )
                found[model] = np.unique(near[near < len(self.t)]).tolist()
        return found

    @cached_property
    def drawn(self) -> dict[str, dict[str, Array]]:
        """The `values` up to the fall, NaN from there on."""
        standing = {model: self.t <= self.falls.get(model, math.inf) for model in self.values}
        return {
            m: {name: np.where(standing[m], v, math.nan) for name, v in columns.items()}
            for m, columns in self.values.items()
        }

    @cached_property
    def active(self) -> tuple[float, float]:
        """The window of time, s, in which something happens: a model turns or slides.

        The whole time where that is nearly all.
        """
        moving = np.zeros(len(self.t), dtype=bool)
        for name in ("theta", "slip_rate"):
            sizes = [np.nan_to_num(np.abs(columns[name])) for columns in self.drawn.values()]
            least = STILL * max((float(size.max()) for size in sizes), default=0.0)
            for size in sizes:
                moving |= size > max(least, 1e-9)
        rows, whole = np.flatnonzero(moving), (float(self.t[0]), float(self.t[-1]))
        if not len(rows):
            return whole
        first, last = float(self.t[rows[0]]), float(self.t[rows[-1]])
        room = ROOM * (last - first) + 10.0 * float(self.t[1] - self.t[0])
        first, last = max(whole[0], first - room), min(whole[1], last + room)
        return (first, last) if last - first < NEARLY_ALL * (whole[1] - whole[0]) else whole

    @property
    def hop(self) -> Hop | None:
        """The highest hop, by the most trusted model that may hop.

        None where no model may hop, or none does.
        """
        order = (
            *self.unilateral,
            *(cell.model for cell in self.cells if cell.model not in self.bilateral),
        )
        for cell in sorted(
            self.cells,
            key=lambda cell: order.index(cell.model) if cell.model in order else len(order),
        ):
            height = next(
                (f.value for f in cell.figures if f.measure == "highest_hop" and not f.window), None
            )
            if cell.model in order and height is not None:
                return (
                    Hop(height, cell.model, self._longest_flight(cell.model))
                    if height > 0.0
                    else None
                )
        return None

    def _longest_flight(self, model: str) -> float:
        channels = self.histories[model].channels if model in self.histories else {}
        if "mode" not in channels:
            return 0.0
        t, flying = (
            np.asarray(channels["t"], dtype=float),
            np.asarray(channels["mode"]).astype(str) == "flight",
        )
        ends = np.flatnonzero(np.diff(np.r_[False, flying, False].astype(int)))
        return max(
            (
                float(t[min(end, len(t) - 1)] - t[start])
                for start, end in zip(ends[::2], ends[1::2], strict=True)
            ),
            default=0.0,
        )

    @property
    def references(self) -> tuple[str, ...]:
        """Models with a history that others are held against here, the run's reference first."""
        named = [
            self.run.reference,
            self.run.model_form,
            *(f.against for cell in self.cells for f in cell.figures),
        ]
        return tuple(model for model in dict.fromkeys(named) if model in self.histories)

    @property
    def figure_references(self) -> tuple[str | None, ...]:
        """References that have a figure of their own.

        All where a wall makes them differ in form, else the first; None without any.
        """
        return (self.references if self.model_form_matters else self.references[:1]) or (None,)

    def differences(self, channel: str, against: str) -> dict[str, Array]:
        """Candidate minus reference by model, in the channel's unit.

        The difference ends with the first fall of the two.
        """
        reference = self.drawn[against][channel]
        return {
            model: columns[channel] - reference
            for model, columns in self.drawn.items()
            if model != against
        }

    def running_rms(self, band: Band) -> Array:
        """The RMS difference from 0 up to each time, to `band.until`.

        The band's limit applies to the last value. NaN where it is not known.
        """
        both = [
            self.values.get(model, {}).get(band.channel) for model in (band.model, band.against)
        ]
        t = self.t[self.t <= band.until + 1e-9]
        if both[0] is None or both[1] is None or len(t) < 2:
            return np.full(len(t), math.nan)
        square = (both[0][: len(t)] - both[1][: len(t)]) ** 2
        steps = 0.5 * np.diff(t) * (square[1:] + square[:-1])
        return np.sqrt(np.r_[square[0], np.cumsum(steps) / (t[1:] - t[0])])

    def bands(self, against: str | None = None) -> tuple[Band, ...]:
        """The tolerances that can be drawn over time; of one reference, or of all."""
        found = []
        for cell in self.cells:
            for check in cell.checks:
                figure = check.figure
                stem, _, kind = figure.measure.rpartition("_")
                channel = next((c for c in CHANNELS if c.measured_by == stem), None)
                if (
                    channel is None
                    or kind not in ("rms", "peak")
                    or check.limit is None
                    or against not in (None, figure.against)
                ):
                    continue
                until = min(figure.until or self.scene.duration, self.scene.duration)
                found.append(
                    Band(
                        channel.name,
                        cell.model,
                        figure.against,
                        kind,
                        channel.scale * check.limit,
                        until,
                    )
                )
        return tuple(found)

    @property
    def horizon(self) -> float | None:
        """Horizon of predictability, s: the end of the window of that name, where there is one."""
        ends = [
            f.until
            for cell in self.cells
            for f in _all_figures(cell)
            if f.window == "horizon" and f.until is not None
        ]
        return min(ends, default=None)

    @property
    def agreement(self) -> dict[str, tuple[float, str, str]]:
        """How long events agree with those of the first reference, by model.

        The time, what comes then, and that reference.
        """
        found: dict[str, tuple[float, str, str]] = {}
        for against in self.references:
            for cell in self.cells:
                for figure in cell.figures:
                    wanted = (
                        figure.measure == "events_agree_until"
                        and figure.against == against
                        and not figure.window
                    )
                    if wanted and figure.value is not None:
                        found.setdefault(cell.model, (figure.value, figure.note, against))
        return found

    @property
    def bilateral(self) -> tuple[str, ...]:
        """Models here whose pivot cannot leave the floor."""
        return tuple(cell.model for cell in self.cells if cell.settings.get("pivot") == "bilateral")

    @property
    def unilateral(self) -> tuple[str, ...]:
        """Event-based models here whose floor can only push."""
        return tuple(
            cell.model for cell in self.cells if cell.settings.get("pivot") == "unilateral"
        )

    @property
    def model_form_matters(self) -> bool:
        """Whether a wall can throw the block into free flight that one of the models forbids."""
        return bool(self.scene.walls) and bool(self.bilateral)

    @cached_property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of everything that the block and the walls reach, m."""
        block = self.scene.block
        wide = [-block.half_width, block.half_width]
        tall = [0.0, 2.0 * block.half_height]
        for columns in self.values.values():
            theta, x, y = columns["theta"] * block.alpha, columns["x"], columns["y"]
            across = block.half_diagonal * np.sin(np.abs(theta) + block.box_angle)
            up = block.half_diagonal * np.cos(block.box_angle - np.abs(theta))
            with np.errstate(invalid="ignore"):
                wide += [_least(x - across), -_least(-x - across)]
                tall += [_least(y - up), -_least(-y - up)]
        for wall in self.scene.walls:
            face = (block.half_width + wall.gap) * (-1.0 if wall.side == "left" else 1.0)
            wide.append(face)
        return min(wide), max(wide), min(tall), max(tall)


def scene_views(
    run: Run, folder: Path, chosen: Container[str] | None = None, *, most_values: int = 2_000_000
) -> list[SceneView]:
    """The views of the chosen scenes of a run, or of all.

    Where they hold more than `most_values` values, each shows every n-th row.
    """
    slugs = slugs_of(run.scenes)
    names = [name for name in run.scenes if chosen is None or name in chosen]
    share = most_values / max(1, len(names))
    views = []
    for name in names:
        scene = run.load_scene(name)
        columns = (len(CHANNELS) + 2) * max(
            1, sum(cell.status == "done" for cell in run.of_scene(name))
        )
        values = (scene.duration / scene.output_step + 1.0) * columns
        views.append(
            SceneView(
                run,
                name,
                slugs[name],
                scene,
                folder,
                max(1, math.ceil(values / max(share, 20_000.0))),
            )
        )
    return views


def slugs_of(names: Iterable[str]) -> dict[str, str]:
    """A file name for each scene, safe on any system.

    The names differ for different scenes also where case does not count.
    """
    slugs: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        base = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "scene"
        slug, n = base, 2
        while slug.lower() in taken:
            slug, n = f"{base}-{n}", n + 1
        taken.add(slug.lower())
        slugs[name] = slug
    return slugs


def _read(cells: Iterable[Cell], folder: Path) -> tuple[dict[str, History], dict[str, str]]:
    histories, missing = {}, {}
    for cell in cells:
        if cell.status != "done" or cell.history is None:
            missing[cell.model] = cell.reason or "no history"
            continue
        try:
            path = within(folder, cell.history)
            within(folder, str(events_path(Path(cell.history))))
            histories[cell.model] = History.load(path)
        except InputError as error:
            missing[cell.model] = str(error)
    return histories, missing


def _all_figures(cell: Cell) -> list[Any]:
    return [*cell.figures, *(check.figure for check in cell.checks)]


def _least(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.min(known)) if len(known) else 0.0
