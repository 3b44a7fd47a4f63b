"""Which mode follows an event: the one in which every guard leaves zero upward.

A mode is consistent as long as its guards are not negative. As Taylor polynomials they are the
events of a step (their first root) and the test that selects the next mode (the sign with which
they leave zero), so that a selected mode can never end at once. Applied to the bilateral pivot this
selection is the paper's: its rules for uplift and slip (Shenton's map among them), for the tilted
block and for the corner that stays on the wall come out as the one consistent candidate; tests hold
the closed forms against it.

Termination. At one instant a mode is selected once. One that has ended at that instant is selected
again only where no other fits. Then, and where none fits at all, the mode that is wrong by least
goes on with a *slack*: the noise that its guards are allowed. Each further such selection at that
instant doubles the least slack. It soon exceeds all forces, and time goes on.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.contacts import (
    CLOSED,
    SLOW,
    closed_floor,
    closed_wall,
    slip_velocity,
    stand,
    stop,
    upright,
)
from rockcheck.ebm.core.ground import acceleration, acceleration_after, next_kink
from rockcheck.ebm.core.guards import (
    G_FAR_GAP,
    G_PHI,
    G_SLIP,
    GUARDS,
    KIND,
    fill_guards,
    guard,
    seen,
    starts_positive,
)
from rockcheck.ebm.core.motion import (
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    MODE_SIZE,
    OFF,
    PULL,
    SIN,
    SLIP,
    SLIPPING,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    S,
    W,
    X,
    flat_series,
    tilt_series,
)
from rockcheck.ebm.core.rules import HANGS, LEAST_CONTRADICTION, MODE_AGAIN
from rockcheck.ebm.core.series import FORCE, INSTANT, NOISE, WIDTH, contradiction, leading
from rockcheck.scenes.compiled import inner_kernel

#: Order of the series that a selection looks at.
_LOOK = 6
#: Where a base acceleration is zero, its sign is read this much later (samples of a record may be
#: much closer than AHEAD).
SOON = 1e-6
# What a run remembers of the selections at one instant: the mode's slack (in units of noise), the
# least slack of the next mode that does not fit, when the instant began, when the mode was
# selected, and which mode a force has just ended (its code, or -1). A row of flags marks the modes
# that were tried.
SLACK, LEAST_SLACK, SINCE, BEGAN, ENDED = range(5)
MEMORY = 5
MODES = 128


def _candidates() -> np.ndarray:
    """All modes in the order of trial: more contacts first, sticking before slipping, a pushing
    floor before a pulling one.

    Columns: family, sense of tilting or slip, what the pivot does, slip, pull, walls (1 tip or
    left, 2 far or right, 3 both), whether only a flat block tries it. For a flat block all senses
    are relative to that of `tips_first`.
    """
    stands = [(FLAT, 1, STICK, 0, pull, walls, 0) for walls in (3, 1, 2, 0) for pull in (1, -1)]
    # With static friction above kinetic both rocking and sliding can be consistent. Then the pivot
    # sticks.
    rows = [*stands, (TILT, 1, STICK, 0, 1, 0, 1)]
    for family, sense in ((FLAT, 1), (TILT, 1), (TILT, -1)):
        pivot = ((STICK, 0), (SLIPPING, -1), (SLIPPING, 1))
        for walls in (3, 1, 2, 0):
            for pull in (1, -1):
                rows += [
                    (family, sense, floor, slip, pull, walls, 0)
                    for floor, slip in pivot[family == FLAT :]
                ]
            rows.append((family, sense, OFF, 0, 1, walls, 0))
    return np.array(rows)


_CANDIDATES = _candidates()
_FLAT_TRIES = 4


def _tries() -> np.ndarray:
    """The candidates, by number, and then -1: of a tilted block that touches these walls (none, 1,
    2, 3), in the last row of a flat one."""
    family, sense, walls, only_flat = _CANDIDATES[:, [0, 1, 5, 6]].T
    rows = np.full((_FLAT_TRIES + 1, len(_CANDIDATES) + 1), -1, dtype=np.int8)
    rows[_FLAT_TRIES, :-1] = range(len(_CANDIDATES))
    for touched in range(_FLAT_TRIES):
        found = np.flatnonzero(
            (family == TILT) & (sense > 0) & (only_flat == 0) & (walls & ~touched == 0)
        )
        rows[touched, : len(found)] = found
    return rows


_TRIES = _tries()


@inner_kernel
def code_of(m):
    """A number for the mode, below MODES."""
    floor = 3 if m[FLOOR] == OFF else m[SLIP] + 1
    return (
        (((m[FAMILY] * 2 + (m[S] > 0)) * 4 + floor) * 2 + (m[PULL] > 0)) * 4 + m[TIP] + 2 * m[FAR]
    )


@inner_kernel
def forget(tried, memory, t):
    """A new instant begins: no mode has been tried in it."""
    for k in range(MODES):
        tried[k] = False
    memory[SLACK] = memory[LEAST_SLACK] = 1.0
    memory[SINCE], memory[ENDED] = t, -1.0


@inner_kernel
def leave(m, tried, memory, t, kind):
    """Notes that a guard of this kind has ended mode m at time t. If it was a force's, and by
    rounding only, the mode may go on once."""
    if t - memory[SINCE] > INSTANT:
        forget(tried, memory, t)
    tried[code_of(m)] = kind != FORCE or t - memory[BEGAN] <= INSTANT
    memory[ENDED] = code_of(m) if kind == FORCE else -1


@inner_kernel
def slacken(memory):
    """Gives the mode the least slack, and doubles that for the next selection at this instant."""
    memory[SLACK] = memory[LEAST_SLACK]
    memory[LEAST_SLACK] *= 2.0


@inner_kernel
def wrong_by(b, m, z, gh, gv, t, measured, a):
    """0 if mode m can begin at state z, with every guard leaving zero upward; else the slack (in
    units of noise) with which it could.

    Infinite if the mode needs a motion that does not begin, or if that slack is not `measured`:
    only where no mode fits is it asked for.
    """
    look = min(
        _LOOK, WIDTH
    )  # the plain constant would make numba compile all series once more, for it alone
    pivot = 0.0
    if m[FAMILY] == FLAT:
        order = flat_series(b, m, z, gh, gv, t, look, a)
    else:
        order = tilt_series(b, m, z, gh, gv, t, look, 0.0, 0.0, a)
        pivot = m[S] * z[X] - a[SIN, 0]
    fill_guards(b, m, pivot, a)
    smooth = min(next_kink(gh, t), next_kink(gv, t)) - t
    worst = 0.0
    for which in range(GUARDS):
        noise, ahead = NOISE[KIND[which]], seen(KIND[which], smooth)
        if starts_positive(which, ahead, a):
            continue
        degree = guard(which, order, a)
        if which <= G_FAR_GAP and a[GUARD, 1] < -SLOW:
            continue  # a closing contact is the impact handler's
        sign = leading(a, GUARD, degree, noise, ahead)
        if not math.isfinite(a[GUARD, 0]) or (
            sign <= 0 and which == G_PHI and (m[FLOOR] != OFF or sign < 0)
        ):
            return np.inf
        undecided = sign == 0 and which == G_SLIP
        if not measured and (sign < 0 or undecided):
            return np.inf
        if sign < 0:
            worst = max(worst, contradiction(a, GUARD, degree, noise, ahead) / noise)
        elif undecided:
            worst = max(worst, 1.0)
    return worst


@inner_kernel
def _favoured(b, z, gh, t):
    """The side to which a flat block at rest would rather tip, +1 left or -1 right; 0 where the
    scene is its own mirror image.

    Both sides fit only by rounding, or where the floor falls away faster than g under a pivot that
    cannot let go. Then the base acceleration decides, now or soon, or the friction. Failing these
    the block's place and its walls fix the order of calculation, so that a mirror image gives the
    mirrored result.
    """
    toward = acceleration(gh, t)
    if abs(toward) <= NOISE[FORCE]:
        toward = acceleration_after(gh, t)
    if toward == 0.0:
        toward = -z[VX]
    if toward == 0.0 and abs(z[X]) > NOISE[0]:
        toward = z[X]
    if toward == 0.0 and b.gap_left != b.gap_right:
        toward = b.gap_left - b.gap_right
    if toward == 0.0:
        toward = b.right.arm - b.left.arm
    return 0 if toward == 0.0 else (1 if toward > 0.0 else -1)


@inner_kernel
def tips_first(b, z, gh, t):
    """The side to which a flat block is first asked to tip, +1 left or -1 right: the sense in which
    all of it is calculated."""
    return 1 if _favoured(b, z, gh, t) >= 0 else -1


@inner_kernel
def hangs_flat(m):
    """Whether the floor holds a flat block at rest that no wall touches, though it falls away
    faster than g."""
    return m[FAMILY] == FLAT and m[FLOOR] == STICK and m[PULL] < 0 and m[TIP] == 0 and m[FAR] == 0


@inner_kernel
def _write(number, first, m):
    """Writes candidate `number` into m."""
    family, sense, walls = _CANDIDATES[number, 0], _CANDIDATES[number, 1], _CANDIDATES[number, 5]
    m[FAMILY], m[S] = family, 1 if family == FLAT else sense * first
    m[FLOOR], m[SLIP], m[PULL] = (
        _CANDIDATES[number, 2],
        _CANDIDATES[number, 3],
        _CANDIDATES[number, 4],
    )
    m[TIP], m[FAR] = walls & 1, walls >> 1
    if family == FLAT and first < 0:
        m[SLIP] = -m[SLIP]
        m[TIP], m[FAR] = walls >> 1, walls & 1


@inner_kernel
def _possible(b, m, z, v, floor, walls):
    """Whether the contacts of m are closed and its slip agrees with the slip rate v; `walls` are
    the touched ones, as bits."""
    flat, mine = m[FAMILY] == FLAT, m[TIP] + 2 * m[FAR]
    if (not b.unilateral and floor) if m[FLOOR] == OFF else not floor:
        return False
    if (
        m[FLOOR] != OFF
        and m[PULL] < 0
        and (b.unilateral or (b.no_slip and not flat) or (flat and not hangs_flat(m) and mine == 0))
    ):
        return False
    if b.no_slip and m[FLOOR] == SLIPPING:
        return False
    if flat:
        # At rest it is held on the walls that it touches; sliding it touches none; between two
        # walls that it fills it leans on both.
        held = m[FLOOR] == STICK or (m[FLOOR] == OFF and walls == 3)
        if (held and mine != walls) or (m[FLOOR] == SLIPPING and mine != 0):
            return False
        v = z[VX]
    elif m[FLOOR] == STICK and mine == 2 and z[THETA] * z[THETA] < CLOSED:
        # Near phi = 0 the far gap goes with phi^2: it lands along that wall, and does not lean on
        # it.
        return False
    else:
        v = m[S] * (v if mine == 0 else z[W])  # along a wall the pivot slips as the block turns
    return m[FLOOR] == OFF or (v == 0.0 if m[FLOOR] == STICK else m[SLIP] * v >= 0.0)


@inner_kernel
def _touched(b, z, sense, flat):
    """The walls that the block touches, as bits: flat, left and right; else, as it tips to `sense`,
    the tip wall and the far one."""
    if not b.walls:
        return 0
    return (1 if closed_wall(b, z, 1 if flat else sense, False) else 0) + (
        2 if closed_wall(b, z, -1 if flat else -sense, not flat) else 0
    )


@inner_kernel
def _clean(b, z, floor):
    """Sets to zero what differs from it by rounding only: a tilt, a slip, the motion of a block
    that stands on floor and wall."""
    upright(b, z)
    if floor and abs(slip_velocity(b, z)) < SLOW:
        stand(b, z)
    if not floor or not b.walls or (z[THETA] == 0.0 and z[W] == 0.0):
        return
    side = 1 if (z[THETA] if z[THETA] != 0.0 else z[W]) > 0.0 else -1
    near, away = closed_wall(b, z, side, False), closed_wall(b, z, -side, True)
    if (near and away) or (z[THETA] != 0.0 and abs(z[W]) < SLOW and (near or away)):
        stop(z)
        upright(b, z)


@inner_kernel
def select(b, z, gh, gv, t, m, tried, memory, rules, a):
    """Writes the consistent mode at state z into m, or the one that is wrong by least. False where
    the state is not finite."""
    memory[BEGAN] = t
    floor = not b.unilateral or closed_floor(b, z)
    _clean(b, z, floor)
    flat = z[THETA] == 0.0 and z[W] == 0.0
    lean = z[THETA] if z[THETA] != 0.0 else z[W]
    favoured = _favoured(b, z, gh, t) if flat else (1 if lean > 0.0 else -1)
    first = 1 if favoured >= 0 else -1
    upright_walls = _touched(b, z, 1, True) if flat else 0
    near, away = _touched(b, z, first, False), _touched(b, z, -first, False) if flat else 0
    v = slip_velocity(b, z)
    tries = _FLAT_TRIES if flat else near
    least, chosen = np.inf, -1
    for trial in range(
        3
    ):  # one that fits; else that which is wrong by least, among those not tried and those tried
        again = trial == 2
        for place in range(_TRIES.shape[1]):
            number = _TRIES[tries, place]
            if number < 0:
                break
            tilts = _CANDIDATES[number, 0] == TILT
            walls = (near if _CANDIDATES[number, 1] > 0 else away) if tilts else upright_walls
            touched = walls if tilts or first > 0 else walls >> 1 | (walls & 1) << 1
            if _CANDIDATES[number, 5] & ~touched or (tilts and favoured == 0):
                # It does not lean on a wall that it does not touch; where nothing tells left from
                # right it does not tilt.
                continue
            _write(number, first, m)
            if tried[code_of(m)] != again or not _possible(b, m, z, v, floor, walls):
                continue
            wrong = wrong_by(b, m, z, gh, gv, t, trial > 0, a)
            if wrong == 0.0 and not again:
                # One that goes on, since what ended it was noise, is allowed twice that: else the
                # same noise would end it again and again.
                memory[SLACK] = 2.0 if code_of(m) == memory[ENDED] else 1.0
                rules[HANGS] += hangs_flat(m)
                return True
            wrong = max(wrong, memory[LEAST_SLACK] if again else 0.0)
            if wrong < least:
                least, chosen = wrong, number
    if chosen < 0:
        return False
    _write(chosen, first, m)
    rules[MODE_AGAIN if least <= memory[LEAST_SLACK] else LEAST_CONTRADICTION] += 1
    memory[SLACK] = max(least, memory[LEAST_SLACK])
    memory[LEAST_SLACK] *= 2.0
    return True


def mode_vector() -> np.ndarray:
    """An empty mode."""
    return np.zeros(MODE_SIZE, dtype=np.int64)
