"""`rockcheck ida`: peak rotation against the intensity of recorded motions."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import typer

from rockcheck.commands import (
    OUT,
    JobsOption,
    OutOption,
    SchedulerOption,
    scene_names,
    studied,
    tell_left_out,
)
from rockcheck.commands.record import ReadOption, RecordsArgument, reading_of
from rockcheck.ebm.spectrum import Floats
from rockcheck.scenes import InputError, load_scene
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.scenes.recordings.sets import files_of, motions_of

MODELS = ("ebm-unilateral", "ebm")
MOST_LEVELS = 1000
LEVELS, PULSE_LEVELS = "0.05:2:40", "1:12:40"
#: Of the pulses, omega_p/p.
FREQUENCIES = (0.5, 8.0)


def run(
    scene: Annotated[
        str,
        typer.Argument(
            help="Block, floor and walls: a named scene or a .toml file.",
            autocompletion=scene_names,
        ),
    ],
    records: RecordsArgument = None,
    intensity: Annotated[
        str,
        typer.Option(
            "--intensity",
            help="Its measure: pga, pgv, pga-ratio, pgv-ratio, or sa:0.5 (at a period, s).",
        ),
    ] = "pga",
    levels: Annotated[
        str | None,
        typer.Option(
            "--levels",
            metavar="LOW:HIGH:COUNT",
            help=f"The intensities (default {LEVELS}; of pulses {PULSE_LEVELS}).",
        ),
    ] = None,
    capacity: Annotated[
        list[float] | None,
        typer.Option(
            "--capacity",
            help="Peak rotation (alpha) of a fragility curve; repeatable.",
            min=1e-6,
            max=1.0,
        ),
    ] = None,
    model: Annotated[
        str,
        typer.Option(
            "--model", help="ebm-unilateral, or ebm as in the paper: the block cannot hop."
        ),
    ] = MODELS[0],
    read: ReadOption = None,
    out: OutOption = OUT / "ida",
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Peak rotation against the intensity of records.

    Each record is scaled to every intensity and played in both directions by the event-based model:
    a curve a motion, their median and 16 to 84 % band, and fragility curves for peak rotations.

    Without records: the probability that pulses of the scene's kind overturn the block, with its
    wall and without; their intensity is peak acceleration over g tan(alpha).
    """
    from rockcheck.validation.studies.population.study import CAPACITIES, fragility, ida

    if model not in MODELS:
        raise InputError(str(unknown_name("model", model, MODELS)), "--model")
    what = load_scene(scene)
    if not records:
        values = levels_of(levels or PULSE_LEVELS)
        studied(
            fragility(what, [], values, FREQUENCIES, model=model),
            out,
            jobs=jobs,
            scheduler=scheduler,
        )
    values = levels_of(levels or LEVELS)
    motions, left_out = motions_of(files_of(records), reading_of(read))
    study = ida(
        what,
        motions,
        values,
        measure=intensity,
        capacities=capacity or CAPACITIES,
        model=model,
        left_out=left_out,
    )
    tell_left_out(left_out)
    studied(study, out, jobs=jobs, scheduler=scheduler)


def levels_of(text: str) -> Floats:
    """The intensities that LOW:HIGH:COUNT means. Raises `InputError`."""
    try:
        low, high, count = map(float, text.split(":"))
    except ValueError:
        low = high = count = 0.0
    if not (0.0 < low < high < math.inf and count in range(2, MOST_LEVELS + 1)):
        said = f"give LOW:HIGH:COUNT, 0 < LOW < HIGH, 2 to {MOST_LEVELS} of them, not {text!r}"
        raise InputError(printable(said, 120), "--levels")
    return np.linspace(low, high, int(count))
