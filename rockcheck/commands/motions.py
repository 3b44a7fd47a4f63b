"""`rockcheck motions`: synthetic ground motions, for whom no records are at hand."""

from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands.checks import usable_folder
from rockcheck.commands.ending import finish_command
from rockcheck.scenes import InputError, printable, writing
from rockcheck.scenes.recordings import Recording, intensity, synthetic
from rockcheck.validation.finding import Column, Finding, Table, Text, text


def run(
    folder: Annotated[Path, typer.Argument(help="Folder to write to; it is made if need be.")],
    count: Annotated[
        int, typer.Option("--count", min=1, max=synthetic.MOST_MOTIONS, help="How many.")
    ] = 12,
    ground: Annotated[
        str,
        typer.Option(
            "--ground", help=f"Type of ground of the target: {', '.join(synthetic.GROUNDS)}."
        ),
    ] = "B",
    acceleration: Annotated[
        float,
        typer.Option("--acceleration", help="Peak acceleration of rock (g), a_g of the target."),
    ] = 0.3,
    duration: Annotated[
        float, typer.Option("--duration", min=5.0, max=200.0, help="Length of each, s.")
    ] = 20.0,
    seed: Annotated[
        int, typer.Option("--seed", min=0, max=2**31, help="Other seeds make other motions.")
    ] = 1,
) -> None:
    """Write synthetic ground motions.

    They follow the horizontal elastic spectrum of EN 1998-1, type 1, 5 % damped. Each motion is a
    CSV file that all commands read, the same on every call. Such motions differ less from each
    other than recorded ones do.
    """
    if ground not in synthetic.GROUNDS:
        raise InputError(
            f"{printable(repr(ground))} is not allowed: one of {', '.join(synthetic.GROUNDS)}",
            "--ground",
        )
    try:
        target = synthetic.Target(ground=ground, acceleration=acceleration)
    except InputError as error:
        raise InputError(error.reason, f"--{error.key}") from None
    motions = {
        f"synthetic-{number:02d}.csv": motion
        for number, motion in enumerate(
            synthetic.synthetic_motions(target, count, seed=seed, duration=duration), 1
        )
    }
    made = usable_folder(folder)
    writing.write_together({made / name: file_text(motion) for name, motion in motions.items()})
    finish_command(finding_of(motions, target, folder))


def file_text(motion: Recording) -> str:
    """A motion as CSV, what it is above it."""
    times = [round(motion.time_step * number, 6) for number in range(len(motion.samples))]
    columns = {"time_s": times, "acceleration_m_s2": motion.samples.round(6).tolist()}
    return "".join(f"# {note}\n" for note in motion.notes) + writing.columns_text(columns)


def finding_of(motions: dict[str, Recording], target: synthetic.Target, folder: Path) -> Finding:
    """The motions, a row each, and what to do with them."""
    columns = [
        text("file"),
        Column("pga", "PGA", "g", digits=3),
        Column("pgv", "PGV", "m/s", digits=3),
        Column("arias", "Arias", "m/s", digits=3),
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
