"""The paper's closed-form equations, integrated by scipy's DOP853 at 1e-13 (see
test_another_method.py)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rockcheck.scenes import Floats, Record, Scene

State = Floats  # x, theta, dx/dt, dtheta/dt


def sign(value: float) -> int:
    return 1 if value >= 0.0 else -1


@dataclass(frozen=True)
class Mode:
    """Pivot S (+1 left corner), direction d of its slip (0: sticks), wall Sw that a corner rests on
    (0: none), sign of G or P."""

    S: int
    d: int = 0
    Sw: int = 0
    sense: int = 1

    @property
    def name(self) -> str:
        return ("ladder" if self.d else "lean") if self.Sw else ("slide-rock" if self.d else "rock")


@dataclass
class PaperModel:
    """The event-based model of one scene, with a pivot that never leaves the floor and at most one
    wall."""

    scene: Scene
    max_step: float = 5e-3
    events: list[tuple[float, str]] = field(default_factory=list)
    #: When each piece of the motion ends, and the state by the time.
    pieces: list[tuple[float, Callable[[float], State]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.alpha, self.R, self.g = (
            self.scene.block.alpha,
            self.scene.block.radius,
            self.scene.gravity,
        )
        self.mu_s, self.mu_k = self.scene.floor.mu_s, self.scene.floor.friction
        self.wall = self.scene.walls[0] if self.scene.walls else None
        self.side = {"left": 1, "right": -1}[self.wall.side] if self.wall else 0
        self.delta = self.scene.block.half_width + self.wall.gap if self.wall else math.inf

    def u(self, t: float) -> float:
        return float(self.scene.excitation.acceleration(t))

    def G0(self, t: float) -> float:
        return self.g + float(self.scene.vertical.acceleration(t))

    def geometry(self, theta: float) -> tuple[float, float, float, float]:
        a = abs(theta)
        return (
            math.sin(self.alpha - a),
            math.cos(self.alpha - a),
            math.sin(self.alpha + a),
            math.cos(self.alpha + a),
        )

    def motion(self, m: Mode, t: float, y: State) -> tuple[float, float, float, float, float]:
        """x'', theta'', P, Q, N of a mode."""
        _, theta, _, w = y
        s, c, sp, cp = self.geometry(theta)
        S, R, u, G0 = m.S, self.R, self.u(t), self.G0(t)
        G = G0 - R * c * w * w
        sigma = S * m.Sw
        C = sigma * cp
        if m.name == "rock":  # (3)
            turn = 0.75 / R * (u * c - S * s * G0)
            x2 = -R * c * turn - S * R * s * w * w
            return x2, turn, S * R * s * turn + G, x2 + u, 0.0
        if m.name == "slide-rock":  # (7), (8)
            eta = self.mu_k * S * m.d * m.sense
            P = G / (1.0 + 3.0 * s * s + 3.0 * eta * s * c)
            Q = -self.mu_k * m.d * abs(P)
            return Q - u, -3.0 / R * S * (s + eta * c) * P, P, Q, 0.0
        if m.name == "lean":
            N = m.Sw * (u * c - S * s * G0) / (c + C)
            return 0.0, 0.0, G0, u - m.Sw * N, N
        k = self.mu_k * m.d * m.sense
        turn = -(k * (c + C) + S * s) * G - C * (u - sigma * S * R * sp * w * w)
        turn /= R * (1.0 / 3.0 + s * s + cp * cp + k * S * s * (c + C))
        P = S * R * s * turn + G
        x2 = sigma * (R * cp * turn - S * R * sp * w * w)
        return x2, turn, P, -k * P, m.Sw * (x2 + u + k * P)

    def slip(self, y: State) -> float:
        return y[2] + self.R * math.cos(self.alpha - abs(y[1])) * y[3]

    def slip_rate_change(self, m: Mode, t: float, y: State) -> float:
        x2, turn = self.motion(m, t, y)[:2]
        s, c, _, _ = self.geometry(y[1])
        return x2 + self.R * c * turn + m.S * self.R * s * y[3] ** 2

    def gap(self, y: State) -> float:
        return self.side * y[0] + self.delta - self.R * math.sin(self.alpha + abs(y[1]))

    def gap_change(self, m: Mode, t: float, y: State) -> float:
        """Second derivative of the gap, for a corner on the wall."""
        x2, turn = self.motion(m, t, y)[:2]
        _, _, sp, cp = self.geometry(y[1])
        sigma = m.S * self.side
        return self.side * (x2 - self.R * sigma * cp * turn + sigma * m.S * self.R * sp * y[3] ** 2)

    def tilted(self, t: float, y: State, closed: bool) -> Mode:
        """The tilt selector, with a corner on the wall or without."""
        S = sign(y[1] if y[1] != 0.0 else y[3])
        V, w, Sw = self.slip(y), y[3], self.side
        if closed and abs(w) > 1e-12:
            ladder = Mode(S, sign(w), Sw)
            return ladder if self.motion(ladder, t, y)[4] >= 0.0 else Mode(S, sign(V))
        if closed:
            lean = Mode(S, 0, Sw)
            _, _, P, Q, N = self.motion(lean, t, y)
            if N >= 0.0 and abs(Q) <= self.mu_s * P:
                return lean
        elif abs(V) > 1e-12:
            return self.with_sense(Mode(S, sign(V)), t, y)
        rock = Mode(S)
        _, _, P, Q, _ = self.motion(rock, t, y)
        if abs(Q) <= self.mu_s * abs(P) and (not closed or self.gap_change(rock, t, y) >= 0.0):
            return rock
        if not closed:
            return self.with_sense(Mode(S, -sign(Q)), t, y)
        slips = (Mode(S, 1, Sw), Mode(S, -1, Sw), Mode(S, 1), Mode(S, -1))
        found = [mode for mode in slips if self.starts(mode, t, y)]
        assert len(found) == 1, found
        return found[0]

    def C(self, S: int, y: State) -> float:
        return S * self.side * math.cos(self.alpha + abs(y[1]))

    def starts(self, m: Mode, t: float, y: State) -> bool:
        """Whether a slip from rest, down the wall or off it, begins as its mode says."""
        if m.Sw:
            _, turn, _, _, N = self.motion(m, t, y)
            return m.d * turn > 0.0 and N >= 0.0
        return m.d * self.slip_rate_change(m, t, y) > 0.0 and self.gap_change(m, t, y) > 0.0

    def with_sense(self, m: Mode, t: float, y: State) -> Mode:
        return Mode(
            m.S, m.d, m.Sw, sign(self.G0(t) - self.R * math.cos(self.alpha - abs(y[1])) * y[3] ** 2)
        )

    def guards(self, m: Mode) -> dict[str, Callable[[float, State], float]]:
        """Functions that fall through zero where the mode ends."""
        every: dict[str, tuple[object, Callable[[float, State], float]]] = {
            "floor impact": (True, lambda t, y: m.S * y[1]),
            "overturned": (True, lambda t, y: math.pi / 2 - m.S * y[1]),
            "release": (m.Sw, lambda t, y: self.motion(m, t, y)[4]),
            "wall impact": (self.wall and not m.Sw, lambda t, y: self.gap(y)),
            "stick": (m.d, lambda t, y: m.d * self.slip(y)),
            "slip": (
                not m.d,
                lambda t, y: (
                    self.mu_s * abs(self.motion(m, t, y)[2]) - abs(self.motion(m, t, y)[3])
                ),
            ),
            "sense": (m.d and not m.Sw, lambda t, y: m.sense * self.motion(m, t, y)[2]),
        }
        return {name: guard for name, (asked, guard) in every.items() if asked}

    def impact(
        self,
        S: int,
        y: State,
        vertical: float,
        *,
        e: float | None = None,
        slips: int = 0,
        sense: int = 1,
    ) -> list[float]:
        """Momentum balance of one impact at a speed `vertical` of the centroid: dx/dt, w after it,
        impulses P, Q, N.

        The pivot sticks or, with `slips` its direction, slips under a P of sign `sense`; the corner
        on the wall rebounds with e or, with None, receives nothing.
        """
        s, c, _, _ = self.geometry(y[1])
        R, C, Sw = self.R, self.C(S, y) if self.wall else 0.0, self.side
        v1, w1 = y[2], y[3]
        rows = [  # unknowns: dx/dt, w, P, Q, N
            ([1.0, 0.0, 0.0, -1.0, -Sw], v1),
            ([0.0, S * R * s, -1.0, 0.0, 0.0], vertical),
            ([0.0, R * R / 3.0, S * R * s, -R * c, R * C * Sw], R * R / 3.0 * w1),
            ([0.0, 0.0, self.mu_k * slips * sense, 1.0, 0.0], 0.0)
            if slips
            else ([1.0, R * c, 0.0, 0.0, 0.0], 0.0),
            ([0.0, 0.0, 0.0, 0.0, 1.0], 0.0)
            if e is None
            else ([1.0, -R * C, 0.0, 0.0, 0.0], -e * (v1 - R * C * w1)),
        ]
        return np.linalg.solve([row for row, _ in rows], [right for _, right in rows]).tolist()

    def hit_floor(self, m: Mode, y: State) -> State:
        s, c, _, _ = self.geometry(0.0)
        S2, vertical = -m.S, m.S * self.R * s * y[3]
        y = np.array([y[0], 0.0, y[2], y[3]])
        v, w, P, Q, _ = self.impact(S2, y, vertical)
        if S2 * w < 0.0 or P < 0.0 or abs(Q) > self.mu_s * P:
            slides = [(d, *self.impact(S2, y, vertical, slips=d)[:2]) for d in (1, -1)]
            ((v, w),) = [
                (v, w) for d, v, w in slides if S2 * w >= 0.0 and d * (v + self.R * c * w) >= 0.0
            ]
        return np.array([y[0], 0.0, v, w])

    def hit_wall(self, m: Mode, y: State) -> tuple[State, bool]:
        """The cascade of Fig. 3; also whether the corner stays on the wall."""
        s, c, _, _ = self.geometry(y[1])
        R, C, S, Sw, e = self.R, self.C(m.S, y), m.S, self.side, self.wall.restitution
        vertical = S * R * s * y[3]
        v, w, P, Q, N = self.impact(S, y, vertical, e=e)
        if abs(Q) <= self.mu_s * abs(P):
            if N >= 0.0:  # A
                return np.array([y[0], y[1], v, w]), e == 0.0
            v, w, *_ = self.impact(S, y, vertical)
            if Sw * (v - R * C * w) >= 0.0:  # B
                return np.array([y[0], y[1], v, w]), False
            return np.array([y[0], y[1], 0.0, 0.0]), e == 0.0  # C
        trials = [
            (-self.mu_k * Sr * sy, Sr, sy, *self.impact(S, y, vertical, e=e, slips=Sr, sense=sy))
            for Sr in (1, -1)
            for sy in (1, -1)
        ]
        ((v, w, N, k),) = (
            (v, w, N, k)
            for k, Sr, sy, v, w, P, _, N in trials
            if sign(P) == sy and sign(v + R * c * w) == Sr
        )
        if N >= 0.0:  # D
            return np.array([y[0], y[1], v, w]), e == 0.0
        # E: no impulse from the wall, whose corner neither rebounds nor enters; the moment is what
        # is left over.
        w = (k * vertical - y[2]) / (k * S * R * s - R * C)
        return np.array([y[0], y[1], R * C * w, w]), False

    def uplift(self, t: float, x: float) -> tuple[float, Mode | None, State]:
        """From rest: when and how the block starts to move. Only blocks whose friction lets them
        tilt."""
        slope, end = math.tan(self.alpha), self.scene.duration
        assert self.mu_s >= slope
        y = np.array([x, 0.0, 0.0, 0.0])
        held = self.side if self.gap(y) < 1e-10 else 0  # a flush block cannot tilt toward its wall

        def excess(t: float) -> float:
            return max(S * self.u(t) for S in (1, -1) if held != S) - slope * self.G0(t)

        fine = np.append(np.arange(t, end, 1e-3), end)
        first = next((k for k, s in enumerate(fine) if excess(s) > 0.0), None)
        if first is None:
            return end, None, y
        t = brentq(excess, fine[first - 1], fine[first], xtol=1e-15, rtol=1e-15) if first else t
        S = sign(self.u(t))
        sticks = self.mu_s >= (slope * (1.0 + 4.0 * slope**2) + 3.0 * slope) / (
            4.0 + slope**2 + 3.0 * slope**2
        )
        return t, (Mode(S) if sticks else Mode(S, -S)), y

    def run(self) -> PaperModel:
        scene = self.scene
        x, _, theta, v, _, w = scene.initial_state
        t, y = 0.0, np.array([x, theta, v, w])
        mode = self.tilted(t, y, closed=False) if theta != 0.0 or w != 0.0 else None
        while t < scene.duration:
            if mode is None:
                t, mode, y = self.uplift(t, y[0])
                self.pieces.append((t, lambda _, y=y: y))
                if mode:
                    self.events.append((t, "uplift"))
                continue
            t, y, kind = self.step(mode, t, y)
            if kind not in ("end", "sense"):
                self.events.append((t, kind))
            if kind in ("end", "overturned"):
                return self
            mode, y = self.after(mode, kind, t, y)
        return self

    def after(self, mode: Mode, kind: str, t: float, y: State) -> tuple[Mode | None, State]:
        if kind == "floor impact":
            y = self.on_pivot(self.hit_floor(mode, y))
            if mode.Sw or abs(y[3]) < 1e-7:  # on a wall every contact is plastic: flush rest
                return None, np.array([y[0], 0.0, 0.0, 0.0])
            return self.tilted(t, y, closed=False), y
        if kind == "wall impact":
            y, stays = self.hit_wall(mode, y)
            return self.tilted(t, y, closed=stays), y
        if kind == "stick":
            w = 0.0 if mode.Sw else y[3]
            y = np.array([y[0], y[1], -self.R * math.cos(self.alpha - abs(y[1])) * w, w])
            return self.tilted(t, y, closed=mode.Sw != 0), y
        if kind == "slip":
            Q = self.motion(mode, t, y)[3]
            return self.with_sense(Mode(mode.S, -sign(Q), mode.Sw), t, y), y
        if kind == "sense":
            return Mode(mode.S, mode.d, mode.Sw, -mode.sense), y
        return self.tilted(t, y, closed=False), y  # released

    def on_pivot(self, y: State) -> State:
        """Slip that is only rounding is taken out."""
        V = self.slip(y)
        return np.array([y[0], y[1], y[2] - V, y[3]]) if abs(V) < 1e-12 else y

    def step(self, m: Mode, t: float, y: State) -> tuple[float, State, str]:
        named = self.guards(m)
        for function in named.values():
            function.terminal, function.direction = True, -1.0  # type: ignore[attr-defined]
        last, record, kinks = self.scene.duration, self.scene.excitation, np.empty(0)
        if isinstance(record, Record):  # stop at the samples, where the motion has kinks
            kinks = record.time_step * np.arange(1, len(record.unscaled))
        for end in (*kinks[(kinks > t + 1e-12) & (kinks < last)], last):
            run = solve_ivp(
                lambda t, y: [y[2], y[3], *self.motion(m, t, y)[:2]],
                (t, end),
                y,
                method="DOP853",
                rtol=1e-13,
                atol=1e-15,
                max_step=self.max_step,
                events=list(named.values()),
                dense_output=True,
            )
            self.pieces.append((run.t[-1], run.sol))
            t, y = run.t[-1], run.y[:, -1]
            if run.status == 1:
                (kind,) = (
                    name for name, found in zip(named, run.t_events, strict=True) if found.size
                )
                return t, y, kind
        return t, y, "end"

    def at(self, times: Floats) -> Floats:
        """x, theta, dx/dt, dtheta/dt at the times, up to where the run ended."""
        ends = [end for end, _ in self.pieces]
        times = times[times <= ends[-1] + 1e-9]
        pieces = np.minimum(np.searchsorted(ends, times), len(ends) - 1)
        return np.array([self.pieces[k][1](t) for k, t in zip(pieces, times, strict=True)])
