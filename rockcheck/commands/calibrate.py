"""`rockcheck calibrate`: what an engine needs for a wanted restitution and friction."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.table import Table

from rockcheck.commands import answer, console, model_names, progress
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable


def run(
    engine: Annotated[str, typer.Option("--engine", help="The engine.", autocompletion=model_names)],
    restitution: Annotated[float, typer.Option("--restitution", help="Wanted, from 0 to 1.")],
    friction: Annotated[float, typer.Option("--friction", help="Wanted coefficient.")] = 0.3,
    penetration: Annotated[float | None, typer.Option("--penetration", help="Largest penetration allowed, m.")] = None,
    step: Annotated[float, typer.Option("--step", help="Time step, s.")] = 1e-3,
) -> None:
    """Find an engine's own parameters for a restitution.

    Drops a block by 0.2 m and slides it. Prints the parameters in the engine's words, and what they reach.
    Exit 1 where that is not what was wanted.
    """
    from rockcheck.validation.conformance.calibration import KNOBS, calibrate
    from rockcheck.validation.execute.models import not_installed

    if engine not in KNOBS:
        raise InputError(f"{printable(engine)!r} is not allowed: give one of {', '.join(KNOBS)}", "--engine")
    if reason := not_installed(engine):
        raise InputError(reason, f"--engine {engine}")
    for name, value, most in (("restitution", restitution, 1.0), ("friction", friction, 1.3), ("step", step, 0.01)):
        if not (0.0 if name == "restitution" else 1e-6) <= value <= most:
            raise InputError(f"{value:g} is not allowed: give at most {most:g}", f"--{name}")
    limit = {} if penetration is None else {"penetration": penetration}
    with progress("calibrate"):
        found = calibrate(engine, restitution=restitution, friction=friction, step=step, **limit)
    table = Table(box=None, pad_edge=False, show_header=False)
    for where, what in found.parameters.items():
        table.add_row(where, what)
    console().print(table)
    reached = f"restitution {found.restitution:.3f}, friction {found.friction:.3f}, penetration at most {1e3 * found.penetration:.3g} mm"
    console().print(f"reached at a step of {step:g} s: {reached}", soft_wrap=True)
    if found.remark:
        console().print(found.remark, soft_wrap=True)
    if not found.reached:
        console().print("this is not what was wanted", style="red")
    answer(asdict(found))
    raise typer.Exit(int(not found.reached))
