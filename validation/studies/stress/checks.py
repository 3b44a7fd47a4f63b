"""One run of an event-based model against every invariant.

In: a model and a scene. Out: `CheckedRun`. Called by the runs of stress and by tests.
"""

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from rockcheck.ebm import EventBasedModel, batch
from rockcheck.ebm.core.settle import SETTLE
from rockcheck.scenes import (
    History,
    ModelFailure,
    Pulse,
    Record,
    Scene,
    Side,
    Wall,
    kinematics,
)
from rockcheck.validation.studies.stress import ends, extremes
from rockcheck.validation.studies.stress.conditions import conditions
from rockcheck.validation.studies.stress.energy import GROUP, energy_error
from rockcheck.validation.studies.stress.horizon import Horizon
from rockcheck.validation.studies.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.studies.stress.motion import Motion, not_finite

#: Rows of an audited history: this fraction of the shortest time in the scene, and at most this
#: many.
FINE, MOST_ROWS = 64, 4000
#: A whole run goes on for this time (sqrt(R/g)) after the base, and ends in at most so many steps.
SETTLED, MOST_STEPS = 300.0, 50_000
#: The reach of a block is known where it is this many times the largest change between two rows.
RESOLVES = 4.0
#: Invariants of an audited run that cannot always be judged.
UNSURE = ("energy", "fate")
SWAPPED = {"overturned left": "overturned right", "overturned right": "overturned left"}


def check_run(
    model: EventBasedModel, scene: Scene, *, seed: int = 0, audit: bool = False, only: str = ""
) -> CheckedRun:
    """Plays a scene and checks every invariant, or only one.

    With `audit` also those that ask for many rows or a long run: energy, clearance, decided, fate,
    and what the rows show of extremes.
    """
    played = audited(scene) if audit else scene
    try:
        history = model.simulate(played)
    except ModelFailure as error:
        return CheckedRun(figures={"ends": 1.0}, failure=str(error))
    figures = {"ends": 0.0, "finite": not_finite(history)}
    if figures["finite"]:
        return CheckedRun(figures=figures, outcome=history.outcome)
    motion, cost = Motion(played, history), history.cost
    figures |= {"outcome": float(_contradicts(played, history)), **conditions(model, motion)}
    figures["extremes"] = extremes.beyond(motion)
    if audit:
        figures |= _audit(model, scene, motion, seed)
    bounces = max([scene.floor.restitution, *(wall.restitution for wall in scene.walls)]) > 0.0
    if model.pivot == "unilateral":
        figures["impacts"] = (
            cost.largest_energy_gain
            if cost.energy_gains and (model.energy_cap or not bounces)
            else 0.0
        )
    horizon = Horizon(model, motion, seed)
    later = {
        "mirror": lambda: _mirror(model, motion),
        "similarity": lambda: horizon.largest_difference(similar(played, seed)),
        "tolerance": lambda: horizon.largest_difference(played, model.finer()),
    }
    figures |= {name: figure() for name, figure in later.items() if only in ("", name)}
    return CheckedRun(
        figures={name: figure for name, figure in figures.items() if only in ("", name)},
        outcome=history.outcome,
        counts={
            "events": len(history.event_list),
            "gaining": int(cost.energy_gains > 0),
            "horizons": int(horizon.is_computed),
        },
        largest_gain=cost.largest_energy_gain,
        rules=cost.rules,
        failure=horizon.failure,
        unjudged=tuple(name for name in UNSURE if audit and name not in figures),
    )


def _audit(model: EventBasedModel, scene: Scene, motion: Motion, seed: int) -> dict[str, float]:
    """The figures that ask for many rows or a long run; what cannot be judged is left out."""
    audited_scene, history = motion.scene, motion.history
    figures = {"decided": _decided_difference(model, scene)}
    with suppress(ModelFailure):  # at the finer tolerance, whose error does not disturb the balance
        energy = _energy(model.finer(), audited_scene)
        figures |= {"energy": energy} if energy is not None else {}
    with suppress(ModelFailure):
        figures["clearance"] = float(_is_clearance_wrong(model, audited_scene, seed))
    with suppress(ModelFailure):
        figures["rows"] = extremes.change_with_rows(motion, model.simulate)
    with suppress(ModelFailure):
        figures["unseen"] = extremes.unseen(motion, model.simulate)
    fate = ends.contradictions(model, audited_scene, history)
    figures |= {"fate": fate} if fate is not None else {}
    return figures


def _is_clearance_wrong(model: EventBasedModel, scene: Scene, seed: int) -> bool:
    """Whether a wall just out of reach is struck, or one just within reach is not.

    The distance to the reach is the largest change of the clearance between two rows, and what the
    model does not resolve. False for a block that falls, or hardly moves. A strike may be part of
    a landing (the choice "lands along a wall").
    """
    side: Side = "left" if seed % 2 else "right"
    rows = scene.output_times
    if len(rows) < 2:
        return False
    scene = scene.replace(duration=float(rows[-1]))  # what follows has no row
    history = model.simulate(scene.replace(walls=()))
    if history.overturned_at is not None:
        return False
    gaps = kinematics.clearance(
        scene.block, side, 0.0, history.channels["x"], history.channels["theta"]
    )
    reached = history.extremes
    reach = reached.reach_left if side == "left" else reached.reach_right
    # A contact that parts at the settling speed stays closed: what is smaller is not resolved.
    room = float(np.max(np.abs(np.diff(gaps)))) + 2.0 * SETTLE * scene.block.radius
    if reach - max(0.0, -float(gaps[0])) < RESOLVES * room:
        return False
    return _strikes(model, scene, side, reach + room) or not _strikes(
        model, scene, side, reach - room
    )


