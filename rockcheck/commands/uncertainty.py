"""`rockcheck uncertainty`: how sure a scene's figures are."""

from __future__ import annotations

from typing import Annotated

import typer

from rockcheck.commands import answer, console, model_names, progress, scene_names, setting_of
from rockcheck.scenes.files import load_uncertain_scene
from rockcheck.validation.discrepancy.impact_laws import parting_landing
from rockcheck.validation.execute.models import FAMILIES, build
from rockcheck.validation.uncertainty.numerical import numerical_uncertainty
from rockcheck.validation.uncertainty.population import SAMPLES, propagate
from rockcheck.validation.uncertainty.tables import finding_of


def run(
    scene: Annotated[
        str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)
    ],
    model: Annotated[
        str,
        typer.Option(
            "--model",
            help=f"Model to look at: one of {', '.join(FAMILIES)}.",
            autocompletion=model_names,
        ),
    ] = "ebm-unilateral",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the model, such as time_step=1e-4; repeatable."),
    ] = None,
    samples: Annotated[
        int,
        typer.Option(
            "--samples",
            min=2,
            help="Draws of the scene's uncertain numbers (a power of two is taken).",
        ),
    ] = SAMPLES,
) -> None:
    """Give the uncertainty of a scene's figures.

    The numerical error comes from runs at three coarser steps (or a finer tolerance). Numbers that
    the scene file gives as { value = 0.3, sd = 0.03 } are drawn at random, run by the event-based
    model, and ranked by their effect.

    Exit 0: converged. 1: not converged.
    """
    from rockcheck.reports.document import show

    given = load_uncertain_scene(scene)
    player = build(model, dict(setting_of(text) for text in settings or []))
    with progress(f"{given.scene.name}, {model}") as tell:
        tell(0, 2, "steps")
        numerical = numerical_uncertainty(player, given.scene)
        tell(1, 2, "draws")
        inputs = propagate(given, samples=samples).inputs if given.spreads else None
        landing = parting_landing(given.scene)
    parts = None if landing is None else landing.t
    found = finding_of(given.scene.name, model, numerical, inputs, parts)
    show(found, console())
    answer(found.data)
    raise typer.Exit(found.exit_code)
