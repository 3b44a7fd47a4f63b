"""`rockcheck validate`: the main job; `accept`: its figures become the expected ones.

And `rockcheck report`: a finished run rendered again, or one of its figures for a paper.
"""

import os
import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from rockcheck.commands.checks import check_file, usable_folder
from rockcheck.commands.console import console, tell_wrong
from rockcheck.commands.ending import finish_command
from rockcheck.commands.model_choice import ALL, chosen_models
from rockcheck.commands.notices import tell_left_out, tell_missing, tell_record_notes
from rockcheck.commands.options import AllowCodeOption, Played, completing, model_names
from rockcheck.commands.progress_bar import progress
from rockcheck.commands.record import ReadOption, record_sets
from rockcheck.scenes import InputError, files, printable
from rockcheck.validation.execute import models
from rockcheck.validation.finding import Finding, Text
from rockcheck.validation.suite import (
    accepting,
    reasons,
    results,
    run_summary,
    run_tables,
    runner,
    suites,
    trend,
)
from rockcheck.validation.suite.cells import Suite


@dataclass(frozen=True)
class OfScene:
    """Options for a scene; a suite says itself which models play which scene."""

    models: Annotated[
        str,
        typer.Option(
            "--models",
            help="Of a scene: all that are installed, or names with commas between.",
            autocompletion=model_names,
        ),
    ] = ALL
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Of a scene: a model's setting, such as mujoco.time_step=1e-3; repeatable.",
        ),
    ] = None
    records: Annotated[
        list[str] | None,
        typer.Option(
            "--records",
            help="Of a scene: files, folders or patterns, each played in place of its excitation;"
            " repeatable.",
        ),
    ] = None
    read: ReadOption = None


FiguresOption = Annotated[
    bool,
    typer.Option(
        "--figures",
        help="Also write the figures for print as PDF and PNG, and one for each reference.",
    ),
]


@dataclass(frozen=True)
class Pages:
    """What is drawn of a run."""

    report: Annotated[
        bool,
        typer.Option(
            "--report/--no-report", help="Render the pages; without them only run.json and tables."
        ),
    ] = True
    figures: FiguresOption = False


#: The argument of both commands.
_named = partial(
    typer.Argument,
    help="Named, or a .toml file (default: suite paper).",
    show_default=False,
    autocompletion=completing(suites.named_suites),
)


def run(
    what: Annotated[str, _named(metavar="[SUITE or SCENE]")] = "",
    of_scene: OfScene = OfScene(),
    played: Played = Played(),
    force: Annotated[
        bool,
        typer.Option("--force", help="Run every cell, also those whose results are up to date."),
    ] = False,
    strict: Annotated[
        Literal["worse", "both"] | None,
        typer.Option(
            "--strict",
            help="worse: figures that left their drift band for the worse fail; both: better ones,"
            " too.",
        ),
    ] = None,
    allow_code: AllowCodeOption = None,
    history: Annotated[
        Path | None,
        typer.Option(
            "--history",
            metavar="FILE",
            help="Append this run to FILE (a JSON line a run), and show the trend.",
        ),
    ] = None,
    pages: Pages = Pages(),
) -> None:
    """Run a suite, compare, judge, write the report.

    Every model on every scene; cells whose results are up to date are read back. A scene in place
    of a suite is played by all models, perhaps under records, and nothing is judged. --read also
    takes scale=1.2 and vertical=true for its records.

    Exit 0: within tolerance. 1: out of tolerance. 2: bad input. 3: a model failed. 70: a fault of
    rockcheck itself.
    """
    if what:
        suites.check_source(what)
    if suites.is_scene(what):
        _refuse_judging(what, {"--strict": strict, "--history": history})
        suite = _scene(what, of_scene, allow_code or ())
    else:
        if history is not None:
            check_file(history, "--history", trend.read_runs)
        suite = _suite(what, of_scene, allow_code or ())
    folder = _folder_of(suite, played.out)
    from rockcheck.reports import site, terminal

    finished = play(
        suite,
        folder,
        played,
        force=force,
        strict="both" if strict == "both" else strict is not None,
    )
    page = folder / site.INDEX
    shown_already = _is_shown(finished, folder, pages, history)
    if not shown_already:
        page = site.keep(finished, folder, pages=pages.report)
    terminal.show(run_tables.finding_of(finished), console())
    if finished.exit_code:
        better = reasons.improvements(finished) if strict == "both" else ()
        tell_wrong([*reasons.verdict_lines(finished), *better])
    tell_faults(finished, folder)
    if history is not None:
        _show_trend(finished, suite, history, folder, published=pages.report)
    if pages.report and not shown_already:
        with progress("pages") as on_progress:
            page = site.write_site(
                folder,
                jobs=played.jobs or os.cpu_count() or 1,
                all_figures=pages.figures,
                on_progress=on_progress,
            )
    left_out = {} if suite.judged else {"left_out": suite.left_out}
    finish_command(
        Finding("validate", suite.name, "", exit_code=finished.exit_code),
        said=[("report", page)],
        value={**run_summary.summary(finished), **left_out, "report": page},
    )


