"""Coulomb's friction behind its four doors: `expand`, `locate`, `advance` and `after_event`.

How to add a law of friction: a module beside this one, with the same doors.

- `expand`: the series PHI to Q of the mode, in the pivot's frame (see `ebm.core.motion`); in the
  state `order`, `place` and `length`.
- `locate`: `tau` and `guard`. `fill_guards`, then `drop` for the cone and slip guards that the law
  has not, then `first_event`.
- `advance`: the law's own variable at the end of the step; a field of STATE, set by `march.begin`.
- `after_event`, at the start, after an impact and after a guard: the mode that follows (`follow`),
  and the event (`tell`).

Friction that is known with the motion stands in `motion.friction`; what a mode may be, in
`modes._floor_allows`.

Its constants stand in SETTING (`ebm.natural.setting_of`). Impacts have Coulomb's friction, mu_s and
mu_k of SETTING: say what these are. Its loop is a `play` in `ebm.core.march` and a line in `LOOPS`;
then `EventBasedModel` (`friction`, `name`, `check`, `decides`), a family in
`validation.execute.models` and a look in `reports.style`, `rockcheck warm`, and the players of the
stress study. `tests/ebm/test_another_method.py` shows how it is tested: scipy's integration.
"""

from rockcheck.ebm.core import contacts, guards, modes, series
from rockcheck.ebm.core.motion import mode_series
from rockcheck.ebm.core.names import Ending, Event, Family, Guard, HistoryMode, Kind, Row, Shape
from rockcheck.ebm.core.state import code_of, mode_code, note, on_wall, rocks
from rockcheck.scenes.compiled import inner_kernel

#: Largest ratio of successive steps; where a block rattles, short steps need few terms.
_FARTHER = 8.0


@inner_kernel
def expand(block, base, run, reach):
    """Series of the mode's motion: order, place of a sticking pivot, and length of the step."""
    state, mode, motion, a = run.state, run.state.mode, run.state.motion, run.a
    reach = min(reach, _FARTHER * state.stride)
    # The tolerance is relative to a motion that is still tiny, since it may grow.
    enough = 0.01 * state.tolerance_rad * min(1.0, 1e2 * (abs(motion.theta) + abs(motion.w)))
    order = state.order = mode_series(block, base, run, series.ORDER, enough, reach)
    state.length = reach
    if order < series.ORDER:
        return
    tilts, free = mode.family == Family.TILT, rocks(mode)
    last = before = 0.0
    for one, other, counts in (
        (Row.PHI, Row.COS, tilts),
        (Row.XI, Row.Y, tilts and not free),
        # Forces follow the base acceleration.
        (Row.U, Row.G, not free or base.vertical.form.kind != Shape.STILL),
    ):
        if counts:
            last = max(last, series.size_of(a, one, other, order))
            before = max(before, series.size_of(a, one, other, order - 1))
    state.length = series.longest_step(last, before, order, state.last_term_rad, reach)


@inner_kernel
def locate(block, run):
    """The first time within the step at which a guard ends the mode, and which."""
    state, mode, h = run.state, run.state.mode, run.state.length
    if rocks(mode) and mode.pull > 0 and guards.rock_guards_hold(block, run):
        noise = min(state.slack * series.NOISE[Kind.POSITION], contacts.CLOSED)
        tau = series.first_root(run.a, Row.PHI, state.order, h, h, noise, series.AHEAD, run.stack)
        none = tau == series.NO_ROOT
        state.tau, state.guard = h if none else tau, (Guard.NONE if none else Guard.PHI)
        return
    guards.fill_guards(block, run.state, run.a)
    guards.first_event(run)


@inner_kernel
def advance(run):
    """Nothing but the motion: friction has no state of its own."""


@inner_kernel
def after_event(block, base, run):
    """Selects the mode that follows, and notes the event unless the mode goes on."""
    state = run.state
    if not state.known:
        follow(block, base, run)
    state.known = False
    tell(run)


@inner_kernel
def follow(block, base, run):
    """Selects the mode that follows; the event is UNTOLD where the mode goes on."""
    state, ended = run.state, code_of(run.state.mode)
    if state.guard > Guard.FAR_GAP:
        state.event = Event.STICKS if state.guard == Guard.SLIP else Event.RELEASE
    if state.event == Event.STICKS:
        if on_wall(state.mode):
            contacts.stop(state.motion)
        contacts.stand(block, state.motion)
    if not modes.select(block, base, run):
        state.ending, state.event = Ending.NOT_FINITE, Event.UNTOLD
    elif state.event == Event.RELEASE and code_of(state.mode) == ended:
        state.event = Event.UNTOLD


@inner_kernel
def tell(run):
    """Notes the state's event, and one more where an impact ends in rest."""
    state, event, now = run.state, run.state.event, mode_code(run.state)
    if event == Event.RELEASE:
        event = _change(state.before, now)
    if event == Event.UNTOLD:
        return
    note(run, event, state.before)
    state.impulse = 0.0
    impact = event == Event.FLOOR_IMPACT or event == Event.WALL_IMPACT or event == Event.LANDS
    if impact and now == HistoryMode.REST and run.records.log.shape[0] > state.events:
        note(run, Event.SETTLED, state.before)


@inner_kernel
def _change(before, now):
    """The event of a change without impact, by the modes before and after it, as they are shown."""
    if before == HistoryMode.REST and now == HistoryMode.REST:
        return Event.UNTOLD
    if before == HistoryMode.FLIGHT:
        return Event.RELEASE
    if now == HistoryMode.FLIGHT:
        return Event.LIFT_OFF
    if before <= HistoryMode.SLIDE and now > HistoryMode.SLIDE:
        return Event.UPLIFT
    return Event.SLIPS if before % 2 == 0 and now % 2 == 1 else Event.RELEASE
