"""How a scene, a history, a spectrum or a comparison shows itself is said elsewhere; here it is only asked for.

The contract draws nothing. A package above registers a `View` for a class by an entry point of the group
`rockcheck.views`; rockcheck's own is `rockcheck.reports.show`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class View:
    """How objects of one class show themselves: as HTML in a notebook, and as a figure."""

    html: Callable[[Any], str]
    figure: Callable[[Any], Figure]


class Shown:
    """Something that a notebook can show, and that has a figure."""

    def plot(self) -> Figure:
        """It as a matplotlib figure."""
        return _view_of(type(self)).figure(self)

    def _repr_html_(self) -> str:
        return _view_of(type(self)).html(self)


@cache
def _views() -> dict[type, View]:
    views: dict[type, View] = {}
    for entry in entry_points(group="rockcheck.views"):
        views.update(entry.load())
    return views


def _view_of(kind: type) -> View:
    views = _views()
    return next(views[base] for base in kind.__mro__ if base in views)
