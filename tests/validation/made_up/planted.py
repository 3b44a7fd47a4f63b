"""The reference model with a fault planted in it: what the shipped suites have to notice.

A fault is of the scene that is played, or of the history that is returned.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Event, Frozen, History, Record, Rest, Scene

#: Each changes the scene that is played.
Of_scene = Callable[[Scene], Scene]
#: Each changes the history that is returned; the scene says what was to be played.
Of_history = Callable[[History, Scene], History]


# Faults of the scene


def inertia(scene: Scene) -> Scene:
    """The moment of inertia 0.1 % too large."""
    block = scene.block
    moment = 1.001 * block.gyration_squared * (block.mass or 1.0)
    return scene.replace(block=block.replace(moment_of_inertia=moment))


def height(scene: Scene) -> Scene:
    """The block 0.1 % too high."""
    block = Block(
        half_width=scene.block.half_width,
        half_height=1.001 * scene.block.half_height,
        mass=scene.block.mass,
    )
    return scene.replace(block=block)


def friction(scene: Scene) -> Scene:
    """The coefficient of friction 0.1 % too large."""
    return scene.replace(floor=scene.floor.replace(friction=1.001 * scene.floor.friction))


def floor_restitution(scene: Scene) -> Scene:
    """The floor's restitution 0.01 too large."""
    return scene.replace(floor=scene.floor.replace(restitution=scene.floor.restitution + 0.01))


def gap(scene: Scene) -> Scene:
    """Each wall 0.1 mm too far away."""
    walls = [wall.replace(gap=wall.gap + 1e-4) for wall in scene.walls]
    return scene.replace(walls=tuple(walls))


def wall_restitution(scene: Scene) -> Scene:
    """Each wall's restitution 1 % too small."""
    walls = [wall.replace(restitution=0.99 * wall.restitution) for wall in scene.walls]
    return scene.replace(walls=tuple(walls))


def wall_side(scene: Scene) -> Scene:
    """The walls on the other side."""
    return scene.replace(walls=scene.mirrored().walls)


def no_wall(scene: Scene) -> Scene:
    """The walls forgotten."""
    return scene.replace(walls=())


def no_vertical(scene: Scene) -> Scene:
    """The base's vertical motion dropped."""
    return scene.replace(vertical=Rest())


def vertical_sign(scene: Scene) -> Scene:
    """The base's vertical motion upside down."""
    return scene.replace(vertical=scene.vertical.scaled(-1.0))


def base_scale(scene: Scene) -> Scene:
    """The base's motion 0.1 % too strong."""
    return scene.replace(excitation=scene.excitation.scaled(1.001))


def base_held(scene: Scene) -> Scene:
    """The base's acceleration held for 5 ms, as by a loop that reads it once in so long."""
    fine, held = 1e-4, 5e-3
    times = np.arange(0.0, scene.duration, fine)
    last_read = held * np.floor(times / held + 1e-9)
    motions = {
        name: Record.from_samples(motion.acceleration(last_read), fine)
        for name, motion in (("excitation", scene.excitation), ("vertical", scene.vertical))
        if motion.kind != "rest"
    }
    return scene.replace(**motions)


def last_sample(scene: Scene) -> Scene:
    """The last sample of a record dropped."""
    motion = scene.excitation
    if not isinstance(motion, Record):
        return scene
    return scene.replace(excitation=motion.replace(unscaled=motion.unscaled[:-1]))


# Faults of the history


def _with(history: History, **columns: Any) -> History:
    return replace(history, channels={**history.channels, **columns})


def scaled(history: History, scene: Scene, *, column: str, factor: float) -> History:
    """A column times a factor."""
    return _with(history, **{column: factor * history.channels[column]})


def shifted(history: History, scene: Scene, *, column: str, distance: float) -> History:
    """A column off by a distance."""
    return _with(history, **{column: history.channels[column] + distance})


def noise(history: History, scene: Scene, *, size: float) -> History:
    """White noise on the rotation, `size` in rad."""
    drawn = size * np.random.default_rng(1).standard_normal(len(history.channels["t"]))
    return _with(history, theta=history.channels["theta"] + drawn)


def wrong_sign(history: History, scene: Scene) -> History:
    """The rotation's sign, clockwise positive."""
    names = ("theta", "theta_dot")
    return _with(history, **{name: -history.channels[name] for name in names})


def of_a_corner(history: History, scene: Scene) -> History:
    """The place of the pivot corner in place of the centre's."""
    return _with(history, x=history.channels["slip"])


def late(history: History, scene: Scene, *, delay: float) -> History:
    """Everything `delay` s late; what was first stands until then."""
    t = history.channels["t"]
    columns = {
        name: np.interp(t - delay, t, column)
        for name, column in history.channels.items()
        if name not in ("t", "mode")
    }
    events = tuple(replace(event, t=event.t + delay) for event in history.event_list)
    return replace(_with(history, **columns), event_list=events)


