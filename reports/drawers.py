"""Which drawer draws a plot of a finding.

In: a plot. Out: a figure of matplotlib. Called by whatever writes pages.
"""

from rockcheck.reports.block_plot import block
from rockcheck.reports.line_plots import lines, stable_steps, strips
from rockcheck.reports.spectrum_plots import spectra
from rockcheck.reports.style import Figure
from rockcheck.validation.finding import Plot

#: The drawer of each kind of plot.
DRAWERS = {
    "lines": lines,
    "block": block,
    "spectra": spectra,
    "stable-steps": stable_steps,
    "strips": strips,
}


def figure_of(plot: Plot) -> Figure:
    """The figure of a plot."""
    return DRAWERS[plot.kind](plot)
