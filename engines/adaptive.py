"""Adaptive stepping: an engine's contact solver inside an integrator of second order whose steps end at the events.

With a fixed step, the error of an engine is the time of its impacts and a drift along the arcs of its contacts, both of
first order in the step. Here the engine only turns velocities into velocities, at the pose of mid-step (drift, kick, drift);
step ends are placed where gaps close, where slip stops and where a block at rest may start to move; an impact has a step of
its own, so short that nothing else happens in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from engines.base_motion import BaseVelocity, starts_of_motion
from engines.contacts import Contact, contacts_of
from scenes import ModelFailure, Scene

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]  # along x, y and theta

# Lengths in units of the block's radius R, times in units of 1/p.
CLOSED = 5e-8  # a corner nearer than this touches
EMBEDDED = 5e-9  # how deep the engine sees a corner that touches
IMPACT_STEP = 2e-6
PROBE_STEP = 6e-5  # the longest step where the acceleration is not known, that is, after an event
SHORTEST_STEP = 2e-7
LONG_APPROACH = 6e-4  # from farther away a prediction is only trusted to 95 %
RESTING = 0.005  # of g times the longest step: slower approaches and departures are not told from rest
SETTLING_GAP = 2e-6
SETTLING_TIME = 0.15  # of the longest step: a corner that is back on the floor within twice that time is taken to stay


class Push(Protocol):
    """An engine as a map of velocities."""

    def __call__(self, pose: Vector, velocity: Vector, dt: float, felt: tuple[float, float], bouncing: bool) -> Vector:
        """Velocity of the block after `dt` s with the felt acceleration in m/s^2 and the contacts closed at `pose`.

        Contacts take their restitution only where `bouncing`; otherwise they stop what approaches.
        """


def march_adaptively(scene: Scene, push: Push, longest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (n) and states (n, 6) at step ends, and the accelerations (n-1, 2) felt in the steps, until |theta| = pi/2.

    The scene is one of a block with R = 1, see `engines.engine.in_units_of`. No step is longer than `longest` s.
    Raises `ModelFailure` if the motion blows up or needs very many steps.
    """
    floor, walls = contacts_of(scene)[:2], contacts_of(scene)[2:]
    across, up = BaseVelocity(scene.excitation), BaseVelocity(scene.vertical)
    starts, end = [*starts_of_motion(scene), math.inf], float(scene.output_times[-1])
    resting, gravity, upright = RESTING * longest * scene.gravity, scene.gravity, scene.block.half_height
    moment = 1.0 / scene.frequency_parameter
    impact_step, probe_step = min(IMPACT_STEP * moment, longest), PROBE_STEP * moment
    shortest, long_approach = SHORTEST_STEP * moment, LONG_APPROACH * moment
    most_steps = 100_000 + 20 * int(end / longest)

    t, before, next_start = 0.0, (across(0.0), up(0.0)), 0
    x, y, theta, vx, vy, w = scene.initial_state
    acceleration: Vector | None = None
    times, states, felt = [t], [(x, y, theta, vx, vy, w)], []
    while t < end - 1e-12 and abs(theta) < math.pi / 2:
        # How long the step may be, and which corners touch.
        dt = min(longest, end - t)
        if acceleration is None:
            dt = min(dt, probe_step)
        while starts[next_start] <= t + 1e-9:
            next_start += 1
        dt = min(dt, starts[next_start] - t)
        impact = stops = False
        touching: tuple[list[Contact], list[Contact]] = ([], [])
        cos, sin = math.cos(theta), math.sin(theta)
        for contacts, closed in zip((floor, walls), touching, strict=True):
            for contact in contacts:
                arm = contact.arm(cos, sin)
                gap, rate = contact.gap(x, y, arm), contact.rate(vx, vy, w, arm)
                if gap > CLOSED or rate > resting:
                    curvature = 0.0 if acceleration is None else contact.acceleration(*acceleration, w, arm)
                    closing = _time_to_close(gap, rate, curvature)
                    if closing < dt:
                        dt, stops = max(0.95 * closing if closing > long_approach else closing, shortest), False
                    continue
                closed.append(contact)
                if rate < -resting:
                    impact = True
                elif contacts is floor and acceleration is not None:
                    slip = vx - w * arm[1]
                    slowing = acceleration[0] - acceleration[2] * arm[1] - w * w * arm[0]
                    if slip * slowing < 0.0 and 0.2 * resting < abs(slip) < abs(slowing) * dt:
                        dt, stops = abs(slip / slowing), True
        if impact:
            dt = impact_step

        # Drift, kick, drift. The engine sees the block at mid-step, with the corners that touch just below the surface. What
        # rests on a surface at the end of the step moves along its arc in mid-step; `carry` is that velocity: in a frame that
        # moves with it the engine's contacts, which know of no arcs, are right.
        after = across(t + dt), up(t + dt)
        feels = (before[0] - after[0]) / dt, -gravity - (after[1] - before[1]) / dt
        later = w if impact or acceleration is None else w + dt * acceleration[2]
        middle, final = theta + 0.5 * dt * w, theta + 0.5 * dt * (w + later)
        px, py, carry_x, carry_y = x + 0.5 * dt * vx, y + 0.5 * dt * vy, 0.0, 0.0
        cos, sin = math.cos(middle), math.sin(middle)
        for closed in touching:
            if closed:
                arms = [contact.arm(cos, sin) for contact in closed]
                depth = EMBEDDED + max(contact.gap(px, py, arm) for contact, arm in zip(closed, arms, strict=True))
                nx, nz = closed[0].normal
                px, py = px - nx * depth, py - nz * depth
                ends = closed[0].arm(math.cos(final), math.sin(final))
                carry_x = -later * (ends[1] - arms[0][1])
                if nz:
                    carry_y = later * (ends[0] - arms[0][0])
        kicked = push((px, py, middle), (vx + carry_x, vy + carry_y, w), dt, feels, impact)
        new_vx, new_vy, new_w = kicked[0] - carry_x, kicked[1] - carry_y, kicked[2]
        found = (new_vx - vx) / dt, (new_vy - vy) / dt, (new_w - w) / dt
        x, y, theta = x + 0.5 * dt * (vx + new_vx), y + 0.5 * dt * (vy + new_vy), theta + 0.5 * dt * (w + new_w)
        vx, vy, w = new_vx, new_vy, new_w

        # A corner that stays on its surface is put back onto it, and a block that rocks no more is put down.
        cos, sin = math.cos(theta), math.sin(theta)
        for closed in touching:
            if len(closed) == 1:
                arm = closed[0].arm(cos, sin)
                if abs(closed[0].rate(vx, vy, w, arm)) < resting:
                    gap = closed[0].gap(x, y, arm)
                    x, y = x - closed[0].normal[0] * gap, y - closed[0].normal[1] * gap
        if acceleration is None and touching[0] and _settles(floor, (x, y, theta), (vx, vy, w), found, longest):
            y, theta, vy, w = upright, 0.0, 0.0, 0.0
        acceleration = None if impact or stops else found
        t, before = t + dt, after
        times.append(t)
        states.append((x, y, theta, vx, vy, w))
        felt.append(feels)
        if not abs(w) < 1e6 or len(times) > most_steps:
            raise ModelFailure(f"no end to the events, or a motion that blew up, after {len(times)} steps at t = {t:g} s")
    return np.array(times), np.array(states), np.array(felt).reshape(-1, 2)


def _time_to_close(gap: float, rate: float, curvature: float) -> float:
    """When a gap with this rate and acceleration is zero, s; infinity if never. A gap that opens closes on its way back."""
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0:
        return math.inf
    if rate < 0.0:
        return 2.0 * gap / (math.sqrt(discriminant) - rate)
    return (rate + math.sqrt(discriminant)) / -curvature if curvature < 0.0 else math.inf


def _settles(floor: Sequence[Contact], pose: Vector, velocity: Vector, acceleration: Vector, longest: float) -> bool:
    """Whether both lower corners are on the floor, or so near and slow that they are back on it at once."""
    x, y, theta = pose
    cos, sin = math.cos(theta), math.sin(theta)
    for contact in floor:
        arm = contact.arm(cos, sin)
        rate = contact.rate(*velocity, arm)
        pulled = contact.acceleration(*acceleration, velocity[2], arm)
        if contact.gap(x, y, arm) > SETTLING_GAP or abs(rate) > max(SETTLING_GAP, -SETTLING_TIME * longest * pulled):
            return False
    return True
