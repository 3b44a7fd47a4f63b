"""Adaptive stepping: an engine's contact solver inside an integrator of third order whose steps end at the events.

With a fixed step, the error of an engine is the time of its impacts and a drift along the arcs of its contacts, both of
first order in the step. Here the engine only turns velocities into velocities, at the mean pose of a step (drift, kick, drift);
step ends are placed where gaps close, where slip stops and where a block at rest may start to move; an impact has a step of
its own, so short that nothing else happens in it. Between events, where the acceleration changes smoothly from step to step,
that change corrects the drift, which is then of third order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines.base_motion import BaseMotion
from rockcheck.engines.contacts import Contact, contacts_of
from rockcheck.scenes import ModelFailure, Scene, kinematics
from rockcheck.scenes.progress import tell

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]  # along x, y and theta
Touching = tuple[list[Contact], list[Contact]]  # the closed contacts with the floor and with walls

# Lengths in units of the block's radius R, times in units of 1/p.
CLOSED = 5e-9  # a corner nearer than this touches
EMBEDDED = 5e-10  # how deep the engine sees a corner that touches
PROBE_STEP = 6e-5  # the longest step where the acceleration is not known, that is, after an event
SHORTEST_STEP = 2e-8  # that of an impact: the time and the place of each are wrong by so much
LONG_APPROACH = 6e-4  # from farther away the prediction of an event is only trusted to 95 %
RESTING = 0.001  # of g times the longest step: slower approaches and departures are not told from rest
SETTLING_GAP = 2e-6
SETTLING_TIME = 0.2  # of the longest step, after an event of the probe: a corner that is back within twice that time stays


class Push(Protocol):
    """An engine as a map of velocities."""

    def __call__(self, pose: Vector, velocity: Vector, dt: float, felt: tuple[float, float], bouncing: bool) -> Vector:
        """Velocity of the block after `dt` s with the felt acceleration in m/s^2 and the contacts closed at `pose`.

        Contacts take their restitution only where `bouncing`; otherwise they stop what approaches.
        """


@dataclass(frozen=True, slots=True)
class _Limits:
    """The steps and speeds that count as short, long and slow in a scene, s and 1/s (lengths in R)."""

    longest: float
    probe: float
    shortest: float
    long_approach: float
    resting: float
    staying: float

    @classmethod
    def of(cls, scene: Scene, longest: float, short: float) -> _Limits:
        """Those of a scene whose steps are at most `longest` s, and at events `short` times the usual."""
        moment = short / scene.frequency_parameter
        probe = min(PROBE_STEP * moment, longest)
        return cls(
            longest=longest,
            probe=probe,
            shortest=min(SHORTEST_STEP * moment, longest),
            long_approach=LONG_APPROACH * moment,
            resting=RESTING * longest * scene.gravity,
            staying=SETTLING_TIME * probe * scene.gravity,
        )

    def trusted(self, predicted: float) -> float:
        """How much of the predicted time to an event one step may take, s."""
        return 0.95 * predicted if predicted > self.long_approach else predicted


class _Plan(NamedTuple):
    """A step: its length in s, the closed contacts, and whether it is an impact or ends where slip stops."""

    dt: float
    touching: Touching
    impact: bool
    stops: bool


class _Past(NamedTuple):
    """The step before, where nothing came to an end with it: its mean acceleration, length and closed contacts."""

    acceleration: Vector
    dt: float
    touching: Touching


def march_adaptively(
    scene: Scene, base: BaseMotion, push: Push, longest: float, short: float = 1.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (n) and states (n, 6) at step ends, and the accelerations (n-1, 2) felt in the steps, until |theta| = pi/2.

    The scene is one of a block with R = 1, see `engines.marching.in_units_of`; `base` is its base motion. No step is longer than
    `longest` s; those at impacts and after events are `short` times the usual.
    Raises `ModelFailure` if the motion blows up or needs very many steps.
    """
    contacts, limits = contacts_of(scene), _Limits.of(scene, longest, short)
    sides = contacts[:2], contacts[2:]
    starts, end, gravity = [*base.starts, math.inf], float(scene.output_times[-1]), scene.gravity
    most_steps = 100_000 + 20 * int(end / longest)

    t, before, next_start = 0.0, base.velocity(0.0), 0
    x, y, theta, *rates = map(float, kinematics.of_mass(scene.block, scene.initial_state))
    pose, velocity = (x, y, theta), (rates[0], rates[1], rates[2])
    standing = scene.block.weaker_pivot.height
    past: _Past | None = None
    times, states, felt = [t], [(*pose, *velocity)], []
    while t < end - 1e-12 and abs(pose[2]) < math.pi / 2:
        while starts[next_start] <= t + 1e-9:
            next_start += 1
        plan = _plan(pose, velocity, past and past.acceleration, sides, limits, min(end - t, starts[next_start] - t))
        dt = plan.dt
        t += dt
        after = base.velocity(t)
        feels = (before[0] - after[0]) / dt, (before[1] - after[1]) / dt - gravity
        pose, velocity, acceleration = _drift_kick_drift(pose, velocity, past, plan, feels, push)
        pose = _put_back(pose, velocity, plan, limits)
        if past is None and plan.touching[0] and _settles(sides[0], pose, velocity, acceleration, limits):
            pose, velocity = (pose[0], standing, 0.0), (velocity[0], 0.0, 0.0)
        past = None if plan.impact or plan.stops else _Past(acceleration, dt, plan.touching)
        before = after
        times.append(t)
        states.append((*pose, *velocity))
        felt.append(feels)
        if len(times) % 512 == 0:
            tell(t, end)
        if not math.hypot(*velocity) < 1e6 or len(times) > most_steps:  # nan, too
            raise ModelFailure(f"no end to the events, or a motion that blew up, after {len(times)} steps at t = {t:g} s")
    return np.array(times), np.array(states), np.array(felt).reshape(-1, 2)


