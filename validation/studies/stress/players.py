"""The models under stress: settings and scenes of each, and the invariants that it must keep."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.model import ImpactLaw
from rockcheck.scenes import InputError, ModelFailure, Record, Scene
from rockcheck.scenes.excitations import Excitation
from rockcheck.validation.execute.models import build
from rockcheck.validation.studies.stress.generator import Kind, exact_scene, random_scene
from rockcheck.validation.studies.stress.invariants import CheckedRun, check_run
from rockcheck.validation.studies.stress.mechanics import Floats, Motion, motion_of, not_finite

#: Caps of an event-based run: the Zeno rule ends endless bouncing after some 1e5 impacts, each of
#: up to 18 steps with Bouc-Wen.
MOST_STEPS, MOST_EVENTS = 2_000_000, 400_000
#: One run in this many is audited: sampled so finely that its energy can be integrated.
AUDIT = 10


@dataclass(frozen=True)
class Player(ABC):
    """A model under stress: its label, and the kind of scenes that it can play.

    `runs` is the number of scenes in a whole run, `quick` in a quick one.
    """

    label: str
    kind: Kind
    runs: int
    quick: int
    words: str
    friction: Literal["coulomb", "bouc-wen", "no-slip"] = "coulomb"

    @property
    def event_based(self) -> bool:
        """Whether a broken invariant fails the command."""
        return self.label.startswith("ebm")

    @abstractmethod
    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """The settings that the model is built with for this scene, besides those in its name."""

    def command(self, scene: Scene, number: int) -> str:
        """The options of `rockcheck simulate` with which this run can be made again."""
        name = "ebm:EventBasedModel" if self.friction == "no-slip" else self.label.split()[0]
        settings = [
            f"--set {key}={value if isinstance(value, str) else repr(value).lower()}"
            for key, value in self.settings(scene, number).items()
        ]
        return " ".join([f"--model {name}", *settings])

    @abstractmethod
    def scene(self, seed: int, number: int) -> Scene:
        """Its scene of that number."""

    @abstractmethod
    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Plays the scene and checks the invariants that the model must keep."""


@dataclass(frozen=True)
class EventBased(Player):
    """A variant of the event-based model."""

    impacts: ImpactLaw = "moreau"
    #: Whether its scenes are those at which rounding decides.
    exact: bool = False

    def scene(self, seed: int, number: int) -> Scene:
        """Its scene of that number."""
        return (exact_scene if self.exact else random_scene)(seed, number, self.kind)

    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """Every other unilateral run has the energy cap, Bouc-Wen yields within R/1000."""
        every: dict[str, tuple[bool, Any]] = {
            "friction": (self.friction == "no-slip", self.friction),
            "impacts": (self.impacts != "moreau", self.impacts),
            "energy_cap": (self.kind == "unilateral" and number % 2 == 1, True),
            "yield_displacement": (self.friction == "bouc-wen", 1e-3 * scene.block.radius),
        }
        return {key: value for key, (given, value) in every.items() if given}

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Every invariant; energy and clearance in each tenth run."""
        fixed: dict[str, Any] = {
            "pivot": "unilateral" if self.kind == "unilateral" else "bilateral",
            "friction": self.friction,
            "most_steps": MOST_STEPS,
            "most_events": MOST_EVENTS,
        }
        model = EventBasedModel(**fixed | self.settings(scene, number))
        audit = only in ("energy", "clearance") or (not only and number % AUDIT == 0)
        return check_run(model, scene, seed=seed, audit=audit, only=only)


@dataclass(frozen=True)
class Approximate(Player):
    """The continuous model or an engine.

    It may sink no deeper than it states, and gain energy from the base only. Lengths and times of
    its settings are in R and sqrt(R/g), so that they mean the same for every block; runs last at
    most `longest`.
    """

    longest: float = 5.0
    step: float = 2e-3

    def scene(self, seed: int, number: int) -> Scene:
        """The scene of that number, no longer than affordable, with a row a step.

        Between two rows the base may do any work.
        """
        scene = random_scene(seed, number, self.kind)
        unit = math.sqrt(scene.block.radius / scene.gravity)
        return scene.replace(
            duration=min(scene.duration, self.longest * unit), output_step=self.step * unit
        )

    def settings(self, scene: Scene, number: int = 0) -> dict[str, Any]:
        """The settings that the model is built with for this scene."""
        if self.label == "cm":
            return {"penetration": DEPTH * scene.block.radius}
        return {"time_step": self.step * math.sqrt(scene.block.radius / scene.gravity)}

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Checks the run's end, finite numbers, depth and energy.

        If an engine breaks one of the last two, `failure` gives the figures with half the step.
        """
        played = self._check(scene)
        broken = [name for name in played.broken if name in ("depth", "source")]
        if broken and self.label != "cm":
            finer = replace(self, step=0.5 * self.step)._check(
                scene.replace(output_step=0.5 * scene.output_step)
            )
            words = (
                f"{name} {played.figures[name]:.2g}, with half the step"
                f" {finer.figures.get(name, math.nan):.2g}"
                for name in broken
            )
            return replace(played, failure="; ".join(words))
        return played

    def _check(self, scene: Scene) -> CheckedRun:
        try:
            history = build(self.label, self.settings(scene)).simulate(scene)
        except (ModelFailure, InputError) as error:
            return CheckedRun(figures={"ends": 1.0}, failure=str(error))
        figures = {"ends": 0.0, "finite": not_finite(history)}
        if not figures["finite"]:
            motion = motion_of(scene, history)
            figures |= {"depth": self.depth(motion), "source": energy_without_source(motion)}
        return CheckedRun(
            figures=figures, outcome=history.outcome, counts={"events": len(history.event_list)}
        )

    def depth(self, motion: Motion) -> float:
        """Deepest penetration over what the model states.

        An engine states the distance moved in a step, the CM the deflection of its spring.
        """
        spin = float(np.max(np.abs(motion.channels["theta_dot"])))
        ways = sum(np.max(np.abs(motion.channels[name])) for name in ("x_dot", "y_dot"))
        speed = ways * motion.unit / motion.radius + spin * motion.unit
        bases = motion.scene.excitation, motion.scene.vertical
        shaken = sum(np.max(np.abs(base.acceleration(motion.channels["t"]))) for base in bases)
        level = 1.0 + shaken / motion.scene.gravity + spin**2 * motion.unit**2
        if self.label == "cm":
            stated = speed * math.sqrt(DEPTH) + level * DEPTH
        else:
            stated = speed * self.step + level * self.step**2
        return motion.deepest / (2.0 * stated + 1e-5)


