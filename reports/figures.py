"""What is drawn of a scene, figures for a paper and the data of its page, and of an ensemble.

A scene's figures show the quantities of the paper's Figs. 4 and 5 for all models, and their
differences below each.

A page's data (`payload`) are a script, since a page opened from the file system cannot fetch data.
Their values are float32 (rounded to 6e-8 of their size), a line of `rows` values for the ground,
each channel and each running figure. All lines of a page are packed together, and each place holds
the number of its line.
"""

import base64
import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rockcheck.reports.show.words import number, scene_facts
from rockcheck.reports.style import PAGE, SUPERSCRIPTS, Figure, Look, new_figure
from rockcheck.reports.tables import checks_table, runs_table, verdict_mark
from rockcheck.reports.view import (
    CHANNELS,
    PAPER_CHANNELS,
    Band,
    Channel,
    SceneView,
    View,
    slugs_of,
)
from rockcheck.scenes import Scene, excitations
from rockcheck.validation.discrepancy import ensemble, figures, impacts, measures
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.suite import motions, results

#: How an event is drawn on a model's track: kind, marker, size.
TRACKED = (("floor impact", "|", 5.0), ("wall impact", "D", 2.6))
#: The least that the axis of a thumbnail shows to either side, alpha: noise is not blown up.
LEAST = 1e-3
#: Below this share of a channel's largest value differences are drawn on a linear scale.
FINE = 1e-3
LEGEND_COLUMNS = 6
TOLERANCE = "#009168"
#: The mark of a limit of the RMS.
LIMIT: dict[str, Any] = {
    "color": TOLERANCE,
    "marker": "_",
    "markersize": 7.0,
    "markeredgewidth": 1.4,
}
#: Ends of the axes of peaks, alpha, and where an overturned block is drawn beyond.
LOWEST, MOST, FALLEN = 1e-3, 1.0, 3.2
#: Columns of an ensemble's table: measure and title.
STATISTICS_SHOWN = {
    "overturning_accuracy": "agreement",
    "overturning_precision": "precision",
    "overturning_recall": "recall",
    "ks_distance": "KS distance",
    "peak_bias": "bias",
    "peak_scatter": "scatter",
}
PEAK = "peak |θ|/α"


