"""Speed of the event-based model: compiled batches on one core, as microseconds and as
right-hand-side evaluations; cold starts."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import Packed, pack, pack_pulses, run_batch
from rockcheck.ebm.core.ground import Ground, acceleration
from rockcheck.scenes import Floor, ModelFailure, Ricker, Scene, Wall, load_scene
from rockcheck.scenes.compiled import kernel
from rockcheck.scenes.scene import PAPER_BLOCK

Floats = NDArray[np.float64]
#: The grid of Ricker pulses: omega_p/p, a_p/(g tan alpha), and its nodes along each axis.
FREQUENCY_RATIOS, AMPLITUDE_RATIOS, NODES = (0.5, 8.0), (1.0, 12.0), 100
TOLERANCES = (1e-6, 1e-7, 4e-8, 1e-8, 1e-9, 1e-10, 1e-12)
REFERENCE_TOLERANCE, ROUNDS = 1e-14, 3
#: The error at which a trajectory's cost is given: 95th percentile of the peak's error, rad.
LEVEL = 1e-8
#: Runs of a batch whose cost is taken whole, packing included; and in a quick benchmark.
SIZES, QUICK_SIZES = (1, 10, 100, 1000, 10_000, 100_000, 1_000_000), (1, 100, 10_000)


@dataclass(frozen=True)
class BatchCase:
    """A batch: what it is, the model's settings, and how its runs are packed."""

    name: str
    words: str
    settings: dict[str, Any]
    packed: Callable[[EventBasedModel, int], Packed]
    until_decided: bool = True


@dataclass(frozen=True)
class BatchTime:
    """A batch at one tolerance: cost of a trajectory, and what it is wrong by against
    `REFERENCE_TOLERANCE`.

    `cpu` and `wall` in s (medians), `evaluations` the CPU time in right-hand-side evaluations,
    `error_95` and `error_50` percentiles of the peak's error in rad, `wrong` outcomes that differ,
    `failed` runs without outcome. `right_hand_side` is the time of one evaluation in the same
    rounds, s.
    """

    case: str
    tolerance: float
    runs: int
    cpu: float
    wall: float
    evaluations: float
    error_50: float
    error_95: float
    wrong: int
    failed: int
    right_hand_side: float = math.nan


@dataclass(frozen=True)
class ColdStart:
    """Seconds in a fresh process: importing the package, and its first simulation (compiler's
    import included)."""

    cache: str
    importing: float
    first_simulation: float


@dataclass(frozen=True)
class BatchSize:
    """What a batch of so many random pulses (μ 0.3, no wall) takes whole with so many threads,
    packing included: s a run (median)."""

    runs: int
    threads: int
    wall: float


def at_level(rows: Sequence[BatchTime], case: str) -> BatchTime | None:
    """The cheapest tolerance whose p95 error is at most `LEVEL`, None where there is none."""
    good = [row for row in rows if row.case == case and row.error_95 <= LEVEL]
    return min(good, key=lambda row: row.cpu, default=None)


def _scene(*walls: Wall, friction: float = 0.3) -> Scene:
    pulse = Ricker(amplitude=1.0, period=1.0)
    return Scene(
        name="grid",
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=pulse,
        duration=10.0,
    )


def grid(scene: Scene, nodes: int) -> tuple[Floats, Floats]:
    """Amplitudes (m/s^2) and periods (s) of the grid of pulses, `nodes` along each axis."""
    frequency, amplitude = np.meshgrid(
        np.linspace(*FREQUENCY_RATIOS, nodes), np.linspace(*AMPLITUDE_RATIOS, nodes)
    )
    return _pulse(scene, frequency.ravel(), amplitude.ravel())


def _pulse(scene: Scene, frequency: Floats, amplitude: Floats) -> tuple[Floats, Floats]:
    """Amplitudes (m/s^2) and periods (s) of pulses whose frequency is given over p, whose amplitude
    over g tan(alpha)."""
    strength = amplitude * scene.gravity * math.tan(scene.block.alpha)
    return strength, 2.0 * math.pi / (frequency * scene.frequency_parameter)


def _pulses(scene: Scene) -> Callable[[EventBasedModel, int], Packed]:
    return lambda model, nodes: pack_pulses(scene, model, *grid(scene, nodes))


def _records(model: EventBasedModel, nodes: int) -> Packed:
    """El Centro at `nodes` scales from 1.4 to 1.8, to the record's end."""
    scene = load_scene("fig4a")
    louder = (
        scene.excitation.scaled(scale / 1.6) for scale in np.linspace(1.4, 1.8, nodes).tolist()
    )
    return pack(
        [
            scene.replace(excitation=record, duration=scene.excitation.quiet_after)
            for record in louder
        ],
        model,
    )


_WALL = Wall(side="left", gap=0.053)
CASES = (
    BatchCase("pure rocking", "no slip, no wall", {"friction": "no-slip"}, _pulses(_scene())),
    BatchCase("friction", "μ 0.3, no wall", {}, _pulses(_scene())),
    BatchCase("wall", "μ 0.3, left wall at 53 mm, e 0", {}, _pulses(_scene(_WALL))),
    BatchCase(
        "unilateral, wall", "the same, unilateral", {"pivot": "unilateral"}, _pulses(_scene(_WALL))
    ),
    BatchCase(
        "El Centro",
        "31 s of El Centro × 1.4 to 1.8, μ 0.3, to the end",
        {},
        _records,
        until_decided=False,
    ),
)


