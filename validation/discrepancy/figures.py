"""A figure: the value of one measure, as it is stored."""

from __future__ import annotations

from pydantic import ConfigDict

from rockcheck.scenes.base import Frozen

#: How the note begins of a figure that asks nothing here, as a ratio to nothing does.
NOT_DEFINED = "not defined here"


class Stored(Frozen):
    """A value of `run.json`; a float that is not finite is written as null."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="null")


def value_words(value: float | None, *, yes_no: bool) -> str:
    """A figure's value for people: "-" where there is none, yes or no where the measure asks a
    question."""
    if value is None:
        return "-"
    return ("yes" if value else "no") if yes_no else f"{value:.6g}"


class MeasureRecord(Stored):
    """How a measure is defined, for the pages: see `validation.discrepancy.measures`."""

    name: str
    label: str
    unit: str
    formula: str
    source: str = ""


class Figure(Stored):
    """The value of one measure of one cell.

    `against` names the reference model, "closed form" or, for a figure of the cell itself, is
    empty. `until` is the end of the window in s, None for the whole common time; `window` says it
    as the tolerances do ("", "8s", "horizon"). `value` is None where it could not be computed;
    `note` then says why. `note` also holds what a figure cannot (which event).
    """

    measure: str
    label: str
    unit: str
    value: float | None
    against: str = ""
    window: str = ""
    until: float | None = None
    note: str = ""

    @property
    def undefined(self) -> bool:
        """Whether the measure asks nothing here, so that nothing is judged; its note says why."""
        return self.value is None and self.note.startswith(NOT_DEFINED)

    @property
    def of_a_fall(self) -> bool:
        """Whether it is the peak rotation of a block that has fallen, which is no peak: the
        measure's note says so."""
        return self.measure == "peak_rotation" and bool(self.note)
