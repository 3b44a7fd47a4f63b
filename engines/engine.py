"""The interface of every engine: its settings, its methods and the history it returns."""

import sys
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import astuple, dataclass, replace
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from rockcheck.engines import contacts, events
from rockcheck.engines.steps import (
    USUAL_TOLERANCE,
    AdaptiveStep,
    FixedStep,
    World,
    at_output_times,
    in_fine_steps,
    in_units_of,
    time_of_fall,
)
from rockcheck.scenes import (
    Cost,
    Extremes,
    Floats,
    Floor,
    Frozen,
    History,
    Positive,
    Scene,
    errors,
    interpolation,
    kinematics,
    observation,
    printable,
)


@dataclass(frozen=True)
class ContactParameters:
    """How an engine sets its contacts, for `conformance --tune`.

    `range` holds the limits of the parameter that sets its restitution; `words` all parameters in
    the engine's own words, in which the numbers are filled in.
    """

    range: tuple[float, float]
    words: Mapping[str, str]


MOST_STEPS = 5_000_000
#: The step of an engine that cannot step adaptively, where none is given, s.
STOCK_STEP = 1e-4
#: The longest step where a tolerance is given alone, s: no record's sample is passed over.
LONGEST_STEP = 0.02


#: What makes the scene as an engine holds it: at its best, with contacts that stop or bounce within
#: one step, and with its own parameters of contact.
Worlds = tuple[Callable[[Scene], World], Callable[[Scene], World]]