def batch_size(runs: int, threads: int) -> BatchSize:
    """Times a batch of so many random pulses on so many threads."""
    scene, model = _scene(), EventBasedModel(tolerance=LEVEL)
    random = np.random.default_rng(1)
    pulses = _pulse(
        scene, random.uniform(*FREQUENCY_RATIOS, runs), random.uniform(*AMPLITUDE_RATIOS, runs)
    )
    taken = []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        run_batch(pack_pulses(scene, model, *pulses), model, strict=False, jobs=threads)
        taken.append((time.perf_counter() - began) / runs)
    return BatchSize(runs, threads, median(taken))


def batch_times(name: str, nodes: int = NODES) -> list[BatchTime]:
    """A case's cost on one core, a row a tolerance, played in turn with the time of one right-hand
    side."""
    case = next(case for case in CASES if case.name == name)
    reference_model = EventBasedModel(tolerance=REFERENCE_TOLERANCE, **case.settings)
    packed = case.packed(reference_model, nodes)
    play = partial(run_batch, packed, until_decided=case.until_decided, strict=False, jobs=1)
    reference = play(reference_model)
    cpu: dict[float, list[float]] = {tolerance: [] for tolerance in TOLERANCES}
    wall: dict[float, list[float]] = {tolerance: [] for tolerance in TOLERANCES}
    found, ones = {}, []
    for _ in range(ROUNDS):
        ones.append(right_hand_side_seconds())
        for tolerance in TOLERANCES:
            model = EventBasedModel(tolerance=tolerance, **case.settings)
            began, began_cpu = time.perf_counter(), time.process_time()
            found[tolerance] = play(model)
            cpu[tolerance].append((time.process_time() - began_cpu) / len(packed))
            wall[tolerance].append((time.perf_counter() - began) / len(packed))
    one, rows = median(ones), []
    for tolerance, outcomes in found.items():
        error = np.abs(outcomes.peak - reference.peak)
        rows.append(
            BatchTime(
                case=case.name,
                tolerance=tolerance,
                runs=len(packed),
                cpu=median(cpu[tolerance]),
                wall=median(wall[tolerance]),
                evaluations=median(cpu[tolerance]) / one,
                error_50=float(np.quantile(error, 0.5)),
                error_95=float(np.quantile(error, 0.95)),
                wrong=int(np.count_nonzero(outcomes.side != reference.side)),
                failed=int(np.count_nonzero(outcomes.failed)),
                right_hand_side=one,
            )
        )
    return rows


@kernel
def _right_hand_sides(ground: Ground, alpha: float, count: int) -> float:
    """(3) in natural units, `count` times, each at a place that depends on the one before."""
    theta = 0.1 * alpha
    for k in range(count):
        turn = 0.75 * (
            acceleration(ground, 1e-6 * k) * math.cos(alpha - theta) - math.sin(alpha - theta)
        )
        theta += 1e-12 * turn
    return theta


def right_hand_side_seconds(count: int = 400_000) -> float:
    """CPU seconds of one evaluation of the rocking equation under a Ricker pulse: sin, cos, exp and
    a polynomial."""
    from rockcheck.ebm import natural

    ground = natural.base_of(_scene()).horizontal
    _right_hand_sides(ground, PAPER_BLOCK.alpha, 1)
    taken = []
    for _ in range(5):
        began = time.process_time()
        _right_hand_sides(ground, PAPER_BLOCK.alpha, count)
        taken.append((time.process_time() - began) / count)
    return median(taken)


_FRESH = """
import time
began = time.perf_counter()
import rockcheck.ebm
imported = time.perf_counter()
from rockcheck.scenes import load_scene
scene = load_scene("fig5a")
loaded = time.perf_counter()
rockcheck.ebm.EventBasedModel().simulate(scene)
print(imported - began, time.perf_counter() - loaded)
"""


def cold_start(*, cached: bool) -> ColdStart:
    """Import and first simulation in fresh processes, without compile cache, or (median of three)
    with it."""
    with tempfile.TemporaryDirectory() as folder:
        fresh = dict(os.environ) if cached else {**os.environ, "NUMBA_CACHE_DIR": folder}
        if not cached:
            return ColdStart("none", *_cold_start(fresh))
        _cold_start(fresh)
        return ColdStart(
            "filled",
            *(
                median(column)
                for column in zip(*(_cold_start(fresh) for _ in range(3)), strict=True)
            ),
        )


def _cold_start(environment: dict[str, str]) -> tuple[float, float]:
    played = subprocess.run(
        [sys.executable, "-c", _FRESH], env=environment, capture_output=True, text=True, check=False
    )
    if played.returncode:
        raise ModelFailure(
            f"ebm: no fresh process could be started: {played.stderr.strip().splitlines()[-1:]}"
        )
    importing, first = map(float, played.stdout.split()[-2:])
    return importing, first
