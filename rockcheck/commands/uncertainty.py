"""`rockcheck uncertainty`: how sure a scene's figures are."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from rockcheck.commands import answer, console, model_names, progress, scene_names
from rockcheck.commands.simulate import setting_of
from rockcheck.scenes.files import load_uncertain_scene
from rockcheck.validation.execute.models import FAMILIES, build
from rockcheck.validation.uncertainty.inputs import SAMPLES, Inputs, propagate
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty

NOT_CONVERGED = 1


def run(
    scene: Annotated[str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)],
    model: Annotated[
        str, typer.Option("--model", help=f"Model to look at: one of {', '.join(FAMILIES)}.", autocompletion=model_names)
    ] = "ebm-unilateral",
    settings: Annotated[list[str] | None, typer.Option("--set", help="A setting of the model, such as time_step=1e-4; repeatable.")] = None,
    samples: Annotated[
        int, typer.Option("--samples", min=2, help="Draws of the scene's uncertain numbers (a power of two is taken).")
    ] = SAMPLES,
) -> None:
    """Give the uncertainty of a scene's figures.

    The numerical error comes from runs at three coarser steps (or a finer tolerance). Numbers that the scene file gives as
    { value = 0.3, sd = 0.03 } are drawn at random, run by the event-based model, and ranked by their effect.

    Exit 0: converged. 1: not converged.
    """
    given = load_uncertain_scene(scene)
    player = build(model, dict(setting_of(text) for text in settings or []))
    with progress(f"{given.scene.name}, {model}") as tell:
        tell(0, 2, "steps")
        numerical = numerical_uncertainty(player, given.scene)
        tell(1, 2, "draws")
        inputs = propagate(given, samples=samples).inputs if given.spreads else None
        tell(2, 2, "")
    converged = numerical is not None and numerical.converged
    _show(given.scene.name, model, numerical, inputs)
    answer(_data(given.scene.name, model, converged, numerical, inputs))
    raise typer.Exit(0 if converged else NOT_CONVERGED)


def _data(scene: str, model: str, converged: bool, numerical: Numerical | None, inputs: Inputs | None) -> dict[str, Any]:
    quantities = [] if numerical is None else [quantity.model_dump() for quantity in numerical.quantities]
    for quantity in quantities:
        quantity["u_input"] = inputs.u_input(quantity["name"]) if inputs else None
    return {
        "scene": scene,
        "model": model,
        "converged": converged,
        "method": numerical.method if numerical else "",
        "quantities": quantities,
        "inputs": inputs.model_dump() if inputs else None,
    }


def _show(scene: str, model: str, numerical: Numerical | None, inputs: Inputs | None) -> None:
    out = console()
    if numerical is None:
        out.print(f"{scene}, {model}: a model without step or tolerance; its numerical error is not known")
    else:
        out.print(f"{scene}, {model}: {'converged' if numerical.converged else 'not converged'}, by {numerical.method}")
        table = Table(box=None, pad_edge=False)
        for name in ("quantity", "value", "u_num", "unit", "order", "verdict"):
            table.add_column(name, justify="right" if name in ("value", "u_num", "order") else "left")
        for q in numerical.quantities:
            value = q.value if isinstance(q.value, str) else _digits(q.value)
            table.add_row(q.name, value, _digits(q.u_num), q.unit, _digits(q.order, 2), q.verdict)
        out.print(table)
        for reason in numerical.reasons:
            out.print(reason)
    if inputs is None:
        return
    out.print(f"{inputs.samples} draws of {', '.join(inputs.names)}, played by {inputs.model}; 95 % of them between low and high")
    table = Table(box=None, pad_edge=False)
    for name in ("figure", "value", "low", "high", "unit"):
        table.add_column(name, justify="left" if name in ("figure", "unit") else "right")
    for figure in (*inputs.figures, inputs.overturns):
        table.add_row(figure.name, _digits(figure.value), _digits(figure.low), _digits(figure.high), figure.unit)
    out.print(table)
    if inputs.sensitivities:
        table = Table(box=None, pad_edge=False)
        for name in ("what matters most for the peak", "alone", "with others"):
            table.add_column(name, justify="left" if name.startswith("what") else "right")
        for row in inputs.sensitivities:
            table.add_row(row.name, f"{100.0 * max(row.first, 0.0):.0f} %", f"{100.0 * max(row.total, 0.0):.0f} %")
        out.print(table)
    if inputs.note:
        out.print(inputs.note)


def _digits(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"
