"""Histories: tables, saving and loading, and files that are not histories."""

import gzip
import json
import math
import re

import numpy as np
import pandas as pd
import pytest

from rockcheck.scenes import (
    Block,
    Cost,
    Event,
    Floor,
    History,
    Rest,
    Scene,
    observation,
    reading,
    writing,
)
from rockcheck.scenes.columns import COLUMNS
from rockcheck.scenes.history_files import HEAD

SCENE = Scene(
    name="observed",
    block=Block(half_width=0.4, half_height=1.6),
    floor=Floor(friction=0.3),
    excitation=Rest(),
    duration=0.05,
    output_step=0.005,
)


def states(theta: np.ndarray) -> np.ndarray:
    """States of a block that turns about its lower corner, at rest at each instant."""
    block, side = SCENE.block, np.sign(theta)
    x = side * (block.radius * np.sin(block.alpha - np.abs(theta)) - block.half_width)
    y = block.radius * np.cos(block.alpha - np.abs(theta))
    return np.column_stack([x, y, theta, *np.zeros((3, len(theta)))])


@pytest.fixture
def history() -> History:
    return observation.observe(
        SCENE,
        "model",
        states(np.linspace(0.1, 0.01, 11)),
        events=[
            Event(t=0.012, kind="uplift", mode_before="rest", mode_after="rock"),
            Event(t=0.03, kind="floor impact", impulse=0.1 / 3.0),
            Event(t=0.04, kind="None", mode_before="hit #2", mode_after="#"),
        ],
        outcome="moving",
        cost=Cost(wall_seconds=0.25, steps=12, error_estimate=1e-9),
        settings={"tolerance": 1e-10},
        notes=["a note, with a comma"],
    )


def test_save_and_load_round_trip(history, tmp_path):
    path = tmp_path / "run.csv"
    history.save(path)
    again = History.load(path)
    for field in ("name", "model", "outcome", "notes", "block", "cost", "settings", "event_list"):
        assert getattr(again, field) == getattr(history, field), field
    pd.testing.assert_frame_equal(again.frame, history.frame, check_exact=True)
    # and none is taken for another
    assert [{history: 1, again: 2}[history], *sorted(p.name for p in tmp_path.iterdir())] == [
        1,
        "run.csv",
        "run.events.csv",
    ]


def test_a_loaded_blocks_history_keeps_where_its_mass_is(tmp_path):
    """The block comes back, its moment of inertia per unit mass; a history of a homogeneous one
    says nothing of it."""
    block = Block(
        half_width=0.4,
        half_height=1.6,
        mass=20.0,
        centre_of_mass=(0.1, -0.3),
        moment_of_inertia=12.0,
    )
    unit = Block(half_width=0.4, half_height=1.6, centre_of_mass=(0.1, -0.3), moment_of_inertia=0.6)
    for given, kept, alpha in (
        (block, unit, math.atan2(0.4 - 0.1, 1.6 - 0.3)),
        (SCENE.block, SCENE.block, SCENE.block.alpha),
    ):
        still = observation.observe(
            SCENE.replace(block=given), "model", states(np.zeros(11)), outcome="at rest"
        )
        still.save(tmp_path / "run.csv")
        again = History.load(tmp_path / "run.csv")
        assert again.block == kept
        assert again.alpha == alpha
    assert "centre_of_mass" not in (tmp_path / "run.csv").read_text(encoding="utf-8")


def test_a_compressed_history_is_the_same(history, tmp_path):
    """Half the size; the same history gives the same bytes, whenever it is written."""
    path = tmp_path / "run.csv.gz"
    history.save(path)
    history.save(tmp_path / "run.csv")
    written = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    packed = {f"run{ending}": content for ending, content in history.packed().items()}
    assert packed.keys() == {"run.csv.gz", "run.events.csv.gz"}
    assert written == packed | {name[:-3]: gzip.decompress(packed[name]) for name in packed}
    assert History.load(path).packed() == history.packed()


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[:5],
        lambda content: content[:99] + bytes([content[99] ^ 0xFF]) + content[100:],
        lambda content: content[:-8],
    ],
    ids=["cut", "flipped", "no end"],
)
def test_a_damaged_compressed_history(history, written, damage, fault_of):
    said = str(fault_of(History.load, written("run.csv.gz", damage(history.packed()[".csv.gz"]))))
    assert re.search(r"run\.csv\.gz: (a compressed file that is damaged|not a CSV table)", said)


