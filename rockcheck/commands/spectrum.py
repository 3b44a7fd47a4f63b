"""`rockcheck spectrum`: overturning spectra, the paper's or the user's own."""

from dataclasses import dataclass
from typing import Annotated

import typer

from rockcheck.commands import (
    OUT,
    Played,
    model_names,
    scene_names,
    setting_of,
    studied,
    tell_missing,
)
from rockcheck.scenes import InputError, load_scene
from rockcheck.validation.execute.store import name_of
from rockcheck.validation.paper import (
    AMPLITUDES,
    FIGURES,
    FREQUENCIES,
    Panel,
    paper_panels,
)

PAPER = {"paper": tuple(FIGURES), **{f"fig{number}": (number,) for number in FIGURES}}


def names(incomplete: str) -> list[str]:
    """For the shell's completion: the paper's figures, and scenes."""
    return [*(name for name in PAPER if name.startswith(incomplete)), *scene_names(incomplete)]


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


def run(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[WHAT]",
            help="paper (all 28 spectra), fig6, fig7, fig8 or fig9; or your own block, walls,"
            " friction and pulse or record: a scene's name or a .toml file.",
            autocompletion=names,
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
