"""`rockcheck conformance`: engines, user-defined models and histories, judged by phenomena.

Each phenomenon has a certain answer; histories may be written elsewhere. `export` writes the scenes
for an engine elsewhere. `Tuning` (`--tune`) finds engines' parameters for a wanted restitution and
friction, by dropping a block and by sliding it.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.engines import base_motion, steps
from rockcheck.scenes import (
    Floats,
    Floor,
    History,
    Scene,
    errors,
    files,
    observation,
    printable,
    reading,
    writing,
)
from rockcheck.validation.execute import models, pool, provenance
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
from rockcheck.validation.studies.conformance.phenomena import (
    DROP,
    PHENOMENA,
    SCENES,
    SQUAT,
    G,
    Motion,
)
from rockcheck.validation.study import Study, Task

#: The file that describes a folder of histories; the name of unnamed settings.
ABOUT, AS_IT_COMES = "engine.toml", "as it comes"
#: Default time step, and usual CPU time of a step, s.
STEP, A_STEP = 1e-3, 1e-4
#: A value that moved by more than this share of its limit has changed.
SHARE = 0.1
#: Verdicts, their words, their colours, and what came of their JUnit cases.
VERDICTS: dict[str, tuple[str, Verdict, Any]] = {
    "pass": ("conforms", "pass", ""),
    "fail": ("fails", "fail", "failed"),
    "lacks": ("has none", "incomplete", "skipped"),
    "reported": ("reported", "", "skipped"),
    "error": ("error", "error", "error"),
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


@dataclass(frozen=True, kw_only=True)
class Player(models.Work):
    """A participant, by the engine's name.

    `version`, `setup` and `step` (s) are the words of its card besides. `cost` is the usual CPU
    time of a simulated second.
    """

    setup: str
    step: float | str | None
    version: str = ""
    lacks: tuple[str, ...] = ()
    cost: float = 0.0


def named(name: str, settings: str | None, given: Mapping[str, Any]) -> Player:
    """An engine, with rockcheck's best settings unless others are named, or a "module:Class"."""
    own = models.is_own(name)
    built_by = {
        "time_step": STEP,
        **({"settings": settings or "best"} if settings or not own else {}),
        **given,
    }
    if not own:
        models.build(name, built_by)  # an unusable player is refused before anything runs
    more = (
        f"{key}={value}" for key, value in given.items() if key not in ("settings", "time_step")
    )
    step = built_by["time_step"]
    return Player(
        label=name,
        family=name,
        settings=built_by,
        setup=", ".join([str(built_by.get("settings", AS_IT_COMES)), *more]),
        step=step,
        version="" if own else provenance.version_of(models.family(name).libraries[0]),
        search_path=(str(Path.cwd()),) if own else (),
        cost=A_STEP / (step if isinstance(step, float) and step > 0.0 else STEP),
    )