def histories_figure(view: SceneView, against: str | None = None) -> Figure:
    """Each channel of all models over time, below it the difference from `against`, then impacts.

    Tolerances are shaded.

    `against` None: the first reference of the scene; where there is none the differences are left
    out.
    """
    against = against or view.figure_references[0]
    heights = (
        [0.55]
        + ([1.0, 0.62] if against else [1.0]) * len(PAPER_CHANNELS)
        + [0.16 * len(view.histories) + 0.15]
    )
    beyond = view.horizon is not None and view.horizon < view.t[-1]
    shades = _shades(view, against, beyond)
    legend_rows = -(-(len(view.histories) + len(shades)) // LEGEND_COLUMNS)
    # Margins in inches: a layout engine would need several times the drawing's own time.
    top, bottom, space = 0.25 + 0.16 * legend_rows, 0.42, 0.09
    height = top + bottom + 0.92 * sum(heights) + space * len(heights)
    with new_figure(figsize=(PAGE, height)) as figure:
        axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
        figure.subplots_adjust(
            0.95 / PAGE, bottom / height, 1.0 - 0.08 / PAGE, 1.0 - top / height, hspace=space / 0.7
        )
        axes[0].plot(
            view.t, view.ground / excitations.GRAVITY_OF_RECORDS, color="#666666", linewidth=0.5
        )
        axes[0].set_ylabel("base\n(g)")
        panels = iter(axes[1:])
        for channel in PAPER_CHANNELS:
            _values(next(panels), view, channel)
            if against:
                _differences(next(panels), view, channel, against)
        _tracks(next(panels), view)
        for ax in axes:
            if beyond:
                ax.axvspan(view.horizon, view.t[-1], color="#000000", alpha=0.05, linewidth=0)
            ax.yaxis.set_label_coords(-0.6 / (PAGE - 1.03), 0.5)
        axes[-1].set(xlabel="time (s)", xlim=(float(view.t[0]), float(view.t[-1]) or 1.0))
        edge = 0.08 / PAGE
        below = f"; below each the difference from {view.looks[against].label}" if against else ""
        figure.text(
            edge,
            1.0 - 0.06 / height,
            f"{view.name}: all models{below}",
            va="top",
            weight="bold",
            fontsize=8.5,
        )
        handles, labels = axes[1].get_legend_handles_labels()
        figure.legend(
            handles + shades,
            [_short(label, 24) for label in labels + [str(shade.get_label()) for shade in shades]],
            ncols=LEGEND_COLUMNS,
            loc="upper left",
            bbox_to_anchor=(0.0, 1.0 - 0.2 / height),
            borderaxespad=0.0,
        )
        figure.text(
            1.0 - edge,
            0.03 / height,
            ", ".join(
                f"{name} {view.run.versions[name]}"
                for name in ("rockcheck", *view.run.models)
                if name in view.run.versions
            ),
            ha="right",
            va="bottom",
            fontsize=4.5,
            color="#777777",
        )
    return figure


def thumbnail(curves: Iterable[tuple[Any, Any, Look]], *, step: bool = False) -> Figure:
    """Some curves (x, y, and whose) over each other, small and without words."""
    with new_figure(figsize=(3.4, 0.9)) as figure:
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        for x, y, look in curves:
            ax.plot(
                x, y, color=look.light, linewidth=0.7, drawstyle="steps-post" if step else "default"
            )
        if step:
            ax.set_ylim(0.0, 1.0)
        else:
            ax.axhline(0.0, color="#bbbbbb", linewidth=0.4, zorder=0)
            ax.margins(x=0.0, y=0.08)
            ax.set_ylim(min(ax.get_ylim()[0], -LEAST), max(ax.get_ylim()[1], LEAST))
        ax.set_axis_off()
    return figure


def packed_lines(lines: Sequence[ArrayLike]) -> str:
    """Lines of values as base64 of a deflated stream.

    The stream holds of each little-endian float32 the first byte, then of each the second, and so
    on.

    A line shorter than others ends with NaN. Neighbours share their sign and exponent, so bytes of
    one place compress well: a page takes half of what plain values take.
    """
    values = np.full((len(lines), max(map(np.size, lines))), np.nan, "<f4")
    for place, line in zip(values, lines, strict=True):
        place[: np.size(line)] = line
    return base64.b64encode(zlib.compress(values.reshape(-1, 1).view(np.uint8).T.tobytes())).decode(
        "ascii"
    )


def payload(view: SceneView) -> dict[str, Any]:
    """All that is drawn and animated of a scene on its page; see the module."""
    scene = view.scene
    bands = view.bands()
    lines: list[ArrayLike] = []

    def line(values: ArrayLike) -> int:
        lines.append(values)
        return len(lines) - 1

    return {
        "scene": view.name,
        "duration": float(view.t[-1]),
        "step": scene.output_step * view.stride,
        "rows": len(view.t),
        "ground": line(view.ground / excitations.GRAVITY_OF_RECORDS),
        "alpha": scene.block.alpha,
        "frequencyParameter": scene.frequency_parameter,
        "block": [scene.block.half_width, scene.block.half_height],
        "walls": [{"side": wall.side, "gap": wall.gap} for wall in scene.walls],
        "extent": [float(f"{edge:.4g}") for edge in view.extent],
        "references": view.references,
        "horizon": view.horizon,
        "channels": [
            {
                "name": c.name,
                "label": c.label,
                "unit": "" if c.unit == "1" else c.unit,
                "fine": fineness(view, c, bands),
                "folded": c not in PAPER_CHANNELS,
            }
            for c in CHANNELS
        ],
        "window": view.active,
        "bands": [
            vars(band) | ({"running": line(view.running_rms(band))} if band.kind == "rms" else {})
            for band in bands
        ],
        "models": [
            {
                "name": model,
                "label": look.label,
                "look": look.key,
                "dash": look.dash,
                "values": {name: line(values) for name, values in view.values[model].items()},
                "events": [
                    [float(f"{e.t:.6f}"), e.kind, float(f"{e.impulse:.3g}")]
                    for e in view.histories[model].event_list
                ],
                "modes": [[float(f"{t:.4f}"), mode] for t, _, mode in view.spells(model)],
                "agreement": view.agreement.get(model),
                "fell": view.falls.get(model),
                "samples": view.measured.get(model),
            }
            for model, look in view.looks.items()
            if model in view.histories
        ],
        "lines": packed_lines(lines),  # the last, when all are known
    }


def summary(view: SceneView) -> str:
    """The figure of a scene in words: each model's peak rotation, impacts and outcome."""
    sentences = []
    for model, history in view.histories.items():
        whole = figures.WindowedHistory(history)
        count = len(whole.events(*impacts.IMPACTS))
        impact_count = "" if whole.silent else f"{count} impacts, "
        peak = number(history.peak_rotation / view.scene.block.alpha)
        reached = f"peak {peak} α, " if history.overturned_at is None else ""
        sentences.append(f"{model}: {reached}{impact_count}{history.fate}")
    return "; ".join(sentences) + "."


def fineness(view: SceneView, channel: Channel, bands: Sequence[Band]) -> float:
    """Where the scale of differences turns from linear to logarithmic, in the channel's unit.

    The tightest tolerance that is not below a thousandth of the channel's largest value, else that
    thousandth: finer scales would show nothing but decades.
    """
    largest = max((_largest(columns[channel.name]) for columns in view.drawn.values()), default=0.0)
    least = float(f"{FINE * largest:.1g}") or 1e-12
    return min(
        (band.limit for band in bands if band.channel == channel.name and band.limit >= least),
        default=least,
    )


def _largest(values: np.ndarray) -> float:
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))


