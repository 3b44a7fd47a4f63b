"""Repeats of one test: their mean history, their scatter u_D, and their alignment in time."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import History, InputError
from rockcheck.scenes.history import outcome_of

Floats = NDArray[np.float64]
CONFIDENCE = 0.95
#: Columns that are averaged; a mode or an event has no mean.
AVERAGED = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate")


def time_shift(reference: History, candidate: History) -> float:
    """The time in s to add to the candidate's for the best agreement of the rotations: the peak of
    their cross-correlation.

    Both are read on the finer of their mean steps; the peak is a parabola's through three lags.
    Raises `InputError` where one does not rotate, so that nothing can be aligned.
    """
    from scipy.signal import correlate, correlation_lags

    a, b = (
        (history.channels["t"], history.channels["theta"]) for history in (reference, candidate)
    )
    for history, (_, theta) in zip((reference, candidate), (a, b), strict=True):
        if len(theta) < 3 or not np.any(theta):
            raise InputError(f"{history.name}: no rotation by which it could be aligned", "align")
    step = min(float(t[-1] - t[0]) / (len(t) - 1) for t, _ in (a, b))
    grids = [np.arange(t[0], t[-1] + 0.5 * step, step) for t, _ in (a, b)]
    rotations = [np.interp(grid, t, theta) for grid, (t, theta) in zip(grids, (a, b), strict=True)]
    product = correlate(rotations[0], rotations[1])
    lags = correlation_lags(len(rotations[0]), len(rotations[1]))
    top = int(np.argmax(product))
    between = 0.0
    if 0 < top < len(product) - 1:
        left, middle, right = product[top - 1 : top + 2]
        bend = left - 2.0 * middle + right
        between = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return float((lags[top] + between) * step + grids[0][0] - grids[1][0])


def shifted(history: History, offset: float) -> History:
    """The same history `offset` s later."""
    events = tuple(dataclasses.replace(event, t=event.t + offset) for event in history.event_list)
    return dataclasses.replace(
        history,
        channels={**history.channels, "t": history.channels["t"] + offset},
        event_list=events,
    )


def mean_history(tests: Sequence[History]) -> History:
    """The mean of some repeats of one test over their common time, on the first one's times, with
    its uncertainty u_D.

    `uncertainty` holds the 95 % interval of the mean, t s/sqrt(n) by Student: "theta_rms" (rad, the
    RMS over time), "peak_rotation" (rad) and "last_slip" (m). Raises `InputError` where the tests
    have no time in common or do not all end alike.
    """
    first, *others = tests
    if not others:
        return first
    outcomes = [outcome_of(test.channels).startswith("overturned") for test in tests]
    if len(set(outcomes)) > 1:
        raise InputError(
            f"{sum(outcomes)} of {len(tests)} tests overturn: they have no mean; give each as a"
            " model of its own",
            "files",
        )
    start, end = (
        pick(test.channels["t"][side] for test in tests) for pick, side in ((max, 0), (min, -1))
    )
    t = first.channels["t"]
    t = t[(t >= start) & (t <= end)]
    if len(t) < 2:
        raise InputError("the tests have no time in common", "files")
    columns = {name for name in AVERAGED if all(name in test.channels for test in tests)}
    stacked = {
        name: np.array([np.interp(t, test.channels["t"], test.channels[name]) for test in tests])
        for name in sorted(columns)
    }
    channels = {"t": t, **{name: rows.mean(axis=0) for name, rows in stacked.items()}}
    return dataclasses.replace(
        first,
        channels=channels,
        event_list=(),
        outcome=outcome_of(channels),
        uncertainty=_scatter(stacked),
        notes=(*first.notes, f"the mean of {len(tests)} tests"),
    )


def _scatter(stacked: Mapping[str, Floats]) -> dict[str, float]:
    count = len(stacked["theta"])
    from scipy.stats import t

    factor = float(t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1)) / np.sqrt(count)
    found = {
        "theta_rms": float(np.sqrt(np.mean(np.var(stacked["theta"], axis=0, ddof=1)))),
        "peak_rotation": float(np.std(np.max(np.abs(stacked["theta"]), axis=1), ddof=1)),
    }
    if "slip" in stacked:
        found["last_slip"] = float(np.std(stacked["slip"][:, -1], ddof=1))
    return {name: factor * value for name, value in found.items()}
