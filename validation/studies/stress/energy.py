"""The balance of energy: between events to rounding, and over a whole run.

In: `Motion`. Out: the largest energy that nothing accounts for. Called by `checks`, `players` and
`maps`.
"""

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    Floats,
    History,
    Scene,
)
from rockcheck.validation.studies.stress.conditions import largest, none_between
from rockcheck.validation.studies.stress.forces import Mask
from rockcheck.validation.studies.stress.motion import Motion

#: Weights of the closed Newton-Cotes rule with nine nodes, which is exact up to degree 9.
NEWTON_COTES = (
    np.array([989.0, 5888.0, -928.0, 10496.0, -4540.0, 10496.0, -928.0, 5888.0, 989.0])
    * 4.0
    / 14175.0
)
GROUP = len(NEWTON_COTES) - 1
#: The same interval by Boole's rule twice, exact up to degree 5. The difference of the two rules
#: estimates the error.
BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 14.0, 32.0, 12.0, 32.0, 7.0]) * 2.0 / 45.0
#: An integral is used where rules of order 6 and 10 agree to this, relatively: the error of order
#: 10 is then far smaller.
RESOLVED = 1e-10


def integrals(step: float, values: Floats, rule: Floats = NEWTON_COTES) -> Floats:
    """Integrals of `values`, at multiples of `step`, over each group of eight steps.

    Steps beyond the last whole group are left out.
    """
    groups = (len(values) - 1) // GROUP
    nodes = values[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return np.asarray(step * (nodes @ rule))


def energy_error(model: EventBasedModel, motion: Motion) -> float | None:
    """Largest change of energy that the work of base and friction does not account for.

    The change is over eight rows without event or kink, relative to the energy and the work at play
    in the run, at least g R. Where friction is not known (Bouc-Wen): the gain of energy beyond the
    work of the base and what the friction spring can hold. None where no eight rows can be judged:
    the history has fewer, events or kinks lie in all of them, or the work is not resolved in any.
    """
    scene, radius, vg = motion.scene, motion.radius, motion.vertical
    energy = motion.energy / (scene.gravity * radius)
    speed = radius / motion.unit
    power = -(motion.u * motion.across + vg * motion.up) / speed
    if model.friction != "bouc-wen":  # the floor's friction, too
        along, mu = motion.sign * motion.slip, scene.floor.friction
        power = power - np.where(motion.within("slide"), mu * np.abs(1.0 + vg) * np.abs(along), 0.0)
        tilted = motion.within("slide-rock", "ladder")
        forces, _ = motion.forces(tilted, np.where(along >= 0.0, 1.0, -1.0))
        power[tilted] += forces[1] * along[tilted]
    whole, quiet = _whole_groups(scene, motion.history)
    step = scene.output_step / motion.unit
    work, moved = integrals(step, power), integrals(step, np.abs(power))
    before, after = energy[:-1:GROUP][: len(work)], energy[GROUP::GROUP][: len(work)]
    size = 1.0 + np.maximum(after, moved)
    off = (after - before - work) / size
    doubt = np.where(whole, np.abs(work - integrals(step, power, BOOLE)) / size, 0.0)
    # Checked in the groups before and after, too: the difference of the two rules says nothing
    # where it changes its sign.
    beside = np.append(doubt[1:], 0.0), np.append(0.0, doubt[:-1])
    whole &= np.maximum(doubt, np.maximum(*beside)) < RESOLVED
    if model.friction == "bouc-wen":
        # Of `up`, per row; with gravity it is the floor's force.
        rise = np.abs(np.diff(motion.up)) / speed / step
        force = 2.0 + np.max(np.abs(vg)) + rise[: len(work) * GROUP].reshape(-1, GROUP).max(axis=1)
        held = scene.floor.friction * model.yield_displacement / radius * force
        return largest(off - held / size, whole) if whole.any() else None
    whole &= quiet
    return largest(np.abs(off), whole) if whole.any() else None


def energy_without_source(motion: Motion) -> float:
    """Largest energy beyond the initial one and the work of the base, relative to that at play.

    At play are g R, the initial energy and all work done by then.

    The base's acceleration acts on the block as a force. Its work between two rows is its impulse
    times the mean of the velocities before and after. It is exact however the acceleration changes
    between the rows (a record can be finer than they are) where the block stands, and where nothing
    but the base changes its velocity.
    """
    scene, energy, t = motion.scene, motion.energy, motion.channels["t"]
    work, moved = np.zeros(len(energy)), np.zeros(len(energy))
    for excitation, velocity in (
        (scene.excitation, motion.across),
        (scene.vertical, motion.up),
    ):
        # The velocity of the base: the integral, exact for a record, which is linear between its
        # samples; on both sides of a jump.
        times = t
        if excitation.jumps:
            kinks = np.array([*excitation.kinks, *np.nextafter(excitation.jumps, np.inf)])
            times = np.union1d(t, kinks[kinks < t[-1]])
        acceleration = excitation.acceleration(times)
        base_velocity = np.cumsum(0.5 * np.diff(times) * (acceleration[1:] + acceleration[:-1]))
        impulse = -np.diff(np.append(0.0, base_velocity)[np.searchsorted(times, t)])
        increments = 0.5 * (velocity[1:] + velocity[:-1]) * impulse
        work[1:] += np.cumsum(increments)
        moved[1:] += np.cumsum(np.abs(increments))
    size = scene.gravity * motion.radius + np.abs(energy[0]) + moved
    return float(np.max((energy - energy[0] - work) / size))


def _whole_groups(scene: Scene, history: History) -> tuple[Mask, Mask]:
    """Which groups of eight steps have no event or kink inside; which have one mode in all rows."""
    t, mode = history.channels["t"], history.channels["mode"]
    groups = (len(t) - 1) // GROUP
    edges = t[: groups * GROUP + 1 : GROUP]
    events = [event.t for event in history.event_list]
    bases = scene.excitation, scene.vertical
    kinks = [time for base in bases for time in (*base.kinks, base.quiet_after)]
    jumps = [time for base in bases for time in base.jumps]
    near = 1e-9 * scene.output_step

    # An event at an edge itself: the row there is from before or after it. The base acceleration
    # jumps where some motions end.
    whole = none_between([*events, *kinks], edges[:-1] + near, edges[1:] - near) & none_between(
        [*events, *jumps],
        edges[:-1] - 1e3 * near,
        edges[1:] + 1e3 * near,
    )
    nodes = mode[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return whole, np.all(nodes == nodes[:, :1], axis=1)