def test_a_compressed_table_is_bounded(written, monkeypatch, fault_of):
    """A small file may hold very much: it is refused before it is taken into memory."""
    monkeypatch.setattr(reading, "MOST_TABLE_BYTES", 100_000)
    path = written("bomb.csv.gz", gzip.compress(b"t,theta\n" + b"0,0\n" * 1_000_000))
    assert path.stat().st_size < 100_000
    assert "bomb.csv.gz: larger than 100000 bytes" in str(fault_of(History.load, path))


def test_another_compressed_file_is_refused(history, tmp_path, fault_of):
    for act, name, said in (
        (history.save, "run.json.gz", "written as .csv or .csv.gz, not as .gz"),
        (History.load, "run.json", "read from .csv or .csv.gz, not from .json"),
    ):
        assert said in str(fault_of(act, tmp_path / name))


def test_tables(history):
    words = "t x y theta x_dot y_dot theta_dot slip slip_rate mode"
    assert list(history.frame.columns) == words.split()
    assert [*history.frame["mode"], *history.events["kind"]] == [
        *["rock"] * 11,
        "uplift",
        "floor impact",
        "None",
    ]
    assert history.peak_rotation == 0.1
    np.testing.assert_allclose(history.channels["slip"], 0.0, atol=1e-15)


def test_a_plain_table_is_a_measured_history(written):
    text = "clock,theta,t\n9,0.0,0\n9,0.1,0.5\n9,0.00001,1\n"
    history = History.load(written("table.csv", text))
    assert history.name == "table"
    assert history.model == "measured"
    assert history.alpha is None
    assert set(history.channels) == {"t", "theta"}
    assert history.event_list == ()
    for rows, outcome in (
        (text, "at rest"),
        ("t,theta\n0,0\n1,-1.57\n", "overturned right"),
        ("t,theta,y_dot\n0,0,0\n1,0,-2\n", "moving"),  # it falls
        (rows_about('{"outcome": "<script>"}'), "moving"),  # an unknown one is not believed
    ):
        assert History.load(written("table.csv", rows)).outcome == outcome


@pytest.mark.parametrize(
    ("end", "outcome"),
    [
        ("1.1,0,0,0", "moving"),
        ("1.53,0,0,0", "overturned left"),
        ("-1.53,0,0,0", "overturned right"),
        ("0.001,0,0,0", "moving"),
        ("0,0.001,0,0", "moving"),
        ("0,0,0.001,0", "moving"),
        ("0,0,0,-0.001", "moving"),
        ("0.00005,0.00005,0.00005,0.00005", "at rest"),
    ],
)
def test_the_outcome_is_that_of_the_last_row(end, outcome, written):
    text = f"t,theta,theta_dot,x_dot,y_dot\n0,0,0,0,0\n1,{end}\n"
    assert History.load(written("run.csv", text)).outcome == outcome


@pytest.mark.parametrize(("angles", "time"), [((0.1, 1.53, 1.56), 1.0), ((0.1, 1.2, 1.4), 2.0)])
def test_without_an_event_a_block_is_down_once_it_lies(angles, time):
    channels = {"t": np.arange(3.0), "theta": np.array(angles)}
    history = History(
        name="a", model="b", channels=channels, event_list=(), outcome="overturned left"
    )
    assert history.overturned_at == time
    assert history.fate == f"overturned left at {time:g} s"


def test_a_measured_history_has_cost_nothing(written):
    history = History.load(written("run.csv", "t,theta\n0,0\n1,0.1\n"))
    assert not any(vars(history.cost).values())


