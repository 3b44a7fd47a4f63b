"""The command `rockcheck`: finds and runs the commands, and prints errors in one line.

Each command is a function of a module of rockcheck.commands.
"""

import inspect
import os
import pkgutil
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import typer
import typer.core

from rockcheck.commands.console import console, output_mode, report_file
from rockcheck.scenes import InputError, ModelFailure, errors, printable, progress

#: The commands, in the order of the help: module and function below this package; an example.
COMMANDS = {
    "scenes": ("simulate:scenes", "rockcheck scenes"),
    "new": ("simulate:new", "rockcheck new cabinet.toml"),
    "record": ("record:run", "rockcheck record station.V2 --read component=1 --plot station.png"),
    "simulate": (
        "simulate:run",
        "rockcheck simulate fig5a --model mujoco --set time_step=1e-3 -o mujoco.csv",
    ),
    "compare": ("compare:run", "rockcheck compare ebm.csv mujoco.csv --until 8"),
    "validate": ("validate:run", "rockcheck validate smoke --out rockcheck-report"),
    "accept": ("validate:accept", 'rockcheck accept smoke --reason "MuJoCo 4 steps differently"'),
    "assess": ("assess:assess", "rockcheck assess shelf.toml records"),
    "spectrum": ("studies:spectrum", "rockcheck spectrum fig8 --size 50 --refine"),
    "benchmark": ("studies:benchmark", "rockcheck benchmark --quick"),
    "conformance": (
        "studies:conformance",
        "rockcheck conformance --engine mujoco --set settings=default",
    ),
    "stress": ("studies:stress", "rockcheck stress --quick"),
    "report": ("validate:report", "rockcheck report rockcheck-report --scene fig4a -o fig4a.pdf"),
    "warm": ("simulate:warm", "rockcheck warm"),
}

#: Commands that are not listed.
HIDDEN = ("warm",)

#: Commands that take no time worth printing.
AT_ONCE = ("scenes", "new", "record", "compare")

#: Options that name models: a command has one, and takes the other as well.
MODEL_OPTIONS = ("--models", "--model")

EXIT_CODES = {
    0: "done; of a verdict: within tolerance",
    1: "out of tolerance, or an invariant is broken",
    2: "bad input, or a file that cannot be read or written",
    3: "a model failed",
    errors.FAULT: "a fault of rockcheck itself: please report it",
    progress.INTERRUPTED: "interrupted by Ctrl-C",
}

_NAMED = inspect.Parameter.KEYWORD_ONLY
#: The options that all commands have, by their parameters.
COMMON = {
    "quiet": typer.Option(
        "--quiet", "-q", help="Print errors only, and what fails; the exit code is the answer."
    ),
    "as_json": typer.Option("--json", help="The result as JSON on stdout, instead of tables."),
}


def with_common_options(does: Callable[..., None], *, timed: bool) -> Callable[..., None]:
    """A command with the options that all of them have, --quiet and --json.

    A parameter that is a dataclass is a group of options, its fields. A `timed` command ends with
    its total time, whatever its verdict: its user waits for more than the simulations.
    """
    own = inspect.signature(does, eval_str=True).parameters.values()
    groups: dict[str, Any] = {
        one.name: one.annotation for one in own if is_dataclass(one.annotation)
    }

    def command(context: typer.Context, *, quiet: bool, as_json: bool, **given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{one.name: given.pop(one.name) for one in fields(group)})
        with output_mode("json" if as_json else "quiet" if quiet else "tables"):
            try:
                does(**given)
            except typer.Exit:  # by `finish_command`
                if timed:
                    console().print(f"total: {time.perf_counter() - context.obj:.1f} s")
                raise

    every = [
        *(option for one in own for option in _options(one)),
        inspect.Parameter("context", _NAMED, annotation=typer.Context),
        *(
            inspect.Parameter(name, _NAMED, default=False, annotation=Annotated[bool, option])
            for name, option in COMMON.items()
        ),
    ]
    command.__doc__ = does.__doc__
    command.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in every}
    return command


def _options(given: inspect.Parameter) -> list[inspect.Parameter]:
    if not is_dataclass(given.annotation):
        return [given.replace(kind=_NAMED)]
    return [
        one.replace(kind=_NAMED, default=getattr(given.default, one.name))
        for one in inspect.signature(cast(Any, given.annotation), eval_str=True).parameters.values()
    ]


