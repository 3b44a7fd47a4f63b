"""Makes the pictures of docs/gallery.md: `make gallery`, or `python docs/site_tools/gallery.py
FOLDER`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from rockcheck.cm import ContinuousModel
from rockcheck.ebm import EventBasedModel, overturning_spectrum
from rockcheck.engines import MuJoCo, PyBullet
from rockcheck.reports.show.drawing import draw_block
from rockcheck.reports.spectrum_plots import draw_spectrum
from rockcheck.reports.style import PAGE, STYLE, looks, save_as
from rockcheck.scenes import PAPER_BLOCK, Floor, History, Ricker, Scene, Wall, load_scene
from rockcheck.scenes.kinematics import pivot_height

FOLDER = Path(__file__).parents[1] / "images" / "gallery"


def bookcase(gap: float | None = 0.053, **change: object) -> Scene:
    """The paper's block, beside a left wall unless `gap` is None."""
    walls = () if gap is None else (Wall(side="left", gap=gap, restitution=0.5),)
    return Scene(
        name="block beside a wall",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        walls=walls,
        excitation=Ricker(amplitude=6.0, period=0.75),
        duration=4.0,
    ).replace(**change)


def scene() -> Figure:
    """A scene shows itself."""
    return bookcase().plot()


def history() -> Figure:
    """A history shows itself: El Centro beside a wall."""
    return EventBasedModel(pivot="unilateral").simulate(load_scene("fig5a")).plot()


def models(scene: Scene) -> list[History]:
    """A scene by each model, the paper's first, the unilateral one second."""
    players = (
        EventBasedModel(),
        EventBasedModel(pivot="unilateral"),
        ContinuousModel(),
        MuJoCo(time_step=1e-4),
        PyBullet(time_step=1e-4),
    )
    return [player.simulate(scene) for player in players]


def front_scene() -> Scene:
    """A pulse after which the block falls, if it may not hop."""
    return bookcase(
        floor=Floor(friction=0.5), excitation=Ricker(amplitude=5.0, period=0.9), duration=6.0
    )


def front() -> Figure:
    """The project in one picture: block and wall, the rotation by each model, and its distance from
    the unilateral one so far."""
    shaken = front_scene()
    found = models(shaken)
    reference, alpha = found[1], shaken.block.alpha
    figure = Figure(figsize=(PAGE, 3.3), layout="constrained")
    axes = figure.subplot_mosaic(
        [["place", "rotation"], ["place", "difference"]], width_ratios=(1, 2.6)
    )
    place, rotation, difference = axes["place"], axes["rotation"], axes["difference"]
    draw_block(place, shaken.replace(initial_rotation=float(reference.channels["theta"].min())))
    place.set(xlim=(-1.0, 1.4), ylim=(-0.3, 3.6))
    place.set_axis_off()
    for one, look in zip(found, looks(one.model for one in found).values(), strict=True):
        t, theta = one.channels["t"], one.channels["theta"] / alpha
        rotation.plot(t, theta, **look.line)
        if one is not reference:
            off = np.abs(theta - reference.channels["theta"][: len(theta)] / alpha)
            difference.plot(t, np.maximum.accumulate(off), **look.line)
    rotation.set(ylabel="rotation θ / α", xlim=(1.0, shaken.duration), ylim=(-1.25, 0.5))
    rotation.text(3.5, -1.12, "the paper's model: no hop, it falls")
    rotation.tick_params(labelbottom=False)
    difference.set(
        xlabel="t, s",
        ylabel="largest difference\nso far, α",
        xlim=(1.0, shaken.duration),
        yscale="log",
        ylim=(1e-6, 20.0),
    )
    difference.set_yticks([1e-6, 1e-4, 1e-2, 1.0], ["10⁻⁶", "10⁻⁴", "0.01", "1"])
    difference.minorticks_off()
    difference.text(3.1, 1.5, "model form", rotation=14)
    difference.text(4.6, 1e-2, "numerical error")
    figure.legend(*rotation.get_legend_handles_labels(), loc="outside upper left", ncols=5)
    return figure


