"""An overturning spectrum as a figure with its motions, and as a table of shares.

In: spectra and the motions of some of their nodes, by panel. Out: blocks of a finding. Called by
the study.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT, node_pulse
from rockcheck.scenes import Pulse
from rockcheck.validation.finding import Block, Column, Mark, Plot, Table, Text, text
from rockcheck.validation.paper import GAPS, TITLES, Panel
from rockcheck.validation.studies.spectrum import scene_node, tiles

#: Nodes an axis whose histories are kept, both ends of the axis among them.
KEPT_AN_AXIS = 16
ABOUT = (
    "Which pulses overturn the block: frequency against amplitude of the pulse, each node a run"
    " until its outcome is certain. ωₚ is the pulse's circular frequency, over that of the block,"
    " p = √(3g/4R) if it is homogeneous; aₚ its peak acceleration, over the g tan α that lifts a"
    " corner. Point at a node: each spectrum of the figure says what becomes of the block there. A"
    " click plays the motion: of the model's own histories, the one next to the click that ends the"
    " same way."
)
ABOUT_RECORD = (
    "Which blocks the record overturns: the size of the block, over its own, against the scale of"
    " the record, each node a run until its outcome is certain. 1 and 1 is the block and the record"
    " as they are. Point at a node to see what becomes of the block there. A click plays the"
    " motion: of the model's own histories, the one next to the click that ends the same way."
)
LAWS = (
    "Depends on the impact law: so many nodes have another outcome where a block strikes one"
    ' contact after another and not all at once (impacts = "moreau"): as it lands flush against a'
    ' wall ("floor-first") or flat on the floor while it slides ("leading-first",'
    ' "trailing-first"). In the figure they have a ring. Rigid-body mechanics does not tell between'
    " these laws."
)


def stem_of(panel: Panel, model: str) -> str:
    """The name of a spectrum's files: the panel's, and the model's unless it is the paper's."""
    return panel.name if model == "ebm" else f"{panel.name}--{model}"


def kept_nodes(size: int) -> NDArray[np.int64]:
    """The nodes (i, j) whose histories are kept, a row each."""
    spread = np.round(np.linspace(0, size - 1, min(size, KEPT_AN_AXIS))).astype(np.int64)
    return np.stack(np.meshgrid(*[np.unique(spread)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


def spectrum_blocks(
    spectra: Mapping[Panel, Spectrum],
    motions: Mapping[Panel, tiles.Played],
    request: tiles.Request,
) -> Iterator[Block]:
    """The figures, and the shares of outcomes."""
    is_record = next(iter(motions)).scene.excitation.kind == "record"
    yield Text(ABOUT_RECORD if is_record else ABOUT, on="page")
    for number in dict.fromkeys(panel.figure for panel in spectra):
        of_figure = {
            panel: spectrum for panel, spectrum in spectra.items() if panel.figure == number
        }
        yield _figure(of_figure, motions, request)
    has_laws = any(spectrum.depends_on_law is not None for spectrum in spectra.values())
    yield _table_of_outcomes(spectra, request, has_laws=has_laws)
    if has_laws:
        yield Text(LAWS, on="page")


def _table_of_outcomes(
    spectra: Mapping[Panel, Spectrum], request: tiles.Request, *, has_laws: bool
) -> Table:
    """A row a spectrum: shares of outcomes, undecided nodes, runs, and files."""
    columns = [
        text("spectrum"),
        text("title", brief=False),
        Column("figure", brief=False, optional=True),
        Column("safe", kind="percent", digits=4),
        Column("left", kind="percent", digits=4, help="overturned counterclockwise"),
        Column("right", kind="percent", digits=4, help="overturned clockwise"),
        Column("undecided"),
        *([Column("depends_on_law")] if has_laws else []),
        Column("runs"),
        text("csv", brief=False),
        text("npz", brief=False),
    ]
    rows = []
    for panel, spectrum in spectra.items():
        stem, law = stem_of(panel, request.model), spectrum.depends_on_law
        rows.append(
            [
                panel.name,
                panel.title,
                panel.figure,
                spectrum.safe_area,
                float(np.mean(spectrum.outcomes == LEFT)),
                float(np.mean(spectrum.outcomes == RIGHT)),
                len(spectrum.undecided),
                *([None if law is None else len(law)] if has_laws else []),
                spectrum.evaluations,
                Mark("CSV", link=f"{stem}.csv"),
                Mark("NPZ", link=f"{stem}.npz"),
            ]
        )
    return Table("spectra", columns, rows, "Shares of outcomes")


def _figure(
    spectra: Mapping[Panel, Spectrum],
    motions: Mapping[Panel, tiles.Played],
    request: tiles.Request,
) -> Plot:
    """The spectra of one figure, and what a click on the page plays."""
    first = next(iter(spectra))
    number = first.figure
    by_model = "" if request.model == "ebm" else f", by {request.model}"
    refined = ", refined along boundaries." if request.refine else "."
    name = f"figure-{number}" if number else first.name
    return Plot(
        stem_of(first, request.model).replace(first.name, name),
        TITLES.get(number, first.title) + by_model,
        kind="spectra",
        live=True,
        note=f"{request.size} x {request.size} nodes, {request.model}{refined}",
        data={
            "frequencies": request.frequencies.tolist(),
            "amplitudes": request.amplitudes.tolist(),
            "record": first.scene.excitation.kind == "record",
            "pulse": _pulses(first, request),
            "own": scene_node.ratios(first.scene) if number is None else None,
            "panels": [
                _panel(panel, spectrum, motions[panel], request.size)
                for panel, spectrum in spectra.items()
            ],
            "height": 4.0,
        },
        played=[_motions_of(panel, motions[panel]) for panel in spectra],
    )


def _pulses(panel: Panel, request: tiles.Request) -> dict[str, Any] | None:
    """Amplitude (m/s^2) and period (s) along the axes; None for a record."""
    if not isinstance(panel.scene.excitation, Pulse):
        return None
    amplitudes, periods = node_pulse(panel.scene, request.amplitudes, request.frequencies)
    return {"amplitude": abs(amplitudes).tolist(), "period": abs(periods).tolist()}


def _panel(panel: Panel, spectrum: Spectrum, motions: tiles.Played, size: int) -> dict[str, Any]:
    """One spectrum of a figure: its letters, its place, and the nodes whose histories are kept."""
    place = [0, 4, 0] if panel.figure is None else [1, 2, 0]
    if panel.figure is not None and panel.wall:
        place = [2 if panel.wall.restitution else 0, 2, 1 + GAPS.index(panel.wall.gap)]
    law = spectrum.depends_on_law
    return {
        "title": panel.title,
        "free": panel.wall is None,
        "outcomes": "".join(tiles.letters_of(spectrum.outcomes, spectrum.undecided).ravel()),
        "law": [] if law is None else law.tolist(),
        "place": place,
        "nodes": kept_nodes(size)[[*motions.played]].tolist(),
    }


def _motions_of(panel: Panel, motions: tiles.Played) -> dict[str, Any]:
    """What the page needs to play the motions of a spectrum."""
    block = panel.scene.block
    return {
        "block": [block.half_width, block.half_height],
        "alpha": block.alpha,
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in panel.scene.walls],
        "ends": motions.ends,
        "rows": motions.rows,
    }
