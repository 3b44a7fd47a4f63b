"""What is shown of an ensemble: the distribution of peak rotation by model, and how models agree
scene by scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rockcheck.reports.show import words as display
from rockcheck.reports.style import PAGE, figure_style, looks, save
from rockcheck.reports.words import number
from rockcheck.scenes import Scene
from rockcheck.scenes.writing import table_text
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.statistics import CONFIDENCE, SMALLEST_PEAK, Sample, Samples
from rockcheck.validation.suite.ensembles import Distribution, Ensemble
from rockcheck.validation.suite.results import Cell, EnsembleRecord, Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

#: Ends of the axes of peaks, alpha; an overturned block is drawn beyond.
LEAST, MOST = 1e-3, 1.0


@dataclass(frozen=True)
class Overturning:
    """In how many scenes both fall, only the reference, only the candidate, neither."""

    both: int
    only_reference: int
    only_candidate: int
    neither: int


@dataclass(frozen=True)
class EnsembleView:
    """One ensemble of a finished run, ready to be drawn."""

    run: Run
    record: EnsembleRecord
    slug: str
    folder: Path

    @property
    def name(self) -> str:
        """Name of the ensemble."""
        return self.record.name

    @property
    def printed(self) -> bool:
        """Whether it has figures for a paper: each has."""
        return True

    @property
    def description(self) -> str:
        """What it is, in a line."""
        return self.record.description

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The ensemble's cells, in the models' order."""
        return self.run.of_scene(self.name)

    @cached_property
    def ensemble(self) -> Ensemble:
        """How its scenes are drawn."""
        return Ensemble(**self.record.definition)

    @cached_property
    def samples(self) -> dict[str, Sample]:
        """By model: peaks (alpha, NaN where it failed) and outcomes of all scenes."""
        return {
            model: Sample(
                np.array([math.nan if peak is None else peak for peak in peaks]),
                self.record.outcomes[model],
            )
            for model, peaks in self.record.peaks.items()
        }

    @property
    def references(self) -> tuple[str, ...]:
        """Models that others are held against here; the run's own reference first."""
        named = [
            self.run.reference,
            self.run.model_form,
            *(f.against for cell in self.cells for f in cell.figures),
        ]
        return tuple(model for model in dict.fromkeys(named) if model in self.samples)

    def candidates(self, against: str) -> tuple[str, ...]:
        """Models that are held against that reference."""
        return tuple(
            cell.model
            for cell in self.cells
            if any(figure.against == against for figure in cell.figures)
        )

    def figure(self, model: str, measure: str, against: str) -> Figure:
        """One of a model's figures."""
        (cell,) = (cell for cell in self.cells if cell.model == model)
        return next(
            figure
            for figure in cell.figures
            if (figure.measure, figure.against) == (measure, against)
        )

    def overturning(self, model: str, against: str) -> Overturning:
        """The scenes by who falls in them."""
        reference, candidate = self.samples[against].fallen, self.samples[model].fallen
        counts = (
            reference & candidate,
            reference & ~candidate,
            ~reference & candidate,
            ~reference & ~candidate,
        )
        return Overturning(*(int(np.sum(count)) for count in counts))

    @property
    def facts(self) -> list[tuple[str, str]]:
        """The ensemble in a few words: what is drawn, and the scene that it is drawn from."""
        drawn = self.ensemble
        facts = [("scenes", f"{drawn.count}, seed {drawn.seed}")]
        if drawn.friction:
            facts.append(("friction", _distribution(drawn.friction)))
        if drawn.gap:
            facts.append(("gap (m)", _distribution(drawn.gap)))
        if drawn.pulse:
            facts += [
                ("pulse", "Ricker, of random phase"),
                ("its period (s)", _distribution(drawn.pulse.period)),
            ]
            facts.append(("its peak (m/s²)", _distribution(drawn.pulse.amplitude)))
        if drawn.noise:
            noise = drawn.noise
            facts.append(
                (
                    "noise",
                    f"Kanai-Tajimi, {number(noise.frequency)} Hz, damping {number(noise.damping)},"
                    f" {number(noise.strong)} s",
                )
            )
            facts.append(("its peak (m/s²)", _distribution(noise.amplitude)))
        moved = {"friction": "floor", "gap": "wall"}
        hidden = {moved[key] for key in moved if getattr(drawn, key)} | (
            {"base"} if drawn.pulse or drawn.noise else set()
        )
        if self._base is not None:
            facts += [
                (key, words) for key, words in display.scene_facts(self._base) if key not in hidden
            ]
        return facts

    @cached_property
    def _base(self) -> Scene | None:
        return (
            Scene(**{"name": self.name, **self.ensemble.scene})
            if "excitation" not in self.ensemble.scene
            else None
        )

    def table(self) -> str:
        """Peak rotation (alpha) and outcome of every scene by every model, as CSV."""
        columns = [
            "scene",
            *(
                f"{what} {model}"
                for model in self.samples
                for what in ("peak_rotation_alpha", "outcome")
            ),
        ]
        values = [
            column
            for sample in self.samples.values()
            for column in (sample.peaks.tolist(), sample.outcomes)
        ]
        return table_text(
            columns, ([n, *row] for n, row in enumerate(zip(*values, strict=True), 1))
        )


