"""Notebook tables and figures of scenes, histories, spectra and comparisons."""

from rockcheck.ebm import Spectrum
from rockcheck.reports.show import words
from rockcheck.scenes import History, Scene
from rockcheck.scenes.base import View
from rockcheck.validation import Discrepancy

#: The views of this package's classes (entry point of the group `rockcheck.views`).
VIEWS = {
    Scene: View(
        html=lambda scene: words.html_table(scene.name, words.scene_facts(scene)),
        figure=f"{__name__}.drawing:scene_figure",
    ),
    History: View(html=words.history_html, figure=f"{__name__}.drawing:history_figure"),
    Discrepancy: View(html=words.discrepancy_html, figure=f"{__name__}.drawing:discrepancy_figure"),
    Spectrum: View(html=words.spectrum_html, figure=f"{__name__}.drawing:spectrum_figure"),
}
