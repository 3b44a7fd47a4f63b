"""The event-based models: `ebm`, `ebm-unilateral` and `ebm-bouc-wen`."""

import time
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, Strict

from rockcheck.ebm.core import names
from rockcheck.scenes import Frozen, Positive, Scene, errors, history, observation, progress

#: The finest tolerance.
FINEST = 1e-15
#: The laws of impacts at several contacts at once (see ebm.core.contact_impacts).
ImpactLaw = Literal["moreau", "closed", "open", "floor-first", "leading-first", "trailing-first"]


class EventBasedModel(Frozen):
    """The paper's Event-Based Model and its extensions.

    `tolerance` bounds the local truncation error of each Taylor step: of a rotation in alpha, of a
    length in alpha R. `pivot`: "bilateral" is the paper's model, in which the pivot never leaves
    the floor; "unilateral" lets the floor only push, so that the block may hop. `friction`:
    "coulomb" switches exactly between stick and slip, "bouc-wen" is the paper's regularisation (9)
    with the `yield_displacement` u_y in m, "no-slip" is Housner's block (both bilateral). `impacts`
    (unilateral) is the law of impacts at several contacts at once: "moreau" strikes all that touch
    together, "floor-first" one after another; they differ where a block lands flush against a wall.
    ("closed" and "open" are the two branches that "moreau" takes there.) "leading-first" and
    "trailing-first" strike one bottom corner before the other where a block lands flat while it
    slides. `energy_cap` (unilateral) lowers the restitution of an impact that would add kinetic
    energy to the largest that does not. `estimate_error` runs the scene again at tolerance/100 and
    puts the largest change of theta/alpha into `cost.error_estimate`. A run that reaches
    `most_steps` or `most_events` is a `ModelFailure`.
    """

    tolerance: Annotated[float, Strict(), Field(ge=FINEST, le=1e-2)] = 1e-10
    pivot: Literal["bilateral", "unilateral"] = "bilateral"
    friction: Literal["coulomb", "bouc-wen", "no-slip"] = "coulomb"
    impacts: ImpactLaw = "moreau"
    energy_cap: bool = False
    yield_displacement: Positive = 1e-5
    estimate_error: bool = False
    most_steps: Annotated[int, Field(ge=1)] = 20_000_000
    most_events: Annotated[int, Field(ge=1)] = 200_000

    @property
    def name(self) -> str:
        """`ebm`, `ebm-unilateral` or `ebm-bouc-wen`."""
        if self.friction == "bouc-wen":
            return "ebm-bouc-wen"
        return "ebm" if self.pivot == "bilateral" else "ebm-unilateral"

    @property
    def decides(self) -> bool:
        """Whether a run knows when its outcome is certain: Coulomb's friction, or none."""
        return self.friction != "bouc-wen"

    def finer(self) -> Self:
        """The same model at a hundredth of its tolerance, but at least the finest tolerance.

        The limit is double precision's.
        """
        return self.model_copy(update={"tolerance": max(self.tolerance / 100.0, FINEST)})

    def check(self, scene: Scene) -> None:
        """Raises `InputError` where the scene asks for physics that this model excludes."""
        errors.check_kind(scene, Scene, "load_scene", "scene")
        floor, height, speed = scene.floor, scene.initial_height, scene.initial_velocity
        bilateral, bouc_wen = self.pivot == "bilateral", self.friction == "bouc-wen"
        if self.friction != "no-slip":
            scene.check_friction("event-based models")
        if self.friction != "coulomb" and not bilateral:
            raise errors.InputError(
                f'{self.pivot!r} is not allowed with friction="{self.friction}", only "bilateral"',
                "pivot",
            )
        if bouc_wen and floor.mu_s != floor.friction:
            raise errors.InputError(
                f"{floor.mu_s:g} is not allowed: Bouc-Wen friction has one coefficient,"
                f" {floor.friction:g}",
                "floor.static_friction",
            )
        if self.friction == "no-slip" and speed != 0.0:
            raise errors.InputError(
                f'{speed:g} is not allowed with friction="no-slip": it never slips',
                "initial_velocity",
            )
        if bilateral and floor.restitution > 0.0:
            raise errors.InputError(
                f"{floor.restitution:g} is not allowed with the bilateral pivot: a floor impact"
                " that rebounds is free flight, which this model excludes; use 0, or"
                ' pivot="unilateral"',
                "floor.restitution",
            )
        if bilateral and height > 0.0:
            raise errors.InputError(
                f"{height:g} is not allowed with the bilateral pivot, which never leaves the"
                ' floor; use 0, or pivot="unilateral"',
                "initial_height",
            )
        if floor.restitution == 1.0:
            raise errors.InputError(
                "1 is not allowed: a block that loses nothing at the floor never settles; use less"
                " than 1",
                "floor.restitution",
            )

    def simulate(self, scene: Scene) -> history.History:
        """The motion of the scene on its output grid.

        Raises `InputError` (see `check`) or `ModelFailure`.
        """
        began = time.perf_counter()
        from rockcheck.ebm import natural
        from rockcheck.ebm.core import state
        from rockcheck.ebm.extremes import extremes_of

        given, unit = natural.pack([scene], self), natural.time_unit(scene)
        shape = 1, len(scene.output_times)
        records = state.Records(
            out=np.empty((*shape, 6)),
            out_mode=np.zeros(shape, dtype=np.int8),
            log=np.empty((1, self.most_events, 5)),
            extremes=np.zeros(1, state.EXTREMES),
        )
        states, work = natural.state_for(self, 0, keeps=names.Keep.EXTREMES), state.workspace()
        kept = np.empty(1, state.FOUND)
        ending, ready, seconds, cpu = self._played(given, states, work, records, kept)
        end = kept[0]
        t, written = float(end.t), int(end.rows)
        if ending in names.FAILURES:
            raise errors.ModelFailure(
                f"{self.name}: {names.FAILURES[ending]} at t = {t * unit:.6g} s"
            )
        found, (out, modes, log) = states[0], (rows[0] for rows in records[:3])
        rows = max(written, 1)
        speed = scene.block.radius / unit
        out[0] = natural.state_of(scene) if written == 0 else out[0]
        events = [
            history.Event(
                t=at * unit,
                kind=names.EVENT_NAMES[int(kind)],
                mode_before=names.MODE_NAMES[int(before)],
                mode_after=names.MODE_NAMES[int(after)],
                impulse=impulse * speed,
            )
            for at, kind, before, after, impulse in log[: min(found.events, len(log))].tolist()
        ]
        cost = history.Cost(
            wall_seconds=seconds,
            cpu_seconds=cpu,
            set_up=ready - began,
            steps=int(end.steps),
            evaluations=int(end.steps),
            energy_gains=int(found.gains),
            largest_energy_gain=float(found.largest_gain),
            rules={
                name: int(count)
                for name, count in zip(names.RULE_NAMES, found.rules, strict=True)
                if count
            },
        )
        seen = natural.to_si(scene, out[:rows])
        # at the end of the run (the last row may come before): what slides without friction, or
        # rocks, as slowly as in any history at rest (`outcome_of`)
        motion = np.array([end.motion.tolist()])
        slow = np.abs(natural.to_si(scene, motion)[0, 2:]) < history.STILL
        outcome = "at rest" if end.at_rest or slow.all() else "moving"
        if ending == names.Ending.OVERTURNED:
            outcome = "overturned left" if end.motion.theta > 0 else "overturned right"
        played = observation.observe(
            scene,
            self.name,
            seen,
            mode=np.array(names.MODE_NAMES)[modes[:rows]],
            events=events,
            outcome=outcome,
            cost=cost,
            settings=self.model_dump(),
            model_extremes=extremes_of(scene, records.extremes, given.given["setting"]),
        )
        if not self.estimate_error:
            return played
        finer = self.finer().model_copy(update={"estimate_error": False}).simulate(scene)
        thetas = finer.channels["theta"], played.channels["theta"]
        fine, coarse = (theta[: min(map(len, thetas))] for theta in thetas)
        change = np.max(np.abs(fine - coarse)) / scene.block.alpha
        return replace(played, cost=replace(cost, error_estimate=float(change)))

    def _played(self, rows: Any, states: Any, *work: Any) -> tuple[int, float, float, float]:
        """Plays a run. Returns its Ending, when its clock started, its wall and CPU time (s)."""
        from rockcheck.ebm import natural

        runs = rows, states, *work
        # What is compiled or loaded is so before the clock starts. A run of few steps is played
        # here: to hand it over takes longer. Each sample of a record is a step.
        short = len(rows.samples) < _INTERPRETED
        slow = natural.interpreted_loop(self, *runs) if short else None
        at_once = _INTERPRETED if slow else _AT_ONCE
        few = min(self.most_steps, at_once if len(rows.samples) < at_once else 0)
        loop = slow or natural.loop_of(self, *runs)

        def play(most_steps: int) -> int:
            states["control"]["most_steps"] = most_steps
            loop(*runs)
            return int(work[-1]["ending"][0])

        ready, cpu = time.perf_counter(), time.process_time()
        ending = play(few) if few else names.Ending.TOO_MANY_STEPS
        if ending == names.Ending.TOO_MANY_STEPS and few < self.most_steps:
            if loop is slow:
                loop = natural.loop_of(self, *runs)
                ready, cpu = time.perf_counter(), time.process_time()
            ending = progress.interruptible(partial(play, self.most_steps))
        return ending, ready, time.perf_counter() - ready, time.process_time() - cpu


#: Steps that take about as long as to hand a run over to the thread that Ctrl-C need not wait for.
_AT_ONCE = 500
#: Steps that the interpreter takes faster than the compiler compiles: one in about a millisecond.
_INTERPRETED = 2500
