"""A benchmark's figures as Markdown: `summary.md`, and the page that the repository keeps of one whole run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import median

from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.bench.ebm import CASES, EbmSpeed
from rockcheck.validation.bench.models import EQUAL_COST, LEVEL, LINES, WorkPrecision, league
from rockcheck.validation.bench.scenes import FAMILIES
from rockcheck.validation.bench.skipping import NOT_MEASURED, Saving
from rockcheck.validation.bench.study import Benchmark


def markdown(found: Benchmark) -> str:
    """All tables of a benchmark but those of single runs."""
    parts = [
        f"{found.suite}, {found.created[:10]}, {found.wall_seconds / 60.0:.0f} minutes",
        ", ".join(f"{name} {version}" for name, version in found.versions.items()),
        ", ".join(f"{name}: {value}" for name, value in found.hardware.items()),
    ]
    if found.models is not None:
        parts += _models(found.models)
    if found.ebm is not None:
        parts += _batches(found.ebm)
    if found.savings is not None:
        parts += _savings(found.savings)
    if found.models is not None:
        parts += ["## Left out", "\n".join(f"- {line}" for line in found.models.left_out)]
    return "\n\n".join(parts) + "\n"


def _models(found: WorkPrecision) -> Iterable[str]:
    families = list(found.horizons)
    standings = league(found.pooled)
    if standings:
        yield "## League of engines"
        yield (
            f"Free rocking and pulses. Error: RMS of θ, α, at {1e3 * EQUAL_COST:g} ms of CPU a simulated second. Cost: CPU ms a simulated"
            f" second at an error of {LEVEL:g} α. –: not reached, or beyond the settings that were played."
        )
        rows = [
            [one.line, _number(1e3 * one.cost), f"{one.error:.1e}" if math.isfinite(one.error) else "–", f"{one.best:.1e}",
             _number(1e3 * one.best_cost)]
            for one in standings
        ]  # fmt: skip
        yield markdown_table(["engine", "cost at equal error", "error at equal cost", "least error", "at a cost of"], rows)
    yield "## Scenes"
    rows = [[name, FAMILIES[name].words, _number(found.horizons[name]), _number(found.model_form[name])] for name in families]
    yield markdown_table(["scene", "what", "compared up to, s", "model form, α RMS"], rows)
    yield f"## Run time at an error of {LEVEL:g} α, over the EBM's"
    yield "≤: already the coarsest setting is that good. –: not reached."
    trends = {(trend.line, trend.family): trend for trend in found.trends}
    rows = []
    for label in LINES:
        mine = [trends.get((label, family)) for family in families]
        cells = ["" if t is None else "–" if math.isnan(t.ratio) else f"{'≤ ' if t.at_coarsest else ''}{_number(t.ratio)}" for t in mine]
        rows.append([label, *cells])
    yield markdown_table(["model", *families], rows)
    yield "## Engines over whole kinds of scenes"
    yield "CPU: ms a simulated second. Error: RMS of θ, α. Adaptive: the error of adaptive steps at the same CPU time."
    rows = [
        [p.kind, p.line, f"{LINES[p.line].knob} {p.value:g}", str(p.runs), _number(1e3 * p.cpu), f"{p.rms:.1e}", f"{p.rms_worst:.1e}",
         "" if math.isnan(p.at_the_cost) else f"{p.at_the_cost:.1e}"]
        for p in found.pooled
    ]  # fmt: skip
    yield markdown_table(["scenes", "line", "setting", "runs", "CPU", "median error", "worst", "adaptive"], rows)
    yield "## Order of convergence in the swept setting"
    rows = [
        [label, line.knob, *("" if (t := trends.get((label, f))) is None else _number(t.order) for f in families)]
        for label, line in LINES.items()
    ]
    yield markdown_table(["model", "setting", *families], rows)
    yield "## Median RMS error of θ, α, up to the horizon"
    yield "CPU: ms a simulated second, median over the scenes."
    points = {(point.line, point.value, point.family): point for point in found.points}
    rows = []
    for label, line in LINES.items():
        for value in line.values:
            row = [points.get((label, value, family)) for family in families]
            known = [1e3 * p.cpu for p in row if p is not None and math.isfinite(p.cpu)]
            if known:
                errors = ["" if p is None else f"{p.rms:.1e}" + (f" ({p.runs})" if p.runs < 10 else "") for p in row]
                rows.append([label, f"{line.knob} {value:g}", _number(median(known)), *errors])
    yield markdown_table(["model", "setting", "CPU", *families], rows)


def _batches(found: EbmSpeed) -> Iterable[str]:
    yield "## Compiled batches of the event-based model"
    yield (
        "One core; p95 of the peak's error, rad, against a tolerance of 1e-14. One right-hand side took"
        f" {1e9 * found.right_hand_side:.1f} ns in the same run. Bold: the cheapest tolerance with a p95 error of at most 1e-8."
    )
    rows = []
    for case in CASES:
        best = found.at_level(case.name)
        for row in found.times:
            if row.case == case.name:
                cost = f"{1e6 * row.cpu:.1f}"
                wrong = f"{row.wrong} of {row.runs}"
                rows.append([
                    f"{case.name} ({case.words})", f"{row.tolerance:g}", f"**{cost}**" if row is best else cost,
                    f"{row.evaluations:.0f}", f"{row.error_95:.1e}", wrong,
                ])  # fmt: skip
    yield markdown_table(["batch", "tolerance", "CPU μs a run", "right-hand sides", "p95 error", "wrong outcomes"], rows)
    for start in found.cold_starts:
        seconds = f"import {start.importing:.2f} s, first simulation {start.first_simulation:.2f} s"
        yield f"Fresh process, compile cache {start.cache}: {seconds}."
    if found.sizes:
        yield "## Cost of a batch against its size"
        yield "Random pulses (μ 0.3, no wall), packing included: wall-clock μs a run."
        counts = sorted({row.threads for row in found.sizes})
        walls = {(row.runs, row.threads): f"{1e6 * row.wall:.3g}" for row in found.sizes}
        rows = [[f"{runs:,}", *(walls[runs, count] for count in counts)] for runs in dict.fromkeys(row.runs for row in found.sizes)]
        yield markdown_table(["runs", *(f"{count} thread{'s' * (count > 1)}" for count in counts)], rows)


def _savings(found: Sequence[Saving]) -> Iterable[str]:
    yield "## What a scene does not need"
    rows = []
    for saving in found:
        costs = _number(saving.cost_with), _number(saving.cost_without), saving.unit, f"{saving.ratio:.2f}"
        rows.append([saving.model, saving.thing, *costs, _number(saving.change), saving.remark])
    yield markdown_table(["model", "thing", "with", "without", "unit", "with/without", "change, α", "what was compared"], rows)
    yield f"Not measured: {'; '.join(NOT_MEASURED)}."


def _number(value: float) -> str:
    return f"{value:.2g}" if abs(value) < 100.0 else f"{value:.0f}" if math.isfinite(value) else "–"