def rows_about(text: str) -> str:
    """Rows with a column in which the first says this of the history."""
    return 't,theta,rockcheck_history\n0,0,"{}"\n1,0.1,\n'.format(text.replace('"', '""'))


#: What a file may hold instead of a history, and what is said of it.
HOSTILE = [
    ("", "not a CSV table"),
    ("t,theta\n", "no rows"),
    ("clock,theta\n0,0\n", "no column 't'"),
    ("t,x\n0,0\n", "no column 'theta'"),
    ("t,theta\n0,a\n", "column 'theta' is not numeric"),
    ("t,theta\n0,0\n1,nan\n", "column 'theta', row 2: nan is not finite"),
    ("t,theta\n0,0\n1,inf\n", "column 'theta', row 2: inf is not finite"),
    ("t,theta\n0,0\n1,\n", "column 'theta', row 2: nan is not finite"),
    ("t,theta\n0,0\n0,1\n", "column 't' does not increase"),
    ("t,theta\n1,0\n0,1\n", "column 't' does not increase"),
    ("t,theta\n0,0\n1,0,5,6\n", "not a CSV table"),
    (rows_about("{broken"), "metadata: not written by rockcheck"),
    (rows_about("[1, 2]"), "metadata: not written by rockcheck"),
    (rows_about("[" * 100000), "metadata: not written by rockcheck"),
    (rows_about('{"cost": 3}'), "metadata: cost: 3 is not allowed"),
    (rows_about('{"cost": {"steps": NaN}}'), "metadata: cost.steps: nan is not"),
    (rows_about('{"settings": []}'), "metadata: settings: "),
    (rows_about('{"notes": "x"}'), "metadata: notes: x is not allowed"),
    (rows_about('{"half_width": -1}'), "half_width: -1 is not allowed"),
    (
        rows_about('{"half_width": 1, "half_height": 2, "centre_of_mass": [3, 0]}'),
        "centre_of_mass: (3, 0) is not allowed",
    ),
    (rows_about('{"half_width": "1"}'), "half_width: the text '1' is not allowed"),
    (rows_about('{"half_height": true}'), "half_height: True is not allowed"),
    (rows_about('{"half_height": Infinity}'), "half_height: inf is not allowed"),
    # What is too large to square: not warnings of the arithmetic later on.
    *(
        (f"t,theta,x\n-2,0,0\n{row}\n".replace("_", value), f"column '{column}'")
        for column, row in (("t", "_,0,0"), ("theta", "1,_,0"), ("x", "1,0,_"))
        for value in ("1e200", "-1e31", "inf")
    ),
    *(
        (rows_about(f'{{"half_width": {value}}}'), "half_width")
        for value in ("1e200", "-1e31", "Infinity")
    ),
    ("t,theta\n0,True\n1,False\n", "column 'theta' is not numeric"),
    ("t,theta\n0,True\n1,0.5\n", "column 'theta' is not numeric"),
    ("t,theta\n0,1_000\n1,0.5\n", "column 'theta' is not numeric"),
    ("t,theta\n0,0x10\n1,0.5\n", "column 'theta' is not numeric"),
    ("t,x,theta\n0,1,2\n0,,1\n", "column 'x', row 2: nan is not finite"),
    ("# a remark\n", "not a CSV table"),
    ('t,"theta\nx"\n0,1\n', "line 1: a quotation mark that is not closed on its line"),
    ("t,theta" + ",x" * 1000 + "\n", "line 1: more than 1000 columns"),
    # Found by fuzzing: rows longer than the heading, and a column that is there twice.
    ("t,theta\n0.0,0.1,7\n0.5,0.2,7\n", "more values"),
    ("t_ms,theta\n0,1,7\n1,2,7\n", "more values"),  # as if the times were numbers of rows
    ("t,theta, t\n0.0,0.1,nan\n0.5,0.2,nan\n", "gives t a second time"),
    ("t,theta,t\n0.0,0.1,nan\n0.5,0.2,nan\n", "gives t a second time"),
    # Found by fuzzing: control characters in a heading.
    ("t,theta,\x1b[2Jx, \x1b[2Jx\n0,0,0,0\n", "gives ?[2Jx a second time"),
]