def short(history: History, scene: Scene) -> History:
    """The last tenth of the history missing."""
    rows = len(history.channels["t"]) * 9 // 10
    columns = {name: column[:rows] for name, column in history.channels.items()}
    return replace(history, channels=columns)


def events_late(history: History, scene: Scene) -> History:
    """The times of events 15 ms late, the motion right."""
    events = tuple(replace(event, t=event.t + 0.015) for event in history.event_list)
    return replace(history, event_list=events)


def no_events(history: History, scene: Scene) -> History:
    """No event at all."""
    return replace(history, event_list=())


def _is_impact(event: Event) -> bool:
    return event.kind in ("floor impact", "wall impact")


def lost_impact(history: History, scene: Scene) -> History:
    """The strongest impact left out."""
    impacts = [event for event in history.event_list if _is_impact(event)]
    strongest = max(impacts, key=lambda event: abs(event.impulse), default=None)
    events = tuple(event for event in history.event_list if event is not strongest)
    return replace(history, event_list=events)


def impulses(history: History, scene: Scene, *, factor: float) -> History:
    """The impulses times a factor."""
    events = tuple(replace(event, impulse=factor * event.impulse) for event in history.event_list)
    return replace(history, event_list=events)


def kinds(history: History, scene: Scene) -> History:
    """Wall impacts told as floor impacts, and floor impacts as wall impacts."""
    other = {"floor impact": "wall impact", "wall impact": "floor impact"}
    events = tuple(
        replace(event, kind=other.get(event.kind, event.kind)) for event in history.event_list
    )
    return replace(history, event_list=events)


OF_SCENE: dict[str, Of_scene] = {
    "g off by 3e-4": lambda scene: scene.replace(gravity=(1.0 + 3e-4) * scene.gravity),
    "friction off by 1e-3": friction,
    "height off by 1e-3": height,
    "inertia off by 1e-3": inertia,
    "base motion off by 1e-3": base_scale,
    "base held for 5 ms": base_held,
    "last sample of a record dropped": last_sample,
    "vertical base motion dropped": no_vertical,
    "vertical base motion upside down": vertical_sign,
    "gap off by 0.1 mm": gap,
    "wall restitution off by 1 %": wall_restitution,
    "wall on the other side": wall_side,
    "wall forgotten": no_wall,
    "floor restitution off by 0.01": floor_restitution,
}
OF_HISTORY: dict[str, Of_history] = {
    "rotation's sign": wrong_sign,
    "rotation off by 1e-3": partial(scaled, column="theta", factor=1.001),
    "rotation rate 10 % too large": partial(scaled, column="theta_dot", factor=1.1),
    "horizontal velocity 10 % too large": partial(scaled, column="x_dot", factor=1.1),
    "vertical velocity 10 % too large": partial(scaled, column="y_dot", factor=1.1),
    "vertical velocity's sign": partial(scaled, column="y_dot", factor=-1.0),
    "slip rate 10 % too large": partial(scaled, column="slip_rate", factor=1.1),
    "slip 1 % too large": partial(scaled, column="slip", factor=1.01),
    "x of a corner": of_a_corner,
    "x off by 1 mm": partial(shifted, column="x", distance=1e-3),
    "y off by 1 mm": partial(shifted, column="y", distance=1e-3),
    "half a millisecond late": partial(late, delay=5e-4),
    "a row late": partial(late, delay=5e-3),
    "last tenth missing": short,
    "no events at all": no_events,
    "strongest impact lost": lost_impact,
    "event times 15 ms late": events_late,
    "walls and floor exchanged in events": kinds,
    "impulses halved": partial(impulses, factor=0.5),
    "impulses of the other sign": partial(impulses, factor=-1.0),
    "noise of 1e-5 rad": partial(noise, size=1e-5),
    "noise of 1e-6 rad": partial(noise, size=1e-6),
}
#: Where the laws of impacts part, the answer of another one.
OTHER_LAW = "the other law of impacts"
FAULTS = (*OF_SCENE, *OF_HISTORY, OTHER_LAW)
#: What is below the suites' own tolerances, and not to be noticed.
BELOW_TOLERANCE = ("noise of 1e-6 rad",)
#: What the other suite does not notice, in the place of any model.
ONLY_BY_PAPER = {"floor restitution off by 0.01"}
ONLY_BY_SMOKE = {
    "last sample of a record dropped",
    "vertical base motion dropped",
    "vertical base motion upside down",
    OTHER_LAW,
}


class Planted(Frozen):
    """The reference with the fault of this name; "" for none."""

    fault: str = ""

    def simulate(self, scene: Scene) -> History:
        changed = OF_SCENE[self.fault](scene) if self.fault in OF_SCENE else scene
        model = EventBasedModel(pivot="unilateral")
        if self.fault == OTHER_LAW:
            model = model.model_copy(update={"impacts": "floor-first"})
        history = replace(model.simulate(changed), name=scene.name, block=scene.block.per_unit_mass)
        return OF_HISTORY[self.fault](history, scene) if self.fault in OF_HISTORY else history
