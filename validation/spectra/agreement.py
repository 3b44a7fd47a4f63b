"""The same spectra by the other models: at some nodes of each, the share of outcomes that are equal to the event-based models'."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.engines.engine import Engine
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import Model, build, not_installed
from rockcheck.validation.spectra.claims import percent
from rockcheck.validation.spectra.study import Panel, SpectrumRequest, play_panels
from rockcheck.validation.spectra.tiles import CODES, UNDECIDED, Tiles
from rockcheck.validation.uncertainty.population import SETTLE

CANDIDATES = ("ebm-unilateral", "cm", "mujoco", "pybullet", "pymunk", "dart", "drake")
#: The share of the nodes that a model plays, where it is not all. These engines draw no map: whether they, too, agree is told by fewer
#: nodes, and a run of DART costs four times, one of Drake twice the others'.
PLAYED_SHARE = {"pymunk": 0.3, "dart": 0.1, "drake": 0.2}
REFERENCES = ("ebm", "ebm-unilateral")
COLUMNS = ("spectrum", "model", "near, bilateral", "away, bilateral", "near, unilateral", "away, unilateral", "nodes", "failed")
#: A node is near the boundary if a node of another outcome is among those at most this many nodes away, diagonals included.
NEAR = 2
#: The paper's figure of which every model draws a map, and the map's nodes an axis.
MAPPED, MAP_SIZE = 8, 25


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


class Map(Stored):
    """The spectra of one figure by one model, coarsely: by panel, rows of `validation.spectra.study` codes, lowest amplitude first.

    `equal` are the nodes, of `nodes`, at which the outcome is the unilateral event-based model's.
    """

    model: str
    nodes: int
    equal: int
    outcomes: dict[str, tuple[str, ...]]


class Agreement(Stored):
    """`agreement.json`: all shares, and a map by each model."""

    format: int = 2
    about: str
    #: Day of the run, ISO 8601; of a machine's clock in UTC.
    date: str
    versions: dict[str, str]
    settings: dict[str, dict[str, Any]]
    shares: tuple[Share, ...]
    map_frequencies: tuple[float, ...]
    map_amplitudes: tuple[float, ...]
    maps: tuple[Map, ...]

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The table with `COLUMNS`: all spectra together first, then a row for each spectrum and model."""
        models = list(dict.fromkeys(share.model for share in self.shares))
        rows = [_row("all", model, [share for share in self.shares if share.model == model]) for model in models]
        for name in dict.fromkeys(share.spectrum for share in self.shares):
            groups = {model: [s for s in self.shares if (s.spectrum, s.model) == (name, model)] for model in models}
            rows += [_row(name, model, shares) for model, shares in groups.items() if shares]
        return tuple(rows)


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


