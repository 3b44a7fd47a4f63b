"""Base of all scene objects: frozen, strictly validated, with a registered display.

An invalid value raises `InputError` with a message of one line. The package draws nothing: another
package registers a `View` for a class of scene, history, spectrum or comparison by an entry point
of the group `rockcheck.views`; rockcheck's own is `rockcheck.reports.show`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import entry_points
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Self, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, ValidationError

from rockcheck.scenes.errors import InputError, from_validation, unknown_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
#: The data that come with the package: scenes, records and the experience of the suites.
DATA = Path(str(resources.files("rockcheck.scenes"))) / "data"
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
    """An immutable value; its constructor raises `InputError` for invalid fields.

    A field is invalid if it is missing, unknown or out of range.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, *values: Any, **data: Any) -> None:
        if values:
            raise _without_names(type(self))
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise from_validation(error, type(self).model_fields) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Raises `InputError`: a field is changed in a copy, by `replace`."""
        if name.startswith("_"):
            super().__setattr__(name, value)
            return
        raise _is_frozen(type(self), name)

    def __delattr__(self, name: str) -> None:
        """Raises `InputError`, as `__setattr__`."""
        raise _is_frozen(type(self), name)

    def replace(self, **change: object) -> Self:
        """A copy with some fields changed, validated like any other."""
        return type(self)(
            **{name: getattr(self, name) for name in type(self).model_fields} | change
        )


def _without_names(kind: type[Frozen]) -> InputError:
    """The error for values that are given without the names of their fields."""
    names = ", ".join(kind.model_fields)
    first = next(iter(kind.model_fields))
    return InputError(
        f"{kind.__name__} takes its values by name, as in {kind.__name__}({first}=...); names:"
        f" {names}"
    )


def _is_frozen(kind: type[Frozen], name: str) -> InputError:
    """The error for a field, or what was meant to be one, that is assigned or deleted."""
    if name not in kind.model_fields:
        return unknown_name(f"field of {kind.__name__}", name, kind.model_fields)
    return InputError(
        f"{kind.__name__} does not change: replace({name}=...) gives a changed copy", name
    )


@dataclass(frozen=True, kw_only=True)
class View:
    """Display of the objects of one class: HTML for a notebook, and a figure.

    `figure` is the place of the function that draws one, "module:function". It is imported when it
    is called, for matplotlib takes a second.
    """

    html: Callable[[Any], str]
    figure: str


class Shown:
    """An object with a figure and an HTML representation, by the `View` of its class."""

    def plot(self) -> Figure:
        """The object as a matplotlib figure."""
        return cast("Figure", resolve_name(_view_of(type(self)).figure)(self))

    def _repr_html_(self) -> str:
        return _view_of(type(self)).html(self)


def _view_of(kind: type) -> View:
    entries = (entry.load() for entry in entry_points(group="rockcheck.views"))
    views = {shown: view for entry in entries for shown, view in entry.items()}
    return next(views[base] for base in kind.__mro__ if base in views)
