"""Measured histories: a CSV of a shake table or another program, played back as if by a model.

`History.load` says how its columns are named.
"""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
import scipy  # it loads its parts as they are used

from rockcheck.scenes import (
    Cost,
    Finite,
    Floats,
    Frozen,
    History,
    InputError,
    Scene,
    interpolation,
    printable,
)
from rockcheck.scenes.history import outcome_of
from rockcheck.validation.discrepancy.impacts import TURNS

CONFIDENCE = 0.95
#: Columns that are averaged; a mode or an event has no mean.
AVERAGED = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate")


class Measured(Frozen):
    """Plays back the measured file of each scene that has one.

    `files` maps names of scenes to CSV files; several files are repeats of one test, whose mean is
    played back with its scatter (`History.uncertainty`). `offset` (s) is added to the file's times,
    to align it with the scene's. `align` shifts the repeats to the first one by cross-correlation;
    the history's notes give each shift.
    """

    name: ClassVar[str] = "measured"
    files: dict[str, str | tuple[str, ...]]
    offset: Finite = 0.0
    align: bool = False

    def simulate(self, scene: Scene) -> History:
        """The measured history of the scene, from its t = 0 to its end.

        Raises `InputError` for a file that is not usable.
        """
        if scene.name not in self.files:
            raise InputError(f"no measured history of scene {scene.name!r}", "files")
        given = self.files[scene.name]
        paths = (given,) if isinstance(given, str) else given
        if not paths:
            raise InputError("no file is given", "files")
        tests = [shifted(History.load(path), self.offset) for path in paths]
        said: list[str] = []
        if self.align:
            offsets = [0.0, *(time_shift(tests[0], test) for test in tests[1:])]
            tests = [shifted(test, offset) for test, offset in zip(tests, offsets, strict=True)]
            said = [
                f"{Path(path).name} is shifted by {offset:+.4g} s"
                for path, offset in zip(paths[1:], offsets[1:], strict=True)
            ]
        history = mean_history(tests)
        t, ends = history.channels["t"], (-1e-9, scene.duration + 1e-9)
        inside = (t >= ends[0]) & (t <= ends[1])
        if not np.any(inside):
            raise InputError(
                f"nothing of {', '.join(map(printable, paths))} lies within the scene's 0 to"
                f" {scene.duration:g} s",
                "offset",
            )
        channels = {key: column[inside] for key, column in history.channels.items()}
        return dataclasses.replace(
            history,
            name=scene.name,
            channels=channels,
            cost=Cost(),  # of a model whose file this is: nothing was simulated here
            outcome=history.outcome if inside[-1] else outcome_of(channels),
            event_list=tuple(e for e in history.event_list if ends[0] <= e.t <= ends[1]),
            block=scene.block.per_unit_mass,
            uncertainty=mean_history(tests, ends).uncertainty,
            notes=(*history.notes, *said),
            settings={"file": ", ".join(Path(path).name for path in paths), "offset": self.offset},
        )


# Repeats of one test: their mean history, their scatter u_D, and their alignment in time.


def time_shift(reference: History, candidate: History) -> float:
    """Shift (s) of the candidate's times at the peak of the rotations' cross-correlation.

    Both are resampled at the finer of their mean steps; the peak is a parabola's through three
    lags. Where the longer is stronger than the shorter its strength beside it does not count: a
    history that holds a weak part of a motion belongs there, not beside the strongest. Raises
    `InputError` where one does not rotate, so that nothing can be aligned.
    """
    both = [history.channels for history in (reference, candidate)]
    for history, one in zip((reference, candidate), both, strict=True):
        if len(one["t"]) < 3 or not np.any(one["theta"]):
            raise InputError(f"{history.name}: no rotation by which it could be aligned", "align")
    step = min(float(one["t"][-1] - one["t"][0]) / (len(one["t"]) - 1) for one in both)
    grids = [np.arange(one["t"][0], one["t"][-1] + 0.5 * step, step) for one in both]
    first, second = (
        np.interp(grid, one["t"], one["theta"]) for grid, one in zip(grids, both, strict=True)
    )
    product = scipy.signal.correlate(first, second)
    # The squares of each that lie beside the other, over all squares of the shorter.
    least = np.sum(min(second, first, key=len) ** 2)
    beside = [
        np.maximum(scipy.signal.correlate(*pair) / least, 1e-20)
        for pair in ((first**2, np.ones_like(second)), (np.ones_like(first), second**2))
    ]
    of_longer = np.maximum(beside[len(second) > len(first)], 1.0)
    lags = scipy.signal.correlation_lags(len(first), len(second))
    top = int(np.argmax(product / np.sqrt(of_longer)))
    place = _top_beside(product / np.sqrt(np.multiply(*beside)), top)
    return float((lags[0] + place) * step + grids[0][0] - grids[1][0])


