"""Invariants: conditions that hold for every history, whatever the scene.

Each invariant gives a figure, which must stay below its bound. Figures are in natural units
(lengths in R, accelerations in g, times in sqrt(R/g)), energies relative to the energy at play.

In: figures of a run. Out: which invariants it breaks. Called by all of stress.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple


class Invariant(NamedTuple):
    """A condition: what its figure means, and the largest value that is allowed."""

    words: str
    bound: float


INVARIANTS = {
    name: Invariant(words, bound)
    for name, words, bound in (
        ("ends", "the run ends within its caps, in a mode of motion (1: it does not)", 0.0),
        ("finite", "values that are not finite", 0.0),
        ("outcome", "rows, last event and outcome contradict each other (1: they do)", 0.0),
        ("penetration", "depth of a corner in floor or wall, R", 1e-9),
        ("floor", "height of the pivot over the floor in modes that have it there, R", 1e-9),
        ("stick", "slip rate of a pivot that stands, sqrt(g R)", 1e-9),
        (
            "coulomb",
            "friction beyond the cone of a pivot that stands, of the acceleration at play",
            1e-7,
        ),
        (
            "push",
            "tension in a contact that can only push, of the acceleration at play",
            1e-7,
        ),
        (
            "energy",
            "energy less the work of base and friction, between events, of the energy at play",
            1e-9,
        ),
        (
            "impacts",
            "relative energy that an impact without restitution, or with the energy cap, adds",
            0.0,
        ),
        ("mirror", "bits that differ in the mirror image", 0.0),
        ("similarity", "rotation of the scene at another scale, within the horizon, rad", 1e-6),
        ("tolerance", "rotation at tolerance/100, within the horizon, rad", 1e-6),
        (
            "clearance",
            "a wall just out of the reach of the block without walls is struck, or one just within"
            " is not (1: so it is)",
            0.0,
        ),
        (
            "decided",
            "peak of a run that ends once it is certain, against the whole run's and its rows', rad"
            " (pi: another side)",
            1e-6,
        ),
        ("extremes", "a row beyond the extremes that the model kept, R or rad", 1e-9),
        (
            "unseen",
            "an extreme beyond all dense rows, over the way between two of them",
            1.0,
        ),
        ("rows", "change of an extreme with the distance of the rows, natural units", 1e-9),
        (
            "fate",
            "histories, other rows and mirror images that contradict what is said to become of the"
            " block",
            0.0,
        ),
        (
            "ties",
            "what is not said, or wrongly, of a scene on a knife edge and of scenes beside it",
            0.0,
        ),
        (
            "storey",
            "what does not hold of a storey's motion: a rigid building's is the ground's, it is"
            " linear, has its mirror image, and does not depend on its steps",
            0.0,
        ),
        # of models that approximate contact
        (
            "depth",
            "penetration over twice the way that a step, or the contact's spring, takes at this"
            " motion",
            1.0,
        ),
        (
            "source",
            "energy beyond that of the start and the work of the base, of all work done",
            0.05,
        ),
    )
}


@dataclass(frozen=True, kw_only=True)
class CheckedRun:
    """One checked run: the figure of each invariant that was checked, and its failure, if any."""

    figures: dict[str, float]
    failure: str = ""
    outcome: str = ""
    #: "events"; "gaining": 1 where impacts added energy, as their law is known to do (see `rules`);
    #: "horizons": 1 where the horizon of predictability had to be computed.
    counts: Mapping[str, int] = field(default_factory=dict)
    #: The most energy that an impact added.
    largest_gain: float = 0.0
    #: How often each modelling choice was made.
    rules: Mapping[str, int] = field(default_factory=dict)
    #: Invariants that could not be judged.
    unjudged: tuple[str, ...] = ()

    @property
    def broken(self) -> list[str]:
        """Names of the invariants that do not hold."""
        return [name for name, value in self.figures.items() if not value <= INVARIANTS[name].bound]
