"""Extremes of a motion that is known at instants: the steps of a model, or the rows of a table.

Between two instants a quantity follows the cubic that has its values and rates there (Hermite).
Where an impact lies between them the rates jump: it then follows both rates up to the impact.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import kinematics
from rockcheck.scenes.base import Floats
from rockcheck.scenes.block import Block, Side
from rockcheck.scenes.events import Event
from rockcheck.scenes.extremes import NO_STRIKE, Extremes, WallExtremes
from rockcheck.scenes.scene import Wall

#: A length below this share of the block's half height is rounding.
ROUNDING = 1e-14
#: A landing strikes a wall that is nearer than this to the upright block, m.
FLUSH = 1e-9
#: Rotation over alpha, rotation rate (rad/s) and slip rate (m/s) of a block that has not uplifted,
#: and does not slip, for models that report neither.
FLAT, TURNING, SLIPPING = 1e-4, 1e-3, 1e-3
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True, kw_only=True)
class Track:
    """A motion of the box's centre at instants, and the events in it.

    `t` (n) in s; `states` (n, 6): x, y, theta and their rates, SI, NaN where unknown. `breaks` are
    the times of impacts.
    """

    t: Floats
    states: Floats
    breaks: Floats

    @classmethod
    def of(cls, t: Floats, states: Floats, events: Sequence[Event]) -> "Track":
        """The track of a motion with these events."""
        impacts = sorted(event.t for event in events if event.kind.endswith("impact"))
        return cls(t=t, states=states, breaks=np.array(impacts, dtype=float))

    def until(self, end: float) -> "Track":
        """The motion up to `end` (s), where it has a state of its own."""
        if not self.t[0] < end < self.t[-1]:
            return self
        rows = int(np.searchsorted(self.t, end))
        last = self.states_at(np.array([end]))
        return Track(
            t=np.append(self.t[:rows], end),
            states=np.concatenate([self.states[:rows], last]),
            breaks=self.breaks[self.breaks <= end],
        )

    def since(self, start: float) -> "Track":
        """The motion from `start` (s) on, where it has a state of its own."""
        if not self.t[0] < start < self.t[-1]:
            return self
        rows = int(np.searchsorted(self.t, start, side="right"))
        first = self.states_at(np.array([start]))
        return Track(
            t=np.insert(self.t[rows:], 0, start),
            states=np.concatenate([first, self.states[rows:]]),
            breaks=self.breaks[self.breaks > start],
        )

    def states_at(self, times: Floats) -> Floats:
        """States (..., 6) at times inside the motion: positions cubic, rates their slopes.

        Beside an impact both follow the nearer side: positions its rates, rates its value.
        Positions without rates, and rates without positions, are linear.
        """
        if len(self.t) < 2:
            return np.repeat(self.states, len(times), axis=0)
        right = np.clip(np.searchsorted(self.t, times, side="right"), 1, len(self.t) - 1)
        left = right - 1
        before, after = times - self.t[left], self.t[right] - times
        length = (before + after)[:, None]
        share = before[:, None] / length
        first, last = self.states[left], self.states[right]
        positions = hermite(
            share, first[:, :3], last[:, :3], length * first[:, 3:], length * last[:, 3:]
        )
        slopes = slope(
            share, first[:, :3], last[:, :3], length * first[:, 3:], length * last[:, 3:]
        )
        line = first[:, 3:] + share * (last[:, 3:] - first[:, 3:])
        rates = np.where(np.isnan(slopes), line, slopes / length)
        # A row at the time of an impact comes after it.
        past_rows = np.searchsorted(self.breaks, self.t[left], side="right")
        past_times = np.searchsorted(self.breaks, times, side="right")
        past_next = np.searchsorted(self.breaks, self.t[right], side="right")
        broken = past_next > past_rows
        on_left = broken & (past_times == past_rows)
        on_right = broken & ~on_left
        positions[on_left] = (first[:, :3] + before[:, None] * first[:, 3:])[on_left]
        positions[on_right] = (last[:, :3] - after[:, None] * last[:, 3:])[on_right]
        rates[on_left], rates[on_right] = first[on_left, 3:], last[on_right, 3:]
        chord = first[:, :3] + share * (last[:, :3] - first[:, :3])
        positions = np.where(np.isnan(positions), chord, positions)
        at_last = times == self.t[right]
        positions[at_last], rates[at_last] = last[at_last, :3], last[at_last, 3:]
        return np.concatenate([positions, rates], axis=1)


def hermite(share: Any, first: Any, last: Any, first_rate: Any, last_rate: Any) -> Any:
    """The cubic with these values and rates (per interval) at 0 and 1, at `share` of the way."""
    gain = last - first
    square = 3.0 * gain - 2.0 * first_rate - last_rate
    cube = first_rate + last_rate - 2.0 * gain
    return first + share * (first_rate + share * (square + share * cube))


def slope(share: Any, first: Any, last: Any, first_rate: Any, last_rate: Any) -> Any:
    """The rate (per interval) of that cubic at `share` of the way."""
    gain = last - first
    square = 3.0 * gain - 2.0 * first_rate - last_rate
    cube = first_rate + last_rate - 2.0 * gain
    return first_rate + share * (2.0 * square + 3.0 * share * cube)


def largest(
    t: Floats,
    value: Floats,
    rate: Floats,
    breaks: Floats,
    unknown: Sequence[int] | NDArray[np.intp] = (),
) -> tuple[float, float]:
    """Largest value of a quantity with these values and rates at the times `t`, and when it is.

    `breaks` are times at which the rate jumps; after the rows `unknown` it is no cubic.
    """
    top = int(np.argmax(value))
    best, when = float(value[top]), float(t[top])
    if not math.isfinite(best) or len(t) < 2:
        return best, when
    length = np.diff(t)
    rises = rate[:-1] * length
    falls = rate[1:] * length
    # A cubic lies inside the hull of its control points.
    hull = np.maximum(value[:-1] + rises / 3.0, value[1:] - falls / 3.0)
    broken = np.zeros(len(length), dtype=bool)
    after_break = np.searchsorted(t, breaks, side="left")
    inside = (after_break > 0) & (after_break < len(t))
    broken[after_break[inside] - 1] = True
    broken[np.asarray(unknown, dtype=np.intp)] = True
    for at, row in zip(breaks[inside].tolist(), after_break[inside].tolist(), strict=True):
        before, after = at - t[row - 1], t[row] - at
        reached = value[row - 1] + rate[row - 1] * before
        left_from = value[row] - rate[row] * after
        met = (reached * after + left_from * before) / (before + after)
        if met > best:
            best, when = float(met), at
    for row in np.flatnonzero((hull > best) & ~broken).tolist():
        ends = float(value[row]), float(value[row + 1]), float(rises[row]), float(falls[row])
        for share in turning_points(*ends):
            between = hermite(share, *ends)
            if between > best:
                best, when = between, float(t[row] + share * length[row])
    return best, when


def turning_points(first: float, last: float, first_rate: float, last_rate: float) -> list[float]:
    """Where between 0 and 1 the cubic with these values and rates at 0 and 1 has no rate."""
    gain = last - first
    square = 3.0 * gain - 2.0 * first_rate - last_rate
    cube = first_rate + last_rate - 2.0 * gain
    discriminant = square * square - 3.0 * first_rate * cube
    if discriminant < 0.0:
        return []
    half = -(square + math.copysign(math.sqrt(discriminant), square))
    roots = []
    if cube != 0.0:
        roots.append(half / (3.0 * cube))
    if half != 0.0:
        roots.append(first_rate / half)
    return [root for root in roots if 0.0 < root < 1.0]


def extremes_of(
    track: Track,
    block: Block | None,
    walls: Sequence[Wall],
    events: Sequence[Event],
    outcome: str,
    *,
    source: Literal["model", "rows"],
    gravity: float = 9.81,
) -> Extremes:
    """The extremes of a motion; NaN where it lacks the columns, or its block, that they need."""
    t, breaks = track.t, track.breaks
    x, _, theta, x_dot, _, theta_dot = track.states.T
    rotations = _rotations(track, outcome, events)
    slips = reaches = (math.nan, math.nan)
    top = hop = last_slip = math.nan
    if block is not None and np.all(np.isfinite(x)):
        slip = kinematics.slip(block, x, theta)
        slip_rate = kinematics.slip_rate(block, theta, x_dot, theta_dot)
        slips = largest(t, slip, slip_rate, breaks)[0], largest(t, -slip, -slip_rate, breaks)[0]
        last_slip = float(slip[-1])
        reaches = _reach(track, block, "left"), _reach(track, block, "right")
        top = _top_displacement(track, block)
        hop = _hop(track, block)
    least = 0.0 if block is None else ROUNDING * block.half_height
    first_uplift, first_slip = _firsts(track, block, events)
    return Extremes(
        rotation_left=rotations["left"][0],
        rotation_left_s=rotations["left"][1],
        rotation_right=rotations["right"][0],
        rotation_right_s=rotations["right"][1],
        slip=_above(max(slips), least),
        last_slip=last_slip if not abs(last_slip) <= least else 0.0,
        reach_left=_above(reaches[0], least),
        reach_right=_above(reaches[1], least),
        top_displacement=_above(top, least),
        hop=_above(hop, least),
        walls=_walls(track, block, walls, events, gravity),
        first_uplift_s=first_uplift,
        first_slip_s=first_slip,
        source=source,
    )


def from_rows(
    channels: Mapping[str, NDArray[Any]],
    events: Sequence[Event],
    block: Block | None,
    outcome: str,
    walls: Sequence[Wall] = (),
    gravity: float = 9.81,
) -> Extremes:
    """The extremes of a table of motion, with the channels of a history; rates may be missing."""
    return extremes_of(
        track_of(channels, events), block, walls, events, outcome, source="rows", gravity=gravity
    )


def track_of(channels: Mapping[str, NDArray[Any]], events: Sequence[Event]) -> Track:
    """The track of a history's channels."""
    names = "x", "y", "theta", "x_dot", "y_dot", "theta_dot"
    unknown = np.full(len(channels["t"]), math.nan)
    states = np.column_stack(
        [np.asarray(channels.get(name, unknown), dtype=float) for name in names]
    )
    return Track.of(np.asarray(channels["t"], dtype=float), states, events)


