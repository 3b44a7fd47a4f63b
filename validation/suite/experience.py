"""What the suites have found about each model: bias and scatter of its figures, and the domain that
the scenes cover.

Bias and scatter as in the FDS validation guide (McGrattan and Toman 2011). With M a model's figure
and E the reference's,

    sigma = standard deviation of ln(M/E),      delta = exp(mean of ln(M/E) + sigma^2 / 2).

The reference's own numerical error is far below sigma and left out. A new prediction M is then
expected at M/delta, with a relative standard deviation sigma: `History.expected`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from rockcheck.scenes import Scene
from rockcheck.scenes.experience import Experience, Range, Trust
from rockcheck.validation.suite.results import Run

#: Figures that have a bias, and the size (alpha) below which a ratio means nothing.
QUANTITIES = {"peak_rotation": 1e-3}
#: Fewest pairs from which a scatter is computed.
FEWEST = 5


def pairs_of(runs: Iterable[Run]) -> dict[tuple[str, str], list[tuple[float, float]]]:
    """(reference's, model's) figures of all cells by (model, quantity), where both are finite and
    large enough for a ratio.

    Blocks that fall have no peak: they are left out, as are cells of the reference itself.
    """
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for run in runs:
        references = {cell.scene: cell for cell in run.cells if cell.model == run.reference}
        for cell in run.cells:
            yardstick = references.get(cell.scene)
            if (
                yardstick is None
                or yardstick is cell
                or "failed" in (cell.status, yardstick.status)
            ):
                continue
            if cell.outcome.startswith("overturned") or yardstick.outcome.startswith("overturned"):
                continue
            for name, least in QUANTITIES.items():
                values = [_value(one.figures, name) for one in (yardstick, cell)]
                if all(value is not None and value > least for value in values):
                    found.setdefault((cell.model, name), []).append(
                        (values[0] or 0.0, values[1] or 0.0)
                    )
        for model, name, one_pair in _ensemble_pairs(run):
            found.setdefault((model, name), []).append(one_pair)
    return found


def _ensemble_pairs(run: Run) -> Iterator[tuple[str, str, tuple[float, float]]]:
    least = QUANTITIES["peak_rotation"]
    for ensemble in run.ensembles:
        reference = ensemble.peaks.get(run.reference)
        for model, peaks in ensemble.peaks.items():
            if reference is None or model == run.reference:
                continue
            outcomes = zip(ensemble.outcomes[run.reference], ensemble.outcomes[model], strict=True)
            for e, m, ends in zip(reference, peaks, outcomes, strict=True):
                stands = not any(outcome.startswith("overturned") for outcome in ends)
                if e is not None and m is not None and min(e, m) > least and stands:
                    yield model, "peak_rotation", (e, m)


def _value(figures: Sequence[Any], name: str) -> float | None:
    return next(
        (f.value for f in figures if f.measure == name and not f.against and not f.window), None
    )


def experience_of(runs: Sequence[Run]) -> Experience:
    """Bias and scatter a model and figure, and the domain of the scenes, over some runs of
    suites."""
    trust: dict[str, dict[str, Trust]] = {}
    for (model, name), found in sorted(pairs_of(runs).items()):
        if len(found) < FEWEST:
            continue
        bias, scatter = bias_and_scatter(found)
        trust.setdefault(model, {})[name] = Trust(bias=bias, scatter=scatter, count=len(found))
    scenes = [run.load_scene(name) for run in runs for name in run.scenes]
    return Experience(
        suites=tuple(run.suite for run in runs), trust=trust, domain=domain_of(scenes)
    )


def bias_and_scatter(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """delta and sigma of (E, M) pairs; see the module."""
    ratios = np.log([m / e for e, m in pairs])
    scatter = float(np.std(ratios, ddof=1))
    return math.exp(float(np.mean(ratios)) + 0.5 * scatter**2), scatter


def domain_of(scenes: Iterable[Scene]) -> Mapping[str, Range]:
    """The range of each axis (`scenes.experience.axes_of`) over some scenes."""
    values: dict[str, list[float]] = {}
    from rockcheck.scenes.experience import axes_of

    for scene in scenes:
        for axis, numbers in axes_of(scene).items():
            values.setdefault(axis, []).extend(numbers)
    return {axis: Range(low=min(numbers), high=max(numbers)) for axis, numbers in values.items()}
