"""The event-based models: `ebm`, `ebm-unilateral` and `ebm-bouc-wen`."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, Strict

from rockcheck.ebm.core.rules import NAMES
from rockcheck.scenes.base import Frozen, Positive
from rockcheck.scenes.errors import InputError, ModelFailure, check_kind
from rockcheck.scenes.history import Cost, Event, History
from rockcheck.scenes.observation import observe
from rockcheck.scenes.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rockcheck.ebm.core.march import Tally


#: The finest tolerance.
FINEST = 1e-15


#: The laws of impacts at several contacts at once (see ebm.core.laws.contact_impacts).
ImpactLaw = Literal["moreau", "closed", "open", "floor-first", "leading-first", "trailing-first"]


class EventBasedModel(Frozen):
    """The paper's Event-Based Model and its extensions.

    `tolerance` bounds the local truncation error of each Taylor step: of a rotation in alpha, of a
    length in alpha R. `pivot`: "bilateral" is the paper's model, in which the pivot never leaves
    the floor; "unilateral" lets the floor only push, so that the block may hop. `friction`:
    "coulomb" switches exactly between stick and slip, "bouc-wen" is the paper's regularisation (9)
    with the `yield_displacement` u_y in m, "no-slip" is Housner's block. `impacts` (unilateral) is
    the law of impacts at several contacts at once: "moreau" strikes all that touch together,
    "floor-first" one after another; they differ where a block lands flush against a bouncing wall.
    ("closed" and "open" are the two branches that "moreau" takes there.) "leading-first" and
    "trailing-first" strike one bottom corner before the other where a block lands flat while it
    slides. `energy_cap` (unilateral) lowers the restitution of an impact that would add kinetic
    energy to the largest that does not. `estimate_error` runs the scene again at tolerance/100 and
    puts the largest change of theta/alpha into `cost.error_estimate`. A run that reaches
    `most_steps` or `most_events` is a `ModelFailure`.
    """

    tolerance: Annotated[float, Strict(), Field(ge=FINEST, le=1e-2)] = 1e-10
    pivot: Literal["bilateral", "unilateral"] = "bilateral"
    friction: Literal["coulomb", "bouc-wen", "no-slip"] = "coulomb"
    impacts: ImpactLaw = "moreau"
    energy_cap: bool = False
    yield_displacement: Positive = 1e-5
    estimate_error: bool = False
    most_steps: Annotated[int, Field(ge=1)] = 20_000_000
    most_events: Annotated[int, Field(ge=1)] = 200_000

    @property
    def name(self) -> str:
        """`ebm`, `ebm-unilateral` or `ebm-bouc-wen`."""
        if self.friction == "bouc-wen":
            return "ebm-bouc-wen"
        return "ebm" if self.pivot == "bilateral" else "ebm-unilateral"

    def finer(self) -> Self:
        """The same model at a hundredth of its tolerance, or at the finest tolerance that double
        precision allows."""
        return self.model_copy(update={"tolerance": max(self.tolerance / 100.0, 1e-15)})

    def check(self, scene: Scene) -> None:
        """Raises `InputError` where the scene asks for physics that this model excludes."""
        check_kind(scene, Scene, "load_scene", "scene")
        if self.friction == "bouc-wen":
            self._check_bouc_wen(scene)
        if self.friction == "no-slip" and scene.initial_velocity != 0.0:
            raise InputError(
                f'{scene.initial_velocity:g} is not allowed with friction="no-slip":'
                " it never slips",
                "initial_velocity",
            )
        if self.pivot == "bilateral":
            if scene.floor.restitution > 0.0:
                raise InputError(
                    f"{scene.floor.restitution:g} is not allowed with the bilateral pivot: a floor"
                    " impact that rebounds is free flight,"
                    ' which this model excludes; use 0, or pivot="unilateral"',
                    "floor.restitution",
                )
            if scene.initial_height > 0.0:
                raise InputError(
                    f"{scene.initial_height:g} is not allowed with the bilateral pivot, which"
                    " never leaves the floor; use 0, or"
                    ' pivot="unilateral"',
                    "initial_height",
                )
        elif scene.floor.restitution == 1.0:
            raise InputError(
                "1 is not allowed: a block that loses nothing at the floor never settles; use less"
                " than 1",
                "floor.restitution",
            )

    def _check_bouc_wen(self, scene: Scene) -> None:
        if self.pivot != "bilateral":
            raise InputError(
                f'{self.pivot!r} is not allowed with friction="bouc-wen": only "bilateral" is',
                "pivot",
            )
        if scene.floor.mu_s != scene.floor.friction:
            raise InputError(
                f"{scene.floor.mu_s:g} is not allowed: Bouc-Wen friction has one coefficient,"
                f" {scene.floor.friction:g}",
                "floor.static_friction",
            )

    def simulate(self, scene: Scene) -> History:
        """The motion of the scene on its output grid. Raises `InputError` (see `check`) or
        `ModelFailure`."""
        self.check(scene)
        history = self._simulate(scene, self.tolerance)
        if not self.estimate_error:
            return history
        finer = self._simulate(scene, max(self.tolerance / 100.0, FINEST))
        rows = min(len(finer.channels["theta"]), len(history.channels["theta"]))
        change = (
            np.max(np.abs(finer.channels["theta"][:rows] - history.channels["theta"][:rows]))
            / scene.block.alpha
        )
        cost = Cost(**(vars(history.cost) | {"error_estimate": float(change)}))
        return History(**(vars_of(history) | {"cost": cost}))

    def _simulate(self, scene: Scene, tolerance: float) -> History:
        start = time.perf_counter()
        from rockcheck.ebm import natural
        from rockcheck.ebm.core import bouc_wen, march, motion
        from rockcheck.scenes.progress import interruptible

        b = natural.setting_of(
            scene,
            unilateral=self.pivot == "unilateral",
            no_slip=self.friction == "no-slip",
            energy_cap=self.energy_cap,
            impacts=self.impacts,
        )
        horizontal, vertical = natural.grounds_of(scene)
        unit = natural.time_unit(scene)
        state = natural.state_of(scene)
        times = scene.output_times
        out = np.empty((len(times), 6))
        out_mode = np.zeros(len(times), dtype=np.int8)
        log = np.empty((self.most_events, 5))
        yields = None
        if self.friction == "bouc-wen":
            yields = self.yield_displacement / scene.block.radius
        scratch = motion.workspace() if yields is None else (*bouc_wen.friction_workspace(), yields)
        _compiled(scratch, self.pivot == "unilateral")

        def play(most_steps: int) -> tuple[Tally, NDArray[np.int64]]:
            control = march.Control(
                tolerance, most_steps, self.most_events, False, scene.output_step / unit
            )
            state[:] = natural.state_of(scene)
            return march.run(
                b,
                horizontal,
                vertical,
                state,
                scene.duration / unit,
                control,
                out,
                out_mode,
                log,
                *scratch,
            )

        ready, cpu = time.perf_counter(), time.process_time()
        # A run of few steps is played here: to hand it over takes longer. Each sample of a record
        # is a step.
        few = min(
            self.most_steps,
            _AT_ONCE if max(len(horizontal.samples), len(vertical.samples)) < _AT_ONCE else 0,
        )
        found = play(few) if few else None
        if found is None or (found[0].ending == march.TOO_MANY_STEPS and few < self.most_steps):
            found = interruptible(partial(play, self.most_steps))
        tally, rules = found
        seconds, cpu = time.perf_counter() - ready, time.process_time() - cpu
        if tally.ending in march.FAILURES:
            raise ModelFailure(
                f"{self.name}: {march.FAILURES[tally.ending]} at t = {tally.t * unit:.6g} s"
            )
        rows = max(tally.rows, 1)
        out[0] = natural.state_of(scene) if tally.rows == 0 else out[0]
        events = _events(log[: min(tally.events, len(log))], unit, scene.block.radius)
        cost = Cost(
            wall_seconds=seconds,
            cpu_seconds=cpu,
            set_up=ready - start,
            steps=int(tally.steps),  # the loop, interpreted, counts in numpy's integers
            evaluations=int(tally.steps),
            energy_gains=int(tally.gains),
            largest_energy_gain=float(tally.largest_gain),
            rules={name: int(count) for name, count in zip(NAMES, rules, strict=True) if count},
        )
        return observe(
            scene,
            self.name,
            natural.to_si(scene, out[:rows]),
            mode=np.array(march.MODE_NAMES)[out_mode[:rows]],
            events=events,
            outcome=_outcome(tally, state[2]),
            cost=cost,
            settings=self.model_dump(),
        )


def _outcome(tally: Tally, theta: float) -> str:
    from rockcheck.ebm.core import march

    if tally.ending == march.OVERTURNED:
        return "overturned left" if theta > 0 else "overturned right"
    return "at rest" if tally.at_rest else "moving"


def _events(log: np.ndarray, unit: float, radius: float) -> list[Event]:
    """The event log (natural units) as events (SI)."""
    from rockcheck.ebm.core import march

    modes, kinds, speed = march.MODE_NAMES, march.EVENT_NAMES, radius / unit
    return [
        Event(
            t=t * unit,
            kind=kinds[int(kind)],
            mode_before=modes[int(before)],
            mode_after=modes[int(after)],
            impulse=impulse * speed,
        )
        for t, kind, before, after, impulse in log.tolist()
    ]


def vars_of(history: History) -> dict[str, Any]:
    """The fields of a history, without its cached values."""
    return {name: getattr(history, name) for name in History.__dataclass_fields__}


def _compiled(scratch: tuple[Any, ...], unilateral: bool) -> None:
    """Loads or compiles the event loop by a run of no steps, so that no run's time holds it."""
    kind = len(scratch), unilateral
    if kind in _READY:
        return
    from rockcheck.ebm import natural
    from rockcheck.ebm.core import march
    from rockcheck.scenes.excitations import Rest
    from rockcheck.scenes.scene import Block, Floor

    scene = Scene(
        name="warm-up",
        block=Block(half_width=1.0, half_height=4.0),
        floor=Floor(friction=0.5),
        excitation=Rest(),
        duration=1.0,
    )
    b = natural.setting_of(scene, unilateral=unilateral, no_slip=False, energy_cap=False)
    control = march.Control(WARM_UP_TOLERANCE, 1, 1, False, 1.0)
    nothing = np.empty((0, 6)), np.empty(0, dtype=np.int8), np.empty((0, 5))
    march.run(
        b, *natural.grounds_of(scene), natural.state_of(scene), 1.0, control, *nothing, *scratch
    )
    _READY.add(kind)


#: Steps that take about as long as to hand a run over to the thread that Ctrl-C need not wait for.
_AT_ONCE = 500
#: The variants of the event loop that are compiled: by the friction (its kind of scratch) and by
#: the pivot.
_READY: set[tuple[int, bool]] = set()
WARM_UP_TOLERANCE = 0.01
