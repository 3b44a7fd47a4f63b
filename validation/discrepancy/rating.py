"""The rating of ISO/TS 18571 of two histories, by the package objective-rating-metrics.

In: a `Pair`. Out: a number from 0 to 1; `Unavailable` where the package is not installed or the
curves cannot be rated. `measures` lists it for `compare`.
"""

import numpy as np

from rockcheck.validation.discrepancy.figures import Measure, Pair, Unavailable, by_name

FEWEST_SAMPLES, MOST_SAMPLES = 20, 4000


def _iso_18571(pair: Pair) -> float:
    try:
        from objective_rating_metrics.rating import ISO18571
    except ImportError:
        raise Unavailable(
            "needs the package objective-rating-metrics: pip install objective-rating-metrics"
        ) from None
    reference, candidate = pair.rocking
    finite = np.all(np.isfinite(pair.rocking))
    constant = np.ptp(reference) == 0.0 or np.ptp(candidate) == 0.0
    if len(pair.time) < FEWEST_SAMPLES or not finite or constant:
        raise Unavailable("too short, constant or not finite")
    samples = min(len(pair.time), MOST_SAMPLES)
    grid = np.linspace(pair.time[0], pair.time[-1], samples)
    rating = ISO18571(
        np.column_stack([grid, np.interp(grid, pair.time, reference)]),
        np.column_stack([grid, np.interp(grid, pair.time, candidate)]),
        dt=float(grid[1] - grid[0]),
    )
    return float(rating.overall_rating(ndigits=-1))


DIFFERENCES = by_name(
    Measure(
        "iso_18571",
        "ISO/TS 18571 rating",
        "1",
        "ISO/TS 18571 overall rating of theta, 0 to 1 (corridor 0.4, phase 0.2, magnitude 0.2,"
        " slope 0.2), not rounded.\n\nBy the package objective-rating-metrics, which takes the"
        " square of the samples in time and memory, does not look at their times and answers NaN"
        " where it has no answer; so both curves are put on one uniform grid of at most 4,000"
        " samples, and curves that are constant or shorter than 20 samples have no rating.",
        _iso_18571,
        ideal=1.0,
        on_request=True,
    ),
)