def _values(ax: Any, view: SceneView, channel: Channel) -> None:
    """One channel of all models, the first reference drawn wide below the others.

    Wall impacts are marked on each model's own curve.
    """
    first = view.figure_references[0]
    for order, model in enumerate(model for model in view.looks if model in view.values):
        look, values = view.looks[model], view.drawn[model][channel.name]
        if model in view.measured:
            rows = view.measured[model]
            ax.plot(
                view.t[rows],
                values[rows],
                ".",
                color=look.light,
                markersize=2.0,
                label=look.label,
                zorder=3.0,
            )
        else:
            ax.plot(
                view.t,
                values,
                **look.line
                | (
                    {"linewidth": 1.6, "zorder": 1.9}
                    if model == first
                    else {"zorder": 2.0 + 0.01 * order}
                ),
            )
        if channel.name == "theta":
            _marks(ax, view, model, look.light)
    ax.set_ylabel(channel.symbol)


def _marks(ax: Any, view: SceneView, model: str, colour: str) -> None:
    """A diamond at each wall impact, and a cross where the block falls: the curve ends there."""
    theta, until = view.drawn[model]["theta"], view.falls.get(model, math.inf)
    if model in view.falls:
        row = int(np.searchsorted(view.t, until))
        ax.plot(
            view.t[row],
            theta[row],
            marker="x",
            markersize=4.5,
            markeredgewidth=1.2,
            color=colour,
            zorder=4.0,
        )
    if times := [
        event.t
        for event in view.histories[model].event_list
        if event.kind == "wall impact" and event.t <= until
    ]:
        ax.plot(
            times,
            np.interp(times, view.t, np.nan_to_num(theta)),
            marker="D",
            markersize=2.4,
            markerfacecolor="white",
            markeredgecolor=colour,
            linestyle="",
        )


