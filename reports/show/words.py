"""Readable numbers, units and facts, and the escaped HTML tables that notebooks show."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import datetime
from html import escape
from itertools import chain, repeat, takewhile

import numpy as np

from rockcheck.ebm.spectrum import LEFT, RIGHT, Spectrum
from rockcheck.reports.style import SUPERSCRIPTS
from rockcheck.scenes import (
    Cosine,
    Excitation,
    History,
    Pulse,
    Record,
    Ricker,
    Scene,
    Sine,
    errors,
)
from rockcheck.validation import Discrepancy
from rockcheck.validation.discrepancy import figures, impacts


def number(value: float | None, digits: int = 3) -> str:
    """A number with `digits` significant digits and a true minus sign; "–" for None.

    Very large and very small numbers have a power of ten: 1.2·10⁻⁵.
    """
    return "–" if value is None else readable(f"{value:.{digits}g}").replace("-", "−")


def html_table(caption: str, rows: Iterable[Sequence[object]], head: Sequence[object] = ()) -> str:
    """A small HTML table; all text is escaped. Without `head` the first column names the rows."""
    first = "td" if head else 'th scope="row"'
    tagged = [
        *((row, repeat('th scope="col"')) for row in [head] if row),
        *((row, chain([first], repeat("td"))) for row in rows),
    ]
    lines = (
        "".join(
            f'<{tag} style="text-align: left">{escape(errors.inert(str(cell)))}</{tag[:2]}>'
            for cell, tag in zip(row, tags, strict=False)
        )
        for row, tags in tagged
    )
    return (
        f'<table><caption style="text-align: left"><b>{escape(errors.inert(caption))}</b></caption>'
        f"{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
    )


def excitation_words(excitation: Excitation) -> str:
    """An excitation in a few words."""
    match excitation:
        case Record(source=source, scale=scale, peak=peak):
            return f"{source} × {number(scale)}, peak {number(peak)} g"
        case Sine() | Cosine():
            return (
                f"{excitation.kind}, {number(excitation.amplitude)} m/s²,"
                f" period {number(excitation.period)} s, {excitation.cycles} cycles"
            )
        case Ricker(amplitude=amplitude, period=period, symmetric=symmetric):
            kind = "symmetric" if symmetric else "antisymmetric"
            return f"{kind} Ricker pulse, {number(amplitude)} m/s², period {number(period)} s"
        case Pulse(amplitude=amplitude, period=period):
            return f"{excitation.kind} pulse, {number(amplitude)} m/s², period {number(period)} s"
    return "at rest"


def scene_facts(scene: Scene) -> list[tuple[str, str]]:
    """(label, text) of a scene's block, floor, walls, excitation and duration."""
    block, tilt = scene.block, scene.initial_rotation
    place = pivots = ""
    if not block.homogeneous:
        (x, z), left, right = block.offset, block.pivot("left"), block.pivot("right")
        place = (
            f"{number(abs(x))} m {'right' if x >= 0.0 else 'left'} of the box's,"
            f" {number(abs(z))} m {'above' if z >= 0.0 else 'below'} it; radius of gyration"
            f" {number(math.sqrt(block.gyration_squared))} m"
        )
        pivots = f"left α = {number(left.alpha)} rad, right α = {number(right.alpha)} rad"
    g = (
        ""
        if scene.gravity == figures.STANDARD_GRAVITY
        else f", gravity {number(scene.gravity)} m/s²"
    )
    mu, mu_s, e = scene.floor.friction, scene.floor.mu_s, scene.floor.restitution
    floor = f"μ {number(mu)}{f' (static {number(mu_s)})' if mu_s != mu else ''}"
    floor += f", restitution {number(e)}" if e else ""
    walls = ", ".join(
        f"{wall.side}, gap {number(1e3 * wall.gap)} mm, restitution {number(wall.restitution)}"
        for wall in scene.walls
    )
    starts = [
        f"{what} {number(value)} {of}"
        for what, value, of in (
            ("θ =", tilt / block.alpha, "α"),
            ("velocity", scene.initial_velocity, "m/s"),
            ("angular velocity", scene.initial_angular_velocity, "rad/s"),
            ("height", scene.initial_height, "m"),
        )
        if value
    ]
    facts = [
        (
            "block",
            f"{number(2 * block.half_width, 4)} m × {number(2 * block.half_height, 4)} m, α ="
            f" {number(block.alpha)} rad",
        ),
        ("mass's centre", place),
        ("pivots", pivots),
        ("p", f"{number(scene.frequency_parameter)} rad/s{g}"),
        ("floor", floor),
        ("wall" if len(scene.walls) < 2 else "walls", walls or "none"),
        ("base", excitation_words(scene.excitation)),
        ("vertical", excitation_words(scene.vertical) if scene.vertical.kind != "rest" else ""),
        (
            "duration",
            f"{number(scene.duration)} s, a row each {number(1e3 * scene.output_step)} ms",
        ),
        ("starts at", ", ".join(starts)),
    ]
    return [fact for fact in facts if fact[1]]


