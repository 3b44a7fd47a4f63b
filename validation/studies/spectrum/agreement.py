"""How far other models agree with an overturning spectrum, node by node.

In: spectra of event-based models, and the book of what is played. Out: shares of equal outcomes and
coarse maps, as JSON keeps them. Called by the study, which plays what the book then wants.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import CALM, vary
from rockcheck.engines import registry
from rockcheck.engines.engine import Engine
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.paper import Panel
from rockcheck.validation.studies.spectrum import tiles

#: How engines play spectra, by name; those that play none are left out.
ENGINE_PLAYS = {facts.name: facts.spectrum for facts in registry.every() if facts.spectrum}
CANDIDATES = ("ebm-unilateral", "cm", *ENGINE_PLAYS)
#: The share of the nodes that a model plays, where it is not all. These engines draw no map: fewer
#: nodes show whether they agree.
PLAYED_SHARE = {name: play.share for name, play in ENGINE_PLAYS.items() if play.share < 1.0}
REFERENCES = {"ebm": "bilateral", "ebm-unilateral": "unilateral"}
#: A node is near the boundary if a node of another outcome is among those at most this many nodes
#: away, diagonals included.
NEAR = 2
#: The paper's figure of which every model draws a map, and the map's nodes an axis, at the most.
MAPPED, MAP_SIZE = 8, 25
Indices = NDArray[np.int64]
#: All shares and maps, as JSON keeps them (`agree`).
Agreement = Mapping[str, Any]


def choose_nodes(spectrum: Spectrum, count: int, name: str) -> tuple[Indices, Indices]:
    """`count` nodes (i, j) of a spectrum: those near the boundary, and those away from it.

    Half of them are near it, where there are enough. The choice is random but depends only on
    `name`. Nodes that the reference could not decide are left out.
    """
    near = vary(spectrum.outcomes, 2 * NEAR + 1)
    random = np.random.default_rng(zlib.crc32(name.encode()))
    decided = tiles.letters_of(spectrum.outcomes, spectrum.undecided) != tiles.UNDECIDED
    inside, outside = np.argwhere(near & decided), np.argwhere(~near & decided)
    number_near = max(min(count // 2, len(inside)), min(count - len(outside), len(inside)))
    return (
        inside[random.permutation(len(inside))[:number_near]],
        outside[random.permutation(len(outside))[: count - number_near]],
    )


def plays(request: tiles.Request, panel: Panel) -> bool:
    """Whether the model can play the contacts of the panel.

    An engine without restitution does not play walls or a floor that bounce.
    """
    model = models.build(request.model, request.settings)
    bounces = panel.scene.floor.restitution or any(wall.restitution for wall in panel.scene.walls)
    return not (bounces and isinstance(model, Engine) and "restitution" in model.lacks())


def agree(
    book: tiles.Book, spectra: Mapping[Panel, Spectrum], request: tiles.Request, count: int
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
    shares: list[dict[str, Any]] = []
    for panel, spectrum in spectra.items():
        players = [other for other in others if plays(other, panel)]
        shares += _shares(book, panel, spectrum, players, count)
    coarse = {
        wanted.model: replace(wanted, size=min(MAP_SIZE, wanted.size), refine=False)
        for wanted in (request, *others)
        if wanted.model not in PLAYED_SHARE
    }
    maps = list(_maps(book, list(spectra), coarse))
    if book.wanted:
        return None
    settings = {wanted.model: dict(wanted.settings) for wanted in (request, *others)}
    return {
        "about": _about(request, count, [other.model for other in others]),
        "date": datetime.now(UTC).date().isoformat(),
        "versions": provenance.versions(),
        "settings": settings,
        "shares": shares,
        "map_frequencies": coarse["ebm"].frequencies.tolist(),
        "map_amplitudes": coarse["ebm"].amplitudes.tolist(),
        "maps": maps,
    }


def _about(request: tiles.Request, count: int, other_models: Sequence[str]) -> str:
    """What was compared, in words."""
    words = (
        f"Share of equal outcomes at {count} nodes of each spectrum of {request.size} x"
        f" {request.size} nodes. Half of them are at most {NEAR} nodes from a boundary (near), the"
        " others further away. Models are held against the paper's bilateral event-based model and"
        " against the unilateral one, which lets the block hop as the other models do. Runs of the"
        " other models end with the pulse where the block then lacks the energy to tip over,"
        f" otherwise at least {CALM:g} s later. A block that then stands counts as safe."
    )
    fewer = [model for model in other_models if model in PLAYED_SHARE]
    return words + (f" Played at fewer of the nodes: {', '.join(fewer)}." if fewer else "")


def _shares(
    book: tiles.Book,
    panel: Panel,
    spectrum: Spectrum,
    requests: Sequence[tiles.Request],
    count: int,
) -> Iterator[dict[str, Any]]:
    """The shares of each model's request at the nodes of one spectrum, near the boundary first."""
    near, away = choose_nodes(spectrum, count, panel.name)
    outcomes = {"ebm": _at_nodes(spectrum, near, away)}
    for request in requests:
        nodes_near, nodes_away = _fewer(request.model, near, away, count)
        i, j = np.concatenate([nodes_near, nodes_away]).T
        sides, failed = book.outcomes(
            request.nodes(panel.scene, request.amplitudes[i], request.frequencies[j])
        )
        # Nothing is equal to what a reference could not finish.
        ends = [len(nodes_near)]
        outcomes.setdefault(request.model, np.split(np.where(failed, np.nan, sides), ends))
        halves = zip(np.split(sides, ends), np.split(~failed, ends), strict=True)
        for half, (mine, finished) in enumerate(halves):
            equal = {
                reference: int(np.sum(finished & (mine == outcomes[reference][half][: len(mine)])))
                for reference in REFERENCES
                if reference != request.model and reference in outcomes
            }
            yield {
                "spectrum": panel.name,
                "figure": panel.figure,
                "model": request.model,
                "near": half == 0,
                "nodes": len(mine),
                "failed": len(mine) - int(finished.sum()),
                "equal": equal,
            }