def hop() -> Figure:
    """Where the floor can only push, the block hops after a hit; the paper's model excludes it."""
    block, found = (
        bookcase().block,
        models(bookcase(duration=2.6, output_step=0.001)),
    )  # just before and after the first hit
    figure = Figure(figsize=(PAGE, 3.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for one, look in zip(found, looks(one.model for one in found).values(), strict=True):
        t, theta = one.channels["t"], one.channels["theta"]
        above.plot(t, theta / block.alpha, **look.line)
        below.plot(t, 1e3 * pivot_height(block, one.channels["y"], theta), **look.line)
    hit = next(event.t for event in found[1].event_list if event.kind == "wall impact")
    above.set(
        ylabel="θ / α",
        title="Beside a wall: rotation, and height of the pivot above the floor",
        xlim=(hit - 0.2, hit + 0.6),
    )
    below.set(xlabel="t, s", ylabel="height of the pivot, mm")
    above.legend(ncols=3)
    return figure


def cases() -> Figure:
    """The scenes that are not the paper's, by the reference; dashed: what the page sets beside
    each."""
    rack, bookcase, statue, vial, boulder = (
        load_scene(name) for name in ("rack", "bookcase", "statue", "vial", "boulder")
    )
    reference = EventBasedModel(pivot="unilateral")
    shown = (
        (rack, EventBasedModel().simulate(rack), "may not hop"),
        (bookcase, reference.simulate(bookcase.replace(walls=())), "no wall"),
        (statue, None, ""),
        (
            vial,
            reference.simulate(vial.replace(excitation=Ricker(amplitude=5.0, period=0.1))),
            "pulse of 0.1 s",
        ),
        (
            boulder,
            reference.simulate(boulder.replace(excitation=boulder.excitation.scaled(1.2))),
            "x 3",
        ),
    )
    figure = Figure(figsize=(PAGE, 7.5), layout="constrained")
    for (place, ax), (one, other, beside) in zip(
        figure.subplots(len(shown), 2, width_ratios=(1, 2.6)), shown, strict=True
    ):
        draw_block(place, one)
        place.set_xlabel("")
        place.set_title(f"{one.name}, R = {one.block.radius:.2g} m", loc="left")
        slides = one in (rack, statue)
        for history, style in ((reference.simulate(one), "-"), (other, "--")):
            if history is not None:
                values = (
                    1e3 * history.channels["slip"]
                    if slides
                    else history.channels["theta"] / one.block.alpha
                )
                ax.plot(
                    history.channels["t"],
                    values,
                    style,
                    color="#0072b2" if style == "-" else "#d55e00",
                    linewidth=0.8,
                )
        ax.set(ylabel="slip, mm" if slides else "θ / α", xlim=(0.0, min(one.duration, 32.0)))
        if not slides:
            ax.set_ylim(-1.3, 1.3)
        if beside:
            ax.set_title(f"dashed: {beside}", loc="right", fontsize=7)
    ax.set_xlabel("t, s")
    return figure


def spectra() -> Figure:
    """Overturning spectra without and with a wall (blue: safe)."""
    figure = Figure(figsize=(PAGE, 2.9), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    grid = np.linspace(0.5, 8.0, 120), np.linspace(1.0, 12.0, 120)
    for ax, gap in zip(axes, (None, 0.053), strict=True):
        draw_spectrum(overturning_spectrum(bookcase(gap), *grid), ax)
        ax.set_title("no wall" if gap is None else f"left wall at {1e3 * gap:g} mm, e = 0.5")
    axes[1].set_ylabel("")
    return figure


def chaos() -> Figure:
    """One record, its scale a thousandth more from block to block."""
    figure = Figure(figsize=(PAGE, 2.4), layout="constrained")
    ax = figure.subplots()
    shaken = load_scene("fig4a").replace(duration=20.0)
    for n in range(10):
        record = shaken.excitation.model_copy(update={"scale": 1.84 * (1.0 + 1e-3 * n)})
        one = EventBasedModel(pivot="unilateral").simulate(shaken.replace(excitation=record))
        ax.plot(
            one.channels["t"],
            one.channels["theta"] / shaken.block.alpha,
            color="#0072b2",
            alpha=0.6,
            linewidth=0.6,
        )
    ax.set(
        xlabel="t, s",
        ylabel="θ / α",
        ylim=(-1.5, 1.5),
        title="El Centro x 1.84, ten times, a thousandth more each time",
    )
    return figure


PICTURES: Iterable[Callable[[], Figure]] = (front, scene, history, hop, cases, spectra, chaos)


def make(folder: Path) -> list[Path]:
    """All pictures, as PNG; the same code makes the same bytes."""
    written = []
    for picture in PICTURES:
        with rc_context(STYLE):
            path = folder / f"{picture.__name__}.png"
            written.append(save_as(picture(), path, named=False))
    return written


if __name__ == "__main__":
    for path in make(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER):
        print(path)
