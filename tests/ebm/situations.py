"""Blocks in a state under constant accelerations, as tests of the core's parts take them.

`Core` is all that these tests know of how the core is called: a core of another shape is met there,
and nowhere else.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from stepping import TILTED, block_of, run_at

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import guards, modes, motion
from rockcheck.ebm.core.names import Family, Guard, Pivot, Row, Rule
from rockcheck.ebm.core.state import Run
from rockcheck.scenes import Floor, Record, Scene, Wall

PIVOTS = ["bilateral", "unilateral"]


def shentons(mu_s: float, mu_k: float, slope: float, a: float) -> str:
    """Shenton (1996): the mode into which a block at rest goes under a constant base acceleration.

    `a` is over gravity, `slope` is tan(alpha).
    """
    if a <= min(slope, mu_s):
        return "rest"
    if mu_s < slope:
        return "slide"
    if mu_s >= (a * (1.0 + 4.0 * slope**2) + 3.0 * slope) / (4.0 + slope**2 + 3.0 * a * slope):
        return "rock"
    return "slide-rock" if mu_k > slope else "slide"


GUARDS = {
    "far gap": Guard.FAR_GAP,
    "tip gap": Guard.TIP_GAP,
    "landing": Guard.LANDING,
    "push": Guard.FLOOR_PUSH,
    "tip push": Guard.TIP_PUSH,
    "far push": Guard.FAR_PUSH,
    "cone +": Guard.CONE_PLUS,
    "cone -": Guard.CONE_MINUS,
    "slip": Guard.SLIP,
    "topple": Guard.TOPPLE,
    "phi": Guard.PHI,
}


class Mode(NamedTuple):
    """Contacts of a mode in the frame of its pivot, in which a tilted block tips to the left."""

    tilted: bool
    side: int  # sign of theta
    floor: str  # "off", "stick" or "slip"
    slip: int  # direction
    pull: int  # sign of the floor's force
    tip: bool  # a corner rests on the wall that the block tips to
    far: bool

    @property
    def contacts(self) -> int:
        return (self.floor != "off") + self.tip + self.far

    @property
    def name(self) -> str:
        if not self.tilted:
            return {"off": "flight", "stick": "rest", "slip": "slide"}[self.floor]
        return {"off": "flight", "stick": "rock", "slip": "slide-rock"}[self.floor]


def run_of(mode: Mode, state) -> Run:
    return run_at(
        state,
        **TILTED | {"pull": mode.pull},
        sense=mode.side,
        slip=mode.slip,
        pivot={"off": Pivot.OFF, "stick": Pivot.STICK, "slip": Pivot.SLIPPING}[mode.floor],
        tip=mode.tip,
        far=mode.far,
    )


@dataclasses.dataclass(frozen=True)
class Situation:
    """A block (R = 1, g = 1) under constant accelerations of its base, with walls that it may
    touch, in a state."""

    alpha: float
    mu_s: float
    mu_k: float
    u: float
    g: float
    state: tuple[float, ...]
    walls: tuple[Wall, ...] = ()

    @property
    def scene(self) -> Scene:
        return Scene(
            name="part",
            block=block_of(self.alpha),
            floor=Floor(friction=self.mu_k, static_friction=self.mu_s),
            walls=self.walls,
            excitation=Record.from_samples([self.u] * 3, time_step=1.0),
            vertical=Record.from_samples([self.g - 1.0] * 3, time_step=1.0),
            duration=1.0,
            gravity=1.0,
        )


class Core:
    """The core as these tests call it. Natural units: R, g, sqrt(R/g)."""

    def __init__(self, at: Situation, pivot: str, friction: str = "coulomb") -> None:
        self.setting = natural.setting_of(at.scene, EventBasedModel(pivot=pivot, friction=friction))
        self.base = natural.base_of(at.scene)

    def select(self, state) -> Mode | None:
        """The mode in which the state (x, y, theta and their rates) goes on."""
        run = run_at(state)
        if (
            not modes.select(self.setting, self.base, run)
            or run.state.rules[Rule.LEAST_CONTRADICTION]
        ):
            return None
        mode = run.state.mode
        return Mode(
            tilted=bool(mode.family == Family.TILT),
            side=int(mode.sense),
            floor={Pivot.OFF: "off", Pivot.STICK: "stick", Pivot.SLIPPING: "slip"}[mode.pivot],
            slip=int(mode.slip),
            pull=int(mode.pull),
            tip=bool(mode.tip),
            far=bool(mode.far),
        )

    def guards(self, mode: Mode, state) -> tuple[dict[str, Polynomial], dict[str, Polynomial]]:
        """Guards of a tilted mode as polynomials of time, and the motion (phi, xi, y) that they
        follow."""
        run = run_of(mode, state)
        order = motion.mode_series(self.setting, self.base, run, 8, 0.0, 0.0)
        a = run.a
        guards.fill_guards(self.setting, run.state, a)
        found = {
            name: Polynomial(a[Row.GUARD, : guards.guard(which, order, a) + 1].copy())
            for name, which in GUARDS.items()
            if a[Row.THERE, which]
        }
        rock = mode.floor == "stick" and not mode.tip and not mode.far
        places = {"xi": Row.SIN, "y": Row.COS} if rock else {"xi": Row.XI, "y": Row.Y}
        follows = {
            name: Polynomial(a[row, : order + 1].copy())
            for name, row in ({"phi": Row.PHI} | places).items()
        }
        follows["xi"] += run.state.place if rock else 0.0
        return found, follows


def upright(u: float, g: float, alpha: float, mu_s: float, mu_k: float) -> Situation:
    return Situation(alpha, mu_s, mu_k, u, g, (0.0, math.cos(alpha), 0.0, 0.0, 0.0, 0.0))


class Found(NamedTuple):
    """What a candidate mode asks for, by Newton and Euler: accelerations of xi, y, phi and the
    contact forces."""

    acceleration: np.ndarray
    normal: float
    friction: float
    tip: float
    far: float


def answer(at: Situation, mode: Mode) -> Found:
    """Solves the equations of motion of a tilted block with the contacts of a mode, in its pivot's
    frame."""
    phi, w = mode.side * at.state[2], mode.side * at.state[5]
    rows, bias = contacts(at.alpha, phi, w)
    matrix, right = np.zeros((7, 7)), np.zeros(7)  # three accelerations; P, Q, N, M
    matrix[:3, :3] = np.diag([1.0, 1.0, 1.0 / 3.0])
    matrix[:3, 3:] = -rows.T
    right[:3] = [-mode.side * at.u, -at.g, 0.0]
    for k, closed in enumerate([mode.floor != "off", mode.floor == "stick", mode.tip, mode.far]):
        if closed:
            matrix[3 + k, :3], right[3 + k] = rows[k], -bias[k]
        else:
            matrix[3 + k, 3 + k] = 1.0
    if mode.floor == "slip":  # Q = -mu d |P|
        matrix[4, 3] = at.mu_k * mode.slip * mode.pull
    solved = np.linalg.solve(matrix, right)
    return Found(solved[:3], *solved[3:])


def contacts(alpha: float, phi: float, w: float) -> tuple[np.ndarray, np.ndarray]:
    """Of floor (normal, tangent), tip wall and far wall: the gap's derivative by (xi, y, phi), and
    what the rates alone give it."""
    s, c, sp, cp = (
        math.sin(alpha - phi),
        math.cos(alpha - phi),
        math.sin(alpha + phi),
        math.cos(alpha + phi),
    )
    return (
        np.array([[0.0, 1.0, -s], [1.0, 0.0, c], [1.0, 0.0, -cp], [-1.0, 0.0, -cp]]),
        np.array([c, s, sp, sp]) * w * w,
    )


def margin(at: Situation, mode: Mode, touched: tuple[bool, bool], pivot: str) -> float:
    """By how much a mode is consistent (positive) or not (negative): the least of all that must not
    be negative."""
    try:
        found = answer(at, mode)
    except np.linalg.LinAlgError:
        return -math.inf
    phi, w = mode.side * at.state[2], mode.side * at.state[5]
    rows, bias = contacts(at.alpha, phi, w)
    rates = rows @ np.array([mode.side * at.state[3], at.state[4], w])
    opens = rows @ found.acceleration + bias
    stands, slides = mode.floor == "stick", mode.floor == "slip"
    moves = abs(rates[1]) > 1e-9
    pushes = mode.pull * found.normal
    asked = [
        (mode.tip, found.tip),
        (touched[0] and not mode.tip, opens[2]),
        (mode.far, found.far),
        (touched[1] and not mode.far, opens[3]),
        (mode.floor == "off", opens[0]),
        (slides or (stands and pivot == "unilateral"), pushes),
        (stands, at.mu_s * pushes - abs(found.friction)),
        (stands and moves, -1.0),
        (slides, mode.slip * (rates[1] if moves else opens[1])),
    ]
    return min((least for holds, least in asked if holds), default=math.inf)


def candidates(side: int, touched: tuple[bool, bool], pivot: str) -> list[Mode]:
    found = []
    for tip, far in ((True, False), (False, True), (False, False)):
        if (tip and not touched[0]) or (far and not touched[1]):
            continue
        for pull in (1,) if pivot == "unilateral" else (1, -1):
            found.append(Mode(True, side, "stick", 0, pull, tip, far))
            found += [Mode(True, side, "slip", d, pull, tip, far) for d in (1, -1)]
        if pivot == "unilateral":
            found.append(Mode(True, side, "off", 0, 1, tip, far))
    return found


def random_tilt(rng: np.random.Generator, touch: str) -> tuple[Situation, int, tuple[bool, bool]]:
    """A block tilted at random on the floor, perhaps with a corner on a wall, at rest or moving as
    its contacts allow."""
    alpha = rng.uniform(0.05, 0.7)
    phi, side = alpha * rng.uniform(0.05, 0.9), int(rng.choice([-1, 1]))
    s, c, sp, cp = (
        math.sin(alpha - phi),
        math.cos(alpha - phi),
        math.sin(alpha + phi),
        math.cos(alpha + phi),
    )
    mu_k = rng.uniform(0.0, 1.2)
    mu_s = min(mu_k * float(rng.choice([1.0, rng.uniform(1.0, 1.4)])), 1.33)
    w, v, xi = 0.0, 0.0, rng.uniform(-0.02, 0.02)
    if touch == "none":
        w, v = rng.choice([0.0, rng.normal(0.0, 0.5)]), rng.choice([0.0, rng.normal(0.0, 0.5)])
        walls: tuple[Wall, ...] = ()
    else:
        w = rng.choice([0.0, 0.0, rng.normal(0.0, 0.3)])
        wall = 1.0 if touch == "tip" else -1.0
        # xi + delta = s' on the tip wall, delta - xi = s' on the far one
        gap = sp - wall * xi - math.sin(alpha)
        if gap < 0.0:
            xi += wall * (gap - 0.01)
            gap = 0.01
        walls = (
            Wall(side="left" if (side if touch == "tip" else -side) > 0 else "right", gap=gap),
        )
        v = (wall * cp + c) * w  # along the wall
    state = (side * xi, c, side * phi, side * (v - c * w), s * w, side * w)
    # 0.3 g to 2 g, seldom a floor that falls away
    g = rng.uniform(0.3, 2.0) if rng.random() < 0.9 else rng.uniform(-1.0, -0.2)
    at = Situation(alpha, mu_s, mu_k, rng.normal(0.0, 0.7), g, state, walls)
    if rng.random() < 0.4 and (
        touch == "none" or w == 0.0
    ):  # at the limit of slip, where a pivot may stand or go on slipping
        at = dataclasses.replace(at, state=standing(at))
        stuck = answer(at, Mode(True, side, "stick", 0, 1, touch == "tip", touch == "far"))
        mu_k = min(abs(stuck.friction / stuck.normal) * rng.uniform(0.75, 1.15), 1.2)
        at = dataclasses.replace(at, mu_k=mu_k, mu_s=min(mu_k * rng.uniform(1.0, 1.5), 1.33))
    return at, side, (touch == "tip", touch == "far")


def standing(at: Situation) -> tuple[float, ...]:
    """The state with the slip of its pivot taken away."""
    x, y, theta, _, _, w = at.state
    s, c = math.sin(at.alpha - abs(theta)), math.cos(at.alpha - abs(theta))
    return (x, y, theta, -c * w, math.copysign(1.0, theta) * s * w, w)


def at_wall(at: Situation, side: int) -> float | None:
    """Distance of the wall on a side (+1 left) from the middle, or None."""
    return next(
        (math.sin(at.alpha) + w.gap for w in at.walls if (w.side == "left") == (side > 0)), None
    )
