"""The tasks of a spectrum: some nodes, and what is asked of them."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.spectrum import (
    LEFT,
    RIGHT,
    SAFE,
    Floats,
    Nodes as Outcomes,
    node_scene,
    play_motions,
    play_nodes,
)
from rockcheck.scenes import Scene
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import Model, build
from rockcheck.validation.execute.pool import cores
from rockcheck.validation.study import Task
from rockcheck.validation.uncertainty import population
from rockcheck.validation.uncertainty.population import compiled

What = Literal["outcomes", "motions", "one impact"]
#: Nodes of a tile of the compiled event-based models, and of a model that is simulated one by one.
TILE, SLOW_TILE = 10_000, 20
#: What a node takes as a rule, s: compiled, simulated, and its motion.
A_NODE, A_SLOW_NODE, A_MOTION = 4e-5, 0.1, 2e-4
#: Outcomes in text, by their code from `LEFT` on; and where the run failed.
LETTERS, UNDECIDED = "LSR", "U"
#: A history is played in so many equal parts, and thinned until straight lines between the rows
#: that stay are within this much of it: of alpha in rotation, of the half width in position.
PARTS, COARSE = 400, 0.01


@dataclass(frozen=True)
class Nodes(Task):
    """Nodes of one scene's spectrum by one model; `hash` of all that their record depends on."""

    hash: str
    what: What
    scene: Scene = field(compare=False)
    amplitudes: Floats = field(compare=False)
    frequencies: Floats = field(compare=False)
    model: str = field(compare=False)
    settings: Mapping[str, Any] = field(compare=False)

    @property
    def label(self) -> str:
        """Whose nodes, and where they begin."""
        first = f"{self.frequencies[0]:.4g}, {self.amplitudes[0]:.4g}"
        return f"{self.scene.name} by {self.model}, {self.what} from {first}"

    def depends(self) -> str:
        """Its hash."""
        return self.hash


@dataclass(frozen=True)
class Played:
    """A letter a node: its outcome, or whether it overturned after one floor impact (Y or N).

    Of motions the numbers of the nodes that could be played, in their order, and their rows t (s),
    theta (rad), x, y (m) below each other as base64 of float32; `ends` says where each ends.
    """

    letters: str = ""
    played: tuple[int, ...] = ()
    ends: tuple[int, ...] = ()
    rows: str = ""


def nodes_of(
    scene: Scene,
    amplitudes: Floats,
    frequencies: Floats,
    model: str,
    settings: Mapping[str, Any],
    what: What = "outcomes",
) -> list[Nodes]:
    """The tasks that play nodes (1-D arrays of one length) of a spectrum, in order."""
    fast = compiled(build(model, settings))
    neutral = scene.replace(name="tile", description="", duration=1.0, output_step=0.02)
    how = provenance.code_digest(__name__) if fast else f"{population.SETTLE} {population.ENOUGH}"
    base = provenance.cell_key(neutral, model, settings) + what + how
    size = len(amplitudes) if what != "outcomes" else TILE if fast else SLOW_TILE
    one = A_MOTION if what == "motions" else A_NODE if fast else A_SLOW_NODE
    found = []
    for first in range(0, len(amplitudes), max(size, 1)):
        a, f = (
            np.ascontiguousarray(axis[first : first + size]) for axis in (amplitudes, frequencies)
        )
        key = provenance.digest(base + a.tobytes().hex() + f.tobytes().hex())
        how_played: dict[str, Any] = {
            "where": "here" if fast else "worker",
            "expected": one * len(a),
        }
        found.append(Nodes(key, what, scene, a, f, model, settings, **how_played))
    return found


def play(task: Nodes) -> Played:
    """What is asked of the nodes."""
    player = build(task.model, task.settings)
    if task.what == "motions":
        return _motions(task, player)
    nodes = list(zip(task.amplitudes.tolist(), task.frequencies.tolist(), strict=True))
    if task.what == "one impact":
        return Played("".join("NY"[_impacts(player, task.scene, *node) == 1] for node in nodes))
    if compiled(player):
        where = task.scene, task.amplitudes, task.frequencies
        sides, failed = play_nodes(*where, model=player, jobs=cores())
    else:
        runs = population.play([node_scene(task.scene, *node) for node in nodes], player)
        sides, failed = np.array(runs.side), np.array(runs.failed)
    letters = np.where(failed, UNDECIDED, np.array(list(LETTERS))[sides - LEFT])
    return Played("".join(letters))


def outcomes_of(letters: str) -> Outcomes:
    """Sides (-1, 0, +1) and which runs failed, of letters."""
    codes = np.frombuffer(letters.encode(), dtype=np.uint8)
    sides = np.full(len(codes), SAFE, dtype=np.int8)
    sides[codes == ord(LETTERS[0])], sides[codes == ord(LETTERS[2])] = LEFT, RIGHT
    failed: NDArray[np.bool_] = codes == ord(UNDECIDED)
    return sides, failed


def letters_of(sides: NDArray[np.int8], undecided: NDArray[np.int64]) -> NDArray[np.str_]:
    """A letter a node of a grid of sides, and of the nodes (i, j) that are undecided."""
    letters = np.array(list(LETTERS))[sides - LEFT]
    letters[tuple(undecided.T)] = UNDECIDED
    return letters


def _impacts(player: Model, scene: Scene, amplitude: float, frequency: float) -> int:
    """Floor impacts until the outcome at a node is decided."""
    node = node_scene(scene, amplitude, frequency)
    history = player.simulate(node.replace(output_step=node.duration))
    return sum(event.kind == "floor impact" for event in history.event_list)


def _motions(task: Nodes, player: Any) -> Played:
    # Needs numba, which a page of what is kept does not.
    from rockcheck.validation.studies.spectrum.thinning import enough

    where = task.scene, task.amplitudes, task.frequencies
    found = play_motions(*where, model=player, parts=PARTS, jobs=cores())
    kept, played = [], []
    for number, motion in enumerate(found):
        if motion is not None:
            block, rows = motion.block, motion.rows
            size = np.array([block.alpha, block.half_width, block.half_width])
            kept.append(rows[enough(rows[:, 0].copy(), rows[:, 1:] / size, COARSE)])
            played.append(number)
    ends = np.cumsum([len(rows) for rows in kept], dtype=int).tolist()
    content = np.concatenate(kept).astype("<f4").tobytes() if kept else b""
    return Played("", tuple(played), tuple(ends), base64.b64encode(content).decode("ascii"))
