"""When the outcome and the peak of a run are certain before its end, for spectra and fates."""

import math

from rockcheck.ebm.core.block import LEAST_FRICTION, arm_of, side_of
from rockcheck.ebm.core.contacts import SLOW
from rockcheck.ebm.core.extremes import has_met, reaches_wall
from rockcheck.ebm.core.ground import acceleration, impulse_ahead, largest_ahead
from rockcheck.ebm.core.names import Ending, Family, Fate, Keep, Kind, Pivot, Shape
from rockcheck.ebm.core.series import NOISE
from rockcheck.ebm.core.state import on_wall, rocks, stands_still
from rockcheck.scenes.compiled import inner_kernel

# A pulse is over when its acceleration is below this share of the tolerance. The second is the
# energy bound's margin where impacts may add energy.
_LEFT, _MARGIN = 1e-3, 0.9
#: Steps of a swing, from one impact to the next.
_STEPS = 4.0
_TINIEST = math.ulp(0.0)
#: How long a run on a quiet base goes on undecided, in 1/p. A block with tan alpha = 0.05, which
#: loses a hundredth of its energy an impact, comes to rest within 700. What moves longer is held up
#: by elastic walls, or slides without friction.
PATIENCE = 1e3


@inner_kernel
def quiet_from(base, tolerance):
    """The time from which the base stands still as far as an outcome can tell."""
    along, upward = base.horizontal.form, base.vertical.form
    if upward.kind == Shape.STILL and along.kind == Shape.GAUSSIAN:
        return along.centre + math.sqrt(-math.log(_LEFT * tolerance) / along.rate)
    return max(along.quiet, upward.quiet)


@inner_kernel
def given_up_at(block, quiet):
    """The time at which a run that is still undecided is given up, by when its base is quiet."""
    squares = block.left.share * block.left.radius, block.right.share * block.right.radius
    return quiet + PATIENCE / math.sqrt(min(squares[0], squares[1]))


@inner_kernel
def fate_of(block, state):
    """What becomes of the block, a Fate, of a run that has ended.

    A block that cannot overturn comes to rest, unless its swings repeat or nothing brakes it.
    """
    ending, motion = state.ending, state.motion
    if ending == Ending.OVERTURNED:
        return Fate.OVERTURNED_LEFT if motion.theta > 0.0 else Fate.OVERTURNED_RIGHT
    if ending == Ending.GIVEN_UP:
        return Fate.UNDECIDED
    if ending != Ending.DONE:
        return Fate.FAILED
    slides_on = block.mu_k == 0.0 and not block.no_slip and abs(motion.vx) > SLOW
    goes_on = state.t >= state.t_end or not state.control.until_decided
    moves = state.repeats or slides_on or goes_on
    return Fate.MOVING if moves and not stands_still(state.mode) else Fate.AT_REST


@inner_kernel
def slides_for_good(block, state):
    """Whether an upright block on a quiet base slides on for ever.

    Nothing brakes it, nothing turns it, and no wall is ahead. How far it gets has no end.
    """
    mode, speed = state.mode, state.motion.vx
    if mode.family != Family.FLAT or mode.pivot != Pivot.SLIPPING or block.mu_k > 0.0:
        return False
    ahead = block.left if speed < 0.0 else block.right
    return ahead.gap == math.inf


@inner_kernel
def decided(block, base, state):
    """The final peak rotation if the rest of the motion is certain, else -1.

    From pi/2 on the block overturns.
    """
    t, quiet, peak, theta = state.t, state.quiet_from, state.peak, state.motion.theta
    still = base.vertical.form.kind == Shape.STILL
    ahead = 0.0
    if t < quiet:
        ahead = impulse_ahead(base.horizontal, t) if still else math.inf
    # At its peak nothing is certain, however little is to come. A floor that bounces adds energy.
    gains = block.e_floor > 0.0 and block.mu_s > LEAST_FRICTION and not block.energy_cap
    uncertain = gains or ahead == math.inf or (ahead > 0.0 and abs(theta) >= peak)
    verdict = -1.0 if uncertain else _by_energy(block, state, ahead)
    if verdict <= 0.0 and still and abs(theta) > side_of(block, theta).alpha:
        verdict = _falls(block, base, state)
    return verdict


@inner_kernel
def _by_energy(block, state, ahead):
    """The peak (pi/2: overturns) that follows from the energy now and still to come, else -1.

    `ahead` bounds the integral of |u| to come, I. The energy E of block and floor, counted from
    standing, grows by no other work: dE/dt <= |u| sqrt(2 E), so that sqrt(2 E) grows by at most I.
    A block that can never reach the energy of standing on its lower corner cannot overturn: it is
    safe once that energy cannot lift it, on either corner, above the peak it has had. After the
    excitation a block that only rocks conserves its energy up to its next impact. So as it rises
    its peak is known, unless with as much it would turn farther on its other corner.
    """
    mode, motion, peak = state.mode, state.motion, state.peak
    phi = abs(motion.theta)
    energy = energy_of(block, motion)
    side, other = side_of(block, mode.sense), side_of(block, -mode.sense)
    corner = min(side.radius, other.radius) - block.height
    most = 0.5 * (math.sqrt(2.0 * max(energy, 0.0)) + ahead) ** 2
    free = (
        ahead == 0.0
        and rocks(mode)
        and not block.walls
        and _sticks(block, block.left, energy)
        and _sticks(block, block.right, energy)
    )
    if not (most < corner and phi < side.alpha):
        falls = phi > side.alpha or energy > side.radius - block.height
        return 0.5 * math.pi if free and falls and mode.sense * motion.w >= 0.0 else -1.0
    highest, beyond = _highest(block, side, most), _highest(block, other, most)
    reached = max(peak, highest)
    if free and mode.sense * motion.w > 0.0 and beyond <= reached:
        return reached
    least = (_MARGIN if block.walls else 1.0) * corner
    return max(peak, _TINIEST) if max(highest, beyond) <= peak and most < least else -1.0


