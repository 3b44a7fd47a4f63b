"""One model under stress: its settings and scenes, runs, totals, smaller scenes that still fail.

To find these, parts are dropped, shortened or rounded as long as the failure stays.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import chain
from operator import getitem
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.model import ImpactLaw
from rockcheck.scenes import InputError, ModelFailure, Scene, files, printable
from rockcheck.validation.execute import models, pool
from rockcheck.validation.studies.stress.generator import Kind, exact_scene, random_scene
from rockcheck.validation.studies.stress.invariants import (
    INVARIANTS,
    CheckedRun,
    Motion,
    check_run,
    energy_without_source,
    not_finite,
)
from rockcheck.validation.study import Task

#: Caps of an event-based run: the Zeno rule ends endless bouncing after some 1e5 impacts, each of
#: up to 18 steps with Bouc-Wen.
MOST_STEPS, MOST_EVENTS = 2_000_000, 400_000
#: One run in this many is audited: sampled so finely that its energy can be integrated. An odd
#: number: with the energy cap, too, which is on in odd runs.
AUDIT = 9
#: Penetration of the CM under the block's weight, R; longest run of it and of engines, sqrt(R/g).
DEPTH, LONGEST = 1e-8, 5.0


@dataclass(frozen=True)
class Player:
    """A model under stress: its label, which begins with the model's name, and what it plays.

    `runs` is the number of scenes in a whole run, `quick` in a quick one.
    """

    label: str
    runs: int
    quick: int
    words: str


@dataclass(frozen=True)
class EventBased(Player):
    """A variant of the event-based model, for the kind of scenes that it can play.

    A broken invariant fails the command. `exact` scenes are those at which rounding decides.
    """

    kind: Kind
    impacts: ImpactLaw = "moreau"
    exact: bool = False

    def scene(self, seed: int, number: int) -> Scene:
        """Its scene of that number."""
        return (exact_scene if self.exact else random_scene)(seed, number, self.kind)

    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """The settings that the model is built with for this scene, besides those in its name.

        Every other unilateral run has the energy cap, Bouc-Wen yields within R/1000.
        """
        every: dict[str, tuple[bool, Any]] = {
            "friction": (self.kind == "no-slip", self.kind),
            "impacts": (self.impacts != "moreau", self.impacts),
            "energy_cap": (self.kind == "unilateral" and number % 2 == 1, True),
            "yield_displacement": (self.kind == "bouc-wen", 1e-3 * scene.block.radius),
        }
        return {key: value for key, (given, value) in every.items() if given}

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Plays the scene and checks every invariant; those of an audit in each ninth run."""
        return check_run(
            EventBasedModel(
                **{
                    "pivot": "unilateral" if self.kind == "unilateral" else "bilateral",
                    "friction": "bouc-wen" if self.kind == "bouc-wen" else "coulomb",
                    "most_steps": MOST_STEPS,
                    "most_events": MOST_EVENTS,
                    **self.settings(scene, number),
                }
            ),
            scene,
            seed=seed + number,  # each run has another scale, disturbance and wall
            # Of an audited run with all its rows: a coarser one may not show the failure.
            audit=only in ("energy", "clearance", "decided") or number % AUDIT == 0,
            only=only,
        )


