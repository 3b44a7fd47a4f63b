"""A scene's page as data: the script file it draws from, and the scene as files to be played.

It is a script since a page opened from the file system cannot fetch data.

Values of the script are float32 (rounded to 6e-8 of their size), a line of `rows` values for the
ground, each channel and each running figure. All lines of a page are packed together, and each
place holds the number of its line, so that lines on which models agree are kept once.
"""

import base64
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from numpy.typing import ArrayLike

from rockcheck.reports.figures import fineness
from rockcheck.reports.style import looks
from rockcheck.reports.view import CHANNELS, PAPER_CHANNELS, SceneView
from rockcheck.scenes import Scene
from rockcheck.scenes.excitations import GRAVITY_OF_RECORDS, Record
from rockcheck.scenes.writing import write_whole


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


def payload(view: SceneView) -> dict[str, Any]:
    """All that is drawn and animated of a scene; see the module."""
    scene = view.scene
    known = looks(view.run.models)
    bands = view.bands()
    lines: list[ArrayLike] = []

    def line(values: ArrayLike) -> int:
        lines.append(values)
        return len(lines) - 1

    data = {
        "scene": view.name,
        "duration": float(view.t[-1]),
        "step": scene.output_step * view.stride,
        "rows": len(view.t),
        "ground": line(view.ground / GRAVITY_OF_RECORDS),
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
            for model, look in known.items()
            if model in view.histories
        ],
    }
    return {**data, "lines": packed_lines(lines)}


def write_scene_file(scene: Scene, folder: Path, slug: str) -> dict[str, str]:
    """Write the scene as `<slug>.toml` with its records as CSV beside it.

    Returns file names and texts, the TOML first.

    `load_scene` reads the file back to a scene that moves in the same way.
    """
    document, records = scene_tables(scene, slug)
    text = tomlkit.dumps(document)
    write_whole(folder / f"{slug}.toml", text)
    for name, record in records.items():
        head = [f"# {re.sub(r'[^ -~]', '?', record.source)}", "time_s,acceleration_m_s2"]
        rows = [f"{record.time_step * n:.12g},{value!r}" for n, value in enumerate(record.unscaled)]
        write_whole(folder / name, "\n".join([*head, *rows, ""]))
    return {f"{slug}.toml": text} | dict.fromkeys(records, "")


def scene_tables(scene: Scene, slug: str) -> tuple[dict[str, Any], dict[str, Record]]:
    """A scene as the tables of a scene file, and its records by file name.

    What is at its default is left out.
    """
    records: dict[str, Record] = {}
    tables: dict[str, Any] = scene.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    for key in ("excitation", "vertical"):
        excitation, name = getattr(scene, key), f"{slug}-{key}.csv"
        if isinstance(excitation, Record):
            records[name] = excitation
            tables[key] = {"kind": "record", "file": name, "scale": excitation.scale}
        elif key in tables:
            tables[key] = {"kind": excitation.kind} | tables[key]
    return dict(sorted(tables.items(), key=lambda one: isinstance(one[1], dict | list))), records
