"""What a stress run showed: failures, totals by model, the maps."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from rockcheck.validation.execute.study import Study
from rockcheck.validation.stress.players import PLAYERS
from rockcheck.validation.stress.stability import Stability


@dataclass(frozen=True)
class Failure:
    """A run that breaks an invariant; `file` holds its scene, as small as was found in time."""

    model: str
    invariant: str
    seed: int
    number: int
    figure: float
    words: str = ""
    file: str = ""


@dataclass(frozen=True, kw_only=True)
class RunTotals:
    """What some runs of one model showed, one after the other."""

    model: str
    runs: int = 0
    cpu_seconds: float = 0.0
    #: Number of runs that checked an invariant; its worst figure, and the run of that figure.
    looked_at: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int]] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()
    outcomes: Counter[str] = field(default_factory=Counter)
    events: int = 0
    #: Runs in which an impact added energy, as its law is known to do, and the most that one added.
    gaining: int = 0
    largest_gain: float = 0.0
    #: How often each modelling choice of the model was made, by its name.
    rules: Counter[str] = field(default_factory=Counter)
    #: Runs whose comparison ended at the horizon of predictability.
    horizons: int = 0
    #: Runs in which an invariant could not be judged, by its name.
    unjudged: Counter[str] = field(default_factory=Counter)

    def __add__(self, other: RunTotals) -> RunTotals:
        worst = dict(self.worst)
        for name, found in other.worst.items():
            worst[name] = max(found, worst.get(name, found))
        return RunTotals(
            model=self.model,
            runs=self.runs + other.runs,
            cpu_seconds=self.cpu_seconds + other.cpu_seconds,
            looked_at=self.looked_at + other.looked_at,
            worst=worst,
            failures=self.failures + other.failures,
            outcomes=self.outcomes + other.outcomes,
            events=self.events + other.events,
            gaining=self.gaining + other.gaining,
            largest_gain=max(self.largest_gain, other.largest_gain),
            rules=self.rules + other.rules,
            horizons=self.horizons + other.horizons,
            unjudged=self.unjudged + other.unjudged,
        )

    def failed(self, invariant: str) -> int:
        """How many runs break it."""
        return sum(failure.invariant == invariant for failure in self.failures)


@dataclass(frozen=True, kw_only=True)
class Stress(Study):
    """What was found."""

    seed: int
    complete: bool
    batches: dict[str, RunTotals]
    stability: Stability | None = None

    @property
    def broken(self) -> list[Failure]:
        """The failures of event-based models, which fail the command."""
        return [failure for label, batch in self.batches.items() if PLAYERS[label].event_based for failure in batch.failures]

    @property
    def failures(self) -> list[Failure]:
        """All failures."""
        return [failure for batch in self.batches.values() for failure in batch.failures]
