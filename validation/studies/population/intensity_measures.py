"""How strong a motion is: measures of intensity.

In: a motion and the scene that it moves. Out: its intensity, which is in proportion to the size of
the motion, so that the factor of a motion is the wanted intensity over its own. The command, the
plan, and whatever needs the size of a motion call it.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rockcheck.scenes import InputError, Scene, errors, files, recordings
from rockcheck.scenes.recordings import intensity
from rockcheck.validation.criteria import sampled


@dataclass(frozen=True)
class Measure:
    """A measure of intensity: its name for options, label, unit, and value of a motion.

    It is `of` the ground's motion, or `of_floor`: of that of the block's base.
    """

    name: str
    label: str
    unit: str
    of: Callable[[recordings.Recording, Scene], float]
    of_floor: bool = False


def _pga_ratio(motion: recordings.Recording, scene: Scene) -> float:
    return float(np.max(np.abs(motion.samples))) / (scene.gravity * scene.block.slope)


def _pgv_ratio(motion: recordings.Recording, scene: Scene) -> float:
    velocity = intensity.peak_velocity(motion)
    return velocity * scene.frequency_parameter / (scene.gravity * scene.block.slope)


MEASURES = {
    measure.name: measure
    for measure in (
        Measure("pga", "PGA", "g", lambda motion, scene: intensity.peak_acceleration(motion)),
        Measure(
            "pfa",
            "peak floor acceleration",
            "g",
            lambda motion, scene: intensity.peak_acceleration(motion),
            of_floor=True,
        ),
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


def size_of(measure: Measure, given: files.UncertainScene) -> float:
    """The intensity of a scene's horizontal motion as it is; 0 of a base at rest."""
    motion = given.scene.excitation if measure.of_floor else given.ground_motion
    if motion.kind == "rest":
        return 0.0
    return float(measure.of(sampled(motion, motion.quiet_after), given.scene))
