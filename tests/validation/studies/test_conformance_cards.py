"""Cards, of results that are made up; who takes part; parameters of an engine that is made up."""

import math
from types import SimpleNamespace

import pytest

from rockcheck import InputError, ModelFailure
from rockcheck.engines import steps
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.studies.conformance import cards, tuning
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA, SCENES
from rockcheck.validation.studies.conformance.players import Player, named, written
from rockcheck.validation.studies.conformance.trial import Result, Trial

# Cards


def player(label="abacus", **more):
    given = {"family": "abacus:Abacus", "settings": {}, "setup": "best", "step": 1e-3}
    return Player(label=label, **given | more)


PASSED = Result(1.0, "pass", "", "2.0")


def gathered(*players, **results):
    """The finding of players that pass all, but for these results (`RC_01=...`) of the first."""
    done = {Trial(each, id): PASSED for each in players for id in PHENOMENA}
    for id, result in results.items():
        done[Trial(players[0], id.replace("_", "-"))] = result
    done = {trial: result for trial, result in done.items() if result is not None}
    return cards.Conformance(players).gather(done)


def test_a_phenomenon_has_a_hundred_times_its_usual_time_and_two_minutes_more():
    """Its usual time is the player's cost a second by the seconds of its scenes."""
    mine = player(cost=0.5)
    lasts = sum(scene.duration for scene in PHENOMENA["RC-05"].scenes)
    assert lasts > 2.0
    trial = cards.Conformance((mine,)).trial(mine, "RC-05")
    assert trial.expected == pytest.approx(0.5 * lasts)
    assert trial.seconds == pytest.approx(120.0 + 100.0 * trial.expected)
    assert cards.Conformance((mine,), limit=7.0).trial(mine, "RC-01").seconds == 7.0


def test_a_card_counts_the_verdicts_of_all_phenomena():
    found = gathered(player(), RC_02=Result(9.0, "fail", "too far", "2.0"))
    (card,) = found.data["cards"]
    assert card["counts"]["pass"] == len(PHENOMENA) - 1
    assert card["counts"]["fail"] == 1
    assert card["counts"]["total"] == len(PHENOMENA)
    assert found.exit_code == 1


def test_what_fails_is_told_and_nothing_else():
    found = gathered(
        player(),
        RC_02=Result(9.0, "fail", "too far", "2.0"),
        RC_03=Result(9.0, "reported", "not judged", "2.0"),
    )
    (told,) = (block for block in found.blocks if block.block == "text")
    assert len(told.items) == 1
    assert told.items[0].endswith("too far")


def test_without_a_fault_nothing_is_told():
    found = gathered(player())
    assert [block.block for block in found.blocks] == ["table"] * 4
    assert found.exit_code == 0
    assert found.answer.startswith(f"1 of 1 cards conform; of {len(PHENOMENA)} phenomena")


def test_a_card_has_the_version_that_played_else_that_of_its_player():
    other = Result(1.0, "pass", "", "3.0")
    assert gathered(player(version="1"), RC_02=other).data["cards"][0]["version"] == "2.0"
    unknown = {id.replace("-", "_"): Result(1.0, "pass", "", "") for id in PHENOMENA}
    assert gathered(player(version="1"), **unknown).data["cards"][0]["version"] == "1"


def test_a_column_of_absent_files_stands_where_one_is_absent():
    alone = gathered(player())
    assert "absent" not in [column.name for column in alone.table("engines").columns]
    scene = PHENOMENA["RC-05"].scenes[0].name
    found = gathered(player(absent=(scene,)), RC_05=None)
    (counts,) = found.table("engines").records()
    assert counts["absent"] == 1
    assert counts["pass"] == len(PHENOMENA) - 1
    assert counts["fail"] == 0


def test_what_there_was_no_time_for_is_not_on_the_card():
    found = gathered(player(), RC_05=None)
    (card,) = found.data["cards"]
    assert "RC-05" not in [row["id"] for row in card["phenomena"]]


def test_a_value_with_a_narrow_limit_has_more_digits():
    found = gathered(player())
    shown = {row[0][:5]: row[1].digits for row in found.table("cards").rows}
    narrow = {id for id, one in PHENOMENA.items() if one.limit and one.limit < 1e-3}
    assert narrow
    assert shown == {id: 6 if id in narrow else 3 for id in PHENOMENA}