class _EachOnce(typer.core.TyperCommand):
    """A command that refuses an option given twice, unless the option gathers values.

    Otherwise the last value would silently win. Either of `MODEL_OPTIONS` stands for that which the
    command has.
    """

    def __init__(self, name: str | None, **settings: Any) -> None:
        super().__init__(name, **settings)
        for option in self.params:
            if not {*MODEL_OPTIONS}.isdisjoint(option.opts):
                option.opts[:0] = [other for other in MODEL_OPTIONS if other not in option.opts]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        try:
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        except typer.TyperException as error:
            option_name = getattr(error, "option_name", "")
            by_name = {name: option for option in self.params for name in option.opts}
            if "requires an argument" not in error.format_message() or option_name not in by_name:
                raise
            without_value = cast(typer.core.TyperOption, by_name[option_name])
            raise InputError(f"needs a value: {without_value.help}", option_name) from None
        for option in order:
            single = isinstance(option, typer.core.TyperOption) and not (
                option.multiple or option.is_flag or option.count
            )
            if single and sum(one is option for one in order) > 1:
                raise InputError("is given twice: give one value", option.opts[-1])
        return super().parse_args(ctx, args)


class _Commands(typer.core.TyperGroup):
    """The commands by name.

    Only the command that is called is imported: half of them need the compiler, or the code that
    draws.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = cast(Any, COMMANDS)  # whose names are suggested

    def list_commands(self, ctx: Any) -> list[str]:
        return [name for name in COMMANDS if name not in HIDDEN]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        where, example = COMMANDS[cmd_name]
        does = pkgutil.resolve_name(f"rockcheck.commands.{where}")
        alone = typer.Typer(rich_markup_mode=None, add_completion=False)
        alone.command(name=cmd_name, cls=_EachOnce, epilog=f"Example: {example}")(
            with_common_options(does, timed=cmd_name not in AT_ONCE)
        )
        return typer.main.get_command(alone)


app = typer.Typer(
    name="rockcheck",
    cls=_Commands,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    epilog="\b\nExit codes:\n"
    + "\n".join(f"{code:5}  {meaning}" for code, meaning in EXIT_CODES.items()),
)


def _version(asked: bool) -> None:
    if asked:
        from rockcheck.version import __version__

        print(f"rockcheck {__version__}")
        raise typer.Exit


@app.callback()
def common(
    _: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_version, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Simulate a rigid block on a shaking floor with several models, and compare them.

    Suites judge the models against tolerances.
    """


def main(arguments: Sequence[str] | None = None, *, began: float | None = None) -> int:
    """Run the command line; returns the exit code, one of `EXIT_CODES`.

    `began` is the start of the program, by `time.perf_counter`; None: now.
    """
    try:
        code = app(
            args=list(sys.argv[1:] if arguments is None else arguments) or ["--help"],
            prog_name="rockcheck",
            standalone_mode=False,
            obj=time.perf_counter() if began is None else began,
        )
    except (typer.TyperException, InputError) as error:
        return _told(
            error.format_message().replace("Value error, ", "")
            if isinstance(error, typer.TyperException)
            else str(error),
            2,
        )
    except ModelFailure as error:
        return _told(str(error), 3)
    except (KeyboardInterrupt, typer.Abort):
        code = progress.INTERRUPTED
    except OSError as error:  # a full disk: what was written before is whole
        return _told(
            f"{printable(Path(os.fsdecode(error.filename or 'output')))}: cannot be used:"
            f" {error.strerror or error}",
            2,
        )
    except MemoryError:
        return _told("out of memory; what was finished is kept", 3)
    except Exception as error:
        from rockcheck.version import __version__

        where = report_file(
            f"rockcheck {__version__}, Python {sys.version}\n"
            + "".join(traceback.format_exception(error))
        )
        return _told(
            f"a fault of rockcheck itself, {type(error).__name__}: please report it with"
            f" {where or f'this: {error}'}",
            errors.FAULT,
        )
    # A study has gathered what there is, or Typer has caught it.
    if code == progress.INTERRUPTED:
        return _told("interrupted; what was finished is kept", progress.INTERRUPTED)
    return code if isinstance(code, int) else 0


def _told(message: str, code: int) -> int:
    print(f"rockcheck: {printable(message, 1400)}", file=sys.stderr)
    return code
