"""Synthetic ground motions of `rockcheck new`, for whom no records are at hand.

In: a folder, and what is asked for. Out: a CSV file a motion. The command `new` calls it.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands.checks import usable_folder
from rockcheck.commands.ending import finish_command
from rockcheck.scenes import InputError, printable, writing
from rockcheck.scenes.recordings import Recording, intensity, synthetic
from rockcheck.validation.finding import Column, Finding, Table, Text, text


@dataclass(frozen=True)
class Synthetic:
    """The options of synthetic motions: without `motions` there are none."""

    motions: Annotated[
        int | None,
        typer.Option(
            "--motions",
            min=1,
            max=synthetic.MOST_MOTIONS,
            help="Write so many synthetic ground motions to a folder in place of a scene.",
        ),
    ] = None
    ground: Annotated[
        str | None,
        typer.Option(
            "--ground",
            help="Of motions: the type of ground of their spectrum, one of"
            f" {', '.join(synthetic.GROUNDS)} (default: B).",
        ),
    ] = None
    acceleration: Annotated[
        float | None,
        typer.Option(
            "--acceleration", help="Of motions: peak acceleration of rock, a_g, g (default: 0.3)."
        ),
    ] = None
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration", min=5.0, max=200.0, help="Of motions: their length, s (default: 20)."
        ),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed", min=0, max=2**31, help="Of motions: other seeds make others (default: 1)."
        ),
    ] = None


def check_none_asked(asked: Synthetic) -> None:
    """Raises `InputError` for an option of motions where none are asked for."""
    for option in fields(asked):
        if getattr(asked, option.name) is not None:
            raise InputError("goes with --motions", f"--{option.name}")


def write_motions(folder: Path, asked: Synthetic) -> None:
    """Writes the motions that are asked for, and tells them."""
    assert asked.motions is not None, "asked for"
    target = target_of(asked)
    found = synthetic.synthetic_motions(
        target,
        asked.motions,
        seed=1 if asked.seed is None else asked.seed,
        duration=asked.duration or 20.0,
    )
    motions = {f"synthetic-{number:02d}.csv": motion for number, motion in enumerate(found, 1)}
    made = usable_folder(folder)
    if any(made.glob("synthetic-*.csv")):
        raise InputError(f"{printable(folder)}: has synthetic motions; they are left as they are")
    writing.write_together({made / name: file_text(motion) for name, motion in motions.items()})
    finish_command(finding_of(motions, target, folder))


def target_of(asked: Synthetic) -> synthetic.Target:
    """The spectrum that is asked for. Raises `InputError`."""
    if asked.ground is not None and asked.ground not in synthetic.GROUNDS:
        raise InputError(
            f"{printable(repr(asked.ground))} is not allowed: one of"
            f" {', '.join(synthetic.GROUNDS)}",
            "--ground",
        )
    given = {"ground": asked.ground, "acceleration": asked.acceleration}
    try:
        return synthetic.Target().replace(
            **{name: value for name, value in given.items() if value is not None}
        )
    except InputError as error:
        raise InputError(error.reason, f"--{error.key}") from None


def file_text(motion: Recording) -> str:
    """A motion as CSV, what it is above it."""
    times = [round(motion.time_step * number, 6) for number in range(len(motion.samples))]
    columns = {"time_s": times, "acceleration_m_s2": motion.samples.round(6).tolist()}
    return "".join(f"# {note}\n" for note in motion.notes) + writing.columns_text(columns)


def finding_of(motions: dict[str, Recording], target: synthetic.Target, folder: Path) -> Finding:
    """The motions, a row each, and what to do with them."""
    columns = [
        text("file"),
        Column("pga", "PGA", "g"),
        Column("pgv", "PGV", "m/s"),
        Column("arias", "Arias", "m/s"),
    ]
    rows = [
        [
            name,
            intensity.peak_acceleration(motion),
            intensity.peak_velocity(motion),
            intensity.arias(motion),
        ]
        for name, motion in motions.items()
    ]
    table = Table("motions", columns, rows, most=len(rows))
    lines = [f"target: {target.words}", f"next: rockcheck assess SCENE.toml {printable(folder)}"]
    data = {"folder": str(folder), "target": target.words, "motions": table.records()}
    return Finding("motions", "Synthetic motions", "", [table, Text("", items=lines)], data)
