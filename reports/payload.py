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
from rockcheck.reports.view import CHANNELS, PAPER_CHANNELS, SceneView
from rockcheck.scenes import excitations
from rockcheck.validation.discrepancy import figures, impacts


def packed_lines(lines: Sequence[ArrayLike]) -> str:
    """Lines of values as base64 of a deflated stream.

    The stream holds of each little-endian float32 the first byte, then of each the second, and so
    on.

    A line shorter than others ends with NaN. Neighbours share their sign and exponent, so bytes of
    one place compress well: a page takes half of what plain values take.
    """
    values = np.full((len(lines), max(map(np.size, lines))), np.nan, "<f4")
    for place, line in zip(values, lines, strict=True):
        place[: np.size(line)] = line
    return base64.b64encode(zlib.compress(values.reshape(-1, 1).view(np.uint8).T.tobytes())).decode(
        "ascii"
    )


def payload_of(view: SceneView) -> dict[str, Any]:
    """All that is drawn and animated of a scene on its page; see the module."""
    scene = view.scene
    bands = view.bands()
    lines: list[ArrayLike] = []

    def line(values: ArrayLike) -> int:
        lines.append(values)
        return len(lines) - 1

    return {
        "scene": view.name,
        "duration": float(view.t[-1]),
        "step": scene.output_step * view.stride,
        "rows": len(view.t),
        "ground": line(view.ground / excitations.GRAVITY_OF_RECORDS),
        "alpha": scene.block.alpha,
        "frequencyParameter": scene.frequency_parameter,
        "block": [scene.block.half_width, scene.block.half_height],
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in scene.walls],
        "extent": [float(f"{edge:.4g}") for edge in view.extent],
        "references": view.references,
        "horizon": view.horizon,
        "channels": [
            {
                "name": c.name,
                "label": c.label,
                "unit": "" if c.unit == "1" else c.unit,
                "fine": fineness(view, c, bands),
                "folded": c not in PAPER_CHANNELS,
            }
            for c in CHANNELS
        ],
        "window": view.active,
        "bands": [
            vars(band) | ({"running": line(view.running_rms(band))} if band.kind == "rms" else {})
            for band in bands
        ],
        "models": [
            {
                "name": model,
                "label": look.label,
                "look": look.key,
                "dash": look.dash,
                "values": {name: line(values) for name, values in view.values[model].items()},
                "events": [
                    [float(f"{e.t:.6f}"), e.kind, float(f"{e.impulse:.3g}")]
                    for e in view.histories[model].event_list
                ],
                "modes": [[float(f"{t:.4f}"), mode] for t, _, mode in view.spells(model)],
                "agreement": view.agreement.get(model),
                "fell": view.falls.get(model),
                "samples": view.measured.get(model),
            }
            for model, look in view.looks.items()
            if model in view.histories
        ],
        "lines": packed_lines(lines),  # the last, when all are known
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