def _plan(
    pose: Vector,
    velocity: Vector,
    acceleration: Vector | None,
    sides: tuple[Sequence[Contact], Sequence[Contact]],
    limits: _Limits,
    dt: float,
) -> _Plan:
    """The next step, at most `dt` s long: it ends before a gap closes or a slip stops that the present acceleration brings."""
    (x, y, theta), (vx, vy, w), resting = pose, velocity, limits.resting
    dt = min(dt, limits.longest if acceleration is not None else limits.probe)
    leaving = resting if acceleration is not None else max(resting, limits.staying)
    impact = stops = False
    touching: Touching = ([], [])
    cos, sin = math.cos(theta), math.sin(theta)
    for side, closed in enumerate(touching):
        for contact in sides[side]:
            arm = contact.arm(cos, sin)
            gap, rate = contact.gap(x, y, arm), contact.rate(vx, vy, w, arm)
            if gap > CLOSED or rate > leaving:
                curvature = 0.0 if acceleration is None else contact.acceleration(*acceleration, w, arm)
                closing = _time_to_close(gap, rate, curvature)
                if closing < dt:
                    dt, stops = max(limits.trusted(closing), limits.shortest), False
                continue
            closed.append(contact)
            if rate < -resting:
                impact = True
            elif contact.surface == "floor" and acceleration is not None:
                slip = vx - w * arm[1]
                slowing = acceleration[0] - acceleration[2] * arm[1] - w * w * arm[0]
                if slip * slowing < 0.0 and 0.2 * resting < abs(slip) < abs(slowing) * dt:
                    stopping = abs(slip / slowing)
                    dt = limits.trusted(stopping)
                    stops = dt == stopping
    return _Plan(limits.shortest if impact else dt, touching, impact, stops)


