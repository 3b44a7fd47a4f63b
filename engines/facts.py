"""The record of an engine: what others know of it by its name, beside its model.

Each module NAME_engine.py ends with one, `FACTS`. `engines.registry` finds them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rockcheck.engines.engine import Engine


@dataclass(frozen=True)
class LineLook:
    """How an engine's line is drawn: colours (hex) on white and on black, dashes and a marker.

    Dashes are in line widths, on and off. The marker is one of matplotlib's letters.
    """

    light: str
    dark: str
    dash: tuple[float, ...]
    marker: str


@dataclass(frozen=True)
class SpectrumPlay:
    """How an engine plays overturning spectra beside the event-based models.

    The settings differ from its defaults: enough for outcomes, in a tenth of the time. It plays
    this share of the nodes; below 1 it draws no map.
    """

    settings: Mapping[str, Any]
    share: float = 1.0


@dataclass(frozen=True)
class BenchmarkSteps:
    """Fixed steps with which the benchmark plays an engine, s, coarse to fine.

    `diagram` are those of work and precision. Those of `convergence` beside a wall may be none.
    """

    diagram: tuple[float, ...] = (1e-2, 1e-3, 1e-4)
    convergence: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class EngineFacts:
    """What is known of an engine by its name; its class says the rest.

    `summary` says what the model is, where models are listed. An engine without `spectrum` plays no
    overturning spectra. One `in_short_studies` is played by those, too, that play few engines.
    """

    engine: type[Engine]
    label: str
    summary: str
    look: LineLook
    spectrum: SpectrumPlay | None = None
    benchmark: BenchmarkSteps = BenchmarkSteps()
    in_stress_maps: bool = False
    in_short_studies: bool = False
    #: Whether an adaptive step takes about a millisecond: quick studies play fewer of them.
    dear_adaptive_steps: bool = False
    #: What else changes at fixed steps where a scene has no wall; "" for nothing.
    changes_without_wall: str = ""

    @property
    def name(self) -> str:
        """The name of the model."""
        return self.engine.name

    @property
    def distribution(self) -> str:
        """The package that holds the engine, as pip knows it."""
        return self.engine.package or self.engine.module

    @property
    def steps_vary(self) -> bool:
        """Whether it can step adaptively."""
        return not self.engine.fixed_because
