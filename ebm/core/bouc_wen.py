"""The model `ebm-bouc-wen`: the bilateral pivot with the paper's regularised friction (9).

The floor's friction force on the pivot is Q = -mu_k |P| z. The hysteretic variable z replaces the
sign of the slip velocity V and follows it over the yield displacement u_y:

    z' = (-gamma |V| z |z|^(n-1) - beta V |z|^n + V) / u_y,    beta = gamma = 1/2, n = 2,

that is z' = V (1 - z^2)/u_y while the pivot *loads* (V z > 0) and z' = V/u_y while it unloads. A
pivot that sticks is thus a stiff undamped spring, and after some u_y of slip z = +-1, which is an
invariant state: the pivot has *yielded* and slips as in (7), (8) until V = 0. So the equation,
stiff as it looks (eigenvalue -2 |V|/u_y), is smooth between the instants at which V or z changes
sign, and needs no stiff integrator: Taylor steps stop there, and hold z once it has come within the
tolerance of +-1. Q takes part in the series of `ebm.core.motion`; z coming to the sense of slip is
a guard. Everything else (modes, guards, impacts, natural units) is the exact model's.

What (9) leaves open: where the pivot has stood, friction begins as Coulomb's, z being the share
that it takes, so that a block at rest uplifts or slides exactly when it should. Impacts are the
paper's, with their own stick and slip; they change velocities only, so that z goes on through them.
"slip" and "stick" events, and the modes, tell a yielded pivot (SLIDE-ROCK, LADDER) from one that
has not (ROCK, LEAN).
"""

import math

from rockcheck.ebm.core import contacts, coulomb, ground, modes, series
from rockcheck.ebm.core.motion import mode_series
from rockcheck.ebm.core.names import Ending, Event, Family, Guard, Kind, Pivot, Row
from rockcheck.ebm.core.state import mode_code, note
from rockcheck.scenes.compiled import called_kernel, inner_kernel

# z counts as yielded where 1 - abs(z) < this multiple of max(tolerance, rounding).
_NEARLY = 10.0


@inner_kernel
def expand(block, base, run, reach):
    """Series of the motion: their order, the place of the pivot, and the step they are good for."""
    state, mode, a, last = run.state, run.state.mode, run.a, run.state.last_term_rad
    order = state.order = mode_series(block, base, run, series.ORDER, 0.0, reach)
    h = series.step_size(a, Row.U, Row.G, order - 1, last, reach)
    if mode.pivot == Pivot.SLIPPING:
        if state.winds:
            h = series.force_step(a, Row.Z, order - 1, state.tolerance_rad, h)
        h = series.step_size(a, Row.XI, Row.XI, order - 1, last, h)
        if mode.family == Family.TILT:
            h = series.step_size(a, Row.PHI, Row.COS, order, last, h)
    state.length = h


#: The first event of the step. One more guard: z comes to the sense of slip.
locate = coulomb.locate


@inner_kernel
def advance(run):
    """Moves z to the end of a step. Where it has come to +-1 the pivot has yielded."""
    state, mode = run.state, run.state.mode
    if mode.pivot != Pivot.SLIPPING or not state.winds:
        return
    sense = mode.sense * mode.slip
    state.zeta = mode.sense * series.value(run.a, Row.Z, state.order - 1, state.tau)
    near = _NEARLY * max(state.tolerance_rad, series.NOISE[Kind.POSITION])
    if 1.0 - sense * state.zeta < min(near, 1.0):
        before = mode_code(state)
        state.zeta, state.winds = float(sense), False
        note(run, Event.SLIPS, before)


@called_kernel
def after_event(block, base, run):
    """The mode that follows an event, or the start; notes the event.

    Where the pivot has stood, friction begins as Coulomb's: so does the mode, and z is the share
    that it takes. Through all else z goes on.
    """
    state, mode, motion, which = run.state, run.state.mode, run.state.motion, run.state.guard
    if which == Guard.LOADS or (which == Guard.SLIP and mode.family == Family.TILT):
        _turn(run)
        return
    contacts.upright(block, motion)
    contacts.stand_if_slow(block, motion)
    stands = contacts.lean(motion) == 0.0 and (motion.vx == 0.0 or which == Guard.SLIP)
    begins = stands or math.isnan(state.zeta)
    state.winds = not begins
    if stands:
        # As the push of the floor ends, friction fails: what moves in between is rounding.
        state.t = ground.weightless_at(base.vertical, state.t)
    coulomb.follow(block, base, run)
    slides = mode.family == Family.FLAT and mode.pivot == Pivot.SLIPPING
    if begins and not (slides and which == Guard.SLIP):
        state.zeta = _share(block, run)
    state.winds = True
    if begins and mode.family == Family.TILT and not modes.select(block, base, run):
        state.ending = Ending.NOT_FINITE
    state.winds = mode.pivot != Pivot.SLIPPING or mode.sense * mode.slip * state.zeta != 1.0
    coulomb.tell(run)


@inner_kernel
def _share(block, run):
    """The share z of the friction that the selected mode has with Coulomb's law."""
    mode, held = run.state.mode, -run.state.mode.sense * run.a[Row.Q, 0]
    if mode.pivot == Pivot.SLIPPING:
        return float(mode.sense * mode.slip)
    return held / max(block.mu_k * abs(run.a[Row.P, 0]), abs(held), contacts.SLOW)


@inner_kernel
def _turn(run):
    """The pivot slips back, or begins to load as z comes to the sense of slip.

    At one instant each further event doubles the slack, as in a selection (ebm.core.modes).
    """
    state = run.state
    modes.relax_tolerance(state)
    if state.guard == Guard.SLIP:
        yielded = not state.winds
        state.winds, state.mode.slip = True, -state.mode.slip
        if yielded:
            note(run, Event.STICKS, state.before)
