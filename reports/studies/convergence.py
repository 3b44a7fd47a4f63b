"""Page and diagram of the convergence study: error over step, against the unilateral event-based model and against the paper's."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from rockcheck.reports.studies.page import write_study
from rockcheck.reports.style import LOOKS, PAGE, figure_style, log_scales, power_of_ten, save
from rockcheck.scenes.writing import made
from rockcheck.validation.bench.convergence import DURATION, LEVEL, PULSES, REFERENCE_TOLERANCE, REFERENCES, SWEEPS, Convergence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The name of the diagram's files, and the error (alpha) up to which it is drawn where a run failed.
DIAGRAM, FAILED = "error-over-step", 3.0
TITLES = {"ebm-unilateral": "Against the unilateral EBM: numerical error", "ebm": "Against the paper's EBM: model form remains"}


def write_convergence(found: Convergence, folder: Path) -> Path:
    """Writes `index.html` with its diagram into the folder of a study; returns the page."""
    save(convergence_figure(found), made(folder, "figures") / DIAGRAM)
    return write_study(
        found,
        folder,
        "convergence.html",
        diagram=DIAGRAM,
        references=REFERENCES,
        refinements=SWEEPS,
        pulses=PULSES,
        duration=DURATION,
        level=LEVEL,
        tolerance=power_of_ten(REFERENCE_TOLERANCE),
    )


def convergence_figure(found: Convergence) -> Figure:
    """A panel a reference: the RMS error of every run, thin, and of each model the median, over the step."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE, 3.4), layout="constrained")
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for ax, reference in zip(panels, REFERENCES, strict=True):
            for model in found.models():
                colour = LOOKS[model].light
                for case in found.cases:
                    line = [one for one in found.line(model, case.scene) if math.isfinite(one.error(reference))]
                    ax.plot([one.step for one in line], [one.error(reference) for one in line], color=colour, linewidth=0.5, alpha=0.55)
                levels = [level for level in found.levels if (level.model, level.reference) == (model, reference)]
                look = LOOKS[model].line | {"marker": LOOKS[model].marker, "linewidth": 1.8}
                ax.plot([level.step for level in levels], [min(level.median, FAILED) for level in levels], **look)
            ax.set(xscale="log", yscale="log", title=TITLES[reference], xlabel="step, s")
            log_scales(ax, decades=12)
        panels[0].set_ylabel("RMS error of θ / α")
        steps = [min(one.step for one in found.plays), max(one.step for one in found.plays)]
        panels[0].plot(steps, steps, color="#6e6e6e", linewidth=0.8, linestyle=(0, (1, 1.5)), label="first order")
        form = {"color": "#6e6e6e", "linewidth": 1.0, "linestyle": (0, (6, 3))}
        panels[1].axhline(found.model_form, **form)
        panels[0].plot([], [], **form, label="EBM against unilateral: model form, median")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure
