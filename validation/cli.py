"""The command `rockcheck`: one module a command under validation.commands; here they meet, and errors become one line.

Exit codes: 0 pass, 1 out of tolerance, 2 bad input, 3 a model failed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from scenes import InputError, ModelFailure
from scenes.errors import printable
from validation.commands import accept, benchmark, compare, convergence, report, scenes, simulate, spectrum, stress, validate

app = typer.Typer(
    name="rockcheck",
    help="Simulate a rigid block on a shaking floor with several models, compare them, and judge them against tolerances.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for module in (scenes, simulate, compare, validate, accept, spectrum, benchmark, convergence, stress, report):
    app.command(name=module.__name__.rpartition(".")[2])(module.run)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    try:
        code = app(args=list(sys.argv[1:] if arguments is None else arguments), prog_name="rockcheck", standalone_mode=False)
    except (typer.TyperException, InputError) as error:
        return _told(error.format_message() if isinstance(error, typer.TyperException) else str(error), 2)
    except ModelFailure as error:
        return _told(str(error), 3)
    except (KeyboardInterrupt, typer.Abort):
        return _told("interrupted; what was finished is kept", 130)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of a pipe has gone: nobody is left to be told
        return 141
    return code if isinstance(code, int) else 0


def _told(message: str, code: int) -> int:
    print(f"rockcheck: {printable(message, 500)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
