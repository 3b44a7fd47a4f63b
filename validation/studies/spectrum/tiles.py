"""A spectrum's request, the tasks that play its nodes, and the spectra that are complete."""

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import (
    EventBasedModel,
    Spectrum,
    overturning_spectrum,
    spectrum as nodes_of_spectra,
)
from rockcheck.ebm.spectrum import (
    LEFT,
    RIGHT,
    SAFE,
    TOLERANCE,
    Motion,
    Nodes as Outcomes,
    node_scene,
    play_motions,
    play_nodes,
)
from rockcheck.engines import registry
from rockcheck.scenes import Floats, InputError, ModelFailure, Scene, kinematics
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.paper import AMPLITUDES, FREQUENCIES, Panel
from rockcheck.validation.study import Task

What = Literal["outcomes", "motions", "one impact"]
#: Nodes of a tile of the compiled event-based models, and of a model that is simulated one by one.
TILE, SLOW_TILE = 10_000, 20
#: Usual time of a node, s: compiled, simulated, and of its motion.
A_NODE, A_SLOW_NODE, A_MOTION = 4e-5, 0.1, 2e-4
#: Outcomes in text, by their code from `LEFT` on; and where the run failed.
LETTERS, UNDECIDED = "LSR", "U"
#: The share of the energy of tipping over below which the outcome is decided: a hundredth is left
#: for the model's own error. Step of the rows of a run, s.
ENOUGH, STEP = 0.99, 0.02
#: Number of equal parts of a history; bound on its distance from straight lines between the rows
#: that are kept: of alpha in rotation, of the half width in position.
PARTS, COARSE = 400, 0.01


@dataclass(frozen=True)
class Played:
    """A letter a node: its outcome, or whether it overturned after one floor impact (Y or N).

    Of motions: the numbers of the nodes that could be played, in their order, and their rows t (s),
    theta (rad), x, y (m) below each other as base64 of float32; `ends` says where each ends.
    """

    letters: str = ""
    played: tuple[int, ...] = ()
    ends: tuple[int, ...] = ()
    rows: str = ""


@dataclass(frozen=True)
class Nodes(Task):
    """Nodes of one scene's spectrum, as requested; `key` hashes all that the record depends on."""

    what: What
    scene: Scene = field(compare=False)
    amplitudes: Floats = field(compare=False)
    frequencies: Floats = field(compare=False)
    request: "Request" = field(compare=False)
    key: str = field()

    @property
    def label(self) -> str:
        """The scene, and the first of its nodes."""
        return (
            f"{self.scene.name} by {self.request.model}, {self.what} from"
            f" {self.frequencies[0]:.4g}, {self.amplitudes[0]:.4g}"
        )

    def play(self) -> Played:
        """Outcomes or motions of the nodes, or whether they overturn after one impact."""
        player: Any = models.build(self.request.model, self.request.settings)
        where = self.scene, self.amplitudes, self.frequencies
        if self.what == "motions":
            return _motions(play_motions(*where, model=player, parts=PARTS, jobs=pool.cores()))
        scenes = (
            node_scene(self.scene, *node)
            for node in zip(self.amplitudes.tolist(), self.frequencies.tolist(), strict=True)
        )
        if self.what == "one impact":
            kinds = [
                [event.kind for event in player.simulate(one).event_list]
                for one in (each.replace(output_step=each.duration) for each in scenes)
            ]
            return Played("".join("NY"[some.count("floor impact") == 1] for some in kinds))
        if not compiled(player):
            return Played("".join(_letter(one, player) for one in scenes))
        sides, failed = play_nodes(*where, model=player, jobs=pool.cores())
        return Played("".join(letters_of(sides, np.argwhere(failed))))


def compiled(player: object) -> bool:
    """Whether the model plays whole batches compiled."""
    return isinstance(player, EventBasedModel) and player.decides


def _letter(scene: Scene, player: Any) -> str:
    """The outcome of the scene of a node by a model that is simulated.

    A block that has not tipped past its balance when the base has come to rest, and has too little
    energy left to do so, is safe. Any other run is made again, up to the scene's duration; a block
    that then stands is safe.
    """
    block, quiet = scene.block, max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    needed = scene.gravity * (block.radius - block.weaker_pivot.height)
    for last in (quiet, scene.duration):  # few rows: only the outcome is needed
        try:  # the last row at `last` or after it: what the base does until then counts
            history = player.simulate(
                scene.replace(duration=STEP * max(1, math.ceil(last / STEP)), output_step=STEP)
            )
        except ModelFailure:
            return UNDECIDED
        if history.outcome.startswith("overturned"):
            return history.outcome.removeprefix("overturned ")[0].upper()
        theta, y, *rates = (
            history.channels[name][-1] for name in ("theta", "y", "x_dot", "y_dot", "theta_dot")
        )
        energy = kinematics.energy(block, scene.gravity, y, theta, *rates)
        if energy < ENOUGH * needed and abs(theta) < block.alpha:
            break
    return LETTERS[SAFE - LEFT]