def distributions_figure(view: EnsembleView) -> Drawing:
    """The share of scenes whose peak is below each value, by model, and below it the difference
    from the reference.

    An overturned block is beyond every peak, so that a curve ends at the share that stays. Shaded:
    where the Kolmogorov-Smirnov test finds no difference at its level.
    """
    from matplotlib.figure import Figure
    from scipy.stats import kstwobign

    reference = view.references[0]
    known = looks(view.run.models)
    with figure_style():
        figure = Figure(figsize=(PAGE, 4.4))
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
        figure.subplots_adjust(0.085, 0.1, 0.985, 0.9, hspace=0.09)
        grid = np.unique(
            np.concatenate(
                [[0.0], *(_standing(sample) for sample in view.samples.values()), [MOST * 1.05]]
            )
        )
        shares = {
            model: np.searchsorted(_standing(sample), grid, side="right") / len(sample.peaks)
            for model, sample in view.samples.items()
        }
        for model, share in shares.items():
            style = known[model].line | (
                {"linewidth": 1.8, "zorder": 1.9} if model == reference else {"linewidth": 1.0}
            )
            above.step(grid, share, where="post", **style)
            if model != reference:
                below.step(
                    grid,
                    share - shares[reference],
                    where="post",
                    **known[model].line | {"linewidth": 0.8},
                )
        counts = [len(sample.peaks) for sample in view.samples.values()]
        same = float(kstwobign.ppf(CONFIDENCE)) * math.sqrt(2.0 / min(counts))
        band = below.axhspan(-same, same, color="#009168", alpha=0.1, linewidth=0)
        below.axhline(0.0, color="#888888", linewidth=0.5)
        above.set_ylim(0.0, 1.0)
        above.set_ylabel("share of scenes\nbelow the peak")
        below.set_ylabel("difference")
        below.set_xlabel("peak rotation |θ|/α of blocks that stay; the rest has overturned")
        below.set_xlim(
            0.0, min(float(grid[-1]), MOST * 1.5)
        )  # beyond: blocks that were still falling at the end
        below.legend([band], [f"no difference at the {CONFIDENCE:.0%} level"], loc="lower right")
        title = f"{view.name}: peak rotation in {max(counts)} scenes"
        figure.text(0.012, 0.985, title, va="top", weight="bold", fontsize=8.5)
        figure.legend(
            *above.get_legend_handles_labels(),
            ncols=6,
            loc="upper left",
            bbox_to_anchor=(0.0, 0.965),
            borderaxespad=0.3,
        )
    return figure


