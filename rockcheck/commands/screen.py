"""The console that tables are printed on.

In: words and tables. Out: what Rich makes of them, without control characters. `console` makes it
when something is printed: to import Rich takes longer than many an answer.
"""

from typing import Any

from rich.console import Console

from rockcheck.scenes import errors


class Screen(Console):
    """A console that prints text without control characters (`inert`).

    Paths, and names in files that somebody sent, may hold any characters.
    """

    def print(self, *objects: Any, **options: Any) -> None:
        """As Rich's, but for what a terminal would obey."""
        super().print(
            *(errors.inert(one) if isinstance(one, str) else one for one in objects), **options
        )