def letters_of(sides: NDArray[np.int8], undecided: NDArray[np.int64]) -> NDArray[np.str_]:
    """A letter a node of an array of sides; `undecided` are indices of nodes, a row each."""
    letters = np.array(list(LETTERS))[sides - LEFT]
    letters[tuple(undecided.T)] = UNDECIDED
    return letters


def _motions(found: Sequence[Motion | None]) -> Played:
    moved = {number: motion for number, motion in enumerate(found) if motion is not None}
    if not moved:
        return Played()
    lengths = [len(motion.rows) for motion in moved.values()]
    ends, rows = np.cumsum(lengths), np.concatenate([motion.rows for motion in moved.values()])
    units = [[one.block.alpha, *[one.block.half_width] * 2] for one in moved.values()]
    chosen = enough(rows[:, 0], rows[:, 1:] / np.repeat(units, lengths, axis=0), ends, COARSE)
    return Played(
        "",
        tuple(moved),
        tuple(np.cumsum(chosen)[ends - 1].tolist()),
        base64.b64encode(rows[chosen].astype("<f4").tobytes()).decode("ascii"),
    )


def enough(t: Floats, values: Floats, ends: NDArray[np.int64], coarse: float) -> NDArray[np.bool_]:
    """Rows of some motions between which straight lines are accurate enough: the rows to keep.

    The lines are within `coarse` of all `values` (n, k) at the times `t` (n). A motion's rows end
    before each of `ends`.

    From a motion's first and last row on, each part is split at the row farthest from its straight
    line.
    """
    columns = [np.ascontiguousarray(column) for column in values.T]  # three are quicker than a row
    kept = np.zeros(len(t), dtype=np.bool_)
    kept[[0, *ends[:-1], *(ends - 1)]] = True
    waiting = np.flatnonzero(~kept)
    while waiting.size:
        nodes = np.flatnonzero(kept)
        part = np.searchsorted(nodes, waiting) - 1
        first, last = nodes[part], nodes[part + 1]
        share = (t[waiting] - t[first]) / (t[last] - t[first])
        farthest = np.zeros(len(part))
        for column in columns:
            line = (1.0 - share) * column[first] + share * column[last]
            np.maximum(farthest, np.abs(column[waiting] - line), out=farthest)
        begins = np.flatnonzero(np.diff(part, prepend=-1))
        most = np.maximum.reduceat(farthest, begins)
        most = np.repeat(most, np.diff(begins, append=len(part)))
        split = np.flatnonzero((farthest == most) & (most > coarse))
        kept[waiting[split[np.diff(part[split], prepend=-1) > 0]]] = True
        waiting = waiting[(most > coarse) & ~kept[waiting]]
    return kept


#: Event-based models that play spectra with their tolerance.
TOLERANT = ("ebm", "ebm-unilateral")
MOST_SIZE = 5000


def usual_settings(model: str) -> Mapping[str, Any]:
    """Settings of a model in spectra that differ from its defaults: enough for outcomes."""
    if model in TOLERANT:
        return {"tolerance": TOLERANCE}
    play = registry.facts_of(model).spectrum if model in models.ENGINE_NAMES else None
    return play.settings if play else {}


