"""`rockcheck spectrum`: overturning spectra, the paper's and one's own, as a study."""

import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, Spectrum
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, node_pulse
from rockcheck.scenes import Ricker, Scene, Sine, reading, writing
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.finding import Block, Column, Finding, Mark, Plot, Table, Text, text
from rockcheck.validation.paper import (
    GAPS,
    KEPT,
    Panel,
    measures,
    paper_panels,
    title_of,
)
from rockcheck.validation.studies.spectrum import agreement, tiles
from rockcheck.validation.study import Study

Indices = NDArray[np.int64]
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
LAWS = (
    "Depends on the impact law: so many nodes have another outcome where a block strikes one"
    ' contact after another and not all at once (impacts = "moreau"): as it lands flush against a'
    ' wall that bounces ("floor-first") or flat on the floor while it slides ("leading-first",'
    ' "trailing-first"). In the figure they have a ring. Rigid-body mechanics does not tell between'
    " these laws."
)


#: Of a book's nodes: spectra and motions by panel, what the paper's sentences ask for, and the
#: agreement of the other models.
_Found = tuple[
    dict[Panel, Spectrum],
    dict[Panel, tiles.Played],
    measures.Paper | None,
    agreement.Agreement | None,
]


@dataclass(frozen=True)
class Spectra(Study):
    """The spectra of some panels, all on one grid by one model.

    At `compared` nodes of each, where that is not 0, the other models play, too. Raises
    `InputError` where the model cannot play.
    """

    panels: tuple[Panel, ...]
    request: tiles.Request = field(default_factory=tiles.Request)
    compared: int = 0
    name = "spectrum"
    record = tiles.Played

    def __post_init__(self) -> None:
        check = getattr(models.build(self.request.model, self.request.settings), "check", None)
        for panel in self.panels if check else ():
            check(panel.scene)  # type: ignore[misc]

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[tiles.Nodes]:
        """The nodes that are still to be played."""
        book = tiles.Book(done)
        self._found(book)
        return book.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The complete spectra, and the findings from them."""
        by_panel, motions, paper, compared = self._found(tiles.Book(done))
        panels, spectra = list(by_panel), list(by_panel.values())
        nodes, runs = sum(s.outcomes.size for s in spectra), sum(s.evaluations for s in spectra)
        answer = (
            f"{100.0 * spectra[0].safe_area:.2f} % of {nodes} nodes are safe."
            if len(self.panels) == len(spectra) == 1
            else f"{len(spectra)} spectra: {nodes} nodes, {runs} runs."
        )
        laws = any(one.depends_on_law is not None for one in spectra)
        blocks: list[Block] = [
            Text(ABOUT, on="page"),
            *self._figures(by_panel, motions),
            self._shares(by_panel, laws),
            *([Text(LAWS, on="page")] if laws else ()),
        ]
        if paper:
            claims = measures.claims_of(paper)
            tally = Counter(claim.verdict for claim in claims)
            answer = (
                f"Of {tally.total()} sentences of the paper {tally['holds']} hold,"
                f" {tally['holds in part']} hold in part, {tally['does not hold']} do not."
            )
            blocks += measures.blocks(paper, claims)
        if self._papers and not self.compared:
            compared, panels = reading.read_json(KEPT / "agreement.json"), [*paper_panels()]
        if compared:
            blocks += agreement.blocks(compared, agreement.mapped(panels), came=not self.compared)
        return Finding(
            self.name,
            "Overturning spectra" if len(self.panels) > 1 else self.panels[0].title,
            answer,
            blocks,
            data={
                "model": self.request.model,
                "settings": dict(self.request.settings),
                "agreement": compared,
            },
            files={
                f"{self._stem(panel)}.{kind}": content
                for panel, one in by_panel.items()
                for kind, content in self._files(panel, one).items()
            },
            exit_code=3 if any(isinstance(one, pool.Failure) for one in done.values()) else 0,
        )

    @property
    def _papers(self) -> bool:
        return self.request.model == "ebm" and (
            {panel.name for panel in self.panels} >= {panel.name for panel in paper_panels()}
        )

    def _stem(self, panel: Panel) -> str:
        """The name of a spectrum's files: the panel's, and the model's unless it is the paper's."""
        return panel.name + ("" if self.request.model == "ebm" else f"--{self.request.model}")

    def _found(self, book: tiles.Book) -> _Found:
        """All that follows from the nodes played; the book lists those still to be played."""
        found = {panel: self._spectrum(book, panel) for panel in self.panels}
        spectra = {panel: one for panel, one in found.items() if one is not None}
        fast = tiles.compiled(models.build(self.request.model, self.request.settings))
        i, j = np.meshgrid(*[_spread(self.request.size)] * 2, indexing="ij")
        motions = {
            panel: book.ask(self._nodes(panel.scene, i.ravel(), j.ravel(), "motions"))[0]
            if fast
            else tiles.Played()
            for panel in self.panels
        }
        whole = len(spectra) == len(self.panels)
        return (
            spectra,
            motions,
            self._paper(book, list(spectra.values())) if whole and self._papers else None,
            agreement.agree(book, spectra, self.request, self.compared)
            if whole and self.compared
            else None,
        )

    def _spectrum(self, book: tiles.Book, panel: Panel) -> Spectrum | None:
        """The spectrum and, as soon as they are known, its nodes that depend on the impact law."""
        request, walls = self.request, panel.scene.walls
        player = models.build(request.model, request.settings)
        others = (
            other_laws(
                player,
                walls=any(wall.restitution > 0.0 for wall in walls),
                flat=may_fly(panel.scene),
            )
            if isinstance(player, EventBasedModel)
            else ()
        )
        one = book.spectrum(panel, request)
        played = (
            book.spectrum(panel, request, {**request.settings, "impacts": law}) for law in others
        )
        laws = [law for law in played if law is not None]
        if one is None or not laws or len(laws) < len(others):
            return one
        return replace(one, depends_on_law=tiles.differing(one, laws))

    def _nodes(self, scene: Scene, i: Indices, j: Indices, what: tiles.What) -> list[tiles.Nodes]:
        one = self.request
        return tiles.nodes_of(
            scene, one.amplitudes[i], one.frequencies[j], one.model, one.settings, what
        )

    def _paper(self, book: tiles.Book, spectra: Sequence[Spectrum]) -> measures.Paper | None:
        scanned = {
            measures.SCANNED_WALLS[one.scene.name]: book.outcomes(
                one.scene,
                measures.SCANNED,
                np.full(len(measures.SCANNED), measures.SCANNED_AT),
                self.request.model,
                self.request.settings,
            )
            for one in spectra
            if one.scene.name in measures.SCANNED_WALLS
        }
        struck = [(one, *measures.near_one_impact(one)) for one in spectra if not one.scene.walls]
        records = [book.ask(self._nodes(one.scene, i, j, "one impact")) for one, i, j in struck]
        if book.wanted:
            return None
        tongues = {}
        for (one, i, j), some in zip(struck, records, strict=True):
            mask = np.zeros(one.outcomes.shape, dtype=bool)
            mask[i, j] = [letter == "Y" for record in some for letter in record.letters]
            tongues[one.scene.floor.friction] = mask
        return measures.Paper(
            spectra,
            {
                wall: float(measures.SCANNED[sides != SAFE].min(initial=np.inf))
                for wall, (sides, _) in scanned.items()
            },
            tongues,
        )

    def _shares(self, spectra: Mapping[Panel, Spectrum], laws: bool) -> Table:
        return Table(
            "spectra",
            [
                text("spectrum"),
                text("title", brief=False),
                Column("figure", brief=False),
                Column("safe", kind="percent", digits=4),
                Column("left", kind="percent", digits=4, help="overturned counterclockwise"),
                Column("right", kind="percent", digits=4, help="overturned clockwise"),
                Column("undecided"),
                *([Column("depends_on_law")] if laws else []),
                Column("runs"),
                text("csv", brief=False),
                text("npz", brief=False),
            ],
            [
                [
                    panel.name,
                    panel.title,
                    panel.figure,
                    one.safe_area,
                    *(float(np.mean(one.outcomes == side)) for side in (LEFT, RIGHT)),
                    len(one.undecided),
                    *(
                        [None if one.depends_on_law is None else len(one.depends_on_law)]
                        if laws
                        else []
                    ),
                    one.evaluations,
                    *(Mark(k.upper(), link=f"{self._stem(panel)}.{k}") for k in ("csv", "npz")),
                ]
                for panel, one in spectra.items()
            ],
            "Shares of outcomes",
        )

    def _figures(
        self, spectra: Mapping[Panel, Spectrum], motions: Mapping[Panel, tiles.Played]
    ) -> Iterator[Plot]:
        request = self.request
        for number in dict.fromkeys(panel.figure for panel in spectra):
            mine = [panel for panel in spectra if panel.figure == number]
            first = mine[0]
            pulses, pulse = None, first.scene.excitation
            if isinstance(pulse, Ricker | Sine):
                # amplitude (m/s^2) and period (s) along the axes, and where the user's own one is
                f, a = request.frequencies, request.amplitudes
                amplitudes, periods = (some.tolist() for some in node_pulse(first.scene, a, f))
                own = f[0] * periods[0] / pulse.period, a[0] * pulse.amplitude / amplitudes[0]
                pulses = {
                    "amplitude": amplitudes,
                    "period": periods,
                    "own": [*map(float, own)] if number is None else None,
                }
            yield Plot(
                self._stem(first).replace(first.name, f"figure-{number}" if number else first.name),
                (title_of(number) if number else first.title)
                + ("" if request.model == "ebm" else f", by {request.model}"),
                kind="spectra",
                live=True,
                note=f"{request.size} x {request.size} nodes, {request.model}"
                + (", refined along boundaries." if request.refine else "."),
                data={
                    "frequencies": request.frequencies.tolist(),
                    "amplitudes": request.amplitudes.tolist(),
                    "record": first.scene.excitation.kind == "record",
                    "pulse": pulses,
                    "panels": [self._panel(one, spectra[one], motions[one]) for one in mine],
                    "height": 4.0,
                },
                played=[
                    {
                        "block": [panel.scene.block.half_width, panel.scene.block.half_height],
                        "alpha": panel.scene.block.alpha,
                        "walls": [{"side": w.side, "gap": w.gap} for w in panel.scene.walls],
                        "ends": motions[panel].ends,
                        "rows": motions[panel].rows,
                    }
                    for panel in mine
                ],
            )

    def _panel(self, panel: Panel, one: Spectrum, motions: tiles.Played) -> dict[str, Any]:
        wall, spread = panel.wall, _spread(self.request.size)
        place = [0, 4, 0] if panel.figure is None else [1, 2, 0]
        if panel.figure is not None and wall:
            place = [0 if wall.restitution == 0.0 else 2, 2, 1 + GAPS.index(wall.gap)]
        return {
            "title": panel.title,
            "free": wall is None,
            "outcomes": "".join(tiles.letters_of(one.outcomes, one.undecided).ravel()),
            "law": [] if one.depends_on_law is None else one.depends_on_law.tolist(),
            "place": place,
            "nodes": [
                [int(spread[n // len(spread)]), int(spread[n % len(spread)])]
                for n in motions.played
            ],
        }

    def _files(self, panel: Panel, one: Spectrum) -> dict[str, bytes]:
        """A spectrum as CSV and as NPZ, with its settings.

        The CSV has one row an amplitude ratio, one column a frequency ratio: -1 overturned left, 0
        safe, 1 overturned right. A record's samples are left out of the settings: its name
        identifies it.
        """
        about = json.dumps(
            {
                "name": self._stem(panel),
                "title": panel.title,
                "figure": panel.figure,
                "scene": panel.scene.model_dump(
                    mode="json", exclude={"excitation": {"unscaled"}, "vertical": {"unscaled"}}
                ),
                "model": self.request.model,
                "settings": dict(self.request.settings),
                "refined": self.request.refine,
                "evaluations": one.evaluations,
                "versions": provenance.versions(),
            }
        )
        rows = zip(one.amplitude_ratios.tolist(), one.outcomes.tolist(), strict=True)
        table = writing.table_text(
            ["amplitude_ratio\\frequency_ratio", *map(repr, one.frequency_ratios.tolist())],
            ([amplitude, *row] for amplitude, row in rows),
        )
        arrays = io.BytesIO()
        law: Any = one.depends_on_law
        np.savez_compressed(
            arrays,
            outcomes=one.outcomes,
            frequency_ratios=one.frequency_ratios,
            amplitude_ratios=one.amplitude_ratios,
            undecided=one.undecided,
            settings=np.array(about),
            **({} if law is None else {"depends_on_law": law}),
        )
        return {
            "csv": f"# rockcheck spectrum {about}\n{table}".encode(),
            "npz": arrays.getvalue(),
        }


def _spread(size: int) -> NDArray[np.int64]:
    return np.unique(np.round(np.linspace(0, size - 1, min(size, KEPT_AN_AXIS))).astype(np.int64))
