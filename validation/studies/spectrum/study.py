"""`rockcheck spectrum`: overturning spectra, the paper's and one's own, as a study.

In: panels (a scene each) and a grid. Out: a finding with figures, tables and files. Called by the
command. At some nodes of each spectrum the outcomes of the other models are compared with those of
the event-based ones; of one figure every model draws a coarse map.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel, Spectrum, horizon
from rockcheck.ebm.spectrum import SAFE
from rockcheck.scenes import reading
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Block, Finding
from rockcheck.validation.paper import (
    KEPT,
    Panel,
    paper_panels,
    sentences,
    spectra as paper_spectra,
    tables as paper_tables,
)
from rockcheck.validation.studies.spectrum import scene_node, tiles
from rockcheck.validation.studies.spectrum.agreement import Agreement, agree, mapped
from rockcheck.validation.studies.spectrum.agreement_blocks import agreement_blocks
from rockcheck.validation.studies.spectrum.spectrum_blocks import (
    kept_nodes,
    spectrum_blocks,
    stem_of,
)
from rockcheck.validation.studies.spectrum.spectrum_files import files_of
from rockcheck.validation.study import Study


@dataclass(frozen=True)
class PlayedSpectra:
    """What follows from the nodes that have been played.

    `spectra` and `motions` by panel; `paper` what the paper's sentences ask for, and `agreement`
    that of the other models, None where not asked for, or not played to the end.
    """

    spectra: Mapping[Panel, Spectrum]
    motions: Mapping[Panel, tiles.Played]
    paper: paper_spectra.Paper | None
    agreement: Agreement | None


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
        if check is None:
            return
        for panel in self.panels:
            check(panel.scene)

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[tiles.Nodes]:
        """The nodes that are still to be played."""
        book = tiles.Book(done)
        played = self._played(book)
        self._scene_node(book, list(played.spectra.values()))
        return book.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The complete spectra, and the findings from them."""
        played = self._played(tiles.Book(done))
        at_scene = self._scene_node(tiles.Book(done), list(played.spectra.values()))
        claims = list(sentences.claims_of(played.paper)) if played.paper else []
        blocks: list[Block] = [*spectrum_blocks(played.spectra, played.motions, self.request)]
        if played.paper:
            blocks += paper_tables.blocks(played.paper, claims)
        agreement, panels = played.agreement, list(played.spectra)
        if self._is_papers and not self.compared:
            agreement, panels = reading.read_json(KEPT / "agreement.json"), [*paper_panels()]
        if agreement:
            blocks += agreement_blocks(
                agreement, mapped(panels), came_with_package=not self.compared
            )
        files = {
            f"{stem_of(panel, self.request.model)}.{ending}": content
            for panel, spectrum in played.spectra.items()
            for ending, content in files_of(panel, spectrum, self.request).items()
        }
        has_failed = any(isinstance(record, pool.Failure) for record in done.values())
        return Finding(
            self.name,
            "Overturning spectra" if len(self.panels) > 1 else self.panels[0].title,
            self._answer(list(played.spectra.values()), at_scene, claims),
            blocks,
            data={
                "model": self.request.model,
                "settings": dict(self.request.settings),
                "agreement": agreement,
                "own": at_scene and asdict(at_scene),
            },
            files=files,
            exit_code=3 if has_failed else 0,
        )

    def _answer(
        self,
        spectra: Sequence[Spectrum],
        at_scene: scene_node.NodeAnswer | None,
        claims: Sequence[sentences.Claim],
    ) -> str:
        """The first sentence: of the paper's sentences, of the scene's own pulse, or of all."""
        if claims:
            tally = Counter(claim.verdict for claim in claims)
            return (
                f"Of {tally.total()} sentences of the paper {tally['holds']} hold,"
                f" {tally['holds in part']} hold in part, {tally['does not hold']} do not."
            )
        if at_scene is not None:
            return scene_node.answer(at_scene, self.panels[0].scene)
        nodes = sum(spectrum.outcomes.size for spectrum in spectra)
        if len(self.panels) == len(spectra) == 1:
            return f"{100.0 * spectra[0].safe_area:.2f} % of {nodes} nodes are safe."
        runs = sum(spectrum.evaluations for spectrum in spectra)
        return f"{len(spectra)} spectra: {nodes} nodes, {runs} runs."

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
    def _is_papers(self) -> bool:
        """Whether these are all spectra of the paper, by the paper's model."""
        names = {panel.name for panel in self.panels}
        papers = {panel.name for panel in paper_panels()}
        return self.request.model == "ebm" and names >= papers

    def _played(self, book: tiles.Book) -> PlayedSpectra:
        """All that follows from the nodes played; the book lists those still to be played."""
        spectra: dict[Panel, Spectrum] = {}
        for panel in self.panels:
            spectrum = self._spectrum(book, panel)
            if spectrum is not None:
                spectra[panel] = spectrum
        motions = {panel: self._motions(book, panel) for panel in self.panels}
        paper, agreement = None, None
        if len(spectra) == len(self.panels):
            if self._is_papers:
                paper = self._paper(book, list(spectra.values()))
            if self.compared:
                agreement = agree(book, spectra, self.request, self.compared)
        return PlayedSpectra(spectra, motions, paper, agreement)

    def _motions(self, book: tiles.Book, panel: Panel) -> tiles.Played:
        """The motions of some nodes, which the page plays; none of models that are slow."""
        if not tiles.compiled(models.build(self.request.model, self.request.settings)):
            return tiles.Played()
        i, j = kept_nodes(self.request.size).T
        amplitudes, frequencies = self.request.amplitudes[i], self.request.frequencies[j]
        return book.ask(self.request.nodes(panel.scene, amplitudes, frequencies, "motions"))[0]

    def _spectrum(self, book: tiles.Book, panel: Panel) -> Spectrum | None:
        """The spectrum and, as soon as they are known, its nodes that depend on the impact law."""
        request = self.request
        spectrum = book.spectrum(panel, request)
        laws = self._other_laws(panel)
        by_law: list[Spectrum] = []
        for law in laws:
            settings = {**request.settings, "impacts": law}
            by_other = book.spectrum(panel, replace(request, settings=settings))
            if by_other is not None:
                by_law.append(by_other)
        if spectrum is None or not by_law or len(by_law) < len(laws):
            return spectrum
        return replace(spectrum, depends_on_law=tiles.differing(spectrum, by_law))

    def _other_laws(self, panel: Panel) -> Sequence[str]:
        """The other laws of impacts that may give another outcome."""
        model = models.build(self.request.model, self.request.settings)
        if not isinstance(model, EventBasedModel):
            return ()
        has_walls = bool(panel.scene.walls)
        return horizon.other_laws(model, walls=has_walls, flat=horizon.may_fly(panel.scene))

    def _paper(self, book: tiles.Book, spectra: Sequence[Spectrum]) -> paper_spectra.Paper | None:
        """What the paper's sentences ask for; None where nodes are still to be played."""
        scanned = {
            paper_spectra.SCANNED_WALLS[spectrum.scene.name]: self._scan(book, spectrum)
            for spectrum in spectra
            if spectrum.scene.name in paper_spectra.SCANNED_WALLS
        }
        struck = [
            (spectrum, *paper_spectra.near_one_impact(spectrum))
            for spectrum in spectra
            if not spectrum.scene.walls
        ]
        records = [
            book.ask(
                self.request.nodes(
                    spectrum.scene,
                    self.request.amplitudes[i],
                    self.request.frequencies[j],
                    "one impact",
                )
            )
            for spectrum, i, j in struck
        ]
        if book.wanted:
            return None
        tongues = {}
        for (spectrum, i, j), tile_records in zip(struck, records, strict=True):
            letters = [letter for record in tile_records for letter in record.letters]
            has_one_impact = np.zeros(spectrum.outcomes.shape, dtype=bool)
            has_one_impact[i, j] = [letter == "Y" for letter in letters]
            tongues[spectrum.scene.floor.friction] = has_one_impact
        least = {
            wall: float(paper_spectra.SCANNED[sides != SAFE].min(initial=np.inf))
            for wall, sides in scanned.items()
        }
        return paper_spectra.Paper(spectra, least, tongues)

    def _scan(self, book: tiles.Book, spectrum: Spectrum) -> np.ndarray:
        """The outcomes along the amplitudes that the paper's sentences name."""
        frequencies = np.full(len(paper_spectra.SCANNED), paper_spectra.SCANNED_AT)
        nodes = self.request.nodes(spectrum.scene, paper_spectra.SCANNED, frequencies)
        sides, _ = book.outcomes(nodes)
        return sides
