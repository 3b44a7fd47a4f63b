"""`rockcheck spectrum`, `benchmark`, `stress` and `conformance`: the studies of models.

That of one scene is in `assess`.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, NoReturn, get_args

import typer

from rockcheck.commands.checks import check_file, usable_folder
from rockcheck.commands.ending import finish_command, played_study, run_study
from rockcheck.commands.model_choice import check_one_model, names_in, need_installed, settings_of
from rockcheck.commands.notices import tell_missing
from rockcheck.commands.options import (
    OUT,
    AllowCodeOption,
    JobsOption,
    OutOption,
    Played,
    completing,
    model_names,
)
from rockcheck.scenes import errors, files, printable
from rockcheck.validation import history_file
from rockcheck.validation.execute import models, store
from rockcheck.validation.finding import Finding, Text
from rockcheck.validation.paper import AMPLITUDES, FIGURES, FREQUENCIES, Panel, paper_panels

#: Nothing begins later than this; what was left out begins with the next run.
MINUTES = 25.0
PAPER = {"paper": tuple(FIGURES), **{f"fig{number}": (number,) for number in FIGURES}}


@dataclass(frozen=True)
class Grid:
    """The options of the nodes."""

    size: Annotated[int, typer.Option("--size", help="Nodes an axis.")] = 100
    frequencies: Annotated[
        tuple[float, float],
        typer.Option(
            "--frequencies",
            help="Range of omega_p/p; with a record, of the block's size relative to its own.",
        ),
    ] = FREQUENCIES
    amplitudes: Annotated[
        tuple[float, float],
        typer.Option(
            "--amplitudes", help="Range of a_p/(g tan alpha); with a record, of its scale."
        ),
    ] = AMPLITUDES
    refine: Annotated[
        bool, typer.Option("--refine", help="Run only what lies near a boundary.")
    ] = False


def spectrum(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[WHAT]",
            help="paper (all 28 spectra), fig6, fig7, fig8 or fig9; or your own block, walls,"
            " friction and pulse or record: a scene's name or a .toml file.",
            autocompletion=completing(lambda: [*PAPER, *files.named_scenes()]),
        ),
    ] = "paper",
    grid: Grid = Grid(),
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            help="Another model than ebm (ebm-unilateral, the block may hop, for your own scene"
            " with a wall); engines are slow: mind --size.",
            autocompletion=model_names,
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the model, such as tolerance=1e-10; repeatable."),
    ] = None,
    agreement: Annotated[
        int | None,
        typer.Option(
            "--agreement", help="Nodes a spectrum at which the other models are compared."
        ),
    ] = None,
    played: Played = Played(OUT / "spectrum"),
) -> None:
    """Overturning spectra: the paper's, or your own.

    What is finished is kept, and read back next time.

    \b
    rockcheck spectrum                                     the paper's figures and sentences
    rockcheck spectrum paper --agreement 200               against the other models
    rockcheck spectrum shelf.toml --amplitudes 1 6 --refine    your own block and pulse
    """
    from rockcheck.validation.studies.spectrum import scene_node, study, tiles

    if model is not None:
        check_one_model(model, "spectrum")
    if what in PAPER:
        panels = paper_panels(*PAPER[what])
    else:
        scene = files.load_scene(what)
        panels = (Panel(store.name_of(scene.name.replace(" ", "-")), scene.name, scene),)
    # Beside a wall a block hops, which the pivot of the paper's figures forbids.
    hops = what not in PAPER and panels[0].wall is not None
    given = settings_of(settings or ())
    name = model or ("ebm-unilateral" if hops and agreement is None else "ebm")
    through = None if what in PAPER else scene_node.ratios(panels[0].scene)
    request = tiles.Request(
        grid.size, grid.frequencies, grid.amplitudes, name, given, grid.refine, through
    )
    if agreement is not None:
        if name != "ebm":
            raise errors.InputError(
                "cannot be given together with --model: all are compared", "--agreement"
            )
        if not 2 <= agreement <= grid.size**2:
            raise errors.InputError(
                f"{agreement} is not allowed: give 2 up to the number of the spectrum's nodes",
                "--agreement",
            )
        tell_missing()
    run_study(study.Spectra(panels, request, agreement or 0), played)


def benchmark(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[WHAT]",
            help="all, ebm (batches), models (work and precision), skipping, convergence, or"
            " commands (what each command costs; not in all).",
        ),
    ] = "all",
    out: OutOption = OUT / "benchmark",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer scenes and settings.")] = False,
    jobs: JobsOption = None,
    history: Annotated[
        Path | None,
        typer.Option(
            "--history",
            help="Of commands: append their costs to FILE (a JSON line a run), and draw all.",
        ),
    ] = None,
) -> None:
    """Run time against error, for every model.

    Work and precision, compiled batches, what a scene does not need, and what engines converge to;
    or what each command costs a person who waits for it.
    """
    if what == "commands":
        _measure_commands(Played(out, jobs), quick, history)
    if history is not None:
        raise errors.InputError("is of commands: rockcheck benchmark commands", "--history")
    from rockcheck.validation.studies.work_precision.study import What, WorkPrecision

    part: What = errors.one_of("benchmark", what, (*get_args(What), "commands"))
    tell_missing()
    run_study(WorkPrecision(part, quick), Played(out, jobs), minutes=MINUTES)


def _measure_commands(played: Played, quick: bool, history: Path | None) -> NoReturn:
    """What each command costs, now and over the runs of a history."""
    from rockcheck.validation.studies.command_cost.study import CommandCost, CostsOfRun

    earlier: list[CostsOfRun] = []
    if history is not None:
        check_file(history, "--history", lambda path: None)
        earlier = history_file.read_history(history, CostsOfRun)
    finding = played_study(CommandCost(quick, earlier), played, force=True)
    if history is not None:
        history_file.append_history(history, CostsOfRun.model_validate(finding.data))
    finish_command(finding, played.out)


def stress(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[WHAT]", help="all, runs (random scenes) or maps (where engines break)."
        ),
    ] = "all",
    played: Played = Played(OUT / "stress"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Some thousand runs, below a minute.")
    ] = False,
    seed: Annotated[
        int,
        typer.Option(
            "--seed", min=0, help="Of the random scenes; scene k of a seed is always the same."
        ),
    ] = 1,
    runs: Annotated[
        int | None,
        typer.Option(
            "--runs", min=1, help="Runs of each model (100,000 of event-based ones, else 2,000)."
        ),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option("--models", help="Only these, with commas between; repeatable."),
    ] = None,
) -> None:
    """Numerical stability: where the models break.

    Random scenes over all allowed settings, checked for invariants, and the steps at which
    engines break. Writes a page, tables, and of failures the smallest scene files that show them.
    An interrupted run resumes where it ended.
    Exit 1 where an event-based model breaks an invariant.
    """
    from rockcheck.validation.studies.stress.maps import map_points
    from rockcheck.validation.studies.stress.players import PLAYERS
    from rockcheck.validation.studies.stress.study import Stress, What

    part: What = errors.one_of("stress", what, get_args(What))
    names = names_in(model or ())
    families = [errors.one_of("model", name, PLAYERS).split()[0] for name in names]
    need_installed(families, "--models")
    if part == "maps" and runs:
        raise errors.InputError("is of random scenes, not of maps", "--runs")
    if part == "maps" and not map_points(quick, names):
        raise errors.InputError(
            "maps are of engines and cm: an event-based model has no step", "--models"
        )
    tell_missing()
    run_study(Stress(part, seed, quick, runs, tuple(names)), played)


def conformance(
    engines: Annotated[
        list[str] | None,
        typer.Option(
            "--models",
            "--engine",
            help="Engines by name, or module:Class, with commas between; repeatable (default: all"
            " engines that are installed).",
            autocompletion=model_names,
        ),
    ] = None,
    histories: Annotated[
        list[Path] | None,
        typer.Option(
            "--histories", help="Folder with an engine's own CSV, see --export; repeatable."
        ),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export", help="Write the scenes for another engine into a folder, and stop."
        ),
    ] = None,
    tune: Annotated[
        float | None,
        typer.Option("--tune", metavar="E", help="Find engines' own parameters for restitution E."),
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A setting of the engines, such as time_step=1e-3; repeatable. Their set-up:"
            " settings=best (the default), default or both. With --tune: time_step, friction,"
            " penetration (m).",
        ),
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(
            "--limit",
            min=1.0,
            help="Longest time of a phenomenon, s (default: some 100 times the usual one).",
        ),
    ] = None,
    allow_code: AllowCodeOption = None,
    played: Played = Played(OUT / "conformance"),
) -> None:
    """Check engines against phenomena with a known answer.

    Writes a card an engine: a page, JSON, JUnit and Markdown. Exit 1 where an engine fails one.
    With --tune, finds what an engine needs for a restitution: it drops a block, and slides it.
    """
    from rockcheck.validation.studies.conformance.cards import Conformance
    from rockcheck.validation.studies.conformance.players import named, written

    if export and (engines or histories or sets or tune is not None):
        raise errors.InputError(
            "does not go with --models, --histories, --tune or --set", "--export"
        )
    if tune is not None and histories:
        raise errors.InputError("does not go with --histories", "--tune")
    if export is not None:
        _export(usable_folder(export))
    settings, folders = settings_of(sets or ()), histories or []
    names = _engine_names(engines or (), () if folders else models.ENGINE_NAMES)
    _check_engines(names, allow_code or (), user_models=tune is None)
    if tune is not None:
        _tune(names, tune, settings, replace(played, out=played.out / "tuned"))
    setup = settings.pop("settings", None)
    setups = ("best", "default") if setup == "both" else (setup,)
    players = [named(*pair, settings) for pair in itertools.product(names, setups)]
    players += [written(folder) for folder in folders]
    run_study(Conformance(tuple(players), limit), played)


def _tune(
    names: Sequence[str], restitution: float, settings: Mapping[str, Any], played: Played
) -> NoReturn:
    from rockcheck.validation.studies.conformance.tuning import WANTED, Tune, Tuning

    wanted = WANTED.keys() - {"restitution"}
    if unknown := settings.keys() - wanted:
        raise errors.unknown_name("setting", min(unknown), wanted)
    run_study(Tuning(tuple(Tune(name, restitution, **settings) for name in names)), played)


def _engine_names(words: Sequence[str], default: Sequence[str]) -> list[str]:
    """The names in words with commas between them; without words those of `default` here."""
    if words:
        return names_in(words)
    return [name for name in default if not models.not_installed(name)]


def _check_engines(names: Sequence[str], allow_code: Sequence[str], *, user_models: bool) -> None:
    known = models.ENGINE_NAMES
    for name in names:
        models.check_allowed(name, allow_code)
        if name not in known and not (user_models and models.is_own(name)):
            raise errors.InputError(
                f"{printable(name)!r} is not allowed: give one of {', '.join(known)}"
                + ", or module:Class" * user_models,
                "--models",
            )
    need_installed(names, "--models")


def _export(folder: Path) -> NoReturn:
    from rockcheck.reports.site import write_scene_file
    from rockcheck.validation.studies.conformance import export, phenomena

    for name, scene in phenomena.SCENES.items():
        write_scene_file(scene, folder, name)
    names = export.export(folder)
    lines = [
        f"{len(names)} scenes in {folder}, README.md says how they are meant; then:",
        f"  rockcheck conformance --histories {folder}",
    ]
    finish_command(
        Finding("export", "", "", [Text(items=lines)]),
        value={"folder": folder, "scenes": {name: f"{name}.toml" for name in names}},
    )
