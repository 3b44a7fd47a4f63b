"""The command `rockcheck`: one module a command under validation.commands; here they meet, and errors become one line.

Exit codes: 0 pass, 1 out of tolerance, 2 bad input, 3 a model failed.
"""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from rockcheck.scenes import InputError, ModelFailure
from rockcheck.scenes.errors import printable
from rockcheck.validation.commands import (
    accept,
    benchmark,
    compare,
    convergence,
    new,
    report,
    scenes,
    simulate,
    speaking,
    spectrum,
    stress,
    validate,
)

#: The commands, in the order of the help, each with an example.
COMMANDS = {
    scenes: "rockcheck scenes",
    new: "rockcheck new bookcase.toml",
    simulate: "rockcheck simulate fig5a --model mujoco --set time_step=1e-3 -o mujoco.csv",
    compare: "rockcheck compare ebm.csv mujoco.csv --until 8",
    validate: "rockcheck validate smoke --out rockcheck-report",
    accept: 'rockcheck accept smoke --reason "MuJoCo 4 steps differently"',
    spectrum: "rockcheck spectrum --figure 8 --size 50 --refine",
    benchmark: "rockcheck benchmark --quick",
    convergence: "rockcheck convergence --quick",
    stress: "rockcheck stress --quick",
    report: "rockcheck report rockcheck-report",
}

#: Exit code of a run that Ctrl-C ended.
INTERRUPTED = 130

QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Nothing but errors; the exit code tells.")]
JsonOption = Annotated[bool, typer.Option("--json", help="The result as JSON on stdout, instead of tables.")]

app = typer.Typer(
    name="rockcheck",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def spoken(run: Callable[..., None]) -> Callable[..., None]:
    """A command with the options that all of them have: --quiet and --json."""

    def command(*, quiet: bool, as_json: bool, **arguments: Any) -> None:
        with speaking("json" if as_json else "quiet" if quiet else "tables"):
            run(**arguments)

    signature = inspect.signature(run, eval_str=True)
    common = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option)
        for name, option in (("quiet", QuietOption), ("as_json", JsonOption))
    ]
    command.__doc__ = run.__doc__
    command.__signature__ = signature.replace(parameters=[*signature.parameters.values(), *common])  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in (*signature.parameters.values(), *common)}
    return command


def _version(asked: bool) -> None:
    if asked:
        print(f"rockcheck {version('rockcheck')}")
        raise typer.Exit


@app.callback()
def common(
    _: Annotated[bool, typer.Option("--version", is_eager=True, callback=_version, help="Show the version and exit.")] = False,
) -> None:
    """Simulate a rigid block on a shaking floor with several models, compare them, and judge them against tolerances."""


for module, example in COMMANDS.items():
    app.command(name=module.__name__.rpartition(".")[2], epilog=f"Example: {example}")(spoken(module.run))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    try:
        code = app(args=list(sys.argv[1:] if arguments is None else arguments), prog_name="rockcheck", standalone_mode=False)
    except (typer.TyperException, InputError) as error:
        return _told(error.format_message() if isinstance(error, typer.TyperException) else str(error), 2)
    except ModelFailure as error:
        return _told(str(error), 3)
    except (KeyboardInterrupt, typer.Abort):
        return _told("interrupted; what was finished is kept", INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of a pipe has gone: nobody is left to be told
        return 141
    except OSError as error:  # a disk that is full, a folder that has gone: what was written before is whole
        return _told(f"{printable(Path(os.fsdecode(error.filename or 'output')))}: cannot be used: {error.strerror or error}", 2)
    except MemoryError:
        return _told("out of memory; what was finished is kept", 3)
    if code == INTERRUPTED:  # Typer has caught it
        return _told("interrupted; what was finished is kept", INTERRUPTED)
    return code if isinstance(code, int) else 0


def _told(message: str, code: int) -> int:
    print(f"rockcheck: {printable(message, 1400)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
