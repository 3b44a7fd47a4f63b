"""An assessment against a loop of one's own, and what it says."""

import itertools
import json
import math
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from dask.distributed import LocalCluster

from rockcheck import EventBasedModel, Record, load_scene
from rockcheck.scenes import files
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.studies.population.plan import GapRange, Plan
from rockcheck.validation.studies.population.study import Assessment
from rockcheck.validation.studies.population.tasks import draws_of

CABINET = """
duration = 12.0
[block]
half_width = 0.3
half_height = 1.0
[floor]
friction = 0.4
[[walls]]
side = "right"
gap = 0.05
[excitation]
kind = "ricker"
amplitude = 5.0
period = 0.9
"""
GAPS = (0.0, 0.05, 0.15, 0.4)
COUNT = 12


def noise(seed: int) -> Record:
    """A seeded motion of 10 s, coloured and with an envelope, of 4 to 12 m/s^2."""
    random = np.random.default_rng(seed)
    t = 0.02 * np.arange(500)
    tones = np.arange(0.4, 5.0, 0.2)
    phases = random.uniform(0.0, 2.0 * math.pi, len(tones))
    envelope = np.minimum(t / 2.0, 1.0) * np.exp(-np.maximum(t - 5.0, 0.0))
    samples = envelope * (np.sin(2.0 * math.pi * np.outer(t, tones) + phases) @ (1.0 / tones))
    return Record.from_samples(samples * random.uniform(4.0, 12.0) / np.abs(samples).max(), 0.02)


