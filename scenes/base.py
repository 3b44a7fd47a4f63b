"""What all scene objects share: frozen, strictly validated, faults told in one line."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, ValidationError

from rockcheck.scenes.errors import from_validation

#: Sizes of numbers in SI units that still have a square, a cube and an inverse.
LEAST, MOST = 1e-30, 1e30


def _not_tiny(value: float) -> float:
    if value < LEAST:
        raise ValueError(f"Input should be at least {LEAST:g}")
    return value


Finite = Annotated[float, Strict(), Field(ge=-MOST, le=MOST, allow_inf_nan=False)]
Positive = Annotated[float, Strict(), Field(gt=0.0, le=MOST, allow_inf_nan=False), AfterValidator(_not_tiny)]
NonNegative = Annotated[float, Strict(), Field(ge=0.0, le=MOST, allow_inf_nan=False)]
Restitution = Annotated[float, Strict(), Field(ge=0.0, le=1.0, allow_inf_nan=False)]


class Frozen(BaseModel):
    """A frozen value whose constructor raises `InputError` for whatever is missing, unknown or out of range."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise from_validation(error, type(self).model_fields) from None
