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
    Excitation,
    Floats,
    Frozen,
    History,
    Positive,
    Record,
    Rest,
    Scene,
    Side,
    errors,
    kinematics,
    observation,
    progress,
)

#: Most steps of a run: at 0.1 to 0.3 microseconds each, some ten minutes.
MOST_STEPS = 4_000_000_000
#: Samples of a period of a pulse; the straight lines between them are off by 2e-8 of its amplitude.
SAMPLES_A_PERIOD = 16384
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
        effective mass has the scene's restitution (`kernels.damping_ratio`,
        `kernels.effective_mass`). "paper": (33) with the whole mass, constant.

    What the calibration leaves out: slip that stops or turns within an impact (then friction, not
    the spring, decides; on floors with restitution up to 0.2 of it at a friction of 0.3, 0.5 at 1),
    another corner that the impact presses down (a wall hit at more than the slenderness angle,
    0.02). A restitution of zero is reached within `kernels.least_restitution`, 7e-5 for the paper's
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
        from rockcheck.cm import extremes, kernels

        times = scene.run_times
        stiffness, dt = self.stiffness_in(scene), self.time_step_in(scene)
        if times[-1] / dt > MOST_STEPS:
            raise errors.ModelFailure(
                f"cm: {times[-1] / dt:.3g} steps of {dt:.3g} s are needed; at most"
                f" {MOST_STEPS:.3g} are allowed"
            )
        base = tuple(
            (samples, np.cumsum(samples) - 0.5 * (samples + samples[0]), rate)
            for samples, rate in (
                _samples(one, scene.duration) for one in (scene.excitation, scene.vertical)
            )
        )
        state, contacts = kernels.begun(scene, stiffness, dt, self.damping_rule == "calibrated")
        output = np.empty((len(times), 6))
        output[0] = kinematics.of_mass(scene.block, scene.initial_state)
        rows_a_slab = max(1, math.ceil(SLAB / scene.output_step))
        strikes_a_slab = (
            math.ceil(min(rows_a_slab * scene.output_step, times[-1]) / kernels.STRIKE) + 4
        )
        events = np.empty((len(contacts.memory) * strikes_a_slab, 4))
        noted = extremes.noted_at_start(scene)
        end = float(times[-1])
        advance = partial(kernels.advance, contacts, base, state, noted, events, end)
        advance(times[:0], output[:0])  # compiles, or reads the compiled loop from its cache
        ready, ready_cpu = time.perf_counter(), time.process_time()
        strikes: list[Floats] = []
        row, ending = 1, kernels.DONE
        while row < len(times) and ending == kernels.DONE:
            slab = slice(row, row + rows_a_slab)
            play = partial(advance, times[slab], output[slab])
            ending, rows, count = progress.interruptible(play)
            row += rows
            strikes.append(events[:count].copy())
            if state.steps > MOST_STEPS:
                raise errors.ModelFailure(
                    f"cm: more than {MOST_STEPS:.3g} steps by {state.t:.4g} s"
                )
        if ending == kernels.BLOWN_UP:
            raise errors.ModelFailure(
                f"cm: the motion blew up (more energy than work done) before {times[row]:.4g} s,"
                f" with a step of {dt:.3g} s and a stiffness of {stiffness:.3g} 1/s^2"
            )
        strikes.append(events[: kernels.gather(contacts.memory, 0.0, state.t, events, 0)[0]])
        cost = Cost(
            wall_seconds=time.perf_counter() - ready,
            cpu_seconds=time.process_time() - ready_cpu,
            set_up=ready - began,
            steps=int(state.steps),
            evaluations=int(state.sweeps),
        )
        rows_of_strikes = sorted(np.concatenate(strikes).tolist())
        happened = [
            Event(
                t=t,
                kind="floor impact" if contact >= 2 * kernels.FLOOR else "wall impact",
                impulse=impulse,
            )
            for t, contact, impulse, _ in rows_of_strikes
        ]
        if ending == kernels.OVERTURNED:
            side = "left" if state.theta > 0.0 else "right"
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
        walls: dict[int, Side] = {kernels.LEFT_WALL: "left", kernels.RIGHT_WALL: "right"}
        at_walls = [
            (walls[contact // 2], t, impulse, speed)
            for t, contact, impulse, speed in rows_of_strikes
            if contact < 2 * kernels.FLOOR
        ]
        last = np.array([state[name] for name in ("x", "y", "theta", "vx", "vy", "w")])
        found = extremes.extremes_of(
            scene, noted, kinematics.of_box(scene.block, last), history, at_walls
        )
        return replace(history, model_extremes=found)


def _samples(excitation: Excitation, duration: float) -> tuple[Floats, float]:
    """Samples (m/s^2) of the excitation, linear in between, and their number a second.

    A record keeps its samples, and no line leads beyond the last one.
    """
    if isinstance(excitation, Record):
        return excitation.samples, 1.0 / excitation.time_step
    if isinstance(excitation, Rest):
        return np.zeros(1), 1.0
    step = excitation.period / SAMPLES_A_PERIOD
    until = min(excitation.quiet_after, duration)
    if until in excitation.jumps:
        times = np.linspace(0.0, until, round(until / step) + 1)
        return excitation.acceleration(times), (len(times) - 1) / until
    return excitation.acceleration(step * np.arange(math.ceil(until / step) + 2)), 1.0 / step
