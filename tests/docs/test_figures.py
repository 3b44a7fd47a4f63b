"""The figures that pages state, computed again; tables between markers are those of the kept runs;
pages keep to their budget of words."""

import re
from pathlib import Path

import experience
import gallery
import hostile
import numpy as np
import pandas
import planted
import pytest
import whole_runs
from cases import kept_spectra

from rockcheck import ContinuousModel, EventBasedModel, MuJoCo, compare, load_scene
from rockcheck.commands.cli import main
from rockcheck.ebm.core import block, contacts, names, series, settle, state
from rockcheck.scenes import recordings
from rockcheck.scenes.experience import Experience
from rockcheck.scenes.kinematics import pivot_height
from rockcheck.scenes.recordings import intensity, synthetic
from rockcheck.validation.studies.work_precision.runs import LINES
from rockcheck.validation.suite import suites
from rockcheck.validation.suite.runner import run_suite

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
UNILATERAL = EventBasedModel(pivot="unilateral")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_tables_are_those_of_the_kept_runs(page):
    text = page.read_text("utf-8")
    assert whole_runs.filled(text) == text


def test_the_documentation_keeps_to_its_budget_of_words():
    words = {page.stem: len(page.read_text("utf-8").split()) for page in PAGES}
    assert sum(words.values()) <= 20_000
    most = {"theory": 4000, "README": 600}
    assert {page: n for page, n in words.items() if n > most.get(page, 1500)} == {}


def rounded(value: float, digits: int = 1) -> float:
    return float(f"{value:.{digits}g}")


def test_the_front_picture():
    scene = gallery.front_scene().replace(output_step=0.001)
    paper, found = EventBasedModel().simulate(scene), UNILATERAL.simulate(scene)
    hop = np.max(pivot_height(scene.block, found.channels["y"], found.channels["theta"]))
    assert rounded(hop, 2) == 0.0057
    assert paper.outcome == "overturned right"
    assert found.outcome == "at rest"
    others = [one.simulate(scene) for one in (ContinuousModel(), MuJoCo(time_step=1e-4))]
    apart = np.abs([one.channels["theta"] - found.channels["theta"] for one in others])
    off = np.max(apart, axis=1) / scene.block.alpha
    assert 1e-4 < min(off) <= max(off) < 0.01


def test_the_tutorials_bookcase(tmp_path, told):
    told("new", str(tmp_path / "cabinet.toml"))
    scene = load_scene(tmp_path / "cabinet.toml")
    reference = UNILATERAL.simulate(scene)
    assert rounded(reference.peak_rotation / reference.alpha, 2) == 0.72
    assert reference.outcome == "at rest"
    assert sum(event.kind == "wall impact" for event in reference.event_list) == 2
    error = {
        name: compare(reference, model.simulate(scene))["theta_rms"]
        for name, model in (
            ("ebm", EventBasedModel()),
            ("cm", ContinuousModel()),
            ("mujoco", MuJoCo(time_step=1e-3)),
        )
    }
    assert rounded(error["mujoco"]) == 9e-4
    assert rounded(error["ebm"], 2) == 0.2
    assert max(error["cm"], error["mujoco"]) < 0.004


@pytest.fixture(scope="module")
def fifth_floor(tmp_path_factory):
    """The folder of the page about storeys: its scene, and its twelve motions."""
    folder = tmp_path_factory.mktemp("storeys")
    page = (DOCS / "storeys.md").read_text("utf-8")
    scene = re.search(r'```toml title="bookcase.toml"\n(.*?)```', page, re.DOTALL)
    assert scene is not None
    (folder / "bookcase.toml").write_text(scene[1], encoding="utf-8")
    main(["new", str(folder / "records"), "--motions", "12", "-q"])
    return folder


def test_the_bookcase_on_the_fifth_floor(fifth_floor):
    scene = load_scene(fifth_floor / "bookcase.toml")
    ground = recordings.read_record(fifth_floor / "records" / "synthetic-01.csv")
    assert rounded(scene.excitation.peak, 2) == 0.61
    assert rounded(intensity.peak_acceleration(ground), 2) == 0.47
    found = UNILATERAL.simulate(scene)
    assert found.outcome == "at rest"
    assert rounded(found.peak_rotation / found.alpha, 2) == 0.84
    assert rounded(found.extremes.walls["left"].speed, 2) == 1.7
    assert rounded(found.extremes.slip, 1) == scene.walls[0].gap


def test_the_mean_of_the_twelve_motions_is_within_8_percent():
    target = synthetic.Target(ground="B", acceleration=0.3)
    found = synthetic.synthetic_motions(target)
    spectra = [
        [intensity.spectral_acceleration(motion, period) for period in synthetic.PERIODS.tolist()]
        for motion in found
    ]
    ratios = np.mean(spectra, axis=0) / target.spectral_acceleration(synthetic.PERIODS)
    assert np.max(np.abs(ratios - 1.0)) < 0.085


