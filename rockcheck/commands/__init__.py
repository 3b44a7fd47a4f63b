"""The commands of `rockcheck`, and their common options and output.

Tables or JSON go to stdout, progress to stderr.
"""

import os
import sys
import tempfile
import threading
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task as ProgressTask,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from rockcheck.commands.pace import Pace
from rockcheck.reports.style import ENDINGS, kind_of
from rockcheck.scenes import InputError, Record, Scene, errors, named_scenes, printable, writing
from rockcheck.scenes.progress import OnProgress, announcing, within
from rockcheck.scenes.recordings import sets
from rockcheck.validation.execute.models import FAMILIES, build, compiles, is_own, not_installed
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import Study, run

OUT = Path("rockcheck-report")

OutOption = Annotated[
    Path,
    typer.Option("--out", help="Folder to write; the page to open is index.html in it."),
]
JobsOption = Annotated[
    int | None, typer.Option("--jobs", min=1, help="Worker processes (default: one a core).")
]
AllowCodeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--allow-code",
        metavar="MODULE:CLASS",
        help="A model of your own that may be run: its code is imported; repeatable.",
    ),
]


@dataclass(frozen=True)
class Played:
    """The options of a study: the folder that it writes, and where it is played."""

    out: OutOption = OUT
    jobs: JobsOption = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            help="Run on a Dask cluster instead: its address, or local:N for N local workers.",
        ),
    ] = None


PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help=f"Figure to draw: {ENDINGS}.")
]

#: All models that are installed.
ALL = "all"
#: Most lines on what failed that --quiet prints.
MOST_WRONG = 100

#: Output of a command: tables and progress, one JSON value instead, or errors only.
Voice = Literal["tables", "json", "quiet"]
_voice: ContextVar[Voice] = ContextVar("voice", default="tables")


@contextmanager
def speaking(voice: Voice) -> Iterator[None]:
    """Within this block commands print in this voice."""
    say = (
        (lambda words: print(f"rockcheck: {words}", file=sys.stderr)) if voice == "tables" else None
    )
    with within(_voice, voice), announcing(say):
        yield


class _Screen(Console):
    """A console that prints text without control characters (`inert`).

    Paths, and names in files that somebody sent, may hold any characters.
    """

    def print(self, *objects: Any, **options: Any) -> None:
        super().print(
            *(errors.inert(one) if isinstance(one, str) else one for one in objects), **options
        )


def console() -> Console:
    """The console for tables, on stdout; silent with --json and --quiet.

    At most as wide as the terminal, 80 columns where there is none; coloured on a terminal only.
    """
    return _Screen(markup=False, emoji=False, highlight=False, quiet=_voice.get() != "tables")


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


def answer(value: Any) -> None:
    """Print the command's result as JSON on stdout, if `--json` asks for it.

    Numbers that are not finite become null.
    """
    if _voice.get() == "json":
        print(writing.json_text(value), flush=True)  # before what stderr has to say


#: Time between two lines of progress, s; and before the first one, which is printed only if more
#: than `EVERY` is left.
EVERY, EARLY = 10.0, 2.0


@contextmanager
def progress(
    title: str, models: Iterable[tuple[str, Mapping[str, Any]]] = ()
) -> Iterator[OnProgress]:
    """Show progress and the time left on stderr: a bar on a terminal, elsewhere lines.

    It says if one of the `models` (family, settings) that play may compile first. Nothing is shown
    where a command is quiet.
    """
    may_compile = any(compiles(*model) for model in models)
    title += ", may compile first" * may_compile
    screen, pace = Console(stderr=True), Pace(compiles=may_compile)
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(20),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        _TimeLeft(pace),
        console=screen,
        transient=True,
        disable=_voice.get() != "tables" or not screen.is_terminal,
    )
    bar.add_task(title, total=None, what="")
    (task,) = bar.tasks

    def on_progress(done: float, total: float, what: str = "") -> None:
        pace.hear(done, total)
        bar.update(
            task.id,
            total=total,
            completed=done,
            description=f"{title}: {printable(what, 24)}" if what else title,
            what=what,
        )

    over = threading.Event()
    if bar.disable and _voice.get() != "quiet":
        threading.Thread(target=_tell_lines, args=[title, task, pace, over], daemon=True).start()
    with nullcontext() if bar.disable else bar:
        try:
            yield on_progress
        finally:
            over.set()


def _tell_lines(title: str, task: ProgressTask, pace: Pace, over: threading.Event) -> None:
    """Print lines of progress for a log until the work is `over`.

    None for a work of a few seconds.
    """
    wait = EARLY
    while not over.wait(wait):
        left = pace.left
        if wait == EVERY or (left or 0.0) > EVERY:
            parts = f"{pace.done:.0f} of {pace.total:.0f}, " if pace.total else ""
            what = f" ({printable(task.fields['what'], 60)})" if task.fields["what"] else ""
            words = f"{parts}{_time_words(pace)}{what}"
            print(f"rockcheck: {title}: {words}", file=sys.stderr, flush=True)
        wait = EVERY


def _time_words(pace: Pace) -> str:
    """The time left, as "2:05 left"; before that is known the time so far."""
    left = pace.left
    minutes, seconds = divmod(int(pace.elapsed if left is None else left), 60)
    return f"{minutes}:{seconds:02d} {'so far' if left is None else 'left'}"


class _TimeLeft(ProgressColumn):
    """The time left in a bar."""

    def __init__(self, pace: Pace) -> None:
        super().__init__()
        self.pace = pace

    def render(self, task: ProgressTask) -> Text:
        return Text("" if self.pace.left is None else _time_words(self.pace), style="cyan")


