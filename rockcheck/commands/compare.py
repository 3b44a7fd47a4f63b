"""`rockcheck compare`: any two histories, or two finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from rockcheck.commands import (
    PlotOption,
    answer,
    check_picture,
    console,
    save_picture,
    scene_names,
    tell_notes,
    told,
)
from rockcheck.scenes import load_scene
from rockcheck.validation.discrepancy.compare import Discrepancy, compare
from rockcheck.validation.discrepancy.figures import value_words
from rockcheck.validation.discrepancy.measured import read_measured, shifted, time_shift
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.discrepancy.motion import motion_of
from rockcheck.validation.suite.changes import Change, changes, judged_otherwise
from rockcheck.validation.suite.results import Run

#: So many figures that moved are listed without --all.
SHOWN = 20


def run(
    reference: Annotated[
        Path,
        typer.Argument(
            metavar="A", help="History of the reference, CSV; or a finished run's folder."
        ),
    ],
    candidate: Annotated[
        Path,
        typer.Argument(metavar="B", help="History of the candidate, CSV; or a later run's folder."),
    ],
    offset: Annotated[
        float,
        typer.Option(
            "--offset", help="Added to the candidate's times, s, to align a measured history."
        ),
    ] = 0.0,
    align: Annotated[
        bool,
        typer.Option(
            "--align", help="Shift the candidate in time to where the rotations agree best."
        ),
    ] = False,
    until: Annotated[
        float | None,
        typer.Option("--until", help="End of the window, s (default: the whole common time)."),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene", help="Scene of both: its block and gravity.", autocompletion=scene_names
        ),
    ] = None,
    plot: PlotOption = None,
    everything: Annotated[
        bool, typer.Option("--all", help=f"Of two runs: all figures that moved, not only {SHOWN}.")
    ] = False,
) -> None:
    """Compare two histories, or two finished runs.

    Two folders: what changed between runs of a suite, or of `conformance`, exit 1 where a verdict
    or a cell changed.

    Histories that rockcheck wrote, or any CSV with columns t_s and theta_rad (or theta_deg,
    time_ms, x_mm, ...). --plot draws both rotations and their difference.
    """
    if reference.is_dir() or reference.suffix == ".json":
        from rockcheck.validation.studies.conformance import study

        if study.wrote(reference):
            told(study.changes(reference, candidate))
    if reference.is_dir() or candidate.is_dir():
        two_runs(reference, candidate, everything=everything)
        return
    check_picture(plot)
    what = load_scene(scene) if scene else None
    given, other = read_measured(reference), read_measured(candidate, offset=offset)
    shift = time_shift(given, other) if align else 0.0
    found = compare(given, shifted(other, shift), until=until, scene=what)
    out = console()
    out.print(headline(found), style="bold")
    motions = {
        role: motion_of(history, what)
        for role, history in (("reference", given), ("candidate", other))
    }
    for role, motion in motions.items():
        if words := motion.words():
            out.print(f"{role}: {', '.join(words)}", soft_wrap=True)
    table = Table(box=None, pad_edge=False)
    for name in ("measure", "value", "unit", ""):
        table.add_column(name, justify="right" if name == "value" else "left")
    for figure in found.figures:
        yes_no = DIFFERENCES[figure.measure].yes_no
        table.add_row(
            figure.label,
            value_words(figure.value, yes_no=yes_no),
            "" if yes_no else figure.unit,
            figure.note,
        )
    out.print(f"{found.candidate} against {found.reference}, {found.start:g} to {found.end:g} s")
    out.print(table)
    if align:
        out.print(f"the candidate is shifted by {shift:+.4g} s")
    if found.gap:
        out.print(f"not the whole time: {found.gap}")
    for role, history in (("the reference", given), ("the candidate", other)):
        tell_notes(history, role)
    if plot is not None:
        save_picture(found.plot(), plot)
    answer(
        {
            "reference": found.reference,
            "candidate": found.candidate,
            "start": found.start,
            "end": found.end,
            "shift": shift,
            "gap": found.gap,
            "headline": headline(found),
            "motion": {role: motion.model_dump() for role, motion in motions.items()},
            "notes": {"reference": given.notes, "candidate": other.notes},
            "figures": [
                {"measure": f.measure, "value": f.value, "unit": f.unit, "note": f.note}
                for f in found.figures
            ],
        }
    )


def headline(found: Discrepancy) -> str:
    """The comparison in one sentence: whether the outcomes agree, and how far the rotations are
    apart."""
    assert found.histories is not None
    reference, candidate = (history.fate for history in found.histories)
    same = found["outcome_agrees"] == 1.0
    fate = (
        f"same outcome, {candidate}"
        if same
        else f"outcomes differ, {candidate} against {reference}"
    )
    rms = found.figure("theta_rms")
    apart = "" if rms.value is None else f"; rotations {rms.value:.3g} {rms.unit} apart (RMS)"
    return f"{fate}{apart}"


def two_runs(before: Path, after: Path, *, everything: bool) -> None:
    """What changed between two finished runs of a suite; exit 1 where a verdict or a cell
    changed."""
    old, new = Run.load(before), Run.load(after)
    found = changes(old, new)
    versions = {
        name: (old.versions.get(name), new.versions.get(name))
        for name in sorted({*old.versions, *new.versions})
    }
    versions = {name: pair for name, pair in versions.items() if pair[0] != pair[1]}
    screen = console()
    counts = {
        what: sum(change.what == what for change in found)
        for what in ("verdict", "cell", "outcome", "figure")
    }
    words = ", ".join(
        f"{count} {what}{'s' if count > 1 else ''}" for what, count in counts.items() if count
    )
    screen.print(
        f"{old.suite}: {f'{words} changed' if words else 'nothing changed'}",
        style="bold",
        soft_wrap=True,
    )
    for name, (was, now) in versions.items():
        screen.print(f"{name} {was or 'absent'} -> {now or 'absent'}")
    shown = (
        found
        if everything
        else [change for change in found if change.what != "figure"] + _figures(found)[:SHOWN]
    )
    if shown:
        screen.print(_table(shown))
    if len(found) > len(shown):
        screen.print(f"and {len(found) - len(shown)} more figures: --all")
    code = int(judged_otherwise(found))
    answer(
        {
            "suite": old.suite,
            "verdict": [old.words, new.words],
            "exit_code": code,
            "versions": versions,
            "changes": [change.model_dump() for change in found],
        }
    )
    raise typer.Exit(code)


def _figures(found: list[Change]) -> list[Change]:
    return [change for change in found if change.what == "figure"]


def _table(found: list[Change]) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("scene", "model", "what", "before", "after"):
        table.add_column(name, overflow="fold")
    for change in found:
        values = (
            f"{value:.6g}" if isinstance(value, float) else value or "-"
            for value in (change.before, change.after)
        )
        table.add_row(
            change.scene or "the run", change.model, f"{change.what} {change.name}".strip(), *values
        )
    return table
