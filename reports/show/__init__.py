"""How scenes, histories, spectra and comparisons show themselves in a notebook, and as a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rockcheck.ebm.spectrum import Spectrum
from rockcheck.reports.show import words
from rockcheck.scenes import History, Scene
from rockcheck.scenes.base import View
from rockcheck.validation.discrepancy import Discrepancy

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# matplotlib takes a second to import: only what is drawn asks for it.
def _scene_figure(scene: Scene) -> Figure:
    from rockcheck.reports.show.drawing import scene_figure

    return scene_figure(scene)


def _history_figure(history: History) -> Figure:
    from rockcheck.reports.show.drawing import history_figure

    return history_figure(history)


def _discrepancy_figure(discrepancy: Discrepancy) -> Figure:
    from rockcheck.reports.show.drawing import discrepancy_figure

    return discrepancy_figure(discrepancy)


def _spectrum_figure(spectrum: Spectrum) -> Figure:
    from rockcheck.reports.show.spectrum import spectrum_figure

    return spectrum_figure(spectrum)


#: The views of this package's classes (entry point of the group `rockcheck.views`).
VIEWS = {
    Scene: View(html=words.scene_html, figure=_scene_figure),
    History: View(html=words.history_html, figure=_history_figure),
    Discrepancy: View(html=words.discrepancy_html, figure=_discrepancy_figure),
    Spectrum: View(html=words.spectrum_html, figure=_spectrum_figure),
}
