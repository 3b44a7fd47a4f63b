"""Draws an overturning spectrum in the paper's colours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rockcheck.ebm.spectrum import Spectrum
from rockcheck.scenes import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The paper's colours.
COLOURS = {"safe": "#3b6fb6", "counterclockwise": "#e8833a", "clockwise": "#f2cf4a", "overturned": "#e8833a", "undecided": "#9a9a9a"}
#: The mark of a node whose outcome depends on the law of impacts.
LAW_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.0,
    "markerfacecolor": "none",
    "markeredgecolor": "black",
    "markeredgewidth": 0.8,
}


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """The spectrum as a figure of its own."""
    from rockcheck.reports.show.drawing import new_figure

    figure = new_figure(4.5, 3.6)
    draw(spectrum, figure.subplots())
    return figure


def draw(spectrum: Spectrum, axes: Any) -> None:
    """Draws a spectrum into matplotlib axes in the paper's colours.

    Blue is safe. Without a wall orange is overturned counterclockwise and yellow clockwise; with a wall orange is overturned.
    Grey is undecided, a black ring around a node says that its outcome depends on the law of impacts.
    """
    from matplotlib.colors import ListedColormap

    names = ("counterclockwise", "safe", "overturned" if spectrum.scene.walls else "clockwise", "undecided")
    shown = spectrum.outcomes.copy()
    shown[tuple(spectrum.undecided.T)] = 2
    axes.pcolormesh(
        spectrum.frequency_ratios,
        spectrum.amplitude_ratios,
        shown,
        cmap=ListedColormap([COLOURS[name] for name in names]),
        vmin=-1,
        vmax=2,
        shading="nearest",
        rasterized=True,
    )
    if spectrum.depends_on_law is not None and len(spectrum.depends_on_law):
        i, j = spectrum.depends_on_law.T
        axes.plot(spectrum.frequency_ratios[j], spectrum.amplitude_ratios[i], **LAW_MARK)
    horizontal, vertical = axis_labels(spectrum.scene)
    axes.set_xlabel(horizontal)
    axes.set_ylabel(vertical)
    axes.grid(False)


def axis_labels(scene: Scene) -> tuple[str, str]:
    """What the axes of the scene's spectrum show, in plain text: frequency and amplitude ratio, or size and scale."""
    if scene.excitation.kind == "record":
        return "size of the block / its own", "scale of the record"
    return "\u03c9\u209a / p", "a\u209a / (g tan \u03b1)"