def _drift_kick_drift(
    pose: Vector, velocity: Vector, past: _Past | None, plan: _Plan, felt: tuple[float, float], push: Push
) -> tuple[Vector, Vector, Vector]:
    """Pose and velocity at the step's end, and the mean acceleration.

    The engine sees the block in its mean pose, with the corners that touch just below the surface. What rests on a surface at the
    step's end still moves along its arc in the mean pose; `carry` is that velocity. The engine's contacts know nothing of arcs, but
    in a frame that moves with it they are right.

    Where the same contacts were closed in the step before, the acceleration is taken to be linear over both steps, for the mean
    pose (there the last one will do) and for the drift: dt/2 (v + v_new) - dt^2/12 (change of the acceleration over the step).
    """
    (x, y, theta), (vx, vy, w), dt = pose, velocity, plan.dt
    bend, (ax, ay, spin) = 0.0, (0.0, 0.0, 0.0)
    if past is not None and past.touching == plan.touching:
        bend, (ax, ay, spin) = dt**3 / (6.0 * (dt + past.dt)), past.acceleration
    half, sixth, later = 0.5 * dt, dt * dt / 6.0, w + dt * spin
    px, py, mean = x + half * vx + sixth * ax, y + half * vy + sixth * ay, theta + half * w + sixth * spin
    carry_x = carry_y = 0.0
    cos, sin = math.cos(mean), math.sin(mean)
    for closed in plan.touching:
        if closed:
            highest = -math.inf
            for contact in closed:
                arm = contact.arm(cos, sin)
                highest = max(highest, contact.gap(px, py, arm))
            nx, nz = contact.normal
            px, py = px - nx * (highest + EMBEDDED), py - nz * (highest + EMBEDDED)
            final = theta + half * (w + later)
            ends = contact.arm(math.cos(final), math.sin(final))
            carry_x = -later * (ends[1] - arm[1])
            if nz:
                carry_y = later * (ends[0] - arm[0])
    kicked = push((px, py, mean), (vx + carry_x, vy + carry_y, w), dt, felt, plan.impact)
    new_vx, new_vy, new_w = kicked[0] - carry_x, kicked[1] - carry_y, kicked[2]
    new_ax, new_ay, new_spin = (new_vx - vx) / dt, (new_vy - vy) / dt, (new_w - w) / dt
    return (
        (
            x + half * (vx + new_vx) - bend * (new_ax - ax),
            y + half * (vy + new_vy) - bend * (new_ay - ay),
            theta + half * (w + new_w) - bend * (new_spin - spin),
        ),
        (new_vx, new_vy, new_w),
        (new_ax, new_ay, new_spin),
    )


def _put_back(pose: Vector, velocity: Vector, plan: _Plan, limits: _Limits) -> Vector:
    """The pose with the one corner that stays on a surface put back onto it."""
    x, y, theta = pose
    cos, sin = math.cos(theta), math.sin(theta)
    for closed in plan.touching:
        if len(closed) == 1:
            arm, (nx, nz) = closed[0].arm(cos, sin), closed[0].normal
            if abs(closed[0].rate(*velocity, arm)) < limits.resting:
                gap = closed[0].gap(x, y, arm)
                x, y = x - nx * gap, y - nz * gap
    return x, y, theta


def _time_to_close(gap: float, rate: float, curvature: float) -> float:
    """When a gap with this rate and acceleration is zero, s; infinity if never. A gap that opens closes on its way back."""
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0:
        return math.inf
    if rate < 0.0:
        return 2.0 * gap / (math.sqrt(discriminant) - rate)
    return (rate + math.sqrt(discriminant)) / -curvature if curvature < 0.0 else math.inf


def _settles(floor: Sequence[Contact], pose: Vector, velocity: Vector, acceleration: Vector, limits: _Limits) -> bool:
    """Whether both lower corners are on the floor, or so near and slow that they are back on it at once."""
    x, y, theta = pose
    cos, sin = math.cos(theta), math.sin(theta)
    for contact in floor:
        arm = contact.arm(cos, sin)
        rate = contact.rate(*velocity, arm)
        pulled = contact.acceleration(*acceleration, velocity[2], arm)
        if contact.gap(x, y, arm) > SETTLING_GAP or abs(rate) > max(SETTLING_GAP, -SETTLING_TIME * limits.longest * pulled):
            return False
    return True