class Engine(Frozen):
    """A physics engine as a model of the block.

    `time_step` in s, or "adaptive": then steps end at the events, are at most `largest_step` s
    long, and have an error of at most `tolerance`, in units of alpha (rotation) and alpha R
    (place). With a `largest_step` alone no error is estimated; with neither the tolerance is
    `USUAL_TOLERANCE`. Steps at impacts and just after events are `short_steps` times their usual
    length. Where no step is given it is "adaptive", or `STOCK_STEP` where the engine cannot vary
    its steps. A `FixedStep` or `AdaptiveStep` says all at once.

    `settings` "best" is the set-up that converges to rigid contact with Coulomb friction and
    Newton's restitution; "default" is the engine as it comes, a box on a floor with the engine's
    own contact parameters, which cannot step adaptively.
    """

    name: ClassVar[str]
    #: The module that it needs, "" where it comes with rockcheck; the package that holds it, as pip
    #: knows it, where that is called otherwise.
    module: ClassVar[str] = ""
    package: ClassVar[str] = ""
    worlds: ClassVar[Worlds]
    #: Digits of its states: "double" or "single" precision.
    precision: ClassVar[Literal["double", "single"]] = "double"
    #: The first and the last Python that the package has wheels for; None where it keeps up.
    first_python: ClassVar[tuple[int, int]] = (3, 11)
    last_python: ClassVar[tuple[int, int] | None] = None
    #: Whether it takes no centre of mass and no moment of inertia but those of a homogeneous block.
    homogeneous_only: ClassVar[bool] = False
    #: Why its steps cannot vary; "" where they can.
    fixed_because: ClassVar[str] = ""
    #: The settings in which contacts have Newton's coefficient of restitution.
    bounces_with: ClassVar[tuple[str, ...]] = ("best", "default")
    contact_parameters: ClassVar[ContactParameters]
    #: What to look at where it does not conform, by theme, in the names of its settings.
    advice: ClassVar[Mapping[str, str]] = MappingProxyType({})
    time_step: float | Literal["adaptive"] = "adaptive"
    largest_step: Positive = LONGEST_STEP
    short_steps: Positive = 1.0
    tolerance: Positive | None = None
    settings: Literal["best", "default"] = "best"

    @model_validator(mode="before")
    @classmethod
    def _steps_given(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        stock = given.get("settings") == "default"
        usual = STOCK_STEP if stock or cls.fixed_because else "adaptive"
        given = {"time_step": usual, **given}
        if isinstance(steps := given["time_step"], FixedStep | AdaptiveStep):
            fields = zip(steps.knobs, astuple(steps), strict=True)
            given |= {"time_step": "adaptive", **dict(fields)}
        step = given["time_step"]
        if step == "adaptive" and not {"largest_step", "tolerance"} & given.keys():
            given["tolerance"] = USUAL_TOLERANCE
        number = isinstance(step, int | float) and not isinstance(step, bool)
        why = ' with settings = "default":' if stock else f": {cls.fixed_because};"
        if step != "adaptive" and not (number and 0.0 < step <= sys.float_info.max):
            raise errors.InputError(
                f'{printable(step)} is not allowed: give a step above 0 s, or "adaptive"',
                "time_step",
            )
        if step == "adaptive" and usual != "adaptive":
            raise errors.InputError(f'"adaptive" is not allowed{why} give a step in s', "time_step")
        return given

    @property
    def steps(self) -> FixedStep | AdaptiveStep:
        """How its steps follow each other."""
        return (
            AdaptiveStep(self.largest_step, self.short_steps, self.tolerance)
            if self.time_step == "adaptive"
            else FixedStep(self.time_step)
        )

    @classmethod
    def installed(cls) -> bool:
        """Whether the module that it needs can be imported."""
        return not cls.module or find_spec(cls.module) is not None

    @classmethod
    def has_wheel(cls) -> bool:
        """Whether its package is published in a form that this Python can install as it is."""
        here = sys.version_info[:2]
        return cls.first_python <= here <= (cls.last_python or here)

    @classmethod
    def hint(cls) -> str:
        """What to do where it is not installed."""
        package = cls.package or cls.module
        if cls.has_wheel():
            return f"not installed: pip install {package}"
        this = ".".join(map(str, sys.version_info[:2]))
        return f"no wheel for Python {this}: pip install {package} compiles it"

    def coarser(self, factor: float) -> Self:
        """The same engine with all steps `factor` times as long.

        For adaptive steps this includes those at the events.
        """
        steps = self.steps.coarser(factor)
        return self.model_copy(update=dict(zip(steps.knobs, astuple(steps), strict=True)))

    def rigid_world(self, scene: Scene) -> World:
        """The scene with this engine's best settings.

        Contacts stop or bounce within one step, whatever the step.
        """
        return self.worlds[0](scene)

    def stock_world(self, scene: Scene) -> World:
        """The scene as this engine holds it with its own contact parameters."""
        return self.worlds[1](scene)

    def tuned_world(self, scene: Scene, parameters: Mapping[str, float], step: float) -> World:
        """The scene with the engine's native contact parameters.

        By default these are "restitution" and "friction" of its floor.
        """
        floor = Floor.model_construct(
            friction=parameters["friction"], restitution=parameters["restitution"]
        )
        return self.stock_world(scene.model_copy(update={"floor": floor}))

    def tuned(self, step: float) -> dict[str, float]:
        """Further parameters of contact that `tuned_world` chooses at a step of `step` s."""
        return {}

    def lacks(self) -> tuple[str, ...]:
        """What these settings do not have at all: "restitution" or nothing."""
        return () if self.settings in self.bounces_with else ("restitution",)

    def notes(self, scene: Scene) -> list[str]:
        """What this engine cannot do of the scene, a line each."""
        kinetic, static = scene.floor.friction, scene.floor.mu_s
        notes = {
            "the engine has one friction coefficient:"
            f" kinetic {kinetic:g} is used for static {static:g}": static != kinetic,
            f"{self.name} has no coefficient of restitution with these settings; that of the"
            " scene is not used": "restitution" in self.lacks() and contacts.rebounds(scene),
        }
        return [note for note, applies in notes.items() if applies]

    def check(self, scene: Scene) -> None:
        """Raises `InputError` where the engine cannot hold the scene, or needs too many steps."""
        errors.check_kind(scene, Scene, "load_scene", "scene")
        steps = self.steps
        if scene.duration / steps.usual > MOST_STEPS:
            raise errors.InputError(
                f"{getattr(self, steps.limiting):g} is not allowed: {scene.duration:g} s would need"
                f" more than {MOST_STEPS} steps",
                steps.limiting,
            )
        if self.homogeneous_only and not scene.block.homogeneous:
            raise errors.InputError(
                f"{type(self).__name__} holds a homogeneous block only", "block.centre_of_mass"
            )

    def simulate(self, scene: Scene) -> History:
        """The history of the scene as the engine plays it.

        The cost's `wall_seconds` and `cpu_seconds` are those of the march alone. Raises
        `InputError` (see `check`), `NotInstalled` if the engine is missing, `ModelFailure` if the
        motion blows up or its events do not end.
        """
        if not self.installed():
            raise errors.NotInstalled(f"the engine {self.name}: {self.hint()}", self.name)
        self.check(scene)
        steps = self.steps
        start = time.perf_counter()
        best = self.settings == "best"
        unit = scene.block.radius if best else 1.0  # of length, m
        played = in_units_of(unit, scene)
        with closing(self.rigid_world(played) if best else self.stock_world(played)) as world:
            march = steps.ready(world, played)
            begin, begin_cpu = time.perf_counter(), time.process_time()
            times, states, felt = march()
            cost = Cost(
                wall_seconds=time.perf_counter() - begin,
                cpu_seconds=time.process_time() - begin_cpu,
                set_up=begin - start,
                steps=len(states) - 1,
            )
        if steps.smooth:
            times, states, felt = in_fine_steps(times, states, felt)
        states[:, [0, 1, 3, 4]] *= unit
        happened = events.events_of(scene, times, states, unit * felt)
        history = observation.observe(
            scene,
            self.name,
            kinematics.of_box(scene.block, at_output_times(scene, times, states, steps.smooth)),
            events=happened,
            cost=cost,
            settings=self.model_dump(),
            notes=self.notes(scene),
        )
        return replace(history, model_extremes=_extremes(scene, times, states, history))


def _extremes(scene: Scene, times: Floats, states: Floats, history: History) -> Extremes:
    """The extremes of a run, from the states of the mass's centre at the ends of all steps."""
    happened = history.event_list
    box = kinematics.of_box(scene.block, states)
    whole = interpolation.Track.of(times, box, happened)
    # A step of fixed length may go beyond the scene's end.
    end = min(scene.run_times[-1], time_of_fall(times, states))
    return interpolation.extremes_of(
        whole.until(end),
        scene.block,
        scene.walls,
        happened,
        history.outcome,
        source="model",
        gravity=scene.gravity,
    )
