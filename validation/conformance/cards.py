"""Cards: what an engine's histories say about each phenomenon, written and read, and what changed between two of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.reading import read_json
from rockcheck.validation.conformance.phenomena import PHENOMENA, SCENES, Phenomenon

VERDICTS = {
    "pass": "conforms",
    "fail": "does not",
    "lacks": "the engine says that it has none",
    "error": "no history",
    "reported": "reported, not judged",
}


@dataclass(frozen=True)
class Row:
    """One phenomenon on a card."""

    id: str
    name: str
    target: float
    value: float
    limit: float
    verdict: str
    reason: str = ""

    @property
    def phenomenon(self) -> Phenomenon:
        """The phenomenon of this row."""
        return next(one for one in PHENOMENA if one.id == self.id)


@dataclass(frozen=True)
class Card:
    """An engine's card: which version, with which settings and step (s), and its rows."""

    engine: str
    version: str
    settings: str
    step: float
    phenomena: tuple[Row, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def failed(self) -> list[Row]:
        """The rows that fail, those without a history included."""
        return [row for row in self.phenomena if row.verdict in ("fail", "error")]

    @property
    def title(self) -> str:
        """One line."""
        return f"{self.engine} {self.version}, {self.settings}, {self.step:g} s".replace("  ", " ")


def make_card(
    play: Callable[[Scene], History],
    *,
    engine: str,
    version: str,
    settings: str,
    step: float,
    lacks: Iterable[str] = (),
    on_scene: Callable[[str], None] = lambda name: None,
) -> Card:
    """Plays every scene once, and judges. What goes wrong in `play` is told in the rows that need that scene."""
    histories: dict[str, History] = {}
    faults: dict[str, str] = {}
    for name, scene in SCENES.items():
        on_scene(name)
        try:
            histories[name] = play(scene)
        except (ModelFailure, InputError) as error:
            faults[name] = printable(error, 200)
        except Exception as error:  # one's own model may raise anything: it costs the cards that need this scene
            faults[name] = printable(f"{type(error).__name__}: {error}", 200)
    notes = tuple(dict.fromkeys(note for history in histories.values() for note in history.notes))
    rows = tuple(_row(phenomenon, histories, faults, tuple(lacks)) for phenomenon in PHENOMENA)
    return Card(engine, version, settings, step, rows, notes)


def _row(phenomenon: Phenomenon, histories: Mapping[str, History], faults: Mapping[str, str], lacks: Sequence[str]) -> Row:
    value, reason, verdict = math.nan, "", "error"
    missing = [faults[scene.name] for scene in phenomenon.scenes if scene.name in faults]
    if phenomenon.needs in lacks:
        verdict, reason = "lacks", f"the engine has no {phenomenon.needs} with these settings"
    elif missing:
        reason = missing[0]
    else:
        try:
            value = phenomenon.value(histories)
        except (InputError, ValueError, IndexError) as error:  # a motion in which what is asked for does not happen
            reason = printable(error, 200)
        else:
            verdict = phenomenon.verdict(value)
            reason = phenomenon.means if verdict == "fail" else ""
    return Row(phenomenon.id, phenomenon.name, phenomenon.target, value, phenomenon.limit, verdict, reason)


def as_json(cards: Sequence[Card]) -> dict[str, Any]:
    """Plain data; numbers that are not finite become null."""
    return {"cards": [_plain(asdict(card)) for card in cards]}


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def read_cards(path: Path) -> list[Card]:
    """The cards of a file that `as_json` was written to; raises `InputError` naming file and fault."""
    try:
        return [_card(one) for one in read_json(path)["cards"]]
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{printable(path)}: no cards that `rockcheck conformance` wrote") from None


def _card(data: Mapping[str, Any]) -> Card:
    rows = []
    for row in data["phenomena"]:
        numbers = {key: math.nan if row[key] is None else float(row[key]) for key in ("target", "value", "limit")}
        rows.append(Row(str(row["id"]), str(row["name"]), verdict=str(row["verdict"]), reason=str(row.get("reason", "")), **numbers))
    about = {key: str(data[key]) for key in ("engine", "version", "settings")}
    return Card(**about, step=float(data["step"]), phenomena=tuple(rows), notes=tuple(map(str, data.get("notes", ()))))


@dataclass(frozen=True)
class Change:
    """A phenomenon that one engine shows differently in two files of cards; verdict "absent" where a file has no such row."""

    engine: str
    settings: str
    versions: tuple[str, str]
    id: str
    name: str
    values: tuple[float, float]
    verdicts: tuple[str, str]

    @property
    def worse(self) -> bool:
        """Whether it conformed before, and does not any more."""
        return self.verdicts[0] == "pass" and self.verdicts[1] in ("fail", "error", "absent")


def changes(before: Sequence[Card], after: Sequence[Card], *, share: float = 0.1) -> list[Change]:
    """What differs: every verdict, and every value that moved by more than `share` of its limit. Cards meet by engine and settings."""
    old, new = ({(card.engine, card.settings): card for card in cards} for cards in (before, after))
    found = []
    for key in [*old, *(key for key in new if key not in old)]:
        rows = [{row.id: row for row in card.phenomena} if (card := cards.get(key)) else {} for cards in (old, new)]
        versions = tuple(cards[key].version if key in cards else "absent" for cards in (old, new))
        for id in dict.fromkeys([*rows[0], *rows[1]]):
            pair = [side.get(id) for side in rows]
            known = next(row for row in pair if row is not None)
            values = tuple(math.nan if row is None else row.value for row in pair)
            verdicts = tuple("absent" if row is None else row.verdict for row in pair)
            moved = abs(values[1] - values[0]) > share * known.limit if all(map(math.isfinite, values)) else False
            if verdicts[0] != verdicts[1] or moved:
                found.append(Change(*key, versions, id, known.name, values, verdicts))  # type: ignore[arg-type]
    return found


def junit(cards: Sequence[Card]) -> str:
    """JUnit XML: a suite a card, a case a phenomenon."""
    document = JUnitXml("rockcheck conformance")
    for card in cards:
        suite = TestSuite(card.title)
        for row in card.phenomena:
            case = TestCase(f"{row.id} {row.name}", card.title)
            words = f"{row.value:.4g}, {row.target:g} ± {row.limit:g} is right. {row.reason}"
            if row.verdict in ("fail", "error"):
                case.result = [(Failure if row.verdict == "fail" else Error)(words)]
            elif row.verdict in ("lacks", "reported"):
                case.result = [Skipped(row.reason or VERDICTS[row.verdict])]
            suite.add_testcase(case)
        document.add_testsuite(suite)
    text = document.tostring()
    return text.decode("utf-8") if isinstance(text, bytes) else str(text)


def markdown(cards: Sequence[Card]) -> str:
    """A table a card."""
    parts = ["# Conformance", "A phenomenon conforms where its value is within the limit of the target."]
    for card in cards:
        judged = [row for row in card.phenomena if row.verdict != "reported"]
        conform = sum(row.verdict == "pass" for row in judged)
        lines = [f"## {card.title}", "", f"{conform} of {len(judged)} conform.", ""]
        lines += ["| card | phenomenon | target | value | limit | verdict |", "| --- | --- | --- | --- | --- | --- |"]
        for row in card.phenomena:
            limit = f"{row.limit:g}" if math.isfinite(row.limit) else "–"
            value = f"{row.value:.4g}" if math.isfinite(row.value) else "–"
            lines.append(f"| {row.id} | {row.name} | {row.target:g} | {value} | {limit} | {VERDICTS.get(row.verdict, row.verdict)} |")
        for row in card.failed:
            lines += ["", f"- {row.id}: {row.reason} Look at: {row.phenomenon.cure}."]
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"
