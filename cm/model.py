"""The Continuous Model as a model of a scene: settings, set-up, run."""

import math
import time
from dataclasses import replace
from functools import partial
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from rockcheck.cm.grid import GRID
from rockcheck.scenes import (
    Cost,
    Event,
    Frozen,
    History,
    Positive,
    Scene,
    errors,
    kinematics,
    observation,
    progress,
)

#: Most steps of a run: at 0.1 to 0.3 microseconds each, some ten minutes.
MOST_STEPS = 4_000_000_000
#: Longest stretch of motion (s) in one call of the compiled loop: it bounds the memory for events,
#: and Ctrl-C is heard between.
SLAB = 5.0


class ContinuousModel(Frozen):
    """The paper's Continuous Model (Chatzis & Smyth 2012): corners on springs and dampers.

    One equation of motion holds in all modes.

    Each bottom corner meets the floor, each side's corners a wall, in a Kelvin-Voigt contact that
    can only push; the floor has stick-slip friction with a memory. As the stiffness rises the
    motion tends to that of a rigid block whose floor can only push (the *unilateral* event-based
    model), not to the paper's, whose pivot the floor may pull.

    penetration
        The one target that ties the two numerical knobs, in m: how deep the block sinks when it
        stands on one corner. The contacts' stiffness per unit mass is k/m = g/penetration. The
        error falls with the penetration itself without walls, with its root where a wall has
        restitution (the duration of the contact).
    stiffness
        k/m in 1/s^2, in place of that.
    time_step
        Longest step in s; None means 3/sqrt(k/m), from which on shorter ones change nothing (El
        Centro, k/m = 9.81e8: 1.4e-6 of alpha from the rigid motion after 12 s; 6.5e-6 at 10, 1.4e-4
        at 30 times 1/sqrt(k/m)). Impacts have shorter steps of their own, whatever it is.
    damping_rule
        "calibrated": a contact that closes is given the damping with which a clamped contact of its
        effective mass has the scene's restitution (`contact_law.damping_ratio`,
        `impacts.effective_mass`). "paper": (33) with the whole mass, constant.

    What the calibration leaves out: slip that stops or turns within an impact (then friction, not
    the spring, decides; on floors with restitution up to 0.2 of it at a friction of 0.3, 0.5 at 1),
    another corner that the impact presses down (a wall hit at more than the slenderness angle,
    0.02). A restitution of zero is reached within
    `contact_law.least_restitution`, 7e-5 for the paper's
    block.
    """

    #: The name by which reports and the command line call this model.
    name: ClassVar[str] = "cm"
    penetration: Positive = 1e-8
    stiffness: Positive | None = None
    time_step: Positive | None = None
    damping_rule: Literal["calibrated", "paper"] = "calibrated"

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if self.stiffness is not None and "penetration" in self.model_fields_set:
            raise errors.InputError("cannot be given together with penetration", "stiffness")
        return self

    def coarser(self, factor: float) -> Self:
        """The same model with steps `factor` times as long and contacts softer by `factor`^2.

        The step goes with 1/sqrt(k/m).
        """
        change = (
            {"penetration": factor**2 * self.penetration}
            if self.stiffness is None
            else {"stiffness": self.stiffness / factor**2}
        )
        if self.time_step is not None:
            change["time_step"] = factor * self.time_step
        return self.model_copy(update=change)

    def stiffness_in(self, scene: Scene) -> float:
        """Stiffness of a contact per unit mass in that scene, 1/s^2."""
        return scene.gravity / self.penetration if self.stiffness is None else self.stiffness

    def time_step_in(self, scene: Scene) -> float:
        """Longest step in s in that scene, a whole fraction of `GRID`."""
        longest = (
            3.0 / math.sqrt(self.stiffness_in(scene)) if self.time_step is None else self.time_step
        )
        return GRID / math.ceil(GRID / longest * (1.0 - 1e-12))

    def check(self, scene: Scene) -> None:
        """Raises `InputError` where the scene asks for physics that this model excludes."""
        errors.check_kind(scene, Scene, "load_scene", "scene")
        scene.check_friction("the continuous model")

    def simulate(self, scene: Scene) -> History:
        """The motion of the scene's block. Events: floor impacts, wall impacts, overturning.

        Raises `InputError` (see `check`), and `ModelFailure` where the motion gains energy out of
        nothing (far too long a step, absurd excitation) or asks for too many steps.
        """
        self.check(scene)
        began = time.perf_counter()
        from rockcheck.cm import extremes, geometry, impacts, integrate, start
        from rockcheck.cm.base_motion import base_of
        from rockcheck.cm.state import STRIKE

        times = scene.run_times
        stiffness, dt = self.stiffness_in(scene), self.time_step_in(scene)
        if times[-1] / dt > MOST_STEPS:
            raise errors.ModelFailure(
                f"cm: {times[-1] / dt:.3g} steps of {dt:.3g} s are needed; at most"
                f" {MOST_STEPS:.3g} are allowed"
            )
        base = base_of(scene)
        parameters = start.parameters_of(scene, stiffness, dt, self.damping_rule == "calibrated")
        state = start.initial_state(scene, parameters)
        output = np.empty((len(times), 6))
        output[0] = kinematics.of_mass(scene.block, scene.initial_state)
        rows_a_slab = max(1, math.ceil(SLAB / scene.output_step))
        slab_time = min(rows_a_slab * scene.output_step, times[-1])
        strikes_a_contact = math.ceil(slab_time / impacts.STRIKE_TIME) + 4
        strikes = np.empty(state.contacts.size * strikes_a_contact, STRIKE)
        end = float(times[-1])
        advance = partial(integrate.advance, parameters, base, state, strikes, end)
        advance(times[:0], output[:0])  # compiles, or reads the compiled loop from its cache
        ready, ready_cpu = time.perf_counter(), time.process_time()
        written = []
        row, ending = 1, integrate.DONE
        while row < len(times) and ending == integrate.DONE:
            slab = slice(row, row + rows_a_slab)
            play = partial(advance, times[slab], output[slab])
            ending, rows, count = progress.interruptible(play)
            row += rows
            written.append(strikes[:count].copy())
            if state.steps > MOST_STEPS:
                raise errors.ModelFailure(
                    f"cm: more than {MOST_STEPS:.3g} steps by {state.t:.4g} s"
                )
        if ending == integrate.BLOWN_UP:
            raise errors.ModelFailure(
                f"cm: the motion blew up (more energy than work done) before {times[row]:.4g} s,"
                f" with a step of {dt:.3g} s and a stiffness of {stiffness:.3g} 1/s^2"
            )
        count = impacts.record_strikes(state, 0.0, state.t, strikes, 0)
        written.append(strikes[:count])
        cost = Cost(
            wall_seconds=time.perf_counter() - ready,
            cpu_seconds=time.process_time() - ready_cpu,
            set_up=ready - began,
            steps=int(state.steps),
            evaluations=int(state.sweeps),
        )
        in_order = sorted(np.concatenate(written).tolist())
        floor_contacts = 2 * geometry.FLOOR
        happened = [
            Event(
                t=t,
                kind="floor impact" if contact >= floor_contacts else "wall impact",
                impulse=impulse,
            )
            for t, contact, impulse, _ in in_order
        ]
        if ending == integrate.OVERTURNED:
            side = "left" if state.motion.theta > 0.0 else "right"
            happened.append(Event(t=float(state.t), kind=f"overturned {side}"))
        history = observation.observe(
            scene,
            self.name,
            kinematics.of_box(scene.block, output[:row]),
            events=happened,
            cost=cost,
            settings={
                "penetration": scene.gravity / stiffness,
                "stiffness": stiffness,
                "time_step": dt,
                "damping_rule": self.damping_rule,
            },
        )
        sides = {number: side for side, number in start.WALLS.items()}
        at_walls = [
            (sides[contact // 2], t, impulse, speed)
            for t, contact, impulse, speed in in_order
            if contact < floor_contacts
        ]
        last = kinematics.of_box(scene.block, np.array(state.motion.item()))
        found = extremes.extremes_of(scene, state.extremes, last, history, at_walls)
        return replace(history, model_extremes=found)
