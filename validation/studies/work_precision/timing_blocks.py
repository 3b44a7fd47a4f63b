"""Timings other than a model's run, as tables: batches, cold starts, sizes, savings.

In: rows of `timings` and `savings`. Out: blocks of a finding. Called by the study.
"""

from collections.abc import Iterator, Sequence
from statistics import median

import pandas as pd

from rockcheck.validation.finding import Block, Column, Table, text
from rockcheck.validation.studies.work_precision import savings, timings
from rockcheck.validation.studies.work_precision.drawing import batch_plot
from rockcheck.validation.studies.work_precision.run_blocks import table_of


def batch_blocks(times: Sequence[timings.BatchTime]) -> Iterator[Block]:
    """The compiled batches: the cheapest tolerance of each case, the diagram, all tolerances."""
    rows = []
    for name in timings.CASES:
        if row := timings.at_level(times, name):
            wrong = f"{row.wrong} of {row.runs}"
            cost = 1e6 * row.cpu
            rows.append([row.case, row.tolerance, cost, row.evaluations, row.error_95, wrong])
    yield Table(
        "batches-at-level",
        [
            text("case", "batch, one core"),
            Column("tolerance"),
            Column("cpu", "CPU", "μs a run"),
            Column("evaluations", "right-hand sides"),
            Column("error_95", "p95 error", "rad", digits=2),
            text("wrong"),
        ],
        rows,
        "Compiled batches of the event-based model",
        f"The cheapest tolerance with a p95 error of the peak of at most {timings.LEVEL:g} rad."
        f" One right-hand side: {1e9 * median(row.right_hand_side for row in times):.1f} ns.",
    )
    yield batch_plot(times)
    every = pd.DataFrame(times)
    yield table_of("batch-times", every, title="All tolerances", on="page", folded=True)


def cold_start_table(starts: Sequence[timings.ColdStart]) -> Table:
    """The time to import and to the first result, in a new process."""
    return Table(
        "cold-starts",
        [
            text("cache", "compile cache"),
            Column("importing", "import", "s"),
            Column("first_simulation", "first run", "s"),
        ],
        [[start.cache, start.importing, start.first_simulation] for start in starts],
        "Cold starts",
    )


def size_table(sizes: Sequence[timings.BatchSize]) -> Table:
    """The wall time of a run by the size of its batch and the number of threads."""
    threads = sorted({size.threads for size in sizes})
    wall = {(size.runs, size.threads): 1e6 * size.wall for size in sizes}
    counts = dict.fromkeys(size.runs for size in sizes)
    return Table(
        "batch-sizes",
        [
            Column("runs"),
            *(Column(f"threads_{n}", f"{n} thread{'s' * (n > 1)}", "μs a run") for n in threads),
        ],
        [[count, *(wall.get((count, n)) for n in threads)] for count in counts],
        "Cost of a batch against its size",
        "Random pulses, packing included.",
        on="page",
    )


def saving_table(saved: Sequence[savings.Saving]) -> Table:
    """The cost of what a scene does not need, with it and without it."""
    return Table(
        "savings",
        [
            text("model"),
            text("thing", "not needed"),
            Column("cost_with", "with"),
            Column("cost_without", "without"),
            text("unit"),
            Column("ratio", "times"),
            Column("change", "change", "alpha", digits=2),
            text("remark", "what was compared"),
        ],
        [
            [
                saving.model,
                saving.thing,
                saving.cost_with,
                saving.cost_without,
                saving.unit,
                saving.cost_with / saving.cost_without,
                saving.change,
                saving.remark,
            ]
            for saving in saved
        ],
        "What a scene does not need",
        f"Not measured: {'; '.join(savings.NOT_MEASURED)}.",
        folded=True,
    )
