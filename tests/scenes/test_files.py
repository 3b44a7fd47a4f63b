"""Scene files (TOML), the scenes that come with the package, and numbers that are not known
exactly: how they are distributed, what is refused, where they stand in a scene."""

import math
from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import PAPER_BLOCK, Block, Ricker, errors, files, load_scene

TEXT = """
duration = 8.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = 0.3
[[walls]]
side = "left"
gap = 0.053
[excitation]
kind = "ricker"
amplitude = 6.0
period = 0.98
"""


def test_a_scene_file(written):
    scene = load_scene(written("bookcase.toml", TEXT))
    assert scene.name == "bookcase"
    assert scene.wall("left").gap == 0.053
    assert scene.excitation == Ricker(amplitude=6.0, period=0.98)
    assert load_scene(str(written("a.toml", 'name = "other"\n' + TEXT))).name == "other"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "duration = 8.0",
            "duration = -8.0",
            "duration: -8.0 is not allowed: input should be greater than 0",
        ),
        ("duration = 8.0", "", "duration: is missing"),
        ("duration = 8.0", "durations = 8.0", "durations: unknown key; did you mean 'duration'"),
        ("duration = 8.0", "duration = 8.0\ncolour = 1", "colour: unknown key"),
        ("duration = 8.0", "duration = nan", "duration: nan is not allowed"),
        (
            "half_width = 0.397",
            "half_width = -0.397",
            "block.half_width: -0.397 is not allowed: input should be greater than 0",
        ),
        (
            "half_width = 0.397",
            'half_width = "0.397"',
            "block.half_width: the text '0.397' is not allowed",
        ),
        ('side = "left"', 'side = "top"', "walls.0.side: top is not allowed"),
        ('kind = "ricker"', 'kind = "morlet"', "excitation"),
        ('kind = "ricker"', "", "excitation: kind is missing"),
        ("period = 0.98", "period = 0.98\nfile = 'a.AT2'", "excitation.file: unknown key"),
        ('kind = "ricker"', 'kind = "record"\nfile = "none.AT2"', "none.AT2: cannot be read"),
        ("[floor]", "[floor", "not valid TOML"),
        ("[floor]", "[block]", "not valid TOML"),
        ("duration = 8.0", "a = " + "[" * 20000, "not valid TOML"),
    ],
)
def test_faults_name_file_key_and_value(old, new, said, written, fault_of):
    fault = fault_of(load_scene, written("bookcase.toml", TEXT.replace(old, new)))
    assert said in str(fault).split("bookcase.toml: ", 1)[1]


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("fig4aa", "did you mean 'fig4a'?"),
        ("scene.json", "or the path of a .toml file"),
        (None, "source: give a name"),
    ],
)
def test_what_is_no_scene_is_told(source, said, fault_of):
    assert said in str(fault_of(load_scene, source))


def test_a_record_is_looked_up_beside_the_file_then_in_the_package(written, fault_of):
    text = (
        TEXT.split("[excitation]")[0]
        + '[excitation]\nkind = "record"\nfile = "elcentro_1940_ns.csv"\nscale = 1.6\n'
    )
    path = written("bookcase.toml", text)
    assert len(load_scene(path).excitation.unscaled) > 1000
    written("elcentro_1940_ns.csv", "time_s,acceleration_g\n0,0.1\n0.1,0.2\n")
    assert len(load_scene(path).excitation.unscaled) == 2
    outside = text.replace("elcentro_1940_ns.csv", "../elcentro_1940_ns.csv")
    assert "cannot be read" in str(fault_of(load_scene, written("outside.toml", outside)))


@pytest.mark.parametrize(
    ("name", "friction", "gap", "restitution"),
    [
        ("fig4a", 0.3, None, None),
        ("fig4b", 0.6, None, None),
        ("fig5a", 0.3, 0.053, 0.0),
        ("fig5b", 0.3, 0.053, 0.5),
    ],
)
def test_the_papers_scenes(name, friction, gap, restitution):
    scene = load_scene(name)
    record, walls = scene.excitation, [] if gap is None else [("left", gap, restitution)]
    assert scene.name == name
    assert scene.floor.friction == friction
    assert scene.duration == 36.0
    assert scene.block == PAPER_BLOCK
    assert record.time_step == 0.02
    assert record.peak == pytest.approx(1.6 * 0.31882, abs=1e-9)
    assert [(wall.side, wall.gap, wall.restitution) for wall in scene.walls] == walls
    assert scene.description


def test_a_message_lists_no_more_names_than_fit_a_line():
    said = errors.suggestion("s7x", [f"s{n}" for n in range(errors.MOST_NAMES + 20)])
    assert said.startswith("; did you mean 's7'? allowed: s0, s1, s10, ")
    assert said.endswith(" and 20 more")
    assert errors.suggestion("ebn", ["ebm", "cm"]) == "; did you mean 'ebm'? allowed: cm, ebm"


# --- numbers that are not known exactly


@pytest.mark.parametrize(
    ("given", "mean", "sd", "at", "share"),
    [
        *(
            # Where it is wide, the median is far below the mean.
            (
                {"value": 3.0, "sd": 3.0 * cv, "distribution": "lognormal"},
                *(3.0, 3.0 * cv, 3.0 / math.sqrt(1.0 + cv**2), 0.5),
            )
            for cv in (0.05, 0.5, 2.0)
        ),
        *(
            (given, 3.0, 0.5, 3.0 + 0.25 * 3**0.5, 0.75)
            for given in (
                {"value": 3.0, "sd": 0.5, "distribution": "uniform"},
                {"low": 3.0 - 0.75**0.5, "high": 3.0 + 0.75**0.5},
            )
        ),
        ({"value": -3.0, "sd": 0.5}, -3.0, 0.5, -2.5, 0.5 * (1.0 + math.erf(math.sqrt(0.5)))),
    ],
)
def test_a_number_has_its_mean_its_standard_deviation_and_its_distribution(
    given, mean, sd, at, share
):
    law = files.Spread(**given).law
    assert law.mean() == pytest.approx(mean, rel=1e-12)
    assert law.std() == pytest.approx(sd, rel=1e-12)
    assert law.cdf(at) == pytest.approx(share, rel=1e-12)


