"""Overturning spectra as the paper shows them, and the page with all that was found out about them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rockcheck.ebm.spectrum import Spectrum
from rockcheck.reports.show.spectrum import COLOURS, LAW_MARK, axis_labels, draw
from rockcheck.reports.site import PAGES, STUDIES, Site
from rockcheck.reports.studies.nodes import write_nodes
from rockcheck.reports.style import FORMATS, LOOKS, PAGE, figure_style, keep_drawn
from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.reading import read_json, within
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.spectra.findings import Finding, findings
from rockcheck.validation.spectra.histories import KEPT_AN_AXIS, glimpses_path
from rockcheck.validation.spectra.study import SpectrumRecord, paper_panels, read_spectrum
from rockcheck.validation.suite.results import RUN_FILE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rockcheck.validation.spectra.agreement import Agreement
    from rockcheck.validation.spectra.study import Panel

TITLES = {
    6: "Wall on the left, μ = 0.3",
    7: "Wall on the left, μ = 0.6",
    8: "Wall on the right, μ = 0.3",
    9: "Wall on the right, μ = 0.6",
}
PAGE_NAME = "spectra.html"
#: The names of the files of the figures of all models' maps, of all safe areas, and of what the paper does not say.
MAPS, AREAS, FINDINGS = "models", "safe-areas", "findings"
#: In its maps: overturned, safe, gained, lost.
FOUND = ["#e9e9e9", "#a9c1df", "#009168", "#c4342d"]
PAPER_SCENE = paper_panels(6)[0].scene


def paper_figure(panels: Sequence[Panel], spectra: Sequence[Spectrum], *, of: str = "") -> Figure:
    """One of the paper's Figs. 6 to 9: the unobstructed spectrum beside those with a wall, a column a gap, a row an e.

    `of` names the model where it is not the paper's.
    """
    from matplotlib.figure import Figure

    gaps = sorted({panel.wall.gap for panel in panels if panel.wall})
    restitutions = sorted({panel.wall.restitution for panel in panels if panel.wall})
    with figure_style():
        figure = Figure(figsize=(PAGE, 4.0), layout="constrained")
        grid = figure.add_gridspec(2 * len(restitutions), 1 + len(gaps))
        for panel, spectrum in zip(panels, spectra, strict=True):
            if panel.wall is None:
                axes = figure.add_subplot(grid[1:3, 0])
                _panel(axes, spectrum, panel.title)
            else:
                row, column = restitutions.index(panel.wall.restitution), gaps.index(panel.wall.gap)
                axes = figure.add_subplot(grid[2 * row : 2 * row + 2, 1 + column])
                _panel(axes, spectrum, panel.title)
                if row + 1 < len(restitutions):
                    axes.set_xlabel("")
                    axes.tick_params(labelbottom=False)
                if column:
                    axes.set_ylabel("")
                    axes.tick_params(labelleft=False)
        number = panels[0].figure or 0
        figure.suptitle(f"Fig. {number}: {TITLES[number]}{f' ({of})' if of else ''}", fontsize=9, x=0.01, ha="left")
        _legend(figure, spectra)
    return figure


def own_figure(panel: Panel, spectrum: Spectrum) -> Figure:
    """The user's own spectrum."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE / 1.6, 3.6), layout="constrained")
        axes = figure.subplots()
        _panel(axes, spectrum, panel.title)
        _units(axes, spectrum.scene)
        _legend(figure, [spectrum])
    return figure


def _units(axes: Any, scene: Scene) -> None:
    """The pulses of the axes in Hz and g, too."""
    if scene.excitation.kind == "record":
        return
    hertz = scene.frequency_parameter / (2.0 * np.pi)
    pga_g = scene.gravity * scene.block.slope / GRAVITY_OF_RECORDS
    axes.secondary_xaxis("top", functions=(lambda x: x * hertz, lambda x: x / hertz)).set_xlabel("frequency of the pulse, Hz")
    axes.secondary_yaxis("right", functions=(lambda y: y * pga_g, lambda y: y / pga_g)).set_ylabel("peak acceleration, g")


def _panel(axes: Any, spectrum: Spectrum, title: str) -> None:
    draw(spectrum, axes)
    axes.set_title(title, fontsize=7.5)
    axes.set_xlim(spectrum.frequency_ratios[[0, -1]])
    axes.set_ylim(spectrum.amplitude_ratios[[0, -1]])
    for spine in ("top", "right"):
        axes.spines[spine].set_visible(True)
    if spectrum.scene.excitation.kind != "record" and spectrum.frequency_ratios[-1] <= 12:
        axes.set_xticks(np.arange(np.ceil(spectrum.frequency_ratios[0]), spectrum.frequency_ratios[-1] + 1e-9))
        axes.yaxis.get_major_locator().set_params(integer=True)


