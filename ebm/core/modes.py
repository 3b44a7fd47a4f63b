"""Which mode follows an event: the one in which every guard leaves zero upward.

A mode is consistent as long as its guards are not negative. As Taylor polynomials they are the
events of a step (their first root) and the test that selects the next mode (the sign with which
they leave zero), so that a selected mode can never end at once. Applied to the bilateral pivot this
selection is the paper's: its rules for uplift and slip (Shenton's map among them), for the tilted
block and for the corner that stays on the wall come out as the one consistent candidate; tests hold
the closed forms against it.

Termination. At one instant a mode is selected once. One that has ended at that instant is selected
again only where no other fits. Then, and where none fits at all, the mode that is violated least
goes on with a *slack*: the noise that its guards are allowed. Each further such selection at that
instant doubles the least slack. It soon exceeds all forces, and time goes on.
"""

import itertools
import math
from collections import namedtuple
from enum import IntEnum

import numpy as np

from rockcheck.ebm.core import contacts, ground, guards, series
from rockcheck.ebm.core.block import LEAST_FRICTION
from rockcheck.ebm.core.motion import mode_series
from rockcheck.ebm.core.names import Family, Guard, Kind, Pivot, Row, Rule
from rockcheck.ebm.core.state import MODE, code_of, on_wall, rests
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: Order of the series that a selection looks at.
_LOOK = 6


def _candidates(first: int) -> list[tuple[int, ...]]:
    """All modes in the order of trial, each a MODE; the left side is first (1), or the right (-1).

    More contacts come first, sticking before slipping, a pushing floor before a pulling one. The
    first side of a flat block is the one that is `favoured`, left where none is.
    """
    tilted = (1, 1), (1, 0), (0, 1), (0, 0)  # on the wall that it tips to, on the other one
    flat = [walls[::first] for walls in tilted]
    rows = [(Family.FLAT, 1, Pivot.STICK, 0, pull, *walls) for walls in flat for pull in (1, -1)]
    # With static friction above kinetic both rocking and sliding can be consistent. Then the pivot
    # sticks.
    rows.append((Family.TILT, first, Pivot.STICK, 0, 1, 0, 0))
    # A flat block that slides touches no wall, and the floor pushes.
    rows += [(Family.FLAT, 1, Pivot.OFF, 0, 1, *walls) for walls in flat[:-1]]
    rows += [(Family.FLAT, 1, Pivot.SLIPPING, slip, 1, 0, 0) for slip in (-first, first)]
    rows.append((Family.FLAT, 1, Pivot.OFF, 0, 1, 0, 0))
    pivots = (Pivot.STICK, 0), (Pivot.SLIPPING, -1), (Pivot.SLIPPING, 1)
    for sense, walls in itertools.product((first, -first), tilted):
        on_floor = itertools.product((1, -1), pivots)
        rows += [(Family.TILT, sense, *pivot, pull, *walls) for pull, pivot in on_floor]
        rows.append((Family.TILT, sense, Pivot.OFF, 0, 1, *walls))
    return rows


#: The passes of a selection: the first mode that fits; else that which is violated least, among
#: those not tried at this instant, and among those tried.
Search = IntEnum("Search", "FITS UNTRIED TRIED", start=0)
#: Row 1 has the left side first, row -1 (the last one) the right one.
_CANDIDATES = np.array([_candidates(side) for side in (1, 1, -1)], MODE)
# The numbers of those that tilt to the first side, but for the first of all, an upright block's
# only. They follow one another; those that no wall takes part in come last, from `_FREE` on.
_LEFT = _CANDIDATES[1]
_TILTS = np.flatnonzero((_LEFT["family"] == Family.TILT) & (_LEFT["sense"] > 0))[1:]
_FREE = _TILTS[(_LEFT["tip"] | _LEFT["far"])[_TILTS] == 0][0]


@inner_kernel
def reset_tried_modes(state):
    """A new instant begins: no mode has been tried in it."""
    state.tried[:] = 0
    state.slack = state.least_slack = 1.0
    state.since, state.ended = state.t, -1


@inner_kernel
def mark_mode_ended(state, kind):
    """Notes that a guard of this kind has ended the mode.

    If it was a force's, and by rounding only, the mode may go on once.
    """
    if state.t - state.since > series.INSTANT:
        reset_tried_modes(state)
    code = code_of(state.mode)
    state.tried[code] = kind != Kind.FORCE or state.t - state.began <= series.INSTANT
    state.ended = code if kind == Kind.FORCE else -1


@inner_kernel
def relax_tolerance(state):
    """Gives the mode the least slack, and doubles that for the next selection at this instant."""
    state.slack = state.least_slack
    state.least_slack *= 2.0


