"""Overturning spectra by the other models: shares of equal outcomes, and coarse maps.

At some nodes of each spectrum the outcomes are compared with those of the event-based models. The
maps are of one figure.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.engines.engine import Engine
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.finding import Block, Column, Plot, Table, Text, text
from rockcheck.validation.paper import Panel
from rockcheck.validation.studies.spectrum.tiles import (
    SETTLE,
    UNDECIDED,
    Book,
    Request,
    letters_of,
)

CANDIDATES = ("ebm-unilateral", "cm", "mujoco", "pybullet", "pymunk", "dart", "drake")
#: The share of the nodes that a model plays, where it is not all. These engines draw no map: fewer
#: nodes show whether they agree; a run of DART costs four times, one of Drake twice the others'.
PLAYED_SHARE = {"pymunk": 0.3, "dart": 0.1, "drake": 0.2}
REFERENCES = {"ebm": "bilateral", "ebm-unilateral": "unilateral"}
#: A node is near the boundary if a node of another outcome is among those at most this many nodes
#: away, diagonals included.
NEAR = 2
#: The paper's figure of which every model draws a map, and the map's nodes an axis.
MAPPED, MAP_SIZE = 8, 25


#: All shares and maps, as JSON keeps them (`agree`).
Agreement = Mapping[str, Any]


def choose_nodes(spectrum: Spectrum, count: int, name: str) -> list[NDArray[np.int64]]:
    """`count` nodes (i, j) of a spectrum: those near the boundary, and those away from it.

    Half of them are near it, where there are enough. The choice is random but depends only on
    `name`. Nodes that the reference could not decide are left out.
    """
    from scipy import ndimage

    most, least = (
        filtered(spectrum.outcomes, 2 * NEAR + 1, mode="nearest")
        for filtered in (ndimage.maximum_filter, ndimage.minimum_filter)
    )
    near: NDArray[np.bool_] = most != least
    random = np.random.default_rng(zlib.crc32(name.encode()))
    decided = letters_of(spectrum.outcomes, spectrum.undecided) != UNDECIDED
    inside, outside = np.argwhere(near & decided), np.argwhere(~near & decided)
    wanted = max(min(count // 2, len(inside)), min(count - len(outside), len(inside)))
    return [
        side[random.permutation(len(side))[:number]]
        for side, number in ((inside, wanted), (outside, count - wanted))
    ]


def plays(request: Request, panel: Panel) -> bool:
    """Whether the model can play the contacts of the panel.

    An engine without restitution does not play walls or a floor that bounce.
    """
    model = models.build(request.model, request.settings)
    lacks = model.lacks() if isinstance(model, Engine) else ()
    return "restitution" not in lacks or not any(
        [panel.scene.floor.restitution, *(wall.restitution for wall in panel.scene.walls)]
    )


def agree(
    book: Book, spectra: Mapping[Panel, Spectrum], request: Request, count: int
) -> Agreement | None:
    """Equal outcomes of the other models at nodes of each spectrum, and their maps.

    Up to `count` nodes of each spectrum are played; the maps are of one figure. None where nodes
    are still to be played.

    `shares` are those of one model at the nodes of one spectrum, near the boundary or away from it:
    `equal` counts nodes against each of `REFERENCES`; `failed` are nodes that the model could not
    finish, counted as unequal. A map has rows of letters by panel, lowest amplitude first; `equal`
    of its `nodes` have the unilateral event-based model's outcome.
    """
    others = [
        replace(request, model=model, settings={})
        for model in CANDIDATES
        if not models.not_installed(model)
    ]
    requests = {one.model: one for one in (request, *others)}
    shares = [list(_shares(book, panel, one, others, count)) for panel, one in spectra.items()]
    coarse = {
        model: replace(one, size=MAP_SIZE, refine=False)
        for model, one in requests.items()
        if model not in PLAYED_SHARE
    }
    maps = list(_maps(book, list(spectra), coarse))
    if book.wanted:
        return None
    fewer = [one.model for one in others if one.model in PLAYED_SHARE]
    return {
        "about": f"Share of equal outcomes at {count} nodes of each spectrum of {request.size} x"
        f" {request.size} nodes. Half of them are at most {NEAR} nodes from a boundary (near), the"
        " others further away. Models are held against the paper's bilateral event-based model and"
        " against the unilateral one, which lets the block hop as the other models do. Runs of the"
        " other models end with the pulse where the block then lacks the energy to tip over,"
        f" otherwise {SETTLE:g} s later. A block that then stands counts as safe."
        + (f" Played at fewer of the nodes: {', '.join(fewer)}." if fewer else ""),
        "date": datetime.now(UTC).date().isoformat(),
        "versions": provenance.versions(),
        "settings": {model: dict(one.settings) for model, one in requests.items()},
        "shares": [share for some in shares for share in some],
        "map_frequencies": coarse["ebm"].frequencies.tolist(),
        "map_amplitudes": coarse["ebm"].amplitudes.tolist(),
        "maps": maps,
    }


def _shares(
    book: Book, panel: Panel, spectrum: Spectrum, others: Sequence[Request], count: int
) -> Iterator[dict[str, Any]]:
    chosen = choose_nodes(spectrum, count, panel.name)
    sides = {"ebm": [spectrum.outcomes[tuple(part.T)] for part in chosen]}
    for one in others:
        # at least two, one on each side
        number = max(2, round(PLAYED_SHARE.get(one.model, 1.0) * count))
        halves = (
            [number // 2, number - number // 2]
            if number < sum(map(len, chosen))
            else [*map(len, chosen)]
        )
        i, j = np.concatenate([part[:half] for part, half in zip(chosen, halves, strict=True)]).T
        how = panel.scene, one.amplitudes[i], one.frequencies[j], one.model, one.settings
        if not plays(one, panel):
            continue
        outcomes, failed = book.outcomes(*how)
        ends = [len(chosen[0][: halves[0]])]
        mine, fine = np.split(outcomes, ends), np.split(~failed, ends)
        sides.setdefault(one.model, mine)
        for part in (0, 1):
            yield {
                "spectrum": panel.name,
                "figure": panel.figure,
                "model": one.model,
                "near": part == 0,
                "nodes": len(mine[part]),
                "failed": len(mine[part]) - int(fine[part].sum()),
                "equal": {
                    other: int(
                        np.sum(fine[part] & (mine[part] == sides[other][part][: len(mine[part])]))
                    )
                    for other in REFERENCES
                    if other != one.model and other in sides
                },
            }


def mapped(panels: Sequence[Panel]) -> list[Panel]:
    """The panels of the figure of which every model draws a map."""
    figures = [panel.figure for panel in panels]
    return [p for p in panels if p.figure == (MAPPED if MAPPED in figures else figures[0])]


def _maps(
    book: Book, panels: Sequence[Panel], requests: Mapping[str, Request]
) -> Iterator[dict[str, Any]]:
    chosen = mapped(panels)
    drawn = {
        model: [book.spectrum(panel, one) for panel in chosen] for model, one in requests.items()
    }
    if book.wanted:
        return
    letters = {
        model: np.array([letters_of(one.outcomes, one.undecided) for one in some if one])
        for model, some in drawn.items()
    }
    for model, mine in letters.items():
        yield {
            "model": model,
            "nodes": mine.size,
            "equal": int(np.sum(mine == letters["ebm-unilateral"])),
            "outcomes": {
                panel.name: ["".join(row) for row in grid]
                for panel, grid in zip(chosen, mine, strict=True)
            },
        }


def blocks(found: Agreement, panels: Sequence[Panel], came: bool) -> Iterator[Block]:
    """The agreement as text, tables and maps; `came`: whether it came with the package."""
    origin = (
        f"Not computed in this run: it came with the package, from a run on {found['date']} by"
        f" rockcheck {found['versions'].get('rockcheck', '')}. --agreement 200 computes it anew"
        if came
        else f"Computed on {found['date']}"
    )
    settings = "; ".join(
        f"{model} {', '.join(f'{key} {value}' for key, value in chosen.items()) or 'as it comes'}"
        for model, chosen in found["settings"].items()
    )
    versions = ", ".join(
        f"{name} {found['versions'][name]}"
        for name in ("dartpy", "drake", "mujoco", "pybullet", "pymunk")
        if name in found["versions"]
    )
    yield Text(
        f"{found['about']} {origin}. Settings: {settings}. {versions}.",
        "The same spectra by the other models",
        on="page",
    )
    model = Column("model", kind="model")
    yield _table("agreement", found["shares"], [model])
    yield _table(
        "agreement-by-spectrum",
        found["shares"],
        [text("spectrum"), model],
        title="Spectrum by spectrum",
        on="page",
        folded=True,
    )
    if found["maps"]:
        equal = ", ".join(
            f"{one['model']} {one['equal']} of {one['nodes']}"
            for one in found["maps"]
            if one["model"] != "ebm-unilateral"
        )
        size = len(found["map_frequencies"])
        yield Plot(
            "models",
            f"Fig. {panels[0].figure} by every model" if panels[0].figure else "By every model",
            kind="spectra",
            note=f"{size} x {size} nodes a spectrum; equal to the unilateral event-based model's:"
            f" {equal}.",
            data={
                "frequencies": found["map_frequencies"],
                "amplitudes": found["map_amplitudes"],
                "record": False,
                "panels": [
                    {
                        "title": panel.title.replace(", ", "\n") if row == 0 else "",
                        "free": panel.wall is None,
                        "outcomes": "".join(one["outcomes"][panel.name]),
                        "place": [row, 1, column],
                        "row": one["model"],
                    }
                    for row, one in enumerate(found["maps"])
                    for column, panel in enumerate(panels)
                ],
                "height": 0.4 + 0.92 * len(found["maps"]),
            },
        )


def _table(name: str, shares: Sequence[Any], by: Sequence[Column], **more: Any) -> Table:
    """The shares of equal outcomes, summed up by some columns."""
    columns = [
        Column(f"{side}_{short}", f"{side}, {short}", kind="percent")
        for short in REFERENCES.values()
        for side in ("near", "away")
    ]
    groups: dict[tuple[str, ...], list[Any]] = {}
    for one in shares:
        groups.setdefault(tuple(one[column.name] for column in by), []).append(one)
    return Table(
        name,
        [*by, *columns, Column("nodes"), Column("failed")],
        [
            [
                *at,
                *(_equal(some, near, one) for one in REFERENCES for near in (True, False)),
                *(sum(one[count] for one in some) for count in ("nodes", "failed")),
            ]
            for at, some in groups.items()
        ],
        **more,
    )


def _equal(shares: Sequence[Any], near: bool, reference: str) -> float | None:
    mine = [share for share in shares if share["near"] == near and reference in share["equal"]]
    nodes = sum(share["nodes"] for share in mine)
    return sum(share["equal"][reference] for share in mine) / nodes if nodes else None
