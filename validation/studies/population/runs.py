"""Runs of a scene: those of an assessment, and populations under many motions and intensities.

A population is an incremental dynamic analysis (Vamvatsikos and Cornell 2002) or of fragility. An
intensity is in proportion to the size of its motion, so the factor of a motion is the wanted
intensity over the motion's own.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, get_args

import numpy as np
from pydantic import Field

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    Excitation,
    History,
    InputError,
    ModelFailure,
    Record,
    Scene,
    Side,
    Wall,
    errors,
    files,
    recordings,
    writing,
)
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy import compare, figures, impact_laws
from rockcheck.validation.execute import models
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
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty import population
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty

Motions = Sequence[tuple[str, recordings.Recording]]
#: The event-based model that plays populations, draws and gaps where the first one cannot.
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


def effort(model: str, settings: Mapping[str, Any], runs: int, every: int) -> dict[str, Any]:
    """For a `Task`: the usual time of these runs, s, and the code that they may have to compile.

    It is played in this process where `every` run takes less time than a worker needs to start.
    """
    a_run = A_RUN if models.family(model).compiled else A_SLOW_RUN
    return {
        "expected": runs * a_run,
        "compiles": models.compiles(model, settings),
        "where": "here" if every * a_run < SOON else "worker",
    }


@dataclass(frozen=True)
class Batch(OneScene):
    """Runs of a population that are played together: a scene at factors of its base motion.

    `both`: the vertical motion is scaled too, and not mirrored.
    """

    factors: tuple[float, ...] = field(default=(), repr=False)
    both: bool = False

    def play(self) -> tuple[float, ...]:
        """The peak of each run."""
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
    `other` its axis in another unit; `data` is what `--json` says besides. `model` plays, with
    these `settings`.
    """

    cases: Mapping[str, Scene]
    motions: Sequence[tuple[str, Any, float]]
    levels: population.Floats
    across: Column
    limits: Mapping[str, float]
    model: str
    settings: Mapping[str, Any]
    data: Mapping[str, Any]
    other: dict[str, Any] | None = None
    upward: Mapping[str, Excitation] = field(default_factory=dict)

    @cached_property
    def batches(self) -> list[Batch]:
        """One a case and motion. Raises `InputError` where the model cannot play a scene."""
        player: Any = models.build(self.model, self.settings)
        for scene in self.cases.values():
            player.check(scene)
        count, tasks = 2 * len(self.levels), len(self.motions) * len(self.cases)
        how = effort(self.model, self.settings, count, count * tasks)
        return [
            Batch(
                (case, name),
                scene.replace(excitation=motion, vertical=self.upward.get(name, scene.vertical)),
                self.model,
                tuple(self.settings.items()),
                (*(self.levels / own).tolist(), *(-self.levels / own).tolist()),
                name in self.upward,
                **how,
            )
            for case, scene in self.cases.items()
            for name, motion, own in self.motions
        ]

    def gather(self, ended: Mapping[Any, Any]) -> tuple[str, list[Block]]:
        """The answer, and the blocks: a curve a case and event; the lines of all motions."""
        played = [one for one in self.batches if one in ended]
        peaks = {
            case: np.array([ended[one] for one in played if one.of[0] == case]).reshape(
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
        medians = [
            f"{one.label} {one.median:.3g} {unit}".rstrip() for one in curves if one.median > 0.0
        ]
        return (
            f"{len(self.motions)} motions in both directions, {len(self.levels)} intensities."
            f" Median {self.across.label}: {', '.join(medians) or 'no curve fits'}."
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
    x = levels.tolist()
    quantiles = np.nanquantile(peaks.reshape(-1, len(x)), list(BAND), axis=0, method="inverted_cdf")
    lines = [
        (name, sign, line)
        for name, both in zip(motions, peaks.tolist(), strict=True)
        for sign, line in zip((1, -1), both, strict=True)
    ]
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
                [name, sign, level, math.nan if peak == math.inf else peak, int(peak == math.inf)]
                for name, sign, line in lines
                for level, peak in zip(x, line, strict=True)
            ],
            on="file",
        ),
        Table(
            "quantiles",
            [Column("intensity"), *(Column(f"p{100.0 * share:g}") for share in BAND)],
            [
                [level, *(math.nan if one == math.inf else one for one in row)]
                for level, row in zip(x, quantiles.T.tolist(), strict=True)
            ],
            on="file",
        ),
    ]


