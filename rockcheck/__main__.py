"""`python -m rockcheck`, and the command `rockcheck`."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    from rockcheck.validation.commands.cli import main as run

    return run(arguments)


if __name__ == "__main__":
    sys.exit(main())
