"""Spectra from what has been played: each asks for the nodes that are still missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, Spectrum, overturning_spectrum
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.ebm.spectrum import TOLERANCE, Floats, Nodes as Outcomes
from rockcheck.scenes import InputError, Scene
from rockcheck.validation.execute.models import build
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.paper.panels import AMPLITUDES, FREQUENCIES, Panel
from rockcheck.validation.studies.spectrum.tiles import (
    UNDECIDED,
    Nodes,
    Played,
    nodes_of,
    outcomes_of,
)

#: Settings of the models in spectra, where they are not their own: outcomes need no more, and take
#: a tenth of the time.
SETTINGS: dict[str, dict[str, Any]] = {
    "ebm": {"tolerance": TOLERANCE},
    "ebm-unilateral": {"tolerance": TOLERANCE},
    **{
        engine: {"time_step": "adaptive", "largest_step": 2e-3}
        for engine in ("mujoco", "pybullet", "pymunk")
    },
    "dart": {"time_step": "adaptive", "largest_step": 4e-3},
    "drake": {"time_step": 1e-3},
}
MOST_SIZE = 5000


def axis(low: float, high: float, size: int, key: str) -> Floats:
    """`size` equally spaced ratios from `low` to `high`. Raises `InputError` where they are not
    finite, positive and in order."""
    said = f"{low:g} to {high:g} is not allowed"
    if not (np.isfinite(low) and np.isfinite(high) and low > 0.0):
        raise InputError(f"{said}: give positive finite numbers", key)
    if low >= high:
        raise InputError(f"{said}: the lower end comes first", key)
    return np.linspace(low, high, size)


@dataclass(frozen=True)
class Request:
    """How spectra are to be played: grid, model and settings. Raises `InputError` where that
    cannot be."""

    size: int = 100
    frequency_range: tuple[float, float] = FREQUENCIES
    amplitude_range: tuple[float, float] = AMPLITUDES
    model: str = "ebm"
    settings: Mapping[str, Any] = field(default_factory=dict)
    refine: bool = False

    def __post_init__(self) -> None:
        if not 2 <= self.size <= MOST_SIZE:
            said = f"{self.size} is not allowed: give 2 to {MOST_SIZE} nodes an axis"
            raise InputError(said, "--size")
        settings = {**SETTINGS.get(self.model, {}), **self.settings}
        object.__setattr__(self, "settings", settings)
        build(self.model, settings)
        _ = self.frequencies, self.amplitudes

    @cached_property
    def frequencies(self) -> Floats:
        """omega_p/p of the nodes."""
        return axis(*self.frequency_range, self.size, "--frequencies")

    @cached_property
    def amplitudes(self) -> Floats:
        """a_p/(g tan alpha) of the nodes."""
        return axis(*self.amplitude_range, self.size, "--amplitudes")

    def other_laws(self, scene: Scene) -> list[dict[str, Any]]:
        """The settings with each other law of impacts on which outcomes may depend."""
        player = build(self.model, self.settings)
        if not isinstance(player, EventBasedModel):
            return []
        bounces = any(wall.restitution > 0.0 for wall in scene.walls)
        laws = other_laws(player, walls=bounces, flat=may_fly(scene))
        return [{**self.settings, "impacts": law} for law in laws]


class _Waiting(Exception):
    """Nodes are asked for that have not been played."""


@dataclass
class Book:
    """What has been played, and what is asked for beyond that."""

    done: Mapping[Any, Any]
    wanted: list[Nodes] = field(default_factory=list)

    def ask(self, tasks: Sequence[Nodes]) -> list[Played] | None:
        """Their records, None where some are still to be played. All nodes of a task that failed
        are undecided."""
        missing = [task for task in tasks if task not in self.done]
        self.wanted += missing
        return None if missing else [_whole(task, self.done[task]) for task in tasks]

    def outcomes(self, *nodes: Any) -> Outcomes | None:
        """Sides and failures of the nodes of `tiles.nodes_of`."""
        found = self.ask(nodes_of(*nodes))
        return None if found is None else outcomes_of("".join(one.letters for one in found))

    def spectrum(self, panel: Panel, request: Request, settings: Any = None) -> Spectrum | None:
        """A spectrum, None where nodes are still to be played: refinement then begins again with
        all that is known."""

        def known(scene: Scene, a: Floats, f: Floats) -> Outcomes:
            found = self.outcomes(scene, a, f, request.model, settings or request.settings)
            if found is None:
                raise _Waiting
            return found

        axes = request.frequencies, request.amplitudes
        try:
            return overturning_spectrum(panel.scene, *axes, refine=request.refine, play=known)
        except _Waiting:
            return None


def _whole(task: Nodes, record: Any) -> Played:
    failed = isinstance(record, Failure)
    return Played(UNDECIDED * len(task.amplitudes)) if failed else record


def differing(spectrum: Spectrum, others: Sequence[Spectrum]) -> NDArray[np.int64]:
    """The nodes (i, j), a row each, that are decided and differ in one of the others, decided,
    too."""
    differ = np.zeros(spectrum.outcomes.shape, dtype=bool)
    for other in others:
        own = spectrum.outcomes != other.outcomes
        for one in (spectrum, other):
            own[tuple(one.undecided.T)] = False
        differ |= own
    return np.argwhere(differ)
