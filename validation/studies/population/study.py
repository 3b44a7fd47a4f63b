"""A block under many motions at many intensities: incremental dynamic analysis (Vamvatsikos and
Cornell 2002) and fragility.

An intensity is in proportion to the size of its motion, so the factor of a motion is the wanted
intensity over that of the motion as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import InputError, Record, Scene
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.scenes.recordings import Recording, intensity
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build, family
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Panel,
    Plot,
    Series,
    Table,
    text,
)
from rockcheck.validation.studies.population.curves import DRAWS, Curve, Floats, blocks_of, curve_of
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty.population import Runs, compiled, play

Motions = Sequence[tuple[str, Recording]]
#: Records of a set, at the least; frequencies of a set of pulses.
FEWEST, PULSES = 2, 50
#: Shares of the motions whose peaks stay below the curves that are drawn.
BAND = (0.16, 0.5, 0.84)
#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: The end of the axis of peaks (alpha).
FALLEN = 1.25
#: Time of a run as a rule, s, of compiled models and of others; and of all up to which no process
#: of their own is worth while.
A_RUN, A_SLOW_RUN, SOON = 1e-3, 1.0, 5.0
FAILED = 3


@dataclass(frozen=True)
class Batch(Task):
    """Runs of a population that are played together: a scene at factors of its base motion.

    `of` says of what in the population they are: a case, a motion.
    """

    of: tuple[str, ...]
    scene: Scene = field(repr=False)
    factors: tuple[float, ...] = field(repr=False)
    model: str
    settings: tuple[tuple[str, Any], ...] = ()

    @property
    def label(self) -> str:
        """What it is of."""
        return ", ".join(self.of)

    def depends(self) -> Any:
        """The scene with its motion, the model, the factors, and the code that plays them."""
        cell = provenance.cell_key(self.scene, self.model, dict(self.settings))
        return cell, self.factors, provenance.code_digest(play.__module__)

    def scenes(self) -> list[Scene]:
        """The scenes, one a run."""
        motion = self.scene.excitation
        return [self.scene.replace(excitation=motion.scaled(factor)) for factor in self.factors]


@dataclass(frozen=True, kw_only=True)
class Population(Study):
    """What the studies share: batches of one model, each with both directions of a motion."""

    scene: Scene
    motions: Motions = ()
    #: What of the records was not played, for who reads the answer.
    left_out: Sequence[str] = ()
    model: str = "ebm-unilateral"
    settings: Mapping[str, Any] = field(default_factory=dict)
    title: ClassVar[str]
    record = Runs

    @cached_property
    def batches(self) -> list[Batch]:
        """All batches. Raises `InputError` where the model cannot play the scene."""
        raise NotImplementedError

    def batch(self, of: tuple[str, ...], scene: Scene, levels: Floats) -> Batch:
        """A motion in both directions at factors `levels` of its size."""
        player, factors = build(self.model, self.settings), np.concatenate([levels, -levels])
        fast = compiled(player)
        if compiled(player):
            player.check(scene)
        return Batch(
            of,
            scene,
            tuple(factors.tolist()),
            self.model,
            tuple(self.settings.items()),
            expected=len(factors) * (A_RUN if fast else A_SLOW_RUN),
            compiles=self.model if family(self.model).compiled else "",
        )

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Batch]:
        """All batches at once."""
        if len(self.motions) == 1:
            raise InputError(f"1 is too few: give at least {FEWEST} records", "records")
        soon = sum(one.expected for one in self.batches) < SOON
        return [replace(one, where="here") for one in self.batches] if soon else self.batches

    @staticmethod
    def play(task: Batch) -> Runs:
        """The runs of a batch."""
        return play(task.scenes(), build(task.model, dict(task.settings)))

    def found(
        self, done: Mapping[Any, Any], answer: str, blocks: Sequence[Block], data: Mapping[str, Any]
    ) -> Finding:
        """A finding; where a model failed, its command ends so."""
        failed = any(isinstance(one, Failure) for one in done.values())
        about = {"scene": self.scene.name, "model": self.model, "left_out": list(self.left_out)}
        title = f"{self.title}: {self.scene.name}"
        return Finding(
            self.name, title, answer, blocks, {**about, **data}, exit_code=FAILED * failed
        )


class Grid:
    """Runs of batches as arrays (motion, direction, intensity)."""

    def __init__(self, batches: Sequence[Batch], done: Mapping[Any, Any]) -> None:
        self.batches = [one for one in batches if isinstance(done.get(one), Runs)]
        runs = [done[one] for one in self.batches]
        shape = (len(runs), 2, -1 if runs else 0)
        side, failed, peak = (
            np.array([values(one) for one in runs]).reshape(shape)
            for values in (
                lambda one: one.side,
                lambda one: one.failed,
                lambda one: one.figures["peak_rotation"],
            )
        )
        self.failed: NDArray[np.bool_] = failed.astype(bool)
        self.overturned: NDArray[np.bool_] = (side != 0) & ~self.failed
        #: Peaks, alpha; infinite of a block that overturned, NaN where the run failed.
        self.peaks: Floats = np.where(self.failed, np.nan, np.where(self.overturned, np.inf, peak))


@dataclass(frozen=True)
class Measure:
    """A measure of intensity: its label, its unit, and its value for a record and a scene."""

    label: str
    unit: str
    of: Callable[[Recording, Scene], float]


def _per_slope(scene: Scene) -> float:
    """1/(g tan alpha), s^2/m."""
    pivot = scene.block.weaker_pivot
    return pivot.height / (scene.gravity * pivot.arm)


def _velocity_ratio(record: Recording, scene: Scene) -> float:
    return intensity.peak_velocity(record) * scene.frequency_parameter * _per_slope(scene)


MEASURES: Mapping[str, Measure] = {
    "pga": Measure("PGA", "g", lambda record, scene: intensity.peak_acceleration(record)),
    "pgv": Measure("PGV", "m/s", lambda record, scene: intensity.peak_velocity(record)),
    "pga-ratio": Measure(
        "PGA/(g tan α)",
        "",
        lambda record, scene: float(np.max(np.abs(record.samples))) * _per_slope(scene),
    ),
    "pgv-ratio": Measure("p PGV/(g tan α)", "", _velocity_ratio),
}


def measure_of(word: str) -> Measure:
    """The measure of that name, or of "sa:0.5", spectral acceleration at a period (s).

    Raises `InputError`.
    """
    name, _, period = word.partition(":")
    if name == "sa":
        try:
            seconds = float(period)
        except ValueError:
            seconds = math.nan
        if not 1e-3 <= seconds < math.inf:
            said = f"{printable(word)!r} is not allowed: give a period from 0.001 s, as in sa:0.5"
            raise InputError(said, "--intensity")
        at = partial(intensity.spectral_acceleration, period=seconds)
        return Measure(f"Sa({seconds:g} s), 5 %", "g", lambda record, scene: at(record))
    if word not in MEASURES:
        raise InputError(str(unknown_name("intensity", word, [*MEASURES, "sa:0.5"])), "--intensity")
    return MEASURES[word]


@dataclass(frozen=True, kw_only=True)
class Ida(Population):
    """Peak rotation of the scene's block under each record, scaled to each of the intensities."""

    intensities: Floats
    intensity: str = "pga"
    capacities: Sequence[float] = CAPACITIES
    settings: Mapping[str, Any] = field(default_factory=lambda: {"tolerance": 1e-8})
    name = "ida"
    title: ClassVar[str] = "Incremental dynamic analysis"

    @cached_property
    def own(self) -> list[float]:
        """The intensities of the records as they are."""
        found = [measure_of(self.intensity).of(one, self.scene) for _, one in self.motions]
        return [_moving(name, one) for (name, _), one in zip(self.motions, found, strict=True)]

    @cached_property
    def batches(self) -> list[Batch]:
        """One a record."""
        return [
            self.batch(
                (name,),
                self.scene.replace(excitation=Record.from_samples(one.samples, one.time_step)),
                self.intensities / own,
            )
            for (name, one), own in zip(self.motions, self.own, strict=True)
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """Lines of all motions, their quantiles, and the fragility of each capacity."""
        grid, measure, levels = (
            Grid(self.batches, done),
            measure_of(self.intensity),
            self.intensities,
        )
        across = Column("intensity", measure.label, measure.unit)
        curves, peaks = [], grid.peaks.reshape(-1, len(levels))
        if len(peaks):
            with np.errstate(invalid="ignore"):
                curves = [
                    curve_of(_event(limit), grid.peaks > limit, grid.failed, levels, DRAWS)
                    for limit in self.capacities
                ]
        shown = _lines(grid, across, levels) if curves else []
        records = Table(
            "records",
            [text("record"), Column("own", f"{measure.label} as recorded", measure.unit)],
            [[name, own] for (name, _), own in zip(self.motions, self.own, strict=True)],
            "Records",
            on="page",
        )
        blocks = [*shown, *(blocks_of(curves, across) if curves else []), records]
        answer = (
            f"{self.scene.name}, {measure.label}: {len(grid.batches)} records in both directions,"
            f" {len(levels)} intensities."
        )
        data = {
            "measure": self.intensity,
            "label": measure.label,
            "unit": measure.unit,
            "intensities": levels.tolist(),
            "capacities": list(self.capacities),
        }
        return self.found(done, answer, blocks, data)


def _moving(name: str, size: float) -> float:
    if size <= 0.0:
        raise InputError(f"{name}: a record without motion has no intensity")
    return size


def _event(limit: float) -> str:
    return "peak above α, or overturned" if limit == 1.0 else f"peak above {limit:g} α"


def _lines(grid: Grid, across: Column, levels: Floats) -> list[Block]:
    """All runs: a line a motion, and their quantiles, the smallest peak that the share of the
    motions does not exceed."""
    x, series, rows = levels.tolist(), [], []
    for batch, both in zip(grid.batches, grid.peaks, strict=True):
        for direction, line in zip((1, -1), both.tolist(), strict=True):
            label = f"{batch.label}{'' if direction > 0 else ', reversed'}"
            series.append(Series(label, x, [_standing(peak) for peak in line], style="thin"))
            rows += [
                [batch.label, direction, level, _standing(peak), int(peak == math.inf)]
                for level, peak in zip(x, line, strict=True)
            ]
    peaks = grid.peaks.reshape(-1, len(levels))
    quantiles = np.nanquantile(peaks, BAND, axis=0, method="inverted_cdf").tolist()
    for share, line in zip(BAND, quantiles, strict=True):
        middle = [_standing(peak) for peak in line]
        series.append(Series(f"{100.0 * share:g} %", x, middle, style="smooth"))
    names = ("direction", "intensity", "peak_rotation_alpha", "overturned")
    return [
        Plot(
            "lines",
            f"Peak rotation against {across.label}",
            panels=[Panel("", series)],
            x=Axis(across.head),
            y=Axis("peak |θ|/α", limits=(0.0, FALLEN)),
            note="A grey line a motion; it ends where the block falls. Coloured: the peak that 16,"
            " 50 and 84 % of the motions stay below.",
            live=True,
        ),
        Table("ida", [text("record"), *map(Column, names)], rows, on="file"),
        Table(
            "quantiles",
            [Column("intensity"), *(Column(f"p{100.0 * share:g}") for share in BAND)],
            [
                [level, *map(_standing, row)]
                for level, row in zip(x, zip(*quantiles, strict=True), strict=True)
            ],
            on="file",
        ),
    ]


def _standing(peak: float) -> float | None:
    return peak if math.isfinite(peak) else None


@dataclass(frozen=True, kw_only=True)
class Fragility(Population):
    """The probability of overturning, with and without the wall, for a set of records, or, without
    any, for pulses of the scene's kind at `PULSES` frequencies over p between two.

    The intensity is peak acceleration over g tan(alpha): `amplitudes`.
    """

    amplitudes: Floats
    frequencies: tuple[float, float]
    name = "fragility"
    title: ClassVar[str] = "Fragility"

    @cached_property
    def batches(self) -> list[Batch]:
        """One a motion and case."""
        return [batch for case in self.cases for batch in case]

    @cached_property
    def cases(self) -> list[list[Batch]]:
        """The batches with the wall, where there is one, and without."""
        motions = list(self._records() if self.motions else self._pulses())
        free = ("without a wall", self.scene.replace(walls=()))
        found = []
        for case, scene in [("with the wall", self.scene), free] if self.scene.walls else [free]:
            sizes = self.amplitudes * scene.gravity * scene.block.slope
            found.append(
                [
                    self.batch((case, name), scene.replace(excitation=motion), sizes / peak)
                    for name, motion, peak in motions
                ]
            )
        return found

    def _records(self) -> list[tuple[str, Any, float]]:
        return [
            (
                name,
                Record.from_samples(one.samples, one.time_step),
                _moving(name, float(np.max(np.abs(one.samples)))),
            )
            for name, one in self.motions
        ]

    def _pulses(self) -> list[tuple[str, Any, float]]:
        motion = self.scene.excitation
        if motion.kind not in ("ricker", "sine"):
            raise InputError("are needed: the scene's excitation is no pulse", "records")
        unit, frequencies = self.scene.frequency_parameter, np.geomspace(*self.frequencies, PULSES)
        periods = (2.0 * math.pi / (frequencies * unit)).tolist()
        return [
            (
                f"{1.0 / period:.4g} Hz",
                type(motion)(**motion.model_dump() | {"amplitude": 1.0, "period": period}),
                1.0,
            )
            for period in periods
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """A curve with the wall, and one without."""
        curves: list[Curve] = []
        for batches in self.cases:
            grid = Grid(batches, done)
            if len(grid.batches):
                curves.append(
                    curve_of(batches[0].of[0], grid.overturned, grid.failed, self.amplitudes, DRAWS)
                )
        slope = self.scene.gravity * self.scene.block.slope / GRAVITY_OF_RECORDS
        other = {"per_unit": slope, "other_unit": "g", "other_label": "peak acceleration, g"}
        across = Column("intensity", "peak acceleration / (g tan α)")
        motions = f"{len(self.motions)} records" if self.motions else f"{PULSES} pulses"
        medians = ", ".join(f"{one.label} {one.median:.3g}" for one in curves if one.median)
        answer = f"{self.scene.name}, {motions} in both directions; median intensity: {medians or 'no curve fits'}."
        blocks = blocks_of(curves, across, other) if curves else []
        return self.found(done, answer, blocks, {"pga_g": slope})
