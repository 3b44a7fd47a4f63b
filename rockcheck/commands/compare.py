"""`rockcheck compare`: any two histories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from rockcheck.commands import PlotOption, answer, check_picture, console, save_picture, scene_names, tell_notes, told
from rockcheck.scenes import load_scene
from rockcheck.validation.discrepancy.compare import Discrepancy, compare
from rockcheck.validation.discrepancy.figures import value_words
from rockcheck.validation.discrepancy.measured import read_measured
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.discrepancy.repeats import shifted, time_shift


def run(
    reference: Annotated[Path, typer.Argument(help="History of the reference, CSV; or a folder.")],
    candidate: Annotated[Path, typer.Argument(help="History of the candidate, CSV; or a folder.")],
    offset: Annotated[float, typer.Option("--offset", help="Added to the candidate's times, s, to align a measured history.")] = 0.0,
    align: Annotated[bool, typer.Option("--align", help="Shift the candidate in time to where the rotations agree best.")] = False,
    until: Annotated[float | None, typer.Option("--until", help="End of the window, s (default: the whole common time).")] = None,
    scene: Annotated[str | None, typer.Option("--scene", help="Scene of both: its block and gravity.", autocompletion=scene_names)] = None,
    plot: PlotOption = None,
) -> None:
    """Compare two histories, or two conformance folders.

    Histories that rockcheck wrote, or any CSV with columns t_s and theta_rad (or theta_deg, time_ms, x_mm, ...).
    --plot draws both rotations and their difference.
    """
    if reference.is_dir() and candidate.is_dir():
        from rockcheck.validation.studies.conformance.study import changes

        told(changes(reference, candidate))
    check_picture(plot)
    what = load_scene(scene) if scene else None
    given, other = read_measured(reference), read_measured(candidate, offset=offset)
    shift = time_shift(given, other) if align else 0.0
    found = compare(given, shifted(other, shift), until=until, scene=what)
    out = console()
    out.print(headline(found), style="bold")
    table = Table(box=None, pad_edge=False)
    for name, justify in (("measure", "left"), ("value", "right"), ("unit", "left"), ("", "left")):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for figure in found.figures:
        yes_no = DIFFERENCES[figure.measure].yes_no
        table.add_row(figure.label, value_words(figure.value, yes_no=yes_no), "" if yes_no else figure.unit, figure.note)
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
            "notes": {"reference": given.notes, "candidate": other.notes},
            "figures": [{"measure": f.measure, "value": f.value, "unit": f.unit, "note": f.note} for f in found.figures],
        }
    )


def headline(found: Discrepancy) -> str:
    """The comparison in one sentence: whether the outcomes agree, and how far the rotations are apart."""
    assert found.histories is not None
    reference, candidate = (history.fate for history in found.histories)
    same = found["outcome_agrees"] == 1.0
    fate = f"same outcome, {candidate}" if same else f"outcomes differ, {candidate} against {reference}"
    rms = found.figure("theta_rms")
    apart = "" if rms.value is None else f"; rotations {rms.value:.3g} {rms.unit} apart (RMS)"
    return f"{fate}{apart}"
