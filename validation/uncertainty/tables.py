"""What is known of a run's uncertainty, as tables."""

from __future__ import annotations

from collections.abc import Iterator

from rockcheck.validation.finding import Block, Column, Table, Text, text
from rockcheck.validation.uncertainty.inputs import Inputs
from rockcheck.validation.uncertainty.numerical import Numerical

DIGITS = 4


def numerical_blocks(found: Numerical) -> Iterator[Block]:
    """Each figure with its numerical uncertainty, and why what is not converged is not."""
    columns = [
        text("quantity"),
        Column("value", digits=DIGITS),
        Column("u_num", "u_num", digits=DIGITS),
        text("unit"),
        Column("order", digits=2),
        text("verdict"),
    ]
    rows = [[q.name, q.value, q.u_num, q.unit, q.order, q.verdict] for q in found.quantities]
    yield Table("quantities", columns, rows)
    yield Text(items=found.reasons)


def inputs_blocks(found: Inputs) -> Iterator[Block]:
    """The intervals of the figures, and which number matters most."""
    columns = [
        text("figure"),
        *(Column(name, digits=DIGITS) for name in ("value", "low", "high")),
        text("unit"),
    ]
    rows = [[f.name, f.value, f.low, f.high, f.unit] for f in (*found.figures, found.overturns)]
    yield Text(
        f"{found.samples} draws of {', '.join(found.names)}, played by {found.model};"
        " 95 % of them between low and high"
    )
    yield Table("inputs", columns, rows)
    if found.sensitivities:
        columns = [
            text("input", "what matters most for the peak"),
            Column("alone", kind="percent", digits=2),
            Column("with_others", kind="percent", digits=2),
        ]
        rows = [[s.name, max(s.first, 0.0), max(s.total, 0.0)] for s in found.sensitivities]
        yield Table("sensitivities", columns, rows)
    yield Text(found.note)
