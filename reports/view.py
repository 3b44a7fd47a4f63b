"""The view of one scene: histories on one time axis, differences, tolerances and horizon."""

import math
import re
from collections.abc import Collection, Container
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.reports.style import Look, looks
from rockcheck.scenes import (
    Block,
    Floats,
    History,
    InputError,
    Scene,
    Side,
    kinematics,
    reading,
)
from rockcheck.scenes.columns import COLUMNS
from rockcheck.scenes.history_files import events_path
from rockcheck.validation.discrepancy import compare
from rockcheck.validation.suite import results

#: A block that falls is drawn up to this rotation, in alpha of the pivot that it turns about.
#: Beyond 1 a block in free rocking does not come back.
FALL = 1.5
#: The opening window: a model turns or slides by at least this share of the largest motion; the
#: margin beside it; and the share of the whole time from which on the whole is shown.
STILL, ROOM, NEARLY_ALL = 0.01, 0.05, 0.85
#: Settings that only a measured history has (`validation.discrepancy.measured`).
MEASURED = {"file", "offset"}


def fall_to(side: Side, block: Block) -> float:
    """`FALL` of a block that tilts to a side, in its own alpha, that of the weaker pivot."""
    return FALL * (block.pivot(side).alpha / block.alpha)


def rows_beyond(theta: Floats, left: float, right: float) -> NDArray[np.int64]:
    """The last rows of a rotation: from where it passes its side's limit, and is never back."""
    size, limit = np.abs(theta), np.where(theta > 0.0, left, right)
    last_within = np.max(np.flatnonzero(size <= limit), initial=-1)
    beyond = np.flatnonzero(size > limit)
    return beyond[beyond > last_within]


@dataclass(frozen=True)
class Channel:
    """A quantity over time: name, label, symbol (for an axis) and unit.

    Measures `<name>_rms` and `<name>_peak` limit its difference; `scale` turns their unit into
    `unit` (1000: from m to mm).
    """

    name: str
    label: str
    symbol: str
    unit: str
    scale: float = 1.0


