"""How far a block moves: the four figures of a history that an engineer reads first."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rockcheck.scenes import History, Scene, kinematics
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.finding import Column

#: A slip below this share of the block's half height is rounding.
ROUNDING = 1e-14


#: The figures: name, what readers call it, unit and meaning.
QUANTITIES = (
    Column(
        "peak_rotation", "peak rotation", "alpha", help="largest |θ|, over the slenderness angle"
    ),
    Column("slip", "slip", "m", help="largest |slip| of the pivot corner along the floor"),
    Column(
        "top_displacement",
        "top displacement",
        "m",
        help="largest horizontal distance of a top corner from where it began, relative to the"
        " floor",
    ),
    Column(
        "wall_speed",
        "speed at the wall",
        "m/s",
        help="largest speed with which the block strikes a wall",
    ),
)


class Motion(Stored):
    """How far a block moves; None where unknown and, except `wall_speed`, for a fallen block.

    `peak_rotation` over alpha; `slip` and `top_displacement` in m, the largest along the floor and
    of a top corner from where it began; `wall_speed` in m/s, the largest with which the block
    struck a wall, None where it struck none.
    """

    peak_rotation: float | None
    slip: float | None
    top_displacement: float | None
    wall_speed: float | None

    def words(self) -> list[str]:
        """The known figures, with their units."""
        return [
            f"{q.label} {value:.4g} {q.unit}"
            for q in QUANTITIES
            if (value := getattr(self, q.name)) is not None
        ]


def motion_of(history: History, scene: Scene | None = None) -> Motion:
    """The figures of a history; `scene` gives the walls, and the block where the file has none."""
    block, channels = scene.block if scene else history.block, history.channels
    theta = np.asarray(channels["theta"], dtype=float)
    stands = not history.outcome.startswith("overturned")
    peak = top = None
    if stands and block is not None:
        peak = history.peak_rotation / block.alpha
        if "x" in channels:
            places = kinematics.top_corners(block, np.asarray(channels["x"], dtype=float), theta)
            top = float(np.max(np.abs(places - places[:, :1])))
    return Motion(
        peak_rotation=peak,
        slip=largest_slip(history) if stands and "slip" in channels else None,
        top_displacement=top,
        wall_speed=max(wall_speeds(history, scene), default=None) if scene else None,
    )


def largest_slip(history: History) -> float:
    """Largest |slip|, m, also of a block that falls; 0 if it is rounding of the pivot's place."""
    largest = float(np.max(np.abs(history.channels["slip"])))
    return largest if largest > ROUNDING * getattr(history.block, "half_height", 0.0) else 0.0


def wall_speeds(history: History, scene: Scene) -> list[float]:
    """Speeds (m/s) with which the block struck walls, one per event "wall impact".

    The speed of the outermost corner in the last row before the event, extrapolated to the event
    from the last two rows if no other event lies between.
    """
    names = ("t", "x", "theta", "x_dot", "theta_dot")
    if not scene.walls or any(name not in history.channels for name in names):
        return []
    t, x, theta, x_dot, theta_dot = (
        np.asarray(history.channels[name], dtype=float) for name in names
    )
    times = np.array([event.t for event in history.event_list])
    found = []
    for event in history.event_list:
        row = int(np.searchsorted(t, event.t - 1e-9)) - 1
        if event.kind != "wall impact" or row < 0:
            continue
        rows = slice(max(row - 1, 0), row + 1)
        wall = min(
            scene.walls, key=lambda w: kinematics.wall_gap(scene, w.side, x[row], theta[row])
        )
        rates = kinematics.reach_rate(
            scene.block, wall.side, theta[rows], x_dot[rows], theta_dot[rows]
        )
        speed = rates[-1]
        if len(rates) == 2 and not np.any((times > t[rows][0]) & (times < event.t - 1e-9)):
            speed += (rates[1] - rates[0]) * (event.t - t[row]) / (t[row] - t[row - 1])
        found.append(max(float(speed), 0.0))
    return found


def largest_reach(history: History, scene: Scene, side: str) -> float:
    """Farthest reach (m) of the block beyond its first place on `side`.

    A wall at a smaller clear gap there would be struck.
    """
    x, theta = history.channels["x"], history.channels["theta"]
    return float(np.max(-kinematics.clearance(scene.block, side, 0.0, x, theta)))


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Median, 16 and 84 % quantiles and maximum of `values`; each None if there are none."""
    if not len(values):
        return dict.fromkeys(("median", "p16", "p84", "largest"))
    low, median, high = np.quantile(values, (0.16, 0.5, 0.84)).tolist()
    return {"median": median, "p16": low, "p84": high, "largest": float(np.max(values))}