@inner_kernel
def constraint_violation(block, base, run, measured):
    """0 if the mode can begin, else the slack (in units of noise) with which it could.

    A mode can begin with every guard leaving zero upward. Infinite if the mode needs a motion that
    does not begin, or if that slack is not `measured`: only where no mode fits is it asked for.
    """
    # The plain constant would make numba compile all series once more, for it alone.
    look = min(_LOOK, series.WIDTH)
    state, t, a = run.state, run.state.t, run.a
    order = mode_series(block, base, run, look, 0.0, 0.0)
    guards.fill_guards(block, run.state, run.a)
    smooth = ground.smooth_until(base, t) - t
    if _stands(block, state, order - 2, guards.seen(Kind.FORCE, smooth), a):
        return np.inf
    worst = 0.0
    for which in range(len(guards.KIND)):
        if a[Row.THERE, which] != 0.0:
            ahead = guards.seen(guards.KIND[which], smooth)
            worst = max(worst, _guard_violation(state, which, order, ahead, a, measured))
            if worst == np.inf:
                break
    return worst


@inner_kernel
def _stands(block, state, degree, ahead, a):
    """Whether static friction holds the flat block at rest that is to slide.

    With less friction it would slide: the kinetic one tells nothing of a block that rests.
    """
    mode = state.mode
    slides = mode.family == Family.FLAT and mode.pivot == Pivot.SLIPPING
    if not slides or state.motion.vx != 0.0 or block.mu_s <= max(block.mu_k, LEAST_FRICTION):
        return False
    for k in range(degree + 1):
        a[Row.GUARD, k] = block.mu_s * a[Row.G, k] + mode.slip * a[Row.U, k]
    return series.leading(a, Row.GUARD, degree, series.NOISE[Kind.FORCE], ahead) > 0


@inner_kernel
def _guard_violation(state, which, order, ahead, a, measured):
    """What one guard adds to `constraint_violation`."""
    mode = state.mode
    noise, degree = series.NOISE[guards.KIND[which]], guards.guard(which, order, a)
    if which <= Guard.FAR_GAP and a[Row.GUARD, 1] < -contacts.SLOW:
        return 0.0  # a closing contact is the impact handler's
    sign = series.leading(a, Row.GUARD, degree, noise, ahead)
    never = sign <= 0 and which == Guard.PHI and (mode.pivot != Pivot.OFF or sign < 0)
    if never or not math.isfinite(a[Row.GUARD, 0]):
        return np.inf
    # A pivot that has not yielded (Bouc-Wen) may stand.
    if sign > 0 or (sign == 0 and (which != Guard.SLIP or state.winds)):
        return 0.0
    if not measured:
        return np.inf
    slack = 1.0
    while sign < 0:
        slack *= 4.0
        sign = series.leading(a, Row.GUARD, degree, slack * noise, ahead)
    return slack


@inner_kernel
def favoured(block, base, state):
    """The side to which a flat block at rest would rather tip: +1 left, -1 right, 0 neither.

    It is 0 where the scene is its own mirror image. Both sides fit only by rounding, or where the
    floor falls away faster than g under a pivot that cannot let go. Then the base acceleration
    decides, now or soon, or the friction. Failing these the block's place and its walls fix the
    order of calculation, so that a mirror image gives the mirrored result.
    """
    motion, t = state.motion, state.t
    toward = ground.acceleration(base.horizontal, t)
    if abs(toward) <= series.NOISE[Kind.FORCE]:
        toward = ground.acceleration_after(base.horizontal, t)
    off = motion.x if abs(motion.x) > series.NOISE[Kind.POSITION] else 0.0
    left, right = block.left, block.right
    room = left.gap - right.gap if left.gap != right.gap else 0.0
    for one in (toward, -motion.vx, off, room, right.arm - left.arm):
        if one != 0.0:
            return 1 if one > 0.0 else -1
    return 0


@inner_kernel
def hangs_flat(mode):
    """Whether the floor pulls at a flat block at rest that no wall touches.

    The floor then falls away faster than g.
    """
    return rests(mode) and mode.pull < 0 and not on_wall(mode)


@inner_kernel
def _is_possible(block, state, at):
    """Whether the contacts of the mode are closed and its slip agrees with the motion."""
    mode, motion = state.mode, state.motion
    flat, mine = mode.family == Family.FLAT, mode.tip + 2 * mode.far
    off, stands = mode.pivot == Pivot.OFF, mode.pivot == Pivot.STICK
    if not _floor_allows(block, state, flat, mine) or not (off or at.floor):
        return False
    # At rest a flat block is held on all walls that it touches; in flight it leans on both if it
    # fills what is between them.
    if flat and (stands or (off and at.upright_walls == 3)) and mine != at.upright_walls:
        return False
    # Near phi = 0 the far gap goes with phi^2: it lands along that wall, and does not lean on it.
    lies = mine == 2 and motion.theta * motion.theta < contacts.CLOSED
    if not flat and stands and lies:
        return False
    # Along a wall the pivot slips as the block turns.
    v = motion.vx if flat else mode.sense * (at.v if mine == 0 else motion.w)
    return v == 0.0 if stands else off or mode.slip * v >= 0.0


