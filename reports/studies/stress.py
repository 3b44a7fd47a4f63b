"""Page of a stress run: invariants by model, failures with their scene files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from rockcheck.reports.studies.page import write_study
from rockcheck.reports.style import PAGE, figure_style, save
from rockcheck.scenes.writing import made
from rockcheck.validation.stress.invariants import INVARIANTS
from rockcheck.validation.stress.players import PLAYERS
from rockcheck.validation.stress.results import Stress
from rockcheck.validation.stress.stability import AXIS_WORDS, STEPS, Stability

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The name of the maps' files.
MAPS = "stable-steps"


def write_stress(found: Stress, folder: Path) -> Path:
    """Writes `index.html` into the folder of a stress run; returns the page."""
    if found.stability is not None:
        save(stability_figure(found.stability), made(folder, "figures") / MAPS)
    return write_study(
        found,
        folder,
        "stress.html",
        maps=MAPS,
        invariants=INVARIANTS,
        players=PLAYERS,
    )


def stability_figure(found: Stability) -> Figure:
    """A panel an axis: the largest stable step of each model with its settings, by colour and number."""
    import numpy as np
    from matplotlib.figure import Figure

    labels = list(dict.fromkeys(one.line for one in found.stable))
    with figure_style():
        figure = Figure(figsize=(PAGE, 5.6), layout="constrained")
        panels = figure.subplots(2, 2)
        for ax, (axis, words) in zip(panels.flat, AXIS_WORDS.items(), strict=True):
            values = list(dict.fromkeys(one.value for one in found.stable if one.axis == axis))
            steps = np.array([[one.step if (one := found.step(label, axis, value)) else np.nan for value in values] for label in labels])
            with np.errstate(divide="ignore"):
                ax.imshow(np.log10(steps), cmap="viridis", vmin=math.log10(STEPS[-1]), vmax=math.log10(STEPS[0]), aspect="auto")
            for row, column in np.ndindex(*steps.shape):
                step = steps[row, column]
                light = step >= STEPS[2] or not step
                ax.text(
                    column, row, f"{step:g}" if step else "none", ha="center", va="center", fontsize=6, color="#1b1b1b" if light else "w"
                )
            ax.set_xticks(range(len(values)), [f"{value:g}" for value in values])
            ax.set_yticks(range(len(labels)), labels)
            ax.grid(visible=False)
            ax.set_xlabel(words)
    return figure
