"""The models under stress: the settings and scenes of each, and how a run of it is checked.

In: a seed and a number. Out: scenes and `CheckedRun`. Called by `runs` and the study.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.model import ImpactLaw
from rockcheck.engines import registry
from rockcheck.scenes import (
    InputError,
    ModelFailure,
    Scene,
)
from rockcheck.validation.execute import models
from rockcheck.validation.studies.stress import extremes, storeys, ties
from rockcheck.validation.studies.stress.checks import check_run
from rockcheck.validation.studies.stress.energy import energy_without_source
from rockcheck.validation.studies.stress.generator import Kind, exact_scene, random_scene
from rockcheck.validation.studies.stress.invariants import CheckedRun
from rockcheck.validation.studies.stress.motion import Motion, not_finite

#: Caps of an event-based run: the Zeno rule ends endless bouncing after some 1e5 impacts, each of
#: up to 18 steps with Bouc-Wen.
MOST_STEPS, MOST_EVENTS = 2_000_000, 400_000
#: One run in this many is audited: sampled so finely that its energy can be integrated. An odd
#: number: with the energy cap, too, which is on in odd runs.
AUDIT = 9
AUDITED = ("energy", "clearance", "decided", "unseen", "rows", "fate")
#: Penetration of the CM under the block's weight, R; longest run of it and of engines, sqrt(R/g).
DEPTH, LONGEST = 1e-8, 5.0


@dataclass(frozen=True)
class Player:
    """A model under stress: its label, which begins with the model's name, and what it plays.

    `runs` is the number of scenes in a whole run, `quick` in a quick one. `slow`: a run takes much
    longer than one of an event-based model.
    """

    label: str
    runs: int
    quick: int
    words: str

    @property
    def slow(self) -> bool:
        """Whether few runs make a task."""
        return False


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
        if self.exact:
            return exact_scene(seed, number, self.kind)
        return random_scene(seed, number, self.kind)

    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """The settings that the model is built with for this scene, besides those in its name.

        Every other unilateral run has the energy cap, Bouc-Wen yields within R/1000.
        """
        settings: dict[str, Any] = {}
        if self.kind == "no-slip":
            settings["friction"] = self.kind
        if self.impacts != "moreau":
            settings["impacts"] = self.impacts
        if self.kind == "unilateral" and number % 2 == 1:
            settings["energy_cap"] = True
        if self.kind == "bouc-wen":
            settings["yield_displacement"] = 1e-3 * scene.block.radius
        return settings

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
            audit=only in AUDITED or number % AUDIT == 0,
            only=only,
        )


@dataclass(frozen=True)
class Tied(EventBased):
    """The event-based model on scenes at a knife edge of the mechanics, by what is said of them."""

    @property
    def slow(self) -> bool:
        """Each scene is played from both sides, by several models."""
        return True

    def scene(self, seed: int, number: int) -> Scene:
        """Its scene of that number."""
        return ties.tie_scene(seed, number)

    def settings(self, scene: Scene, number: int) -> dict[str, Any]:
        """Those of the model by which ties are told."""
        return {}

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Checks what is said of the scene, of its sides and of scenes a little away."""
        model = EventBasedModel(pivot="unilateral", most_steps=MOST_STEPS, most_events=MOST_EVENTS)
        unsaid = ties.unsaid(model, scene, number)
        return CheckedRun(
            figures={"ends": 0.0, "ties": float(len(unsaid))}, failure="; ".join(unsaid)
        )


@dataclass(frozen=True)
class OnStorey(EventBased):
    """The event-based model on storeys of random buildings; the scene's base is the ground."""

    def check(self, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
        """Checks the storey's motion, and every invariant of the run under it."""
        building = storeys.random_building(scene, seed, number)
        faults = [] if only not in ("", "storey") else [*storeys.faults(building, scene)]
        played = super().check(storeys.stood(building, scene), seed, number, only)
        return replace(
            played,
            figures=played.figures | {"storey": float(len(faults))},
            failure="; ".join(filter(None, [played.failure, *faults])),
        )


@dataclass(frozen=True)
class Approximate(Player):
    """The continuous model or an engine.

    It may sink no deeper than it states, and gain energy from the base only. Lengths and times of
    its settings are in R and sqrt(R/g), so that they mean the same for every block.
    """

    step: float = 2e-3

    @property
    def slow(self) -> bool:
        """It takes many steps."""
        return True

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
        model = models.build(self.label, self.settings(scene, number))
        try:
            history = model.simulate(scene)
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
            figures["extremes"] = extremes.beyond(motion)
            if number % AUDIT == 0:
                figures["rows"] = extremes.change_with_rows(motion, model.simulate)
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
    Tied("ebm-unilateral ties", 2000, 20, "scenes on a knife edge: what is said", "unilateral"),
    OnStorey("ebm-unilateral storeys", 2000, 20, "on storeys of buildings", "unilateral"),
    Approximate("cm", 2000, 40, "continuous model, standing 1e-8 R deep"),
    *(
        Approximate(facts.name, 2000, 40, f"{facts.label}, best settings, steps of 0.002 sqrt(R/g)")
        for facts in registry.every()
        if facts.in_short_studies
    ),
)
PLAYERS = {player.label: player for player in _EVERY}
