"""What is known of a run's uncertainty, as a finding."""

from __future__ import annotations

from rockcheck.validation.finding import Block, Column, Finding, Table, Text, text
from rockcheck.validation.uncertainty.numerical import Numerical
from rockcheck.validation.uncertainty.population import Inputs


def finding_of(
    scene: str,
    model: str,
    numerical: Numerical | None,
    inputs: Inputs | None,
    parts: float | None = None,
) -> Finding:
    """The numerical uncertainty of each figure, and what the spread of the inputs makes of it; its
    data are what `--json` says.

    `parts` is the time (s) from which the motion depends on the law of impacts: from there on no
    step makes a figure sure.
    """
    converged = numerical is not None and numerical.converged and parts is None
    said = "a model without step or tolerance; its numerical error is not known"
    quantities, blocks = [], list[Block]()
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
        blocks += [Table("quantities", columns, rows), Text(items=numerical.reasons)]
    if parts is not None:
        law = f"from {parts:.3g} s on the motion depends on the law of impacts (docs, limits)"
        blocks.append(Text(law, verdict="changed"))
    if inputs is not None:
        about = f"{inputs.samples} draws of {', '.join(inputs.names)}, played by {inputs.model}"
        shares = [[s.name, max(s.first, 0.0), max(s.total, 0.0)] for s in inputs.sensitivities]
        blocks += [
            Text(f"{about}; 95 % of them between low and high"),
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
    return Finding(
        "uncertainty",
        f"Uncertainty: {scene}",
        f"{scene}, {model}: {said}",
        blocks,
        {
            "scene": scene,
            "model": model,
            "converged": converged,
            "depends_on_law_from_s": parts,
            "method": numerical.method if numerical else "",
            "quantities": quantities,
            "inputs": inputs.model_dump() if inputs else None,
        },
        exit_code=0 if converged else 1,
    )
