"""`rockcheck assess`: does it fall, how far does it move, how sure is that."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from rockcheck.commands import (
    OUT,
    Played,
    chosen_models,
    model_names,
    scene_names,
    studied,
    tell_left_out,
)
from rockcheck.commands.record import ReadOption, RecordsArgument, record_sets
from rockcheck.ebm.spectrum import Floats
from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.files import UncertainScene, load_uncertain_scene
from rockcheck.validation.criteria import sampled
from rockcheck.validation.studies.population.answers import Assessment
from rockcheck.validation.studies.population.runs import gaps_of
from rockcheck.validation.studies.population.study import CAPACITIES, Population, fragility, ida
from rockcheck.validation.suite.motions import under_records

MOST_LEVELS, MOST_SAMPLES = 1000, 1 << 16
#: Of the pulses of a fragility curve, omega_p/p.
FREQUENCIES = (0.5, 8.0)
#: Draws of the numbers of a single run.
SAMPLES = 1024
REFERENCE = "ebm-unilateral"


@dataclass(frozen=True)
class Tried:
    """What is varied about the scene, beside its records."""

    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            min=2,
            max=MOST_SAMPLES,
            help="Draws of the scene's uncertain numbers for each record (a power of two is taken;"
            f" default without records: {SAMPLES}).",
        ),
    ] = None
    gaps: Annotated[
        str | None,
        typer.Option(
            "--gaps",
            metavar="[SIDE:]GAP,GAP...",
            help="Clear gaps (m) to try, such as 0,0.05,0.1 or left:0.05,0.1.",
        ),
    ] = None
    levels: Annotated[
        str | None,
        typer.Option(
            "--levels",
            metavar="MEASURE:LOW:HIGH:COUNT",
            help="Intensities to scale the records to: pga (g), pgv (m/s), pga-ratio, pgv-ratio or"
            " sa:PERIOD (g), such as pga:0.05:2:40. Without records: pulses, over g tan(alpha).",
        ),
    ] = None
    capacity: Annotated[
        list[float] | None,
        typer.Option(
            "--capacity",
            help="Peak rotation (alpha) of a fragility curve; repeatable.",
            min=1e-6,
            max=1.0,
        ),
    ] = None


def run(
    scene: Annotated[
        str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)
    ],
    records: RecordsArgument = None,
    models: Annotated[
        str,
        typer.Option(
            "--models",
            help="The model that plays, and others to compare with it, with commas between.",
            autocompletion=model_names,
        ),
    ] = REFERENCE,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A setting of the first model, such as time_step=1e-4, or MODEL.key=value;"
            " repeatable.",
        ),
    ] = None,
    tried: Tried = Tried(),
    read: ReadOption = None,
    played: Played = Played(OUT / "assess"),
) -> None:
    """Does it fall, how far does it move, how sure is that?

    And which gap is safe, and at which intensity does it fall.
    Plays the scene under its own base motion, or under each record; says what hand methods say
    beside it. A number that the scene file gives as { value = 0.3, sd = 0.03 } is uncertain.
    --read also takes scale=1.2 and vertical=true for the records.

    Exit 0: done; of a single run: converged. 1: a single run that is not converged. 3: a model
    failed.
    """
    given = load_uncertain_scene(scene)
    words = [
        word if "." in word.partition("=")[0] else f"{models.split(',')[0]}.{word}"
        for word in settings or ()
    ]
    chosen = chosen_models(models, words)
    clear: tuple[float, ...] = ()
    sides = tuple(wall.side for wall in given.scene.walls)
    if tried.gaps is not None:
        clear, sides, changed = gaps_of(tried.gaps, given.scene)
        given = UncertainScene(changed, given.spreads, given.correlation)
    sets = record_sets(records or (), read or ())
    cases, left_out = under_records({given.scene.name: given}, sets, Path())
    check_tried(tried, next(iter(cases.values())), given, recorded=bool(records))
    draws = tried.samples or (0 if records or not given.spreads else SAMPLES)
    named = {str(getattr(one.scene.excitation, "source", name)): one for name, one in cases.items()}
    study = Assessment(
        own=given,
        cases=named if records else cases,
        models=tuple(chosen),
        settings=chosen,
        gaps=clear,
        sides=sides,
        samples=1 << max(1, (draws - 1).bit_length()) if draws else 0,
        recorded=bool(records),
        levels=None
        if tried.levels is None
        else population_of(tried, given.scene, named if records else {}),
        left_out=left_out,
    )
    tell_left_out(left_out, "--read vertical=true plays such a component with the horizontal ones")
    studied(study, played)


def check_tried(
    tried: Tried, drawn: UncertainScene, given: UncertainScene, *, recorded: bool
) -> None:
    """Raises `InputError` for a scene in which nothing happens, or an option without an effect.

    `drawn` is the scene to be drawn.
    """
    scene = given.scene
    begins = (scene.initial_rotation, scene.initial_angular_velocity, scene.initial_velocity)
    rests = scene.excitation.kind == scene.vertical.kind == "rest"
    besides = " besides the excitation that the records replace" if given.spreads else ""
    for wrong, option, said in (
        (
            rests and not (recorded or any(begins) or scene.initial_height),
            "records",
            "are needed: the base of the scene is at rest",
        ),
        (
            tried.samples is not None and not drawn.spreads,
            "--samples",
            f"no number of the scene{besides} is uncertain: write one as"
            " { value = 0.3, sd = 0.03 }",
        ),
        (
            tried.capacity and not (recorded and tried.levels),
            "--capacity",
            "needs records and --levels",
        ),
    ):
        if wrong:
            raise InputError(said, option)


def population_of(tried: Tried, scene: Scene, cases: dict[str, UncertainScene]) -> Population:
    """What --levels asks for. Raises `InputError`.

    An incremental dynamic analysis of the `cases` under records; without any, the fragility under
    pulses of the scene's kind.
    """
    measure, values = levels_of(tried.levels or "")
    if not cases:
        if measure not in ("", "pga-ratio"):
            raise InputError(f"{measure} needs records; of pulses it is pga-ratio", "--levels")
        return fragility(scene, values, FREQUENCIES)
    return ida(
        scene,
        [(name, sampled(one.scene.excitation, one.scene.duration)) for name, one in cases.items()],
        values,
        measure=measure or "pga",
        capacities=tried.capacity or CAPACITIES,
        upward={
            name: one.scene.vertical
            for name, one in cases.items()
            if one.scene.vertical != scene.vertical
        },
    )


def levels_of(text: str) -> tuple[str, Floats]:
    """The measure and the intensities that MEASURE:LOW:HIGH:COUNT means. Raises `InputError`."""
    *measure, low, high, count = ["", "", "", *text.split(":")]
    try:
        first, last, number = float(low), float(high), float(count)
    except ValueError:
        first = last = number = 0.0
    if not (0.0 < first < last < math.inf and number in range(2, MOST_LEVELS + 1)):
        raise InputError(
            printable(
                "give MEASURE:LOW:HIGH:COUNT such as pga:0.05:2:40, 0 < LOW < HIGH, 2 to"
                f" {MOST_LEVELS} of them, not {text!r}",
                160,
            ),
            "--levels",
        )
    return ":".join(filter(None, measure)), np.linspace(first, last, int(number))