def first_of(near: NDArray[np.bool_], count: int) -> NDArray[np.int64]:
    """The indices of `count` of the chosen nodes, in the order chosen: the first half of each side, or all nodes."""
    if count >= len(near):
        return np.arange(len(near))
    sides = [np.flatnonzero(near == part) for part in (True, False)]
    wanted = [min(count // 2, len(sides[0])), min(count - count // 2, len(sides[1]))]
    return np.concatenate([side[:number] for side, number in zip(sides, wanted, strict=True)])


def near_boundary(outcomes: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Which nodes have another outcome within `NEAR` nodes."""
    from scipy import ndimage

    width = 2 * NEAR + 1
    near: NDArray[np.bool_] = ndimage.maximum_filter(outcomes, width, mode="nearest") != ndimage.minimum_filter(
        outcomes, width, mode="nearest"
    )
    return near


def candidates() -> tuple[str, ...]:
    """The models that are held against the event-based ones and are installed."""
    return tuple(model for model in CANDIDATES if not not_installed(model))


def drawing(models: Sequence[str]) -> tuple[str, ...]:
    """Those of the models that draw maps."""
    return tuple(model for model in models if model not in PLAYED_SHARE)


def nodes_of(model: str, count: int) -> int:
    """At how many of `count` nodes of a spectrum a model plays; two at least, one on each side."""
    return max(2, round(PLAYED_SHARE.get(model, 1.0) * count))


def has_contacts_of(model: Model, panel: Panel) -> bool:
    """Whether the model has what the panel asks of contacts; an engine without restitution does not play walls that bounce."""
    lacks = model.lacks() if isinstance(model, Engine) else ()
    return "restitution" not in lacks or panel.wall is None or panel.wall.restitution == 0.0


def agree(
    panels: Sequence[Panel],
    spectra: Sequence[Spectrum],
    request: SpectrumRequest,
    count: int,
    tiles: Tiles,
) -> Agreement:
    """Plays up to `count` nodes of each spectrum by the other models and counts equal outcomes; then a map of one figure by each model."""
    shares: list[Share] = []
    models = candidates()
    settings = {model: SpectrumRequest(request.frequencies, request.amplitudes, model).settings for model in models}
    for panel, spectrum in zip(panels, spectra, strict=True):
        nodes, near = choose_nodes(spectrum, count, panel.name)
        i, j = nodes.T
        sides = {"ebm": spectrum.outcomes[i, j]}
        for model in models:
            if not has_contacts_of(build(model, settings[model]), panel):
                continue
            chosen = first_of(near, nodes_of(model, count))
            amplitudes, frequencies = request.amplitudes[i[chosen]], request.frequencies[j[chosen]]
            mine, failures = tiles.play(panel.scene, amplitudes, frequencies, model=model, settings=settings[model])
            if model in REFERENCES:
                sides[model] = mine
            for part in (True, False):
                here = near[chosen] == part
                fine = here & ~failures
                equal = {other: int(np.sum(fine & (mine == sides[other][chosen]))) for other in REFERENCES if other != model}
                shares.append(
                    Share(
                        spectrum=panel.name,
                        figure=panel.figure,
                        model=model,
                        near=part,
                        nodes=int(here.sum()),
                        failed=int(np.sum(here & failures)),
                        equal=equal,
                    )
                )
    grid = f"{len(request.amplitudes)} x {len(request.frequencies)}"
    about = (
        f"Share of equal outcomes at {count} nodes of each spectrum of {grid} nodes. Half of them are at most {NEAR} nodes from a boundary"
        " (near), the others further away. Models are held against the paper's bilateral event-based model and against the unilateral one,"
        " which lets the block hop as the other models do. Runs of the other models end with the pulse where the block then lacks the"
        f" energy to tip over, otherwise {SETTLE:g} s later. A block that then stands counts as safe."
    )
    if fewer := [model for model in models if model in PLAYED_SHARE]:
        about += f" Played at fewer of the nodes: {', '.join(fewer)}."
    plain = {request.model: dict(request.settings)} | {model: dict(chosen) for model, chosen in settings.items()}
    across, up = (np.linspace(axis[0], axis[-1], MAP_SIZE) for axis in (request.frequencies, request.amplitudes))
    mapping = [SpectrumRequest(across, up, model, plain[model]) for model in drawing(tuple(plain))]
    return Agreement(
        about=about,
        date=datetime.now(UTC).date().isoformat(),
        versions=provenance.versions(),
        settings=plain,
        shares=tuple(shares),
        map_frequencies=tuple(across.tolist()),
        map_amplitudes=tuple(up.tolist()),
        maps=_maps(mapped(panels), mapping, tiles),
    )


def mapped(panels: Sequence[Panel]) -> list[Panel]:
    """The panels of which every model draws a map: those of one figure."""
    figure = MAPPED if any(panel.figure == MAPPED for panel in panels) else panels[0].figure
    return [panel for panel in panels if panel.figure == figure]


def _maps(panels: Sequence[Panel], request: Sequence[SpectrumRequest], tiles: Tiles) -> tuple[Map, ...]:
    played = {one.model: play_panels(panels, one, tiles) for one in request}
    truth = played["ebm-unilateral"]
    return tuple(
        Map(
            model=model,
            nodes=sum(spectrum.outcomes.size for spectrum in spectra),
            equal=sum(int(np.sum(mine.outcomes == true.outcomes)) for mine, true in zip(spectra, truth, strict=True)),
            outcomes={panel.name: encoded(spectrum) for panel, spectrum in zip(panels, spectra, strict=True)},
        )
        for model, spectra in played.items()
    )


def encoded(spectrum: Spectrum) -> tuple[str, ...]:
    """Outcomes as rows of text, lowest amplitude first: L left, R right, . safe, ? undecided."""
    rows = [[CODES[int(side)] for side in row] for row in spectrum.outcomes]
    for i, j in spectrum.undecided:
        rows[i][j] = UNDECIDED
    return tuple("".join(row) for row in rows)


def map_spectra(found: Agreement, one: Map, panels: Sequence[Panel]) -> list[Spectrum]:
    """A model's map as spectra, one a panel."""
    spectra = []
    for panel in panels:
        codes = np.array([list(row) for row in one.outcomes[panel.name]])
        outcomes = np.zeros(codes.shape, dtype=np.int8)
        for side, code in CODES.items():
            outcomes[codes == code] = side
        spectra.append(
            Spectrum(
                outcomes=outcomes,
                frequency_ratios=np.array(found.map_frequencies),
                amplitude_ratios=np.array(found.map_amplitudes),
                evaluations=codes.size,
                undecided=np.argwhere(codes == UNDECIDED),
                scene=panel.scene,
                model=None,
            )
        )
    return spectra


def _row(name: str, model: str, shares: Sequence[Share]) -> tuple[str, ...]:
    cells = []
    for reference in REFERENCES:
        for near in (True, False):
            mine = [share for share in shares if share.near == near and reference in share.equal]
            nodes = sum(share.nodes for share in mine)
            cells.append(percent(sum(share.equal[reference] for share in mine) / nodes) if nodes else "–")
    return (name, model, *cells, *(str(sum(getattr(share, what) for share in shares)) for what in ("nodes", "failed")))