def failing(reason="gone", *, refused=False, but=()):
    return {
        id.replace("-", "_"): Failure(reason, refused=refused) for id in PHENOMENA if id not in but
    }


@pytest.mark.parametrize(("refused", "error"), [(True, InputError), (False, ModelFailure)])
def test_a_player_alone_that_plays_nothing_is_an_error(refused, error):
    with pytest.raises(error, match="gone"):
        gathered(player(), **failing(refused=refused))


def test_beside_others_a_player_that_plays_nothing_has_a_card():
    found = gathered(player(), player("other"), **failing())
    assert [card["common_fault"] for card in found.data["cards"]] == ["gone", ""]


def test_failures_of_two_kinds_or_beside_a_result_are_no_common_fault():
    mixed = failing() | {"RC_01": Failure("otherwise")}
    assert gathered(player(), **mixed).data["cards"][0]["common_fault"] == ""
    beside = failing(but=("RC-01",))
    assert gathered(player(), **beside).data["cards"][0]["common_fault"] == ""
    lacking = failing() | {"RC_01": Result(None, "lacks", "none", "")}
    both = gathered(player(), player("other"), **lacking)
    assert both.data["cards"][0]["common_fault"] == "gone"


# Who takes part


@pytest.fixture
def folder(tmp_path):
    """A folder with the history of one scene."""
    (tmp_path / "slide.csv").write_text("t,theta\n0,0\n", "utf-8")
    return tmp_path


def test_an_engine_comes_with_its_best_settings_and_its_library_s_version():
    found = named("mujoco", None, {})
    assert found.settings["settings"] == "best"
    assert found.setup == "best"
    assert found.version
    assert found.cost == pytest.approx(0.1)
    assert found.search_path == ()


def test_an_engine_s_own_settings_may_be_named():
    found = named("mujoco", "default", {"time_step": 1e-2})
    assert found.setup == "default"
    assert found.cost == pytest.approx(0.01)


def test_a_step_that_is_chosen_costs_what_the_usual_one_does():
    assert named("mujoco", None, {"time_step": "adaptive"}).cost == pytest.approx(0.1)


def test_a_class_comes_as_it_is():
    found = named("abacus:Abacus", None, {"beads": 7})
    assert found.settings == {"time_step": 1e-3, "beads": 7}
    assert found.setup == "as it comes, beads=7"
    assert len(found.search_path) == 1


def test_a_setting_that_an_engine_does_not_have_is_refused():
    with pytest.raises(InputError):
        named("mujoco", None, {"beads": 7})


def test_a_folder_says_whose_histories_it_has(folder):
    (folder / "engine.toml").write_text('engine = "a"\nversion = "2"\nlacks = ["walls"]', "utf-8")
    found = written(folder)
    assert [found.label, found.version, found.setup] == ["a", "2", "as it comes"]
    assert found.lacks == ("walls",)
    assert set(found.absent) == set(SCENES) - {"slide"}
    assert found.settings["files"]["slide"] == str(folder / "slide.csv")


@pytest.mark.parametrize("about", ["", 'engine = ""', "engine = 1", 'engine = "a"\nlacks = "b"'])
def test_a_folder_of_nobody_is_refused(folder, about):
    (folder / "engine.toml").write_text(about, "utf-8")
    with pytest.raises(InputError, match=r"engine\.toml"):
        written(folder)


def test_a_word_that_a_folder_has_not_to_say_is_refused(folder):
    (folder / "engine.toml").write_text('engine = "a"\nbeads = "7"', "utf-8")
    with pytest.raises(InputError, match="beads"):
        written(folder)


def test_settings_of_a_folder_are_its_words(folder):
    (folder / "engine.toml").write_text('engine = "a"\nsettings = "quick"', "utf-8")
    assert written(folder).setup == "quick"


# Parameters of an engine


