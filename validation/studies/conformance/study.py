"""`rockcheck conformance`: engines, user-defined models and histories, judged by phenomena.

Each phenomenon has a certain answer; histories may be written elsewhere. `export` writes the scenes
for an engine elsewhere.
"""

import math
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from junitparser import Error, Failure as Failed, JUnitXml, Skipped, TestCase, TestSuite

from rockcheck.engines.base_motion import BaseMotion
from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.observation import scene_notes
from rockcheck.scenes.reading import read_json
from rockcheck.scenes.writing import table_text, write_whole
from rockcheck.validation.execute.models import build, build_own, family, is_own
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.execute.provenance import cell_key, version_of
from rockcheck.validation.finding import (
    Block,
    Column,
    Finding,
    Mark,
    Table,
    Text,
    Verdict,
    text,
)
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA, SCENES, Motion
from rockcheck.validation.study import Study, Task

#: The file that describes a folder of histories; the name of unnamed settings.
ABOUT, AS_IT_COMES = "engine.toml", "as it comes"
#: Default time step, and usual CPU time of a step, s.
STEP, A_STEP = 1e-3, 1e-4
#: A value that moved by more than this share of its limit has changed.
SHARE = 0.1
#: Verdicts, their words, their colours, and their JUnit results.
VERDICTS: dict[str, tuple[str, Verdict, Any]] = {
    "pass": ("conforms", "pass", None),
    "fail": ("fails", "fail", Failed),
    "lacks": ("has none", "incomplete", Skipped),
    "reported": ("reported", "", Skipped),
    "error": ("error", "error", Error),
}


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
class Player:
    """A participant: a model by name, with the settings that it is built with.

    `engine`, `version`, `settings` and `step` (s) are the words of its card. `cost` is the usual
    CPU time of a simulated second; `search` lists folders that may hold the user's code.
    """

    engine: str
    settings: str
    step: float | str | None
    model: str
    given: Mapping[str, Any] = field(hash=False)
    version: str = ""
    lacks: tuple[str, ...] = ()
    search: tuple[str, ...] = ()
    cost: float = 0.0


def named(name: str, settings: str | None, given: Mapping[str, Any]) -> Player:
    """An engine, with rockcheck's best settings unless others are named, or a "module:Class"."""
    own = is_own(name)
    kind = {"settings": settings or "best"} if settings or not own else {}
    built_by = {"time_step": STEP, **kind, **given}
    if not own:
        build(name, built_by)  # an unusable player is refused before anything runs
    more = (
        f"{key}={value}" for key, value in given.items() if key not in ("settings", "time_step")
    )
    step = built_by["time_step"]
    return Player(
        name,
        ", ".join([str(built_by.get("settings", AS_IT_COMES)), *more]),
        step,
        name,
        built_by,
        "" if own else version_of(family(name).libraries[0]),
        search=(str(Path.cwd()),) if own else (),
        cost=A_STEP / (step if isinstance(step, float) and step > 0.0 else STEP),
    )


def written(folder: Path) -> Player:
    """A folder with a CSV for each scene, and an `engine.toml` that says whose they are."""
    allowed = {"engine": str, "version": str, "settings": str, "step": float, "lacks": list}
    about = {"engine": ""} | read_toml(folder / ABOUT)
    for key, value in about.items():
        if not isinstance(value, allowed.get(key, ())) or (key == "engine" and not value):
            reason = f"{printable(repr(value))} is not allowed; allowed: {', '.join(allowed)}"
            raise InputError(reason, f"{printable(folder / ABOUT)}: {printable(key)}")
    return Player(
        about["engine"],
        about.get("settings") or AS_IT_COMES,
        about.get("step"),
        "measured",
        {"files": {name: str(folder / f"{name}.csv") for name in SCENES}},
        about.get("version", ""),
        tuple(map(str, about.get("lacks", ()))),
    )