def studied(study: Study, options: Played, **how: Any) -> NoReturn:
    """Run a study with progress, write its page, print its finding; ends with its exit code."""
    folder = usable_folder(options.out)
    with progress(study.name) as on_progress:
        found = run(
            study,
            folder,
            jobs=options.jobs,
            scheduler=options.scheduler,
            on_progress=on_progress,
            **how,
        )
    told(found, folder)


def told(
    found: Finding,
    folder: Path | None = None,
    said: Iterable[tuple[str, Path]] = (),
    value: Any = None,
) -> NoReturn:
    """Print a finding, and where what was written lies; end with the finding's exit code.

    Its page is written first if it has a `folder`; else `said` has the files, each with its kind.
    As JSON it is its `value`, by default all that it holds.
    """
    from rockcheck.reports.document import publish
    from rockcheck.reports.terminal import show

    page = folder and publish(found, folder)
    show(found, console())
    for kind, path in [("report", page)] if page else said:
        console().print(f"{kind}: {path}", soft_wrap=True)
    answer(value or found.as_dict() | {"report": page})
    raise typer.Exit(found.exit_code)


def chosen_models(names: str = ALL, settings: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """The models by name, each with its settings; of all, those that are installed.

    Raises `InputError` for an unknown one, and for a setting that is not allowed.
    """
    named = (
        (name for name in FAMILIES if name != "measured" and not not_installed(name))
        if names == ALL
        else filter(None, map(str.strip, names.split(",")))
    )
    chosen = list(dict.fromkeys(named))
    if not chosen or "measured" in chosen:
        raise InputError(
            f"{printable(names)!r} is not allowed: models that play, with commas between, or all",
            "--models",
        )
    by_model = _settings_by_model(settings, chosen)
    for name, given in by_model.items():
        if not is_own(name):
            build(name, given)
    return by_model


def _settings_by_model(settings: Iterable[str], models: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The settings of each of these models, from words `MODEL.key=value`."""
    words: dict[str, list[str]] = {name: [] for name in models}
    for text in settings:
        model, dot, rest = text.partition(".")
        if not dot or model not in words:
            raise InputError(
                f"{printable(text)!r}: write MODEL.key=value, with MODEL one of"
                f" {', '.join(models)}",
                "--set",
            )
        words[model].append(rest)
    return {name: settings_of(own) for name, own in words.items()}


def names_in(words: Iterable[str]) -> list[str]:
    """The names in words, which may hold several with commas between; each once."""
    names = [name.strip() for word in words for name in word.split(",")]
    return list(dict.fromkeys(names))


def check_one_model(name: str, command: str) -> None:
    """Raise `InputError` for several models where a command plays one."""
    if "," in name:
        raise InputError(
            f"{printable(name)!r} is not allowed: {command} plays one model; validate and assess"
            " take several",
            "--model",
        )


def need_installed(names: Iterable[str], option: str) -> None:
    """Raise `NotInstalled` for the first model whose engine is not installed."""
    for name in names:
        if hint := not_installed(name):
            raise errors.NotInstalled(hint, f"{option} {name}")


def settings_of(words: Iterable[str], option: str = "--set") -> dict[str, Any]:
    """The values of words `key=value` by their keys, as in TOML; a bare value is a string.

    Raises `InputError` for a word of another form, and for a key that is given twice.
    """
    found: dict[str, Any] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not key.isidentifier():
            raise InputError(f"{printable(word)!r}: write key=value", option)
        if key in found:
            raise InputError(f"{key} is given twice: give one value", option)
        try:
            found[key] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[key] = value
    return found


def check_file(path: Path, option: str, check: Callable[[Path], Any] = kind_of) -> None:
    """Raise `InputError` that names the `option` where a file of that name cannot be written.

    `check` raises it for an ending that is not allowed, by default of a figure.
    """
    if not path.parent.is_dir():
        raise InputError(f"{printable(path.parent)}: no such folder", option)
    check(path)


def report_file(text: str) -> str:
    """Write a traceback into a file that only the user can read.

    Returns its path, "" where it cannot be written.
    """
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            encoding="utf-8",
            errors="backslashreplace",
            prefix="rockcheck-fault-",
            suffix=".txt",
            delete=False,
        ) as stream:
            stream.write(text)
    except OSError:
        return ""
    return stream.name


def usable_folder(folder: Path, *parts: str) -> Path:
    """A folder, or one within it, made if need be.

    Raises `InputError` where it cannot be written, or lies behind a link in `folder`.
    """
    path = folder.joinpath(*parts)
    try:
        writing.made(folder, *parts)
    except OSError as error:
        raise InputError(
            f"{printable(path)}: cannot be used as a folder: {error.strerror}"
        ) from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(f"{printable(path)}: not writable")
    return path


def tell_wrong(lines: Sequence[str]) -> None:
    """Print on stderr what failed, where no table on stdout says it: with --quiet."""
    if _voice.get() != "quiet":
        return
    for line in lines[:MOST_WRONG]:
        print(printable(f"rockcheck: {line}", 1400), file=sys.stderr)
    if len(lines) > MOST_WRONG:
        print(f"rockcheck: and {len(lines) - MOST_WRONG} more lines", file=sys.stderr)


def completing(
    known: Callable[[], Iterable[str]], *, files: bool = True
) -> Callable[[str], list[str]]:
    """For the shell's completion: the names that are `known`, and the TOML `files` here."""

    def complete(incomplete: str) -> list[str]:
        here = sorted(path.name for path in Path().glob("*.toml")) if files else []
        return [name for name in (*known(), *here) if name.startswith(incomplete)]

    return complete


scene_names = completing(named_scenes)
model_names = completing(lambda: FAMILIES, files=False)
