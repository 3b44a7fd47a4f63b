"""`rockcheck spectrum`: overturning spectra, the paper's and one's own, as a study.

At some nodes of each spectrum the outcomes of the other models are compared with those of the
event-based ones; of one figure every model draws a coarse map.
"""

import io
import json
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, Spectrum, horizon
from rockcheck.ebm.spectrum import CALM, LEFT, RIGHT, SAFE, node_pulse, vary
from rockcheck.engines.engine import Engine
from rockcheck.scenes import Pulse, reading, writing
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.finding import Block, Column, Finding, Mark, Plot, Table, Text, text
from rockcheck.validation.paper import (
    GAPS,
    KEPT,
    TITLES,
    Panel,
    paper_panels,
    sentences,
    spectra as paper_spectra,
    tables as paper_tables,
)
from rockcheck.validation.studies.spectrum import scene_node, tiles
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

CANDIDATES = ("ebm-unilateral", "cm", "mujoco", "pybullet", "pymunk", "dart", "drake")
#: The share of the nodes that a model plays, where it is not all. These engines draw no map: fewer
#: nodes show whether they agree; a run of DART costs four times, one of Drake twice the others'.
PLAYED_SHARE = {"pymunk": 0.3, "dart": 0.1, "drake": 0.2}
REFERENCES = {"ebm": "bilateral", "ebm-unilateral": "unilateral"}
#: A node is near the boundary if a node of another outcome is among those at most this many nodes
#: away, diagonals included.
NEAR = 2
#: The paper's figure of which every model draws a map, and the map's nodes an axis, at the most.
MAPPED, MAP_SIZE = 8, 25
#: All shares and maps, as JSON keeps them (`agree`).
Agreement = Mapping[str, Any]


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
        spectra, *_ = self._found(book)
        self._scene_node(book, list(spectra.values()))
        return book.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The complete spectra, and the findings from them."""
        by_panel, motions, paper, compared = self._found(tiles.Book(done))
        panels, spectra = list(by_panel), list(by_panel.values())
        nodes, runs = sum(s.outcomes.size for s in spectra), sum(s.evaluations for s in spectra)
        answer = f"{len(spectra)} spectra: {nodes} nodes, {runs} runs."
        if len(self.panels) == len(spectra) == 1:
            answer = f"{100.0 * spectra[0].safe_area:.2f} % of {nodes} nodes are safe."
        at_scene = self._scene_node(tiles.Book(done), spectra)
        if at_scene is not None:
            answer = scene_node.answer(at_scene, self.panels[0].scene)
        blocks: list[Block] = [*self._blocks(by_panel, motions)]
        if paper:
            claims = list(sentences.claims_of(paper))
            tally = Counter(claim.verdict for claim in claims)
            answer = (
                f"Of {tally.total()} sentences of the paper {tally['holds']} hold,"
                f" {tally['holds in part']} hold in part, {tally['does not hold']} do not."
            )
            blocks += paper_tables.blocks(paper, claims)
        if self._papers and not self.compared:
            compared, panels = reading.read_json(KEPT / "agreement.json"), [*paper_panels()]
        if compared:
            blocks += agreement_blocks(compared, mapped(panels), came=not self.compared)
        return Finding(
            self.name,
            "Overturning spectra" if len(self.panels) > 1 else self.panels[0].title,
            answer,
            blocks,
            data={
                "model": self.request.model,
                "settings": dict(self.request.settings),
                "agreement": compared,
                "own": at_scene and asdict(at_scene),
            },
            files={
                f"{self._stem(panel)}.{kind}": content
                for panel, one in by_panel.items()
                for kind, content in self._files(panel, one).items()
            },
            exit_code=3 if any(isinstance(one, pool.Failure) for one in done.values()) else 0,
        )

    def _scene_node(
        self, book: tiles.Book, spectra: Sequence[Spectrum]
    ) -> scene_node.NodeAnswer | None:
        """The answer at the scene's own pulse or record; None of the paper's spectra.

        A node beyond the axes is a task of its own, which the book asks for.
        """
        scene = self.panels[0].scene
        ratios = scene_node.ratios(scene)
        if self.panels[0].figure is not None or ratios is None or len(spectra) != 1:
            return None
        answer = scene_node.within(spectra[0], ratios)
        if answer is not None:
            return answer
        frequency, amplitude = np.array([ratios[0]]), np.array([ratios[1]])
        sides, failed = book.outcomes(self.request.nodes(scene, amplitude, frequency))
        letters = tiles.letters_of(sides, np.argwhere(failed))
        return scene_node.NodeAnswer(str(letters[0]), inside=False)

    @property
    def _papers(self) -> bool:
        return self.request.model == "ebm" and (
            {panel.name for panel in self.panels} >= {panel.name for panel in paper_panels()}
        )

    def _stem(self, panel: Panel) -> str:
        """The name of a spectrum's files: the panel's, and the model's unless it is the paper's."""
        return panel.name + ("" if self.request.model == "ebm" else f"--{self.request.model}")

    def _found(
        self, book: tiles.Book
    ) -> tuple[
        dict[Panel, Spectrum],
        dict[Panel, tiles.Played],
        paper_spectra.Paper | None,
        Agreement | None,
    ]:
        """Spectra and motions by panel, what the paper's sentences ask for, and the agreement.

        All follows from the nodes played; the book lists those still to be played.
        """
        spectra = {
            panel: one for panel in self.panels if (one := self._spectrum(book, panel)) is not None
        }
        fast = tiles.compiled(models.build(self.request.model, self.request.settings))
        i, j = _kept(self.request.size).T
        at = self.request.amplitudes[i], self.request.frequencies[j]
        motions = {
            panel: book.ask(self.request.nodes(panel.scene, *at, "motions"))[0]
            if fast
            else tiles.Played()
            for panel in self.panels
        }
        whole = len(spectra) == len(self.panels)
        return (
            spectra,
            motions,
            self._paper(book, list(spectra.values())) if whole and self._papers else None,
            agree(book, spectra, self.request, self.compared) if whole and self.compared else None,
        )

    def _spectrum(self, book: tiles.Book, panel: Panel) -> Spectrum | None:
        """The spectrum and, as soon as they are known, its nodes that depend on the impact law."""
        request = self.request
        player = models.build(request.model, request.settings)
        others = (
            horizon.other_laws(
                player,
                walls=bool(panel.scene.walls),
                flat=horizon.may_fly(panel.scene),
            )
            if isinstance(player, EventBasedModel)
            else ()
        )
        one = book.spectrum(panel, request)
        laws = [
            played
            for law in others
            if (
                played := book.spectrum(
                    panel, replace(request, settings={**request.settings, "impacts": law})
                )
            )
        ]
        if one is None or not laws or len(laws) < len(others):
            return one
        return replace(one, depends_on_law=tiles.differing(one, laws))

    def _paper(self, book: tiles.Book, spectra: Sequence[Spectrum]) -> paper_spectra.Paper | None:
        scanned = {
            paper_spectra.SCANNED_WALLS[one.scene.name]: book.outcomes(
                self.request.nodes(
                    one.scene,
                    paper_spectra.SCANNED,
                    np.full(len(paper_spectra.SCANNED), paper_spectra.SCANNED_AT),
                )
            )
            for one in spectra
            if one.scene.name in paper_spectra.SCANNED_WALLS
        }
        struck = [
            (one, *paper_spectra.near_one_impact(one)) for one in spectra if not one.scene.walls
        ]
        records = [
            book.ask(
                self.request.nodes(
                    one.scene, self.request.amplitudes[i], self.request.frequencies[j], "one impact"
                )
            )
            for one, i, j in struck
        ]
        if book.wanted:
            return None
        tongues = {}
        for (one, i, j), some in zip(struck, records, strict=True):
            mask = np.zeros(one.outcomes.shape, dtype=bool)
            mask[i, j] = [letter == "Y" for record in some for letter in record.letters]
            tongues[one.scene.floor.friction] = mask
        return paper_spectra.Paper(
            spectra,
            {
                wall: float(paper_spectra.SCANNED[sides != SAFE].min(initial=np.inf))
                for wall, (sides, _) in scanned.items()
            },
            tongues,
        )

    def _blocks(
        self, spectra: Mapping[Panel, Spectrum], motions: Mapping[Panel, tiles.Played]
    ) -> Iterator[Block]:
        """The figures, and the shares of outcomes."""
        record = self.panels[0].scene.excitation.kind == "record"
        yield Text(ABOUT_RECORD if record else ABOUT, on="page")
        for number in dict.fromkeys(panel.figure for panel in spectra):
            mine = {panel: one for panel, one in spectra.items() if panel.figure == number}
            yield self._figure(mine, motions)
        laws = any(one.depends_on_law is not None for one in spectra.values())
        yield Table(
            "spectra",
            [
                text("spectrum"),
                text("title", brief=False),
                Column("figure", brief=False, optional=True),
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
        if laws:
            yield Text(LAWS, on="page")

    def _figure(
        self, spectra: Mapping[Panel, Spectrum], motions: Mapping[Panel, tiles.Played]
    ) -> Plot:
        request, first, pulses = self.request, next(iter(spectra)), None
        number, pulse = first.figure, first.scene.excitation
        if isinstance(pulse, Pulse):
            # amplitude (m/s^2) and period (s) along the axes
            f, a = request.frequencies, request.amplitudes
            amplitudes, periods = (abs(some).tolist() for some in node_pulse(first.scene, a, f))
            pulses = {"amplitude": amplitudes, "period": periods}
        return Plot(
            self._stem(first).replace(first.name, f"figure-{number}" if number else first.name),
            TITLES.get(number, first.title)
            + ("" if request.model == "ebm" else f", by {request.model}"),
            kind="spectra",
            live=True,
            note=f"{request.size} x {request.size} nodes, {request.model}"
            + (", refined along boundaries." if request.refine else "."),
            data={
                "frequencies": request.frequencies.tolist(),
                "amplitudes": request.amplitudes.tolist(),
                "record": pulse.kind == "record",
                "pulse": pulses,
                "own": scene_node.ratios(first.scene) if number is None else None,
                "panels": [
                    self._panel(panel, one, motions[panel]) for panel, one in spectra.items()
                ],
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
                for panel in spectra
            ],
        )

    def _panel(self, panel: Panel, one: Spectrum, motions: tiles.Played) -> dict[str, Any]:
        place = [0, 4, 0] if panel.figure is None else [1, 2, 0]
        if panel.figure is not None and panel.wall:
            place = [2 if panel.wall.restitution else 0, 2, 1 + GAPS.index(panel.wall.gap)]
        return {
            "title": panel.title,
            "free": panel.wall is None,
            "outcomes": "".join(tiles.letters_of(one.outcomes, one.undecided).ravel()),
            "law": [] if one.depends_on_law is None else one.depends_on_law.tolist(),
            "place": place,
            "nodes": _kept(self.request.size)[[*motions.played]].tolist(),
        }

    def _files(self, panel: Panel, one: Spectrum) -> dict[str, bytes]:
        """A spectrum as CSV and as NPZ, with its settings.

        The CSV has one row an amplitude ratio, one column a frequency ratio: -1 overturned left, 0
        safe, 1 overturned right, an empty cell undecided. A record's samples are left out of the
        settings: its name identifies it.
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
        table = writing.table_text(
            ["amplitude_ratio\\frequency_ratio", *map(repr, one.frequency_ratios.tolist())],
            (
                [
                    amplitude,
                    *(side if side or safe else None for side, safe in zip(*row, strict=True)),
                ]
                for amplitude, *row in zip(
                    *(one.amplitude_ratios.tolist(), one.outcomes.tolist(), one.safe.tolist()),
                    strict=True,
                )
            ),
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


def _kept(size: int) -> Indices:
    """The nodes (i, j) whose histories are kept, a row each."""
    spread = np.round(np.linspace(0, size - 1, min(size, KEPT_AN_AXIS))).astype(np.int64)
    return np.stack(np.meshgrid(*[np.unique(spread)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


def choose_nodes(spectrum: Spectrum, count: int, name: str) -> list[NDArray[np.int64]]:
    """`count` nodes (i, j) of a spectrum: those near the boundary, and those away from it.

    Half of them are near it, where there are enough. The choice is random but depends only on
    `name`. Nodes that the reference could not decide are left out.
    """
    near = vary(spectrum.outcomes, 2 * NEAR + 1)
    random = np.random.default_rng(zlib.crc32(name.encode()))
    decided = tiles.letters_of(spectrum.outcomes, spectrum.undecided) != tiles.UNDECIDED
    inside, outside = np.argwhere(near & decided), np.argwhere(~near & decided)
    wanted = max(min(count // 2, len(inside)), min(count - len(outside), len(inside)))
    return [
        side[random.permutation(len(side))[:number]]
        for side, number in ((inside, wanted), (outside, count - wanted))
    ]


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
    requests = {one.model: one for one in (request, *others)}
    shares = [
        list(_shares(book, panel, one, [other for other in others if plays(other, panel)], count))
        for panel, one in spectra.items()
    ]
    coarse = {
        model: replace(one, size=min(MAP_SIZE, one.size), refine=False)
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
        f" otherwise at least {CALM:g} s later. A block that then stands counts as safe."
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
    book: tiles.Book, panel: Panel, spectrum: Spectrum, others: Sequence[tiles.Request], count: int
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
        outcomes, failed = book.outcomes(
            one.nodes(panel.scene, one.amplitudes[i], one.frequencies[j])
        )
        ends = [len(chosen[0][: halves[0]])]
        mine, fine = np.split(outcomes, ends), np.split(~failed, ends)
        # Nothing is equal to what a reference could not finish.
        sides.setdefault(one.model, np.split(np.where(failed, np.nan, outcomes), ends))
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
    book: tiles.Book, panels: Sequence[Panel], requests: Mapping[str, tiles.Request]
) -> Iterator[dict[str, Any]]:
    chosen = mapped(panels)
    drawn = {
        model: [book.spectrum(panel, one) for panel in chosen] for model, one in requests.items()
    }
    if book.wanted:
        return
    letters = {
        model: np.array([tiles.letters_of(one.outcomes, one.undecided) for one in some if one])
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


def agreement_blocks(found: Agreement, panels: Sequence[Panel], came: bool) -> Iterator[Block]:
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
    yield _table_of_shares("agreement", found["shares"], [model])
    yield _table_of_shares(
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
                "record": panels[0].scene.excitation.kind == "record",
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


def _table_of_shares(name: str, shares: Sequence[Any], by: Sequence[Column], **more: Any) -> Table:
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
