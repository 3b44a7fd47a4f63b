"""Bias and scatter of each model against the reference, over many runs.

In: finished runs. Out: by model, a `Trust`: what a new prediction may be multiplied by. The start
page and the documentation's table of experience call it. As in the FDS validation guide (McGrattan
and Toman 2011): with M a model's figure and E the reference's,

    sigma = standard deviation of ln(M/E),      delta = exp(mean of ln(M/E) + sigma^2 / 2).

The reference's own numerical error is far below sigma and left out. A new prediction M is then
expected at M/delta, with a relative standard deviation sigma: `History.expected`.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from rockcheck.scenes import experience
from rockcheck.validation.discrepancy.ensemble import SMALLEST_PEAK
from rockcheck.validation.suite import results

#: The fewest pairs from which a scatter is computed.
FEWEST = 5


def pairs_of(runs: Iterable[results.Run]) -> dict[str, list[tuple[float, float]]]:
    """Peak rotations (reference's, model's) of all scenes by model, if both allow a ratio.

    Both must be finite and larger than `SMALLEST_PEAK`. Blocks that fall have no peak: they are
    left out, as are cells of the reference itself.
    """
    found: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for run in runs:
        # by model, scene and number in its ensemble
        ends = [
            (
                (cell.model, cell.scene, 0),
                cell.outcome,
                results.value_of(cell.figures, "peak_rotation"),
            )
            for cell in run.cells
            if cell.status == "done"
        ] + [
            ((model, drawn.name, n), drawn.outcomes[model][n], peak)
            for drawn in run.ensembles
            for model, peaks in drawn.peaks.items()
            for n, peak in enumerate(peaks)
        ]
        stands = {
            key: peak
            for key, outcome, peak in ends
            if peak is not None and peak > SMALLEST_PEAK and not outcome.startswith("overturned")
        }
        for (model, scene, n), peak in stands.items():
            if model != run.reference and (run.reference, scene, n) in stands:
                found[model].append((stands[run.reference, scene, n], peak))
    return found


def trust_in(pairs: Sequence[tuple[float, float]]) -> experience.Trust | None:
    """Bias and scatter of (E, M) pairs, see the module; None for fewer than `FEWEST`."""
    if len(pairs) < FEWEST:
        return None
    ratios = np.log([m / e for e, m in pairs])
    scatter = float(np.std(ratios, ddof=1))
    return experience.Trust(
        bias=math.exp(float(np.mean(ratios)) + 0.5 * scatter**2), scatter=scatter, count=len(pairs)
    )