def _at_nodes(spectrum: Spectrum, near: Indices, away: Indices) -> list[NDArray[Any]]:
    """The outcomes of a spectrum at both sets of nodes."""
    return [spectrum.outcomes[tuple(nodes.T)] for nodes in (near, away)]


def _fewer(model: str, near: Indices, away: Indices, count: int) -> tuple[Indices, Indices]:
    """The nodes that a model plays, of which it may play a share: at least one on each side."""
    number = max(2, round(PLAYED_SHARE.get(model, 1.0) * count))
    if number >= len(near) + len(away):
        return near, away
    return near[: number // 2], away[: number - number // 2]


def mapped(panels: Sequence[Panel]) -> list[Panel]:
    """The panels of the figure of which every model draws a map."""
    figures = [panel.figure for panel in panels]
    return [p for p in panels if p.figure == (MAPPED if MAPPED in figures else figures[0])]


def _maps(
    book: tiles.Book, panels: Sequence[Panel], requests: Mapping[str, tiles.Request]
) -> Iterator[dict[str, Any]]:
    """The map of each model, by panel; none where nodes are still to be played."""
    chosen = mapped(panels)
    spectra = {
        model: [book.spectrum(panel, request) for panel in chosen]
        for model, request in requests.items()
    }
    if book.wanted:
        return
    letters = {}
    for model, maps in spectra.items():
        grids = [
            tiles.letters_of(spectrum.outcomes, spectrum.undecided)
            for spectrum in maps
            if spectrum is not None
        ]
        letters[model] = np.array(grids)
    for model, mine in letters.items():
        outcomes = {
            panel.name: ["".join(row) for row in grid]
            for panel, grid in zip(chosen, mine, strict=True)
        }
        yield {
            "model": model,
            "nodes": mine.size,
            "equal": int(np.sum(mine == letters["ebm-unilateral"])),
            "outcomes": outcomes,
        }