def history_html(history: History) -> str:
    """The table of a history in a notebook.

    Outcome, peak, impacts, time, settings, cost and notes.
    """
    time, size, cost = history.channels["t"], history.alpha or 1.0, history.cost
    peak = f"{number(history.peak_rotation / size)} {'α' if history.alpha else 'rad'}"
    whole = figures.WindowedHistory(history)
    kinds = Counter(event.kind for event in whole.events(*impacts.IMPACTS))
    facts = {
        "outcome": history.fate,
        "peak rotation": peak if history.overturned_at is None else "",
        "impacts": ""
        if whole.silent
        else f"{kinds['floor impact']} on the floor, {kinds['wall impact']} on walls",
        "time": f"{number(float(time[0]))} to {number(float(time[-1]), 4)} s, {len(time)} rows",
        "settings": ", ".join(f"{key} {value}" for key, value in history.settings.items()),
        "cost": f"{number(1e3 * cost.wall_seconds)} ms, {cost.steps} steps" if cost.steps else "",
    }
    return html_table(
        f"{history.name}, {history.model}",
        [
            *((name, said) for name, said in facts.items() if said),
            *(("note", note) for note in history.notes),
        ],
    )


def discrepancy_html(found: Discrepancy) -> str:
    """The table of a comparison in a notebook."""
    caption = f"{found.candidate} against {found.reference}, {found.start:g} to {found.end:g} s"
    return html_table(
        f"{caption}; not the whole time: {found.gap}" if found.gap else caption,
        [(f.label, number(f.value), f.unit, f.note) for f in found.figures],
        ("measure", "value", "unit", ""),
    )


def spectrum_html(spectrum: Spectrum) -> str:
    """The table of a spectrum in a notebook: shares of outcomes, runs and scene."""
    falls = (float(np.mean(spectrum.outcomes == side)) for side in (LEFT, RIGHT))
    shares = (f"{number(100.0 * share)} %" for share in (spectrum.safe_area, *falls))
    facts = [*zip(("safe", "overturned left", "overturned right"), shares, strict=True)]
    facts += [
        ("nodes", f"{spectrum.outcomes.size}, from {spectrum.evaluations} runs"),
        ("undecided", str(len(spectrum.undecided))),
    ]
    # What the scene's own base motion is, and what follows from it, does not count.
    facts += takewhile(lambda fact: fact[0] != "base", scene_facts(spectrum.scene))
    return html_table(f"Overturning spectrum: {spectrum.scene.name}", facts)


_POWER = re.compile(r"(?<![\w.])([+-]?\d+(?:\.\d+)?)e([+-]?\d+)(?![\w.]\w)")
_MINUS = re.compile(r"(?<![\w.)\]-])-(?=\.?\d)")


def readable(text: str) -> str:
    """A sentence whose numbers do not break at a hyphen: −1.2·10⁻³ for -1.2e-3."""
    return _MINUS.sub(
        "−",
        _POWER.sub(
            lambda found: f"{found[1]}·10{str(int(found[2])).translate(SUPERSCRIPTS)}", text
        ),
    )


def unit(name: str) -> str:
    """A unit as printed: α for "alpha", nothing for "1"."""
    return {"alpha": "α", "1": ""}.get(name, name)


def duration(seconds: float) -> str:
    """A time as text: in s from 1 s on, else in ms."""
    return f"{seconds:.1f} s" if seconds >= 0.9995 else f"{1e3 * seconds:.3g} ms"


def moment(created: str) -> str:
    """An ISO 8601 time to the minute.

    Any other text, as a run made elsewhere may hold, is returned unchanged.
    """
    try:
        return f"{datetime.fromisoformat(created):%Y-%m-%d %H:%M %Z}"
    except ValueError:
        return created


def ratio(value: float | None) -> str:
    """A ratio followed by a multiplication sign; "–" for None."""
    if value is None:
        return "–"
    return f"{value:,.0f}×".replace(",", "\u202f") if value >= 99.5 else f"{number(value, 2)}×"


def window(figure: figures.Figure) -> str:
    """The window of a figure in words."""
    if figure.window == "horizon":
        return "to the horizon" + (
            f" ({number(figure.until)} s)" if figure.until is not None else ""
        )
    return (
        f"first {number(figure.until)} s"
        if figure.until is not None
        else f"first {figure.window}"  # of a figure that was not computed
        if figure.window
        else "whole run"
    )