def _legend(figure: Figure, spectra: Iterable[Spectrum]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    spectra = list(spectra)
    free, walled = (any(bool(spectrum.scene.walls) == wall for spectrum in spectra) for wall in (False, True))
    labels = {"safe": "safe"}
    if free:
        labels |= {"clockwise": "overturned clockwise", "counterclockwise": "overturned counterclockwise"}
    if free and walled:
        labels |= {"clockwise": "no wall: overturned clockwise", "counterclockwise": "overturned; no wall: counterclockwise"}
    elif walled:
        labels["overturned"] = "overturned"
    if any(len(spectrum.undecided) for spectrum in spectra):
        labels["undecided"] = "undecided"
    handles: list[Patch | Line2D] = [Patch(facecolor=COLOURS[name], label=label) for name, label in labels.items()]
    if any(spectrum.depends_on_law is not None and len(spectrum.depends_on_law) for spectrum in spectra):
        handles.append(Line2D([], [], label="depends on the impact law", **LAW_MARK))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7, handlelength=1.6)


def maps_figure(found: Agreement, panels: Sequence[Panel]) -> Figure:
    """The figure's spectra by every model, a row each, in the paper's colours."""
    from matplotlib.figure import Figure

    from rockcheck.validation.spectra.agreement import map_spectra

    with figure_style():
        figure = Figure(figsize=(PAGE, 0.4 + 0.92 * len(found.maps)), layout="constrained")
        grid = figure.subplots(len(found.maps), len(panels), sharex=True, sharey=True, squeeze=False)
        for axes, panel in zip(grid[0], panels, strict=True):
            axes.set_title(panel.title.replace(", ", "\n"), fontsize=6.5)
            axes.locator_params(integer=True)
        for row, one in zip(grid, found.maps, strict=True):
            for axes, spectrum in zip(row, map_spectra(found, one, panels), strict=True):
                draw(spectrum, axes)
                axes.set(xlabel="", ylabel="")
            row[0].set_ylabel(LOOKS[one.model].label.replace(", ", ",\n"))
        horizontal, vertical = axis_labels(panels[0].scene)
        figure.supxlabel(horizontal, fontsize=7.5)
        figure.supylabel(vertical, fontsize=7.5)
    return figure