#: The rates of the columns of a history.
RATES = {"x": "x_dot", "y": "y_dot", "theta": "theta_dot", "slip": "slip_rate"}


def column_at(
    channels: Mapping[str, NDArray[Any]], events: Sequence[Event], name: str, times: Floats
) -> Floats:
    """A column of a history at times inside it.

    Places follow the cubics of their rates, and are linear without; rates are linear, too, and
    jump at impacts.
    """
    t = np.asarray(channels["t"], dtype=float)
    states = np.full((len(t), 6), math.nan)
    is_place = name in RATES
    states[:, 0 if is_place else 3] = channels[name]
    if is_place and RATES[name] in channels:
        states[:, 3] = channels[RATES[name]]
    return Track.of(t, states, events).states_at(times)[:, 0 if is_place else 3]


def _above(value: float, least: float) -> float:
    """The value where it is more than rounding; NaN stays."""
    return 0.0 if value <= least else value


def _rotations(
    track: Track, outcome: str, events: Sequence[Event]
) -> dict[Side, tuple[float, float]]:
    """Largest rotation to each side, rad, and its time, s."""
    theta, theta_dot = track.states[:, 2], track.states[:, 5]
    rotations: dict[Side, tuple[float, float]] = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        peak, when = largest(track.t, sign * theta, sign * theta_dot, track.breaks)
        # What does not overturn stays above the floor, whatever a cubic over a long step shows.
        rotations[side] = (0.0, 0.0) if peak <= 0.0 else (min(peak, 0.5 * math.pi), when)
        if outcome == f"overturned {side}":
            fallen = [event.t for event in events if event.kind == outcome]
            rotations[side] = 0.5 * math.pi, fallen[0] if fallen else float(track.t[-1])
    return rotations