@dataclass(frozen=True)
class Approximate(Player):
    """The continuous model or an engine.

    It may sink no deeper than it states, and gain energy from the base only. Lengths and times of
    its settings are in R and sqrt(R/g), so that they mean the same for every block.
    """

    step: float = 2e-3

    def scene(self, seed: int, number: int) -> Scene:
        """The scene of that number, no longer than affordable, with a row a step.

        Between two rows the base may do any work.
        """
        scene = random_scene(seed, number)
        unit = math.sqrt(scene.block.radius / scene.gravity)
        return scene.replace(
            duration=min(scene.duration, LONGEST * unit), output_step=self.step * unit
        )

    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """The settings that the model is built with for this scene."""
        radius = scene.block.radius
        return (
            {"penetration": DEPTH * radius}
            if self.label == "cm"
            else {"time_step": self.step * math.sqrt(radius / scene.gravity)}
        )

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Checks the run's end, finite numbers, depth and energy.

        If an engine breaks one of the last two, `failure` gives the figures with half the step.
        """
        played = self._check(scene, number)
        broken = [name for name in played.broken if name in ("depth", "source")]
        if broken and self.label != "cm":
            finer = replace(self, step=0.5 * self.step)._check(
                scene.replace(output_step=0.5 * scene.output_step), number
            )
            return replace(
                played,
                failure="; ".join(
                    f"{name} {played.figures[name]:.2g}, with half the step"
                    f" {finer.figures.get(name, math.nan):.2g}"
                    for name in broken
                ),
            )
        return played

    def _check(self, scene: Scene, number: int) -> CheckedRun:
        try:
            history = models.build(self.label, self.settings(scene, number)).simulate(scene)
        except (ModelFailure, InputError) as error:
            return CheckedRun(figures={"ends": 1.0}, failure=str(error))
        figures = {"ends": 0.0, "finite": not_finite(history)}
        if not figures["finite"]:
            motion = Motion(scene, history)
            # The deepest penetration over what the model states: an engine the distance moved in a
            # step, the CM the deflection of its spring.
            x, y, spin = (
                float(np.max(np.abs(history.channels[name])))
                for name in ("x_dot", "y_dot", "theta_dot")
            )
            speed = (x + y) * motion.unit / motion.radius + spin * motion.unit
            shaken = sum(
                np.max(np.abs(base.acceleration(history.channels["t"])))
                for base in (scene.excitation, scene.vertical)
            )
            level = 1.0 + shaken / scene.gravity + spin**2 * motion.unit**2
            way = math.sqrt(DEPTH) if self.label == "cm" else self.step
            figures["depth"] = motion.deepest / (2.0 * (speed * way + level * way**2) + 1e-5)
            figures["source"] = energy_without_source(motion)
        return CheckedRun(
            figures=figures, outcome=history.outcome, counts={"events": len(history.event_list)}
        )


ROUNDING = "scenes at which rounding decides"
_EVERY: tuple[EventBased | Approximate, ...] = (
    EventBased("ebm", 100_000, 1000, "the paper's pivot, Coulomb friction", "bilateral"),
    EventBased("ebm no-slip", 100_000, 500, "the paper's pivot, which never slips", "no-slip"),
    EventBased(
        "ebm-unilateral",
        100_000,
        1000,
        "a floor that can only push; every other run with the energy cap",
        "unilateral",
    ),
    EventBased(
        "ebm-bouc-wen",
        100_000,
        300,
        "regularised friction, which yields within R/1000",
        "bouc-wen",
    ),
    EventBased(
        "ebm-unilateral floor-first",
        20_000,
        200,
        "one contact after another",
        "unilateral",
        "floor-first",
    ),
    EventBased(
        "ebm-unilateral leading-first",
        20_000,
        100,
        "lands flat on one corner",
        "unilateral",
        "leading-first",
    ),
    EventBased(
        "ebm-unilateral trailing-first",
        20_000,
        100,
        "on the other one",
        "unilateral",
        "trailing-first",
    ),
    EventBased("ebm exact", 20_000, 200, ROUNDING, "bilateral", exact=True),
    EventBased("ebm no-slip exact", 20_000, 200, ROUNDING, "no-slip", exact=True),
    EventBased("ebm-unilateral exact", 20_000, 200, ROUNDING, "unilateral", exact=True),
    EventBased("ebm-bouc-wen exact", 5000, 50, ROUNDING, "bouc-wen", exact=True),
    Approximate("cm", 2000, 40, "continuous model, standing 1e-8 R deep"),
    *(
        Approximate(engine.lower(), 2000, 40, f"{engine}, best settings, steps of 0.002 sqrt(R/g)")
        for engine in ("MuJoCo", "PyBullet")
    ),
)
PLAYERS = {player.label: player for player in _EVERY}

Path = tuple[str | int, ...]
#: Most scenes that are tried.
MOST_TRIALS = 400
#: Lists of at most this many values are simplified value by value.
SHORT = 8
#: What is dropped first, since a block that nothing moves is told soonest.
FIRST: dict[str | int, int] = {"vertical": 0, "excitation": 1}


def shrink(
    scene: Scene, shows: Callable[[Scene], bool], trials: int = MOST_TRIALS
) -> tuple[Scene, bool]:
    """A minimal scene that `shows` the failure as `scene` does.

    No single simplification can be made without losing the failure. Ends after this many `trials`
    with the scene found by then; the second value is then false.
    """
    simpler = _simpler(scene)
    while one := next(simpler, None):
        if trials == 0:
            return scene, False
        trials -= 1
        if shows(one):
            scene, simpler = one, _simpler(one)
    return scene, True


def _simpler(scene: Scene) -> Iterator[Scene]:
    """The scene with one simplification each, the greatest first, where it is valid.

    A part is left out, a run or list is shorter, the scale is another; at last one number is zero
    or has fewer digits.
    """
    tables = files.tables_of(scene)
    places = sorted(_places(tables), key=lambda place: (len(place[0]), FIRST.get(place[0][0], 2)))
    numbers = [(path, value) for path, value in places if isinstance(value, float)]
    unit, radius = math.sqrt(scene.block.radius / scene.gravity), scene.block.radius
    for changed in chain(
        (_with(tables, path) for path, _ in places),
        (
            tables | {key: factor * getattr(scene, key) for key in ("duration", "output_step")}
            for factor in (0.25, 0.5, 0.9)
            if factor * scene.duration > 0.01 * unit
        ),
        (
            _with(tables, path, value[:count])
            for path, value in places
            if isinstance(value, list)
            for count in (len(value) // 2, -1)
        ),
        # near 1 m rounding would change it again
        [tables | {"block": scene.block.scaled(1.0 / radius)}] if not 0.5 < radius < 2.0 else [],
        (_with(tables, path, 0.0) for path, _ in numbers),
        (
            _with(tables, path, float(f"{value:.{digits}g}"))
            for digits in (1, 2, 4, 8)
            for path, value in numbers
        ),
    ):
        with suppress(InputError):
            simpler = Scene(**changed)
            if simpler != scene:
                yield simpler


def _places(part: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    if path:
        yield path, part
    short = isinstance(part, list) and len(part) <= SHORT
    for key, value in part.items() if isinstance(part, dict) else enumerate(part if short else ()):
        if key not in ("name", "output_step"):  # these are never dropped or rounded
            yield from _places(value, (*path, key))


def _with(tables: dict[str, Any], path: Path, *value: Any) -> dict[str, Any]:
    changed: Any = deepcopy(tables)
    part = reduce(getitem, path[:-1], changed)
    if value:
        part[path[-1]] = value[0]
    else:
        del part[path[-1]]
    return changed


#: Time limit (s) of a run on average, event-based or not, and its ratio to the usual time; then
#: the time (s) that a task may take in addition.
A_RUN, AN_APPROXIMATE_RUN, AMPLE, PATIENCE = 0.2, 2.0, 50.0, 20.0
#: Failures of a model and an invariant that are written as scenes.
MOST_FILES = 20


@dataclass(frozen=True)
class Broken:
    """A run that breaks an invariant."""

    model: str
    invariant: str
    seed: int
    number: int
    figure: float
    words: str = ""

    @property
    def scene(self) -> Scene:
        """The run's scene as it was played."""
        return PLAYERS[self.model].scene(self.seed, self.number)

    @property
    def name(self) -> str:
        """The name of the run's scene file."""
        return f"{self.model.replace(' ', '-')}-{self.invariant}-{self.seed}-{self.number}.toml"

    def text(self, scene: Scene, remark: str) -> str:
        """Its scene file with a scene that shows it."""
        settings = PLAYERS[self.model].settings(scene, self.number)
        options = [
            f"--set {key}={value if isinstance(value, str) else repr(value).lower()}"
            for key, value in settings.items()
        ]
        words = (
            f"{self.invariant}: {INVARIANTS[self.invariant].words}",
            printable(self.words, 200),
            remark,
            # No model's name has Housner's block, which never slips.
            'python -c "import rockcheck as rc;'
            f" rc.EventBasedModel(friction='no-slip').simulate(rc.load_scene('{self.name}'))"
            ".save('history.csv')\""
            if "friction" in settings
            else " ".join(
                [f"rockcheck simulate {self.name} --model {self.model.split()[0]}", *options]
            ),
        )
        # the name is the file's own
        tables = {key: part for key, part in files.tables_of(scene).items() if key != "name"}
        return files.scene_text(tables, "\n".join(filter(None, words)))


