"""Notebook tables and figures of scenes, histories, spectra and comparisons."""

from collections.abc import Callable
from pkgutil import resolve_name
from typing import Any

from rockcheck.ebm import Spectrum
from rockcheck.reports.show import words
from rockcheck.reports.style import Figure
from rockcheck.scenes import History, Scene
from rockcheck.scenes.base import View
from rockcheck.validation import Discrepancy


def _later(name: str) -> Callable[[Any], Figure]:
    """A drawing function, imported only when called: matplotlib takes a second."""
    return lambda what: resolve_name(f"{__name__}.{name}")(what)


#: The views of this package's classes (entry point of the group `rockcheck.views`).
VIEWS = {
    Scene: View(
        html=lambda scene: words.html_table(scene.name, words.scene_facts(scene)),
        figure=_later("drawing:scene_figure"),
    ),
    History: View(html=words.history_html, figure=_later("drawing:history_figure")),
    Discrepancy: View(html=words.discrepancy_html, figure=_later("drawing:discrepancy_figure")),
    Spectrum: View(html=words.spectrum_html, figure=_later("spectrum:spectrum_figure")),
}
