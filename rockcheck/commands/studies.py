"""`rockcheck spectrum`, `benchmark`, `stress` and `conformance`: the studies of models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, NoReturn, get_args

import typer

from rockcheck.commands import (
    OUT,
    AllowCodeOption,
    JobsOption,
    OutOption,
    Played,
    answer,
    completing,
    console,
    model_names,
    setting_of,
    studied,
    tell_missing,
    usable_folder,
)
from rockcheck.scenes.errors import InputError, NotInstalled, one_of, printable, unknown_name
from rockcheck.scenes.files import load_scene, named_scenes
from rockcheck.validation.execute import models
from rockcheck.validation.execute.store import name_of
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
            autocompletion=completing(lambda: [*PAPER, *named_scenes()]),
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
    from rockcheck.validation.studies.spectrum.study import Spectra
    from rockcheck.validation.studies.spectrum.tiles import Request

    if what in PAPER:
        panels = paper_panels(*PAPER[what])
    else:
        scene = load_scene(what)
        panels = (Panel(name_of(scene.name.replace(" ", "-")), scene.name, scene),)
    # Beside a wall a block hops, which the pivot of the paper's figures forbids.
    hops = what not in PAPER and panels[0].wall is not None
    given = dict(setting_of(one) for one in settings or [])
    name = model or ("ebm-unilateral" if hops and agreement is None else "ebm")
    request = Request(grid.size, grid.frequencies, grid.amplitudes, name, given, grid.refine)
    if agreement is not None:
        if name != "ebm":
            raise InputError(
                "cannot be given together with --model: all are compared", "--agreement"
            )
        if not 2 <= agreement <= grid.size**2:
            raise InputError(
                f"{agreement} is not allowed: give 2 up to the number of the spectrum's nodes",
                "--agreement",
            )
        tell_missing()
    studied(Spectra(panels, request, agreement or 0), played)


def benchmark(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[WHAT]",
            help="all, ebm (batches), models (work and precision), skipping, or convergence.",
        ),
    ] = "all",
    out: OutOption = OUT / "benchmark",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer scenes and settings.")] = False,
    jobs: JobsOption = None,
) -> None:
    """Run time against error, for every model.

    Work and precision, compiled batches, what a scene does not need, and what engines converge to.
    """
    from rockcheck.validation.studies.work_precision.study import What, WorkPrecision

    part: What = one_of("benchmark", what, get_args(What))
    tell_missing()
    studied(WorkPrecision(part, quick), Played(out, jobs), minutes=MINUTES)


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
        list[str] | None, typer.Option("--model", help="Only this model; repeatable.")
    ] = None,
) -> None:
    """Numerical stability: where the models break.

    Random scenes over all allowed settings, checked for invariants, and the steps at which
    engines break. Writes a page, tables, and of failures the smallest scene files that show them.
    An interrupted run resumes where it ended.
    Exit 1 where an event-based model breaks an invariant.
    """
    from rockcheck.validation.studies.stress.runs import PLAYERS
    from rockcheck.validation.studies.stress.study import Stress, What, places

    part: What = one_of("stress", what, get_args(What))
    for name in model or ():
        if missing := models.not_installed(one_of("model", name, PLAYERS).split()[0]):
            raise NotInstalled(missing, name)
    if part == "maps" and not places(quick, model or ()):
        raise InputError("maps are of engines and cm: an event-based model has no step", "--model")
    tell_missing()
    studied(Stress(part, seed, quick, runs, tuple(model or ())), played)


def conformance(
    engine: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            help="A name or module:Class; repeatable (default: all installed).",
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
    allow_code: AllowCodeOption = None,
    played: Played = Played(OUT / "conformance"),
) -> None:
    """Check engines against phenomena with a known answer.

    Writes a card an engine: a page, JSON, JUnit and Markdown. Exit 1 where an engine fails one.
    With --tune, finds what an engine needs for a restitution: it drops a block, and slides it.
    """
    from rockcheck.validation.studies.conformance.study import Conformance, named, written

    if export is not None:
        _export(usable_folder(export))
        return
    given, folders = dict(setting_of(text) for text in sets or []), histories or []
    known = () if folders else models.engine_names()
    names = list(
        dict.fromkeys(engine or [name for name in known if not models.not_installed(name)])
    )
    for name in names:
        _check_engine(name, allow_code or (), own=tune is None)
    if tune is not None:
        if folders:
            raise InputError("does not go with --histories", "--tune")
        _tune(names, tune, given, played)
    setup = given.pop("settings", None)
    kinds = ("best", "default") if setup == "both" else (setup,)
    players = [named(name, kind, given) for name in names for kind in kinds]
    players += [written(folder) for folder in folders]
    studied(Conformance(tuple(players)), played)


def _check_engine(name: str, allow_code: Sequence[str], *, own: bool) -> None:
    models.check_allowed(name, allow_code)
    known = models.engine_names()
    if name not in known and not (own and models.is_own(name)):
        allowed = f"give one of {', '.join(known)}" + ", or module:Class" * own
        raise InputError(f"{printable(name)!r} is not allowed: {allowed}", "--engine")
    if reason := models.not_installed(name):
        raise InputError(reason, f"--engine {name}")


def _tune(
    engines: Sequence[str], restitution: float, given: Mapping[str, Any], played: Played
) -> NoReturn:
    from rockcheck.validation.studies.conformance.study import WANTED, Tune, Tuning

    settings = WANTED.keys() - {"restitution"}
    if unknown := given.keys() - settings:
        raise unknown_name("setting", min(unknown), settings)
    wanted = tuple(Tune(name, restitution, **given) for name in engines)
    studied(Tuning(wanted), replace(played, out=played.out / "tuned"))


def _export(folder: Path) -> None:
    from rockcheck.reports.site import write_scene_file
    from rockcheck.validation.studies.conformance.phenomena import SCENES
    from rockcheck.validation.studies.conformance.study import export

    for name, scene in SCENES.items():
        write_scene_file(scene, folder, name)
    names = export(folder)
    console().print(
        f"{len(names)} scenes in {folder}, README.md says how they are meant; then:\n"
        f"  rockcheck conformance --histories {folder}",
        soft_wrap=True,
    )
    answer({"folder": folder, "scenes": {name: f"{name}.toml" for name in names}})