def written(folder: Path) -> Player:
    """A folder with a CSV for each scene, and an `engine.toml` that says whose they are."""
    allowed = {"engine": str, "version": str, "settings": str, "step": float, "lacks": list}
    about = {"engine": ""} | files.read_toml(folder / ABOUT)
    errors.refuse(
        *(
            (
                not isinstance(value, allowed.get(key, ())) or (key == "engine" and not value),
                f"{printable(repr(value))} is not allowed; allowed: {', '.join(allowed)}",
                f"{printable(folder / ABOUT)}: {printable(key)}",
            )
            for key, value in about.items()
        )
    )
    return Player(
        label=about["engine"],
        family="measured",
        settings={"files": {name: str(folder / f"{name}.csv") for name in SCENES}},
        setup=about.get("settings") or AS_IT_COMES,
        step=about.get("step"),
        version=about.get("version", ""),
        lacks=tuple(map(str, about.get("lacks", ()))),
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
        return f"{self.player.label}, {self.player.setup}: {self.id}"

    def depends(self) -> Any:
        """Also the model's own code, and the files of histories."""
        who, scenes = self.player, PHENOMENA[self.id].scenes
        return {
            **super().depends(),
            "cells": [
                provenance.cell_key(scene, who.family, who.settings, who.search_path)
                for scene in scenes
            ],
        }

    def play(self) -> Seen:
        """Plays the scenes, reads the value off, and judges it."""
        who, what = self.player, PHENOMENA[self.id]
        model: Any = models.build(who.family, who.settings, who.search_path)
        version = who.version or str(getattr(model, "version", ""))
        if what.needs in tuple(who.lacks or getattr(model, "lacks", tuple)()):
            return Seen(
                None, "lacks", f"the engine has no {what.needs} with these settings", version
            )
        histories = [model.simulate(scene) for scene in what.scenes]
        if who.family == "measured":
            for scene, history in zip(what.scenes, histories, strict=True):
                _in_units(scene, history)
        try:
            value = float(what.value(*map(Motion, histories)))
        except (ValueError, IndexError) as error:  # the motion lacks the wanted event
            raise errors.ModelFailure(printable(error, 200)) from None
        # Notes of our own scenes.
        told = set(chain.from_iterable(map(observation.scene_notes, what.scenes)))
        return Seen(
            value if math.isfinite(value) else None,
            *what.judge(value),
            version,
            tuple(
                dict.fromkeys(note for one in histories for note in one.notes if note not in told)
            ),
        )


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
        suites = [
            (
                card["title"],
                [
                    (
                        *(card["title"], f"{row['id']} {row['name']}"),
                        *(VERDICTS[row["verdict"]][2], row["reason"], "", None),
                    )
                    for row in card["phenomena"]
                ],
            )
            for card in cards
        ]
        return Finding(
            self.name,
            "Conformance: phenomena with a certain answer",
            f"{len(cards) - failing} of {len(cards)} cards conform; of"
            f" {sum(card['counts']['total'] for card in cards)} phenomena {sum(wrong)} failed.",
            list(_blocks(cards)),
            {"cards": cards},
            "fail" if failing else "pass",
            int(failing > 0),
            files={"junit.xml": writing.junit_text("rockcheck conformance", suites)},
        )


def _in_units(scene: Scene, history: History) -> None:
    """Raises `ModelFailure` for a history that does not begin and end as its scene does.

    As a rule a column is then in other units than its name says.
    """
    t, size = history.channels["t"], scene.block.radius
    begins = (
        (name, float(history.channels.get(name, [value])[0]), value, unit)
        for name, value, unit in zip(
            ("x", "y", "theta"), scene.initial_state, (size, size, 1.0), strict=False
        )
    )
    turned = float(np.max(np.abs(history.channels["theta"])))
    early = turned < 1.0 and t[-1] < 0.9 * scene.duration - scene.output_step
    for wrong, said in (
        *(
            (
                not abs(first - value) <= 0.02 * unit,
                f"{name} begins at {first:.4g}, and the scene at {value:.4g}: columns are in SI"
                " units unless their names say otherwise, such as x_mm, theta_deg",
            )
            for name, first, value, unit in begins
        ),
        (turned > math.pi, f"theta reaches {turned:.4g} rad: degrees are called theta_deg"),
        (
            early,
            f"t ends at {t[-1]:.4g} s, and the scene at {scene.duration:g} s: milliseconds are"
            " called t_ms",
        ),
    ):
        if wrong:
            raise errors.ModelFailure(f"unit? {said}")


def _card(player: Player, found: Mapping[str, Seen | pool.Failure]) -> Card:
    faults = {one.reason for one in found.values() if isinstance(one, pool.Failure) and one.refused}
    if len(faults) == 1 and all(one.reason in faults for one in found.values()):
        raise errors.InputError(*faults)
    seen = {
        id: Seen(None, "error", one.reason, "") if isinstance(one, pool.Failure) else one
        for id, one in found.items()
    }
    rows = [
        dict(zip(ROW, itemgetter(*ROW)(vars(PHENOMENA[id]) | vars(one)), strict=True))
        for id, one in seen.items()
    ]
    counts = Counter(row["verdict"] for row in rows)
    version = next(filter(None, (one.version for one in seen.values())), player.version)
    return {
        "engine": player.label,
        "version": version,
        "settings": player.setup,
        "step": player.step,
        "title": " ".join(filter(None, [player.label, version])) + f", {player.setup}",
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
    wrong = [
        *(
            f"{card['title']}: {row['id']} {row['name']}: {row['reason']}"
            for card in cards
            for row in card["phenomena"]
            if row["verdict"] == "fail"
        ),
        *(f"{card['title']}: {note}" for card in cards for note in card["notes"]),
    ]
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
    yield Table(
        "rows",
        [*HEAD, *map(Column, ROW)],
        [
            [*head, *row.values()]
            for head, card in zip(about, cards, strict=True)
            for row in card["phenomena"]
        ],
        on="file",
    )


def wrote(path: Path) -> bool:
    """Whether the path is a finished study: a folder or its `run.json`."""
    try:
        data = reading.read_json(path / "run.json" if path.is_dir() else path)
    except errors.InputError:
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
    rows = [
        [
            *key,
            was["name"],
            *(one[name] for name in ("version", "verdict", "value") for one in (was, now)),
            was["verdict"] == "pass" != now["verdict"],
        ]
        for key, (was, now) in pairs.items()
        if was["verdict"] != now["verdict"]
        or (
            None not in (was["value"], now["value"], was["limit"])
            and abs(now["value"] - was["value"]) > SHARE * was["limit"]
        )
    ]
    worse = sum(row[-1] for row in rows)
    return Finding(
        "conformance-changes",
        "Conformance: what changed",
        f"{len(rows)} changes, {worse} for the worse",
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
        verdict="fail" if worse else "changed" if rows else "pass",
        exit_code=int(worse > 0),
    )


def _read(path: Path) -> dict[tuple[str, str, str], dict[str, Any]]:
    path = path / "run.json" if path.is_dir() else path
    try:
        return {
            (row["engine"], row["settings"], row["id"]): row
            | {name: row[name] and float(row[name]) for name in ("value", "limit")}
            | {name: str(row[name]) for name in ("name", "version", "verdict")}
            for row in reading.read_json(path)["tables"]["rows"]
        }
    except (ValueError, KeyError, TypeError):
        raise errors.InputError(
            f"{printable(path)}: not what `rockcheck conformance` wrote"
        ) from None


TEXTS = Path(__file__).parents[2] / "data" / "export"
#: Time step of the sampled base motion, s.
BASE_STEP = 1e-3
STATE = ("x_m", "y_m", "theta_rad", "x_dot_m_s", "y_dot_m_s", "theta_dot_rad_s")


def export(folder: Path) -> list[str]:
    """Write all scenes as tables into a folder; returns their names.

    An existing `engine.toml` stays as it is.
    """
    for name, scene in SCENES.items():
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            t = BASE_STEP * np.arange(round(scene.duration / BASE_STEP) + 1)
            bases = scene.excitation, scene.vertical
            writing.write_whole(
                folder / f"{name}-base.csv",
                writing.table_text(
                    (
                        "t_s",
                        "x_velocity_m_s",
                        "y_velocity_m_s",
                        "x_acceleration_m_s2",
                        "y_acceleration_m_s2",
                    ),
                    np.column_stack(
                        [
                            t,
                            *(
                                [base_motion.velocity_at(at, *one) for at in t.tolist()]
                                for one in map(base_motion.velocity_of, bases)
                            ),
                            *(one.acceleration(t) for one in bases),
                        ]
                    ).tolist(),
                ),
            )
    scenes: list[dict[str, Any]] = [
        {
            "scene": scene.name,
            "duration_s": scene.duration,
            "output_step_s": scene.output_step,
            "gravity_m_s2": scene.gravity,
            "half_width_m": scene.block.half_width,
            "half_height_m": scene.block.half_height,
            "friction": scene.floor.friction,
            "floor_restitution": scene.floor.restitution,
            **{
                f"{side}_wall_{name}": getattr(scene.wall(side), key, "")
                for side in ("left", "right")
                for name, key in (("gap_m", "gap"), ("restitution", "restitution"))
            },
            **dict(zip(STATE, map(float, scene.initial_state), strict=True)),
        }
        for scene in SCENES.values()
    ]
    writing.write_whole(
        folder / "scenes.csv",
        writing.table_text(tuple(scenes[0]), [tuple(row.values()) for row in scenes]),
    )
    writing.write_whole(
        folder / "README.md",
        "\n".join(
            [
                (TEXTS / "README.md").read_text(encoding="utf-8"),
                *(
                    f"- {one.id} {one.name}: {', '.join(scene.name for scene in one.scenes)}"
                    for one in PHENOMENA.values()
                ),
                "",
            ]
        ),
    )
    if not (folder / ABOUT).exists():
        writing.write_whole(folder / ABOUT, (TEXTS / ABOUT).read_text(encoding="utf-8"))
    return list(SCENES)


#: Tolerance of the restitution, absolute, and of the friction, relative.
NEAR = 2e-3
SLIDING = 1.5  # m/s
#: Allowed values of what is wanted: least and most.
WANTED = {
    "restitution": (0.0, 1.0),
    "friction": (1e-6, 1.3),
    "time_step": (1e-6, 0.01),
    "penetration": (0.0, math.inf),
}


#: By engine, the limits of the parameter that sets its restitution, and all parameters in the
#: engine's own words, in which `Tune` fills in the numbers.
KNOBS: dict[str, tuple[tuple[float, float], Mapping[str, str]]] = {
    "mujoco": (
        (0.5, 2.2),
        {
            "geom solref": "{push:.6g} {damp:.6g}",
            "geom solimp": "0.9999 0.9999 0.001 0.5 1",
            "geom friction": "{friction:.4g} 0 0",
            "option": 'timestep="{step:g}" integrator="Euler" cone="elliptic"',
        },
    ),
    "pybullet": (
        (0.0, 1.2),
        {
            "changeDynamics(block)": "restitution=1, lateralFriction=1 (of two bodies they"
            " multiply)",
            "changeDynamics(floor)": "restitution={restitution:.4g},"
            " lateralFriction={friction:.4g}",
            "setPhysicsEngineParameter": "restitutionVelocityThreshold=0.2 (slower contacts do not"
            " bounce), contactERP=0.2",
        },
    ),
    "pymunk": (
        (0.0, 1.2),
        {
            "block": "elasticity=1, friction=1 (of two shapes they multiply)",
            "floor": "elasticity={restitution:.4g}, friction={friction:.4g}",
            "space": "collision_bias=0.0018 (0.9 ** 60 a second), collision_slop=0.1",
        },
    ),
    "dart": (
        (0.0, 1.0),
        {
            "block": "setRestitutionCoeff(1), setFrictionCoeff({friction:.4g}) (restitutions"
            " multiply, the smaller friction counts)",
            "floor": "setRestitutionCoeff({restitution:.4g}), setFrictionCoeff({friction:.4g})",
            "world": "contacts below 0.1 m/s do not bounce; the error reduction of 0.01 cannot be"
            " set from Python",
        },
    ),
    "drake": (
        (0.0, 20.0),
        {
            "AddContactMaterial": "dissipation={restitution:.4g} s/m, point_stiffness="
            "{stiffness:.4g} N/m a kg, each body",
            "CoulombFriction": "{friction:.4g}, {friction:.4g}",
            "MultibodyPlant": "time_step={step:g}, DiscreteContactApproximation.kTamsi",
            "remark": "dissipation, not restitution: it holds for this speed of approach, 2 m/s,"
            " and this mass",
        },
    ),
    "box2d": (
        (0.0, 1.0),
        {
            "block": "restitution=0, friction={friction:.4g} (of two restitutions the larger"
            " counts, of two frictions the geometric mean)",
            "floor": "restitution={restitution:.4g}, friction={friction:.4g}",
            "world": "restitution_threshold=1 (slower contacts do not bounce), contact_hertz=30, 4"
            " substeps",
        },
    ),
    "physx": (
        (0.0, 2.0),
        {
            "PhysxMaterial(block)": "{friction:.4g}, {friction:.4g}, 0 (of two materials the mean"
            " counts)",
            "PhysxMaterial(floor)": "{friction:.4g}, {friction:.4g}, {restitution:.4g}",
            "set_scene_config": "bounce_threshold=2 (slower contacts do not bounce)",
        },
    ),
    "jolt": (
        (0.0, 1.2),
        {
            "create_body(block)": "friction={friction:.4g}, restitution=0 (of two restitutions the"
            " larger counts, of two frictions the geometric mean)",
            "create_body(floor)": "friction={friction:.4g}, restitution={restitution:.4g}",
            "remark": "contacts below about 1 m/s do not bounce",
        },
    ),
}


@dataclass(frozen=True)
class Calibration:
    """Parameters in the engine's own words, and the contact reached with them.

    Reached are `restitution`, `friction` and `penetration` (m); `reached` tells whether they are
    near enough to the wanted ones.
    """

    parameters: dict[str, str]
    restitution: float
    friction: float
    penetration: float
    reached: bool


def _played(model: Any, scene: Scene, parameters: Mapping[str, float], step: float) -> Floats:
    times: Floats = step * np.arange(math.ceil(scene.duration / step) + 1, dtype=np.float64)
    world = model.tuned_world(scene, parameters, step)
    try:
        world.ready(step)
        return steps.march_fixed(world, scene, times, np.tile([0.0, -G], (len(times) - 1, 1)))[1]
    except errors.ModelFailure as error:
        raise errors.InputError(
            f"{model.name} cannot play a drop with these parameters: {error}", "--set time_step"
        ) from None
    finally:
        world.close()


@dataclass(frozen=True)
class Tune(Task):
    """An engine's wanted restitution and friction, and largest penetration (m), at a step (s)."""

    engine: str
    restitution: float
    friction: float = 0.3
    time_step: float = 1e-3
    penetration: float = math.inf

    def __post_init__(self) -> None:
        for name, (least, most) in WANTED.items():
            value = getattr(self, name)
            if not isinstance(value, int | float) or not least <= value <= most:
                raise errors.InputError(
                    f"{printable(value)} is not allowed: give {least:g} to {most:g}",
                    "--tune" if name == "restitution" else f"--set {name}",
                )

    def play(self) -> Calibration:
        """Parameters in the engine's own words, and the contact reached with them.

        The rebound of a block dropped from 0.2 m gives the restitution, the way of one sliding at
        1.5 m/s the friction. Raises `InputError` where the engine cannot reach the restitution,
        naming what it can.
        """
        from scipy.optimize import brentq

        (bounds, words), step, friction = KNOBS[self.engine], self.time_step, self.friction
        model: Any = models.build(self.engine, {"time_step": step, "settings": "default"})
        drop = Scene(
            name="drop",
            block=SQUAT,
            floor=Floor(friction=friction),
            initial_height=DROP,
            duration=0.65,
        )
        slide = Scene(
            name="slide",
            block=SQUAT,
            floor=Floor(friction=friction),
            initial_velocity=SLIDING,
            duration=SLIDING / (friction * G) + 0.3,
        )

        def dropped(setting: float) -> tuple[float, float]:
            """Restitution of the rebound, and penetration, m."""
            heights = (
                _played(model, drop, {"restitution": setting, "friction": friction}, step)[:, 1]
                - SQUAT.half_height
            )
            later = heights[int((math.sqrt(2.0 * DROP / G) + 0.02) / step) :]
            return math.sqrt(max(float(np.max(later)), 0.0) / DROP), -float(np.min(heights))

        restitution, ends = self.restitution, [dropped(end)[0] for end in bounds]
        if not min(ends) - NEAR <= restitution <= max(ends) + NEAR:
            raise errors.InputError(
                f"{restitution:g} cannot be reached by {self.engine} at a step of {step:g} s:"
                f" {min(ends):.3g} to {max(ends):.3g} can",
                "--tune",
            )
        near = [
            one for one, end in zip(bounds, ends, strict=True) if abs(end - restitution) <= NEAR
        ]
        found = (
            near[0]
            if near
            else brentq(
                lambda setting: dropped(setting)[0] - restitution, *bounds, xtol=1e-5, rtol=1e-5
            )
        )
        asked = friction
        for _ in range(12):
            way = _played(model, slide, {"restitution": found, "friction": asked}, step)[-1, 0]
            slid = SLIDING**2 / (2.0 * G * float(way))
            if abs(slid - friction) <= NEAR * friction:
                break
            asked *= friction / slid
        rebound, deep = dropped(found)
        used = {"step": step, "restitution": found, "friction": asked, **model.tuned(step)}
        used |= {"push": -used.get("erp", 0.0) / step**2, "damp": -found / step}
        return Calibration(
            {where: what.format_map(used) for where, what in words.items()},
            rebound,
            slid,
            max(deep, 0.0),
            reached=abs(rebound - restitution) <= 5.0 * NEAR
            and abs(slid - friction) <= 5.0 * NEAR * friction
            and deep <= self.penetration,
        )


@dataclass(frozen=True)
class Tuning(Study):
    """The wanted restitution and friction of each engine."""

    wanted: tuple[Tune, ...]
    name = "tuning"
    record = Calibration

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Tune]:
        """All at once."""
        return self.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """Tables of parameters and contacts reached. Raises `InputError` where no engine can."""
        found = {task: one for task, one in done.items() if isinstance(one, Calibration)}
        refused = [one for one in done.values() if isinstance(one, pool.Failure) and one.refused]
        if refused and not found:
            raise errors.InputError(refused[0].reason)
        reached = sum(one.reached for one in found.values())
        return Finding(
            self.name,
            "Parameters for a wanted restitution",
            f"{reached} of {len(self.wanted)} engines reach what is wanted.",
            [
                Table(
                    "parameters",
                    [Column("engine", kind="model"), text("where"), text("what")],
                    [
                        [task.engine, *pair]
                        for task, one in found.items()
                        for pair in one.parameters.items()
                    ],
                    "Parameters",
                ),
                Table(
                    "reached",
                    [
                        Column("engine", kind="model"),
                        Column("step", unit="s"),
                        Column("restitution"),
                        Column("friction"),
                        Column("penetration", unit="m", digits=2),
                        text("reached"),
                    ],
                    [
                        [
                            *(task.engine, task.time_step),
                            *(one.restitution, one.friction, one.penetration),
                            Mark(one.reached, "pass" if one.reached else "fail"),
                        ]
                        for task, one in found.items()
                    ],
                    "Reached",
                ),
            ],
            {
                "engines": {
                    task.engine: {"engine": task.engine, "step": task.time_step, **asdict(one)}
                    for task, one in found.items()
                }
            },
            "pass" if reached == len(self.wanted) else "fail",
            int(reached < len(self.wanted)),
        )
