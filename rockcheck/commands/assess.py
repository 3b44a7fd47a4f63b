"""`rockcheck assess`: does it fall, how far does it move, how sure is that?

In: options, a scene, records. Out: a plan, which the study `population` plays and answers.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer

from rockcheck.commands.ending import run_study
from rockcheck.commands.model_choice import chosen_models, need_installed
from rockcheck.commands.notices import tell_left_out, tell_record_notes
from rockcheck.commands.options import OUT, Played, model_names, scene_names
from rockcheck.commands.record import ReadOption, record_sets
from rockcheck.scenes import InputError, Scene, Side, files, printable
from rockcheck.scenes.buildings import Regular
from rockcheck.validation.execute import models
from rockcheck.validation.paper import FREQUENCIES
from rockcheck.validation.studies.population import intensity_measures, plan
from rockcheck.validation.studies.population.capacities import Capacity, capacities_of
from rockcheck.validation.studies.population.levels import (
    CAPACITIES,
    Levels,
    levels_of_pulses,
    levels_of_records,
)
from rockcheck.validation.studies.population.storeys import Storeys
from rockcheck.validation.studies.population.study import Assessment
from rockcheck.validation.suite import motions

MOST_LEVELS, MOST_SAMPLES = 1000, 1 << 16
#: Half diagonals of the block that a capacity of its slip, or of its top, is at the most.
MOST_LENGTHS = 20.0
#: Draws of a scene's uncertain numbers under its own motion, and under each of its records.
OWN_DRAWS, RECORD_DRAWS = 256, 64


@dataclass(frozen=True)
class Varied:
    """What is varied about the scene, beside its records."""

    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            min=2,
            max=MOST_SAMPLES,
            help="Draws of the scene's uncertain numbers (a power of two is taken); default"
            f" {RECORD_DRAWS} for each record, {OWN_DRAWS} without records.",
        ),
    ] = None
    gaps: Annotated[
        str | None,
        typer.Option(
            "--gaps",
            metavar="[SIDE][:GAP,GAP...]",
            help="Clear gaps (m) in place of all up to where the block reaches: 0,0.05,0.1; or a"
            " side without a wall: left, or left:0,0.05.",
        ),
    ] = None
    levels: Annotated[
        str | None,
        typer.Option(
            "--levels",
            metavar="MEASURE[:LOW:HIGH:COUNT]",
            help="The measure of intensity: pga (g), pgv (m/s), pga-ratio, pgv-ratio, sa:PERIOD"
            " (g); pfa (g) on a storey; with bounds, as pga:0.05:2:40, all records are scaled to"
            " these intensities, too."
            " Without records: pulses, over g tan(alpha).",
        ),
    ] = None
    storeys: Annotated[
        str | None,
        typer.Option(
            "--storeys",
            metavar="LOW:HIGH",
            help="Storeys of the scene's [building] on which the block is tried, with a page by"
            " storey: 1:8.",
        ),
    ] = None
    capacity: Annotated[
        list[str] | None,
        typer.Option(
            "--capacity",
            metavar="QUANTITY:VALUE",
            help="What the block bears, for a fragility curve; repeatable. slip:0.05 (m), top:0.1"
            " (m), wall_speed:1.0 (m/s), rotation:0.5 (alpha), overturns; a number alone is a"
            " rotation.",
        ),
    ] = None


def assess(
    scene: Annotated[
        str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)
    ],
    records: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[RECORDS]...",
            help='Record files, folders of them, or patterns such as "RSN1_H*.AT2".',
        ),
    ] = None,
    models: Annotated[
        str,
        typer.Option(
            "--models",
            help="The model that plays, and others to compare with it, with commas between.",
            autocompletion=model_names,
        ),
    ] = models.REFERENCE,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A setting of the first model, such as time_step=1e-4, or MODEL.key=value;"
            " repeatable.",
        ),
    ] = None,
    varied: Varied = Varied(),
    read: ReadOption = None,
    played: Played = Played(OUT / "assess"),
) -> None:
    """Does it fall, how far does it move, how sure is that?

    Plays the scene under its own base motion, or under each record, until its outcome is decided;
    searches the gaps and the intensities at which it falls; says what hand methods say beside it. A
    number that the scene file gives as { value = 0.3, sd = 0.03 } is uncertain, and drawn.
    --read also takes scale=1.2 and vertical=true for the records.

    Exit 0: done; of a single run: converged. 1: a single run that is not converged. 3: a model
    failed.
    """
    given = files.load_uncertain_scene(scene)
    first = models.split(",")[0]
    chosen = chosen_models(
        models,
        [word if "." in word.partition("=")[0] else f"{first}.{word}" for word in settings or ()],
    )
    need_installed(chosen, "--models")
    cases, left_out = motions.under_records(
        {given.scene.name: given}, record_sets(records or (), read or ()), Path()
    )
    if records:
        cases = {
            str(getattr(case.ground_motion, "source", name)): case for name, case in cases.items()
        }
    check_varied(varied, next(iter(cases.values())), given, recorded=bool(records))
    measure = measure_of(varied.levels, recorded=bool(records))
    planned = plan.Plan(
        own=given,
        cases=cases,
        models=chosen,
        gaps=gap_ranges_of(varied.gaps, given.scene),
        draws=draws_of(varied.samples, cases, recorded=bool(records)),
        recorded=bool(records),
        measure=measure,
        capacities=searched_capacities(varied, given.scene, measure, recorded=bool(records)),
        left_out=left_out,
    )
    if has_bounds(varied.levels, measure):
        planned = plan.with_levels(
            planned, levels_of(varied, measure, planned, recorded=bool(records))
        )
    if varied.storeys is not None:
        check_for_storeys(varied, given)
        plans = {
            number: plan_of_storey(planned, given, number)
            for number in storeys_of(varied.storeys, given)
        }
        run_study(Storeys(plans=plans), played)
    _ = planned.numbers  # names a draw that is no scene, before anything is played
    tell_left_out(left_out, "--read vertical=true plays such a component with the horizontal ones")
    tell_record_notes(case.scene for case in cases.values())
    run_study(Assessment(plan=planned), played)


def storeys_of(text: str, given: files.UncertainScene) -> range:
    """The storeys that `--storeys` asks for. Raises `InputError`."""
    if not isinstance(given.building, Regular):
        raise InputError("needs a [building] of storeys in the scene file", "--storeys")
    most = given.building.storeys
    low, _, high = text.partition(":")
    if not (low.isdecimal() and high.isdecimal() and int(low) <= int(high) <= most):
        raise InputError(
            f"{printable(repr(text), 40)} is not allowed: LOW:HIGH within 0:{most}", "--storeys"
        )
    return range(int(low), int(high) + 1)


def check_for_storeys(varied: Varied, given: files.UncertainScene) -> None:
    """Raises `InputError` for what a page by storey does not have."""
    if given.spreads:
        raise InputError("needs a scene without uncertain numbers", "--storeys")
    for option, value in (("--gaps", varied.gaps), ("--samples", varied.samples)):
        if value is not None:
            raise InputError(f"does not go with {option}", "--storeys")
    if (varied.levels or "").count(":") > 1:
        raise InputError("goes with a measure of --levels, and no bounds", "--storeys")


def plan_of_storey(planned: plan.Plan, given: files.UncertainScene, number: int) -> plan.Plan:
    """The plan with the block on another storey, under the same motions of the ground."""
    assert isinstance(given.building, Regular)
    building = given.building.replace(storey=number)

    def moved(case: files.UncertainScene) -> files.UncertainScene:
        scene = case.scene.replace(excitation=case.ground_motion)
        return files.on_storey(replace(case, scene=scene), building)

    cases = {name: moved(case) for name, case in planned.cases.items()}
    return replace(planned, own=moved(planned.own), cases=cases, gaps=())


def searched_capacities(
    varied: Varied, scene: Scene, measure: intensity_measures.Measure, *, recorded: bool
) -> tuple[Capacity, ...]:
    """The capacities of `--capacity` whose least intensities are searched. Raises `InputError`.

    With records and bounds in `--levels` rotations are read off its runs in place of a search.
    """
    asked = capacities_of(varied.capacity or ())
    for capacity in asked:
        if capacity.quantity == "wall_speed" and not scene.walls:
            raise InputError(f"{capacity.name}: the scene has no wall", "--capacity")
        most = MOST_LENGTHS * scene.block.radius
        if capacity.quantity in ("slip", "top") and capacity.value > most:
            raise InputError(
                f"{capacity.name}: is it in m? At most {most:.3g} m, {MOST_LENGTHS:g} half"
                " diagonals of the block",
                "--capacity",
            )
    if recorded and has_bounds(varied.levels, measure):
        return tuple(capacity for capacity in asked if capacity.quantity != "rotation")
    return asked


def draws_of(
    samples: int | None, cases: Mapping[str, files.UncertainScene], *, recorded: bool
) -> int:
    """How many draws: a power of two; 0 where no number is uncertain."""
    if not any(case.spreads for case in cases.values()):
        return 0
    wanted = samples or (RECORD_DRAWS if recorded else OWN_DRAWS)
    return 1 << max(1, (wanted - 1).bit_length())


def check_varied(
    varied: Varied, drawn: files.UncertainScene, given: files.UncertainScene, *, recorded: bool
) -> None:
    """Raises `InputError` for a scene in which nothing happens, or an option without an effect.

    `drawn` is the scene to be drawn.
    """
    scene = given.scene
    begins = any(scene.initial_state[2:]) or scene.initial_height
    rests = scene.excitation.kind == scene.vertical.kind == "rest"
    if rests and not recorded and not begins:
        raise InputError("are needed: the base of the scene is at rest", "records")
    if varied.samples is not None and not drawn.spreads:
        besides = " besides the excitation that the records replace" if given.spreads else ""
        raise InputError(
            f"no number of the scene{besides} is uncertain: write one as"
            " { value = 0.3, sd = 0.03 }",
            "--samples",
        )
    if rests and not recorded and varied.capacity:
        raise InputError("needs a motion of the base: give records", "--capacity")


def gap_ranges_of(text: str | None, scene: Scene) -> tuple[plan.GapRange, ...]:
    """The gaps that `--gaps` asks for; without it those of the scene's walls.

    `0.05,0.1` are gaps (m) of the scene's walls, `left` all of that side, `left:0.05,0.1` gaps on
    that side, where a wall without rebound is tried if there is none. Raises `InputError`.
    """
    sides: tuple[Side, ...] = tuple(wall.side for wall in scene.walls)
    if text is None:
        return tuple(plan.GapRange(side) for side in sides)
    word, colon, numbers = text.partition(":")
    named = colon or not word[:1].isdigit()
    if named and word not in get_args(Side):
        raise InputError(f"{printable(word)!r} is not allowed: left or right", "--gaps")
    if named:
        sides = ("left",) if word == "left" else ("right",)
    listed = numbers if named else text
    values = gap_values(listed) if listed else ()
    if not sides:
        raise InputError(f"the scene has no wall: say on which side, as in left:{listed}", "--gaps")
    return tuple(plan.GapRange(side, values) for side in sides)


def gap_values(text: str) -> tuple[float, ...]:
    """Clear gaps (m), increasing. Raises `InputError`."""
    try:
        gaps = tuple(sorted({float(word) for word in text.split(",")}))
    except ValueError:
        gaps = (math.nan,)
    if not all(0.0 <= gap < math.inf for gap in gaps):
        raise InputError(
            f"{printable(text)!r} is not allowed: clear gaps in m, 0 or more, with commas between",
            "--gaps",
        )
    return gaps


def measure_of(levels: str | None, *, recorded: bool) -> intensity_measures.Measure:
    """The measure that `--levels` names. Raises `InputError`.

    Without a name it is PGA; of bounds without records, which scale pulses, over g tan(alpha).
    """
    words = (levels or "pga").split(":")
    if words[0] == "sa":
        return intensity_measures.measure_of(":".join(words[:2]))
    if words[0][:1].isdigit():
        return intensity_measures.measure_of("pga" if recorded else "pga-ratio")
    return intensity_measures.measure_of(words[0])


def has_bounds(levels: str | None, measure: intensity_measures.Measure) -> bool:
    """Whether `--levels` says more than the measure."""
    return levels is not None and levels != measure.name


def levels_of(
    varied: Varied, measure: intensity_measures.Measure, planned: plan.Plan, *, recorded: bool
) -> Levels:
    """The population that `--levels` asks for: MEASURE:LOW:HIGH:COUNT. Raises `InputError`.

    An incremental dynamic analysis under records; without any, the fragility under pulses of the
    scene's kind.
    """
    text = varied.levels or ""
    bounds = text.removeprefix(measure.name).removeprefix(":").split(":")
    try:
        low, high, count = (float(word) for word in bounds)
    except ValueError:
        low = high = count = 0.0
    if not (0.0 < low < high < math.inf and count in range(2, MOST_LEVELS + 1)):
        raise InputError(
            printable(
                "give MEASURE:LOW:HIGH:COUNT such as pga:0.05:2:40, 0 < LOW < HIGH, 2 to"
                f" {MOST_LEVELS} of them, not {text!r}",
                160,
            ),
            "--levels",
        )
    values = np.linspace(low, high, int(count))
    model: dict[str, Any] = {"model": planned.batch_model, "settings": planned.batch_settings}
    if recorded:
        rotations = tuple(
            capacity.value
            for capacity in capacities_of(varied.capacity or ())
            if capacity.quantity == "rotation"
        )
        return levels_of_records(
            planned.cases, values, measure, **model, capacities=rotations or CAPACITIES
        )
    if measure.name != "pga-ratio":
        raise InputError(f"{measure.name} needs records; of pulses it is pga-ratio", "--levels")
    return levels_of_pulses(planned.own.scene, values, FREQUENCIES, **model)