def _strikes(model: EventBasedModel, scene: Scene, side: Side, gap: float) -> bool:
    """Whether a wall with that gap (m) alone is struck."""
    history = model.simulate(scene.replace(walls=(Wall(side=side, gap=gap),)))
    return "lands along a wall" in history.cost.rules or any(
        event.kind == "wall impact" for event in history.event_list
    )


def _decided_difference(model: EventBasedModel, scene: Scene) -> float:
    """How far the peak of a run that ends once it is certain is from the whole run's, rad.

    Or, if more, how far a row of the whole run is above its peak. Pi where they overturn to other
    sides. 0 where no run ends so (Bouc-Wen), or the whole one has not ended `SETTLED` after the
    base.
    """
    if not model.decides:
        return 0.0
    rows, capped = batch.pack([scene], model), model.model_copy(update={"most_steps": MOST_STEPS})
    quiet = max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    ends = rows.given["duration"] / scene.duration * quiet + SETTLED
    rows.given["duration"], rows.given["output_step"] = ends, ends / MOST_ROWS
    early, whole = (
        batch.run_batch(rows, capped, until_decided=not count, rows=count, strict=False, jobs=1)
        for count in (0, MOST_ROWS)
    )
    decided, run = early.runs[0], whole.runs[0]
    if early.failed[0] or not (whole.side[0] or run.at_rest):
        return 0.0
    above_peak = np.max(np.abs(whole.out[0, : run.rows, 2])) - run.peak
    difference = max(abs(decided.peak - run.peak), above_peak)
    return float(difference) if early.side == whole.side else math.pi


def _energy(model: EventBasedModel, scene: Scene) -> float | None:
    """The energy's error, or None where it cannot be judged.

    If it is too large, or cannot be judged, it is computed again from rows four times as dense.
    That removes an error of the integral, but not one of the motion.
    """
    error = energy_error(model, Motion(scene, model.simulate(scene)))
    if error is None or error > INVARIANTS["energy"].bound:
        near = scene.replace(output_step=scene.output_step / 4.0)
        closer = energy_error(model, Motion(near, model.simulate(near)))
        error = error if closer is None else closer
    return error


def audited(scene: Scene) -> Scene:
    """The scene with rows so dense that integrals over them are exact to 1e-10.

    It is cut after `MOST_ROWS` rows.
    """
    bases = scene.excitation, scene.vertical
    step = min(
        [
            0.03 * math.sqrt(scene.block.radius / scene.gravity),
            *(base.period / FINE for base in bases if isinstance(base, Pulse)),
        ]
    )
    sample_steps = [base.time_step for base in bases if isinstance(base, Record)]
    if sample_steps:
        sample_step = sample_steps[0]
        step = sample_step / (GROUP * max(1, math.ceil(sample_step / (GROUP * step))))
    return scene.replace(output_step=step, duration=min(scene.duration, MOST_ROWS * step))


def _contradicts(scene: Scene, history: History) -> bool:
    falls = [event.kind for event in history.event_list if event.kind.startswith("overturned")]
    times = [event.t for event in history.event_list] + [scene.duration * (1.0 + 1e-12)]
    backward = bool(np.any(np.diff(times) < 0.0))
    if history.outcome.startswith("overturned"):
        return backward or not falls == [history.outcome] == [history.event_list[-1].kind]
    whole = len(history.channels["t"]) == len(scene.output_times)
    upright = np.all(np.abs(history.channels["theta"]) < math.pi / 2)
    return backward or bool(falls) or not (whole and upright)


def _mirror(model: EventBasedModel, motion: Motion) -> float:
    """Number of values that differ in any bit from those of the mirror image.

    Infinite where the lengths differ, or the mirrored run fails.
    """
    history = motion.history
    try:
        image = model.simulate(motion.scene.mirrored())
    except ModelFailure:
        return math.inf
    if len(history.channels["t"]) != len(image.channels["t"]):
        return math.inf
    if len(history.event_list) != len(image.event_list):
        return math.inf
    odd = ("x", "theta", "x_dot", "theta_dot", "slip", "slip_rate")
    mirrored = {
        name: -image.channels[name] if name in odd else image.channels[name]
        for name in ("t", "y", "y_dot", "mode", *odd)
    }
    differ = [
        *(np.sum(motion.channels[name] != values) for name, values in mirrored.items()),
        *(
            replace(a, kind=SWAPPED.get(a.kind, a.kind)) != b
            for a, b in zip(history.event_list, image.event_list, strict=True)
        ),
        extremes.bits_of_mirror_image(history.extremes, image.extremes),
    ]
    return float(sum(differ) + (image.outcome != SWAPPED.get(history.outcome, history.outcome)))


def similar(scene: Scene, seed: int) -> Scene:
    """The scene at another scale, with the same accelerations.

    Lengths are multiplied by k, times by sqrt(k); k is random in 0.01 to 100.
    """
    k = float(np.exp(np.random.default_rng([seed, 1]).uniform(math.log(1e-2), math.log(1e2))))
    root = math.sqrt(k)
    return scene.replace(
        block=scene.block.scaled(k),
        walls=tuple(wall.replace(gap=k * wall.gap) for wall in scene.walls),
        excitation=scene.excitation.stretched(root),
        vertical=scene.vertical.stretched(root),
        duration=root * scene.duration,
        output_step=root * scene.output_step,
        initial_angular_velocity=scene.initial_angular_velocity / root,
        initial_velocity=root * scene.initial_velocity,
        initial_height=k * scene.initial_height,
    )
