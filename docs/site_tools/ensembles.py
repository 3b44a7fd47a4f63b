"""Pure rocking under 9,900 pulses by rockcheck's batches and by heyoka's, which advance eight runs
at once on the processor's lanes.

`pip install heyoka`, then `python docs/site_tools/ensembles.py`: the table of docs/benchmark.md,
"Beside an ensemble integrator". Both take the grid of pulses of `rockcheck benchmark ebm` without
slip, from the uplift to one unit of time after the pulse's mirror image of its start, on one core.
heyoka is a Taylor integrator with event detection, too; its events call Python.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from statistics import median
from typing import Any

import heyoka
import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import Packed, pack_pulses, run_batch
from rockcheck.scenes import Floor, Ricker, Scene
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.studies.work_precision.ebm import grid, right_hand_side_seconds

Floats = NDArray[np.float64]
NODES, ROUNDS, TOLERANCES, REFERENCE = 100, 3, (1e-6, 1e-8, 1e-10), 1e-14
ALPHA = PAPER_BLOCK.alpha
#: Natural time after the uplift at which heyoka begins: by then the rotation differs from zero.
LATER = 1e-3
#: Speed of an impact below which a run of heyoka's has come to rest, sqrt(g/R).
RESTS = 1e-6


@dataclass(frozen=True)
class Ended:
    """A batch's runs at their ends: whether they have overturned, else the rotation, rad; CPU
    seconds, Taylor steps a run."""

    fell: NDArray[np.bool_]
    rotation: Floats
    seconds: float
    steps: float


def pulses(model: EventBasedModel) -> Packed:
    """The grid without its weakest row, which hardly lifts the block."""
    scene = Scene(
        name="grid",
        block=PAPER_BLOCK,
        floor=Floor(friction=1.0),
        excitation=Ricker(amplitude=1.0, period=1.0),
        duration=10.0,
    )
    amplitudes, periods = grid(scene, NODES)
    lifts = amplitudes > 1.05 * scene.gravity * math.tan(ALPHA)
    packed = pack_pulses(scene, model, amplitudes[lifts], periods[lifts])
    return replace(packed, durations=2.0 * packed.horizontal["centre"] + 1.0)


def ours(packed: Packed, tolerance: float, **how: Any) -> Ended:
    """The batch by rockcheck."""
    model = EventBasedModel(friction="no-slip", tolerance=tolerance)
    began = time.process_time()
    found = run_batch(packed, model, jobs=1, parts=1, **{"until_decided": False, **how})
    seconds = time.process_time() - began
    rotation = found.motion[:, -1, 2] if found.motion.shape[1] else np.zeros(len(packed))
    return Ended(found.side != 0, rotation, seconds, float(found.series.mean()))


def pulse_at(ground: NDArray[np.void], t: Floats) -> Floats:
    """Base acceleration over g of each run at its own times."""
    tau = t - ground["centre"]
    return np.asarray(
        tau * (ground["c1"] + ground["c3"] * tau**2) * np.exp(-ground["rate"] * tau**2)
    )


def uplift(packed: Packed) -> tuple[Floats, Floats]:
    """When the pulse first exceeds tan(alpha), by bisection, and the side to which the block
    turns."""
    ground, limit = packed.horizontal, math.tan(ALPHA)
    shares = np.linspace(0.0, 1.0, 4001)[:, None] * packed.durations
    first = np.argmax(np.abs(pulse_at(ground, shares)) > limit, axis=0)
    runs = np.arange(len(packed))
    low, high = shares[np.maximum(first - 1, 0), runs], shares[first, runs]
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = np.abs(pulse_at(ground, middle)) > limit
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return high, np.sign(pulse_at(ground, high))


class Heyoka:
    """heyoka's integrator of the paper's (3), (4) without slip in natural units, phi = |theta|, on
    all lanes."""

    def __init__(self, tolerance: float) -> None:
        self.lanes = heyoka.recommended_simd_size()
        phi, rate = heyoka.make_vars("phi", "rate")
        side, c1, c3, b, centre, moves = (heyoka.par[k] for k in range(6))
        tau = heyoka.time - centre
        base = side * tau * (c1 + c3 * tau * tau) * heyoka.exp(-b * tau * tau)
        turn = 0.75 * (base * heyoka.cos(ALPHA - phi) - heyoka.sin(ALPHA - phi))
        falling = heyoka.event_direction.negative
        self.integrator = heyoka.taylor_adaptive_batch(
            [(phi, moves * rate), (rate, moves * turn)],
            state=np.zeros((2, self.lanes)),
            pars=np.zeros((6, self.lanes)),
            tol=tolerance,
            t_events=[
                heyoka.t_event_batch(phi, callback=self._lands, direction=falling),
                heyoka.t_event_batch(phi - 0.5 * math.pi, callback=self._topples),
            ],
        )

    # heyoka calls copies of these, so what they find stands in the integrator.
    @staticmethod
    def _lands(integrator: Any, sign: int, lane: int) -> bool:
        speed = integrator.state[1, lane]
        integrator.state[0, lane] = 0.0
        integrator.state[1, lane] = -(1.0 - 1.5 * math.sin(ALPHA) ** 2) * speed
        integrator.pars[0, lane] *= -1.0
        if abs(speed) < RESTS:
            integrator.state[1, lane] = integrator.pars[5, lane] = 0.0
        return True

    @staticmethod
    def _topples(integrator: Any, sign: int, lane: int) -> bool:
        integrator.pars[5, lane] = 0.0
        return True

    def play(self, packed: Packed, start: Floats, side: Floats) -> Ended:
        """All runs, so many at once as there are lanes."""
        ground, end, integrator = packed.horizontal, packed.durations, self.integrator
        # The angular acceleration is zero at the uplift; this is the rate at which it grows.
        growth = (
            (pulse_at(ground, start + LATER) * side * math.cos(ALPHA) - math.sin(ALPHA))
            * 0.75
            / LATER
        )
        fell, rotation, steps = np.zeros(len(packed), dtype=bool), np.zeros(len(packed)), 0
        began = time.process_time()
        for first in range(0, len(packed), self.lanes):
            runs = np.minimum(np.arange(first, first + self.lanes), len(packed) - 1)
            integrator.set_time(start[runs] + LATER)
            integrator.state[:] = growth[runs] * LATER**3 / 6.0, growth[runs] * LATER**2 / 2.0
            integrator.pars[:] = (
                side[runs],
                *(ground[name][runs] for name in ("c1", "c3", "rate", "centre")),
                np.ones(self.lanes),
            )
            integrator.propagate_until(end[runs])
            steps += sum(result[3] for result in integrator.propagate_res)
            fell[runs], rotation[runs] = (
                integrator.state[0] > 1.5,
                integrator.pars[0] * integrator.state[0],
            )
        return Ended(fell, rotation, time.process_time() - began, steps / len(packed))


def main() -> None:
    """Plays in turn, and prints the table."""
    packed = pulses(EventBasedModel(friction="no-slip"))
    truth = ours(packed, REFERENCE)
    start, side = uplift(packed)
    rows = []
    for tolerance in TOLERANCES:
        other = Heyoka(tolerance)
        plays = {
            "rockcheck": partial(ours, packed, tolerance),
            "rockcheck, until decided": partial(ours, packed, tolerance, until_decided=True),
            f"heyoka, {other.lanes} lanes": partial(other.play, packed, start, side),
        }
        rounds = [
            (right_hand_side_seconds(), {name: play() for name, play in plays.items()})
            for _ in range(ROUNDS)
        ]
        for name in plays:
            ended = rounds[-1][1][name]
            seconds = [found[name].seconds / len(packed) for _, found in rounds]
            ratio = median(found[name].seconds / len(packed) / one for one, found in rounds)
            same = ended.fell == truth.fell
            error = np.abs(ended.rotation - truth.rotation)[same & ~truth.fell]
            known = (
                ["", ""]
                if "decided" in name
                else [f"{np.quantile(error, 0.95):.1e}", str(np.count_nonzero(~same))]
            )
            rows.append(
                [
                    name,
                    f"{tolerance:g}",
                    f"{1e6 * median(seconds):.1f}",
                    f"{ratio:.0f}",
                    f"{ended.steps:.1f}",
                    *known,
                ]
            )
    heads = [
        "integrator",
        "tolerance",
        "CPU μs a run",
        "right-hand sides",
        "steps a run",
        "p95 error at the end, rad",
        "other outcome",
    ]
    print(
        f"{len(packed)} pulses; heyoka {heyoka.__version__}, Python"
        f" {sys.version.split()[0]}\n\n{markdown_table(heads, rows)}"
    )


if __name__ == "__main__":
    main()
