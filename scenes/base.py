"""What all scene objects share: frozen, strictly validated, faults told in one line; and how they
ask to be shown.

The contract draws nothing. How a scene, a history, a spectrum or a comparison shows itself is said
above: a package registers a `View` for a class by an entry point of the group `rockcheck.views`;
rockcheck's own is `rockcheck.reports.show`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, ValidationError

from rockcheck.scenes.errors import from_validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Allowed sizes of numbers in SI units: their squares, cubes and inverses are still finite.
LEAST, MOST = 1e-30, 1e30


def _not_tiny(value: float) -> float:
    if value < LEAST:
        raise ValueError(f"Input should be at least {LEAST:g}")
    return value


Finite = Annotated[float, Strict(), Field(ge=-MOST, le=MOST, allow_inf_nan=False)]
Positive = Annotated[
    float, Strict(), Field(gt=0.0, le=MOST, allow_inf_nan=False), AfterValidator(_not_tiny)
]
NonNegative = Annotated[float, Strict(), Field(ge=0.0, le=MOST, allow_inf_nan=False)]
Restitution = Annotated[float, Strict(), Field(ge=0.0, le=1.0, allow_inf_nan=False)]


class Frozen(BaseModel):
    """A frozen value whose constructor raises `InputError` for whatever is missing, unknown or out
    of range.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise from_validation(error, type(self).model_fields) from None

    def replace(self, **change: object) -> Self:
        """A copy with some fields changed, validated like any other; all other fields stay."""
        return type(self)(
            **{name: getattr(self, name) for name in type(self).model_fields} | change
        )


@dataclass(frozen=True, kw_only=True)
class View:
    """How objects of one class show themselves: as HTML in a notebook, and as a figure."""

    html: Callable[[Any], str]
    figure: Callable[[Any], Figure]


class Shown:
    """Something that a notebook can show, and that has a figure."""

    def plot(self) -> Figure:
        """The object as a matplotlib figure."""
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