class Ball(steps.World):
    """Drops, bounces and slides exactly, with the square of its parameter for a restitution and
    half of it, at most 0.5, for a friction."""

    def __init__(self, height, parameters):
        self.floor = height
        self.restitution = parameters["restitution"] ** 2
        self.friction = min(0.5 * parameters["friction"], 0.5)

    def place(self, *state):
        self.at = state

    def step(self, felt, dt):
        x, y, theta, vx, vy, w = self.at
        g = -felt[1]
        fell = y + vy * dt - 0.5 * g * dt**2
        if fell > self.floor:
            self.at = (x, fell, theta, vx, vy - g * dt, w)
            return
        down = math.sqrt(vy**2 + 2.0 * g * max(y - self.floor, 0.0))
        left = max(dt - (vy + down) / g, 0.0)
        up = self.restitution * down - g * left
        braked = max(vx - self.friction * g * dt, 0.0)
        height = max(self.restitution * down * left - 0.5 * g * left**2, 0.0)
        self.at = (
            x + 0.5 * (vx + braked) * dt,
            self.floor + height,
            theta,
            braked,
            up if height else 0.0,
            w,
        )

    def state(self):
        return self.at


class Abacus:
    name = "abacus"
    contact_parameters = SimpleNamespace(
        range=(0.4, 1.0), words={"solref": "{push:g} {damp:.0f}", "friction": "{friction:.3f}"}
    )

    def tuned_world(self, scene, parameters, step):
        return Ball(scene.block.half_height, parameters)

    def tuned(self, step):
        return {"erp": 0.2}


@pytest.fixture
def tuned(monkeypatch):
    monkeypatch.setattr("rockcheck.validation.execute.models.build", lambda *_: Abacus())
    return lambda restitution, **more: tuning.Tune("abacus", restitution, **more).play()


def test_the_parameters_are_those_that_reach_what_is_wanted(tuned):
    found = tuned(0.25)
    assert found.reached
    assert found.restitution == pytest.approx(0.25, abs=2e-3)
    assert found.friction == pytest.approx(0.3, rel=2e-3)
    assert found.penetration == 0.0
    assert found.parameters["friction"] == "0.600"
    stiffness, damping = map(float, found.parameters["solref"].split())
    assert stiffness == pytest.approx(-0.2 / 1e-3**2)
    assert damping == pytest.approx(-0.5 / 1e-3, rel=5e-3)


def test_a_restitution_beyond_what_an_engine_can_is_refused_and_told(tuned):
    with pytest.raises(InputError, match=r"0\.16 to 1 can"):
        tuned(0.1)


def test_a_restitution_at_the_end_of_what_an_engine_can_is_reached(tuned):
    assert tuned(1.0).restitution == pytest.approx(1.0, abs=1e-3)


def test_a_friction_beyond_what_an_engine_can_is_not_reached(tuned):
    found = tuned(0.25, friction=0.8)
    assert not found.reached
    assert found.friction == pytest.approx(0.5, rel=1e-2)


def test_an_engine_that_plays_no_drop_is_refused(monkeypatch, tuned):
    monkeypatch.setattr(Ball, "step", lambda self, felt, dt: self.place(*[math.nan] * 6))
    with pytest.raises(InputError, match="abacus cannot play a drop"):
        tuned(0.25)


@pytest.mark.parametrize(("restitution", "step"), [(1.1, 1e-3), (-0.1, 1e-3), (0.5, 0.1)])
def test_what_no_contact_has_is_refused(restitution, step):
    with pytest.raises(InputError, match="is not allowed"):
        tuning.Tune("abacus", restitution, time_step=step)


CALIBRATED = tuning.Calibration({"friction": "0.6"}, 0.25, 0.3, 0.0, reached=True)
SHORT = tuning.Calibration({"friction": "0.6"}, 0.25, 0.2, 0.0, reached=False)


def of_engines(*ends):
    tasks = [tuning.Tune(f"abacus{n}", 0.25) for n, _ in enumerate(ends)]
    return tuning.Tuning(tuple(tasks)).gather(dict(zip(tasks, ends, strict=True)))


@pytest.mark.parametrize(
    ("ends", "reached", "code"),
    [
        ([CALIBRATED], 1, 0),
        ([CALIBRATED, SHORT], 1, 1),
        ([CALIBRATED, Failure("no such engine", refused=True)], 1, 1),
        ([Failure("crashed")], 0, 1),
    ],
)
def test_all_engines_must_reach_what_is_wanted(ends, reached, code):
    found = of_engines(*ends)
    assert found.answer.startswith(f"{reached} of {len(ends)} engines")
    assert found.exit_code == code
    assert found.verdict == ("fail" if code else "pass")


def test_where_no_engine_can_it_is_refused():
    with pytest.raises(InputError, match="no such engine"):
        of_engines(Failure("no such engine", refused=True), Failure("crashed"))