@pytest.mark.slow
def test_the_curve_on_the_fifth_floor(fifth_floor, told, tmp_path):
    scene, records = str(fifth_floor / "bookcase.toml"), str(fifth_floor / "records")
    capacities = ("--capacity", "wall_speed:1.0", "--capacity", "overturns")
    told("assess", scene, records, *capacities, "--out", str(tmp_path))
    damage = pandas.read_csv(tmp_path / "capacities.csv")
    assert [rounded(value, 2) for value in damage["median"]] == [0.22, 0.36]
    assert [rounded(value, 2) for value in damage["dispersion"]] == [0.24, 0.24]
    assert damage["islands"].tolist()[1] == 11


@pytest.mark.slow
def test_the_floors_on_which_the_bookcase_falls(fifth_floor, told, tmp_path):
    scene, records = str(fifth_floor / "bookcase.toml"), str(fifth_floor / "records")
    found = told("assess", scene, records, "--storeys", "1:8", "--out", str(tmp_path))
    assert [storey["overturned"] for storey in found["storeys"]] == [0, 0, 0, 0, 6, 10, 11, 11]


def settings() -> dict[str, list[tuple[float, float]]]:
    """Error (alpha) and cost of each setting of the kept benchmark, by kind of scene."""
    drawn = [
        line
        for plot in whole_runs.load("benchmark").plots()
        for panel in plot.panels
        for line in panel.series
    ]
    return {
        f"{name} {value:g}": [(one.y[k], one.x[k]) for one in drawn if one.label == name]
        for name, line in LINES.items()
        for k, value in enumerate(line.values)
    }


@pytest.mark.parametrize(
    ("names", "least", "most", "ratios"),
    [
        (["ebm-unilateral 1e-10"], 3e-15, 2e-10, [1.1]),
        (["ebm 1e-10"], 3e-15, 3e-10, [1.0]),
        (["ebm-bouc-wen 1e-05"], 3e-5, 3e-2, [110.0]),
        (["cm 1e-08"], 2e-7, 2e-4, [77.0]),
        (["{} tolerance 1e-09"], 2e-9, 2e-7, [610.0, 830.0]),
        (["{} tolerance 1e-08"], 4e-8, 1e-6, [290.0, 420.0]),
        (["{} 0.0001"], 2e-5, 3e-3, [5900.0, 6300.0]),
        (["{} 0.001"], 2e-4, 1e-2, [610.0, 640.0]),
    ],
)
def test_the_table_of_choices(names, least, most, ratios):
    found = settings()
    lines = {name.format(engine) for name in names for engine in ("mujoco", "pybullet")}
    errors = [error for line in lines for error, _ in found[line]]
    assert rounded(min(errors)) == least
    assert rounded(max(errors)) == most
    assert sorted(rounded(np.median(ratio(found, one, "ebm 1e-10")), 2) for one in lines) == ratios


def ratio(found, line, other) -> list[float]:
    """Costs of a setting over those of another one."""
    return [one / two for (_, one), (_, two) in zip(found[line], found[other], strict=True)]


def test_the_step_that_an_engine_needs():
    rows = {
        row["line"]: row
        for run in ("league", "league-jolt")
        for row in whole_runs.load(run).table("first-steps").records()
    }
    reached = {line: row["all"] for line, row in rows.items()}
    at_best = {reached[line] for line in ("mujoco", "pybullet", "pymunk", "dart", "box2d")}
    assert at_best == {1e-4}
    adaptive = {step for line, step in reached.items() if line.endswith(" adaptive")}
    assert adaptive == {8e-3}
    assert {reached[f"{engine} default"] for engine in ("pymunk", "dart")} == {1e-4}
    beyond = {line: rows[line]["smallest"] for line in ("drake", "physx", "jolt")}
    assert beyond == {"drake": 1e-3, "physx": 1e-4, "jolt": 1e-4}
    assert {reached[line] for line in beyond} == {None}


def test_what_the_benchmark_says():
    found = settings()
    assert (
        1.285
        < max(
            max(ratio(found, f"{one} 1e-12", f"{one} 0.0001")) for one in ("ebm", "ebm-unilateral")
        )
        < 1.295
    )
    pairs = [(f"{one} tolerance 1e-08", f"{one} 0.001") for one in ("mujoco", "pybullet", "pymunk")]
    for pair in pairs:
        assert 0.45 < np.median(ratio(found, *pair)) < 0.95
    gains = [
        coarse / fine
        for pair in pairs
        for (fine, _), (coarse, _) in zip(*(found[one] for one in pair), strict=True)
    ]
    assert 1900 <= min(gains) < 2000
    bad = [
        error
        for engine in ("mujoco", "pybullet")
        for step in ("0.01", "0.001", "0.0001")
        for error, _ in found[f"{engine} default {step}"]
    ]
    assert rounded(min(bad)) == 2e-3
    assert rounded(max(bad)) == 2e-1