def _differences(ax: Any, view: SceneView, channel: Channel, against: str) -> None:
    bands = [band for band in view.bands(against) if band.channel == channel.name]
    for limit, until in sorted(
        {(band.limit, band.until) for band in bands if band.kind == "peak"}, reverse=True
    ):
        ax.fill_between([0.0, until], -limit, limit, color=TOLERANCE, alpha=0.13, linewidth=0)
    for limit, until in sorted({(band.limit, band.until) for band in bands if band.kind == "rms"}):
        ax.plot([until, until], [0.0, limit], color=TOLERANCE, linewidth=0.8, zorder=3.0)
        ax.plot(until, limit, **LIMIT, zorder=3.0)
    for band in {
        band.model: band
        for band in sorted(bands, key=lambda band: band.until)
        if band.kind == "rms"
    }.values():
        running = view.running_rms(band)
        ax.plot(
            view.t[: len(running)],
            running,
            color=view.looks[band.model].light,
            linewidth=1.5,
            alpha=0.8,
        )
    fine = largest = fineness(view, channel, bands)
    for model, difference in view.differences(channel.name, against).items():
        largest = max(largest, _largest(difference))
        ax.plot(view.t, difference, **view.looks[model].line | {"linewidth": 0.6})
    ax.axhline(0.0, color="#888888", linewidth=0.4, zorder=1)
    ax.set_yscale("asinh", linear_width=fine)
    # Zero, and plus and minus the top power of ten and one at most two decades below it.
    top = math.floor(math.log10(max(largest, fine)))
    low = max(math.ceil(math.log10(fine)), top - 2)
    ticks = {0.0: "0"}
    for power in {min(low, top), top}:
        words = f"10{str(power).translate(SUPERSCRIPTS)}"
        ticks |= {10.0**power: words, -(10.0**power): f"−{words}"}
    ax.set(
        yticks=list(ticks),
        yticklabels=list(ticks.values()),
        ylim=(-1.3 * largest, 1.3 * largest),
    )
    ax.minorticks_off()
    ax.set_ylabel("difference", color="#555555", fontsize=6.5)
    ax.tick_params(axis="y", labelsize=5.5, colors="#555555")


def _tracks(ax: Any, view: SceneView) -> None:
    shown = [model for model in view.looks if model in view.histories]
    for row, model in enumerate(shown):
        for kind, marker, size in TRACKED:
            times = [e.t for e in figures.WindowedHistory(view.histories[model]).events(kind)]
            ax.plot(
                times,
                [row] * len(times),
                marker=marker,
                markersize=size,
                markeredgewidth=0.5,
                color=view.looks[model].light,
                linestyle="",
            )
    ax.set_yticks(
        range(len(shown)), [_short(view.looks[model].label) for model in shown], fontsize=6
    )
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.text(
        0.998,
        0.97,
        "impacts: | floor, ◆ wall",
        transform=ax.transAxes,
        ha="right",
        va="top",
        fontsize=6,
        color="#555555",
    )


def _short(label: str, most: int = 17) -> str:
    return label if len(label) <= most else label[: most - 1] + "…"


