"""How strong a motion is, and populations of runs over given intensities (`--levels`).

In: a scene with motions, and intensities. Out: tasks, and curves: an incremental dynamic analysis
(Vamvatsikos and Cornell 2002) of records, or the fragility under pulses. Called by the command, the
plan, and whatever needs the size of a motion.

An intensity is in proportion to the size of its motion, so the factor of a motion is the wanted
intensity over the motion's own.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import InputError, Pulse, Scene, errors, files, recordings
from rockcheck.scenes.recordings import intensity
from rockcheck.validation.criteria import sampled
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
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.tasks import PeaksTask, Settings, effort
from rockcheck.validation.uncertainty import population

#: Records of a set, at the least; frequencies of a set of pulses.
FEWEST, PULSES = 2, 50
#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: Above all peaks of blocks that stand (alpha).
ANY_STANDING_PEAK = 1e300
#: Shares of the motions whose peaks stay below the quantiles' curves.
BAND: dict[float, Style] = {0.16: "dotted", 0.5: "smooth", 0.84: "dashed"}
#: The end of the axis of peaks (alpha).
FALLEN = 1.25
#: Sets of motions drawn anew for the interval of a fitted median.
DRAWS = 200


@dataclass(frozen=True)
class Measure:
    """A measure of intensity: its name for options, label, unit, and value of a motion."""

    name: str
    label: str
    unit: str
    of: Callable[[recordings.Recording, Scene], float]


def _pga_ratio(motion: recordings.Recording, scene: Scene) -> float:
    return float(np.max(np.abs(motion.samples))) / (scene.gravity * scene.block.slope)


def _pgv_ratio(motion: recordings.Recording, scene: Scene) -> float:
    velocity = intensity.peak_velocity(motion)
    return velocity * scene.frequency_parameter / (scene.gravity * scene.block.slope)


MEASURES = {
    measure.name: measure
    for measure in (
        Measure("pga", "PGA", "g", lambda motion, scene: intensity.peak_acceleration(motion)),
        Measure("pgv", "PGV", "m/s", lambda motion, scene: intensity.peak_velocity(motion)),
        Measure("pga-ratio", "PGA/(g tan α)", "", _pga_ratio),
        Measure("pgv-ratio", "p PGV/(g tan α)", "", _pgv_ratio),
    )
}


def measure_of(word: str) -> Measure:
    """The measure of that name, or of "sa:0.5": spectral acceleration at a period, s."""
    spectral = re.fullmatch(r"sa:(\d*\.?\d+)", word)
    if spectral and (period := float(spectral[1])) >= 1e-3:
        return Measure(
            word,
            f"Sa({period:g} s), 5 %",
            "g",
            lambda motion, scene: _resolved_acceleration(motion, period),
        )
    if word not in MEASURES:
        known = [*MEASURES, "sa:0.5"]
        raise InputError(str(errors.unknown_name("intensity", word, known)), "--levels")
    return MEASURES[word]


def _resolved_acceleration(motion: recordings.Recording, period: float) -> float:
    """Spectral acceleration (g) at a period (s) that the motion resolves; raises `InputError`."""
    low, high = intensity.resolved_periods(motion)
    if not low <= period <= high:
        raise InputError(
            f"sa:{period:g} is not resolved by a record of {high:g} s at {motion.time_step:g} s:"
            f" give a period from {low:g} to {high:g}",
            "--levels",
        )
    return intensity.spectral_acceleration(motion, period)


def size_of(measure: Measure, scene: Scene) -> float:
    """The intensity of a scene's horizontal motion as it is; 0 of a base at rest."""
    if scene.excitation.kind == "rest":
        return 0.0
    return float(measure.of(sampled(scene.excitation, scene.excitation.quiet_after), scene))


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Scenes, each under all motions at all `levels` of intensity, in both directions.

    `cases` are the scenes by name and motion, with the intensity of the motion as it is. `limits`
    are the events that have a curve: peaks (alpha) by name. `across` is the intensity; `per_g`
    makes it g, where it is another unit. `both`: the vertical motion is scaled, too. With
    `lines` each motion has a line. `data` is what `--json` says besides.
    """

    cases: Mapping[tuple[str, str], tuple[Scene, float]]
    levels: population.Floats
    across: Column
    limits: Mapping[str, float]
    model: str
    settings: Settings
    data: Mapping[str, Any]
    per_g: float | None = None
    both: bool = False
    lines: bool = False
    tasks: Sequence[PeaksTask] = field(init=False)

    def __post_init__(self) -> None:
        """Makes the tasks, one a scene and motion."""
        count = 2 * len(self.levels)
        how = effort(self.model, dict(self.settings), count, count * len(self.cases))
        tasks = [
            PeaksTask(
                (case, motion),
                scene,
                self.model,
                self.settings,
                factors=(*(self.levels / size).tolist(), *(-self.levels / size).tolist()),
                both=self.both,
                **how,
            )
            for (case, motion), (scene, size) in self.cases.items()
        ]
        object.__setattr__(self, "tasks", tasks)

    def peaks(self, done: Mapping[Any, Any]) -> dict[str, population.Floats]:
        """By scene, the peaks (motion, direction, level) of the motions that were played."""
        by_case: dict[str, list[tuple[float, ...]]] = {}
        for task in self.played(done):
            by_case.setdefault(task.about[0], []).append(done[task].peaks)
        return {
            case: np.array(peaks).reshape(-1, 2, len(self.levels))
            for case, peaks in by_case.items()
        }

    def played(self, done: Mapping[Any, Any]) -> list[PeaksTask]:
        """The tasks with a result."""
        return [task for task in self.tasks if isinstance(done.get(task), results.Peaks)]

    def curves(self, done: Mapping[Any, Any]) -> list[population.Curve]:
        """A curve a scene and event."""
        return [
            population.curve_of(case + event, peaks > limit, np.isnan(peaks), self.levels, DRAWS)
            for case, peaks in self.peaks(done).items()
            for event, limit in self.limits.items()
        ]


def sentence_of(levels: Levels, curves: Sequence[population.Curve]) -> str:
    """The medians of the curves."""
    medians = [
        f"{curve.label} {curve.median:.3g} {levels.across.unit}".rstrip()
        for curve in curves
        if curve.median > 0.0
    ]
    motions = len({motion for _, motion in levels.cases})
    return (
        f"{motions} motions in both directions, {len(levels.levels)} intensities."
        f" Median {levels.across.label}: {', '.join(medians) or 'no curve fits'}."
    )


def blocks_of(
    levels: Levels, curves: Sequence[population.Curve], done: Mapping[Any, Any]
) -> list[Block]:
    """The curves, the lines of all motions, and the motions as they are."""
    blocks: list[Block] = []
    if levels.lines and (peaks := levels.peaks(done)):
        names = [task.about[1] for task in levels.played(done)]
        blocks += line_blocks(names, np.concatenate([*peaks.values()]), levels)
    if curves:
        blocks += [curve_plot(curves, levels), fit_table(curves, levels), curve_table(curves)]
    motions = {motion: size for (_, motion), (_, size) in levels.cases.items()}
    own = Column("own", f"{levels.across.label} as it is", levels.across.unit)
    rows = [[motion, size] for motion, size in motions.items()]
    blocks.append(Table("motions", [text("motion"), own], rows, "Motions", on="page", folded=True))
    return blocks


def curve_plot(curves: Sequence[population.Curve], levels: Levels) -> Plot:
    """The curves with their bands, and their fits."""
    series = []
    for curve in curves:
        level, share, low, high, fit = zip(*curve.points, strict=True)
        series.append(Series(curve.label, level, share, low, high, style="smooth"))
        series.append(Series(curve.label, level, fit, style="dots"))
    in_g = {"other_unit": "g", "other_label": "peak acceleration, g", "per_unit": levels.per_g}
    return Plot(
        "fragility",
        "Fragility",
        panels=[Panel("", series)],
        x=Axis(levels.across.head),
        y=Axis("probability", limits=(0.0, 1.0)),
        note="Share of the runs, its 95 % band (the motions count, not the runs), and the lognormal"
        " curve of the greatest likelihood, dotted.",
        live=True,
        data=in_g if levels.per_g else None,
    )


def fit_table(curves: Sequence[population.Curve], levels: Levels) -> Table:
    """The lognormal fits."""
    columns = [
        text("case", "event"),
        Column("median", f"median {levels.across.label}", levels.across.unit),
        Column("low", "95 % from"),
        Column("high", "to"),
        Column("dispersion", digits=2, help=f"standard deviation of ln({levels.across.label})"),
        Column("motions", brief=False),
        Column("undecided", "undecided runs", brief=False),
    ]
    rows: list[list[Any]] = [
        [
            curve.label,
            curve.median,
            curve.low,
            curve.high,
            curve.dispersion,
            curve.motions,
            curve.undecided,
        ]
        for curve in curves
    ]
    if levels.per_g:
        columns.append(Column("median_g", "median", "g"))
        rows = [[*row, levels.per_g * row[1]] for row in rows]
    note = "Lognormal fits; the interval of the median is from drawing the motions anew."
    return Table("fits", columns, rows, note=note)


def curve_table(curves: Sequence[population.Curve]) -> Table:
    """The points of the curves."""
    names = ("intensity", "share", "band_low", "band_high", "lognormal_fit")
    rows = [[curve.label, *point] for curve in curves for point in curve.points]
    return Table("fragility", [text("case"), *map(Column, names)], rows, on="file")


def line_blocks(motions: Sequence[str], peaks: population.Floats, levels: Levels) -> list[Block]:
    """Peaks (motion, direction, level) as a line a motion and direction, and their quantiles.

    A quantile is the smallest peak that the share of the motions does not exceed. A line ends where
    the block falls.
    """
    x = levels.levels.tolist()
    flat = peaks.reshape(-1, len(x))
    quantiles = np.nanquantile(flat, list(BAND), axis=0, method="inverted_cdf")
    lines = [
        (name, sign, line)
        for name, both in zip(motions, peaks.tolist(), strict=True)
        for sign, line in zip((1, -1), both, strict=True)
    ]
    drawn = [
        Series(name if sign > 0 else f"{name}, reversed", x, line, style="thin")
        for name, sign, line in lines
    ]
    bands = [
        Series(f"{100.0 * share:g} %", x, line, style=style)
        for (share, style), line in zip(BAND.items(), quantiles.tolist(), strict=True)
    ]
    ida = [
        [name, sign, level, math.nan if peak == math.inf else peak, int(peak == math.inf)]
        for name, sign, line in lines
        for level, peak in zip(x, line, strict=True)
    ]
    of_levels = [
        [level, *(math.nan if value == math.inf else value for value in row)]
        for level, row in zip(x, quantiles.T.tolist(), strict=True)
    ]
    ida_columns = map(Column, ("direction", "intensity", "peak_rotation_alpha", "overturned"))
    shares = [Column(f"p{100.0 * share:g}") for share in BAND]
    return [
        Plot(
            "lines",
            f"Peak rotation against {levels.across.label}",
            panels=[Panel("", [*drawn, *bands])],
            x=Axis(levels.across.head),
            y=Axis("peak |θ|/α", limits=(0.0, FALLEN)),
            note="A grey line a motion; it ends where the block falls. Coloured: the peak that 16,"
            " 50 and 84 % of the motions stay below.",
            live=True,
        ),
        Table("ida", [text("record"), *ida_columns], ida, on="file"),
        Table("quantiles", [Column("intensity"), *shares], of_levels, on="file"),
    ]


def ida(
    cases: Mapping[str, files.UncertainScene],
    levels: population.Floats,
    measure: Measure,
    model: str,
    settings: Settings,
    capacities: Sequence[float] = CAPACITIES,
) -> Levels:
    """Peak rotation of the block under each record, scaled to each intensity.

    The vertical motion of a record is scaled with it. Raises `InputError` for fewer than two
    records, or one without motion.
    """
    if len(cases) < FEWEST:
        raise InputError(f"{len(cases)} is too few: give at least {FEWEST} records", "records")
    sized = {}
    for name, given in cases.items():
        size = size_of(measure, given.scene)
        if size <= 0.0:
            raise InputError(f"{name}: a record without motion has no intensity", "records")
        sized["", name] = given.scene, size
    limits = {
        f"peak above {'α, or overturned' if limit == 1.0 else f'{limit:g} α'}": limit
        for limit in capacities
    }
    return Levels(
        cases=sized,
        levels=levels,
        across=Column("intensity", measure.label, measure.unit),
        limits=limits,
        model=model,
        settings=settings,
        data={
            "measure": measure.name,
            "label": measure.label,
            "unit": measure.unit,
            "intensities": levels.tolist(),
            "capacities": list(capacities),
        },
        both=True,
        lines=True,
    )


def fragility(
    scene: Scene,
    levels: population.Floats,
    frequencies: tuple[float, float],
    model: str,
    settings: Settings,
) -> Levels:
    """The probability of overturning over the intensity, with the wall and without.

    The motions are pulses of the scene's kind at `PULSES` frequencies, over p, between the two of
    `frequencies`. The intensity is peak acceleration over g tan(alpha). Raises `InputError`.
    """
    pulse = scene.excitation
    if not isinstance(pulse, Pulse):
        raise InputError("are needed: the scene's excitation is no pulse", "records")
    slope = scene.gravity * scene.block.slope
    hertz = np.geomspace(*frequencies, PULSES) * scene.frequency_parameter / (2.0 * math.pi)
    variants = {"without a wall": scene.replace(walls=())}
    if scene.walls:
        variants = {"with the wall": scene, **variants}
    cases = {
        (case, f"{frequency:.4g} Hz"): (
            variant.replace(excitation=pulse.replace(amplitude=slope, period=1.0 / frequency)),
            1.0,
        )
        for case, variant in variants.items()
        for frequency in hertz.tolist()
    }
    in_g = slope / recordings.GRAVITY_OF_RECORDS
    return Levels(
        cases=cases,
        levels=levels,
        across=Column("intensity", "peak acceleration / (g tan α)"),
        limits={"": ANY_STANDING_PEAK},
        model=model,
        settings=settings,
        data={"pga_g": in_g},
        per_g=in_g,
    )
