"""The data of a scene's page, as a script file: a page opened from the file system cannot fetch data.

Values are float32 (rounded to 6e-8 of their size), little-endian, in base64.
"""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rockcheck.reports.figures import fineness
from rockcheck.reports.style import looks
from rockcheck.reports.view import CHANNELS, SceneView
from rockcheck.scenes.excitations import GRAVITY_OF_RECORDS


def packed(values: ArrayLike) -> str:
    """Values as base64 of little-endian float32."""
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def payload(view: SceneView) -> dict[str, Any]:
    """All that is drawn and animated of a scene; see the module."""
    scene = view.scene
    known = looks(view.run.models)
    bands = view.bands()
    return {
        "scene": view.name,
        "duration": float(view.t[-1]),
        "step": scene.output_step * view.stride,
        "rows": len(view.t),
        "ground": packed(view.ground / GRAVITY_OF_RECORDS),
        "alpha": scene.block.alpha,
        "frequencyParameter": scene.frequency_parameter,
        "block": [scene.block.half_width, scene.block.half_height],
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in scene.walls],
        "extent": [float(f"{edge:.4g}") for edge in view.extent],
        "references": view.references,
        "horizon": view.horizon,
        "channels": [
            {"name": c.name, "label": c.label, "unit": "" if c.unit == "1" else c.unit, "fine": fineness(view, c, bands)} for c in CHANNELS
        ],
        "window": view.active,
        "bands": [vars(band) | ({"running": packed(view.running_rms(band))} if band.kind == "rms" else {}) for band in bands],
        "models": [
            {
                "name": model,
                "label": look.label,
                "look": look.key,
                "dash": look.dash,
                "values": {name: packed(values) for name, values in view.values[model].items()},
                "events": [[float(f"{e.t:.6f}"), e.kind, float(f"{e.impulse:.3g}")] for e in view.histories[model].event_list],
                "modes": _spells(view, model),
                "agreement": view.agreement.get(model),
                "fell": view.falls.get(model),
                "samples": view.measured.get(model),
            }
            for model, look in known.items()
            if model in view.histories
        ],
    }


def script(view: SceneView) -> str:
    """The payload as a script that assigns it to `rockcheck`, written in ASCII."""
    text = json.dumps(payload(view), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return f"window.rockcheck = {text};\n"


def _spells(view: SceneView, model: str) -> list[list[Any]]:
    """The modes of motion as [start in s, mode], one entry for each change."""
    channels = view.histories[model].channels
    if "mode" not in channels:
        return []
    mode = np.asarray(channels["mode"]).astype(str)
    starts = np.flatnonzero(np.r_[True, mode[1:] != mode[:-1]])
    return [[float(f"{channels['t'][k]:.4f}"), str(mode[k])] for k in starts]
