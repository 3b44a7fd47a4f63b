"""Incremental dynamic analysis (Vamvatsikos and Cornell 2002) and fragility.

A block is played under many motions at many intensities. An intensity is in proportion to the size
of its motion, so the factor of a motion is the wanted intensity over the motion's own.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rockcheck.scenes import Excitation, InputError, Record, Scene, errors
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, Recording, intensity
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Panel,
    Plot,
    Series,
    Style,
    Table,
    text,
)
from rockcheck.validation.study import Task
from rockcheck.validation.uncertainty import population

Motions = Sequence[tuple[str, Recording]]
#: The event-based model that plays populations, draws and gaps.
SWIFT = "ebm-unilateral"
#: Usual time of a run, s, of compiled models and of others; total time up to which separate
#: processes are not worth while.
A_RUN, A_SLOW_RUN, SOON = 1e-3, 1.0, 5.0
#: Records of a set, at the least; frequencies of a set of pulses.
FEWEST, PULSES = 2, 50
#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: Above all peaks of blocks that stand (alpha).
MOST = 1e300
#: Shares of the motions whose peaks stay below the quantiles' curves.
BAND: dict[float, Style] = {0.16: "dotted", 0.5: "smooth", 0.84: "dashed"}
#: The end of the axis of peaks (alpha).
FALLEN = 1.25
#: Sets of motions drawn anew for the interval of a fitted median.
DRAWS = 200


@dataclass(frozen=True)
class OneScene(Task):
    """Runs of one scene by one model; `of` names them."""

    of: tuple[str, ...]
    scene: Scene = field(repr=False)
    model: str
    settings: tuple[tuple[str, Any], ...] = ()

    @property
    def label(self) -> str:
        """Which runs."""
        return ", ".join(filter(None, self.of))

    def depends(self) -> Any:
        """The scene with its motion, the model, what else is asked for, and the code."""
        return (
            provenance.cell_key(self.scene, self.model, dict(self.settings)),
            [v for k, v in self.fields().items() if k not in OneScene.__dataclass_fields__],
            provenance.code_digest(type(self).__module__),
        )


def effort(model: str, settings: Mapping[str, Any], runs: int) -> dict[str, Any]:
    """For a `Task`: the usual time of these runs, s, and the code that they may have to compile."""
    return {
        "expected": runs * (A_RUN if models.family(model).compiled else A_SLOW_RUN),
        "compiles": models.compiles(model, settings),
    }


@dataclass(frozen=True)
class Batch(OneScene):
    """Runs of a population that are played together: a scene at factors of its base motion.

    `both`: the vertical motion is scaled too, and not mirrored.
    """

    factors: tuple[float, ...] = field(default=(), repr=False)
    both: bool = False

    def play(self) -> population.Runs:
        """The runs."""
        player: Any = models.build(self.model, dict(self.settings))
        across, upward = self.scene.excitation, self.scene.vertical
        return population.play(
            [
                self.scene.replace(
                    excitation=across.scaled(factor),
                    vertical=upward.scaled(abs(factor)) if self.both else upward,
                )
                for factor in self.factors
            ],
            player,
        )


@dataclass(frozen=True, kw_only=True)
class Population:
    """Scenes, each under all motions at all `levels` of intensity, in both directions.

    `cases` are the scenes by name; "" is one whose motions each have a line. A motion has a name
    and its own intensity; `upward` has the vertical ones that are scaled with it, by its name.
    `limits` are the events that have a curve: peaks (alpha) by name. `across` is the intensity,
    `other` its axis in another unit; `data` is what `--json` says besides.
    """

    cases: Mapping[str, Scene]
    motions: Sequence[tuple[str, Any, float]]
    levels: population.Floats
    across: Column
    limits: Mapping[str, float]
    settings: Mapping[str, Any]
    data: Mapping[str, Any]
    other: dict[str, Any] | None = None
    upward: Mapping[str, Excitation] = field(default_factory=dict)

    @cached_property
    def batches(self) -> list[Batch]:
        """One a case and motion. Raises `InputError` where the model cannot play a scene."""
        player: Any = models.build(SWIFT, self.settings)
        for scene in self.cases.values():
            player.check(scene)
        how = effort(SWIFT, self.settings, 2 * len(self.levels))
        soon = how["expected"] * len(self.motions) * len(self.cases) < SOON
        return [
            Batch(
                (case, name),
                scene.replace(excitation=motion, vertical=self.upward.get(name, scene.vertical)),
                SWIFT,
                tuple(self.settings.items()),
                (*(self.levels / own).tolist(), *(-self.levels / own).tolist()),
                name in self.upward,
                where="here" if soon else "worker",
                **how,
            )
            for case, scene in self.cases.items()
            for name, motion, own in self.motions
        ]

    def gather(self, done: Mapping[Any, Any]) -> tuple[str, list[Block]]:
        """The answer, and the blocks: a curve a case and event; the lines of all motions."""
        played = [batch for batch in self.batches if isinstance(done.get(batch), population.Runs)]
        peaks = {
            case: np.array([done[one].peaks for one in played if one.of[0] == case]).reshape(
                -1, 2, len(self.levels)
            )
            for case in dict.fromkeys(batch.of[0] for batch in played)
        }
        curves = [
            population.curve_of(case + event, some > limit, np.isnan(some), self.levels, DRAWS)
            for case, some in peaks.items()
            for event, limit in self.limits.items()
        ]
        names, unit = [one.label for one in played], self.across.unit
        medians = [f"{one.label} {one.median:.3g} {unit}" for one in curves if one.median > 0.0]
        return (
            f"{len(self.motions)} motions in both directions, {len(self.levels)} intensities."
            f" Median {self.across.label}: {', '.join(medians).rstrip() or 'no curve fits'}."
        ), [
            *(lines_of(names, peaks[""], self.levels, self.across) if "" in peaks else ()),
            *(blocks_of(curves, self.across, self.other) if curves else ()),
            Table(
                "motions",
                [text("motion"), Column("own", f"{self.across.label} as it is", unit)],
                [[name, own] for name, _, own in self.motions],
                "Motions",
                on="page",
                folded=True,
            ),
        ]


def blocks_of(
    curves: Sequence[population.Curve], across: Column, other: dict[str, Any] | None = None
) -> list[Block]:
    """The curves, drawn and as tables, over the intensity `across`.

    `other`: the axis of the intensity in another unit, see `finding.Plot`.
    """
    columns = [
        text("case", "event"),
        Column("median", f"median {across.label}", across.unit),
        Column("low", "95 % from"),
        Column("high", "to"),
        Column("dispersion", digits=2, help=f"standard deviation of ln({across.label})"),
        Column("motions", brief=False),
        Column("undecided", "undecided runs", brief=False),
    ]

    series = []
    for one in curves:
        level, share, low, high, fit = zip(*one.points, strict=True)
        series += [
            Series(one.label, level, share, low, high, style="smooth"),
            Series(one.label, level, fit, style="dots"),
        ]
    return [
        Plot(
            "fragility",
            "Fragility",
            panels=[Panel("", series)],
            x=Axis(across.head),
            y=Axis("probability", limits=(0.0, 1.0)),
            note="Share of the runs, its 95 % band (Wilson's, with the motions as independent), and"
            " the lognormal curve of the greatest likelihood, dotted.",
            live=True,
            data=other,
        ),
        Table(
            "fits",
            [
                *columns,
                *(
                    [Column(f"median_{other['other_unit']}", "median", other["other_unit"])]
                    if other
                    else []
                ),
            ],
            [
                [
                    *(getattr(one, "label" if c.name == "case" else c.name) for c in columns),
                    *([other["per_unit"] * one.median] if other else ()),
                ]
                for one in curves
            ],
            note="Lognormal fits; the interval of the median is from drawing the motions anew.",
        ),
        Table(
            "fragility",
            [
                text("case"),
                *map(Column, ("intensity", "share", "band_low", "band_high", "lognormal_fit")),
            ],
            [[one.label, *point] for one in curves for point in one.points],
            on="file",
        ),
    ]


def lines_of(
    motions: Sequence[str], peaks: population.Floats, levels: population.Floats, across: Column
) -> list[Block]:
    """Peaks (motion, direction, intensity) as a line a motion and direction, and their quantiles.

    A quantile is the smallest peak that the share of the motions does not exceed. A line ends where
    the block falls.
    """
    x, signs = levels.tolist(), (1, -1)
    quantiles = np.nanquantile(peaks.reshape(-1, len(x)), list(BAND), axis=0, method="inverted_cdf")
    known, quantiles = (np.where(np.isinf(some), np.nan, some) for some in (peaks, quantiles))
    lines = [
        (name, sign, line)
        for name, both in zip(motions, known.tolist(), strict=True)
        for sign, line in zip(signs, both, strict=True)
    ]
    fell = iter(np.isinf(peaks).ravel().tolist())
    return [
        Plot(
            "lines",
            f"Peak rotation against {across.label}",
            panels=[
                Panel(
                    "",
                    [
                        *(
                            Series(name if sign > 0 else f"{name}, reversed", x, line, style="thin")
                            for name, sign, line in lines
                        ),
                        *(
                            Series(f"{100.0 * share:g} %", x, line, style=style)
                            for (share, style), line in zip(
                                BAND.items(), quantiles.tolist(), strict=True
                            )
                        ),
                    ],
                )
            ],
            x=Axis(across.head),
            y=Axis("peak |θ|/α", limits=(0.0, FALLEN)),
            note="A grey line a motion; it ends where the block falls. Coloured: the peak that 16,"
            " 50 and 84 % of the motions stay below.",
            live=True,
        ),
        Table(
            "ida",
            [
                text("record"),
                *map(Column, ("direction", "intensity", "peak_rotation_alpha", "overturned")),
            ],
            [
                [name, sign, level, peak, int(next(fell))]
                for name, sign, line in lines
                for level, peak in zip(x, line, strict=True)
            ],
            on="file",
        ),
        Table(
            "quantiles",
            [Column("intensity"), *(Column(f"p{100.0 * share:g}") for share in BAND)],
            [[level, *row] for level, row in zip(x, quantiles.T.tolist(), strict=True)],
            on="file",
        ),
    ]


Measure = tuple[str, str, Callable[[Recording, Scene], float]]
#: Measures of intensity: label, unit, and value of a record for a scene.
MEASURES: Mapping[str, Measure] = {
    "pga": ("PGA", "g", lambda record, scene: intensity.peak_acceleration(record)),
    "pgv": ("PGV", "m/s", lambda record, scene: intensity.peak_velocity(record)),
    "pga-ratio": (
        "PGA/(g tan α)",
        "",
        lambda record, scene: np.max(np.abs(record.samples)) / (scene.gravity * scene.block.slope),
    ),
    "pgv-ratio": (
        "p PGV/(g tan α)",
        "",
        lambda record, scene: (
            intensity.peak_velocity(record)
            * scene.frequency_parameter
            / (scene.gravity * scene.block.slope)
        ),
    ),
}


def measure_of(word: str) -> Measure:
    """The measure of that name, or of "sa:0.5": spectral acceleration at a period, s."""
    found = re.fullmatch(r"sa:(\d*\.?\d+)", word)
    if found and (at := float(found[1])) >= 1e-3:
        return (
            f"Sa({at:g} s), 5 %",
            "g",
            lambda r, scene: intensity.spectral_acceleration(r, at),
        )
    if word not in MEASURES:
        raise InputError(
            str(errors.unknown_name("intensity", word, [*MEASURES, "sa:0.5"])), "--levels"
        )
    return MEASURES[word]


def ida(
    scene: Scene,
    motions: Motions,
    levels: population.Floats,
    *,
    measure: str = "pga",
    capacities: Sequence[float] = CAPACITIES,
    upward: Mapping[str, Excitation] | None = None,
) -> Population:
    """Peak rotation of the scene's block under each record, scaled to each intensity.

    The vertical motion `upward`, by the record's name, is scaled with it. Raises `InputError` for
    an unknown measure, fewer than two motions, or one without motion.
    """
    label, unit, of = measure_of(measure)
    if len(motions) < FEWEST:
        raise InputError(f"{len(motions)} is too few: give at least {FEWEST} records", "records")
    sized = [
        (name, Record.from_samples(one.samples, one.time_step), float(of(one, scene)))
        for name, one in motions
    ]
    for name, _, own in sized:
        if own <= 0.0:
            raise InputError(f"{name}: a record without motion has no intensity", "records")
    return Population(
        cases={"": scene},
        motions=sized,
        levels=levels,
        across=Column("intensity", label, unit),
        limits={
            f"peak above {'α, or overturned' if limit == 1.0 else f'{limit:g} α'}": limit
            for limit in capacities
        },
        upward=upward or {},
        settings={"tolerance": 1e-8},
        data={
            "measure": measure,
            "label": label,
            "unit": unit,
            "intensities": levels.tolist(),
            "capacities": list(capacities),
        },
    )


def fragility(
    scene: Scene, levels: population.Floats, frequencies: tuple[float, float]
) -> Population:
    """The probability of overturning over the intensity, with the wall and without.

    The motions are pulses of the scene's kind at `PULSES` frequencies, over p, between the two of
    `frequencies`. The intensity is peak acceleration over g tan(alpha). Raises `InputError`.
    """
    slope, pulse = scene.gravity * scene.block.slope, scene.excitation
    if pulse.kind not in ("ricker", "sine"):
        raise InputError("are needed: the scene's excitation is no pulse", "records")
    unit = scene.frequency_parameter / (2.0 * math.pi)
    free = {"without a wall": scene.replace(walls=())}
    in_g = slope / GRAVITY_OF_RECORDS
    return Population(
        cases={"with the wall": scene, **free} if scene.walls else free,
        motions=[
            (
                f"{hertz:.4g} Hz",
                type(pulse)(**pulse.model_dump() | {"amplitude": slope, "period": 1.0 / hertz}),
                1.0,
            )
            for hertz in (np.geomspace(*frequencies, PULSES) * unit).tolist()
        ],
        levels=levels,
        across=Column("intensity", "peak acceleration / (g tan α)"),
        limits={"": MOST},
        settings={},
        data={"pga_g": in_g},
        other={"per_unit": in_g, "other_unit": "g", "other_label": "peak acceleration, g"},
    )
