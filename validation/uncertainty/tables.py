"""What is known of a run's uncertainty, as blocks of a finding."""

from __future__ import annotations

from typing import Any

from rockcheck.validation.finding import Block, Column, Table, Text, text
from rockcheck.validation.uncertainty.numerical import Numerical
from rockcheck.validation.uncertainty.population import Inputs


def quantities_of(
    scene: str,
    model: str,
    numerical: Numerical | None,
    inputs: Inputs | None = None,
    parts: float | None = None,
) -> tuple[dict[str, Any], list[Block]]:
    """The numerical uncertainty of each figure, for `--json` and as blocks.

    `parts` is the time (s) from which the motion depends on the law of impacts: from there on no
    step makes a figure sure.
    """
    converged = numerical is not None and numerical.converged and parts is None
    quantities: list[dict[str, Any]] = []
    said = "a model without step or tolerance; its numerical error is not known"
    blocks: list[Block] = []
    if numerical is not None:
        said = f"{'converged' if converged else 'not converged'}, by {numerical.method}"
        quantities = [
            {**q.model_dump(), "u_input": inputs.u_input(q.name) if inputs else None}
            for q in numerical.quantities
        ]
        names = ("value", "u_num", "order")
        columns = [text("name", "quantity"), *(Column(name, name, digits=4) for name in names)]
        columns += [text("unit"), text("verdict")]
        rows = [[one[column.name] for column in columns] for one in quantities]
        table = Table("numerical", columns, rows, "Numerical uncertainty", f"{scene}, {model}.")
        blocks += [table, Text(items=numerical.reasons)]
    if parts is not None:
        law = f"from {parts:.3g} s on the motion depends on the law of impacts (docs, limits)"
        blocks.append(Text(law, verdict="changed"))
    return {
        "scene": scene,
        "model": model,
        "converged": converged,
        "depends_on_law_from_s": parts,
        "method": numerical.method if numerical else "",
        "quantities": quantities,
        "said": said,
    }, blocks


def inputs_blocks(inputs: Inputs) -> list[Block]:
    """What the spread of the inputs makes of the figures, and which input matters most."""
    about = f"{inputs.samples} draws of {', '.join(inputs.names)}, played by {inputs.model}"
    shares = [[s.name, max(s.first, 0.0), max(s.total, 0.0)] for s in inputs.sensitivities]
    return [
        Table(
            "inputs",
            [
                text("figure"),
                *(Column(name, digits=4) for name in ("value", "low", "high")),
                text("unit"),
            ],
            [
                [one.name, one.value, one.low, one.high, one.unit]
                for one in (*inputs.figures, inputs.overturns)
            ],
            "Uncertain inputs",
            note=f"{about}; 95 % of them between low and high.",
        ),
        Table(
            "sensitivities",
            [
                text("input", "what matters most for the peak"),
                Column("alone", kind="percent", digits=2),
                Column("with_others", kind="percent", digits=2),
            ],
            shares,
            on="all" if shares else "file",
        ),
        Text(inputs.note),
    ]