@dataclass(frozen=True)
class Seen:
    """The result of a player: a value, or None where it lacks a part or no value could be read."""

    value: float | None
    verdict: str
    reason: str
    version: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial(Task):
    """One player and one phenomenon, whose scenes it plays."""

    player: Player
    id: str

    @property
    def label(self) -> str:
        """Engine, settings, phenomenon."""
        return f"{self.player.engine}, {self.player.settings}: {self.id}"

    def depends(self) -> Any:
        """Also the model's own code, and the files of histories."""
        who, scenes = self.player, PHENOMENA[self.id].scenes
        cells = [cell_key(scene, who.model, who.given, who.search) for scene in scenes]
        return {**super().depends(), "cells": cells}

    def play(self) -> Seen:
        """Plays the scenes, reads the value off, and judges it."""
        who, what = self.player, PHENOMENA[self.id]
        sys.path.extend(path for path in who.search if path not in sys.path)
        model: Any = build_own(who.model, who.given)
        version = who.version or str(getattr(model, "version", ""))
        if what.needs in tuple(who.lacks or getattr(model, "lacks", tuple)()):
            reason = f"the engine has no {what.needs} with these settings"
            return Seen(None, "lacks", reason, version)
        histories = [model.simulate(scene) for scene in what.scenes]
        if who.model == "measured":
            for scene, history in zip(what.scenes, histories, strict=True):
                _in_units(scene, history)
        try:
            value = float(what.value(*map(Motion, histories)))
        except (ValueError, IndexError) as error:  # the motion lacks the wanted event
            raise ModelFailure(printable(error, 200)) from None
        told = set(chain.from_iterable(map(scene_notes, what.scenes)))  # of our own scenes
        said = chain.from_iterable(history.notes for history in histories)
        notes = dict.fromkeys(note for note in said if note not in told)
        shown = value if math.isfinite(value) else None
        return Seen(shown, *what.judge(value), version, tuple(notes))


