"""What conformance reads and writes: two studies beside each other, and scenes as tables."""

import json
import math

import pytest

from rockcheck import Block, Floor, HalfSine, Record, Rest, Scene, Wall
from rockcheck.validation.studies.conformance import export
from rockcheck.validation.studies.conformance.changes import changes, wrote

# Two studies


def row(**change):
    given = {
        "engine": "abacus",
        "settings": "best",
        "id": "RC-01",
        "name": "sliding",
        "version": "1",
        "value": 1.0,
        "limit": 0.02,
        "verdict": "pass",
    }
    return given | change


@pytest.fixture
def changed(tmp_path):
    """What has changed between a study with one row and another with one, or none."""

    def between(before, after):
        paths = []
        for name, rows in (("before", before), ("after", after)):
            path = tmp_path / f"{name}.json"
            path.write_text(json.dumps({"cards": [], "tables": {"rows": rows}}), "utf-8")
            paths.append(path)
        return changes(*paths)

    return between


def test_two_studies_alike_have_no_changes(changed):
    found = changed([row()], [row(version="2")])
    assert found.table("changes").rows == []
    assert found.verdict == "pass"
    assert found.exit_code == 0


@pytest.mark.parametrize(
    ("before", "after", "worse"),
    [
        ("pass", "fail", True),
        ("pass", "error", True),
        ("fail", "pass", False),
        ("fail", "lacks", 0),
    ],
)
def test_it_is_for_the_worse_where_a_phenomenon_conformed_before(changed, before, after, worse):
    found = changed([row(verdict=before)], [row(verdict=after, version="2")])
    (record,) = found.table("changes").records()
    assert record["worse"] == bool(worse)
    assert found.exit_code == int(worse)
    assert found.verdict == ("fail" if worse else "changed")
    assert [record["version_before"], record["version_after"]] == ["1", "2"]
    assert [record["verdict_before"], record["verdict_after"]] == [before, after]


@pytest.mark.parametrize(("moved", "rows"), [(0.0019, 0), (0.0021, 1), (-0.0021, 1)])
def test_a_value_has_changed_that_moved_by_a_tenth_of_its_limit(changed, moved, rows):
    found = changed([row()], [row(value=1.0 + moved)])
    assert len(found.table("changes").rows) == rows
    assert found.exit_code == 0


@pytest.mark.parametrize("name", ["value", "limit"])
def test_what_has_no_value_or_no_limit_has_not_moved(changed, name):
    found = changed([row(**{name: None})], [row(**{name: None, "version": "2"} | {"id": "RC-01"})])
    assert found.table("changes").rows == []
    assert changed([row(limit=None)], [row(limit=None, value=9.0)]).table("changes").rows == []


def test_a_row_that_is_gone_or_new_is_absent_on_the_other_side(changed):
    (gone,) = changed([row()], []).table("changes").records()
    assert gone["verdict_after"] == "absent"
    assert gone["worse"]
    (new,) = changed([], [row()]).table("changes").records()
    assert new["verdict_before"] == "absent"
    assert not new["worse"]


def test_settings_are_cards_of_their_own(changed):
    found = changed([row()], [row(settings="default")])
    assert len(found.table("changes").rows) == 2


@pytest.mark.parametrize(
    ("text", "is_study"), [('{"cards": []}', True), ('{"rows": []}', False), ("[]", False)]
)
def test_a_study_has_cards(tmp_path, text, is_study):
    (tmp_path / "run.json").write_text(text, "utf-8")
    assert wrote(tmp_path) == is_study
    assert wrote(tmp_path / "run.json") == is_study


# Scenes as tables

SCENE = Scene(
    name="made",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.5, restitution=0.25),
    walls=[Wall(side="right", gap=0.07, restitution=0.75)],
    excitation=Record.from_samples([0.0, 2.0, 0.0], 0.5),
    vertical=HalfSine(amplitude=1.0, period=0.4),
    initial_rotation=0.05,
    duration=1.2,
    output_step=0.02,
)


def test_a_row_holds_geometry_contacts_and_the_start():
    found = export.row_of(SCENE)
    assert found["half_width_m"] == 0.3
    assert found["floor_restitution"] == 0.25
    assert found["left_wall_gap_m"] == ""
    assert found["left_wall_restitution"] == ""
    assert found["right_wall_gap_m"] == 0.07
    assert found["right_wall_restitution"] == 0.75
    assert found["theta_rad"] == 0.05


def test_a_base_motion_has_velocities_and_accelerations_at_even_times():
    table = export.base_of(SCENE)
    step = table[1, 0]
    assert step == pytest.approx(1e-3)
    assert table[-1, 0] == pytest.approx(1.2)
    assert table[:, 0] == pytest.approx([step * k for k in range(len(table))])
    at = round(0.5 / step)
    # The horizontal one has gained 0.5 m/s, and the vertical one all of its 2 A T/(2 pi).
    assert table[at, 1:] == pytest.approx([0.5, 0.4 / math.pi, 2.0, 0.0], abs=1e-6)
    assert table[-1, 1] == pytest.approx(1.0)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to which two scenes are exported, of which one has a base that moves."""
    resting = SCENE.replace(name="rest", excitation=Rest(), vertical=Rest())
    lifted = resting.replace(name="lifted", vertical=HalfSine(amplitude=1.0, period=0.4))
    monkeypatch.setattr(export, "SCENES", {"rest": resting, "lifted": lifted})
    return tmp_path


def test_a_folder_holds_the_scenes_and_the_bases_that_move(folder):
    assert export.export(folder) == ["rest", "lifted"]
    assert sorted(path.name for path in folder.iterdir()) == [
        "README.md",
        "engine.toml",
        "lifted-base.csv",
        "scenes.csv",
    ]
    head, *rows = (folder / "scenes.csv").read_text("utf-8").splitlines()
    assert head.startswith("scene,duration_s,")
    assert [row.split(",")[0] for row in rows] == ["rest", "lifted"]


def test_what_an_engine_says_of_itself_stays(folder):
    (folder / "engine.toml").write_text("mine", "utf-8")
    export.export(folder)
    assert (folder / "engine.toml").read_text("utf-8") == "mine"


def test_an_engine_is_asked_about_itself(folder):
    export.export(folder)
    assert "engine" in (folder / "engine.toml").read_text("utf-8")
