"""Which models a command plays, and with which settings.

In: the words of --model, --models and --set. Out: names and settings, or one line that says what is
allowed. Commands that play call it.
"""

import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

from rockcheck.scenes import InputError, errors, printable
from rockcheck.validation.execute.models import FAMILIES, build, is_own, not_installed

#: All models that are installed.
ALL = "all"


def chosen_models(names: str = ALL, settings: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """The models by name, each with its settings; of all, those that are installed.

    Raises `InputError` for an unknown one, and for a setting that is not allowed.
    """
    named = (
        (name for name in FAMILIES if name != "measured" and not not_installed(name))
        if names == ALL
        else filter(None, map(str.strip, names.split(",")))
    )
    chosen = list(dict.fromkeys(named))
    if not chosen or "measured" in chosen:
        raise InputError(
            f"{printable(names)!r} is not allowed: models that play, with commas between, or all",
            "--models",
        )
    by_model = _settings_by_model(settings, chosen)
    for name, given in by_model.items():
        if not is_own(name):
            build(name, given)
    return by_model


def _settings_by_model(settings: Iterable[str], models: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The settings of each of these models, from words `MODEL.key=value`."""
    words: dict[str, list[str]] = {name: [] for name in models}
    for text in settings:
        model, dot, rest = text.partition(".")
        if not dot or model not in words:
            raise InputError(
                f"{printable(text)!r}: write MODEL.key=value, with MODEL one of"
                f" {', '.join(models)}",
                "--set",
            )
        words[model].append(rest)
    return {name: settings_of(own) for name, own in words.items()}


def names_in(words: Iterable[str]) -> list[str]:
    """The names in words, which may hold several with commas between; each once."""
    names = [name.strip() for word in words for name in word.split(",")]
    return list(dict.fromkeys(names))


def check_one_model(name: str, command: str) -> None:
    """Raise `InputError` for several models where a command plays one."""
    if "," in name:
        raise InputError(
            f"{printable(name)!r} is not allowed: {command} plays one model; validate and assess"
            " take several",
            "--model",
        )


def need_installed(names: Iterable[str], option: str) -> None:
    """Raise `NotInstalled` for the first model whose engine is not installed."""
    for name in names:
        if hint := not_installed(name):
            raise errors.NotInstalled(hint, f"{option} {name}")


def settings_of(words: Iterable[str], option: str = "--set") -> dict[str, Any]:
    """The values of words `key=value` by their keys, as in TOML; a bare value is a string.

    Raises `InputError` for a word of another form, and for a key that is given twice.
    """
    found: dict[str, Any] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not key.isidentifier():
            raise InputError(f"{printable(word)!r}: write key=value", option)
        if key in found:
            raise InputError(f"{key} is given twice: give one value", option)
        try:
            found[key] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[key] = value
    return found
