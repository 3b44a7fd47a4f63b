"""The picture of the largest stable steps of a stress study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rockcheck.reports.style import PAGE, figure_style
from rockcheck.validation.finding import Plot

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(plot: Plot) -> Figure:
    """A panel an axis: the largest stable step of each model with its settings, by colour and number."""
    import numpy as np
    from matplotlib.figure import Figure

    tried, models = plot.data["tried"], plot.data["models"]
    with figure_style():
        figure = Figure(figsize=(PAGE, 5.6), layout="constrained")
        for ax, (words, values, found) in zip(
            figure.subplots(2, 2).flat, plot.data["panels"], strict=True
        ):
            steps = np.array(found, dtype=float)
            with np.errstate(divide="ignore"):
                ax.imshow(
                    np.log10(steps),
                    cmap="viridis",
                    vmin=np.log10(tried[-1]),
                    vmax=np.log10(tried[0]),
                    aspect="auto",
                )
            for (row, column), step in np.ndenumerate(steps):
                colour = "#1b1b1b" if step >= tried[2] or not step else "w"
                ax.text(
                    column,
                    row,
                    f"{step:g}" if step else "none",
                    ha="center",
                    va="center",
                    fontsize=6,
                    color=colour,
                )
            ax.set_xticks(range(len(values)), [f"{value:g}" for value in values])
            ax.set_yticks(range(len(models)), models)
            ax.grid(visible=False)
            ax.set_xlabel(words)
    return figure