@inner_kernel
def all_is_met(block, state):
    """Whether nothing that a run keeps can change any more.

    So it is where a block on a quiet base only rocks, and sticks as it lands, with too little
    energy to overturn. It conserves that up to each impact, and loses some there. Every corner's
    place is monotone in the rotation to either side: the extremes to come are within those of the
    upright block and of the farthest rotations that the energy allows. No wall is within these.
    """
    mode, motion = state.mode, state.motion
    if state.t < state.quiet_from or not rocks(mode) or block.e_floor > 0.0:
        return False
    side, phi, energy = side_of(block, mode.sense), abs(motion.theta), energy_of(block, motion)
    corner = min(block.left.radius, block.right.radius) - block.height
    free = _sticks(block, block.left, energy) and _sticks(block, block.right, energy)
    if not (free and energy < corner and phi < side.alpha):
        return False
    upright = motion.x + mode.sense * (side.arm - arm_of(side, phi))
    left, right = _highest(block, block.left, energy), _highest(block, block.right, energy)
    at_left = upright - block.left.arm + arm_of(block.left, left)
    at_right = upright + block.right.arm - arm_of(block.right, right)
    return (
        _changes_nothing(block, state, upright, 0.0)
        and _changes_nothing(block, state, at_left, left)
        and _changes_nothing(block, state, at_right, -right)
    )


@inner_kernel
def _changes_nothing(block, state, x, theta):
    """Whether nothing kept changes where an upright or rocking block gets to this place."""
    if reaches_wall(block, x, theta):
        return False
    return state.control.keeps != Keep.EXTREMES or has_met(block, state.extremes, x, theta)


@inner_kernel
def energy_of(block, motion):
    """The block's energy relative to the floor, counted from standing."""
    return (
        0.5 * (motion.vx * motion.vx + motion.vy * motion.vy + motion.w * motion.w / block.spin)
        + motion.y
        - block.height
    )


@inner_kernel
def swings_again(state, energy):
    """Whether this swing repeats the last one: then all to come do, too.

    The swing has turned back in this step, with this energy. After the excitation the energy
    and the place of the pivot are all that a swing depends on. Beside a wall that takes no energy a
    block may rock so for ever, however near its balance it turns back. A swing counts only where
    the pivot sticks to the floor and the block touches no wall.
    """
    mode = state.mode
    if state.t < state.quiet_from or mode.pivot != Pivot.STICK or on_wall(mode):
        return False
    place = mode.sense * state.place
    error = swing_error(state.tolerance_rad)
    again = (
        abs(energy - state.swing_energy) <= error * math.sqrt(2.0 * max(energy, 0.0))
        and abs(place - state.swing_place) <= error
    )
    state.swing_energy, state.swing_place = energy, place
    return again


@inner_kernel
def swing_error(tolerance):
    """The error of rotation and speed after a swing: a step errs by the tolerance, or by rounding.

    Energy errs by that times the speed.
    """
    return _STEPS * (tolerance + NOISE[Kind.POSITION])


@inner_kernel
def _highest(block, side, energy):
    """The rotation on this side to which this energy lifts the block."""
    return side.alpha - math.acos(min((block.height + energy) / side.radius, 1.0))


@inner_kernel
def _falls(block, base, state):
    """pi/2 if a block past its balance point falls whatever the excitation does, else -1.

    Turning outward, beyond tan(phi - alpha) > mu and > |u| for all time to come, it is accelerated
    outward in every mode: sticking by (3), slipping by (7), by an impulse of the floor, or not at
    all in flight. Beside walls nothing is said: that behind it may turn a block back that slips.
    """
    mode, motion, t = state.mode, state.motion, state.t
    side = side_of(block, mode.sense)
    if mode.family == Family.FLAT or mode.sense * motion.w < 0.0 or block.walls:
        return -1.0
    steepness = math.tan(abs(motion.theta) - side.alpha)
    strongest = max(abs(acceleration(base.horizontal, t)), largest_ahead(base.horizontal, t))
    falls = steepness > strongest and (block.no_slip or steepness > block.mu_s)
    return 0.5 * math.pi if falls else -1.0


@inner_kernel
def _sticks(block, side, energy):
    """Whether this pivot sticks as the block rocks about it with this energy, and lands on it.

    That is up to its balance point.

    With k = 1/(I + R^2): |Q| <= max(k s c, s w^2) and P >= 1 - k s^2 - R w^2, with w^2 <= 2 k
    energy; the landing sticks if mu >= k s c/(1 - k s^2), for a homogeneous block 3 t/(4 + t^2), t
    = tan alpha.
    """
    s, c = side.arm, block.height
    square = 2.0 * side.share * energy
    push = 1.0 - side.share * s * s - side.radius * square
    # s c rises with s only up to 45 degrees.
    pull = side.share * (s * c if side.alpha < 0.25 * math.pi else 0.5 * side.radius * side.radius)
    lands = side.share * s * c / (1.0 - side.share * s * s)
    holds = push > 0.0 and block.mu_s * push >= max(pull, s * square) and block.mu_s >= lands
    return block.no_slip or holds