def _reach(track: Track, block: Block, side: Side) -> float:
    """Farthest that a corner gets beyond its side, m."""
    x, _, theta, x_dot, _, theta_dot = track.states.T
    corners = kinematics.side_corners(block, side, 0.0, x, theta, x_dot, theta_dot)
    return max(largest(track.t, -gap, rate, track.breaks)[0] for gap, rate in corners)


def _top_displacement(track: Track, block: Block) -> float:
    """Largest horizontal distance of a top corner from where it began, m."""
    x, _, theta, x_dot, _, theta_dot = track.states.T
    farthest = 0.0
    for side in SIDES:
        _, (gap, rate) = kinematics.side_corners(block, side, 0.0, x, theta, x_dot, theta_dot)
        moved = gap[0] - gap
        outward = largest(track.t, moved, rate, track.breaks)[0]
        inward = largest(track.t, -moved, -rate, track.breaks)[0]
        farthest = max(farthest, outward, inward)
    return farthest


def _hop(track: Track, block: Block) -> float:
    """Largest height of the lower corner, m; NaN where the height is unknown."""
    _, y, theta, _, y_dot, theta_dot = track.states.T
    sign = np.sign(theta)
    lands = np.flatnonzero((sign[1:] == 0.0) & (sign[:-1] != 0.0)) + 1
    sign[lands] = sign[lands - 1]
    height = kinematics.pivot_height(block, y, theta)
    angle = block.box_angle - np.abs(theta)
    rate = y_dot - sign * block.half_diagonal * np.sin(angle) * theta_dot
    # Where the block passes upright, another corner becomes the lower one.
    turned = np.diff(theta) != 0.0
    passes = np.flatnonzero((sign[:-1] != sign[1:]) & turned)
    part = theta[passes] / (theta[passes] - theta[passes + 1])
    upright = track.t[passes] + part * np.diff(track.t)[passes]
    highest = largest(track.t, height, rate, track.breaks, passes)[0]
    standing = track.states_at(upright)[:, 1] - block.half_height
    return max(highest, float(np.max(standing, initial=-math.inf)))