def areas_figure(spectra: Sequence[Spectrum]) -> Figure:
    """The safe areas of the 28 spectra against the gap, with those without a wall: what the claims about areas rest on."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE, 2.6), layout="constrained")
        for axes, side in zip(figure.subplots(1, 2, sharey=True), ("left", "right"), strict=True):
            for friction, colour in ((0.3, "#0072b2"), (0.6, "#d55e00")):
                for e, line, marker in ((0.0, "-", "o"), (1.0, "--", "s")):
                    walls = sorted(
                        (s.scene.walls[0].gap, s.safe_area)
                        for s in spectra
                        if s.scene.walls
                        and (s.scene.walls[0].side, s.scene.floor.friction, s.scene.walls[0].restitution) == (side, friction, e)
                    )
                    gaps, areas = zip(*walls, strict=True)
                    axes.plot(
                        1000.0 * np.array(gaps),
                        100.0 * np.array(areas),
                        line,
                        color=colour,
                        marker=marker,
                        label=f"μ {friction:g}, e {e:g}",
                    )
                free = next(s.safe_area for s in spectra if not s.scene.walls and s.scene.floor.friction == friction)
                axes.axhline(100.0 * free, color=colour, linestyle=":", label=f"μ {friction:g}, no wall")
            axes.set_title(f"Wall on the {side}")
            axes.set_xlabel("gap, mm")
            axes.set_xticks([3, 53, 103])
        figure.axes[0].set_ylim(0.0, 105.0 * max(spectrum.safe_area for spectrum in spectra))
        figure.axes[0].set_ylabel("safe nodes, %")
        figure.axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def findings_figure(found: Sequence[Finding]) -> Figure:
    """What the paper does not say: a map a finding, with the nodes that it rests on."""
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    with figure_style():
        figure = Figure(figsize=(PAGE, 3.0), layout="constrained")
        for axes, one in zip(figure.subplots(1, len(found), sharey=True), found, strict=True):
            shown = np.where(one.safe, 1, 0)
            shown[one.gained], shown[one.lost] = 2, 3
            axes.pcolormesh(
                one.frequencies, one.amplitudes, shown, cmap=ListedColormap(FOUND), vmin=0, vmax=3, shading="nearest", rasterized=True
            )
            axes.set_title(one.case, fontsize=7.0)
            axes.set_xlabel(axis_labels(PAPER_SCENE)[0])
            axes.grid(False)
            marked = [(1, "safe"), (2, one.gained_means), *([(3, one.lost_means)] if one.lost_means else [])]
            handles = [Patch(facecolor=FOUND[code], label=label) for code, label in marked]
            axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2), fontsize=6.5, handlelength=1.2)
        figure.axes[0].set_ylabel(axis_labels(PAPER_SCENE)[1])
    return figure


def _shown(panels: Sequence[Panel], spectra: Sequence[Spectrum]) -> list[object]:
    """All that a figure shows of spectra, as JSON can hold it."""
    return [
        [
            panel.name,
            panel.title,
            spectrum.scene.model_dump(mode="json"),
            *(None if array is None else sha256(array.tobytes()).hexdigest() for array in _arrays(spectrum)),
        ]
        for panel, spectrum in zip(panels, spectra, strict=True)
    ]


def _arrays(spectrum: Spectrum) -> tuple[np.ndarray | None, ...]:
    return (spectrum.outcomes, spectrum.frequency_ratios, spectrum.amplitude_ratios, spectrum.undecided, spectrum.depends_on_law)


def draw_figures(panels: Sequence[Panel], spectra: Sequence[Spectrum], model: str, folder: Path, formats: Sequence[str] = ("svg",)) -> None:
    """Draw the paper's figures, or the user's own spectra, into `folder`, where they would show something else."""
    from rockcheck.validation.spectra.study import stem

    for number in dict.fromkeys(panel.figure for panel in panels):
        mine = [(panel, spectrum) for panel, spectrum in zip(panels, spectra, strict=True) if panel.figure == number]
        if number is None:
            for panel, spectrum in mine:
                place = folder / stem(panel.name, model)
                keep_drawn(place, _shown([panel], [spectrum]), partial(own_figure, panel, spectrum), formats)
        else:
            own, found = [panel for panel, _ in mine], [spectrum for _, spectrum in mine]
            of = "" if model == "ebm" else model
            shown = [of, _shown(own, found)]
            keep_drawn(folder / figure_stem(number, model), shown, partial(paper_figure, own, found, of=of), formats)


def draw_areas(panels: Sequence[Panel], spectra: Sequence[Spectrum], folder: Path, formats: Sequence[str] = ("svg",)) -> None:
    """Draw the safe areas of the paper's spectra into `folder`, where they would show something else."""
    areas = [[panel.name, spectrum.safe_area] for panel, spectrum in zip(panels, spectra, strict=True)]
    keep_drawn(folder / AREAS, areas, partial(areas_figure, spectra), formats)


def draw_maps(found: Agreement, panels: Sequence[Panel], folder: Path, formats: Sequence[str] = ("svg",)) -> None:
    """Draw the maps of all models into `folder`, where they would show something else."""
    keep_drawn(folder / MAPS, maps_shown(found, panels), partial(maps_figure, found, panels), formats)


def maps_shown(found: Agreement, panels: Sequence[Panel]) -> list[object]:
    """All that the figure of maps shows, as JSON can hold it."""
    return [found.model_dump(mode="json", include={"maps", "map_frequencies", "map_amplitudes"}), [panel.name for panel in panels]]


def write_page(folder: Path) -> Path:
    """Write `spectra.html` into the report's folder from what its `spectra/` holds; returns the page.

    Beside the paper's figures stand the long studies, agreement of models and refinement, as they were last computed here, or
    else as they came with the package.
    """
    from rockcheck.validation.execute import provenance
    from rockcheck.validation.spectra.study import SPECTRA, read_index

    data = folder / SPECTRA
    index = read_index(data)
    figures = sorted({(record.figure, record.model) for record in index.spectra if record.figure}, key=lambda key: (key[0] or 0, key[1]))
    shown: list[dict[str, Any]] = [
        {
            "name": figure_stem(number, model),
            "stem": f"{SPECTRA}/{figure_stem(number, model)}",
            "file": figure_stem(number, model),
            "number": number,
            "model": model,
            "title": TITLES[number or 6],
            "records": sorted((one for one in index.spectra if (one.figure, one.model) == (number, model)), key=_place),
        }
        for number, model in figures
        if (data / f"{figure_stem(number, model)}.svg").exists()
    ]
    own: list[dict[str, Any]] = [{"record": record} for record in index.spectra if record.figure is None]
    for figure in shown:
        figure["nodes"] = write_nodes(data, figure["file"], figure["records"])
    for one in own:
        one["nodes"] = write_nodes(data, one["record"].name, [one["record"]])
    scripts = [f"{figure['file']}.nodes.js" for figure in shown if figure["nodes"]]
    scripts += [f"{one['record'].name}.nodes.js" for one in own if one["nodes"]]
    site = Site(folder, "rockcheck: overturning spectra", _links(folder))
    site.assets()
    addresses = [PAGE_NAME] if (folder / RUN_FILE).exists() else ["index.html", PAGE_NAME]  # a folder has a page to open
    studies = _studies(data, bool(figures))
    pages = [
        site.page(
            address,
            "spectra.html",
            figures=shown,
            own=own,
            free=any(not record.scene.get("walls") for record in index.spectra),
            walled=any(record.scene.get("walls") for record in index.spectra),
            scripts=scripts,
            played=KEPT_AN_AXIS**2 if any(glimpses_path(data, record.name).exists() for record in index.spectra) else 0,
            claims=_read(data / "claims.json"),
            **studies,
            findings=_findings(data, index.spectra),
            areas=(data / "safe-areas.svg").exists(),
            versions=provenance.versions(),
            formats=partial(_formats, data),
        )
        for address in addresses
    ]
    return pages[-1]