Measure = tuple[str, str, Callable[[recordings.Recording, Scene], float]]
#: Measures of intensity: label, unit, and value of a record for a scene.
MEASURES: Mapping[str, Measure] = {
    "pga": ("PGA", "g", lambda record, scene: recordings.intensity.peak_acceleration(record)),
    "pgv": ("PGV", "m/s", lambda record, scene: recordings.intensity.peak_velocity(record)),
    "pga-ratio": (
        "PGA/(g tan α)",
        "",
        lambda record, scene: np.max(np.abs(record.samples)) / (scene.gravity * scene.block.slope),
    ),
    "pgv-ratio": (
        "p PGV/(g tan α)",
        "",
        lambda record, scene: (
            recordings.intensity.peak_velocity(record)
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
            lambda record, scene: _resolved_acceleration(record, at),
        )
    if word not in MEASURES:
        raise InputError(
            str(errors.unknown_name("intensity", word, [*MEASURES, "sa:0.5"])), "--levels"
        )
    return MEASURES[word]


def _resolved_acceleration(record: recordings.Recording, period: float) -> float:
    """Spectral acceleration in g at a period (s) that the record resolves; raises `InputError`."""
    low, high = recordings.intensity.resolved_periods(record)
    if not low <= period <= high:
        raise InputError(
            f"sa:{period:g} is not resolved by a record of {high:g} s at {record.time_step:g} s:"
            f" give a period from {low:g} to {high:g}",
            "--levels",
        )
    return recordings.intensity.spectral_acceleration(record, period)


def ida(
    scene: Scene,
    motions: Motions,
    levels: population.Floats,
    *,
    measure: str = "pga",
    capacities: Sequence[float] = CAPACITIES,
    upward: Mapping[str, Excitation] | None = None,
    model: str = SWIFT,
    settings: Mapping[str, Any] = {},
) -> Population:
    """Peak rotation of the scene's block under each record, scaled to each intensity.

    The vertical motion `upward`, by the record's name, is scaled with it. Raises `InputError` for
    an unknown measure, fewer than two motions, or one without motion.
    """
    label, unit, of = measure_of(measure)
    sized = [
        (name, Record.from_samples(one.samples, one.time_step), float(of(one, scene)))
        for name, one in motions
    ]
    errors.refuse(
        (
            len(motions) < FEWEST,
            f"{len(motions)} is too few: give at least {FEWEST} records",
            "records",
        ),
        *(
            (own <= 0.0, f"{name}: a record without motion has no intensity", "records")
            for name, _, own in sized
        ),
    )
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
        model=model,
        settings={"tolerance": 1e-8, **settings},
        data={
            "measure": measure,
            "label": label,
            "unit": unit,
            "intensities": levels.tolist(),
            "capacities": list(capacities),
        },
    )


def fragility(
    scene: Scene,
    levels: population.Floats,
    frequencies: tuple[float, float],
    *,
    model: str = SWIFT,
    settings: Mapping[str, Any] = {},
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
    in_g = slope / recordings.GRAVITY_OF_RECORDS
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
        model=model,
        settings=settings,
        data={"pga_g": in_g},
        other={"per_unit": in_g, "other_unit": "g", "other_label": "peak acceleration, g"},
    )


Numbers = tuple[tuple[str, float], ...]
#: Rows of a history that is kept, at the most.
MOST_ROWS = 2000
#: Runs of one task, at the most.
MOST_RUNS = 256
#: Name of the runs by the other law of impacts, among the models.
LAW = "impact law"


class Ran(figures.Stored):
    """One run: its motion, or the reason why it has none.

    How far the block slid and how far it reached to the left and to the right are in m, also of a
    block that falls. `speeds` (m/s) are the largest at the walls that it struck, by side.
    """

    outcome: str
    motion: Mapping[str, float | None] = Field(default_factory=dict)
    slid: float = 0.0
    reach: Mapping[Side, float] = Field(default_factory=dict)
    speeds: Mapping[Side, float] = Field(default_factory=dict)
    reason: str = ""

    @property
    def fell(self) -> bool:
        """Whether the block overturned."""
        return self.outcome.startswith("overturned")

    @property
    def peak(self) -> float:
        """Peak rotation, alpha; 1, the balance point, where the block fell."""
        turned = self.motion.get("peak_rotation")
        return 1.0 if turned is None else min(turned, 1.0)

    @property
    def turned(self) -> float:
        """Peak rotation, alpha; infinite where the block fell."""
        return math.inf if self.fell else self.peak


class Played(figures.Stored):
    """The runs of a task, in the order of its variants.

    Of the first variant, where they were asked for: `history` as CSV, and `said`, by hand method
    whether its event happens, and how far it goes.
    """

    runs: tuple[Ran, ...]
    history: str = ""
    said: tuple[tuple[bool, float | None], ...] = ()


class Sure(figures.Stored):
    """How sure a run is: its numerical uncertainty, its law of impacts, its inputs.

    `depends_on_law_from_s` is the time (s) from which the run depends on the law of impacts;
    `inputs` is the effect of its uncertain numbers.
    """

    numerical: Numerical | None = None
    depends_on_law_from_s: float | None = None
    inputs: population.Inputs | None = None


@dataclass(frozen=True)
class Run(OneScene):
    """Runs of one scene: as it is, or with numbers changed.

    A gap that is infinite takes the wall away. `shown` asks for the history and for hand methods.
    """

    variants: tuple[Numbers, ...] = field(default=((),), repr=False)
    shown: bool = False

    def play(self) -> Played:
        """All variants, one after the other."""
        model = models.build(self.model, dict(self.settings))
        ran = [_ran(self.scene, numbers, model) for numbers in self.variants]
        runs, history = tuple(one for one, _ in ran), ran[0][1]
        if not self.shown:
            return Played(runs=runs)
        base, rows = base_of(self.scene), ""
        if history is not None:
            every = -(-len(history.channels["t"]) // MOST_ROWS)
            columns: dict[str, Any] = {n: v[::every] for n, v in history.channels.items()}
            rows = writing.columns_text(columns)
        return Played(
            runs=runs,
            history=rows,
            said=tuple(criterion.says(self.scene, base) for criterion in CRITERIA),
        )


def _ran(scene: Scene, numbers: Numbers, model: Any) -> tuple[Ran, History | None]:
    """A run of the scene with these numbers; a wall whose gap is infinite is taken away."""
    gone = [place.split(".")[1] for place, value in numbers if value == np.inf]
    scene = files.with_numbers(scene, {place: v for place, v in numbers if v != np.inf})
    if gone:
        scene = scene.replace(walls=[w for w in scene.walls if w.side not in gone])
    try:
        history = model.simulate(scene)
    except ModelFailure as failure:
        return Ran(outcome="", reason=str(failure)), None
    return Ran(
        outcome=history.outcome,
        motion=compare.motion_of(history, scene),
        slid=compare.largest_slip(history),
        reach={side: compare.largest_reach(history, scene, side) for side in get_args(Side)},
        speeds={side: speed for speed, side in sorted(compare.wall_speeds(history, scene))},
    ), history


@dataclass(frozen=True)
class Certainty(OneScene):
    """How sure a run is; with `samples` draws of the uncertain numbers of `given`, if any."""

    samples: int = 0
    given: files.UncertainScene | None = field(default=None, repr=False, compare=False)

    def depends(self) -> Any:
        """Also what is not known of the scene, where it is drawn."""
        return super().depends(), self.given and (
            {name: spread.model_dump() for name, spread in self.given.spreads.items()},
            self.given.correlation.tolist(),
        )

    def play(self) -> Sure:
        """Plays coarser steps or a finer tolerance, other laws of impacts, and the draws."""
        landing, own = (
            # no event-based model plays a floor that loses nothing
            impact_laws.parting_landing(self.scene) if self.scene.floor.restitution < 1.0 else None,
            dict(self.settings),
        )
        model = models.build(self.model, own)
        return Sure(
            numerical=numerical_uncertainty(model, self.scene),
            depends_on_law_from_s=None if landing is None else landing.t,
            inputs=population.propagate(
                self.given,
                model=model.model_copy(update={"tolerance": own.get("tolerance", 1e-8)})
                if isinstance(model, EventBasedModel) and model.decides
                else None,
                samples=self.samples,
            )
            if self.given
            else None,
        )


@dataclass(frozen=True, kw_only=True)
class Asked(Study):
    """What an assessment is asked for, and its tasks.

    `cases` are the scene under each of its motions, by their names. `own` is the
    scene with its own excitation. The first of `models`, with their settings, plays each case; the
    others are compared with it. `gaps` (m) are those of the walls on `sides`.
    `samples` numbers are drawn for each case and gap, or, without records, for the single run.
    `levels` is the population over intensities.
    """

    own: files.UncertainScene
    cases: Mapping[str, files.UncertainScene]
    models: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: {SWIFT: {}})
    gaps: Sequence[float] = ()
    sides: Sequence[Side] = ()
    samples: int = 0
    recorded: bool = False
    levels: Population | None = None
    left_out: Sequence[str] = ()
    record = tuple[float, ...] | Played | Sure
    name = "assess"

    @property
    def model(self) -> str:
        """The model that plays each case."""
        return next(iter(self.models))

    @property
    def swift(self) -> str:
        """The model that plays draws and gaps: an event-based one, if one can."""
        return (
            self.model
            if self.own.scene.floor.restitution == 1.0
            or isinstance(models.build(self.model, {}), EventBasedModel)
            else SWIFT
        )

    @cached_property
    def draws(self) -> tuple[Numbers, ...]:
        """The numbers of each draw, the same for every case.

        Empty without records: the numbers are then drawn about the single run.
        """
        first = next(iter(self.cases.values()))
        if not (self.samples and self.recorded):
            return ()
        from scipy.stats import qmc

        sobol = qmc.Sobol(len(first.spreads), seed=np.random.default_rng(1))
        for row in (values := first.values(sobol.random(self.samples))):
            first.at(row)  # names a draw that is no scene
        return tuple(tuple(zip(first.names, row, strict=True)) for row in values.tolist())

    def _runs(
        self,
        what: str,
        model: str,
        variants: Sequence[Numbers] = ((),),
        settings: Mapping[str, Any] | None = None,
        besides: Sequence[Wall] = (),
    ) -> dict[str, list[Task]]:
        """By case, runs as tasks of at most `MOST_RUNS`; those of the case as it is are `shown`.

        `besides` are walls that the scene does not have.
        """
        given = self.models.get(model, {}) if settings is None else settings
        return {
            case: [
                Run(
                    (what, case, "" if model == self.model else model),
                    one.scene.replace(walls=(*one.scene.walls, *besides)),
                    model,
                    tuple(given.items()),
                    part,
                    shown=not what and model == self.model,
                    **effort(model, given, len(part), self._every),
                )
                for part in [
                    tuple(variants[first : first + MOST_RUNS])
                    for first in range(0, len(variants), MOST_RUNS)
                ]
            ]
            for case, one in self.cases.items()
        }

    @cached_property
    def _every(self) -> int:
        """About how many runs there are, but for those of `levels`."""
        return len(self.cases) * (6 + len(self.draws)) * (1 + len(self.gaps))

    @cached_property
    def at_gaps(self) -> dict[float, dict[str, list[Task]]]:
        """The runs at each gap, without the walls at an infinite one."""
        found, scene = {}, self.own.scene
        new = [Wall(side=one, gap=self.gaps[-1]) for one in self.sides if not scene.wall(one)]
        for gap in (*self.gaps, np.inf) if self.sides else ():
            walls = {f"walls.{side}.gap": gap for side in self.sides}
            variants = [tuple({**dict(one), **walls}.items()) for one in self.draws or ((),)]
            found[gap] = self._runs(
                "without the wall" if gap == np.inf else f"gap {gap:g} m",
                self.swift,
                variants,
                besides=new,
            )
        return found

    @cached_property
    def parts(self) -> dict[Any, dict[str, list[Task]]]:
        """Tasks by what they are for and by case.

        "shown" each case as it is; "drawn" its draws; `gaps`; the names of other models, `LAW`
        among them; "sure" how sure each is, and, by the name "", the scene under its own motion.
        """
        settings = self.models[self.model]
        law = (
            {
                LAW: self._runs(
                    "other law of impacts",
                    SWIFT,
                    settings={
                        **settings,
                        "impacts": "moreau"
                        if settings.get("impacts") == "floor-first"
                        else "floor-first",
                    },
                )
            }
            if self.model == SWIFT and self.own.scene.walls
            else {}
        )
        drawn = bool(self.samples) and not self.recorded
        return {
            "shown": self._runs("", self.model),
            "drawn": self._runs("draws", self.swift, self.draws),
            **self.at_gaps,
            **{model: self._runs("", model) for model in [*self.models][1:]},
            **law,
            "sure": {
                case: [
                    Certainty(
                        ("certainty", case or given.scene.name),
                        given.scene,
                        self.model,
                        tuple(settings.items()),
                        self.samples if drawn else 0,
                        given if drawn else None,
                        **effort(self.model, settings, 4, self._every),
                    )
                ]
                for case, given in {"": self.own, **(self.cases if self.recorded else {})}.items()
            },
        }

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All of them at once."""
        return [
            *(task for part in self.parts.values() for some in part.values() for task in some),
            *(self.levels.batches if self.levels else ()),
        ]


def gaps_of(text: str, scene: Scene) -> tuple[tuple[float, ...], tuple[Side, ...]]:
    """Gaps (m) and their sides that `--gaps` asks for.

    `0.05,0.1` are gaps of the scene's walls, `left:0.05,0.1` of that side, where a wall without
    rebound is tried if there is none. Raises `InputError`.
    """
    side, colon, numbers = text.rpartition(":")
    sides: tuple[Any, ...] = (side,) if colon else tuple(wall.side for wall in scene.walls)
    try:
        gaps = sorted({float(word) for word in numbers.split(",")})
    except ValueError:
        gaps = [-1.0]
    errors.refuse(
        (colon and side not in get_args(Side), f"{side!r} is not allowed: left or right", "--gaps"),
        (
            not all(0.0 <= gap < np.inf for gap in gaps),
            f"{text!r} is not allowed: clear gaps in m, 0 or more, with commas between",
            "--gaps",
        ),
        (not sides, f"the scene has no wall: say on which side, as in left:{numbers}", "--gaps"),
    )
    return tuple(gaps), sides
