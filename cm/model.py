"""The Continuous Model as a model of a scene: settings, set-up, run."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from cm import contact
from scenes import Event, History, InputError, ModelFailure, Scene
from scenes.base import Frozen, Positive
from scenes.excitations import Record, Rest, Ricker, Sine
from scenes.history import Cost
from scenes.observation import observe

if TYPE_CHECKING:
    from cm import kernels

#: Longest run, in steps: about an hour.
MOST_STEPS = 100_000_000_000
#: Samples of a period of a pulse; between them it is linear, which is off by 3e-7 of its amplitude.
SAMPLES_A_PERIOD = 4096
#: Longest stretch of motion (s) in one call of the compiled loop; bounds the memory for events.
SLAB = 5.0


class ContinuousModel(Frozen):
    """The paper's Continuous Model (Chatzis & Smyth 2012): the corners press on springs and dampers that can only push.

    `stiffness` k/m (1/s^2) of each contact and `time_step` (s) follow from `penetration` (m), the depth to which the block
    sinks when it stands on one corner: k/m = g/penetration and time_step = 0.02/sqrt(k/m). Either can be set instead.
    `damping_rule` "calibrated" chooses the damping of a contact when it closes so that the clamped contact has the scene's
    restitution with the mass that its corner brings; "paper" keeps (33) with the whole mass.

    `simulate` raises `ModelFailure` if the motion blows up or needs too many steps.
    """

    penetration: Positive = 1e-6
    stiffness: Positive | None = None
    time_step: Positive | None = None
    damping_rule: Literal["calibrated", "paper"] = "calibrated"

    @property
    def name(self) -> str:
        """The name by which reports and the command line call this model."""
        return "cm"

    @model_validator(mode="after")
    def _one_stiffness(self) -> ContinuousModel:
        if self.stiffness is not None and "penetration" in self.model_fields_set:
            raise InputError("cannot be given together with penetration", "stiffness")
        return self

    def stiffness_in(self, scene: Scene) -> float:
        """Contact stiffness per unit mass in that scene, 1/s^2."""
        return scene.gravity / self.penetration if self.stiffness is None else self.stiffness

    def time_step_in(self, scene: Scene) -> float:
        """Step in s in that scene, a whole fraction of its output step."""
        longest = 0.02 / math.sqrt(self.stiffness_in(scene)) if self.time_step is None else self.time_step
        return scene.output_step / math.ceil(scene.output_step / longest * (1.0 - 1e-12))

    def simulate(self, scene: Scene) -> History:
        """The motion of the scene's block. Events: floor impacts, wall impacts, overturning."""
        began = time.perf_counter()
        from cm import kernels

        dt = self.time_step_in(scene)
        times = scene.output_times
        a_row = round(scene.output_step / dt)
        if a_row * len(times) > MOST_STEPS:
            raise ModelFailure(f"cm: {a_row * len(times):.3g} steps of {dt:.3g} s are needed; at most {MOST_STEPS:.3g} are allowed")
        parameters = self._parameters(scene, dt)
        horizontal, horizontal_rate = _samples(scene.excitation, scene.duration)
        vertical, vertical_rate = _samples(scene.vertical, scene.duration)
        state, memory = self._initial(scene, parameters)
        output = np.empty((len(times), 6))
        output[0] = scene.initial_state
        rows_a_slab = max(1, math.ceil(SLAB / scene.output_step))
        events = np.empty((kernels.CONTACTS * (math.ceil(rows_a_slab * scene.output_step / kernels.STRIKE) + 2), 3))

        def advance(row: int, rows: int) -> tuple[int, int, int, int]:
            return kernels.advance(
                parameters, (row - 1) * a_row, a_row, horizontal, horizontal_rate, vertical, vertical_rate, state, memory,
                output[row : row + rows], events,
            )  # fmt: skip

        advance(1, 0)  # compiles, or reads the compiled loop from its cache
        ready, ready_cpu = time.perf_counter(), time.process_time()
        strikes: list[NDArray[np.float64]] = []
        row, steps, ending = 1, 0, kernels.DONE
        while row < len(times) and ending == kernels.DONE:
            ending, rows, found, taken = advance(row, min(rows_a_slab, len(times) - row))
            row, steps = row + rows, steps + taken
            strikes.append(events[:found].copy())
        found = kernels.flush(memory, math.inf, events, 0)
        strikes.append(events[:found][np.isfinite(events[:found, 0])])
        cost = Cost(
            wall_seconds=time.perf_counter() - ready,
            cpu_seconds=time.process_time() - ready_cpu,
            set_up=ready - began,
            steps=steps,
            evaluations=steps,
        )
        if ending == kernels.BLOWN_UP:
            raise ModelFailure(f"cm: the motion blew up before {times[row]:.4g} s; a step of {dt:.3g} s is too long for its stiffness")
        happened = [
            Event(t=float(t), kind="floor impact" if i < kernels.WALLS else "wall impact", impulse=float(impulse))
            for t, i, impulse in np.concatenate(strikes)
        ]
        happened.sort(key=lambda event: event.t)
        if ending == kernels.OVERTURNED:
            happened.append(Event(t=steps * dt, kind="overturned left" if state[2] > 0.0 else "overturned right"))
        return observe(
            scene,
            self.name,
            output[:row],
            events=happened,
            cost=cost,
            settings={"stiffness": self.stiffness_in(scene), "time_step": dt, "damping_rule": self.damping_rule},
        )

    def _parameters(self, scene: Scene, time_step: float) -> kernels.Parameters:
        from cm import kernels

        ratio = contact.damping_ratio if self.damping_rule == "calibrated" else contact.damping_ratio_of_paper
        k = self.stiffness_in(scene)
        left, right = scene.wall("left"), scene.wall("right")
        return kernels.Parameters(
            half_width=scene.block.half_width,
            half_height=scene.block.half_height,
            gravity=scene.gravity,
            stiffness=k,
            friction_damping=1000.0 * math.sqrt(k),
            mu_s=scene.floor.mu_s,
            mu_k=scene.floor.friction,
            floor_restitution=scene.floor.restitution,
            floor_damping_ratio=ratio(scene.floor.restitution),
            left_distance=math.inf if left is None else scene.block.half_width + left.gap,
            left_damping_ratio=0.0 if left is None else ratio(left.restitution),
            right_distance=math.inf if right is None else scene.block.half_width + right.gap,
            right_damping_ratio=0.0 if right is None else ratio(right.restitution),
            by_effective_mass=self.damping_rule == "calibrated",
            time_step=time_step,
        )

    def _initial(self, scene: Scene, parameters: kernels.Parameters) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """State and contact memory at t = 0. A block on the floor starts sunk in by its weight, so that it does not bounce."""
        from cm import kernels

        state = np.array((*scene.initial_state, 0.0, 0.0))
        memory = np.zeros((kernels.CONTACTS, 5))
        memory[:, kernels.STRUCK] = math.inf
        memory[:, kernels.LAST_CLOSED] = -math.inf
        k = parameters.stiffness
        for i, wall_ratio in enumerate((parameters.left_damping_ratio,) * 2 + (parameters.right_damping_ratio,) * 2, kernels.WALLS):
            memory[i, kernels.DAMPING] = 2.0 * wall_ratio * math.sqrt(k)
        memory[: kernels.WALLS, kernels.DAMPING] = 2.0 * parameters.floor_damping_ratio * math.sqrt(k)
        if scene.initial_height == 0.0:
            tilt = scene.initial_rotation
            standing = [kernels.FLOOR_LEFT] * (tilt >= 0.0) + [kernels.FLOOR_RIGHT] * (tilt <= 0.0)
            memory[standing, kernels.CLOSED] = 1.0
            state[1] -= scene.gravity / (k * len(standing))
        return state, memory


def _samples(excitation: Rest | Ricker | Sine | Record, duration: float) -> tuple[NDArray[np.float64], float]:
    """The excitation as samples (m/s^2) with straight lines between them, and their number a second; a record's own."""
    if isinstance(excitation, Record):
        return excitation.samples, 1.0 / excitation.time_step
    if isinstance(excitation, Rest):
        return np.zeros(1), 1.0
    step = excitation.period / SAMPLES_A_PERIOD
    until = min(excitation.quiet_after, duration)
    return excitation.acceleration(step * np.arange(math.ceil(until / step) + 2)), 1.0 / step
