"""Histories of some nodes of a spectrum, with as few rows as a drawing needs.

A page plays them: the event-based model's own motion, not an imitation of it. `<name>.histories.npz` beside a spectrum holds them.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, Spectrum
from rockcheck.ebm.spectrum import play_motions
from rockcheck.scenes import InputError
from rockcheck.scenes.reading import read_arrays
from rockcheck.scenes.writing import write_whole

#: Nodes an axis whose histories are kept, both ends of the axis among them.
KEPT_AN_AXIS = 16
#: A history is played in so many equal parts, and thinned until straight lines between the rows that stay are within this much of
#: it: of alpha in rotation, of the half width in position.
PARTS, COARSE = 400, 0.01

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Glimpse:
    """The history of node (`row`, `column`): an array of rows t (s), theta (rad), x, y (m), and its outcome."""

    row: int
    column: int
    outcome: str
    motion: Floats


def glimpses(spectrum: Spectrum, model: EventBasedModel) -> list[Glimpse]:
    """Histories of `KEPT_AN_AXIS` nodes an axis, where the model could play them."""
    from rockcheck.validation.spectra.thinning import enough  # needs numba, which a page of what is kept does not

    i, j = (nodes.ravel() for nodes in np.meshgrid(*map(_spread, spectrum.outcomes.shape), indexing="ij"))
    played = play_motions(spectrum.scene, spectrum.amplitude_ratios[i], spectrum.frequency_ratios[j], model=model, parts=PARTS)
    found = []
    for row, column, motion in zip(i.tolist(), j.tolist(), played, strict=True):
        if motion is not None:
            block, rows = motion.block, motion.rows
            few = enough(rows[:, 0].copy(), rows[:, 1:] / np.array([block.alpha, block.half_width, block.half_width]), COARSE)
            found.append(Glimpse(row, column, motion.outcome, rows[few]))
    return found


def _spread(size: int) -> NDArray[np.int64]:
    return np.unique(np.round(np.linspace(0, size - 1, min(size, KEPT_AN_AXIS))).astype(np.int64))


def kept(path: Path, key: str) -> bool:
    """Whether the histories of that key are there already."""
    try:
        return bool(read_arrays(path)["key"] == key)
    except (InputError, KeyError):
        return False


def save_glimpses(found: Sequence[Glimpse], path: Path, key: str = "") -> None:
    """Write histories as one NPZ: all rows below each other, and where each begins. `key` covers all that they depend on."""
    content = io.BytesIO()
    lengths = [len(one.motion) for one in found]
    np.savez_compressed(
        content,
        key=np.array(key),
        nodes=np.array([(one.row, one.column) for one in found], dtype=np.int64).reshape(-1, 2),
        outcomes=np.array([one.outcome for one in found]),
        ends=np.cumsum(lengths, dtype=np.int64),
        rows=np.concatenate([one.motion for one in found]).astype(np.float32) if found else np.zeros((0, 4), dtype=np.float32),
    )
    write_whole(path, content.getvalue())


def read_glimpses(path: Path) -> list[Glimpse]:
    """What `save_glimpses` wrote; empty where there is no such file."""
    if not path.is_file():
        return []
    data = read_arrays(path)
    parts = np.split(data["rows"].astype(float), data["ends"][:-1]) if len(data["ends"]) else []
    return [
        Glimpse(int(i), int(j), str(outcome), part) for (i, j), outcome, part in zip(data["nodes"], data["outcomes"], parts, strict=True)
    ]


def glimpses_path(folder: Path, name: str) -> Path:
    """Where the histories of a spectrum of that name lie."""
    return folder / f"{name}.histories.npz"
