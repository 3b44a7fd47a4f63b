"""The data of a scene's page, and what is told of the scene in words.

In: a `SceneView`. Out: JSON for the page's own drawing, and a sentence. Called by `site`.

The data are a script, since a page opened from the file system cannot fetch data. Their values are
float32 (rounded to 6e-8 of their size), a line of `rows` values for the ground, each channel and
each running figure. All lines of a page are packed together, and each place holds the number of its
line.
"""

import base64
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rockcheck.reports.histories_figure import fineness
from rockcheck.reports.show.words import number
from rockcheck.reports.view import CHANNELS, PAPER_CHANNELS, Band, Channel, SceneView
from rockcheck.scenes import excitations
from rockcheck.validation.discrepancy import figures, impacts


class Lines:
    """Lines of values that a page draws; each place of its data holds the number of its line."""

    def __init__(self) -> None:
        self._lines: list[ArrayLike] = []

    def add(self, values: ArrayLike) -> int:
        """Take a line; returns its number."""
        self._lines.append(values)
        return len(self._lines) - 1

    def packed(self) -> str:
        """All lines as base64 of a deflated stream.

        The stream holds of each little-endian float32 the first byte, then of each the second, and
        so on. A line shorter than others ends with NaN. Neighbours share their sign and exponent,
        so bytes of one place compress well: a page takes half of what plain values take.
        """
        longest = max(map(np.size, self._lines))
        values = np.full((len(self._lines), longest), np.nan, "<f4")
        for row, line in zip(values, self._lines, strict=True):
            row[: np.size(line)] = line
        by_byte = values.reshape(-1, 1).view(np.uint8).T
        return base64.b64encode(zlib.compress(by_byte.tobytes())).decode("ascii")


def payload_of(view: SceneView) -> dict[str, Any]:
    """All that is drawn and animated of a scene on its page; see the module."""
    scene, bands, lines = view.scene, view.bands(), Lines()
    content = {
        "scene": view.name,
        "duration": float(view.t[-1]),
        "step": scene.output_step * view.stride,
        "rows": len(view.t),
        "ground": lines.add(view.ground / excitations.GRAVITY_OF_RECORDS),
        "alpha": scene.block.alpha,
        "frequencyParameter": scene.frequency_parameter,
        "block": [scene.block.half_width, scene.block.half_height],
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in scene.walls],
        "extent": [float(f"{edge:.4g}") for edge in view.extent],
        "references": view.references,
        "horizon": view.horizon,
        "channels": [_channel(view, channel, bands) for channel in CHANNELS],
        "window": view.active,
        "bands": [_band(view, band, lines) for band in bands],
        "models": [_model(view, model, lines) for model in view.looks if model in view.histories],
    }
    return content | {"lines": lines.packed()}  # the last, when all are known


def _channel(view: SceneView, channel: Channel, bands: Sequence[Band]) -> dict[str, Any]:
    return {
        "name": channel.name,
        "label": channel.label,
        "unit": "" if channel.unit == "1" else channel.unit,
        "fine": fineness(view, channel, bands),
        "folded": channel not in PAPER_CHANNELS,
    }


def _band(view: SceneView, band: Band, lines: Lines) -> dict[str, Any]:
    """A tolerance; of an RMS also the figure as it runs."""
    if band.kind != "rms":
        return {**vars(band)}
    return vars(band) | {"running": lines.add(view.running_rms(band))}


def _model(view: SceneView, model: str, lines: Lines) -> dict[str, Any]:
    """What a model's history has on the page."""
    look, history = view.looks[model], view.histories[model]
    events = [
        [float(f"{event.t:.6f}"), event.kind, float(f"{event.impulse:.3g}")]
        for event in history.event_list
    ]
    return {
        "name": model,
        "label": look.label,
        "look": look.key,
        "dash": look.dash,
        "values": {name: lines.add(values) for name, values in view.values[model].items()},
        "events": events,
        "modes": [[float(f"{start:.4f}"), mode] for start, _, mode in view.spells(model)],
        "agreement": view.agreement.get(model),
        "fell": view.falls.get(model),
        "samples": view.measured.get(model),
    }


def summary_of(view: SceneView) -> str:
    """The figure of a scene in words: each model's peak rotation, impacts and outcome."""
    sentences = []
    for model, history in view.histories.items():
        whole = figures.WindowedHistory(history)
        count = len(whole.events(*impacts.IMPACTS))
        impact_count = "" if whole.silent else f"{count} impacts, "
        peak = number(history.peak_rotation / view.scene.block.alpha)
        reached = f"peak {peak} α, " if history.overturned_at is None else ""
        sentences.append(f"{model}: {reached}{impact_count}{history.fate}")
    return "; ".join(sentences) + "."