def energy_without_source(motion: Motion) -> float:
    """Largest energy beyond the initial one and the work of the base, relative to that at play.

    At play are g R, the initial energy and all work done by then.

    The base's acceleration acts on the block as a force. Its work between two rows is its impulse
    times the mean of the velocities before and after. It is exact however the acceleration changes
    between the rows (a record can be finer than they are) where the block stands, and where nothing
    but the base changes its velocity.
    """
    scene, energy = motion.scene, motion.energy
    work, moved = np.zeros(len(energy)), np.zeros(len(energy))
    bases = scene.excitation, scene.vertical
    for excitation, velocity in zip(bases, (motion.across, motion.up), strict=True):
        impulse = -np.diff(_base_velocity(excitation, motion.channels["t"]))
        part = 0.5 * (velocity[1:] + velocity[:-1]) * impulse
        work[1:] += np.cumsum(part)
        moved[1:] += np.cumsum(np.abs(part))
    size = scene.gravity * motion.radius + np.abs(energy[0]) + moved
    return float(np.max((energy - energy[0] - work) / size))


def _base_velocity(excitation: Excitation, t: Floats) -> Floats:
    """Integral of the base acceleration from the first of the times `t` on.

    Exact for a record, which is linear between samples.
    """
    times = t
    if isinstance(excitation, Record):
        kinks = excitation.time_step * np.arange(len(excitation.unscaled))
        kinks = np.append(kinks, np.nextafter(kinks[-1], np.inf))  # where it ends
        times = np.union1d(t, kinks[kinks < t[-1]])
    acceleration = excitation.acceleration(times)
    steps = 0.5 * np.diff(times) * (acceleration[1:] + acceleration[:-1])
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)])[np.searchsorted(times, t)])


#: Penetration of the CM under the block's weight, R.
DEPTH = 1e-8
ROUNDING = "scenes at which rounding decides"
_LAWS: tuple[tuple[ImpactLaw, int, str], ...] = (
    ("floor-first", 200, "one contact after another"),
    ("leading-first", 100, "lands flat on one corner"),
    ("trailing-first", 100, "on the other one"),
)
PLAYERS: dict[str, Player] = {
    player.label: player
    for player in (
        EventBased("ebm", "bilateral", 100_000, 1000, "the paper's pivot, Coulomb friction"),
        EventBased(
            "ebm no-slip",
            "no-slip",
            100_000,
            500,
            "the paper's pivot, which never slips",
            "no-slip",
        ),
        EventBased(
            "ebm-unilateral",
            "unilateral",
            100_000,
            1000,
            "a floor that can only push; every other run with the energy cap",
        ),
        EventBased(
            "ebm-bouc-wen",
            "bouc-wen",
            100_000,
            300,
            "regularised friction, which yields within R/1000",
            "bouc-wen",
        ),
        *(
            EventBased(f"ebm-unilateral {law}", "unilateral", 20_000, quick, words, impacts=law)
            for law, quick, words in _LAWS
        ),
        EventBased("ebm exact", "bilateral", 20_000, 200, ROUNDING, exact=True),
        EventBased("ebm no-slip exact", "no-slip", 20_000, 200, ROUNDING, "no-slip", exact=True),
        EventBased("ebm-unilateral exact", "unilateral", 20_000, 200, ROUNDING, exact=True),
        EventBased("ebm-bouc-wen exact", "bouc-wen", 5000, 50, ROUNDING, "bouc-wen", exact=True),
        Approximate("cm", "unilateral", 2000, 40, "continuous model, standing 1e-8 R deep"),
        *(
            Approximate(
                engine.lower(),
                "unilateral",
                2000,
                40,
                f"{engine}, best settings, steps of 0.002 sqrt(R/g)",
            )
            for engine in ("MuJoCo", "PyBullet")
        ),
    )
}