@inner_kernel
def _floor_allows(block, state, flat, mine):
    """Whether the floor and its friction do what the mode asks of them.

    A floor that can only push holds nothing down, any other one never lets go. A block that never
    slips hangs upright only. Friction that winds (Bouc-Wen's) lets the pivot slip, however little,
    unless both walls hold the block, `mine`.
    """
    pivot, pulls = state.mode.pivot, state.mode.pull < 0
    if (pulls and block.unilateral) or (pivot == Pivot.OFF and not block.unilateral):
        return False
    if block.no_slip:
        return pivot != Pivot.SLIPPING and (flat or not pulls)
    return not state.winds or (pivot == Pivot.STICK) == (mine == 3 and not flat)


@inner_kernel
def touched_walls(block, motion, sense, flat):
    """The walls that the block touches, as bits 1 and 2.

    As it tips to `sense`, the tip wall and the far one; of a flat block with sense 1 the left and
    the right wall.
    """
    return (1 if contacts.closed_wall(block, motion, sense, False) else 0) + (
        2 if contacts.closed_wall(block, motion, -sense, not flat) else 0
    )


@inner_kernel
def _clean(block, motion, floor):
    """Sets to zero what differs from it by rounding only.

    That is a tilt, a slip, or the motion of a block that stands on floor and wall.
    """
    contacts.upright(block, motion)
    if floor:
        contacts.stand_if_slow(block, motion)
    if not floor or not block.walls or contacts.lean(motion) == 0.0:
        return
    side = 1 if contacts.lean(motion) > 0.0 else -1
    near = contacts.closed_wall(block, motion, side, False)
    away = contacts.closed_wall(block, motion, -side, True)
    slow = motion.theta != 0.0 and abs(motion.w) < contacts.SLOW
    if (near and away) or (slow and (near or away)):
        contacts.stop(motion)
        contacts.upright(block, motion)


#: What a selection begins with: the side to which the block would rather tip (0: either) and the
#: side that is tried first; whether the block touches the floor, and its slip velocity; the walls
#: that it touches, as bits: flat (left and right), as it tips to the first side, and to the other;
#: and the number of the first candidate to try, and that behind the last one: of an upright block
#: all, of one that tips those of its side.
_Touching = namedtuple("_Touching", "favoured first floor v upright_walls near away begin end")


@inner_kernel
def _touching(block, base, state):
    motion = state.motion
    floor = not block.unilateral or contacts.closed_floor(block, motion)
    _clean(block, motion, floor)
    v, lean = contacts.slip_velocity(block, motion), contacts.lean(motion)
    side = int(math.copysign(1.0, lean)) if lean != 0.0 else favoured(block, base, state)
    first = side or 1
    near = touched_walls(block, motion, first, False)
    if lean != 0.0:
        begin = _TILTS[0] if near else _FREE
        return _Touching(side, first, floor, v, 0, near, 0, begin, _TILTS[-1] + 1)
    walls = touched_walls(block, motion, 1, True)
    away = touched_walls(block, motion, -first, False)
    return _Touching(side, first, floor, v, walls, near, away, 0, _CANDIDATES.shape[1])


@called_kernel
def select(block, base, run):
    """Writes the consistent mode into the state, or the one that is violated least.

    False where the state is not finite.
    """
    state, mode = run.state, run.state.mode
    state.began = state.t
    at = _touching(block, base, state)
    least, chosen = np.inf, -1
    for search in (Search.FITS, Search.UNTRIED, Search.TRIED):
        violation, number = _least_violated(block, base, run, at, search)
        if violation == 0.0:
            # One that goes on, since what ended it was noise, is allowed twice that: else the same
            # noise would end it again and again.
            state.slack = 2.0 if code_of(mode) == state.ended else 1.0
            state.rules[Rule.HANGS] += hangs_flat(mode)
            return True
        if violation < least:
            least, chosen = violation, number
    if chosen < 0:
        return False
    state.mode = _CANDIDATES[at.first, chosen]
    again = least <= state.least_slack
    state.rules[Rule.MODE_AGAIN if again else Rule.LEAST_CONTRADICTION] += 1
    relax_tolerance(state)
    state.slack = max(least, state.slack)
    return True


@inner_kernel
def _least_violated(block, base, run, at, search):
    """The slack of the candidate that is violated least, and its number.

    The first one that fits is left in the state.
    """
    least, best = np.inf, -1
    for number in range(at.begin, at.end):
        if least == 0.0:
            break
        if _is_candidate(block, run.state, at, number, search == Search.TRIED):
            violation = constraint_violation(block, base, run, search != Search.FITS)
            violation = max(violation, run.state.least_slack if search == Search.TRIED else 0.0)
            if violation < least:
                least, best = violation, number
    return least, best


@inner_kernel
def _is_candidate(block, state, at, number, again):
    """Writes a candidate, if the walls that it leans on are touched.

    Returns whether it is possible, and has been tried at this instant (`again`) or not.
    """
    mode = _CANDIDATES[at.first, number]
    tilts = mode.family == Family.TILT
    touched = (at.near if mode.sense == at.first else at.away) if tilts else at.upright_walls
    if (mode.tip + 2 * mode.far) & ~touched or (tilts and at.favoured == 0):
        # Where nothing tells left from right it does not tilt.
        return False
    state.mode = mode
    tried = state.tried[code_of(mode)] != 0
    return tried == again and _is_possible(block, state, at)
