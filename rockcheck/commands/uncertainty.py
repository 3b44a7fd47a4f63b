"""`rockcheck uncertainty`: how sure a scene's figures are."""

from __future__ import annotations

from typing import Annotated

import typer

from rockcheck.commands import answer, console, model_names, progress, scene_names, setting_of
from rockcheck.scenes.files import load_uncertain_scene
from rockcheck.validation.execute.models import FAMILIES, build
from rockcheck.validation.finding import Finding
from rockcheck.validation.uncertainty.inputs import SAMPLES, Inputs, propagate
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty
from rockcheck.validation.uncertainty.tables import inputs_blocks, numerical_blocks

NOT_CONVERGED = 1


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

    The numerical error comes from runs at coarser steps (or a finer tolerance). Numbers that the
    scene file gives as { value = 0.3, sd = 0.03 } are drawn at random, run by the event-based
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
        tell(2, 2, "")
    found = finding_of(given.scene.name, model, numerical, inputs)
    show(found, console())
    answer(found.data)
    raise typer.Exit(found.exit_code)


def finding_of(
    scene: str, model: str, numerical: Numerical | None, inputs: Inputs | None
) -> Finding:
    """Both uncertainties; its data are what `--json` says."""
    converged = numerical is not None and numerical.converged
    said, quantities = "a model without step or tolerance; its numerical error is not known", []
    if numerical is not None:
        said = f"{'converged' if converged else 'not converged'}, by {numerical.method}"
        quantities = [
            {**q.model_dump(), "u_input": inputs.u_input(q.name) if inputs else None}
            for q in numerical.quantities
        ]
    return Finding(
        "uncertainty",
        f"Uncertainty: {scene}",
        f"{scene}, {model}: {said}",
        [
            *(numerical_blocks(numerical) if numerical else ()),
            *(inputs_blocks(inputs) if inputs else ()),
        ],
        {
            "scene": scene,
            "model": model,
            "converged": converged,
            "method": numerical.method if numerical else "",
            "quantities": quantities,
            "inputs": inputs.model_dump() if inputs else None,
        },
        exit_code=0 if converged else NOT_CONVERGED,
    )