@dataclass(frozen=True)
class Conformance(Study):
    """The players whose conformance is judged."""

    players: tuple[Player, ...]
    name = "conformance"
    record = Seen

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Trial]:
        """Player by player."""
        return [
            Trial(player, id, expected=player.cost * sum(scene.duration for scene in what.scenes))
            for player in self.players
            for id, what in PHENOMENA.items()
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """A card a player. Raises `InputError` where one cannot be built at all."""
        cards = [
            _card(player, found)
            for player in self.players
            if (found := {id: done[t] for id in PHENOMENA if (t := Trial(player, id)) in done})
        ]
        wrong = [card["counts"]["fail"] + card["counts"]["error"] for card in cards]
        failing = sum(count > 0 for count in wrong)
        asked = sum(card["counts"]["total"] for card in cards)
        return Finding(
            self.name,
            "Conformance: phenomena with a certain answer",
            f"{len(cards) - failing} of {len(cards)} cards conform; of {asked} phenomena"
            f" {sum(wrong)} failed.",
            list(_blocks(cards)),
            {"cards": cards},
            "fail" if failing else "pass",
            int(failing > 0),
            files={"junit.xml": junit(cards)},
        )


def _in_units(scene: Scene, history: History) -> None:
    """Raises `ModelFailure` for a history that does not begin and end as its scene does.

    As a rule a column is then in other units than its name says.
    """
    t, size = history.channels["t"], scene.block.radius
    for name, value in zip(("x", "y", "theta"), scene.initial_state, strict=False):
        first = float(history.channels.get(name, [value])[0])
        if not abs(first - value) <= 0.02 * (1.0 if name == "theta" else size):
            raise ModelFailure(
                f"unit? {name} begins at {first:.4g}, and the scene at {value:.4g}: columns are in"
                " SI units unless their names say otherwise, such as x_mm, theta_deg"
            )
    turned = float(np.max(np.abs(history.channels["theta"])))
    if turned > math.pi:
        raise ModelFailure(f"unit? theta reaches {turned:.4g} rad: degrees are called theta_deg")
    if turned < 1.0 and t[-1] < 0.9 * scene.duration - scene.output_step:
        raise ModelFailure(
            f"unit? t ends at {t[-1]:.4g} s, and the scene at {scene.duration:g} s: milliseconds"
            " are called t_ms"
        )


def _card(player: Player, found: Mapping[str, Seen | Failure]) -> Card:
    faults = {one.reason for one in found.values() if isinstance(one, Failure) and one.refused}
    if len(faults) == 1 and all(one.reason in faults for one in found.values()):
        raise InputError(*faults)
    seen = {
        id: Seen(None, "error", one.reason, "") if isinstance(one, Failure) else one
        for id, one in found.items()
    }
    rows = [
        {
            "id": id,
            "name": (what := PHENOMENA[id]).name,
            "target": what.target,
            "value": one.value,
            "limit": what.limit,
            "unit": what.unit,
            "verdict": one.verdict,
            "reason": one.reason,
        }
        for id, one in seen.items()
    ]
    counts = Counter(row["verdict"] for row in rows)
    version = next(filter(None, (one.version for one in seen.values())), player.version)
    return {
        "engine": player.engine,
        "version": version,
        "settings": player.settings,
        "step": player.step,
        "title": " ".join(filter(None, [player.engine, version])) + f", {player.settings}",
        "counts": {verdict: counts[verdict] for verdict in VERDICTS} | {"total": len(rows)},
        "phenomena": rows,
        "notes": list(dict.fromkeys(note for one in seen.values() for note in one.notes)),
    }


def _blocks(cards: Sequence[Card]) -> Iterator[Block]:
    about = [[card[column.name] for column in HEAD] for card in cards]
    yield Table(
        "engines",
        [*HEAD, *(Column(key, words) for key, (words, *_) in VERDICTS.items()), Column("total")],
        [[*head, *card["counts"].values()] for head, card in zip(about, cards, strict=True)],
    )
    wrong = [
        f"{card['title']}: {row['id']} {row['name']}: {row['reason']}"
        for card in cards
        for row in card["phenomena"]
        if row["verdict"] == "fail"
    ]
    of = [
        {
            row["id"]: Mark(
                row["value"],
                VERDICTS[row["verdict"]][1],
                row["reason"],
                digits=6 if (row["limit"] or 1.0) < 1e-3 else 3,
            )
            for row in card["phenomena"]
        }
        for card in cards
    ]
    yield Table(
        "cards",
        [
            text("phenomenon"),
            Column("target"),
            Column("limit"),
            text("unit"),
            *(Column(card["title"]) for card in cards),
        ],
        [
            [f"{id} {one.name}", one.target, one.limit, one.unit, *(card.get(id) for card in of)]
            for id, one in PHENOMENA.items()
        ],
        "Cards",
        "Tiny scenes whose answer is closed or certain. One conforms where its value is within the"
        " limit of the target. –: the engine says that it has none.",
        on="page",
    )
    wrong += [f"{card['title']}: {note}" for card in cards for note in card["notes"]]
    if wrong:
        yield Text(title="What goes wrong", items=wrong)
    yield Table(
        "phenomena",
        [
            text("phenomenon"),
            text("source", "target from"),
            text("means", "what a failure means"),
            text("cure", "what to look at"),
        ],
        [[f"{id} {one.name}", one.source, one.means, one.cure] for id, one in PHENOMENA.items()],
        "The phenomena",
        on="page",
    )
    rows = [
        [*head, *row.values()]
        for head, card in zip(about, cards, strict=True)
        for row in card["phenomena"]
    ]
    yield Table("rows", [*HEAD, *map(Column, ROW)], rows, on="file")


def junit(cards: Sequence[Card]) -> str:
    """JUnit XML: a suite a card, a case a phenomenon."""
    document = JUnitXml("rockcheck conformance")
    for card in cards:
        suite = TestSuite(card["title"])
        for row in card["phenomena"]:
            case = TestCase(f"{row['id']} {row['name']}", suite.name)
            kind = VERDICTS[row["verdict"]][2]
            case.result = [kind(row["reason"])] if kind else []
            suite.add_testcase(case)
        document.add_testsuite(suite)
    return str(document.tostring(), "utf-8")


def wrote(path: Path) -> bool:
    """Whether the path is a finished study: a folder or its `run.json`."""
    try:
        data = read_json(path / "run.json" if path.is_dir() else path)
    except InputError:
        return False
    return isinstance(data, dict) and "cards" in data


def changes(before: Path, after: Path) -> Finding:
    """Changes between two finished studies, each a folder or its `run.json`.

    Listed are every changed verdict, and every value that moved by more than `SHARE` of its limit.
    Cards are matched by engine and settings. Exit code 1 where a phenomenon conformed before and
    does not any more.
    """
    old, new = _read(before), _read(after)
    gone = {"version": "", "value": None, "verdict": "absent"}
    pairs = {
        key: (old.get(key) or new[key] | gone, new.get(key) or old[key] | gone)
        for key in {**old, **new}
    }
    rows = []
    for key, (was, now) in pairs.items():
        known = None not in (was["value"], now["value"], was["limit"])
        moved = known and abs(now["value"] - was["value"]) > SHARE * was["limit"]
        if moved or was["verdict"] != now["verdict"]:
            told = [one[name] for name in ("version", "verdict", "value") for one in (was, now)]
            worse = was["verdict"] == "pass" and now["verdict"] in ("fail", "error", "absent")
            rows.append([*key, was["name"], *told, worse])
    worst = sum(row[-1] for row in rows)
    return Finding(
        "conformance-changes",
        "Conformance: what changed",
        f"{len(rows)} changes, {worst} for the worse",
        [
            Table(
                "changes",
                [
                    Column("engine", kind="model"),
                    text("settings"),
                    text("id", "no."),
                    text("phenomenon", brief=False),
                    text("version_before", brief=False),
                    text("version_after", brief=False),
                    text("verdict_before"),
                    text("verdict_after"),
                    Column("value_before"),
                    Column("value_after"),
                    text("worse", brief=False),
                ],
                rows,
            )
        ],
        verdict="fail" if worst else "changed" if rows else "pass",
        exit_code=int(worst > 0),
    )


def _read(path: Path) -> dict[tuple[str, str, str], dict[str, Any]]:
    path = path / "run.json" if path.is_dir() else path
    data = read_json(path)
    try:
        return {
            (row["engine"], row["settings"], row["id"]): row
            | {name: row[name] and float(row[name]) for name in ("value", "limit")}
            | {name: str(row[name]) for name in ("name", "version", "verdict")}
            for row in data["tables"]["rows"]
        }
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{printable(path)}: not what `rockcheck conformance` wrote") from None


TEXTS = Path(__file__).parents[2] / "data" / "export"
#: Time step of the sampled base motion, s.
BASE_STEP = 1e-3
STATE = ("x_m", "y_m", "theta_rad", "x_dot_m_s", "y_dot_m_s", "theta_dot_rad_s")
MOTION = ("t_s", "x_velocity_m_s", "y_velocity_m_s", "x_acceleration_m_s2", "y_acceleration_m_s2")


def export(folder: Path) -> list[str]:
    """Write all scenes as tables into a folder; returns their names.

    An existing `engine.toml` stays as it is.
    """
    for name, scene in SCENES.items():
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            t = BASE_STEP * np.arange(round(scene.duration / BASE_STEP) + 1)
            velocity = list(map(BaseMotion(scene).velocity, t.tolist()))
            accelerations = (one.acceleration(t) for one in (scene.excitation, scene.vertical))
            rows = np.column_stack([t, velocity, *accelerations]).tolist()
            write_whole(folder / f"{name}-base.csv", table_text(MOTION, rows))
    scenes = [_row(scene) for scene in SCENES.values()]
    write_whole(
        folder / "scenes.csv", table_text(tuple(scenes[0]), [tuple(row.values()) for row in scenes])
    )
    played = [
        f"- {one.id} {one.name}: {', '.join(scene.name for scene in one.scenes)}"
        for one in PHENOMENA.values()
    ]
    about = (TEXTS / "README.md").read_text(encoding="utf-8")
    write_whole(folder / "README.md", "\n".join([about, *played, ""]))
    if not (folder / ABOUT).exists():
        write_whole(folder / ABOUT, (TEXTS / ABOUT).read_text(encoding="utf-8"))
    return list(SCENES)


def _row(scene: Scene) -> dict[str, Any]:
    walls = {wall.side: wall for wall in scene.walls}
    return {
        "scene": scene.name,
        "duration_s": scene.duration,
        "output_step_s": scene.output_step,
        "gravity_m_s2": scene.gravity,
        "half_width_m": scene.block.half_width,
        "half_height_m": scene.block.half_height,
        "friction": scene.floor.friction,
        "floor_restitution": scene.floor.restitution,
        **{
            f"{side}_wall_{name}": getattr(walls.get(side), key, "")
            for side in ("left", "right")
            for name, key in (("gap_m", "gap"), ("restitution", "restitution"))
        },
        **dict(zip(STATE, map(float, scene.initial_state), strict=True)),
    }
