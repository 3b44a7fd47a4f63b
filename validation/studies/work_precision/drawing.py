"""The diagrams of the benchmark: error over cost, error over step, batches.

In: frames of `points` and `convergence`, times of batches. Out: plots.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import median

import numpy as np
import pandas as pd

from rockcheck.validation.finding import Axis, Panel, Plot, Series, Style
from rockcheck.validation.studies.work_precision import timings
from rockcheck.validation.studies.work_precision.benchmark_scenes import MEMBERS, WALLS, prepared
from rockcheck.validation.studies.work_precision.lines import LINES
from rockcheck.validation.studies.work_precision.points import REFERENCES, grouped

#: The diagrams: a title, and how the names of their scenes begin.
SHEETS = {
    "Without a wall": ("free", "pulse", "slip"),
    "Beside a wall": ("wall",),
    "El Centro": ("fig",),
}
#: How a line of the diagrams is drawn, by the end of its name.
STYLES: Mapping[str, Style] = {"default": "dots", "adaptive": "marked", "tolerance": "dashed"}
#: Below are rounding errors; above nothing is right, alpha.
FLOOR, CEILING = 1e-13, 3.0
#: The level that no error against the other reference can fall below.
FORM = Series("model form: EBM against unilateral", style="level")


def median_form(family: str) -> float:
    """The median difference of the references over a family's members, alpha."""
    return median(prepared(family, k).model_form for k in range(MEMBERS))


def diagrams(points: pd.DataFrame) -> Iterator[Plot]:
    """A diagram of work and precision for each sheet that has points."""
    families = list(dict.fromkeys(points.family))
    for title, starts in SHEETS.items():
        shown = [family for family in families if family.startswith(starts)]
        if shown:
            yield _diagram(title, shown, points)


def _diagram(title: str, families: Sequence[str], points: pd.DataFrame) -> Plot:
    """Median error with its 10-90 % band over CPU time: a panel a family, a line a model."""
    panels = []
    for family in families:
        shown = points[(points.family == family) & (points.rms > 0.0)]
        shown = shown[np.isfinite(shown.rms) & np.isfinite(shown.cpu)]
        series = [_line_of(label, line) for (label,), line in grouped(shown, "line")]
        form = replace(FORM, y=[max(median_form(family), FLOOR)])
        panels.append(Panel(family, [*series, form]))
    return Plot(
        title.lower().replace(" ", "-"),
        f"Work and precision: {title.lower()}",
        panels=panels,
        x=Axis("CPU s a simulated s", log=True),
        y=Axis("RMS error of θ / α", log=True, limits=(FLOOR, CEILING)),
    )


def _line_of(label: str, points: pd.DataFrame) -> Series:
    return Series(
        label,
        points.cpu.tolist(),
        points.rms.tolist(),
        points.rms_10.clip(lower=FLOOR).tolist(),
        points.rms_90.clip(upper=CEILING).tolist(),
        LINES[label].family,
        STYLES.get(label.split()[-1], "line"),
    )


def error_over_step(frame: pd.DataFrame, levels: pd.DataFrame, form: float) -> Plot:
    """Beside a wall: errors over the step against each reference; `form` is theirs, alpha."""
    levels = levels[np.isfinite(levels.step)]  # without those of no run
    panels = []
    for reference in REFERENCES:
        finished = frame[np.isfinite(frame[reference])]
        series = _over_step(finished, levels[levels.reference == reference], reference)
        if reference == "ebm":
            series.append(replace(FORM, y=[form]))
        panels.append(Panel(f"against {reference}", series))
    return Plot(
        "error-over-step",
        panels=panels,
        x=Axis("step, s", log=True),
        y=Axis("RMS error of θ / α", log=True),
    )


def _over_step(frame: pd.DataFrame, levels: pd.DataFrame, reference: str) -> list[Series]:
    """Of each model a thin line a scene, and its medians."""
    lines = dict(grouped(frame, "line", "family"))
    no_line = frame[:0]
    series = []
    for (model,), medians in grouped(levels, "model"):
        for scene in WALLS:
            runs = lines.get((model, scene), no_line)
            steps, errors = runs.step.tolist(), runs[reference].tolist()
            series.append(Series(model, steps, errors, look=model, style="thin"))
        errors = medians["median"].clip(upper=CEILING).tolist()
        series.append(Series(model, medians.step.tolist(), errors, look=model))
    return series


def batch_plot(times: Sequence[timings.BatchTime]) -> Plot:
    """The cost of a run in a batch over its error, a line a case."""
    shown = [row for row in times if row.error_95 > 0.0]
    series = []
    for name, (words, *_) in timings.CASES.items():
        of_case = [row for row in shown if row.case == name]
        errors = [row.error_95 for row in of_case]
        series.append(Series(f"{name}: {words}", errors, [1e6 * row.cpu for row in of_case]))
    return Plot(
        "batches",
        panels=[Panel("", series)],
        x=Axis("p95 error of the peak, rad", log=True),
        y=Axis("CPU μs a run, one core", log=True),
    )
