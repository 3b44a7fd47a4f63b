"""The page of an ensemble: many scenes drawn at random, and how models agree over them.

In: an ensemble's record in a finished run. Out: blocks of a finding. Called by `site`, which writes
the page.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rockcheck.reports.show.words import number, scene_facts
from rockcheck.reports.tables import checks_table, runs_table, verdict_mark
from rockcheck.reports.view import View, slugs_of
from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy import ensemble, measures
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
