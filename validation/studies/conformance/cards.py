"""Cards: engines, user-defined models and histories, judged by phenomena with a certain answer.

In go players; out come a card each, with tables, JUnit and an exit code. `rockcheck conformance`
calls it.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rockcheck.scenes import InputError, ModelFailure, writing
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Block, Column, Finding, Mark, Table, Text, Verdict, text
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA
from rockcheck.validation.studies.conformance.players import Player
from rockcheck.validation.studies.conformance.trial import Result, Trial
from rockcheck.validation.study import Study

#: Of a phenomenon's time limit: the least, s, and how many times its usual time.
LEAST_LIMIT, USUAL_TIMES = 120.0, 100.0


@dataclass(frozen=True)
class Wording:
    """How a verdict is shown: its column, its colour, its JUnit case, and its count in words."""

    column: str
    colour: Verdict
    junit: Any
    one: str
    many: str


WORDINGS: dict[str, Wording] = {
    "pass": Wording("conforms", "pass", "", "conforms", "conform"),
    "fail": Wording("fails", "fail", "failed", "fails", "fail"),
    "lacks": Wording("has none", "incomplete", "skipped", "is lacking", "are lacking"),
    "reported": Wording("reported", "", "skipped", "is reported", "are reported"),
    "error": Wording("error", "error", "error", "ends in an error", "end in errors"),
    "absent": Wording("no file", "incomplete", "error", "has no file", "have no file"),
}
#: What keeps a card from conforming.
FAULTS = ("fail", "error", "absent")
#: A card, as in JSON; the columns that identify its player, and those of its rows.
Card = dict[str, Any]
HEAD = (
    Column("engine", kind="model"),
    text("version", brief=False),
    text("settings"),
    Column("step", unit="s", brief=False),
)
ROW = ("id", "name", "target", "value", "limit", "unit", "verdict", "reason")


@dataclass(frozen=True)
class Conformance(Study):
    """The players whose conformance is judged; `limit` is the time (s) of a phenomenon.

    Without one it is `USUAL_TIMES` times the usual time, at least `LEAST_LIMIT`.
    """

    players: tuple[Player, ...]
    limit: float | None = None
    name = "conformance"
    record = Result

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Trial]:
        """Player by player; what needs a file that is absent is left out."""
        return [
            self.trial(player, id)
            for player in self.players
            for id in PHENOMENA
            if not absent_scenes(player, id)
        ]

    def trial(self, player: Player, id: str) -> Trial:
        """A phenomenon as a player's task, with its usual time and its limit."""
        usual = player.cost * sum(scene.duration for scene in PHENOMENA[id].scenes)
        builtin = player.family in models.ENGINE_NAMES
        return Trial(
            player,
            id,
            expected=usual,
            seconds=self.limit or LEAST_LIMIT + USUAL_TIMES * usual,
            compiles=models.compiles(player.family, player.settings) if builtin else "",
        )

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """A card a player.

        Raises the error of a player that can play nothing, if there is no other player:
        `InputError` where it cannot be built, `ModelFailure` where it fails alike everywhere.
        """
        results = {player: results_of(player, done) for player in self.players}
        common = {player: common_failure(found) for player, found in results.items() if found}
        if common and all(common.values()):
            raise_failure(next(filter(None, common.values())))
        cards = [card_of(player, found) for player, found in results.items() if found]
        for card, failure in zip(cards, common.values(), strict=True):
            card["common_fault"] = failure.reason if failure else ""
        failing = sum(any(card["counts"][fault] for fault in FAULTS) for card in cards)
        return Finding(
            self.name,
            "Conformance: phenomena with a certain answer",
            answer_of(cards, len(cards) - failing),
            blocks_of(cards),
            {"cards": cards},
            "fail" if failing else "pass",
            int(failing > 0),
            files={"junit.xml": junit_of(cards)},
        )


def absent_scenes(player: Player, id: str) -> list[str]:
    """The scenes of a phenomenon of which the player's folder has no file."""
    return [scene.name for scene in PHENOMENA[id].scenes if scene.name in player.absent]


def results_of(player: Player, done: Mapping[Any, Any]) -> dict[str, Result | pool.Failure]:
    """By phenomenon, what came of it; those that there was no time for are left out."""
    results: dict[str, Result | pool.Failure] = {}
    for id in PHENOMENA:
        trial = Trial(player, id)
        if trial in done:
            results[id] = done[trial]
        elif absent := absent_scenes(player, id):
            files = ", ".join(f"{name}.csv" for name in absent)
            results[id] = Result(None, "absent", f"no file {files}", "")
    return results


def common_failure(results: Mapping[str, Result | pool.Failure]) -> pool.Failure | None:
    """The failure that is the same in every phenomenon, if there is one."""
    failures = [result for result in results.values() if isinstance(result, pool.Failure)]
    reasons = {failure.reason for failure in failures}
    played = [
        result
        for result in results.values()
        if isinstance(result, Result) and result.verdict != "lacks"
    ]
    if len(failures) < 2 or len(reasons) > 1 or played:
        return None
    return failures[0]


def raise_failure(failure: pool.Failure) -> None:
    """As the model or its class did."""
    if failure.refused:
        raise InputError(failure.reason)
    raise ModelFailure(failure.reason)


