"""Timings of compiled batches and of cold starts.

In: a case, a number of runs, a state of the cache. Out: times, of the event-based model on one
core, in seconds and in right-hand-side evaluations. Called by the study, one case a task.
"""

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

from rockcheck.ebm import EventBasedModel, natural, spectrum
from rockcheck.ebm.batch import pack, pack_pulses, run_batch
from rockcheck.ebm.right_hand_side import right_hand_sides
from rockcheck.scenes import (
    PAPER_BLOCK,
    Floats,
    ModelFailure,
    Scene,
    Wall,
    load_scene,
)
from rockcheck.validation.studies.work_precision.benchmark_scenes import pulse

#: The grid of Ricker pulses: omega_p/p, a_p/(g tan alpha), and its nodes along each axis.
FREQUENCY_RATIOS, AMPLITUDE_RATIOS, NODES = (0.5, 8.0), (1.0, 12.0), 100
TOLERANCES = (1e-6, 1e-7, 4e-8, 1e-8, 1e-9, 1e-10, 1e-12)
REFERENCE_TOLERANCE, ROUNDS = 1e-14, 3
#: Evaluations of the right-hand side that are timed together, and the time between two, in natural
#: units: so short that the block stays where it is.
EVALUATIONS, A_STEP = 400_000, 1e-6
#: The error at which a trajectory's cost is given: 95th percentile of the peak's error, rad.
LEVEL = 1e-8
#: Runs of a batch whose cost is taken whole, packing included; and in a quick benchmark.
SIZES, QUICK_SIZES = (1, 10, 100, 1000, 10_000, 100_000, 1_000_000), (1, 100, 10_000)


