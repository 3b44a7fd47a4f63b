"""Figures of scenes, histories, comparisons, spectra and recordings, as `.plot()` returns them.

Import this module only to draw: it imports matplotlib, which takes a second.
"""

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rockcheck.ebm import Spectrum
from rockcheck.reports.block_plot import INK, SHADE, draw_block
from rockcheck.reports.spectrum_plots import draw_spectrum
from rockcheck.reports.style import SPARE, looks
from rockcheck.scenes import History, Scene
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, Recording, intensity
from rockcheck.validation import Discrepancy, criteria
from rockcheck.validation.discrepancy import figures

ACCENT = "#0072b2"
#: Limit of the rotation axis where a block overturns, either way, in alpha.
FALLEN = 1.3
#: Marker of each kind of event, in the order of their tracks from the top.
TRACKS = {"wall impact": "v", "floor impact": "^", "slip": "_", "landing": "x", "lift-off": "+"}


class NotebookFigure(Figure):
    """A matplotlib figure that a notebook shows as PNG, without a display.

    It is made without pyplot, which would hold every figure in memory.
    """

    def _repr_png_(self) -> bytes:
        png = io.BytesIO()
        self.savefig(png, format="png", dpi=110)
        return png.getvalue()


def scene_figure(scene: Scene) -> Figure:
    """Sketch of the block, its floor and walls, and the acceleration of the base over time."""
    figure = NotebookFigure(figsize=(7.0, 3.0), layout="constrained")
    sketch, base = figure.subplots(1, 2, width_ratios=(1, 2))
    draw_block(sketch, scene)
    time = np.unique(  # no peak falls between them
        np.concatenate(
            [
                np.linspace(0.0, scene.duration, 2001),
                *(
                    np.clip(one.time_step * np.arange(len(one.samples)), 0.0, scene.duration)
                    for one in (
                        criteria.sampled(motion, scene.duration)
                        for motion in (scene.excitation, scene.vertical)
                    )
                ),
            ]
        )
    )
    base.plot(
        time, scene.excitation.acceleration(time), color=INK, linewidth=0.8, label="horizontal"
    )
    if scene.vertical.kind != "rest":
        base.plot(
            time, scene.vertical.acceleration(time), color=ACCENT, linewidth=0.8, label="vertical"
        )
        base.legend(frameon=False)
    base.set(xlabel="t, s", ylabel="acceleration of the base, m/s²", title=scene.name)
    base.grid(color=SHADE, linewidth=0.5)
    return figure


def history_figure(history: History) -> Figure:
    """Rotation, slip of the pivot (mm) and events over time (s)."""
    figure = NotebookFigure(figsize=(7.0, 4.2), layout="constrained")
    rotation, slip, tracks = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 1))
    time = history.channels["t"]
    rotation_lines(rotation, [history], [INK])
    rotation.set_title(f"{history.name}, {history.model}: {history.fate}")
    if "slip" in history.channels:
        slip.plot(time, 1e3 * history.channels["slip"], color=INK, linewidth=0.9)
    slip.set_ylabel("slip of the\npivot, mm")
    slip.grid(color=SHADE, linewidth=0.5)
    kinds = [kind for kind in TRACKS if any(event.kind == kind for event in history.event_list)]
    for place, kind in enumerate(kinds):
        times = [event.t for event in history.event_list if event.kind == kind]
        tracks.plot(times, [place] * len(times), TRACKS[kind], color=INK, markersize=4)
    tracks.set_yticks(range(len(kinds)), kinds, fontsize="small")
    tracks.set(xlabel="t, s", ylim=(max(len(kinds), 1) - 0.5, -0.5))
    tracks.grid(axis="x", color=SHADE, linewidth=0.5)
    return figure


def rotation_lines(axes: Any, histories: list[History], colours: list[str]) -> None:
    """Draw theta of each history over time, in alpha if all have one, else in rad."""
    known = all(history.alpha is not None for history in histories)
    for history, colour in zip(histories, colours, strict=True):
        unit = (history.alpha if known else None) or 1.0
        axes.plot(
            history.channels["t"],
            history.channels["theta"] / unit,
            color=colour,
            linewidth=0.9,
            label=history.model,
        )
    # Beyond the balance point the motion is only the fall.
    if known and any(history.overturned_at is not None for history in histories):
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, -FALLEN), min(high, FALLEN))
    axes.set_ylabel("θ / α" if known else "θ, rad")
    axes.grid(color=SHADE, linewidth=0.5)


def discrepancy_figure(found: Discrepancy) -> Figure:
    """Rotation of both histories, and candidate minus reference over the compared time."""
    reference, candidate = found.histories
    style = looks([reference.model, candidate.model])
    mine, other = style[reference.model], style[candidate.model]
    other = SPARE[0] if mine is other else other
    figure = NotebookFigure(figsize=(7.0, 4.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    rotation_lines(above, [reference, candidate], [mine.light, other.light])
    above.legend(frameon=False, ncols=2)
    pair = figures.Pair(reference, candidate, None, found.end)
    below.plot(pair.time, np.diff(pair.theta, axis=0)[0], color=other.light, linewidth=0.9)
    below.set(xlabel="t, s", ylabel="difference, α" if pair.alpha else "difference, rad")
    below.grid(color=SHADE, linewidth=0.5)
    return figure


def recordings_figure(recordings: list[tuple[str, Recording]]) -> Figure:
    """Acceleration, velocity and spectral acceleration of named recordings, a row each.

    Acceleration is in g, velocity in m/s, both over time in s. Spectral acceleration, in g at
    5 % damping, is over the period in s.
    """
    figure = NotebookFigure(figsize=(9.0, 1.9 * len(recordings) + 0.4), layout="constrained")
    for (name, record), (acceleration, velocity, spectrum) in zip(
        recordings,
        figure.subplots(len(recordings), 3, squeeze=False, width_ratios=(3, 3, 2)),
        strict=True,
    ):
        time = record.time_step * np.arange(len(record.samples))
        acceleration.plot(time, record.samples / GRAVITY_OF_RECORDS, color=INK, linewidth=0.6)
        velocity.plot(time, intensity.velocity(record), color=ACCENT, linewidth=0.8)
        periods = np.geomspace(intensity.PERIODS[0], intensity.PERIODS[-1], 40)
        spectrum.plot(
            periods,
            [intensity.spectral_acceleration(record, float(period)) for period in periods],
            color=INK,
            linewidth=0.9,
        )
        acceleration.set_title(name.replace("$", "\\$"), loc="left", fontsize=8)
        for axes, label, below in (
            (acceleration, "acceleration, g", "time, s"),
            (velocity, "velocity, m/s", "time, s"),
            (spectrum, "Sa(T), 5 %, g", "period T, s"),
        ):
            axes.set_ylabel(label, fontsize=7)
            axes.set_xlabel(below, fontsize=7)
            axes.tick_params(labelsize=7)
    return figure


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """One overturning spectrum as a figure."""
    figure = NotebookFigure(figsize=(4.5, 3.6), layout="constrained")
    draw_spectrum(spectrum, figure.subplots())
    return figure
