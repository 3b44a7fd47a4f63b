"""What a command leaves out or has assumed, finish_command in yellow lines.

In: names of models, records and scenes. Out: lines on stdout. Commands that play them call it.
"""

from collections.abc import Iterable, Sequence

from rockcheck.commands.console import console
from rockcheck.scenes import Record, Scene, printable
from rockcheck.scenes.recordings import sets
from rockcheck.validation.execute.models import FAMILIES, not_installed


def tell_missing() -> None:
    """Print the models that a study of all models leaves out: those that are not installed."""
    for name in FAMILIES:
        if missing := not_installed(name):
            console().print(f"left out: {name}, {missing}", style="yellow", soft_wrap=True)


def tell_left_out(names: Sequence[str], hint: str = "") -> None:
    """Print the names in a set of records that are not played.

    These are vertical components, with a `hint` how to play them, and files that are no records.
    """
    vertical = [name for name in names if not isinstance(name, sets.Odd)]
    said = f"{', '.join(vertical)} ({'; '.join(filter(None, ['vertical', hint]))})"
    odd = sets.grouped(name for name in names if isinstance(name, sets.Odd))
    for line in [*([said] if vertical else []), *odd]:
        console().print(f"left out: {line}", style="yellow", soft_wrap=True)


def tell_record_notes(scenes: Iterable[Scene]) -> None:
    """Print what readers of the scenes' records assumed or overrode, a line a note."""
    notes = [
        f"{excitation.source}: {note}"
        for scene in scenes
        for excitation in (scene.excitation, scene.vertical)
        if isinstance(excitation, Record)
        for note in excitation.notes
    ]
    for line in sets.grouped(dict.fromkeys(notes)):
        console().print(f"note: {printable(line, 500)}", style="yellow", soft_wrap=True)
