"""One player and one phenomenon: played, read off and judged.

In goes a `Trial`; out comes its `Result`. `cards` makes the trials, workers play them.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rockcheck.scenes import History, ModelFailure, Scene, observation, printable
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA
from rockcheck.validation.studies.conformance.phenomenon import Motion
from rockcheck.validation.studies.conformance.players import Player
from rockcheck.validation.study import Task


@dataclass(frozen=True)
class Result:
    """A value, or None where the player lacks a part or no value could be read; its verdict."""

    value: float | None
    verdict: str
    reason: str
    version: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial(Task):
    """One player and one phenomenon, whose scenes it plays."""

    player: Player
    id: str

    @property
    def label(self) -> str:
        """Engine, settings, phenomenon."""
        return f"{self.player.label}, {self.player.setup}: {self.id}"

    def depends(self) -> Any:
        """Also the model's own code, and the files of histories."""
        player = self.player
        cells = [
            provenance.cell_key(scene, player.family, player.settings, player.search_path)
            for scene in PHENOMENA[self.id].scenes
        ]
        return {**super().depends(), "cells": cells}

    def play(self) -> Result:
        """Plays the scenes, reads the value off, and judges it.

        Raises `ModelFailure` where the model fails, or returns no history of the scene.
        """
        player, phenomenon = self.player, PHENOMENA[self.id]
        model: Any = models.build(player.family, player.settings, player.search_path)
        version = player.version or str(getattr(model, "version", ""))
        lacks = player.lacks or getattr(model, "lacks", tuple)()
        if phenomenon.needs in tuple(lacks):
            reason = f"the engine has no {phenomenon.needs} with these settings"
            return Result(None, "lacks", reason, version)
        histories = [self.history_of(model, scene) for scene in phenomenon.scenes]
        try:
            value = float(phenomenon.value(*map(Motion, histories)))
        except (ValueError, IndexError) as error:  # the motion lacks the wanted event
            raise ModelFailure(printable(error, 200)) from None
        verdict, reason = phenomenon.judge(value, advice_of(player.label, phenomenon.theme))
        return Result(
            value if math.isfinite(value) else None,
            verdict,
            reason,
            version,
            notes_of(phenomenon.scenes, histories),
        )

    def history_of(self, model: Any, scene: Scene) -> History:
        """The scene as the player has it."""
        if models.is_own(self.player.family):
            return models.history_of(self.player, scene)  # which may be anything
        history: History = model.simulate(scene)
        if self.player.family == "measured":
            check_units(scene, history)
        return history


def advice_of(engine: str, theme: str) -> str:
    """What to look at in that engine, by the names of its settings; "" where it is not known."""
    if engine not in models.ENGINE_NAMES:
        return ""
    return str(models.class_of(engine).advice.get(theme, ""))


def notes_of(scenes: tuple[Scene, ...], histories: list[History]) -> tuple[str, ...]:
    """What the histories say of their model; what they say of these scenes is left out."""
    of_scenes = {note for scene in scenes for note in observation.scene_notes(scene)}
    notes = [note for history in histories for note in history.notes if note not in of_scenes]
    return tuple(dict.fromkeys(notes))


def check_units(scene: Scene, history: History) -> None:
    """Raises `ModelFailure` for a history that does not begin and end as its scene does.

    As a rule a column is then in other units than its name says.
    """
    t, size = history.channels["t"], scene.block.radius
    start = dict(zip(("x", "y", "theta"), scene.initial_state, strict=False))
    for name, value in start.items():
        first = float(history.channels[name][0]) if name in history.channels else value
        if not abs(first - value) <= 0.02 * (1.0 if name == "theta" else size):
            raise ModelFailure(
                f"unit? {name} begins at {first:.4g}, and the scene at {value:.4g}: columns are in"
                " SI units unless their names say otherwise, such as x_mm, theta_deg"
            )
    largest = float(np.max(np.abs(history.channels["theta"])))
    if largest > math.pi:
        raise ModelFailure(f"unit? theta reaches {largest:.4g} rad: degrees are called theta_deg")
    if largest < 1.0 and t[-1] < 0.9 * scene.duration - scene.output_step:
        raise ModelFailure(
            f"unit? t ends at {t[-1]:.4g} s, and the scene at {scene.duration:g} s: milliseconds"
            " are called t_ms"
        )