#: The quantities of the paper's Figs. 4 and 5, then energy and hop.
CHANNELS = (
    Channel("theta", "rotation θ/α", "θ/α", "1"),
    Channel("theta_dot", "rotation rate", "dθ/dt\n(rad/s)", "rad/s"),
    Channel("slip", "pivot position", "pivot position\n(mm)", "mm", 1e3),
    Channel("slip_rate", "pivot velocity", "pivot velocity\n(m/s)", "m/s"),
    Channel("energy", "energy per mass", "energy\n(J/kg)", "J/kg"),
    Channel("hop", "height of the lowest corner", "lowest corner\n(mm)", "mm", 1e3),
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
class View:
    """A scene or an ensemble of a finished run: what has a page of its own."""

    run: results.Run
    name: str
    slug: str

    @cached_property
    def cells(self) -> tuple[results.Cell, ...]:
        """Its cells, in the models' order."""
        return tuple(self.run.by_scene.get(self.name, {}).values())

    @cached_property
    def looks(self) -> dict[str, Look]:
        """How each model of the run looks."""
        return looks(self.run.models)


@dataclass(frozen=True)
class SceneView(View):
    """One scene of a finished run, ready to be drawn.

    `t` is every `stride`-th output time (s). Histories are read from the run's `folder` when they
    are asked for.
    """

    scene: Scene
    folder: Path
    stride: int

    @cached_property
    def moved(self) -> list[dict[str, Any]]:
        """Slip, top displacement, speed at the wall by model: (label, unit, values) where known.

        Of a block that falls, also beyond the scene's end, only the last.
        """
        motions = {
            model: compare.motion_of(one, self.scene) for model, one in self.histories.items()
        }
        rows: list[dict[str, Any]] = [
            {
                "label": q.label,
                "unit": q.unit,
                "by_model": {
                    model: one[q.name]
                    for model, one in motions.items()
                    if model not in self.falls or q.name == "wall_speed"
                },
            }
            for q in compare.QUANTITIES[1:]
        ]
        return [row for row in rows if any(v is not None for v in row["by_model"].values())]

    @property
    def printed(self) -> bool:
        """Whether the run asks for the scene's figures for a paper."""
        return self.name in self.run.printed

    @cached_property
    def histories(self) -> dict[str, History]:
        """By model, in the run's order: the histories that could be read."""
        return {model: one for model, one in self._read.items() if isinstance(one, History)}

    @cached_property
    def missing(self) -> dict[str, str]:
        """By model: why there is no history."""
        return {model: one for model, one in self._read.items() if isinstance(one, str)}

    @cached_property
    def _read(self) -> dict[str, History | str]:
        found: dict[str, History | str] = {}
        for cell in self.cells:
            found[cell.model] = cell.reason or "no history"
            if cell.status == "done" and cell.history is not None:
                try:
                    reading.within(self.folder, str(events_path(Path(cell.history))))
                    found[cell.model] = History.load_with_extremes(
                        reading.within(self.folder, cell.history)
                    )
                except InputError as error:
                    found[cell.model] = str(error)
        return found

    @cached_property
    def t(self) -> Floats:
        """The common time axis, s."""
        return self.scene.output_times[:: self.stride]

    @cached_property
    def ground(self) -> Floats:
        """Horizontal base acceleration on `t`, m/s^2."""
        return np.asarray(self.scene.excitation.acceleration(self.t))

    @cached_property
    def values(self) -> dict[str, dict[str, Floats]]:
        """By model and channel (also x and y, m): values on `t`, NaN where the history has none."""
        block = self.scene.block
        values: dict[str, dict[str, Floats]] = {}
        for model, history in self.histories.items():
            times = np.asarray(history.channels["t"], dtype=float)
            inside = (self.t >= times[0] - 1e-9) & (self.t <= times[-1] + 1e-9)
            found = dict.fromkeys(COLUMNS[1:-1], np.full(len(self.t), math.nan))
            for name in found.keys() & history.channels.keys():
                column = np.asarray(history.channels[name], dtype=float)
                found[name] = np.where(inside, np.interp(self.t, times, column), math.nan)
            motion = (found[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
            found |= {
                "energy": np.asarray(kinematics.energy(block, self.scene.gravity, *motion)),
                "hop": np.asarray(kinematics.pivot_height(block, found["y"], found["theta"])),
            }
            found["theta"] = found["theta"] / block.alpha
            values[model] = {c.name: c.scale * found[c.name] for c in CHANNELS} | {
                name: found[name] for name in ("x", "y")
            }
        return values

    @cached_property
    def falls(self) -> dict[str, float]:
        """By model: when the rotation passes `fall_to` for good, s; only those that fall.

        One that is beyond it at the end, and may lean on a wall there, does not.
        """
        block = self.scene.block
        limits = fall_to("left", block), fall_to("right", block)
        falls = {}
        for model, columns in self.values.items():
            theta = columns["theta"]
            rows = rows_beyond(theta, *limits)
            if not len(rows):
                continue
            side: Side = "left" if theta[rows[-1]] > 0.0 else "right"
            overturned = self.histories[model].overturned_at is not None
            if overturned or not self.scene.wall(side):
                falls[model] = float(self.t[rows[0]])
        return falls

    @property
    def measured(self) -> dict[str, list[int]]:
        """By model that was measured: the rows of `t` that lie next to one of its samples."""
        near = {
            model: np.searchsorted(
                self.t,
                np.asarray(history.channels["t"], dtype=float)
                - 0.5 * self.scene.output_step * self.stride,
            )
            for model, history in self.histories.items()
            if set(history.settings) >= MEASURED
        }
        return {model: np.unique(rows[rows < len(self.t)]).tolist() for model, rows in near.items()}

    @cached_property
    def drawn(self) -> dict[str, dict[str, Floats]]:
        """The `values` up to the fall, NaN from there on."""
        drawn = {}
        for model, columns in self.values.items():
            stands = self.t <= self.falls.get(model, math.inf)
            drawn[model] = {
                name: np.where(stands, column, math.nan) for name, column in columns.items()
            }
        return drawn

    @cached_property
    def active(self) -> tuple[float, float]:
        """The window of time, s, in which something happens: a model turns or slides.

        The whole time where that is nearly all.
        """
        moving = np.zeros(len(self.t), dtype=bool)
        for name in ("theta", "slip_rate"):
            drawn = [columns[name] for columns in self.drawn.values()]
            sizes = np.nan_to_num(np.abs(np.array(drawn).reshape(-1, len(self.t))))
            moving |= (sizes > max(STILL * sizes.max(initial=0.0), 1e-9)).any(axis=0)
        rows, whole = np.flatnonzero(moving), (float(self.t[0]), float(self.t[-1]))
        if not len(rows):
            return whole
        first, last = float(self.t[rows[0]]), float(self.t[rows[-1]])
        room = ROOM * (last - first) + 10.0 * self.scene.output_step * self.stride
        first, last = max(whole[0], first - room), min(whole[1], last + room)
        return (first, last) if last - first < NEARLY_ALL * (whole[1] - whole[0]) else whole

    @property
    def hop(self) -> dict[str, Any] | None:
        """The highest hop, by the most trusted model that may hop.

        Its `height` (m), that `model`, and its `longest` flight (s); None where no model may hop,
        or none does.
        """
        trusted_first = sorted(
            self.cells, key=lambda cell: cell.settings.get("pivot") != "unilateral"
        )
        heights = (
            (cell.model, results.value_of(cell.figures, "highest_hop"))
            for cell in trusted_first
            if cell.settings.get("pivot") != "bilateral"
        )
        model, height = next((one for one in heights if one[1] is not None), ("", None))
        if not height:
            return None
        return {
            "height": height,
            "model": model,
            "longest": max(
                (end - start for start, end, mode in self.spells(model) if mode == "flight"),
                default=0.0,
            ),
        }

    def spells(self, model: str) -> list[tuple[float, float, str]]:
        """The modes of motion of a model as (start in s, end in s, mode), one for each change."""
        channels = self.histories[model].channels if model in self.histories else {}
        if "mode" not in channels:
            return []
        mode, t = np.asarray(channels["mode"]).astype(str), np.asarray(channels["t"], dtype=float)
        starts = np.flatnonzero(np.r_[True, mode[1:] != mode[:-1]])
        ends = [*starts[1:], len(t) - 1]
        return list(zip(t[starts].tolist(), t[ends].tolist(), mode[starts].tolist(), strict=True))

    @property
    def references(self) -> tuple[str, ...]:
        """Models with a history that others are held against here, the run's reference first."""
        named = dict.fromkeys(
            [
                self.run.reference,
                self.run.model_form,
                *(figure.against for cell in self.cells for figure in cell.figures),
            ]
        )
        return tuple(model for model in named if model in self.histories)

    @property
    def figure_references(self) -> tuple[str | None, ...]:
        """References that have a figure of their own.

        All where a wall makes them differ in form, else the first; None without any.
        """
        form = self.scene.walls and self.with_pivot("bilateral")
        return (self.references if form else self.references[:1]) or (None,)

    def differences(self, channel: str, against: str) -> dict[str, Floats]:
        """Candidate minus reference by model, in the channel's unit.

        The difference ends with the first fall of the two.
        """
        return {
            model: columns[channel] - self.drawn[against][channel]
            for model, columns in self.drawn.items()
            if model != against
        }

    def running_rms(self, band: Band) -> Floats:
        """The RMS difference from the common start up to each time, to `band.until`.

        The band's limit applies to the last value. NaN where it is not known.
        """
        both = [
            self.values.get(model, {}).get(band.channel) for model in (band.model, band.against)
        ]
        t = self.t[self.t <= band.until + 1e-9]
        if both[0] is None or both[1] is None or len(t) < 2:
            return np.full(len(t), math.nan)
        square = (both[0][: len(t)] - both[1][: len(t)]) ** 2
        late = int(np.argmax(np.isfinite(square)))  # a measured history may start late
        steps = (0.5 * np.diff(t) * (square[1:] + square[:-1]))[late:]
        return np.sqrt(np.r_[square[: late + 1], np.cumsum(steps) / (t[late + 1 :] - t[late])])

    def bands(self, against: str | None = None) -> tuple[Band, ...]:
        """The tolerances that can be drawn over time; of one reference, or of all."""
        whole = self.scene.duration
        return tuple(
            Band(
                channel.name,
                cell.model,
                check.figure.against,
                kind,
                channel.scale * check.limit,
                min(check.figure.until or whole, whole),
            )
            for cell in self.cells
            for check in cell.checks
            for channel in CHANNELS
            for kind in ("rms", "peak")
            if check.figure.measure == f"{channel.name}_{kind}"
            and check.limit is not None
            and against in (None, check.figure.against)
        )

    @property
    def horizon(self) -> float | None:
        """Horizon of predictability, s: the end of the window of that name, where there is one."""
        return min(
            (
                figure.until
                for cell in self.cells
                for figure in cell.figures
                if figure.window == "horizon" and figure.until is not None
            ),
            default=None,
        )

    @property
    def agreement(self) -> dict[str, tuple[float, str, str]]:
        """How long events agree with those of the first reference, by model.

        The time, what comes then, and that reference.
        """
        return {
            cell.model: (figure.value, figure.note, against)
            for against in reversed(self.references)
            for cell in self.cells
            for figure in reversed(cell.figures)
            if (figure.measure, figure.against, figure.window)
            == ("events_agree_until", against, "")
            and figure.value is not None
        }

    def with_pivot(self, pivot: str) -> list[str]:
        """Event-based models here with that pivot.

        "bilateral" cannot leave the floor, so it forbids the free flight into which a wall throws a
        block; "unilateral" can only push the floor.
        """
        return [cell.model for cell in self.cells if cell.settings.get("pivot") == pivot]

    @cached_property
    def extent(self) -> tuple[float, ...]:
        """Left, right, bottom and top of everything that the block and the walls reach, m."""
        block = self.scene.block
        faces = (
            (block.half_width + wall.gap) * (-1.0 if wall.side == "left" else 1.0)
            for wall in self.scene.walls
        )
        wide = [np.array([-block.half_width, block.half_width, *faces])]
        tall = [np.array([0.0, 2.0 * block.half_height])]
        for columns in self.values.values():
            tilt, x, y = np.abs(columns["theta"] * block.alpha), columns["x"], columns["y"]
            across = block.half_diagonal * np.sin(tilt + block.box_angle)
            up = block.half_diagonal * np.cos(block.box_angle - tilt)
            wide += [x - across, x + across]
            tall += [y - up, y + up]
        return tuple(
            float(edge(np.concatenate(places)))
            for places in (wide, tall)
            for edge in (np.nanmin, np.nanmax)
        )


def scene_views(
    run: results.Run,
    folder: Path,
    chosen: Container[str] | None = None,
    *,
    most_values: int = 2_000_000,
) -> list[SceneView]:
    """The views of the chosen scenes of a run, or of all.

    Where they hold more than `most_values` values, each shows every n-th row.
    """
    slugs = slugs_of(run.scenes)
    names = [name for name in run.scenes if chosen is None or name in chosen]
    share = max(most_values / max(1, len(names)), 20_000.0)
    views, cells = [], run.by_scene
    for name in names:
        scene = run.load_scene(name)
        models = max(1, sum(cell.status == "done" for cell in cells.get(name, {}).values()))
        values = (scene.duration / scene.output_step + 1.0) * ((len(CHANNELS) + 2) * models)
        views.append(
            SceneView(run, name, slugs[name], scene, folder, max(1, math.ceil(values / share)))
        )
    return views


def slugs_of(names: Collection[str]) -> dict[str, str]:
    """A file name for each scene, safe on any system.

    The names differ for different scenes also where case does not count. None has a tilde, with
    which begins what is added to one for a further file.
    """
    taken: dict[str, str] = {}
    for name in names:
        base = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "scene"
        numbered = chain([base], (f"{base}-{n}" for n in count(2)))
        slug = next(one for one in numbered if one.lower() not in taken)
        taken[slug.lower()] = slug
    return dict(zip(names, taken.values(), strict=True))