@pytest.mark.parametrize(
    ("module", "name", "stated"),
    [
        (series, "AHEAD", 0.02),
        (series, "INSTANT", 1e-9),
        (series, "ORDER", 15),
        (contacts, "CLOSED", 1e-10),
        (contacts, "SLOW", 1e-9),
        (block, "LEAST_FRICTION", 1e-9),
        (settle, "SETTLE", 5e-8),
        (settle, "_QUIET", 0.025),
        (settle, "_FASTEST", 2.5e-3),
        (settle, "_AT_ONCE", 20),
        (settle, "_IMPACTS", 100),
        (settle, "_TIMES", 500),
        (state, "MODES", 128),
    ],
)
def test_a_threshold_that_the_limits_name(module, name, stated):
    assert getattr(module, name) == stated


def test_what_counts_as_closed_and_each_choice_is_on_the_page_of_limits():
    assert series.NOISE[names.Kind.POSITION] == 1e-13
    assert set(
        re.findall(r"^\| ([\w ]+) \|", (DOCS / "limits.md").read_text("utf-8"), flags=re.MULTILINE)
    ) >= set(names.RULE_NAMES)


def floor_impulses(scene, step=1e-4, alone=5) -> list[float]:
    """The floor's vertical impulse per unit mass (m/s) at each wall impact with no other event
    within `alone` rows: the jump of y_dot."""
    history = EventBasedModel().simulate(scene.replace(output_step=step))
    times, rate = history.channels["t"], history.channels["y_dot"]
    instants = np.array([event.t for event in history.event_list])
    found = []
    for t in (event.t for event in history.event_list if event.kind == "wall impact"):
        after = int(np.searchsorted(times, t, side="right"))
        if (np.sum(np.abs(instants - t) < alone * step) == 1) and 2 <= after < len(times) - 1:
            came = rate[after - 1] + (rate[after - 1] - rate[after - 2]) / step * (
                t - times[after - 1]
            )
            went = rate[after] - (rate[after + 1] - rate[after]) / step * (times[after] - t)
            found.append(float(went - came))
    return [one for one in found if abs(one) > 1e-6]  # a block that stands flat has none


def test_the_papers_floor_pulls_at_every_wall_impact():
    found = [
        one for scene in suites.load_suite("walls").scenes.values() for one in floor_impulses(scene)
    ]
    assert len(found) == 282
    assert max(found) < 0.0


def test_the_models_bias_and_scatter():
    found = Experience.model_validate_json(experience.KEPT.read_text("utf-8"))
    assert experience.tables(found).strip() in (DOCS / "theory.md").read_text("utf-8")


def test_counts_that_are_stated():
    assert sum(1 for _ in hostile.cases()) == 211
    assert len(planted.FAULTS) == 37


def test_the_papers_spectra_are_of_280_000_runs():
    assert sum(spectrum.outcomes.size for spectrum in kept_spectra()) == 280_000


def test_no_node_of_the_papers_spectra_is_undecided():
    assert [s.scene.name for s in kept_spectra() if len(s.undecided)] == []


def test_experience_is_learnt_from_a_run(tmp_path):
    """It keeps the settings that a model can be given, not what follows from them."""
    block = "{ half_width = 0.4, half_height = 1.5 }, floor = { friction = 0.9 }"
    scenes = ", ".join(
        f'{{ name = "at {tilt}", duration = 1.0, initial_rotation = {tilt}, block = {block} }}'
        for tilt in (0.06, 0.08, 0.1, 0.12, 0.15)
    )
    (tmp_path / "five.toml").write_text(
        f'reference = "ebm-unilateral"\nscene = [{scenes}]\n'
        "[models.ebm-unilateral]\n[models.ebm]\ntolerance = 1e-9\n[models.cm]\n"
        '[[ensemble]]\nname = "two"\ncount = 2\nfriction = { uniform = [0.8, 0.9] }\n'
        f"scene = {{ duration = 1.0, initial_rotation = 0.1, block = {block} }}\n"
    )
    found = experience.experience_of(
        [run_suite(suites.load_suite(tmp_path / "five.toml"), tmp_path / "run")]
    )
    counts = {model: one["peak_rotation"].count for model, one in found.trust.items()}
    assert counts == {"cm": 7, "ebm": 7}
    assert found.settings["cm"] == {"penetration": (1e-8,), "damping_rule": ("calibrated",)}
    assert found.settings["ebm"]["pivot"] == ("bilateral",)
    assert found.settings["ebm"]["tolerance"] == (1e-9,)