def write_record(path, samples):
    rows = "".join(f"{0.02 * k!r},{a!r}\n" for k, a in enumerate(samples))
    path.write_text(f"time_s,acceleration_m_s2\n{rows}", "utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("assess")
    (path / "records").mkdir()
    for seed in range(COUNT):
        write_record(path / "records" / f"R{seed:02d}.csv", noise(seed).unscaled)
    for name, text in {
        "cabinet": CABINET,
        "uncertain": CABINET.replace("friction = 0.4", "friction = { value = 0.4, sd = 0.04 }"),
        "uncertain-pulse": CABINET.replace("= 5.0", "= { value = 5.0, sd = 0.1 }"),
        "bouncy": CABINET.replace("friction = 0.4", "friction = 0.4\nrestitution = 0.5"),
        "elastic": CABINET.replace("friction = 0.4", "friction = 0.4\nrestitution = 1.0"),
        "brief": CABINET.replace("duration = 12.0", "duration = 0.004"),
        "pga": CABINET.partition("kind")[0]
        + 'kind = "record"\nfile = "records/R01.csv"\npga = 0.5\n',
    }.items():
        (path / f"{name}.toml").write_text(text, "utf-8")
    return path


@pytest.fixture
def assess(folder, tmp_path, monkeypatch, told):
    monkeypatch.chdir(folder)
    return lambda words, code=0, out="out": told(
        *f"assess {words}".split(), "--out", str(tmp_path / out), code=code
    )


@pytest.fixture(scope="module")
def loop(folder):
    """What a user would write: the histories by gap (inf: without the wall) and record."""
    scene, model = load_scene(folder / "cabinet.toml"), EventBasedModel(pivot="unilateral")
    found = {}
    for gap, path in itertools.product((*GAPS, math.inf), sorted((folder / "records").iterdir())):
        shaken = scene.replace(
            walls=[] if math.isinf(gap) else [scene.walls[0].replace(gap=gap)],
            excitation=Record.from_file(path),
        )
        found[gap, path.stem] = shaken, model.simulate(shaken)
    return found


@pytest.fixture(scope="module")
def standing(loop):
    """The histories of the records as they are whose block stands."""
    as_it_is = {name: run for (gap, name), (_, run) in loop.items() if gap == 0.05}
    return {k: h for k, h in as_it_is.items() if not h.outcome.startswith("overturned")}


def test_outcomes_are_counted_as_in_a_loop_of_ones_own(under_records, standing):
    answer = under_records
    fallen = COUNT - len(standing)
    assert 0 < fallen < COUNT, "the records tell falling from standing"
    assert answer["runs"] == COUNT
    assert answer["undecided"] == 0
    assert answer["overturning"]["count"] == fallen
    assert answer["overturning"]["probability"] == pytest.approx(fallen / COUNT)


@pytest.fixture(scope="module")
def under_records(folder, tmp_path_factory):
    """What is said of the cabinet under all records."""
    out = tmp_path_factory.mktemp("under-records")
    words = f"assess cabinet.toml records --json --out {out}"
    done = subprocess.run(
        [sys.executable, "-m", "rockcheck", *words.split()],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


@pytest.mark.parametrize("quantity", ["peak_rotation", "slip", "top_displacement", "wall_speed"])
def test_quantities_are_the_extremes_of_the_runs_that_stand(under_records, standing, quantity):
    values = {name: of_history(run)[quantity] for name, run in standing.items()}
    known = {name: value for name, value in values.items() if value is not None}
    answer = under_records["quantities"][quantity]
    assert answer["of"] == len(known)
    assert answer["record"] == max(known, key=known.get)
    assert answer["median"] == pytest.approx(np.median([*known.values()]), rel=1e-6)
    assert answer["largest"] == pytest.approx(max(known.values()), rel=1e-6)


def of_history(history):
    """The four figures, from the extremes of a history that lasts until the block rests."""
    extremes = history.extremes
    strikes = [wall.speed for wall in extremes.walls.values() if wall.strikes]
    return {
        "peak_rotation": extremes.peak_rotation / math.atan(0.3),
        "slip": extremes.slip,
        "top_displacement": extremes.top_displacement,
        "wall_speed": max(strikes, default=None),
    }


def test_runs_at_the_gaps_asked_for_are_those_of_a_loop_of_ones_own(assess, loop):
    answer = assess(f"cabinet.toml records --gaps {','.join(map(str, GAPS))}")
    at = [[loop[gap, f"R{k:02d}"][1] for k in range(COUNT)] for gap in GAPS]
    fallen = [sum(run.outcome.startswith("overturned") for run in runs) for runs in at]
    struck = [sum(run.extremes.walls["right"].strikes > 0 for run in runs) for runs in at]
    assert [row["gap"] for row in answer["gaps"]] == list(GAPS)
    assert [row["runs"] for row in answer["gaps"]] == [COUNT] * len(GAPS)
    assert [row["overturned"] for row in answer["gaps"]] == fallen
    assert [row["struck"] for row in answer["gaps"]] == struck


def test_the_clearance_is_the_reach_without_the_wall(assess, loop):
    answer = assess("cabinet.toml records --gaps 0,0.4")
    free = [loop[math.inf, f"R{k:02d}"][1] for k in range(COUNT)]
    assert answer["clearance"] == pytest.approx(
        max(history.extremes.reach_right for history in free), rel=1e-9
    )


def test_gaps_are_searched_without_any_option(assess, folder):
    """Every interval of 2 mm or more that a loop over gaps finds, its ends to 0.1 mm."""
    answer = assess("cabinet.toml records/R00.csv records/R03.csv records/R07.csv")
    found = {row["record"]: row["intervals"] for row in answer["gap_search"]["falls"]}
    step, end = 5e-4, min(answer["gap_search"]["to"], 0.4)
    model, scene = EventBasedModel(pivot="unilateral"), load_scene(folder / "cabinet.toml")
    gaps = np.arange(0.0, end, step)
    for name in ("R00", "R03", "R07"):
        shaken = scene.replace(excitation=Record.from_file(folder / "records" / f"{name}.csv"))
        fell = [
            model.simulate(
                shaken.replace(walls=[shaken.walls[0].replace(gap=gap)], output_step=0.1)
            ).outcome.startswith("overturned")
            for gap in gaps.tolist()
        ]
        for low, high in intervals_of(gaps, fell):
            if high - low >= 2e-3:
                assert any(
                    first <= low + 1e-4 and last >= high - 1e-4
                    for first, last in found.get(name, [])
                ), (name, low, high)


def intervals_of(values, hit):
    """The first and the last value of each run of hits."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], hit, [False]]).astype(int)))
    return [
        (values[first], values[last - 1])
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]


def test_the_least_intensity_is_that_of_a_loop_over_factors(assess, folder):
    (record,) = assess("cabinet.toml records/R03.csv")["intensity"]["records"]
    scene, model = load_scene(folder / "cabinet.toml"), EventBasedModel(pivot="unilateral")
    motion = Record.from_file(folder / "records" / "R03.csv")
    factor = record["least"] / record["as_it_is"]

    def falls(at):
        shaken = scene.replace(excitation=motion.scaled(at), output_step=0.1)
        return model.simulate(shaken).outcome.startswith("overturned")

    assert falls(factor)
    assert [below for below in (0.995, 0.98, 0.9, 0.7, 0.5) if falls(factor * below)] == []


LATE = """
duration = 6.0
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
amplitude = 4.0
period = 1.5
"""


def test_a_fall_after_the_clock_is_a_fall(assess, folder):
    """The block stands at 85 degrees when the scene's clock stops."""
    (folder / "late.toml").write_text(LATE, "utf-8")
    answer = assess("late.toml")
    fallen = answer["outcomes"]["overturned left"] + answer["outcomes"]["overturned right"]
    assert fallen == 1
    assert "overturns" in answer["answer"]


@pytest.mark.parametrize("step", [0.02, 0.001])
def test_no_answer_depends_on_the_output_step(assess, folder, step):
    text = CABINET.replace("duration = 12.0", f"duration = 12.0\noutput_step = {step}")
    (folder / f"steps-{step}.toml").write_text(text, "utf-8")
    plain = assess("cabinet.toml records/R00.csv", out="plain")
    other = assess(f"steps-{step}.toml records/R00.csv", out=f"steps-{step}")
    keys = ("motion", "gaps", "gap_search", "intensity", "overturning")
    assert {key: other[key] for key in keys} == {key: plain[key] for key in keys}


@pytest.mark.parametrize("number", range(len(CRITERIA)), ids=lambda k: CRITERIA[k].name)
def test_hand_methods_stand_beside_the_simulation(under_records, loop, number):
    row = under_records["criteria"][number]
    scenes = [loop[0.05, f"R{k:02d}"][0] for k in range(COUNT)]
    says = [CRITERIA[number].says(scene, base_of(scene))[0] for scene in scenes]
    assert row["of"] == COUNT
    assert row["predicts"] == sum(says)


def test_draws_are_the_same_in_any_number_of_processes_and_are_read_back(assess):
    words = "uncertain.toml records --samples 4 --gaps 0.05,0.2"
    first, again = (assess(f"{words}{more}") for more in ("", " --jobs 1"))
    assert again["made"]["jobs"] == 1
    assert again == first | {"made": again["made"]}
    with LocalCluster(1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        there = assess(f"{words} --scheduler {cluster.scheduler_address}", out="there")
    assert there["gaps"] == first["gaps"]


@pytest.mark.parametrize("model", ["ebm-unilateral", "ebm"])
def test_one_run_says_how_sure_it_is(assess, model):
    answer = assess(f"cabinet.toml --models {model}")
    assert answer["exit_code"] == 0
    assert answer["runs"] == 1
    assert answer["converged"] is True
    assert {q["name"] for q in answer["quantities"]} >= {"peak_rotation", "last_slip", "outcome"}
    assert answer["numerical"]["quantities"] == answer["quantities"]


def test_draws_of_ones_own_motion_are_counted(assess):
    answer = assess("uncertain.toml --samples 16")
    assert answer["runs"] == 16
    assert answer["overturning"]["method"] == "Wilson"
    assert "of 16 draws" in answer["answer"]
    assert answer["tables"]["sensitivities"][0]["input"] == "floor.friction"


def test_a_draw_is_the_run_of_the_scene_with_that_number(assess, folder):
    answer = assess("uncertain.toml --samples 16")
    given = files.load_uncertain_scene(folder / "uncertain.toml")
    model = EventBasedModel(pivot="unilateral")
    runs = [
        model.simulate(files.with_numbers(given.scene, dict(draw))) for draw in draws_of(given, 16)
    ]
    standing = [run for run in runs if not run.outcome.startswith("overturned")]
    peaks = [run.extremes.peak_rotation / math.atan(0.3) for run in standing]
    assert answer["motion"]["peak_rotation"]["of"] == len(standing)
    assert answer["motion"]["peak_rotation"]["largest"] == pytest.approx(max(peaks), rel=1e-9)


def test_a_spread_that_leaves_what_is_allowed_ends_before_anything_is_played(folder, refused):
    text = CABINET.replace("friction = 0.4", "friction = { value = 0.4, sd = 0.3 }")
    (folder / "wide.toml").write_text(text, "utf-8")
    words = refused("assess", str(folder / "wide.toml"))
    assert "floor.friction" in words
    assert "lognormal" in words


def test_a_gap_on_a_side_without_a_wall_tries_one_there(assess):
    answer = assess("cabinet.toml records/R00.csv --gaps left:0.01,0.02")
    assert [row["gap"] for row in answer["gaps"]] == [0.01, 0.02]
    assert answer["gaps"][0]["struck"] == 1


def test_a_side_without_a_wall_is_searched_when_it_is_named(assess):
    answer = assess("cabinet.toml records/R00.csv --gaps left")
    assert answer["gap_search"]["side"] == "left"
    assert answer["gap_search"]["from"] == 0.0
    assert answer["gap_search"]["to"] == pytest.approx(answer["clearance"])


def test_a_gap_that_is_tried_leaves_the_scene_as_it_is(assess):
    plain = assess("cabinet.toml records/R00.csv")
    tried = assess("cabinet.toml records/R00.csv --gaps left:0.01,0.02")
    assert tried["outcomes"] == plain["outcomes"]
    assert tried["quantities"] == plain["quantities"]


def test_a_gap_that_was_not_played_is_not_called_safe(folder):
    """As where Ctrl-C ended the runs, or all of them failed."""
    own = files.load_uncertain_scene(folder / "cabinet.toml")
    plan = Plan(own=own, cases={"cabinet": own}, gaps=[GapRange("right", (0.05, 0.1))])
    done = {task: task.play() for task in plan.shown.values()}
    found = Assessment(plan=plan).gather(done)
    assert found.data["gaps"] == []
    assert found.data["none_overturns_up_to"] is None
    assert found.exit_code == 0


def test_the_other_law_of_impacts_is_another_one(folder):
    own = files.load_uncertain_scene(folder / "cabinet.toml")
    models = {"ebm-unilateral": {"impacts": "floor-first"}}
    plan = Plan(own=own, cases={"cabinet": own}, models=models)
    assert dict(plan.by_other_law["cabinet"].settings) == {"impacts": "moreau"}


def test_the_history_of_each_run_and_its_tables_are_written(assess, tmp_path, loop):
    assess("cabinet.toml records/R0*.csv --gaps 0.05")
    out = tmp_path / "out"
    page = (out / "index.html").read_text("utf-8")
    shown = ("as CSV, in at most 2000 rows", *(f'href="histories/R0{k}.csv"' for k in (0, 9)))
    assert [part for part in shown if part not in page] == []
    for name in ("R00", "R09"):
        theta = loop[0.05, name][1].channels["theta"]
        kept = pd.read_csv(out / "histories" / f"{name}.csv", comment="#").theta
        assert kept.tolist() == pytest.approx(theta[:: -(-len(theta) // 2000)].tolist(), abs=1e-15)
    assert {path.stem for path in out.glob("*.csv")} >= {
        "outcomes",
        "quantities",
        "gaps_right",
        "gap_intervals_right",
        "intensities",
        "contributions",
        "criteria",
        "runs",
    }
    assert (out / "summary.md").read_text("utf-8").startswith("# Assessment: cabinet")


def test_each_record_has_a_file_of_its_own(folder, assess, tmp_path):
    (folder / "alike").mkdir()
    for seed, name in enumerate(("a b.csv", "a-b.csv")):
        write_record(folder / "alike" / name, noise(seed).unscaled)
    assess("cabinet.toml alike")
    assert len(list((tmp_path / "out" / "histories").iterdir())) == 2


def test_of_a_run_that_is_not_converged_no_figure_is_sure(assess, typed, tmp_path):
    typed("new", "new.toml")
    answer = assess("new.toml --models mujoco,ebm-unilateral --set time_step=1e-3", code=1)
    assert answer["exit_code"] == 1
    assert answer["model"] == "mujoco"
    assert [row["model"] for row in answer["tables"]["models"]] == ["ebm-unilateral"]
    sure = {row["question"]: row["answer"] for row in answer["tables"]["answers"]}
    assert "Not converged: no figure is sure." in sure["How sure is that?"]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("bouncy.toml --models ebm", 3),
        ("bouncy.toml --models ebm-unilateral,ebm", 3),
        ("bouncy.toml records/R00.csv --models cm,ebm", 3),
        # one that knows it, where the event-based ones do not
        ("elastic.toml records/R00.csv --models cm", 0),
        ("brief.toml", 0),  # of one row
    ],
)
def test_it_ends_with_3_only_where_a_model_does_not_know_the_floor(assess, words, code):
    assess(words, code=code)


def test_a_peak_acceleration_scales_the_record_of_a_scene(folder):
    scaled = load_scene(folder / "pga.toml").excitation
    assert scaled == Record.from_file(folder / "records" / "R01.csv", pga=0.5)
    assert scaled.peak == pytest.approx(0.5, rel=1e-12)
    assert scaled.unscaled == noise(1).unscaled


def test_a_scaled_record_moves_the_base_upward_as_much_more(folder, assess):
    """A record at 1.3 times its intensity does what it and its vertical one times 1.3 do."""
    t = 0.02 * np.arange(200)
    (folder / "pair").mkdir()
    for name, gain in (("S1_H", 3.0), ("S2_H", 4.0), ("S1_UP", 9.0), ("S2_UP", 9.0)):
        write_record(
            folder / "pair" / f"{name}.csv", (gain * np.sin((4.0 + gain) * t) * np.exp(-t)).tolist()
        )
    words = "cabinet.toml pair --read vertical=true"
    own = assess(f"{words} --levels pga:1:2:2")["tables"]["motions"][0]["own"]
    scaled = assess(f"{words} --levels pga:{own!r}:{1.3 * own!r}:2")["tables"]["ida"][1]
    run = assess(f"{words} --read scale=1.3")["tables"]["runs"][0]
    assert scaled["record"] == "S1_H"
    assert scaled["direction"] == 1
    assert run["record"] == "S1_H"
    assert scaled["peak_rotation_alpha"] == pytest.approx(run["peak_rotation"], rel=1e-6)


def test_numbers_of_an_excitation_that_records_replace_are_not_drawn(assess, refused):
    words = "uncertain-pulse.toml records/R00.csv"
    assert assess(words)["runs"] == 1
    assert "besides the excitation that the records replace" in refused(
        "assess", *words.split(), "--samples", "8"
    )
