"""The same spectra by the other models: at some nodes of each, the share of outcomes that are equal to the event-based models'."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ebm import Spectrum
from validation import provenance
from validation.claims import percent
from validation.results import Stored
from validation.spectra import SETTLE, Asked, Panel, Tiles

CANDIDATES = ("ebm-unilateral", "cm", "mujoco", "pybullet")
REFERENCES = ("ebm", "ebm-unilateral")
#: A node is near the boundary if a node of another outcome is among those at most this many nodes away, diagonals included.
NEAR = 2


class Share(Stored):
    """Equal outcomes of one model at the nodes of one spectrum, near the boundary or away from it.

    `equal` counts them against each of `REFERENCES`; `failed` are nodes that the model could not finish, counted as unequal.
    """

    spectrum: str
    figure: int | None
    model: str
    near: bool
    nodes: int
    failed: int
    equal: dict[str, int]


class Agreement(Stored):
    """`agreement.json`: all shares, and the table that the page shows."""

    format: int = 2
    about: str
    #: Day of the run, ISO 8601; of a machine's clock in UTC.
    date: str
    versions: dict[str, str]
    settings: dict[str, dict[str, Any]]
    shares: tuple[Share, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def choose_nodes(spectrum: Spectrum, count: int, name: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """`count` nodes (i, j) of a spectrum and whether each is near the boundary: half of them are, where there are so many.

    The choice is random but depends only on `name`. Nodes that the reference could not decide are left out.
    """
    near = near_boundary(spectrum.outcomes)
    random = np.random.default_rng(zlib.crc32(name.encode()))
    decided = np.ones(near.shape, dtype=bool)
    decided[tuple(spectrum.undecided.T)] = False
    inside, outside = np.argwhere(near & decided), np.argwhere(~near & decided)
    wanted = min(count // 2, len(inside))
    wanted = max(wanted, min(count - len(outside), len(inside)))
    chosen = [inside[random.permutation(len(inside))[:wanted]], outside[random.permutation(len(outside))[: count - wanted]]]
    nodes = np.concatenate(chosen)
    return nodes, near[nodes[:, 0], nodes[:, 1]]


def near_boundary(outcomes: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Which nodes have another outcome within `NEAR` nodes."""
    width = 2 * NEAR + 1
    near: NDArray[np.bool_] = ndimage.maximum_filter(outcomes, width, mode="nearest") != ndimage.minimum_filter(
        outcomes, width, mode="nearest"
    )
    return near


def agree(
    panels: Sequence[Panel],
    spectra: Sequence[Spectrum],
    asked: Asked,
    count: int,
    tiles: Tiles,
    done: Callable[[Panel], None] | None = None,
) -> Agreement:
    """Plays `count` nodes of each (paper's) spectrum by the other models, and counts equal outcomes."""
    shares: list[Share] = []
    settings = {model: Asked(asked.frequencies, asked.amplitudes, model).settings for model in CANDIDATES}
    for panel, spectrum in zip(panels, spectra, strict=True):
        nodes, near = choose_nodes(spectrum, count, panel.name)
        i, j = nodes.T
        sides = {"ebm": spectrum.outcomes[i, j]}
        failures = {}
        for model in CANDIDATES:
            amplitudes, frequencies = asked.amplitudes[i], asked.frequencies[j]
            sides[model], failures[model] = tiles.play(panel.scene, amplitudes, frequencies, model=model, settings=settings[model])
        for model in CANDIDATES:
            for part in (True, False):
                here = near == part
                fine = here & ~failures[model]
                equal = {
                    reference: int(np.sum(fine & (sides[model] == sides[reference]))) for reference in REFERENCES if reference != model
                }
                failed = int(np.sum(here & failures[model]))
                shares.append(
                    Share(
                        spectrum=panel.name,
                        figure=panel.figure,
                        model=model,
                        near=part,
                        nodes=int(here.sum()),
                        failed=failed,
                        equal=equal,
                    )
                )
        if done is not None:
            done(panel)
    about = (
        f"Share of equal outcomes at {count} nodes of each spectrum of {len(asked.amplitudes)} x {len(asked.frequencies)} nodes, half of"
        f" them at most {NEAR} nodes from a boundary (near), the others further away, against the paper's bilateral event-based model and"
        " against the unilateral one, which lets the block hop as the other models do. Runs of the other models end with the pulse where"
        f" the block then lacks the energy to tip over, otherwise {SETTLE:g} s later; a block that then stands counts as safe."
    )
    columns, rows = table(shares)
    plain = {asked.model: dict(asked.settings)} | {model: dict(chosen) for model, chosen in settings.items()}
    return Agreement(
        about=about,
        date=datetime.now(UTC).date().isoformat(),
        versions=provenance.versions(),
        settings=plain,
        shares=tuple(shares),
        columns=columns,
        rows=rows,
    )


def table(shares: Sequence[Share]) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Columns and rows: all spectra together first, then a row for each spectrum and model."""
    columns = ("spectrum", "model", *(f"{where}, {reference}" for reference in REFERENCES for where in ("near", "away")), "failed")
    models = list(dict.fromkeys(share.model for share in shares))
    rows = [_row("all", model, [share for share in shares if share.model == model]) for model in models]
    for name in dict.fromkeys(share.spectrum for share in shares):
        rows += [_row(name, model, [s for s in shares if (s.spectrum, s.model) == (name, model)]) for model in models]
    return columns, tuple(rows)


def _row(name: str, model: str, shares: Sequence[Share]) -> tuple[str, ...]:
    cells = []
    for reference in REFERENCES:
        for near in (True, False):
            mine = [share for share in shares if share.near == near and reference in share.equal]
            nodes = sum(share.nodes for share in mine)
            cells.append(percent(sum(share.equal[reference] for share in mine) / nodes) if nodes else "–")
    return (name, model, *cells, str(sum(share.failed for share in shares)))
