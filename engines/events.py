"""Events of a motion computed with contacts instead of modes, read off the states at step ends."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines import contacts, steps
from rockcheck.scenes import Event, Floats, Scene, kinematics, observation

Flags = NDArray[np.bool_]
#: Time (s), kind, the step end where it is told, impulse per unit mass (m/s).
Found = tuple[float, str, int, float]
# s: shorter openings of a contact are the engine's chatter, and an impulse is summed over this time
HOLD = 2e-3
REST = 20e-3  # s: a shorter rest is the dead centre of a last tiny rocking
# block radii; wider at fixed steps, where a resting block falls freely for a step now and then
CLOSED = 1e-6
# of the thresholds: what a gap and a slip of a contact that holds may show
GAP_NOISE, SLIP_NOISE = 1e-5, 1e-3
SLIPPING = 1e-3  # m/s
TURNING = 1e-3  # rad/s


def events_of(scene: Scene, t: Floats, states: Floats, felt: Floats) -> list[Event]:
    """Events in order of time.

    `t` (n) and `states` (n, 6) are those of the mass's centre at step ends, `felt` (n-1 or more, 2)
    the accelerations.

    "floor impact" and "wall impact": the onset of a contact that had been open for more than 2 ms,
    with its normal impulse in the first 2 ms; "uplift": one lower corner opens after both were
    closed for more than 20 ms; "lift-off", "landing": of both; "release": a wall contact opens
    after more than 2 ms; "slip" and "stick" of the pivot; "settled"; "overturned ...".
    """
    motion = _Motion(scene, t, states, felt)
    found = [event for i in range(len(motion.contacts)) for event in motion.at_contact(i)]
    found += motion.at_floor()
    end = scene.run_times[-1] * (1.0 + 1e-12)  # a step of fixed length may go beyond
    fall = steps.time_of_fall(t, states)
    if fall <= end:
        found = [
            *(event for event in found if event[0] < fall),
            (fall, f"overturned {'left' if states[-1, 2] > 0 else 'right'}", len(t) - 1, 0.0),
        ]
    found = sorted((event for event in found if event[0] <= end), key=lambda event: event[0])
    before = motion.modes([max(event[2] - 1, 0) for event in found])
    after = motion.modes([motion.later(event[2]) for event in found])
    return [
        Event(
            t=float(time),
            kind=kind,
            mode_before=b,
            mode_after="overturned" if kind.startswith("overturned") else a,
            impulse=impulse,
        )
        for (time, kind, _, impulse), b, a in zip(found, before, after, strict=True)
    ]


class _Motion:
    """The states at all step ends, and what can be told from them."""

    def __init__(self, scene: Scene, t: Floats, states: Floats, felt: Floats) -> None:
        self.scene, self.t, self.states, self.felt = scene, t, states, felt
        self.contacts = contacts.contacts_of(scene)
        self.near = (
            CLOSED * scene.block.radius
            + 2.0 * scene.gravity * float(np.min(np.diff(t), initial=t[-1])) ** 2
        )
        x, y, theta, x_dot, y_dot, theta_dot = states.T
        #: Of each contact: its corner, normal and distance.
        self.places = np.array([(*one.corner, *one.normal, one.distance) for one in self.contacts])
        bx, bz, nx, nz, distance = self.places.T[:, :, None]
        arm = contacts.arm_of(bx, bz, np.cos(theta), np.sin(theta))
        #: Of each contact at step ends: its gap, m; whether it touches, or has struck in the step
        #: before; whether it is closed, openings of less than 2 ms left out.
        self.gap: Floats = contacts.gap_of(nx, nz, distance, x, y, arm)
        rate = contacts.rate_of(nx, nz, x_dot, y_dot, theta_dot, arm)
        # An engine that looks ahead stops a block, or turns it round, up to two steps before it
        # arrives.
        arrives = self.gap[:, :-1] + 2.0 * np.diff(t) * rate[:, :-1] < self.near
        struck = (rate[:, :-1] < -HOLD * scene.gravity) & (rate[:, 1:] > 0.5 * rate[:, :-1])
        self.touching: Flags = (self.gap < self.near) | np.pad(arrives & struck, ((0, 0), (1, 0)))
        self.touching[:, 0] &= rate[:, 0] >= -HOLD * scene.gravity  # else it strikes at the start
        self.closed = [_held(touching, t) for touching in self.touching]
        #: The states of the box's centre.
        self.box = kinematics.of_box(scene.block, states)
        self.slip_rate = kinematics.slip_rate(scene.block, theta, self.box[:, 3], theta_dot)

    def onset(self, contact: int, index: int) -> float:
        """When the gap that is closed at `index` and was open before passed zero, s."""
        before, after = self.gap[contact, index - 1 : index + 1]
        part = (
            min(max(before / (before - after), 0.0), 1.0) if before > after else float(before > 0.0)
        )
        return float(self.t[index - 1] + part * (self.t[index] - self.t[index - 1]))

    def at_contact(self, contact: int) -> list[Found]:
        """Impacts of a contact; of one with a wall, releases too."""
        floor = self.contacts[contact].surface == "floor"
        kind = "floor impact" if floor else "wall impact"
        t, closed = self.t, self.closed[contact]
        strikes = _rises(closed)
        impacts = [(self.onset(contact, i), kind, i, self.impulse(contact, i)) for i in strikes]
        if floor:
            return impacts
        return impacts + [
            (t[_start(self.gap[contact], end, GAP_NOISE * self.near)], "release", end, 0.0)
            for end in _rises(~closed)
            if t[end] - t[max((i for i in strikes if i < end), default=0)] > HOLD
        ]

    def at_floor(self) -> list[Found]:
        """Uplift, flight, slip and rest, from which lower corners are closed."""
        t, (left, right) = self.t, self.closed[:2]
        flat, flight = left & right, ~(left | right)
        noise = GAP_NOISE * self.near
        lowest, highest = np.sort(self.gap[:2], axis=0)
        speed = np.where(flight, math.inf, np.abs(self.slip_rate))  # no slip begins in flight
        slipping = _held(_held(~flight & (speed > SLIPPING), t), t, value=True)
        slow = SLIP_NOISE * SLIPPING
        for i in [i for i in _rises(~slipping) if not flight[i]]:  # it slows down as in this step
            lasts = (speed[i] - slow) / (speed[i - 1] - speed[i]) * (t[i] - t[i - 1])
            slipping[i : np.searchsorted(t, t[i] + min(lasts, HOLD))] = True
        still = flat & ~slipping & (np.abs(self.states[:, 5]) < TURNING)
        # Where each kind began, and where it is told.
        places = {
            "uplift": [
                (_start(highest, i, noise), i)
                for i in _rises(~_held(flat, t, REST, value=True))
                if not flight[i]
            ],
            "lift-off": [(_start(lowest, i, noise), i) for i in _rises(flight)],
            "landing": [(i, i) for i in _rises(~flight)],
            "slip": [(_start(speed, i, slow), i) for i in _rises(slipping)],
            "stick": [(i, i) for i in _rises(~slipping) if not flight[i]],
            "settled": [(i, i) for i in _rises(_held(_held(still, t), t, REST, value=True))],
        }
        return [(t[start], kind, i, 0.0) for kind, found in places.items() for start, i in found]

    def later(self, index: int) -> int:
        """The first step end 2 ms after `index`, or the last one."""
        return min(int(np.searchsorted(self.t, self.t[index] + HOLD)), len(self.t) - 1)

    def impulse(self, contact: int, index: int) -> float:
        """Normal impulse per unit mass of a contact in the 2 ms after its onset, m/s.

        It follows from the balance of momentum: the change of velocity that free fall does not
        explain. Engines report forces differently, some at a high cost.
        """
        from scipy.optimize import nnls

        first, last = index - 1, self.later(index)
        gained = self.states[last, 3:] - self.states[first, 3:]
        gained[:2] -= np.diff(self.t[first : last + 1]) @ self.felt[first:last]
        acts: Flags = np.logical_or.reduce(self.touching[:, first : last + 1], axis=1)
        acts[contact] = True
        bx, bz, nx, nz, _ = self.places[acts].T
        theta = self.states[index, 2]
        arm = contacts.arm_of(bx, bz, math.cos(theta), math.sin(theta))
        along_x, along_y, turning = np.eye(3)[:, :, None]  # an impulse acts on what a contact sees
        normal = contacts.rate_of(nx, nz, along_x, along_y, turning, arm)
        friction = self.scene.floor.friction * nz * (along_x - arm[1] * turning)  # walls are smooth
        edges = np.stack([normal + friction, normal - friction], axis=-1)  # of the contacts' cones
        scale = np.array([[1.0], [1.0], [1.0 / self.scene.block.radius]])
        impulses, _ = nnls(
            edges.reshape(3, -1) * scale,
            gained * np.array([1.0, 1.0, self.scene.block.gyration_squared]) * scale[:, 0],
        )
        return float(impulses.reshape(-1, 2)[np.sum(acts[:contact])].sum())

    def modes(self, indices: Sequence[int]) -> list[str]:
        chosen, lies = self.box[list(indices)], (self.closed[0] | self.closed[1])[list(indices)]
        channels = {name: chosen[:, column] for column, name in enumerate(observation.STATE)}
        return [
            str(mode) if on else "flight"  # also below the 0.01 mm from which the kinematics tell
            for on, mode in zip(
                lies,
                observation.modes_of(
                    self.scene, channels | {"slip_rate": self.slip_rate[list(indices)]}
                ),
                strict=True,
            )
        ]


def _rises(flags: Flags) -> list[int]:
    return [int(i) for i in np.flatnonzero(flags[1:] & ~flags[:-1]) + 1]


def _start(values: Floats, index: int, noise: float) -> int:
    """Index where the rise of `values` above `noise` began that reaches `index`.

    A slow rise is detected late.
    """
    while index > 0 and values[index] > max(values[index - 1], noise):
        index -= 1
    return index


def _held(flags: Flags, t: Floats, hold: float = HOLD, *, value: bool = False) -> Flags:
    """`flags` without those runs of `value` inside it that last for `hold` s or less."""
    edges = np.flatnonzero(flags[1:] != flags[:-1]) + 1
    starts, ends = edges[:-1], edges[1:]  # of runs that neither begin nor end the motion
    short = (flags[starts] == value) & (t[ends] - t[starts] <= hold)
    change = np.zeros(len(flags) + 1, dtype=np.intp)
    np.add.at(change, starts[short], 1)
    np.add.at(change, ends[short], -1)
    inside = np.cumsum(change[:-1]) > 0
    return np.where(inside, not value, flags)
