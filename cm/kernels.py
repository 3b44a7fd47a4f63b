"""The compiled time loop of the Continuous Model. Imported only by a run: it needs numba."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cm import contact

Floats = NDArray[np.float64]

normal_force = njit(cache=True)(contact.normal_force)
friction_force = njit(cache=True)(contact.friction_force)

FLOOR_LEFT, FLOOR_RIGHT, WALLS = 0, 1, 2
#: Contacts: two corners on the floor; bottom and top corner on the left wall, then on the right wall.
CONTACTS = 6
#: Columns of a contact's memory.
CLOSED, DAMPING, LAST_CLOSED, STRUCK, IMPULSE = range(5)
#: A contact that was open for longer than this (s) strikes when it closes, and its impulse is gathered for as long.
STRIKE = 2e-3
#: How a slab ended.
DONE, OVERTURNED, BLOWN_UP = 0, 1, 2


class Parameters(NamedTuple):
    """Constants of a run: SI units, per unit mass. Walls that are not there stand infinitely far off."""

    half_width: float
    half_height: float
    gravity: float
    stiffness: float
    friction_damping: float
    mu_s: float
    mu_k: float
    floor_restitution: float
    floor_damping_ratio: float
    left_distance: float
    left_damping_ratio: float
    right_distance: float
    right_damping_ratio: float
    by_effective_mass: bool
    time_step: float


@njit(cache=True)
def sampled(samples: Floats, rate: float, t: float) -> float:
    """Linear interpolation in `samples`, `rate` of them a second, the first at t = 0; zero after the last."""
    place = t * rate
    left = int(place)
    if left + 1 >= len(samples):
        return 0.0
    return samples[left] + (place - left) * (samples[left + 1] - samples[left])


@njit(cache=True)
def floor_mass(
    rx: float,
    ry: float,
    normal: float,
    tangential: float,
    other_rx: float,
    other_normal: float,
    together: bool,
    mu: float,
    e: float,
    three_over_r2: float,
) -> float:
    """Effective mass that a bottom corner brings to the floor, at offset (rx, ry) and velocity `normal` < 0, `tangential`.

    From the rigid impact: friction that holds the corner makes it heavier (1/m = K_n - K_c^2/K_t), friction that it slips
    against changes it by mu K_c. With the other corner striking at the same time (`together`) each takes its share.
    """
    k_n = 1.0 + three_over_r2 * rx * rx
    if together:
        return 1.0 / (k_n + (1.0 + three_over_r2 * rx * other_rx) * other_normal / normal)
    k_t = 1.0 + three_over_r2 * ry * ry
    k_c = -three_over_r2 * rx * ry
    held = k_n - k_c * k_c / k_t
    push = (-(1.0 + e) * normal + k_c * tangential / k_t) / held
    shear = -(tangential + k_c * push) / k_t
    if push > 0.0 and abs(shear) <= mu * push:
        return 1.0 / held
    return 1.0 / (k_n + math.copysign(mu, shear) * k_c)


@njit(cache=True)
def flush(memory: Floats, until: float, events: Floats, n_events: int) -> int:
    """Write the strikes that began by `until` into `events` behind the first `n_events`; returns how many there are then."""
    for i in range(CONTACTS):
        if memory[i, STRUCK] <= until:
            events[n_events, :] = memory[i, STRUCK], float(i), memory[i, IMPULSE]
            n_events += 1
            memory[i, STRUCK] = math.inf
    return n_events


@njit(cache=True)
def advance(
    parameters: Parameters,
    first_step: int,
    steps_per_output: int,
    horizontal: Floats,
    horizontal_rate: float,
    vertical: Floats,
    vertical_rate: float,
    state: Floats,
    memory: Floats,
    output: Floats,
    events: Floats,
) -> tuple[int, int, int, int]:
    """Fill the rows of `output` (x, y, theta and their rates) with the motion that follows `state`, which is moved along.

    Drift-kick-drift (position Verlet): half a step of motion, forces and excitation there, half a step of motion.
    `state` goes on with the stretch of the floor's friction spring and whether it slips; `memory` holds one row a contact,
    `events` gets rows (onset time, contact, impulse). Returns how it ended, the rows and events written and the steps taken.
    """
    b, h = parameters.half_width, parameters.half_height
    k, dt = parameters.stiffness, parameters.time_step
    half = 0.5 * dt
    three_over_r2 = 3.0 / (b * b + h * h)
    root_k = math.sqrt(k)
    x, y, theta, vx, vy, w, stretch, slip_flag = state
    slipping = slip_flag != 0.0
    highest = abs(y) + 10.0 * math.sqrt(b * b + h * h)
    left_wall, right_wall = math.isfinite(parameters.left_distance), math.isfinite(parameters.right_distance)
    first_strike = float(np.min(memory[:, STRUCK]))
    n_events = 0
    step = first_step
    for row in range(len(output)):
        for _ in range(steps_per_output):
            x += half * vx
            y += half * vy
            theta += half * w
            t = (step + 0.5) * dt
            step += 1
            s, c = math.sin(theta), math.cos(theta)
            bs, bc, hs, hc = b * s, b * c, h * s, h * c
            ax = -sampled(horizontal, horizontal_rate, t)
            ay = -parameters.gravity - sampled(vertical, vertical_rate, t)
            torque = 0.0
            floor_push = arm = 0.0
            for i in range(2):
                rx = (bc if i == 1 else -bc) + hs
                ry = (bs if i == 1 else -bs) - hc
                one = memory[i]
                depth = -(y + ry)
                if depth <= 0.0:
                    if one[CLOSED] != 0.0:
                        one[CLOSED] = 0.0
                        one[LAST_CLOSED] = t
                    continue
                normal = vy + w * rx
                tangential = vx - w * ry
                if one[CLOSED] == 0.0:
                    one[CLOSED] = 1.0
                    if parameters.by_effective_mass:
                        other_rx = rx - 2.0 * bc if i == 1 else rx + 2.0 * bc
                        other_ry = ry - 2.0 * bs if i == 1 else ry + 2.0 * bs
                        other_normal = vy + w * other_rx
                        together = other_normal < 0.0 and y + other_ry < -other_normal / root_k
                        mass = floor_mass(
                            rx,
                            ry,
                            min(normal, -1e-12),
                            tangential,
                            other_rx,
                            other_normal,
                            together,
                            parameters.mu_s,
                            parameters.floor_restitution,
                            three_over_r2,
                        )
                        one[DAMPING] = 2.0 * parameters.floor_damping_ratio * math.sqrt(k * mass)
                    if t - one[LAST_CLOSED] > STRIKE:
                        one[STRUCK] = t
                        one[IMPULSE] = 0.0
                        first_strike = min(first_strike, t)
                push = normal_force(k, one[DAMPING], depth, -normal)
                floor_push += push
                arm += push * ry
                one[IMPULSE] += dt * push
                ay += push
                torque += rx * push
            for side in range(2):
                if not (left_wall if side == 0 else right_wall):
                    continue
                outward = 1.0 if side == 0 else -1.0
                distance = parameters.left_distance if side == 0 else parameters.right_distance
                for end in range(2):
                    # Offsets of the left side's corners; those of the right side are their opposites.
                    ry = outward * ((-bs + hc) if (end == 1) == (side == 0) else (-bs - hc))
                    rx = outward * ((-bc - hs) if (end == 1) == (side == 0) else (-bc + hs))
                    one = memory[WALLS + 2 * side + end]
                    depth = -(outward * (x + rx) + distance)
                    if depth <= 0.0:
                        if one[CLOSED] != 0.0:
                            one[CLOSED] = 0.0
                            one[LAST_CLOSED] = t
                        continue
                    if one[CLOSED] == 0.0:
                        one[CLOSED] = 1.0
                        if parameters.by_effective_mass:
                            ratio = parameters.left_damping_ratio if side == 0 else parameters.right_damping_ratio
                            one[DAMPING] = 2.0 * ratio * math.sqrt(k / (1.0 + three_over_r2 * ry * ry))
                        if t - one[LAST_CLOSED] > STRIKE:
                            one[STRUCK] = t
                            one[IMPULSE] = 0.0
                            first_strike = min(first_strike, t)
                    push = normal_force(k, one[DAMPING], depth, -outward * (vx - w * ry))
                    one[IMPULSE] += dt * push
                    ax += outward * push
                    torque -= ry * outward * push
            vx += dt * ax
            vy += dt * ay
            w += dt * three_over_r2 * torque
            if floor_push > 0.0:
                # Both corners stand on one floor: they share its cone, and slip together or not at all.
                ry = arm / floor_push
                mobility = dt * (1.0 + three_over_r2 * ry * ry)
                shear, slipping = friction_force(
                    k, parameters.friction_damping, mobility, parameters.mu_s, parameters.mu_k, floor_push, stretch, vx - w * ry, slipping
                )
                vx += dt * shear
                w -= dt * three_over_r2 * ry * shear
                stretch += dt * (vx - w * ry)
                if slipping:
                    longest = parameters.mu_k * floor_push / k
                    stretch = min(max(stretch, -longest), longest)
            else:
                stretch, slipping = 0.0, False
            x += half * vx
            y += half * vy
            theta += half * w
            if t - first_strike >= STRIKE:
                n_events = flush(memory, t - STRIKE, events, n_events)
                first_strike = float(np.min(memory[:, STRUCK]))
            if abs(theta) >= 0.5 * math.pi:
                state[:] = x, y, theta, vx, vy, w, stretch, 1.0 if slipping else 0.0
                return OVERTURNED, row, n_events, step - first_step
        if not (abs(x) < 1e9 and abs(y) < highest and abs(vx) < 1e9 and abs(vy) < 1e9 and abs(w) < 1e9):
            state[:] = x, y, theta, vx, vy, w, stretch, 1.0 if slipping else 0.0
            return BLOWN_UP, row, n_events, step - first_step
        output[row, :] = x, y, theta, vx, vy, w
    state[:] = x, y, theta, vx, vy, w, stretch, 1.0 if slipping else 0.0
    return DONE, len(output), n_events, step - first_step
