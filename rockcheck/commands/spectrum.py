"""`rockcheck spectrum`: overturning spectra, the paper's or the user's own."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from rockcheck.commands import (
    OUT,
    JobsOption,
    SchedulerOption,
    answer,
    console,
    out_option,
    progress,
    scene_names,
    studied,
    tell_left_out,
    usable_folder,
)
from rockcheck.commands.record import ReadOption, RecordsArgument, reading_of
from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT
from rockcheck.scenes import InputError, load_scene
from rockcheck.scenes.errors import unknown_name
from rockcheck.scenes.progress import Count
from rockcheck.scenes.recordings.sets import files_of, motions_of
from rockcheck.scenes.threads import threads
from rockcheck.scenes.writing import table_text, write_whole
from rockcheck.validation.execute.store import name_of
from rockcheck.validation.spectra.study import (
    AMPLITUDES,
    FIGURES,
    FREQUENCIES,
    SPECTRA,
    Panel,
    SpectrumRequest,
    axis,
    other_settings,
    paper_panels,
    play_panels,
    save,
)
from rockcheck.validation.spectra.tiles import Tiles

if TYPE_CHECKING:
    from rockcheck.validation.spectra.agreement import Agreement
    from rockcheck.validation.spectra.refinement import Refinement

MOST_SIZE = 5000


def run(
    records: RecordsArgument = None,
    figure: Annotated[str | None, typer.Option("--figure", help="6, 7, 8, 9 or all: the paper's figures.")] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene", help="Your own block, walls, friction and pulse or record: a name or .toml file.", autocompletion=scene_names
        ),
    ] = None,
    size: Annotated[int, typer.Option("--size", help="Nodes an axis.")] = 100,
    frequencies: Annotated[
        tuple[float, float],
        typer.Option("--frequencies", help="Range of omega_p/p; with a record, of the block's size relative to its own."),
    ] = FREQUENCIES,
    amplitudes: Annotated[
        tuple[float, float], typer.Option("--amplitudes", help="Range of a_p/(g tan alpha); with a record, of its scale.")
    ] = AMPLITUDES,
    pivot: Annotated[
        str | None,
        typer.Option("--pivot", help="bilateral (default) or unilateral: the block may hop (default of a --scene with a wall)."),
    ] = None,
    model: Annotated[str | None, typer.Option("--model", help="Another model: cm, mujoco, pybullet (slow: mind --size).")] = None,
    tolerance: Annotated[float | None, typer.Option("--tolerance", help="Tolerance of the event-based model.")] = None,
    refine: Annotated[bool, typer.Option("--refine", help="Run only what lies near a boundary.")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Refine, run the full grid too, and count the nodes that differ.")] = False,
    agreement: Annotated[int | None, typer.Option("--agreement", help="Nodes a spectrum at which the other models are compared.")] = None,
    fragility: Annotated[
        bool, typer.Option("--fragility", help="Probability of overturning against intensity, with and without the wall.")
    ] = False,
    read: ReadOption = None,
    printed: Annotated[bool, typer.Option("--print", help="Write the figures as PDF and PNG, too.")] = False,
    out: Annotated[Path, out_option("spectra.html")] = OUT,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    force: Annotated[bool, typer.Option("--force", help="Run everything again, also what is up to date.")] = False,
) -> None:
    """Overturning spectra: the paper's, or your own.

    What is finished is kept, and read back next time.

    \b
    --figure all                                    the paper's figures and claims
    --figure all --agreement 200                    against the other models
    --scene shelf.toml --amplitudes 1 6 --refine    your own block and pulse
    --scene shelf.toml --fragility records/RSN1_H*.AT2
    """
    panels = _panels(figure, scene)
    if pivot is None:  # beside a wall a block hops, which the bilateral pivot of the paper's figures forbids
        pivot = "unilateral" if model is None and scene is not None and panels[0].scene.walls else "bilateral"
    request = _request(size, frequencies, amplitudes, pivot, model, tolerance, refine)
    if (records or read) and not fragility:
        raise InputError("need --fragility", "records")
    if fragility:
        how = {"out": out / "fragility", "jobs": jobs, "scheduler": scheduler, "force": force}
        _fragility(panels, request, records or (), read or (), **how)
    folder = usable_folder(out)
    data = usable_folder(folder, SPECTRA)
    formats = ("svg", "png", "pdf") if printed else ("svg",)
    screen = console()
    with contextlib.ExitStack() as stack:
        client = None
        if scheduler:
            from rockcheck.validation.execute.cluster import connected

            client = stack.enter_context(connected(scheduler))
        tiles = stack.enter_context(Tiles(data, jobs=jobs, client=client, force=force))
        if verify:
            _verify(panels, request, tiles, data, screen)
        elif agreement is not None:
            _agreement(panels, request, agreement, tiles, data, formats, screen)
        else:
            _spectra(panels, request, tiles, data, formats, screen)
    from rockcheck.reports.studies.spectra import write_page

    page = write_page(folder)
    screen.print(f"report: {page}", soft_wrap=True)
    answer({"report": page, "tables": sorted(data.glob("*.csv")), "data": sorted(data.glob("*.json"))})


def _panels(figure: str | None, scene: str | None) -> list[Panel]:
    if scene is not None and figure is not None:
        raise InputError("cannot be given together with --scene", "--figure")
    if scene is not None:
        what = load_scene(scene)
        return [Panel(name_of(what.name.replace(" ", "-")), what.name, what)]
    chosen = list(FIGURES) if figure in (None, "all") else [number for number in FIGURES if str(number) == figure]
    if not chosen:
        raise InputError(str(unknown_name("figure", str(figure), [*map(str, FIGURES), "all"])), "--figure")
    return [panel for number in chosen for panel in paper_panels(number)]


def _request(
    size: int,
    frequencies: tuple[float, float],
    amplitudes: tuple[float, float],
    pivot: str,
    model: str | None,
    tolerance: float | None,
    refine: bool,
) -> SpectrumRequest:
    if not 2 <= size <= MOST_SIZE:
        raise InputError(f"{size} is not allowed: give 2 to {MOST_SIZE} nodes an axis", "--size")
    if pivot not in ("bilateral", "unilateral"):
        raise InputError(str(unknown_name("pivot", pivot, ("bilateral", "unilateral"))), "--pivot")
    if model is not None and pivot != "bilateral":
        raise InputError("cannot be given together with --model", "--pivot")
    name = model or ("ebm" if pivot == "bilateral" else "ebm-unilateral")
    if tolerance is not None and not (name.startswith("ebm") and math.isfinite(tolerance)):
        raise InputError(f"{tolerance:g} is not allowed: a finite number, with an event-based model", "--tolerance")
    return SpectrumRequest(
        frequencies=axis(*frequencies, size, "--frequencies"),
        amplitudes=axis(*amplitudes, size, "--amplitudes"),
        model=name,
        settings={} if tolerance is None else {"tolerance": tolerance},
        refine=refine,
    )


def _spectra(panels: Sequence[Panel], request: SpectrumRequest, tiles: Tiles, data: Path, formats: Sequence[str], screen: Console) -> None:
    """Plays the spectra, and draws each figure while the next one is played."""
    papers = {panel.figure for panel in panels} == set(FIGURES) and request.model == "ebm"
    nodes = len(request.frequencies) * len(request.amplitudes)
    groups = [[panel for panel in panels if panel.figure == number] for number in dict.fromkeys(panel.figure for panel in panels)]
    if tiles.client is not None:  # a cluster gets all at once
        groups = [list(panels)]
    spectra: list[Spectrum] = []
    aside = 0.0  # s of CPU that figures took meanwhile
    drawn: list[Future[float]] = []
    with threads(1) as drawing:
        with progress("spectra") as on_progress:
            laws = sum(len(other_settings(panel, request)) for panel in panels)
            tiles.count = Count(on_progress, nodes * (len(panels) + laws))
            for group in groups:
                found = play_panels(group, request, tiles, all_laws=True)
                spectra += found
                aside = sum(one.result() for one in drawn if one.done())
                drawn.append(drawing.submit(_draw, group, found, request.model, data, formats))
        if papers:
            drawn.append(drawing.submit(_draw_areas, panels, spectra, data, formats))
        screen.print(_shares(panels, spectra))
        _speed(spectra, request, tiles, tiles.cpu - aside, screen)
        save(panels, spectra, request, data, jobs=tiles.jobs)
        if papers:
            _claims(spectra, request, tiles, data, screen)
        for one in drawn:
            one.result()


# matplotlib takes a second to import: the thread that draws does it. Returned is its CPU time, s.
def _draw(panels: Sequence[Panel], spectra: Sequence[Spectrum], model: str, data: Path, formats: Sequence[str]) -> float:
    began = time.thread_time()
    from rockcheck.reports.studies.spectra import draw_figures

    draw_figures(panels, spectra, model, data, formats)
    return time.thread_time() - began


def _draw_areas(panels: Sequence[Panel], spectra: Sequence[Spectrum], data: Path, formats: Sequence[str]) -> float:
    began = time.thread_time()
    from rockcheck.reports.studies.spectra import draw_areas

    draw_areas(panels, spectra, data, formats)
    return time.thread_time() - began


def _shares(panels: Sequence[Panel], spectra: Sequence[Spectrum]) -> Table:
    laws = any(spectrum.depends_on_law is not None for spectrum in spectra)
    table = Table(box=None, pad_edge=False)
    for title in ("spectrum", "safe", "left", "right", "undecided", *(["depends on the impact law"] if laws else [])):
        table.add_column(title, justify="left" if title == "spectrum" else "right")
    for panel, spectrum in zip(panels, spectra, strict=True):
        left, right = (float(np.mean(spectrum.outcomes == side)) for side in (LEFT, RIGHT))
        shares = (f"{100.0 * share:.2f} %" for share in (spectrum.safe_area, left, right))
        law = "-" if spectrum.depends_on_law is None else str(len(spectrum.depends_on_law))
        table.add_row(panel.name, *shares, str(len(spectrum.undecided)), *([law] if laws else []))
    return table


def _speed(spectra: Sequence[Spectrum], request: SpectrumRequest, tiles: Tiles, cpu: float, screen: Console) -> None:
    nodes, evaluations = sum(s.outcomes.size for s in spectra), sum(s.evaluations for s in spectra)
    share = f" ({nodes / evaluations:.1f} times fewer than nodes)" if request.refine else ""
    what = "spectrum" if len(spectra) == 1 else "spectra"
    screen.print(f"{len(spectra)} {what}, {nodes} nodes, {evaluations} runs{share}, {tiles.read_back} read back")
    if tiles.seconds:
        from rockcheck.validation.studies.work_precision.ebm import right_hand_side_seconds

        one, each = right_hand_side_seconds(), cpu / tiles.played
        screen.print(
            f"{tiles.played / tiles.seconds:,.0f} trajectories/s on {tiles.jobs or os.cpu_count()} threads, {tiles.seconds:.1f} s;"
            f" {cpu:.1f} s of CPU, {1e6 * each:.1f} us a trajectory,"
            f" {each / one:,.0f} times one right-hand-side evaluation ({1e9 * one:.1f} ns)",
            soft_wrap=True,
        )


def _claims(spectra: Sequence[Spectrum], request: SpectrumRequest, tiles: Tiles, data: Path, screen: Console) -> None:
    from rockcheck.validation.spectra.claims import Claims, check_claims, extra_runs

    tiles.count = Count()
    claims = check_claims(spectra, extra_runs(spectra, tiles, request))
    grid = f"{len(request.amplitudes)} x {len(request.frequencies)}"
    write_whole(data / "claims.json", Claims(grid=grid, model=request.model, claims=claims).model_dump_json(indent=1) + "\n")
    table = Table(box=None, pad_edge=False, title="The paper's section 5", title_justify="left")
    for title in ("sentence", "verdict", "finding"):
        table.add_column(title)
    for claim in claims:
        table.add_row(claim.sentence, claim.verdict, claim.finding)
    screen.print(table)


def _verify(panels: Sequence[Panel], request: SpectrumRequest, tiles: Tiles, data: Path, screen: Console) -> None:
    from rockcheck.validation.spectra.refinement import COLUMNS, verify

    nodes = len(request.frequencies) * len(request.amplitudes)
    with progress("refined and full") as on_progress:
        tiles.count = Count(on_progress, 2 * nodes * len(panels))
        found = verify(panels, request, tiles)
    _write_table("refinement", found, COLUMNS, data)
    screen.print(_table(COLUMNS, found.rows, words=1))


def _agreement(
    panels: Sequence[Panel], request: SpectrumRequest, count: int, tiles: Tiles, data: Path, formats: Sequence[str], screen: Console
) -> None:
    from rockcheck.reports.studies.spectra import draw_maps
    from rockcheck.validation.execute.models import not_installed
    from rockcheck.validation.spectra.agreement import CANDIDATES, COLUMNS, MAP_SIZE, agree, candidates, drawing, mapped, nodes_of

    if request.model != "ebm":
        raise InputError("cannot be given together with --model or --pivot: all models are compared", "--agreement")
    for model in CANDIDATES:
        if missing := not_installed(model):
            screen.print(f"{model} is left out: {missing}", markup=False, highlight=False)
    if not 2 <= count <= len(request.frequencies) * len(request.amplitudes):
        raise InputError(f"{count} is not allowed: give 2 up to the number of the spectrum's nodes", "--agreement")
    spectra = play_panels(panels, request, tiles)
    models = candidates()
    on_maps = MAP_SIZE**2 * len(mapped(panels)) * (1 + len(drawing(models)))
    with progress("agreement") as on_progress:
        tiles.count = Count(on_progress, sum(nodes_of(model, count) for model in models) * len(panels) + on_maps)
        found = agree(panels, spectra, request, count, tiles)
    _write_table("agreement", found, COLUMNS, data)
    draw_maps(found, mapped(panels), data, formats)
    screen.print(_table(COLUMNS[1:], [row[1:] for row in found.rows if row[0] == "all"], words=1))


def _write_table(name: str, found: Agreement | Refinement, columns: Sequence[str], data: Path) -> None:
    """Write what was found as JSON and its table as CSV."""
    write_whole(data / f"{name}.json", found.model_dump_json(indent=1) + "\n")
    write_whole(data / f"{name}.csv", table_text(columns, found.rows))


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, words: int) -> Table:
    """A table whose first `words` columns are words, the others numbers."""
    table = Table(box=None, pad_edge=False)
    for n, column in enumerate(columns):
        table.add_column(column, justify="right" if n >= words else "left", no_wrap=n < words)
    for row in rows:
        table.add_row(*row)
    return table


def _fragility(panels: Sequence[Panel], request: SpectrumRequest, records: Sequence[str], read: Sequence[str], **how: Any) -> NoReturn:
    """Plays and tells the fragility of one's own scene, in a folder of its own."""
    from rockcheck.validation.studies.population.study import fragility

    if len(panels) != 1:
        raise InputError("needs --scene", "--fragility")
    motions, left_out = motions_of(files_of(records), reading_of(read))
    tell_left_out(left_out)
    ends = float(request.frequencies[0]), float(request.frequencies[-1])
    study = fragility(
        panels[0].scene, motions, request.amplitudes, ends, model=request.model, settings=request.settings, left_out=left_out
    )
    studied(study, **how)
