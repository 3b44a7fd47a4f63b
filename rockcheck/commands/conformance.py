"""`rockcheck conformance`: a card an engine."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.table import Table

from rockcheck.commands import OUT, AllowCodeOption, OutOption, answer, console, model_names, progress, usable_folder
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable
from rockcheck.scenes.writing import write_together, write_whole

if TYPE_CHECKING:
    from rockcheck.validation.conformance.cards import Card
    from rockcheck.validation.conformance.study import Asked

EngineOption = Annotated[
    list[str] | None,
    typer.Option("--engine", help="A name or module:Class; repeatable (default: all installed).", autocompletion=model_names),
]
STEP = 1e-3


def run(
    engine: EngineOption = None,
    settings: Annotated[
        Literal["best", "default", "both"] | None, typer.Option("--settings", help="Set-up of the engines (default: best).")
    ] = None,
    step: Annotated[float, typer.Option("--step", help="Time step, s.")] = STEP,
    histories: Annotated[
        list[Path] | None, typer.Option("--histories", help="Folder with an engine's own CSV histories, see --export; repeatable.")
    ] = None,
    export: Annotated[Path | None, typer.Option("--export", help="Write the scenes for another engine into a folder, and stop.")] = None,
    compare: Annotated[
        tuple[Path, Path] | None, typer.Option("--compare", help="Show what changed between two files of cards, and stop.")
    ] = None,
    allow_code: AllowCodeOption = None,
    out: OutOption = OUT / "conformance",
) -> None:
    """Hold engines against phenomena with a certain answer.

    Writes a card an engine: a page, JSON, JUnit and Markdown. Exit 1 where an engine fails one.
    """
    if export is not None:
        _export(usable_folder(export))
        return
    if compare is not None:
        _compare(*compare)
        return
    from rockcheck.reports.studies.conformance import write_conformance
    from rockcheck.validation.conformance.cards import as_json, junit, markdown
    from rockcheck.validation.conformance.study import card_of, card_of_histories, card_of_own
    from rockcheck.validation.execute.models import is_own

    asked = _asked(engine, settings, step, bool(histories), allow_code or ())
    folder = usable_folder(out)
    cards: list[Card] = []
    for one in asked:
        with progress("conformance") as on_progress:
            cards.append(card_of_own(one, str(Path.cwd())) if is_own(one.engine) else card_of(one, on_progress))
    cards += [card_of_histories(path) for path in histories or []]
    data = as_json(cards)
    write_together(
        {
            folder / "conformance.json": json.dumps(data, indent=1, allow_nan=False) + "\n",
            folder / "junit.xml": junit(cards),
            folder / "summary.md": markdown(cards),
        }
    )
    index = write_conformance(cards, folder)
    _show(cards)
    console().print(f"report: {index}", soft_wrap=True)
    answer(data | {"report": index})
    raise typer.Exit(int(any(card.failed for card in cards)))


def _asked(names: list[str] | None, settings: str | None, step: float, elsewhere: bool, allow_code: Sequence[str]) -> list[Asked]:
    """What is to be played; nothing where histories are given and no engine is named."""
    from rockcheck.validation.conformance.study import Asked, engines_here
    from rockcheck.validation.execute.models import build, check_allowed, engine_names, is_own, not_installed

    if not 0.0 < step <= 0.1:
        raise InputError(f"{step:g} is not allowed: give a step above 0 and up to 0.1 s", "--step")
    names = names or ([] if elsewhere else engines_here())
    kinds = ["best", "default"] if settings == "both" else [settings or "best"]
    found = []
    for name in names:
        if is_own(name):
            check_allowed(name, allow_code)
        elif name not in engine_names():
            raise InputError(f"{printable(name)!r} is not allowed: give one of {', '.join(engine_names())}, or module:Class", "--engine")
        mine = [""] if is_own(name) and settings is None else kinds
        found += [Asked(name, kind, step) for kind in mine]
        if reason := not_installed(name):  # told before others have run
            raise InputError(reason, f"--engine {name}")
    for one in found:
        if not is_own(one.engine):
            build(one.engine, {"time_step": one.step} | ({"settings": one.settings} if one.settings else {}))
    return found


def _show(cards: list[Card]) -> None:
    from rockcheck.validation.conformance.cards import VERDICTS

    table = Table(box=None, pad_edge=False)
    for column in ("engine", "settings", "step, s", "conforms", "fails", "has none"):
        table.add_column(column, justify="left" if column in ("engine", "settings", "fails") else "right")
    for card in cards:
        verdicts = [row.verdict for row in card.phenomena]
        fails = ", ".join(row.id.removeprefix("RC-") for row in card.failed) or "-"
        judged = len(verdicts) - verdicts.count("reported") - verdicts.count("lacks")
        table.add_row(f"{card.engine} {card.version}", card.settings, f"{card.step:g}", f"{verdicts.count('pass')} of {judged}", fails,
                      str(verdicts.count("lacks")))  # fmt: skip
    console().print(table)
    for card in cards:
        for row in card.failed:
            words = f"{row.value:.4g}, {row.target:g} ± {row.limit:g} is right: {row.reason}" if row.verdict == "fail" else row.reason
            console().print(f"{VERDICTS[row.verdict]}: {card.engine}, {card.settings}: {row.id} {row.name}: {words}", soft_wrap=True)


def _export(folder: Path) -> None:
    from rockcheck.reports.scene_file import write_scene_file
    from rockcheck.validation.conformance.phenomena import SCENES
    from rockcheck.validation.conformance.study import ABOUT, slug_of

    for name, scene in SCENES.items():
        write_scene_file(scene, folder, slug_of(name))
    about = 'engine = "my engine"\nversion = "1.0"\nsettings = "as it comes"\nstep = 1e-3  # s\nlacks = []  # or ["restitution"]\n'
    if not (folder / ABOUT).exists():
        write_whole(folder / ABOUT, about)
    console().print(f"{len(SCENES)} scenes in {folder}: play each, write t_s, x_m, y_m, theta_rad of the centroid,", soft_wrap=True)
    console().print(f"relative to the base, as NAME.csv beside NAME.toml, fill in {ABOUT}, then:", soft_wrap=True)
    console().print(f"  rockcheck conformance --histories {folder}", soft_wrap=True)
    answer({"folder": folder, "scenes": {name: f"{slug_of(name)}.toml" for name in SCENES}})


def _compare(before: Path, after: Path) -> None:
    from rockcheck.validation.conformance.cards import changes, read_cards

    found = changes(read_cards(before), read_cards(after))
    for one in found:
        values = " to ".join(f"{value:.4g}" for value in one.values)
        versions, verdicts = (" to ".join(dict.fromkeys(pair)) for pair in (one.versions, one.verdicts))
        console().print(f"{one.engine} {versions}, {one.settings}: {one.id} {one.name}: {verdicts}, {values}", soft_wrap=True)
    console().print(f"{len(found)} changes, {sum(one.worse for one in found)} for the worse")
    answer({"changes": [vars(one) | {"worse": one.worse} for one in found]})
    raise typer.Exit(int(any(one.worse for one in found)))
