"""A block under many motions at many intensities: incremental dynamic analysis (Vamvatsikos and
Cornell 2002) and fragility.

An intensity is in proportion to the size of its motion, so the factor of a motion is the wanted
intensity over that of the motion as it is.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rockcheck.scenes import InputError, Record, Scene
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.scenes.recordings import Recording, intensity
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build, family
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import Block, Column, Finding, Table, text
from rockcheck.validation.studies.population.curves import (
    DRAWS,
    Curve,
    Floats,
    blocks_of,
    curve_of,
    lines_of,
)
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty.population import Runs, compiled, play

Motions = Sequence[tuple[str, Recording]]
#: Records of a set, at the least; frequencies of a set of pulses.
FEWEST, PULSES = 2, 50
#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: Time of a run as a rule, s, of compiled models and of others; and of all up to which no process
#: of their own is worth while.
A_RUN, A_SLOW_RUN, SOON = 1e-3, 1.0, 5.0
#: Exit code where a model failed.
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
        return ", ".join(filter(None, self.of))

    def depends(self) -> Any:
        """The scene with its motion, the model, the factors, and the code that plays them."""
        cell = provenance.cell_key(self.scene, self.model, dict(self.settings))
        return cell, self.factors, provenance.code_digest(play.__module__)


@dataclass(frozen=True, kw_only=True)
class Population(Study):
    """Scenes, by the names of the cases, each under all motions at all `levels` of intensity, in
    both directions.

    A motion has a name and its own intensity. `limits` are the events that have a curve: peaks
    (alpha) by name. `across` is the intensity, `other` its axis in another unit; `data` is told
    besides.
    """

    name: str
    title: str
    cases: Mapping[str, Scene]
    motions: Sequence[tuple[str, Any, float]]
    levels: Floats
    across: Column
    limits: Mapping[str, float]
    model: str
    settings: Mapping[str, Any]
    data: Mapping[str, Any]
    other: dict[str, Any] | None = None
    record = Runs

    @cached_property
    def batches(self) -> dict[str, list[Batch]]:
        """One a motion, by the case. Raises `InputError` where the model cannot play a scene."""
        player = build(self.model, self.settings)
        for scene in self.cases.values() if compiled(player) else ():
            player.check(scene)
        expected = 2 * len(self.levels) * (A_RUN if compiled(player) else A_SLOW_RUN)
        soon = expected * len(self.motions) * len(self.cases) < SOON
        return {
            case: [
                Batch(
                    (case, name),
                    scene.replace(excitation=motion),
                    (*(self.levels / own).tolist(), *(-self.levels / own).tolist()),
                    self.model,
                    tuple(self.settings.items()),
                    expected=expected,
                    compiles=self.model if family(self.model).compiled else "",
                    where="here" if soon else "worker",
                )
                for name, motion, own in self.motions
            ]
            for case, scene in self.cases.items()
        }

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Batch]:
        """All batches at once."""
        return [batch for some in self.batches.values() for batch in some]

    @staticmethod
    def play(task: Batch) -> Runs:
        """The runs of a batch."""
        motion, scene = task.scene.excitation, task.scene
        scenes = [scene.replace(excitation=motion.scaled(factor)) for factor in task.factors]
        return play(scenes, build(task.model, dict(task.settings)))

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """A curve a case and event; of one case also the lines of all motions."""
        curves: list[Curve] = []
        blocks: list[Block] = []
        for case, batches in self.batches.items():
            played = [one for one in batches if isinstance(done.get(one), Runs)]
            if played:
                peaks = np.array([done[one].peaks for one in played]).reshape(len(played), 2, -1)
                if not case:
                    names = [one.label for one in played]
                    blocks += lines_of(names, peaks, self.levels, self.across)
                curves += [
                    curve_of(case + event, peaks > limit, np.isnan(peaks), self.levels, DRAWS)
                    for event, limit in self.limits.items()
                ]
        if curves:
            blocks += blocks_of(curves, self.across, self.other)
        own = Column("own", f"{self.across.label} as it is", self.across.unit)
        rows = [[name, size] for name, _, size in self.motions]
        blocks.append(
            Table("motions", [text("motion"), own], rows, "Motions", on="page", folded=True)
        )
        count = f"{len(self.motions)} motions in both directions, {len(self.levels)} intensities"
        medians = [
            f"{one.label} {one.median:.3g} {self.across.unit}" for one in curves if one.median
        ]
        return Finding(
            self.name,
            self.title,
            f"{count}. Median {self.across.label}: {', '.join(medians) or 'no curve fits'}.",
            blocks,
            {"model": self.model, **self.data},
            exit_code=FAILED if any(isinstance(one, Failure) for one in done.values()) else 0,
        )


def _per_slope(scene: Scene) -> float:
    """1/(g tan alpha), s^2/m."""
    pivot = scene.block.weaker_pivot
    return pivot.height / (scene.gravity * pivot.arm)


#: Measures of intensity: label, unit, and value of a record for a scene.
MEASURES: Mapping[str, tuple[str, str, Callable[[Recording, Scene], float]]] = {
    "pga": ("PGA", "g", lambda record, scene: intensity.peak_acceleration(record)),
    "pgv": ("PGV", "m/s", lambda record, scene: intensity.peak_velocity(record)),
    "pga-ratio": (
        "PGA/(g tan α)",
        "",
        lambda record, scene: float(np.max(np.abs(record.samples))) * _per_slope(scene),
    ),
    "pgv-ratio": (
        "p PGV/(g tan α)",
        "",
        lambda record, scene: (
            intensity.peak_velocity(record) * scene.frequency_parameter * _per_slope(scene)
        ),
    ),
}


def measure_of(word: str) -> tuple[str, str, Callable[[Recording, Scene], float]]:
    """The measure of that name, or of "sa:0.5": spectral acceleration at a period, s."""
    name, _, period = word.partition(":")
    if name == "sa":
        try:
            at = float(period)
        except ValueError:
            at = math.nan
        if 1e-3 <= at < math.inf:
            return f"Sa({at:g} s), 5 %", "g", lambda r, _: intensity.spectral_acceleration(r, at)
        said = f"{printable(word)!r} is not allowed: give a period from 0.001 s, as in sa:0.5"
        raise InputError(said, "--intensity")
    if word not in MEASURES:
        raise InputError(str(unknown_name("intensity", word, [*MEASURES, "sa:0.5"])), "--intensity")
    return MEASURES[word]


def _recorded(
    motions: Motions, size: Callable[[Recording], float]
) -> list[tuple[str, Record, float]]:
    """Records with their own intensities. Raises `InputError` for too few, or one without motion."""
    if len(motions) < FEWEST:
        raise InputError(f"{len(motions)} is too few: give at least {FEWEST} records", "records")
    found = [(name, Record.from_samples(r.samples, r.time_step), size(r)) for name, r in motions]
    for name, _, own in found:
        if own <= 0.0:
            raise InputError(f"{name}: a record without motion has no intensity", "records")
    return found


def ida(
    scene: Scene,
    motions: Motions,
    levels: Floats,
    *,
    measure: str = "pga",
    capacities: Sequence[float] = CAPACITIES,
    model: str = "ebm-unilateral",
    left_out: Sequence[str] = (),
) -> Population:
    """Peak rotation of the scene's block under each record, scaled to each intensity.

    Raises `InputError` for an unknown measure, fewer than two motions, or one without motion.
    """
    label, unit, of = measure_of(measure)
    return Population(
        name="ida",
        title=f"Incremental dynamic analysis: {scene.name}",
        cases={"": scene},
        motions=_recorded(motions, lambda record: of(record, scene)),
        levels=levels,
        across=Column("intensity", label, unit),
        limits={
            f"peak above {'α, or overturned' if limit == 1.0 else f'{limit:g} α'}": limit
            for limit in capacities
        },
        model=model,
        settings={"tolerance": 1e-8},
        data={
            "scene": scene.name,
            "measure": measure,
            "label": label,
            "unit": unit,
            "intensities": levels.tolist(),
            "capacities": list(capacities),
            "left_out": list(left_out),
        },
    )


def fragility(
    scene: Scene,
    motions: Motions,
    levels: Floats,
    frequencies: tuple[float, float],
    *,
    model: str = "ebm",
    settings: Mapping[str, Any] | None = None,
    left_out: Sequence[str] = (),
) -> Population:
    """The probability of overturning, with the wall and without, for a set of records, or, without
    any, for pulses of the scene's kind at `PULSES` frequencies, over p, between two.

    The intensity is peak acceleration over g tan(alpha). Raises `InputError`.
    """
    slope, pulse = scene.gravity * scene.block.slope, scene.excitation
    if not motions and pulse.kind not in ("ricker", "sine"):
        raise InputError("are needed: the scene's excitation is no pulse", "records")
    unit = scene.frequency_parameter / (2.0 * math.pi)
    free = {"without a wall": scene.replace(walls=())}
    return Population(
        name="fragility",
        title=f"Fragility: {scene.name}",
        cases={"with the wall": scene, **free} if scene.walls else free,
        motions=_recorded(motions, lambda record: float(np.max(np.abs(record.samples))) / slope)
        if motions
        else [
            (
                f"{hertz:.4g} Hz",
                type(pulse)(**pulse.model_dump() | {"amplitude": slope, "period": 1.0 / hertz}),
                1.0,
            )
            for hertz in (np.geomspace(*frequencies, PULSES) * unit).tolist()
        ],
        levels=levels,
        across=Column("intensity", "peak acceleration / (g tan α)"),
        limits={"": sys.float_info.max},
        model=model,
        settings=settings or {},
        data={
            "scene": scene.name,
            "pga_g": slope / GRAVITY_OF_RECORDS,
            "left_out": list(left_out),
        },
        other={
            "per_unit": slope / GRAVITY_OF_RECORDS,
            "other_unit": "g",
            "other_label": "peak acceleration, g",
        },
    )