def _top_beside(values: Floats, top: int) -> float:
    """Where the values have their nearest top, in places: a parabola's through three of them."""
    while 0 < top < len(values) - 1:
        left, middle, right = values[top - 1 : top + 2]
        if middle >= max(left, right):
            bend = left - 2.0 * middle + right
            return top + (0.5 * float((left - right) / bend) if bend < 0.0 else 0.0)
        top += 1 if right > left else -1
    return float(top)


def shifted(history: History, offset: float) -> History:
    """The same history `offset` s later."""
    return dataclasses.replace(
        history,
        channels={**history.channels, "t": history.channels["t"] + offset},
        event_list=tuple(
            dataclasses.replace(event, t=event.t + offset) for event in history.event_list
        ),
        model_extremes=None,
    )


def mean_history(
    tests: Sequence[History], within: tuple[float, float] = (-math.inf, math.inf)
) -> History:
    """Mean of repeats of one test on the first one's times, with its uncertainty u_D.

    Over their common time `within` a start and an end, s. `uncertainty` holds the 95 % interval of
    the mean, t s/sqrt(n) by Student: "theta_rms" (rad, the RMS over time), "peak_rotation" (rad)
    and "last_slip" (m). Raises `InputError` where the tests have no time in common, or do not all
    overturn to one side or stay.
    """
    first, *others = tests
    if not others:
        return first
    fell = [  # a history may stop before its block lies
        max({*TURNS} & {test.outcome, outcome_of(test.channels)}, default="") for test in tests
    ]
    if len({*fell}) > 1:
        raise InputError(
            f"{len(tests) - fell.count('')} of {len(tests)} tests overturn, not all to one side:"
            " they have no mean; give each as a model of its own",
            "files",
        )
    start, end = (
        pick(within[side], *(test.channels["t"][side] for test in tests))
        for pick, side in ((max, 0), (min, -1))
    )
    t = first.channels["t"]
    t = t[(t >= start) & (t <= end)]
    if len(t) < 2:
        raise InputError("the tests have no time in common", "files")
    stacked = {
        name: np.array(
            [interpolation.column_at(test.channels, test.event_list, name, t) for test in tests]
        )
        for name in sorted(AVERAGED)
        if all(name in test.channels for test in tests)
    }
    channels = {"t": t, **{name: rows.mean(axis=0) for name, rows in stacked.items()}}
    theta = stacked["theta"]
    scatter = {
        "theta_rms": math.sqrt(
            scipy.integrate.trapezoid(np.var(theta, axis=0, ddof=1), t) / (t[-1] - t[0])
        ),
        "peak_rotation": float(np.std(np.max(np.abs(theta), axis=1), ddof=1)),
    }
    if "slip" in stacked:
        scatter["last_slip"] = float(np.std(stacked["slip"][:, -1], ddof=1))
    factor = scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(tests) - 1) / np.sqrt(len(tests))
    return dataclasses.replace(
        first,
        channels=channels,
        event_list=(),
        model_extremes=None,
        outcome=fell[0] or outcome_of(channels),
        uncertainty={name: factor * value for name, value in scatter.items()},
        notes=(*first.notes, f"the mean of {len(tests)} tests"),
    )