def _refuse_judging(scene_name: str, options: Mapping[str, object]) -> None:
    """Raise `InputError` for an option that judges, of a scene."""
    for option, value in options.items():
        if value is not None:
            raise InputError(
                f"{printable(scene_name)} is a scene, and nothing of it is judged: give a suite",
                option,
            )


def _is_shown(finished: results.Run, folder: Path, pages: Pages, history: Path | None) -> bool:
    """Whether pages are asked for, and those in `folder` show the run already."""
    from rockcheck.reports import site

    if not pages.report:
        return False
    if history is not None:  # the trend's page is new, and the others lead to it
        return False
    return site.is_up_to_date(finished, folder, all_figures=pages.figures)


def _show_trend(
    finished: results.Run, suite: Suite, history: Path, folder: Path, *, published: bool
) -> None:
    """Add a run to a history of runs, and show the trend; as a page where it is `published`."""
    from rockcheck.reports import document, terminal

    this_run = trend.summary_of_run(finished, suite.path.parent)
    finding = trend.trend_of(trend.append_run(history, this_run))
    terminal.show(finding, console())
    if published:
        page = document.publish(finding, usable_folder(folder, "trend"), of_run=True)
        console().print(f"trend: {page}", soft_wrap=True)


def _suite(name: str, of_scene: OfScene, allow_code: Sequence[str]) -> Suite:
    for option, value in vars(of_scene).items():
        if value and value != ALL:
            raise InputError("is for a scene: a suite says which models play what", f"--{option}")
    suite = suites.load_suite(name or "paper", allow_code=allow_code)
    tell_left_out(suite.left_out)
    return suite


def _scene(name: str, of_scene: OfScene, allow_code: Sequence[str]) -> Suite:
    sets = record_sets(of_scene.records or (), of_scene.read or ())
    chosen = chosen_models(of_scene.models, of_scene.set or ())
    configured = {setting.partition(".")[0] for setting in of_scene.set or ()}
    unnamed = chosen.keys() - configured if of_scene.models == ALL else ()
    if of_scene.models == ALL:
        tell_missing()
    suite = suites.scene_suite(
        name,
        _playable(name, chosen, unnamed),
        records=sets,
        allow_code=allow_code,
        unnamed=unnamed,
    )
    tell_left_out(
        suite.left_out,
        "--read vertical=true plays such a component together with the horizontal ones",
    )
    tell_record_notes(suite.scenes.values())
    return suite


def _playable(
    scene_name: str, chosen: Mapping[str, dict[str, Any]], unnamed: Collection[str]
) -> dict[str, dict[str, Any]]:
    """The chosen models without those that nobody named and that cannot play the scene.

    Prints a line for each that is left out. Raises `InputError` where none can play it.
    """
    scene = files.load_uncertain_scene(scene_name).scene
    reasons = {
        name: models.unplayable(name, chosen[name], scene) for name in chosen if name in unnamed
    }
    playable = {name: settings for name, settings in chosen.items() if not reasons.get(name)}
    if not playable:
        reason = next(iter(reasons.values()))
        raise InputError(f"{printable(scene_name)}: no model can play it: {reason}")
    for name, reason in reasons.items():
        if reason:
            console().print(
                f"left out: {name} cannot play this scene: {reason}", style="yellow", soft_wrap=True
            )
    return playable


