"""Runs at given intensities (`--levels`): incremental dynamic analysis, and fragility.

In: a scene with motions, and intensities. Out: tasks, and curves: an incremental dynamic analysis
(Vamvatsikos and Cornell 2002) of records, or the fragility under pulses. The command makes
`Levels`, the plan plays them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import Floats, InputError, Pulse, Scene, files, recordings
from rockcheck.validation.finding import (
    Column,
)
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.intensity_measures import Measure, size_of
from rockcheck.validation.studies.population.tasks import PeaksTask, Settings, effort
from rockcheck.validation.uncertainty import fragility

#: Records of a set, at the least; frequencies of a set of pulses.
FEWEST, PULSES = 2, 50


#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: Above all peaks of blocks that stand (alpha).
ANY_STANDING_PEAK = 1e300
#: Sets of motions drawn anew for the interval of a fitted median.
DRAWS = 200


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Scenes, each under all motions at all `levels` of intensity, in both directions.

    `cases` are the scenes by name and motion, with the intensity of the motion as it is. `limits`
    are the events that have a curve: peaks (alpha) by name. `across` is the intensity; `per_g`
    makes it g, where it is another unit. `both`: the vertical motion is scaled, too. With
    `lines` each motion has a line. `data` is what `--json` says besides.
    """

    cases: Mapping[tuple[str, str], tuple[Scene, float]]
    levels: Floats
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

    def peaks(self, done: Mapping[Any, Any]) -> dict[str, Floats]:
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

    def curves(self, done: Mapping[Any, Any]) -> list[fragility.Curve]:
        """A curve a scene and event."""
        return [
            fragility.curve_of(case + event, peaks > limit, np.isnan(peaks), self.levels, DRAWS)
            for case, peaks in self.peaks(done).items()
            for event, limit in self.limits.items()
        ]


def levels_of_records(
    cases: Mapping[str, files.UncertainScene],
    levels: Floats,
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
        size = size_of(measure, given)
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


def levels_of_pulses(
    scene: Scene,
    levels: Floats,
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