@pytest.mark.parametrize(("given", "nominal"), [({}, 1.5), ({"value": 1.1}, 1.1)])
def test_a_number_within_bounds_is_in_their_middle_unless_it_is_given(given, nominal):
    assert files.Spread(low=1.0, high=2.0, **given).nominal == nominal


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"low": 0.1, "high": 0.1}, "high"),
        ({"low": 0.2, "high": 0.1}, "high"),
        ({"low": 0.1}, "high"),
        ({"high": 0.1}, "low"),
        ({"sd": 0.1}, "value"),
        ({"value": 0.1, "sd": 0.1, "low": 0.0}, "sd"),
        ({"value": 0.1, "sd": 0.1, "high": 0.0}, "sd"),
        ({"value": 0.0, "sd": 0.1, "distribution": "lognormal"}, "value"),
        ({"low": 0.1, "high": 0.2, "distribution": "lognormal"}, "distribution"),
        ({"low": 0.1, "high": 0.2, "distribution": "normal"}, "distribution"),
    ],
)
def test_what_is_no_spread(given, key, fault_of):
    assert fault_of(files.Spread, **given).key == key


TABLES = {
    "floor": {"friction": 0.3},
    "duration": {"value": 2.0, "sd": 0.1},
    "block": {
        "half_width": {"low": 0.3, "high": 0.5},
        "half_height": 1.0,
        "centre_of_mass": [0.05, 0.2],
    },
    "walls": [{"side": "right", "gap": {"value": 0.05, "sd": 0.01}}, {"side": "left", "gap": 0.06}],
}


def made():
    one = files.uncertain_scene_from(TABLES, folder=Path(), default_name="made")
    return one.scene, one.spreads


def test_numbers_stand_where_they_were_written():
    scene, spreads = made()
    assert list(spreads) == ["duration", "block.half_width", "walls.right.gap"]
    assert scene.duration == 2.0
    assert scene.block.half_width == 0.4
    assert scene.wall("right").gap == 0.05
    other = files.with_numbers(
        scene,
        {
            "duration": 3.0,
            "block.half_width": 0.35,
            "block.half_height": 1.5,
            "block.centre_of_mass.0": 0.1,
            "walls.right.gap": 0.02,
        },
    )
    assert other.duration == 3.0
    assert other.block == Block(half_width=0.35, half_height=1.5, centre_of_mass=(0.1, 0.2))
    assert other.wall("left").gap == 0.06
    assert other.wall("right").gap == 0.02


def test_correlations_that_contradict_each_other_are_refused(fault_of):
    scene, spreads = made()
    a, b, c = spreads
    fine = files.uncertain_scene(
        scene, spreads, {f"{a}, {b}": 0.9, f"{b},{c}": 0.9, f"{a}, {c}": 0.9}
    )
    np.testing.assert_array_equal(fine.correlation, 0.9 + 0.1 * np.eye(3))
    plain = [files.uncertain_scene(scene, numbers, {}) for numbers in (spreads, {})]
    assert [one.independent for one in (fine, *plain)] == [False, True, True]
    for wrong, said in (
        ({f"{a}, {b}": 0.9, f"{b}, {c}": 0.9, f"{a}, {c}": -0.9}, "not positive definite"),
        ({f"{a}, {a}": 0.5}, "give two uncertain numbers"),
        ({f"{a}, {b}, {c}": 0.5}, "give two uncertain numbers"),
        ({f"{a}, {b}": -1.0}, "between -1 and 1"),
        ({f"{a}, {b}": 1}, "between -1 and 1"),
        ({f"{a}, {b}": True}, "between -1 and 1"),
        ({f"{a}, gravity": 0.5}, "not an uncertain number"),
    ):
        assert said in str(fault_of(files.uncertain_scene, scene, spreads, wrong))


def test_correlated_inputs_have_the_correlation_and_their_own_distributions():
    scene, spreads = made()
    values = files.uncertain_scene(scene, spreads, {"duration, walls.right.gap": -0.8}).values(
        np.random.default_rng(1).random((50_000, 3))
    )
    assert np.corrcoef(values.T)[0] == pytest.approx([1.0, 0.0, -0.8], abs=0.02)
    assert values.mean(axis=0) == pytest.approx([2.0, 0.4, 0.05], rel=5e-3)
    assert values.std(axis=0) == pytest.approx([0.1, 0.2 / math.sqrt(12.0), 0.01], rel=2e-2)


def test_a_scene_file_has_its_remarks_on_top_and_its_tables_last(tmp_path):
    """A value after a table would be the table's."""
    tables = {"block": {"half_width": 0.3, "half_height": 1.0}, "name": "shelf", "duration": 2.0}
    text = files.scene_text(tables | {"floor": {"friction": 0.5}}, "First.\nSecond.")
    assert text.startswith("# First.\n# Second.\n")
    path = tmp_path / "shelf.toml"
    path.write_text(text, "utf-8")
    scene = load_scene(path)
    assert scene.duration == 2.0
    assert scene.block.half_height == 1.0