def _folder_of(suite: Suite, out: Path) -> Path:
    """The folder of a run; another suite's run there is replaced, and a line says so."""
    folder = usable_folder(out)
    before: results.Run | None = None
    with suppress(InputError):  # no run there, or none that can be read
        before = results.Run.load(folder)
    if before is not None and before.suite != suite.name:
        console().print(
            f"note: this replaces the report of {printable(before.suite)} in {printable(folder)};"
            " --out keeps both",
            soft_wrap=True,
        )
    return folder


def play(suite: Suite, folder: Path, played: Played, **how: Any) -> results.Run:
    """Run a suite with a progress bar on stderr."""
    models = ((one.family, one.settings) for one in suite.models.values())
    with progress(suite.name, models) as on_progress:
        return runner.run_suite(
            suite,
            folder,
            jobs=played.jobs,
            scheduler=played.scheduler,
            on_progress=on_progress,
            **how,
        )


def tell_faults(finished: results.Run, folder: Path) -> None:
    """Print a line on stderr for each exception that no model may raise.

    One of rockcheck's own models is to be reported, one of the user's own models to be mended.
    """
    for cell in finished.cells:
        if cell.traceback:
            where, path = f"{cell.scene}, {cell.model}: {cell.reason}", folder / cell.traceback
            said = (
                f"a fault of rockcheck itself, {where}: please report it with {path}"
                if cell.unexpected
                else f"{where}: traceback in {path}"
            )
            print(printable(f"rockcheck: {said}", 1400), file=sys.stderr)


def accept(
    suite: Annotated[str, _named(metavar="[SUITE]")] = "",
    reason: Annotated[
        str | None,
        typer.Option(
            "--reason",
            help="Why limits are loosened or figures moved; it is written into the file.",
        ),
    ] = None,
    played: Played = Played(),
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the changes, write none.")
    ] = False,
    allow_code: AllowCodeOption = None,
) -> None:
    """Make today's figures the expected ones.

    They are written into the suite's tolerances, each change is shown: new, tightened, loosened or
    moved, the last two only with --reason.
    """
    loaded = _suite(suite, OfScene(), allow_code or ())
    folder = _folder_of(loaded, played.out)
    finished = play(loaded, folder, played)
    changes, refused = accepting.accept(loaded, finished, reason, write=not dry_run)
    tell_faults(finished, folder)
    finish_command(
        Finding(
            "accept",
            loaded.name,
            f"{len(changes)} changes {'would be written to' if dry_run else 'in'}"
            f" {finished.tolerances_file}",
            [
                Text(items=changes),
                Text(items=[f"not accepted: {line}" for line in refused], verdict="fail"),
            ],
            data={
                "changes": changes,
                "refused": refused,
                "file": finished.tolerances_file,
                "written": not dry_run,
            },
            exit_code=finished.exit_code if finished.verdict == "error" else int(bool(refused)),
        )
    )


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")],
    scene: Annotated[
        list[str] | None,
        typer.Option(
            "--scene",
            metavar="NAME",
            help="A scene that gets a page, too (repeatable), or what -o draws: a scene, an"
            " ensemble, or a figure of a study.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Draw that alone, and stop: .svg, .png or .pdf."),
    ] = None,
    all_figures: FiguresOption = False,
) -> None:
    """Render the pages of a finished run again.

    A run of more than 200 scenes has pages of 200: those that are not within tolerance, then the
    nearest to a limit. With --scene NAME -o FILE.pdf: that figure alone, all models over time with
    their differences and tolerances; of a study's folder the figure of that name.
    """
    from rockcheck.reports import document, site

    if output is not None:
        suites_own = (folder / results.SCHEMA_FILE).is_file()
        part = site if suites_own or not (folder / document.FIGURES).is_dir() else document
        if scene is None or len(scene) != 1:
            raise InputError("needs one --scene NAME", "--output")
        check_file(output, "--output")
        path = part.write_figure(folder, scene[0], output)
    else:
        results.Run.load(folder)
        with progress("pages") as on_progress:
            path = site.write_site(
                folder,
                jobs=os.cpu_count() or 1,
                wanted=scene or (),
                all_figures=all_figures,
                on_progress=on_progress,
            )
    what = "report" if output is None else "figure"
    finish_command(Finding(what, "", ""), said=[(what, path)], value={what: path})
