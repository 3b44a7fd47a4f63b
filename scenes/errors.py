"""Exceptions with messages of one line: unusable input, or a model that cannot finish."""

import re
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any
from unicodedata import category

if TYPE_CHECKING:
    from pydantic import ValidationError

#: Exit code of a fault in rockcheck itself, EX_SOFTWARE of sysexits: no verdict has it.
FAULT = 70


class InputError(ValueError):
    """Unusable input; the message is one line: where, what, and what is allowed.

    `key` is the dotted path of the offending setting within its object, empty if there is none.
    `file` is the file that the message begins with, None if it names none yet.
    """

    def __init__(self, message: str, key: str = "", *, file: Path | None = None) -> None:
        self.key = key
        self.file = file
        self.reason = message
        super().__init__(f"{key}: {message}" if key else message)


class NotInstalled(InputError):
    """A model's engine is not installed; the message says how to install it."""


class ModelFailure(RuntimeError):
    """A model could not finish a scene: blow-up, unsupported physics, or a cap reached.

    Its cell fails; the run continues.
    """


def check_kind(value: object, kind: type, how: str, key: str) -> None:
    """Raise `InputError` unless `value` is a `kind`; `how` names a source of one."""
    if not isinstance(value, kind):
        n = "n" * kind.__name__.startswith(("A", "E", "I", "O", "U"))
        raise InputError(
            f"{printable(repr(value))} is not allowed: give a{n} {kind.__name__}, as from {how}",
            key,
        )


#: Most names that a message lists.
MOST_NAMES = 100


def unknown_name(what: str, name: str, allowed: Iterable[str]) -> InputError:
    """An `InputError` for a name that is not among `allowed`, suggesting the nearest one."""
    return InputError(f"unknown {what} {printable(name)!r}{suggestion(name, allowed)}")


def one_of(what: str, given: str, allowed: Collection[str]) -> Any:
    """The name that was `given`; raises `unknown_name` unless it is among `allowed`."""
    if given not in allowed:
        raise unknown_name(what, given, allowed)
    return given


def suggestion(name: str, allowed: Iterable[str]) -> str:
    """Hint after a name that is not among `allowed`: the nearest one, and all of them.

    At most `MOST_NAMES` are listed; empty if none is allowed.
    """
    names = sorted(allowed)
    near = get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"; {hint}allowed: {', '.join(names[:MOST_NAMES])}{more}" if names else ""


def inert(text: str) -> str:
    """`text` without characters that steer a terminal or a page: each becomes "?".

    These are control characters, and those that turn the order of text (U+202E). Line breaks and
    every kind of blank stay.
    """
    if all(line.isprintable() for line in text.split("\n")):
        return text
    return "".join(c if c.isprintable() or c == "\n" or category(c) == "Zs" else "?" for c in text)


def printable(value: object, limit: int = 80) -> str:
    """`value` as one line of at most `limit` characters, safe to write to a terminal.

    Control characters become "?"; a path is never shortened.
    """
    text = "".join(c if c.isprintable() else "?" for c in str(value))
    return text if len(text) <= limit or isinstance(value, PurePath) else text[: limit - 3] + "..."


#: What pydantic adds to the place of a fault where a value may be of several kinds.
_KINDS = ("int", "constrained-int", "constrained-str", "str", "tuple[str, ...]")


def _shown(value: float | str) -> str:
    """A value of a setting; of a text that looks like a number, that it is one."""
    given = printable(value)
    is_like_a_number = isinstance(value, str) and re.fullmatch(r"\s*[-+.\deE]+\s*", given)
    return f"the text '{given}'" if is_like_a_number else given


def from_validation(error: "ValidationError", keys: Iterable[str] = ()) -> InputError:
    """The first fault that pydantic found, as one line: key, value, what is allowed.

    An unknown key comes before a missing one. `keys` are the allowed ones.
    """
    faults = error.errors(include_url=False)
    # A misspelt key is unknown, and the right one missing: the unknown one shows what to mend.
    fault = (
        next((one for one in faults if one["type"] == "extra_forbidden"), faults[0])
        if faults[0]["type"] == "missing"
        else faults[0]
    )
    path = [printable(part) for part in fault["loc"] if part not in _KINDS]
    if path[:1] in (["excitation"], ["vertical"]):
        del path[1:2]  # the excitation's kind, which pydantic adds
    inner = fault.get("ctx", {}).get("error")
    if isinstance(inner, InputError):
        return InputError(inner.reason, ".".join([*path, inner.key] if inner.key else path))
    message = fault["msg"].removeprefix("Value error, ")
    key = ".".join(path)
    match fault["type"]:
        case "extra_forbidden":
            message = f"unknown key{suggestion(path[-1], keys)}"
        case "missing" | "union_tag_not_found":
            message = "is missing" if fault["type"] == "missing" else "kind is missing"
        case "union_tag_invalid":
            known = re.findall(r"'([^']*)'", str(fault["ctx"]["expected_tags"]))
            message = str(unknown_name("kind", str(fault["ctx"]["tag"]), known))
        case "tuple_type" | "list_type":
            given = printable(fault["input"], 60)
            message = f"{given} is not allowed: give a list, [...] or [[...]]"
        case _ if isinstance(fault["input"], int | float | str | bool):
            given = _shown(fault["input"])
            message = f"{given} is not allowed: {message[0].lower()}{message[1:]}"
    return InputError(message, key)