def _place(record: SpectrumRecord) -> tuple[tuple[float, float], ...]:
    """Where a spectrum stands in its figure: without a wall first, then by gap and restitution."""
    return tuple((wall["gap"], wall["restitution"]) for wall in record.scene.get("walls", ()))


def _findings(data: Path, records: Sequence[SpectrumRecord]) -> tuple[Finding, ...]:
    """What the 28 spectra of the folder show, and its figure; empty where they are not all there, on one grid."""
    mine = {record.name: record for record in records if record.model == "ebm"}
    panels = [panel for number in TITLES for panel in paper_panels(number)]
    if not all(panel.name in mine and (data / f"{panel.name}.npz").exists() for panel in panels):
        return ()
    spectra = [read_spectrum(data, mine[panel.name], panel.scene) for panel in panels]
    if len({spectrum.outcomes.shape for spectrum in spectra}) > 1:
        return ()
    found = findings(spectra)
    shown = [
        [one.name, one.words, one.case, *(sha256(mask.tobytes()).hexdigest() for mask in (one.gained, one.lost, one.safe))] for one in found
    ]
    keep_drawn(data / FINDINGS, shown, partial(findings_figure, found))
    return found


def _studies(data: Path, papers: bool) -> dict[str, Any]:
    """Agreement and refinement for the page: those in the folder, or with the `papers` figures those that came with the package."""
    from rockcheck.validation.spectra import agreement as agreements
    from rockcheck.validation.spectra import refinement
    from rockcheck.validation.spectra.study import KEPT

    context: dict[str, Any] = {"maps": (data / f"{MAPS}.svg").exists()}
    context |= {"agreement_columns": agreements.COLUMNS, "refinement_columns": refinement.COLUMNS}
    for name, kind in (("agreement", agreements.Agreement), ("refinement", refinement.Refinement)):
        found = _stored(data, name, kind)
        context[f"{name}_kept"] = found is None
        context[name] = found or (_stored(KEPT, name, kind) if papers else None)
    if context["agreement"] and context["agreement_kept"]:  # its figure came with it
        for other in ("png", "pdf"):
            (data / f"{MAPS}.{other}").unlink(missing_ok=True)
        write_whole(data / f"{MAPS}.svg", (KEPT / f"{MAPS}.svg").read_bytes())
        context["maps"] = True
    return context


def _stored(folder: Path, name: str, kind: type[Stored]) -> Any:
    try:
        return kind.model_validate(read_json(within(folder, f"{name}.json")))
    except ValueError:
        return None


def _formats(data: Path, name: str) -> list[str]:
    """The formats in which a figure is there."""
    return [kind for kind in FORMATS if (data / f"{name}.{kind}").exists()]


def figure_stem(number: int | None, model: str) -> str:
    """The name of a figure's files."""
    return f"figure-{number}" if model == "ebm" else f"figure-{number}--{model}"


def _links(folder: Path) -> tuple[tuple[str, str], ...]:
    """The navigation: the scenes of the finished run that shares the folder, if any, and the studies beside it."""
    scenes = sorted((folder / PAGES).glob("*.html")) if (folder / RUN_FILE).exists() else []
    studies = [(title, address) for title, address in STUDIES if address == PAGE_NAME or (folder / address).exists()]
    return (*((page.stem, f"{PAGES}/{page.name}") for page in scenes), *studies)


def _read(path: Path) -> Any:
    try:
        return read_json(within(path.parent, path.name))
    except InputError:
        return None