@dataclass(kw_only=True)
class RunTotals:
    """Totals of some runs of one model."""

    model: str
    cpu_seconds: float = 0.0
    #: Number of runs that checked an invariant, and in which it could not be judged; its worst
    #: figure, and the run of that figure.
    looked_at: Counter[str] = field(default_factory=Counter)
    unjudged: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int]] = field(default_factory=dict)
    failures: list[Broken] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    #: How often each modelling choice of the model was made, by its name.
    rules: Counter[str] = field(default_factory=Counter)
    #: "runs", "events", runs in which an impact added energy, as its law is known to do
    #: ("gaining"), and whose comparison ended at the horizon of predictability ("horizons").
    counts: Counter[str] = field(default_factory=Counter)
    #: Largest energy that an impact added, as a share of the energy before it.
    largest_gain: float = 0.0

    def see(self, played: CheckedRun, seed: int, number: int) -> None:
        """Count one more run."""
        self.add(
            RunTotals(
                model=self.model,
                looked_at=Counter(played.figures.keys()),
                unjudged=Counter(played.unjudged),
                worst={
                    name: (math.inf if math.isnan(figure) else figure, number)
                    for name, figure in played.figures.items()
                },
                failures=[
                    Broken(self.model, name, seed, number, played.figures[name], played.failure)
                    for name in played.broken
                ],
                outcomes=Counter([played.outcome or "failed"]),
                rules=Counter(played.rules),
                counts=Counter({"runs": 1, **played.counts}),
                largest_gain=played.largest_gain,
            )
        )

    def add(self, other: RunTotals) -> None:
        """Add the totals of other runs."""
        for name, found in other.worst.items():
            self.worst[name] = max(found, self.worst.get(name, found))
        self.largest_gain = max(self.largest_gain, other.largest_gain)
        for key in vars(self).keys() - {"model", "worst", "largest_gain"}:
            setattr(self, key, getattr(self, key) + getattr(other, key))

    @property
    def shown(self) -> list[Broken]:
        """The first runs that break each invariant: their scenes are written."""
        ordered = sorted(self.failures, key=lambda one: one.number)
        return [
            one
            for name in INVARIANTS
            for one in [one for one in ordered if one.invariant == name][:MOST_FILES]
        ]