def _firsts(
    track: Track, block: Block | None, events: Sequence[Event]
) -> tuple[float | None, float | None]:
    """When the block first uplifts and first slips, s.

    By the events where there are any of a mode, else by the thresholds of what is flat.
    """
    kinds = {event.kind for event in events}
    if kinds & {"uplift", "slip", "stick", "settled", "landing", "lift-off"}:
        uplifts = [event.t for event in events if event.kind == "uplift"]
        slips = [event.t for event in events if event.kind == "slip"]
        return min(uplifts, default=None), min(slips, default=None)
    if block is None:
        return None, None
    x_dot, theta, theta_dot = track.states[:, 3], track.states[:, 2], track.states[:, 5]
    flat = (np.abs(theta) < FLAT * block.alpha) & ~(np.abs(theta_dot) >= TURNING)
    slides = np.abs(kinematics.slip_rate(block, theta, x_dot, theta_dot)) > SLIPPING
    return _first_rise(track.t, ~flat), _first_rise(track.t, slides)


def _first_rise(t: Floats, flags: NDArray[np.bool_]) -> float | None:
    rises = np.flatnonzero(flags[1:] & ~flags[:-1])
    return float(t[rises[0]]) if rises.size else None


def _walls(
    track: Track,
    block: Block | None,
    walls: Sequence[Wall],
    events: Sequence[Event],
    gravity: float,
) -> dict[Side, WallExtremes]:
    """How the block strikes each wall.

    A "wall impact" is at the wall that a corner is nearest to; where the block lands flush with a
    wall, a "floor impact" strikes it as well.
    """
    found = dict.fromkeys((wall.side for wall in walls), NO_STRIKE)
    instants = np.array(sorted(event.t for event in events))
    if block is None or not np.all(np.isfinite(track.states[:, [0, 3, 5]])):
        return found
    for event in events:
        if not event.kind.endswith("impact"):
            continue
        row = max(int(np.searchsorted(track.t, event.t - FLUSH)) - 1, 0)
        near = [wall for wall in walls if _may_strike(track, block, wall, row, event.kind)]
        if not near:
            continue
        speed, side = _strike(track, block, near, row, event.t, instants, gravity)
        before = found[side]
        found[side] = WallExtremes(
            strikes=before.strikes + 1,
            first_s=event.t if before.first_s is None else min(before.first_s, event.t),
            speed=max(before.speed, speed),
            impulse=max(before.impulse, event.impulse),
        )
    return found


def _may_strike(track: Track, block: Block, wall: Wall, row: int, kind: str) -> bool:
    """Whether an impact of this kind can be one at the wall."""
    if kind == "wall impact":
        return True
    x, theta = track.states[row, [0, 2]]
    upright = kinematics.slip(block, x, theta)
    clear = kinematics.clearance(block, wall.side, wall.gap, upright, 0.0)
    return bool(kind == "floor impact" and abs(clear) < FLUSH)


def _strike(
    track: Track,
    block: Block,
    walls: Sequence[Wall],
    row: int,
    at: float,
    instants: Floats,
    gravity: float,
) -> tuple[float, Side]:
    """Speed (m/s) of the corner that strikes one of the walls at a time, and the wall's side.

    Speeds in `row` are carried on to that time, at the acceleration since the row before where none
    of the `instants` of events lies between. It is the fastest of the corners that are then nearest
    to a wall.
    """
    previous = max(row - 1, 0)
    between = np.searchsorted(instants, [track.t[previous], at - FLUSH])
    if between[1] > between[0]:
        previous = row
    rest = at - track.t[row]
    step = track.t[row] - track.t[previous]
    corners: list[tuple[float, float, Side]] = []
    for wall in walls:
        x, _, theta, x_dot, _, theta_dot = track.states[[previous, row]].T
        gaps_rates = kinematics.side_corners(block, wall.side, wall.gap, x, theta, x_dot, theta_dot)
        for gaps, rates in gaps_rates:
            gained = (rates[1] - rates[0]) * rest / step if step > 0.0 else 0.0
            corners.append((gaps[1] - rates[1] * rest, rates[1] + gained, wall.side))
    nearest = min(place for place, _, _ in corners) + gravity * rest * rest
    speed, side = max((rate, side) for place, rate, side in corners if place <= nearest)
    return max(0.0, float(speed)), side