def card_of(player: Player, results: Mapping[str, Result | pool.Failure]) -> Card:
    """The card of a player."""
    judged = {
        id: Result(None, "error", result.reason, "") if isinstance(result, pool.Failure) else result
        for id, result in results.items()
    }
    rows = []
    for id, result in judged.items():
        values = vars(PHENOMENA[id]) | vars(result)
        rows.append({name: values[name] for name in ROW})
    counts = Counter(row["verdict"] for row in rows)
    versions = [result.version for result in judged.values() if result.version]
    version = versions[0] if versions else player.version
    notes = [note for result in judged.values() for note in result.notes]
    return {
        "engine": player.label,
        "version": version,
        "settings": player.setup,
        "step": player.step,
        "title": " ".join(filter(None, [player.label, version])) + f", {player.setup}",
        "counts": {verdict: counts[verdict] for verdict in WORDINGS} | {"total": len(rows)},
        "phenomena": rows,
        "notes": list(dict.fromkeys(notes)),
    }


def answer_of(cards: Sequence[Card], conforming: int) -> str:
    """The last line: counts that add up."""
    totals = {verdict: sum(card["counts"][verdict] for card in cards) for verdict in WORDINGS}
    words = [
        f"{count} {WORDINGS[verdict].one if count == 1 else WORDINGS[verdict].many}"
        for verdict, count in totals.items()
        if count
    ]
    head = f"{conforming} of {len(cards)} cards conform; of {sum(totals.values())} phenomena "
    return f"{head}{', '.join(words)}."


def junit_of(cards: Sequence[Card]) -> str:
    """The cards as JUnit's suites, a case a phenomenon."""
    suites = []
    for card in cards:
        cases = []
        for row in card["phenomena"]:
            ended = WORDINGS[row["verdict"]].junit
            name = f"{row['id']} {row['name']}"
            cases.append((card["title"], name, ended, row["reason"], "", None))
        suites.append((card["title"], cases))
    return writing.junit_text("rockcheck conformance", suites)


def blocks_of(cards: Sequence[Card]) -> list[Block]:
    """The tables of a finding, and what goes wrong."""
    blocks: list[Block] = [engines_table(cards), cards_table(cards)]
    if wrong := lines_of_faults(cards):
        blocks.append(Text(title="What goes wrong", items=wrong))
    return [*blocks, phenomena_table(), rows_table(cards)]


def head_of(card: Card) -> list[Any]:
    """The cells that identify a card's player."""
    return [card[column.name] for column in HEAD]


def engines_table(cards: Sequence[Card]) -> Table:
    """Counts by card; the column of absent files stands where there are any."""
    shown = [
        verdict
        for verdict in WORDINGS
        if verdict != "absent" or any(card["counts"]["absent"] for card in cards)
    ]
    columns = [Column(verdict, WORDINGS[verdict].column) for verdict in shown]
    return Table(
        "engines",
        [*HEAD, *columns, Column("total")],
        [
            [*head_of(card), *(card["counts"][verdict] for verdict in (*shown, "total"))]
            for card in cards
        ],
    )


def cards_table(cards: Sequence[Card]) -> Table:
    """All cards side by side, a row a phenomenon."""
    marks = [{row["id"]: mark_of(row) for row in card["phenomena"]} for card in cards]
    rows = []
    for id, phenomenon in PHENOMENA.items():
        results = [card.get(id) for card in marks]
        about = [phenomenon.target, phenomenon.limit, phenomenon.unit]
        rows.append([f"{id} {phenomenon.name}", *results, *about])
    results_columns = [Column(card["title"]) for card in cards]
    return Table(
        "cards",
        [text("phenomenon"), *results_columns, Column("target"), Column("limit"), text("unit")],
        rows,
        "Cards",
        "Tiny scenes whose answer is closed or certain. One conforms where its value is within the"
        " limit of the target. –: the engine says that it has none.",
        on="page",
    )


def mark_of(row: Mapping[str, Any]) -> Mark:
    """The value of a row with its verdict's colour."""
    digits = 6 if (row["limit"] or 1.0) < 1e-3 else 3
    return Mark(row["value"], WORDINGS[row["verdict"]].colour, row["reason"], digits=digits)


def lines_of_faults(cards: Sequence[Card]) -> list[str]:
    """What fails, and what engines note; a fault of all phenomena once."""
    lines = [
        f"{card['title']}: {row['id']} {row['name']}: {row['reason']}"
        for card in cards
        for row in card["phenomena"]
        if row["verdict"] == "fail"
    ]
    for card in cards:
        if card["common_fault"]:
            lines.append(f"{card['title']}: plays nothing: {card['common_fault']}")
        lines += [f"{card['title']}: {note}" for note in card["notes"]]
    return lines


def phenomena_table() -> Table:
    """Where the targets come from, and what a failure means."""
    return Table(
        "phenomena",
        [
            text("phenomenon"),
            text("source", "target from"),
            text("means", "what a failure means"),
            text("cure", "what to look at"),
        ],
        [
            [f"{id} {phenomenon.name}", phenomenon.source, phenomenon.means, phenomenon.cure]
            for id, phenomenon in PHENOMENA.items()
        ],
        "The phenomena",
        on="page",
    )


def rows_table(cards: Sequence[Card]) -> Table:
    """Every phenomenon of every card, for programs."""
    return Table(
        "rows",
        [*HEAD, *map(Column, ROW)],
        [[*head_of(card), *row.values()] for card in cards for row in card["phenomena"]],
        on="file",
    )