@dataclass(frozen=True)
class BatchTime:
    """A batch at one tolerance: cost of a trajectory, and its error.

    Errors are against `REFERENCE_TOLERANCE`. `cpu` and `wall` in s (medians), `evaluations` the CPU
    time in right-hand-side evaluations, `error_95` and `error_50` percentiles of the peak's error
    in rad, `wrong` outcomes that differ, `failed` runs without outcome. `right_hand_side` is the
    time of one evaluation in the same rounds, s.
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
    """Seconds in a fresh process: importing the package, and its first simulation.

    The import of the compiler is part of the simulation.
    """

    cache: str
    importing: float
    first_simulation: float


@dataclass(frozen=True)
class BatchSize:
    """Wall time of a run (s, median) in a batch of random pulses, packing included.

    The batch has `runs` pulses (μ 0.3, no wall) on `threads` threads.
    """

    runs: int
    threads: int
    wall: float


def at_level(rows: Sequence[BatchTime], case: str) -> BatchTime | None:
    """The cheapest tolerance whose p95 error is at most `LEVEL`, None where there is none."""
    return min(
        [row for row in rows if row.case == case and row.error_95 <= LEVEL],
        key=lambda row: row.cpu,
        default=None,
    )


#: The scene of the batches, whose pulse is another in each run.
PLAIN = pulse(4.5, 4.0, 0.3).replace(duration=10.0)


def grid(scene: Scene, nodes: int) -> tuple[Floats, Floats]:
    """Amplitudes (m/s^2) and periods (s) of the grid of pulses, `nodes` along each axis."""
    frequency, amplitude = np.meshgrid(
        np.linspace(*FREQUENCY_RATIOS, nodes), np.linspace(*AMPLITUDE_RATIOS, nodes)
    )
    return spectrum.node_pulse(scene, amplitude.ravel(), frequency.ravel())


BESIDE = PLAIN.replace(walls=(Wall(side="left", gap=0.053),))
#: The batches by name: what each is, the model's settings, and the scene that is played under a
#: grid of pulses; None: El Centro at several scales, to the end.
CASES: dict[str, tuple[str, dict[str, Any], Scene | None]] = {
    "pure rocking": ("no slip, no wall", {"friction": "no-slip"}, PLAIN),
    "friction": ("μ 0.3, no wall", {}, PLAIN),
    "wall": ("μ 0.3, left wall at 53 mm, e 0", {}, BESIDE),
    "unilateral, wall": ("the same, unilateral", {"pivot": "unilateral"}, BESIDE),
    "El Centro": ("31 s of El Centro × 1.4 to 1.8, μ 0.3, to the end", {}, None),
}


def batch_size(runs: int, threads: int) -> BatchSize:
    """Times a batch of `runs` random pulses on `threads` threads."""
    scene, model = PLAIN, EventBasedModel(tolerance=LEVEL)
    random = np.random.default_rng(1)
    frequencies = random.uniform(*FREQUENCY_RATIOS, runs)
    pulses = spectrum.node_pulse(scene, random.uniform(*AMPLITUDE_RATIOS, runs), frequencies)
    cost = timed(
        lambda _: run_batch(pack_pulses(scene, model, *pulses), model, strict=False, jobs=threads),
        runs,
        clock=time.perf_counter,
    )
    return BatchSize(runs, threads, 1e-6 * median(cost() for _ in range(ROUNDS)))


def batch_times(name: str, nodes: int = NODES) -> list[BatchTime]:
    """A case's cost on one core, a row a tolerance.

    Its runs are `nodes` pulses along each axis of the grid, or `nodes` scales of El Centro. All
    tolerances are played in turn with the timing of one right-hand side.
    """
    _, settings, pulsed = CASES[name]
    reference_model = EventBasedModel(tolerance=REFERENCE_TOLERANCE, **settings)
    if pulsed is not None:
        packed = pack_pulses(pulsed, reference_model, *grid(pulsed, nodes))
    else:
        scene = load_scene("fig4a")
        whole = scene.replace(duration=scene.excitation.quiet_after)
        packed = pack(
            [
                whole.replace(excitation=scene.excitation.scaled(scale / 1.6))
                for scale in np.linspace(1.4, 1.8, nodes).tolist()
            ],
            reference_model,
        )
    play = partial(run_batch, packed, until_decided=pulsed is not None, strict=False, jobs=1)
    reference = play(reference_model)
    costs: dict[float, list[tuple[float, float]]] = {tolerance: [] for tolerance in TOLERANCES}
    ground = natural.base_of(PLAIN).horizontal
    equation = ground, PAPER_BLOCK.alpha, A_STEP
    right_hand_sides(*equation, 1)
    right_hand_side = timed(lambda _: right_hand_sides(*equation, EVALUATIONS), EVALUATIONS)
    found, ones, rows = {}, [], []
    for _ in range(ROUNDS):
        ones.append(1e-6 * median(right_hand_side() for _ in range(5)))
        for tolerance in TOLERANCES:
            model = EventBasedModel(tolerance=tolerance, **settings)
            began, began_cpu = time.perf_counter(), time.process_time()
            found[tolerance] = play(model)
            costs[tolerance].append((time.process_time() - began_cpu, time.perf_counter() - began))
    for tolerance, outcomes in found.items():
        error, one = np.abs(outcomes.runs["peak"] - reference.runs["peak"]), median(ones)
        cpu, wall = (
            median(some) / len(packed.given) for some in zip(*costs[tolerance], strict=True)
        )
        rows.append(
            BatchTime(
                case=name,
                tolerance=tolerance,
                runs=len(packed.given),
                cpu=cpu,
                wall=wall,
                evaluations=cpu / one,
                error_50=float(np.quantile(error, 0.5)),
                error_95=float(np.quantile(error, 0.95)),
                wrong=int(np.count_nonzero(outcomes.side != reference.side)),
                failed=int(np.count_nonzero(outcomes.failed)),
                right_hand_side=one,
            )
        )
    return rows


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


def cold_start(*, cached: bool, times: int = 1) -> ColdStart:
    """Import and first simulation in a fresh process, with compile cache or without.

    With a cache, the medians of `times` processes; one before them fills it. Raises `ModelFailure`.
    """
    starts = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(1 + times if cached else 1):
            played = subprocess.run(
                [sys.executable, "-c", _FRESH],
                env=os.environ | ({} if cached else {"NUMBA_CACHE_DIR": folder}),
                capture_output=True,
                text=True,
                check=False,
            )
            if played.returncode:
                raise ModelFailure(
                    "ebm: no fresh process could be started:"
                    f" {played.stderr.strip().splitlines()[-1:]}"
                )
            starts.append([*map(float, played.stdout.split()[-2:])])
    name, first = ("filled", 1) if cached else ("none", 0)
    return ColdStart(name, *map(median, zip(*starts[first:], strict=True)))


def timed(
    play: Callable[[Any], object],
    count: int,
    start: Callable[[], Any] = lambda: None,
    clock: Callable[[], float] = time.process_time,
) -> Callable[[], float]:
    """Time (us) of one of `count` parts of a play; its argument, from `start`, does not count."""

    def cost() -> float:
        started, began = start(), clock()
        play(started)
        return 1e6 * (clock() - began) / count

    return cost