@dataclass(frozen=True)
class Request:
    """Grid, model and settings with which spectra are played.

    `frequencies` (omega_p/p) and `amplitudes` (a_p/(g tan alpha)) are those of the nodes. Raises
    `InputError` where the model cannot play them.
    """

    size: int = 100
    frequency_range: tuple[float, float] = FREQUENCIES
    amplitude_range: tuple[float, float] = AMPLITUDES
    model: str = "ebm"
    settings: Mapping[str, Any] = field(default_factory=dict)
    refine: bool = False
    #: Frequency and amplitude ratio of a pulse to be played itself: the nearest line of nodes of
    #: each axis moves there, unless it lies beyond the axis.
    through: tuple[float, float] | None = None
    frequencies: Floats = field(init=False, compare=False)
    amplitudes: Floats = field(init=False, compare=False)

    def __post_init__(self) -> None:
        if not 2 <= self.size <= MOST_SIZE:
            raise InputError(
                f"{self.size} is not allowed: give 2 to {MOST_SIZE} nodes an axis", "--size"
            )
        usual, asked = usual_settings(self.model), self.settings
        fixed = "time_step" in asked or asked.get("settings") == "default"
        settings = {**({} if fixed and "largest_step" in usual else usual), **asked}
        object.__setattr__(self, "settings", settings)
        models.build(self.model, settings)
        for name, (low, high) in (
            ("frequencies", self.frequency_range),
            ("amplitudes", self.amplitude_range),
        ):
            usable = 0.0 < low < math.inf and math.isfinite(high)
            if not usable or low >= high:
                what = "the lower end comes first" if usable else "give positive finite numbers"
                raise InputError(f"{low:g} to {high:g} is not allowed: {what}", f"--{name}")
            object.__setattr__(self, name, np.linspace(low, high, self.size))
        if self.through is not None:
            frequency, amplitude = self.through
            object.__setattr__(self, "frequencies", moved_to(self.frequencies, frequency))
            object.__setattr__(self, "amplitudes", moved_to(self.amplitudes, amplitude))

    def nodes(
        self, scene: Scene, amplitudes: Floats, frequencies: Floats, what: What = "outcomes"
    ) -> list[Nodes]:
        """The tasks that play nodes (1-D arrays of one length) of a scene's spectrum, in order."""
        fast = compiled(models.build(self.model, self.settings))
        neutral = scene.replace(name="tile", description="", duration=1.0, output_step=STEP)
        how = (
            provenance.code_digest(__name__)
            if fast
            else provenance.sources_digest(__file__, nodes_of_spectra.__file__)
        )
        base = provenance.cell_key(neutral, self.model, self.settings) + what + how
        size = len(amplitudes) if what != "outcomes" else TILE if fast else SLOW_TILE
        one = A_MOTION if what == "motions" else A_NODE if fast else A_SLOW_NODE
        parts = (
            [np.ascontiguousarray(axis[first : first + size]) for axis in (amplitudes, frequencies)]
            for first in range(0, len(amplitudes), max(size, 1))
        )
        return [
            Nodes(
                what,
                scene,
                a,
                f,
                self,
                provenance.digest(base + a.tobytes().hex() + f.tobytes().hex()),
                expected=one * len(a),
                where="here" if fast else "worker",
            )
            for a, f in parts
        ]


def moved_to(axis: Floats, value: float) -> Floats:
    """The axis with its nearest node moved to `value`; as it is where that lies beyond its ends."""
    if not axis[0] <= value <= axis[-1]:
        return axis
    moved = axis.copy()
    moved[int(np.argmin(np.abs(axis - value)))] = value
    return moved


class _Waiting(Exception):
    """Nodes that a spectrum needs have not been played."""


@dataclass
class Book:
    """The nodes that have been played, and those still to be played."""

    done: Mapping[Any, Any]
    wanted: list[Nodes] = field(default_factory=list)

    def ask(self, tasks: Sequence[Nodes]) -> list[Played]:
        """Their records; nodes of a task that failed, or is still to be played, are undecided."""
        self.wanted += [task for task in tasks if task not in self.done]
        return [
            one
            if isinstance(one := self.done.get(task), Played)
            else Played(UNDECIDED * len(task.amplitudes))
            for task in tasks
        ]

    def outcomes(self, tasks: Sequence[Nodes]) -> Outcomes:
        """Sides (-1, 0, +1) and failures of the nodes of these tasks."""
        letters = np.array([*"".join(one.letters for one in self.ask(tasks))])
        return np.select(
            [letters == LETTERS[side - LEFT] for side in (LEFT, RIGHT)], [LEFT, RIGHT], SAFE
        ).astype(np.int8), letters == UNDECIDED

    def spectrum(self, panel: Panel, request: Request) -> Spectrum | None:
        """A spectrum; None where nodes are still to be played.

        Refinement then begins again with all that is known.
        """
        before = len(self.wanted)

        def known(scene: Scene, a: Floats, f: Floats) -> Outcomes:
            found = self.outcomes(request.nodes(scene, a, f))
            if len(self.wanted) > before:
                raise _Waiting
            return found

        try:
            return overturning_spectrum(
                panel.scene,
                request.frequencies,
                request.amplitudes,
                refine=request.refine,
                play=known,
            )
        except _Waiting:
            return None


def differing(spectrum: Spectrum, others: Sequence[Spectrum]) -> NDArray[np.int64]:
    """The decided nodes (i, j), a row each, that differ from a decided one of another spectrum."""
    own, *laws = (letters_of(one.outcomes, one.undecided) for one in (spectrum, *others))
    decided = own != UNDECIDED
    return np.argwhere(
        np.any([decided & (law != UNDECIDED) & (law != own) for law in laws], axis=0)
    )