@pytest.mark.parametrize(("text", "said"), HOSTILE)
def test_hostile_tables(text, said, written, fault_of):
    fault = str(fault_of(History.load, written("hostile.csv", text)))
    assert said in fault.split("hostile.csv", 1)[1]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz"])
def test_pandas_reads_the_table_and_nothing_else(tmp_path, name):
    """Also a long one, whose columns pandas looks at in pieces."""
    scene = SCENE.replace(duration=30.0, output_step=0.001)
    history = observation.observe(scene, "model", states(0.1 * np.sin(scene.output_times)))
    history.save(tmp_path / name)
    frame = pd.read_csv(tmp_path / name, comment="#")
    assert list(frame.columns) == list(COLUMNS)
    pd.testing.assert_frame_equal(frame, history.frame, check_exact=False, rtol=1e-14)


def test_the_metadata_are_lines_that_a_reader_understands(tmp_path):
    history = observation.observe(
        SCENE, "model", states(np.zeros(11)), notes=["a # note\nwith two"]
    )
    history.save(tmp_path / "run.csv")
    lines = (tmp_path / "run.csv").read_text("utf-8").splitlines()
    assert f"# outcome: {json.dumps(history.outcome)}" in lines
    assert max(len(line) for line in lines if line.startswith("#")) < 400
    assert History.load(tmp_path / "run.csv").notes == ("a # note?with two",)


def test_a_file_with_its_metadata_in_a_column_is_read_as_before(written):
    about = '{"outcome": "at rest", "half_width": 0.4, "half_height": 1.5, "model": "older"}'
    history = History.load(written("older.csv", rows_about(about)))
    assert history.outcome == "at rest"
    assert history.model == "older"
    assert history.block is not None
    assert history.block.half_height == 1.5
    assert set(history.channels) == {"t", "theta"}


def test_metadata_that_nobody_wrote_are_refused(written, fault_of):
    text = f"# {HEAD}\n# cost: {{broken\nt,theta\n0,0\n1,0.1\n"
    assert "metadata: not written by rockcheck" in str(
        fault_of(History.load, written("edited.csv", text))
    )


@pytest.mark.parametrize("row", ["soon,uplift,,,0", "0.5,uplift,,,nan", "0.5,uplift,,,inf"])
def test_hostile_events(written, fault_of, row):
    written("run.events.csv", f"t,kind,mode_before,mode_after,impulse\n{row}\n")
    assert "run.events.csv: not an events table" in str(
        fault_of(History.load, written("run.csv", "t,theta\n0,0\n1,0.1\n"))
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_overturning_cuts_the_rows(side):
    state = states(side * np.linspace(1.2, 2.2, 11))
    name = "overturned left" if side > 0 else "overturned right"
    history = observation.observe(SCENE, "model", state, events=[Event(t=0.02, kind=name)])
    assert history.outcome == name
    assert len(history.channels["t"]) == 4
    assert np.max(np.abs(history.channels["theta"])) < math.pi / 2
    with pytest.raises(ValueError, match="must report the event"):
        observation.observe(SCENE, "model", state)


def test_columns_as_csv_have_all_digits_and_no_word_for_what_is_not_a_number():
    columns = {
        "a": [0.1 + 0.2, math.nan, -0.0],
        "b": ["x, y", "", "z"],
        "c": [1e-300, 1.0, math.inf],
    }
    assert (
        writing.columns_text(columns)
        == 'a,b,c\n0.30000000000000004,"x, y",1e-300\n,,1.0\n-0.0,z,inf\n'
    )
    assert writing.columns_text(columns) == pd.DataFrame(columns).to_csv(
        index=False, lineterminator="\n"
    )