def peaks_figure(view: EnsembleView) -> Drawing:
    """Each scene as a point: its peak by a candidate against that by the reference; overturned
    blocks in the margins."""
    from matplotlib.figure import Figure

    reference = view.references[0]
    candidates = [model for model in view.samples if model != reference]
    known = looks(view.run.models)
    columns = min(4, len(candidates))
    rows = -(-len(candidates) // columns)
    with figure_style():
        height = 0.75 + 1.85 * rows
        figure = Figure(figsize=(PAGE, height))
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        figure.subplots_adjust(
            0.08, 0.42 / height, 0.99, 1.0 - 0.45 / height, wspace=0.12, hspace=0.3
        )
        for ax, model in zip(panels, candidates, strict=False):
            _cloud(ax, Samples(view.samples[reference], view.samples[model]), known[model].light)
            ax.set_title(known[model].label)
        for ax in panels[len(candidates) :]:
            ax.set_visible(False)
        figure.supxlabel(f"peak |θ|/α by {known[reference].label}", fontsize=7.5, y=0.05 / height)
        figure.supylabel("peak |θ|/α by the model", fontsize=7.5, x=0.005)
        figure.text(
            0.012,
            1.0 - 0.06 / height,
            f"{view.name}: scene by scene",
            va="top",
            weight="bold",
            fontsize=8.5,
        )
    return figure


def thumbnail(view: EnsembleView) -> Drawing:
    """The distributions, small and without words."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(3.4, 0.9))
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        for model, look in looks(view.run.models).items():
            if model in view.samples:
                standing = _standing(view.samples[model])
                shares = np.arange(1, len(standing) + 1) / len(view.samples[model].peaks)
                ax.step(standing, shares, where="post", color=look.light, linewidth=0.7)
        ax.set_ylim(0.0, 1.0)
        ax.set_axis_off()
    return figure


def write_ensemble_figures(view: EnsembleView, folder: Path) -> None:
    """Write the figures of an ensemble into `folder`: distributions, scene by scene, thumbnail."""
    save(thumbnail(view), folder / f"{view.slug}-small", ["svg"])
    save(distributions_figure(view), folder / f"{view.slug}")
    if len(view.samples) > 1:
        save(peaks_figure(view), folder / f"{view.slug}-scenes")


def _standing(sample: Sample) -> np.ndarray:
    """The peaks of the scenes in which the block stays, in order."""
    return np.sort(sample.peaks[~sample.fallen & np.isfinite(sample.peaks)])


def _cloud(ax: Axes, samples: Samples, color: str) -> None:
    fallen = MOST * 3.2
    x, y = (
        np.where(s.fallen, fallen, np.clip(s.peaks, LEAST, MOST * 1.6))
        for s in (samples.reference, samples.candidate)
    )
    apart = samples.reference.fallen != samples.candidate.fallen
    ax.plot([LEAST, MOST], [LEAST, MOST], color="#999999", linewidth=0.6, zorder=1)
    ax.plot(x[~apart], y[~apart], ".", color=color, markersize=2.0, markeredgewidth=0, alpha=0.7)
    ax.plot(x[apart], y[apart], "x", color="#c00000", markersize=3.0, markeredgewidth=0.7)
    for line in (ax.axvline, ax.axhline):
        line(MOST * 1.8, color="#bbbbbb", linewidth=0.6, linestyle=":")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ticks = {LEAST: f"{LEAST:g}", 0.01: "0.01", 0.1: "0.1", MOST: "1", fallen: "fell"}
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_ticks(list(ticks), list(ticks.values()), fontsize=5.5)
        axis.set_ticks([], minor=True)
    ax.set_xlim(LEAST * 0.8, fallen * 1.5)
    ax.set_ylim(LEAST * 0.8, fallen * 1.5)
    close = samples.log_ratios()
    if len(close) > 1:
        words = (
            f"ln ratio {np.mean(close):+.2g} ± {np.std(close, ddof=1):.2g}\n"
            f"{len(close)} above {SMALLEST_PEAK:g}"
        )
        ax.text(
            0.97,
            0.03,
            words,
            transform=ax.transAxes,
            ha="right",
            va="bottom",
            fontsize=5.5,
            color="#555555",
        )


def _distribution(of: Distribution) -> str:
    if of.uniform is not None:
        return f"uniform {number(of.uniform[0])} to {number(of.uniform[1])}"
    assert of.lognormal is not None
    return f"lognormal, median {number(of.lognormal[0])}, σ {number(of.lognormal[1])}"


def ensemble_views(run: Run, folder: Path, slugs: Mapping[str, str]) -> list[EnsembleView]:
    """The views of all ensembles of a run."""
    return [EnsembleView(run, record, slugs[record.name], folder) for record in run.ensembles]
