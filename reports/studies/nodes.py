"""What the script of the spectra's page needs: the outcome of every node, and histories of some, as script files.

Two files a figure: `<stem>.nodes.js`, small, which the page reads at once, and `<stem>.histories.js`, read when a node is played.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, node_scene
from rockcheck.reports.payload import packed
from rockcheck.reports.show.spectrum import axis_labels
from rockcheck.scenes import InputError, Ricker, Scene, Sine
from rockcheck.scenes.reading import read_arrays
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.spectra.histories import Glimpse, glimpses_path, read_glimpses
from rockcheck.validation.spectra.study import SpectrumRecord

CODES = {LEFT: "L", SAFE: "S", RIGHT: "R"}
UNDECIDED = "U"


def write_nodes(folder: Path, stem: str, records: Sequence[SpectrumRecord]) -> bool:
    """Write the scripts of a figure's spectra beside them; False, and nothing, where their outcomes cannot be read."""
    grids = [_outcomes(folder / f"{record.name}.npz") for record in records]
    if not records or any(grid is None for grid in grids):
        return False
    found = [read_glimpses(glimpses_path(folder, record.name)) for record in records]
    scenes = [_scene(record) for record in records]
    first = records[0]
    shown = {
        "stem": stem,
        "frequencies": [float(f"{value:.6g}") for value in first.frequency_ratios],
        "amplitudes": [float(f"{value:.6g}") for value in first.amplitude_ratios],
        "axes": axis_labels(scenes[0]) if scenes[0] else ("size of the block / its own", "scale of the record"),
        "pulse": _pulse(scenes[0], first) if scenes[0] else None,
        "panels": [
            {
                "title": record.title,
                "free": not record.scene.get("walls"),
                "outcomes": _runs(grid),
                "nodes": [[one.row, one.column] for one in glimpsed],
            }
            for record, grid, glimpsed in zip(records, grids, found, strict=True)
            if grid is not None
        ],
    }
    _write_script(folder / f"{stem}.nodes.js", "rockcheckNodes", stem, shown)
    played = [_played(scene, glimpsed) for scene, glimpsed in zip(scenes, found, strict=True)]
    _write_script(folder / f"{stem}.histories.js", "rockcheckHistories", stem, played)
    return True


def _outcomes(path: Path) -> NDArray[np.str_] | None:
    """A letter a node, amplitude by frequency; None where there is no such file."""
    try:
        data = read_arrays(path)
        sides, undecided = data["outcomes"], data["undecided"]
    except (InputError, KeyError):
        return None
    letters = np.full(sides.shape, CODES[SAFE])
    for side, letter in CODES.items():
        letters[sides == side] = letter
    letters[tuple(undecided.T)] = UNDECIDED
    return letters


def _runs(letters: NDArray[np.str_]) -> str:
    """The letters row by row, run-length encoded: each run as its length and its letter."""
    return "".join(f"{len(list(same))}{letter}" for letter, same in itertools.groupby(letters.ravel()))


def _scene(record: SpectrumRecord) -> Scene | None:
    """The record's scene; None with a motion whose samples are not written down."""
    try:
        return Scene.model_validate(record.scene)
    except ValueError:
        return None


def _pulse(scene: Scene, record: SpectrumRecord) -> dict[str, list[float]] | None:
    """Amplitude (m/s^2) and period (s) of the pulses along the axes; None for a record."""
    middle = record.frequency_ratios[0]
    along = [node_scene(scene, amplitude, middle).excitation for amplitude in record.amplitude_ratios]
    across = [node_scene(scene, record.amplitude_ratios[0], frequency).excitation for frequency in record.frequency_ratios]
    if not all(isinstance(pulse, Ricker | Sine) for pulse in (*along, *across)):
        return None
    return {
        "amplitude": [float(f"{pulse.amplitude:.4g}") for pulse in along if isinstance(pulse, Ricker | Sine)],
        "period": [float(f"{pulse.period:.4g}") for pulse in across if isinstance(pulse, Ricker | Sine)],
    }


def _played(scene: Scene | None, found: Sequence[Glimpse]) -> dict[str, Any]:
    rows = np.concatenate([one.motion for one in found]) if found else np.zeros((0, 4))
    return {
        "block": [scene.block.half_width, scene.block.half_height] if scene else [1.0, 1.0],
        "alpha": scene.block.alpha if scene else 1.0,
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in scene.walls] if scene else [],
        "outcomes": [one.outcome for one in found],
        "ends": np.cumsum([len(one.motion) for one in found]).tolist(),
        "rows": packed(rows.ravel()),
    }


def _write_script(path: Path, name: str, stem: str, content: Any) -> None:
    text = json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    write_whole(path, f"(window.{name} ??= {{}})[{json.dumps(stem)}] = {text};\n")
