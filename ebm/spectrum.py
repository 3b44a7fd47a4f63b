"""Overturning spectra: outcomes over pulse frequency and amplitude (the paper's Figs. 6 to 9)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes import (
    Block,
    Floats,
    InputError,
    Pulse,
    Record,
    Scene,
    Shown,
    errors,
    progress,
)

if TYPE_CHECKING:
    from rockcheck.ebm.core.state import Rows

MOST_NODES = 50_000_000
#: Tolerance (alpha) of the model that plays a spectrum by default: far too small to move a boundary
#: by a node.
TOLERANCE = 4e-8
#: Of a refined spectrum: distance of the nodes that are run first, the fewest cells an axis that
#: they may leave, and how far (in nodes) around a boundary nothing is inferred: hairs thinner than
#: the nodes' distance break into dots, which are found so.
COARSEST, FEWEST_CELLS, FOLLOWED = 8, 12, 3
#: A node's scene goes on in calm, after the motion of the base: for at least this time, s, and so
#: many 1/p.
CALM, FALLS = 6.0, 12.8
#: The outcome codes of a spectrum.
LEFT, SAFE, RIGHT = -1, 0, 1
_UNKNOWN = 9
#: Results of nodes: their sides, and whether the run failed.
Nodes = tuple[NDArray[np.int8], NDArray[np.bool_]]
#: Plays nodes of a spectrum: scene, amplitude ratios and frequency ratios (1-D, of one length) to
#: sides and failures, see `play_nodes`.
Player = Callable[[Scene, Floats, Floats], Nodes]


@dataclass(frozen=True, kw_only=True, eq=False)
class Spectrum(Shown):
    """Outcomes over frequency and amplitude, or over block size and scale of a record.

    See `overturning_spectrum`.

    `outcomes[i, j]` is -1 (overturned left, counterclockwise), 0 (safe) or +1 (right, clockwise) at
    `amplitude_ratios[i]` (a_p / (g tan alpha)) and `frequency_ratios[j]` (omega_p / p).
    `evaluations` counts the runs, fewer than nodes where only the boundary was refined. `undecided`
    lists the nodes (i, j) whose run failed, or was given up before anything decided it: their
    outcome says 0, but `safe` excludes them.
    `depends_on_law` lists the nodes whose outcome changes under another law of impacts; None where
    that was not checked.
    """

    outcomes: NDArray[np.int8]
    frequency_ratios: Floats
    amplitude_ratios: Floats
    evaluations: int
    undecided: NDArray[np.int64]
    scene: Scene
    model: EventBasedModel | None
    depends_on_law: NDArray[np.int64] | None = None

    @property
    def safe(self) -> NDArray[np.bool_]:
        """Which nodes are safe."""
        safe: NDArray[np.bool_] = self.outcomes == SAFE
        safe[tuple(self.undecided.T)] = False
        return safe

    @property
    def safe_area(self) -> float:
        """Share of nodes that are safe."""
        return float(np.mean(self.safe))

    def least_overturning_amplitude(self) -> Floats:
        """Lowest overturning amplitude ratio at each frequency ratio; NaN where none overturns."""
        fallen = self.outcomes != SAFE
        first = np.argmax(fallen, axis=0)
        return np.where(fallen.any(axis=0), self.amplitude_ratios[first], np.nan)


def overturning_spectrum(
    scene: Scene,
    frequency_ratios: ArrayLike,
    amplitude_ratios: ArrayLike,
    *,
    model: EventBasedModel | None = None,
    refine: bool = False,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
    play: Player | None = None,
) -> Spectrum:
    """The outcomes of a scene under pulses of its own kind, each run until its outcome is decided.

    `frequency_ratios` (omega_p/p) and `amplitude_ratios` (a_p/(g tan alpha)) are increasing,
    positive and finite. `scene` gives block, floor, walls, the kind of pulse and
    its direction, the sign of its amplitude; its duration and the pulse's own size are not used.
    Where the scene's excitation is a record, `frequency_ratios` are sizes of the block relative to
    its own (the gaps stay as they are) and `amplitude_ratios` multiply the record. With `refine`
    only every eighth node is run at first (more of a small grid), then those between nodes that
    differ (and their neighbours). `jobs` threads, default all cores; `on_progress` gets the nodes
    done by `model`. `play` runs the nodes elsewhere or by another model, instead of `model` here.
    Raises `InputError`.
    """
    frequencies, amplitudes = (
        _axis(frequency_ratios, "frequency_ratios"),
        _axis(amplitude_ratios, "amplitude_ratios"),
    )
    if len(frequencies) * len(amplitudes) > MOST_NODES:
        raise InputError(
            f"{len(frequencies)} x {len(amplitudes)} nodes are more than {MOST_NODES}",
            "frequency_ratios",
        )
    errors.check_kind(scene, Scene, "load_scene", "scene")
    if not isinstance(scene.excitation, Pulse | Record):
        raise InputError(
            f"{scene.excitation.kind!r} is not allowed: a spectrum needs a pulse, or a record",
            "excitation.kind",
        )
    outcomes = np.full((len(amplitudes), len(frequencies)), _UNKNOWN, dtype=np.int8)
    undecided = np.zeros(outcomes.shape, dtype=bool)
    evaluations = 0
    if play is None:
        model = model or EventBasedModel(tolerance=TOLERANCE)
        errors.check_kind(model, EventBasedModel, "EventBasedModel()", "model")
        model.check(scene)

        play = partial(
            play_nodes,
            model=model,
            jobs=jobs,
            on_progress=lambda done, total, what="": on_progress(evaluations + done, outcomes.size),
        )

    def run(nodes: NDArray[np.bool_]) -> None:
        nonlocal evaluations
        i, j = np.nonzero(nodes & (outcomes == _UNKNOWN))
        if len(i):
            outcomes[i, j], undecided[i, j] = play(scene, amplitudes[i], frequencies[j])
            evaluations += len(i)

    if refine:
        _refine(outcomes, run)
    else:
        run(np.ones(outcomes.shape, dtype=bool))
    return Spectrum(
        outcomes=outcomes,
        frequency_ratios=frequencies,
        amplitude_ratios=amplitudes,
        evaluations=evaluations,
        undecided=np.argwhere(undecided),
        scene=scene,
        model=model,
    )


def play_nodes(
    scene: Scene,
    amplitude_ratios: Floats,
    frequency_ratios: Floats,
    *,
    model: EventBasedModel,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Nodes:
    """Outcomes at nodes of a spectrum: sides (-1, 0, +1), and whether the run has none.

    The ratios are 1-D arrays of one length. A run that fails is made once more at a hundredth of
    the tolerance.
    """
    from rockcheck.ebm import batch

    packed = _packed(scene, amplitude_ratios, frequency_ratios, model)
    found = batch.run_decided(packed, model, jobs=jobs, on_progress=on_progress)
    return found.side, found.failed | found.undecided


def _packed(
    scene: Scene, amplitude_ratios: Floats, frequency_ratios: Floats, model: EventBasedModel
) -> Rows:
    from rockcheck.ebm import batch

    if scene.excitation.kind == "record":
        return batch.pack(
            [
                node_scene(scene, a, f)
                for a, f in zip(amplitude_ratios, frequency_ratios, strict=True)
            ],
            model,
        )
    return batch.pack_pulses(scene, model, *node_pulse(scene, amplitude_ratios, frequency_ratios))


@dataclass(frozen=True)
class Motion:
    """The motion at one node, and its outcome.

    `rows` has t (s), theta (rad), x and y (m), fewer rows where the node's `block` overturns.
    """

    block: Block
    rows: Floats
    outcome: str


def play_motions(
    scene: Scene,
    amplitude_ratios: Floats,
    frequency_ratios: Floats,
    *,
    model: EventBasedModel,
    parts: int,
    jobs: int | None = None,
) -> list[Motion | None]:
    """The motion at nodes of a spectrum, None where the run failed.

    The ratios are 1-D arrays of one length. Each motion lasts as long as its `node_scene`, and has
    a row at its start and at the ends of `parts` equal parts.
    """
    from rockcheck.ebm import batch, natural

    nodes = zip(amplitude_ratios.tolist(), frequency_ratios.tolist(), strict=True)
    # The nodes of a record are blocks of other sizes; the length of a pulse is its period's.
    changing = scene.excitation.kind == "record"
    made = cache(partial(node_scene, scene))
    played = [made(a if changing else 1.0, f) for a, f in nodes]
    lengths = np.array([one.duration / natural.time_unit(one) for one in played])
    packed = _packed(scene, amplitude_ratios, frequency_ratios, model)
    packed.given["duration"], packed.given["output_step"] = lengths, lengths / parts
    found = batch.run_batch(
        packed, model, until_decided=False, rows=parts + 1, strict=False, jobs=jobs
    )
    motions: list[Motion | None] = []
    for one, failed, side, run, states in zip(
        played, found.failed, found.side, found.runs, found.out, strict=True
    ):
        x, y, theta = natural.to_si(one, states[: max(int(run.rows), 1)])[:, :3].T
        t = one.duration / parts * np.arange(len(theta))
        upright = np.logical_and.accumulate(np.abs(theta) < 0.5 * math.pi)
        rows = np.column_stack([t, theta, x, y])[: max(int(upright.sum()), 1)]
        outcome = {LEFT: "overturned left", RIGHT: "overturned right"}.get(
            int(side), "at rest" if run.at_rest else "moving"
        )
        motions.append(None if failed else Motion(one.block, rows, outcome))
    return motions


def node_scene(
    scene: Scene, amplitude_ratio: float, frequency_ratio: float, settle: float = CALM
) -> Scene:
    """The scene of one node of a spectrum, for any model to play.

    It lasts until `settle` s after the motion of the base; longer where the block is so large that
    it falls more slowly, see `FALLS`.
    """
    block, excitation, ratio = scene.block, scene.excitation, float(frequency_ratio)
    if isinstance(excitation, Record):
        block, excitation = block.scaled(ratio), excitation.scaled(float(amplitude_ratio))
    else:
        amplitude, period = node_pulse(scene, float(amplitude_ratio), ratio)
        excitation = excitation.replace(amplitude=amplitude, period=period)
    return scene.replace(
        block=block,
        excitation=excitation,
        duration=max(excitation.quiet_after, scene.vertical.quiet_after)
        + max(settle, FALLS / block.weaker_pivot.frequency_parameter(scene.gravity)),
    )


def node_pulse(scene: Scene, amplitude_ratio: Any, frequency_ratio: Any) -> tuple[Any, Any]:
    """Amplitude (m/s^2) and period (s) of the pulse of one node, or of many.

    They are a = A g tan(alpha), of the sign of the scene's own pulse, and T = 2 pi/(F p), with the
    frequency parameter p.
    """
    sign = math.copysign(1.0, getattr(scene.excitation, "amplitude", 1.0))
    amplitude = sign * amplitude_ratio * scene.gravity * scene.block.slope
    return amplitude, 2.0 * math.pi / (frequency_ratio * scene.frequency_parameter)


def _refine(outcomes: NDArray[np.int8], run: Callable[[NDArray[np.bool_]], None]) -> None:
    """Fills `outcomes`: a coarse grid, halved again and again where corners of a cell differ.

    Each halving runs the nodes of these cells and of a ring of cells around them. The coarse grid
    has every eighth node, or more of them where that would be fewer than a dozen cells an axis. At
    last the boundary is followed: no node near one of another outcome is left to inference, so that
    a thin tongue is found to its tip.
    """
    from scipy import ndimage

    rows, columns = outcomes.shape
    inferred = np.zeros(outcomes.shape, dtype=bool)
    step = COARSEST
    while step > 1 and min(rows, columns) - 1 < FEWEST_CELLS * step:
        step //= 2
    lattice = _lattice(rows, columns, step)
    run(lattice)
    while step > 1:
        half = step // 2
        corners = outcomes[np.ix_(lattice.any(axis=1), lattice.any(axis=0))]
        differs = vary(corners, 2)[1:, 1:]  # in the cells that end at these corners
        near = ndimage.binary_dilation(differs, np.ones((3, 3)))  # and a ring of cells around each
        inside = np.pad(near.repeat(step, axis=0).repeat(step, axis=1), (0, 1))
        # A node at the end of a cell is in it, too.
        wanted = ndimage.maximum_filter(inside, 2, mode="constant")[:rows, :columns]
        lattice = _lattice(rows, columns, half)
        run(wanted & lattice)
        # Cells without a boundary are uniform: their inner nodes take the value of a corner.
        open_nodes = lattice & (outcomes == _UNKNOWN)
        i, j = np.nonzero(open_nodes)
        outcomes[i, j] = outcomes[i // step * step, j // step * step]
        inferred |= open_nodes
        step = half
    while (doubtful := inferred & vary(outcomes, 2 * FOLLOWED + 1)).any():
        inferred &= ~doubtful
        outcomes[doubtful] = _UNKNOWN
        run(doubtful)


def vary(outcomes: NDArray[np.int8], width: int) -> NDArray[np.bool_]:
    """Where the outcomes are not all the same in the square of `width` nodes around a node.

    A square of two nodes ends at the node.
    """
    from scipy import ndimage

    least, most = (
        extreme(outcomes, width, mode="nearest")
        for extreme in (ndimage.minimum_filter, ndimage.maximum_filter)
    )
    return np.asarray(least != most)


def _lattice(rows: int, columns: int, step: int) -> NDArray[np.bool_]:
    """Every `step`-th node of each axis, and the last one."""
    places = np.arange(rows), np.arange(columns)
    i, j = ((place % step == 0) | (place == place[-1]) for place in places)
    return i[:, None] & j


def _axis(values: ArrayLike, key: str) -> Floats:
    try:
        axis = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("numbers are asked for", key) from None
    if axis.ndim != 1 or axis.size == 0:
        raise InputError(
            f"{axis.size} values of {axis.ndim} dimensions; a list of at least one number is asked"
            " for",
            key,
        )
    if not np.all(np.isfinite(axis)) or np.any(axis.ravel()[:1] <= 0.0):
        raise InputError("positive finite numbers are asked for", key)
    if np.any(np.diff(axis.ravel()) <= 0.0):
        raise InputError("increasing numbers are asked for", key)
    return axis