def _shades(view: SceneView, against: str | None, beyond: bool) -> list[Any]:
    """Legend entries for what the figure has besides the models."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    bands = view.bands(against) if against else ()
    shown = {channel.name for channel in PAPER_CHANNELS}
    kinds = {band.kind for band in bands if band.channel in shown}
    entries: list[tuple[bool, Any]] = [
        ("peak" in kinds, Patch(color=TOLERANCE, alpha=0.25, label="tolerance")),
        ("rms" in kinds, Line2D([], [], color="#555555", linewidth=1.8, label="RMS so far")),
        ("rms" in kinds, Line2D([], [], **LIMIT | {"linestyle": "", "label": "its limit"})),
        (beyond, Patch(color="#000000", alpha=0.08, label="beyond the horizon")),
    ]
    return [handle for shown, handle in entries if shown]


@dataclass(frozen=True)
class EnsembleView(View):
    """One ensemble of a finished run, ready to be shown."""

    record: results.EnsembleRecord
    #: Its figures are for a paper, too.
    printed: ClassVar[bool] = True

    @cached_property
    def references(self) -> tuple[str, ...]:
        """Models that others are held against here; the run's own reference first.

        Where none of them finished, the first that did.
        """
        named = dict.fromkeys(
            [
                self.run.reference,
                self.run.model_form,
                *(figure.against for cell in self.cells for figure in cell.figures),
            ]
        )
        finished = tuple(self.record.finished)
        return tuple(model for model in named if model in finished) or finished[:1]

    @cached_property
    def curves(self) -> dict[str, tuple[list[float], list[float]]]:
        """Sorted peaks of the blocks that stay, and the share of scenes up to each, by model."""
        known = {
            model: np.sort(sample.peaks[~sample.fallen & np.isfinite(sample.peaks)])
            for model, sample in self.record.finished.items()
        }
        return {
            model: (
                peaks.tolist(),
                (np.arange(1, len(peaks) + 1) / len(self.record.peaks[model])).tolist(),
            )
            for model, peaks in known.items()
        }

    @property
    def missing(self) -> dict[str, str]:
        """By model: why it is not drawn."""
        return {cell.model: cell.reason for cell in self.cells if cell.model not in self.curves}

    def page(self) -> Finding:
        """All that its page shows."""
        blocks: list[Block] = [
            Text(self.record.description, facts=self.facts()),
            Text(
                "Rocking is chaotic: what one block does in one motion cannot be predicted beyond"
                " a few impacts, by any model. How many of many blocks rock how far, and how many"
                " fall, can. So here models are held against each other by their distributions,"
                " not by histories."
            ),
            Table(
                "verdicts",
                [Column("model", kind="model"), text("verdict"), text("outcome")],
                [
                    [cell.model, verdict_mark(cell), cell.outcome or cell.reason]
                    for cell in self.cells
                ],
            ),
            *([self.distributions()] if self.curves else []),
            *([self.by_scene()] if len(self.curves) > 1 else []),
            *(table for against in self.references if (table := self.agreement(against)).rows),
            Text(
                "Intervals are for 95 % confidence: Wilson's for shares, Student's for the bias"
                " (mean of ln ratio of the peaks where both rock and neither falls), chi-squared"
                " for the scatter (its standard deviation). p is the probability of such a"
                " distance between two samples of one distribution."
            ),
            replace(checks_table(self.cells), title="Checks"),
            runs_table(self.run, self.cells),
            self.peaks(),
        ]
        return Finding(
            "ensemble",
            self.name,
            "",
            [
                replace(one, name=f"data/{self.slug}~{one.name}".rstrip("~"))
                if isinstance(one, Table)
                else one
                for one in blocks
            ],
        )

    def facts(self) -> list[tuple[str, str]]:
        """The ensemble in a few words: what is drawn, and the scene that it is drawn from."""
        drawn = motions.Ensemble(**self.record.definition)
        pulse, noise, motion = drawn.pulse, drawn.noise, drawn.pulse or drawn.noise
        facts = {
            "scenes": f"{drawn.count}, seed {drawn.seed}",
            "friction": _distribution(drawn.friction),
            "gap (m)": _distribution(drawn.gap),
            "pulse": pulse and "Ricker, of random phase",
            "its period (s)": pulse and _distribution(pulse.period),
            "noise": noise
            and f"Kanai-Tajimi, {number(noise.frequency)} Hz, damping {number(noise.damping)},"
            f" {number(noise.strong)} s",
            "its peak (m/s²)": motion and _distribution(motion.amplitude),
        }
        known = [(name, said) for name, said in facts.items() if said]
        if "excitation" in drawn.scene:
            return known
        instead = {"floor": drawn.friction, "wall": drawn.gap, "base": motion}
        base = Scene(**{"name": self.name, **drawn.scene})
        return known + [fact for fact in scene_facts(base) if not instead.get(fact[0])]

    def distributions(self) -> Plot:
        """Share of scenes with a peak below each value, by model; difference from the reference.

        Shaded: where the Kolmogorov-Smirnov test finds no difference at its level.
        """
        from scipy.stats import kstwobign

        grid = np.unique(
            np.concatenate([[0.0, MOST * 1.05], *(x for x, _ in self.curves.values())])
        )
        counts = {model: len(peaks) for model, peaks in self.record.peaks.items()}
        shares = {
            model: np.searchsorted(peaks, grid, side="right") / counts[model]
            for model, (peaks, _) in self.curves.items()
        }
        known, reference = self.looks, self.references[0]
        same = float(kstwobign.ppf(ensemble.CONFIDENCE)) * math.sqrt(2.0 / min(counts.values()))
        ends = (0.0, float(grid[-1]))
        band = Series(
            f"no difference at the {ensemble.CONFIDENCE:.0%} level",
            ends,
            (0.0,),
            (-same, -same),
            (same, same),
            style="level",
        )

        def steps(values: dict[str, Any]) -> list[Series]:
            return [
                Series(known[m].label, grid.tolist(), list(share), look=known[m].key, style="step")
                for m, share in values.items()
            ]

        others = {m: share - shares[reference] for m, share in shares.items() if m != reference}
        return Plot(
            self.slug,
            f"Peak rotation in {max(counts.values())} scenes",
            panels=[
                Panel("share of scenes below the peak", steps(shares)),
                Panel(f"difference from {known[reference].label}", [*steps(others), band]),
            ],
            x=Axis(f"{PEAK} of blocks that stay", limits=(0.0, min(ends[1], MOST * 1.5))),
            note="An overturned block lies beyond every peak, so a curve ends at the share that"
            " stays. The largest difference of two curves is their Kolmogorov-Smirnov distance;"
            " within the shaded band the test sees no difference.",
            shared=False,
        )

    def by_scene(self) -> Plot:
        """Peak rotation of each scene by each model against the reference's."""
        reference, known, panels = self.references[0], self.looks, []
        for model in [one for one in self.curves if one != reference]:
            pair = ensemble.Samples(self.record.samples[reference], self.record.samples[model])
            x, y = (
                np.where(one.fallen, FALLEN, np.clip(one.peaks, LOWEST, MOST * 1.6))
                for one in (pair.reference, pair.candidate)
            )
            odd = pair.reference.fallen != pair.candidate.fallen
            same, apart = ((x[rows].tolist(), y[rows].tolist()) for rows in (~odd, odd))
            panels.append(
                Panel(
                    known[model].label,
                    [
                        Series("", (LOWEST, MOST), (LOWEST, MOST), style="thin"),
                        Series("", *same, look=known[model].key, style="points"),
                        Series("one falls", *apart, look=known[model].key, style="cross"),
                    ],
                )
            )
        ticks = {LOWEST: f"{LOWEST:g}", 0.01: "0.01", 0.1: "0.1", MOST: "1", FALLEN: "fell"}
        x_axis, y_axis = (
            Axis(f"{PEAK} by {of}", log=True, limits=(LOWEST * 0.8, FALLEN * 1.5), ticks=ticks)
            for of in (known[reference].label, "the model")
        )
        return Plot(
            f"{self.slug}~scenes",
            "Scene by scene",
            panels=panels,
            x=x_axis,
            y=y_axis,
            note="A point a scene. Dots off the diagonal: chaos and numerical error; crosses: one"
            " falls, the other stays.",
        )

    def agreement(self, against: str) -> Table:
        """Who falls in how many scenes beside a reference, and the statistics of the peaks."""
        rows = []
        for cell in self.cells:
            figures = {f.measure: f for f in cell.figures if f.against == against}
            if figures:
                theirs, own = (
                    self.record.samples[against].fallen,
                    self.record.samples[cell.model].fallen,
                )
                counts = (theirs & own, theirs & ~own, ~theirs & own, ~theirs & ~own)
                rows.append(
                    [
                        cell.model,
                        *(int(np.sum(count)) for count in counts),
                        *(
                            Mark(figures[name].value, more=figures[name].note.replace("], ", "]\n"))
                            for name in STATISTICS_SHOWN
                        ),
                    ]
                )
        return Table(
            f"against-{slugs_of([against])[against]}",
            [
                Column("model", kind="model"),
                Column("both fall"),
                Column("only the reference falls"),
                Column("only the model falls"),
                Column("both stay"),
                *(
                    Column(name, title, help=measures.STATISTICS[name].formula)
                    for name, title in STATISTICS_SHOWN.items()
                ),
            ],
            rows,
            f"Agreement with {self.looks[against].label}",
        )

    def peaks(self) -> Table:
        """Peak rotation (alpha) and outcome of every scene by every model."""
        values = {
            f"{what} {model}": column
            for model, sample in self.record.samples.items()
            for what, column in (
                ("peak_rotation_alpha", sample.peaks.tolist()),
                ("outcome", sample.outcomes),
            )
        }
        return Table(
            "",
            list(map(Column, ["scene", *values])),
            [[n, *row] for n, row in enumerate(zip(*values.values(), strict=True), 1)],
            on="file",
        )


def _distribution(of: motions.Distribution | None) -> str:
    match of:
        case motions.Distribution(uniform=(low, high)):
            return f"uniform {number(low)} to {number(high)}"
        case motions.Distribution(lognormal=(median, sigma)):
            return f"lognormal, median {number(median)}, σ {number(sigma)}"
    return ""