@dataclass(frozen=True)
class Chunk(Task):
    """Runs `first` to `first + count - 1` of a model under a seed."""

    model: str
    seed: int
    first: int
    count: int

    @property
    def label(self) -> str:
        """For progress and failures."""
        return f"{self.model}, runs {self.first} to {self.first + self.count - 1}"

    def play(self) -> RunTotals:
        """The totals of the runs."""
        began, totals = time.process_time(), RunTotals(model=self.model)
        for number in range(self.first, self.first + self.count):
            totals.see(
                checked(
                    self.model, PLAYERS[self.model].scene(self.seed, number), self.seed, number
                ),
                self.seed,
                number,
            )
        totals.cpu_seconds = time.process_time() - began
        return totals


def checked(label: str, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
    """One checked run; an exception of the program counts as a failure like any other."""
    found: CheckedRun | pool.Failure = pool.guarded(PLAYERS[label].check, scene, seed, number, only)
    if isinstance(found, pool.Failure):  # the other runs go on
        return CheckedRun(figures={"ends": math.inf}, failure=found.reason)
    return found


@dataclass(frozen=True)
class Shrinking(Task):
    """The search for a smaller scene that fails in the same way, in so many trials."""

    broken: Broken
    trials: int

    @property
    def label(self) -> str:
        """For progress and failures."""
        return f"smallest scene of {self.broken.name}, {self.trials} trials"

    def play(self) -> str:
        """The file of the smallest scene that was found."""
        broken, name = self.broken, self.broken.invariant
        most = math.inf if name == "ends" else 100.0 * INVARIANTS[name].bound

        def shows(scene: Scene) -> bool:
            played = checked(broken.model, scene, broken.seed, broken.number, name)
            return (
                name in played.broken
                and played.figures[name] >= min(broken.figure, most)
                # A fault of the program: the same one.
                and (
                    broken.figure < math.inf
                    or played.failure.partition(":")[0] == broken.words.partition(":")[0]
                )
            )

        if not shows(broken.scene):
            return broken.text(broken.scene, "as it was found: it does not fail again")
        scene, complete = shrink(broken.scene, shows, self.trials)
        return broken.text(
            scene, "" if complete else "not the smallest: not all that is simpler was tried"
        )


def limits(model: str, runs: int) -> dict[str, Any]:
    """For a `Task`: time limit and usual time (s) of so many runs, and what they compile.

    The limit is far more than they take, and short enough for a hang to be found soon.
    """
    a_run = A_RUN if isinstance(PLAYERS[model], EventBased) else AN_APPROXIMATE_RUN
    return {
        "seconds": PATIENCE + runs * a_run,
        "expected": runs * a_run / AMPLE,
        "compiles": models.compiles(model.split()[0]),
    }


def parts(task: Task) -> Sequence[Task]:
    """Smaller tasks in place of one whose process hangs or dies."""
    if isinstance(task, Chunk) and task.count > 1:
        half = task.count // 2
        return [
            replace(task, first=first, count=count, **limits(task.model, count))
            for first, count in ((task.first, half), (task.first + half, task.count - half))
        ]
    if isinstance(task, Shrinking) and task.trials > 1:
        fewer = task.trials // 4
        return [replace(task, trials=fewer, **limits(task.broken.model, fewer))]
    return []
