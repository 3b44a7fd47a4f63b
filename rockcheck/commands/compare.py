"""`rockcheck compare`: any two histories, or two finished runs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from pydantic import FiniteFloat, TypeAdapter

from rockcheck.commands.checks import check_file
from rockcheck.commands.ending import finish_command
from rockcheck.commands.options import PlotOption, scene_names
from rockcheck.reports.style import save_as
from rockcheck.scenes import History, InputError, Scene, load_scene, printable
from rockcheck.validation import Discrepancy, compare
from rockcheck.validation.discrepancy import figures, hints, measured, measures
from rockcheck.validation.discrepancy.compare import motion_of, motion_words
from rockcheck.validation.finding import Block, Column, Finding, Table, Text, text
from rockcheck.validation.suite import results, run_changes

#: Value of --align for the shift at which the rotations agree best.
BEST = "best"


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
    align: Annotated[
        str | None,
        typer.Option(
            "--align",
            metavar="SECONDS|best",
            help="Shift the candidate in time, by SECONDS, or to where the rotations agree best.",
        ),
    ] = None,
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
    changed_nodes: Annotated[
        float | None,
        typer.Option(
            "--changed-nodes",
            metavar="SHARE",
            min=0.0,
            max=1.0,
            help="Of two runs of `spectrum`: the share of a spectrum's nodes that may end otherwise"
            " (default: 0).",
        ),
    ] = None,
) -> None:
    """Compare two histories, or two finished runs.

    Two folders: what changed between runs of a suite, of `conformance` or of `spectrum`, exit 1
    where a verdict or a cell changed, or too many nodes did.

    Histories that rockcheck wrote, or any CSV with columns t_s and theta_rad (or theta_deg,
    time_ms, x_mm, ...). --plot draws both rotations and their difference.
    """
    if reference.is_dir() or candidate.is_dir():
        _refuse_for_runs(
            {"--align": align, "--until": until, "--scene": scene, "--plot": plot},
        )
    between_runs = _changes_between_runs(reference, candidate, changed_nodes)
    if between_runs is not None:
        finish_command(between_runs)
    if plot is not None:
        check_file(plot, "--plot")
    common_scene = load_scene(scene) if scene else None
    seconds = _seconds(align)
    histories = {"reference": History.load(reference), "candidate": History.load(candidate)}
    if seconds is None:
        shift = measured.time_shift(histories["reference"], histories["candidate"])
    else:
        shift = seconds
    shifted = measured.shifted(histories["candidate"], shift)
    discrepancy = compare(histories["reference"], shifted, until=until, scene=common_scene)
    hint = hints.hint(histories["reference"], shifted, until, common_scene)
    finding = _finding(discrepancy, histories, common_scene, shift, _hint_words(hint, shift))
    figures = [("figure", save_as(discrepancy.plot(), plot))] if plot is not None else []
    finish_command(finding, said=figures, value=finding.as_dict())


def _changes_between_runs(
    reference: Path, candidate: Path, changed_nodes: float | None
) -> Finding | None:
    """What changed between two finished runs, of whatever kind; None of two histories."""
    from rockcheck.validation.studies.conformance import changes
    from rockcheck.validation.studies.spectrum import changes as spectrum_changes

    is_run = reference.is_dir() or reference.suffix == ".json"
    if is_run and spectrum_changes.wrote(reference):
        return spectrum_changes.changes(reference, candidate, changed_nodes or 0.0)
    if changed_nodes is not None:
        raise InputError(f"{printable(reference)}: no run of `spectrum`", "--changed-nodes")
    if is_run and changes.wrote(reference):
        return changes.changes(reference, candidate)
    if reference.is_dir() or candidate.is_dir():
        return run_changes.difference(results.Run.load(reference), results.Run.load(candidate))
    return None


def _seconds(align: str | None) -> float | None:
    """The shift that --align gives, s; None for that at which the rotations agree best."""
    if align is None:
        return 0.0
    if align == BEST:
        return None
    try:
        return TypeAdapter(FiniteFloat).validate_python(align)
    except ValueError:
        raise InputError(f"{printable(align)!r}: give seconds, or {BEST}", "--align") from None


def _refuse_for_runs(options: Mapping[str, object]) -> None:
    """Raise `InputError` for an option of histories where finished runs are compared."""
    for option, value in options.items():
        if value is not None:
            raise InputError("is for histories, not for finished runs", option)


def _hint_words(hint: hints.Hint | None, shift: float) -> str:
    """A hint as a line, with the whole shift as an option; "" without one."""
    if hint is None:
        return ""
    advice = f"--align {shift + hint.shift:.4g}"
    return f"hint: {hint.sentence('the candidate', advice)}"


def _finding(
    found: Discrepancy,
    histories: Mapping[str, History],
    scene: Scene | None,
    shift: float,
    hint: str,
) -> Finding:
    # Whether outcomes agree, and how far rotations differ.
    fates = dict.fromkeys(history.fate for history in reversed(found.histories))
    rms = found.figure("theta_rms")
    headline = (
        ("same outcome, " if found["outcome_agrees"] == 1.0 else "outcomes differ, ")
        + " against ".join(fates)
        + ("" if rms.value is None else f"; rotations {rms.value:.3g} {rms.unit} apart (RMS)")
    )
    motions = {role: motion_of(history, scene) for role, history in histories.items()}
    rows = [
        [
            figure.label,
            figures.value_words(figure.value, yes_no=measures.DIFFERENCES[figure.measure].yes_no),
            "" if measures.DIFFERENCES[figure.measure].yes_no else figure.unit,
            figure.note,
        ]
        for figure in found.figures
    ]
    models = f"{found.candidate} against {found.reference}"
    blocks: list[Block] = [
        Text(headline),
        Text(hint, verdict="changed"),
        Text(
            facts=[
                (role, ", ".join(words))
                for role, one in motions.items()
                if (words := motion_words(one))
            ]
        ),
        Text(f"{models}, {found.start:g} to {found.end:g} s"),
        Table(
            "comparison",
            [text("measure"), Column("value"), text("unit"), text("note", " ")],
            rows,
        ),
        Text(f"the candidate is shifted by {shift:+.4g} s" if shift else ""),
        Text(f"not the whole time: {found.gap}" if found.gap else ""),
        Text(
            items=[
                f"note on the {role}: {note}"
                for role, one in histories.items()
                for note in one.notes
            ],
            verdict="changed",
        ),
    ]
    return Finding(
        "comparison",
        models,
        "",
        blocks,
        {
            "reference": found.reference,
            "candidate": found.candidate,
            "start": found.start,
            "end": found.end,
            "shift": shift,
            "gap": found.gap,
            "headline": headline,
            "hint": hint,
            "motion": motions,
            "notes": {role: history.notes for role, history in histories.items()},
            "figures": [
                {"measure": f.measure, "value": f.value, "unit": f.unit, "note": f.note}
                for f in found.figures
            ],
        },
    )
