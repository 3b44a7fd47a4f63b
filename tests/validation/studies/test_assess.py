"""An assessment against a loop of one's own, and what it says."""

import itertools
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from dask.distributed import LocalCluster

from rockcheck import Block, Event, EventBasedModel, MuJoCo, Record, Wall, load_scene
from rockcheck.scenes import files
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy.compare import largest_reach, motion_of, wall_speeds
from rockcheck.validation.finding import Text
from rockcheck.validation.studies.population.answers import Assessment

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


def test_counts_motions_and_gaps_are_those_of_a_loop_of_ones_own(assess, loop):
    said = assess(f"cabinet.toml records --gaps {','.join(map(str, GAPS))}")
    at = {gap: {} for gap in (*GAPS, math.inf)}
    for (gap, name), (_, history) in loop.items():
        at[gap][name] = history
    outcomes = Counter(history.outcome for history in at[0.05].values())
    assert said["outcomes"] == {name: outcomes[name] for name in said["outcomes"]}
    stand = {k: h.frame for k, h in at[0.05].items() if not h.outcome.startswith("overturned")}
    fallen = COUNT - len(stand)
    assert 0 < fallen < COUNT, "the records tell falling from standing"
    assert (said["runs"], said["overturning"]["count"], said["overturning"]["probability"]) == (
        COUNT,
        fallen,
        pytest.approx(fallen / COUNT),
    )
    values = {
        "peak_rotation": {k: np.max(np.abs(f.theta)) / math.atan(0.3) for k, f in stand.items()},
        "slip": {k: np.max(np.abs(f.slip)) for k, f in stand.items()},
        "top_displacement": {
            k: max(
                np.max(np.abs(f.x + d * (np.cos(f.theta) - 1.0) - np.sin(f.theta)))
                for d in (-0.3, 0.3)
            )
            for k, f in stand.items()
        },
    }
    told = {name: said["quantities"][name] for name in values}
    assert {
        name: (one["of"], one["record"], one["median"], one["largest"])
        for name, one in told.items()
    } == {
        name: (
            len(stand),
            max(of, key=of.get),
            pytest.approx(np.median(list(of.values())), rel=1e-9),
            pytest.approx(max(of.values()), rel=1e-9),
        )
        for name, of in values.items()
    }
    runs = [at[gap].values() for gap in GAPS]
    fallen_at = [sum(one.outcome.startswith("overturned") for one in played) for played in runs]
    # at no gap the block strikes as it lands, flush
    struck = [
        sum(bool({"wall impact", gap or "floor impact"} & {*one.events.kind}) for one in played)
        for gap, played in zip(GAPS, runs, strict=True)
    ]
    assert [
        (row["gap"], row["runs"], row["overturned"], row["struck"]) for row in said["gaps"]
    ] == list(zip(GAPS, [COUNT] * len(GAPS), fallen_at, struck, strict=True))
    reach = [
        np.max(np.hypot(0.3, 1.0) * np.sin(math.atan(0.3) + np.abs(f.theta)) - 0.3 + f.x)
        for f in (history.frame for history in at[math.inf].values())
    ]
    safe = [gap for k, gap in enumerate(GAPS) if not any(fallen_at[: k + 1])]
    assert (said["clearance"], said["none_overturns_up_to"], said["monotonic"]) == (
        pytest.approx(max(reach), rel=1e-9),
        max(safe, default=None),
        fallen_at == sorted(fallen_at),
    )


@pytest.mark.parametrize(
    ("gap", "name"), [*((0.05, f"R0{k}") for k in range(4)), (0.0, "R05"), (0.0, "R09")]
)
def test_the_speed_at_the_wall_is_that_of_the_outermost_corner_as_it_strikes(loop, gap, name):
    # at no gap it lands flush, and an engine tells that as an impact of its own
    scene, history = loop[gap, name]
    fine = (EventBasedModel(pivot="unilateral") if gap else MuJoCo()).simulate(
        scene.replace(output_step=5e-5 if gap else 5e-3)
    )
    assert motion_of(history, scene)["wall_speed"] == pytest.approx(
        motion_of(fine, scene)["wall_speed"], rel=5e-3
    )


@pytest.mark.parametrize(
    ("before", "at", "speed", "near", "turn"),
    [
        (None, 0.3, 0.4, {}, 0.0),
        (0.15, 0.3, 0.3, {}, 0.0),
        (None, 0.05, 0.1, {}, 0.0),
        (None, 1e-12, 0.1, {}, 0.0),
        (None, 0.3, 0.4, {"right": 1e-3}, 0.0),
        (None, 0.3, 1e-5, {}, 1e-5),
    ],
)
def test_the_speed_at_the_wall_is_carried_on_over_no_other_event(
    made, before, at, speed, near, turn
):
    """From rows 0.1 s apart to the event 0.1 s after the last, 0.1 m/s more a row; an event between
    the rows has changed the speed, so the last one stands, as does the first row's where there is
    no other. The wall is on the left. One on the right may be nearer in the last row, but it is not
    struck; a block that turns upright until the event strikes with its top."""
    history = made(
        turn * (0.1 * np.arange(4) - 0.25),
        t=0.1 * np.arange(4),
        x_dot=np.array([-0.1, -0.2, -0.3, 0.2]) * (turn == 0.0),
        theta_dot=np.full(4, turn),
        events=[Event(t=t, kind=kind) for t, kind in ((before, "slip"), (at, "wall impact")) if t],
    )
    scene = load_scene("fig5a").replace(
        block=Block(half_width=0.3, half_height=1.0),
        walls=[Wall(side=side, gap=gap) for side, gap in {"left": 0.03, **near}.items()],
    )
    assert [*wall_speeds(history, scene)] == [(pytest.approx(speed), "left")]


def test_rounding_is_no_reach(made):
    history = made(np.full(4, 1e-17), t=0.1 * np.arange(4))
    assert largest_reach(history, load_scene("fig5a"), "left") == 0.0


def test_hand_methods_stand_beside_the_simulation(assess, loop):
    said = assess("cabinet.toml records")["criteria"]
    runs = [loop[0.05, f"R{k:02d}"] for k in range(COUNT)]
    says = [[one.says(scene, base_of(scene))[0] for scene, _ in runs] for one in CRITERIA]
    assert [(row["of"], row["predicts"]) for row in said] == [(COUNT, sum(one)) for one in says]


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
    said = assess(f"uncertain.toml --samples 16 --models {model}")
    assert (said["exit_code"], said["runs"], said["converged"]) == (0, 1, True)
    inputs = said["inputs"]
    assert (inputs["samples"], inputs["model"], inputs["sensitivities"][0]["name"]) == (
        16,
        model,
        "floor.friction",
    )
    assert {q["name"] for q in said["quantities"]} >= {"peak_rotation", "last_slip", "outcome"}
    assert said["numerical"]["quantities"] == said["quantities"]
    assert said["motion"]["top_displacement"]["of"] == 1


def test_a_gap_on_a_side_without_a_wall_tries_one_there_and_leaves_the_scene_as_it_is(assess):
    plain, said = (
        assess(f"cabinet.toml records/R00.csv{gaps}") for gaps in ("", " --gaps left:0.01,0.02")
    )
    assert ([row["gap"] for row in said["gaps"]], said["gaps"][0]["struck"]) == ([0.01, 0.02], 1)
    assert {key: said[key] for key in ("outcomes", "motion")} == {
        key: plain[key] for key in ("outcomes", "motion")
    }


@pytest.mark.parametrize("later", [(), (0.1,)])
def test_a_gap_that_was_not_played_is_not_called_safe(folder, later):
    """As where Ctrl-C ended the runs, or all of them failed, also where a wider one was; nor is
    such a run called unsure. The other law of impacts is another one."""
    own = files.load_uncertain_scene(folder / "cabinet.toml")
    study = Assessment(
        own=own,
        cases={"cabinet": own},
        gaps=(0.05, 0.1),
        sides=("right",),
        models={"ebm-unilateral": {"impacts": "floor-first"}},
    )
    found = study.gather(
        {
            task: task.play()
            for part in (study.parts["shown"], *(study.at_gaps[gap] for gap in later))
            for task in part["cabinet"]
        }
    )
    assert (
        [(row["gap"], row["overturned"]) for row in found.data["gaps"]],
        found.data["none_overturns_up_to"],
        found.exit_code,
    ) == ([(gap, 0) for gap in later], None, 0)
    assert (
        "overturn" in found.answer.partition(".")[2],
        dict(study.parts["impact law"]["cabinet"][0].settings),
    ) == (False, {"impacts": "moreau"})


def test_the_history_of_each_run_and_its_tables_are_written(assess, tmp_path, loop):
    assess("cabinet.toml records/R0*.csv --gaps 0.05")
    out = tmp_path / "out"
    page = (out / "index.html").read_text("utf-8")
    shown = ("as CSV, in at most 2000 rows", *(f'href="histories/R0{k}.csv"' for k in (0, 9)))
    assert [part for part in shown if part not in page] == []
    for name in ("R00", "R09"):
        theta = loop[0.05, name][1].channels["theta"]
        kept = pd.read_csv(out / "histories" / f"{name}.csv").theta
        assert kept.tolist() == pytest.approx(theta[:: -(-len(theta) // 2000)].tolist(), abs=1e-15)
    assert {path.stem for path in out.glob("*.csv")} >= {
        "outcomes",
        "quantities",
        "gaps",
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


def test_of_a_run_that_is_not_converged_nothing_is_said_to_change_the_answer_most(
    assess, typed, tmp_path
):
    typed("new", "new.toml")
    said = assess("new.toml --models mujoco,ebm-unilateral --set time_step=1e-3", code=1)
    compared = [row["model"] for row in said["tables"]["models"]]
    assert (said["exit_code"], said["model"], compared) == (1, "mujoco", ["ebm-unilateral"])
    assert "Not converged: no figure of it is sure." in [
        row["answer"] for row in said["tables"]["answers"]
    ]
    assert "numerical error (no run is converged)" in (tmp_path / "out" / "summary.md").read_text(
        "utf-8"
    )


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


def test_the_records_are_judged_by_what_the_suites_cover_and_not_what_they_replace(folder):
    own = files.load_uncertain_scene(folder / "cabinet.toml")
    record = noise(0)
    shaken = {
        name: replace(own, scene=own.scene.replace(excitation=record.scaled(most / record.peak)))
        for name, most in (("weak", 0.2), ("strong", 0.6))
    }
    notes = notes_of(Assessment(own=own, cases=shaken, recorded=True).gather({}))
    assert [one.endswith("(weak)") for one in notes if "peak acceleration" in one] == [True]
    assert len([one for one in notes if "cover: alpha is" in one]) == 1


def notes_of(found):
    return [line for block in found.blocks if isinstance(block, Text) for line in block.items]


def test_a_record_without_all_of_its_draws_is_not_pooled_with_draws(folder, monkeypatch):
    monkeypatch.setattr("rockcheck.validation.studies.population.runs.MOST_RUNS", 4)
    own = files.load_uncertain_scene(folder / "uncertain.toml")
    study = Assessment(own=own, cases=dict.fromkeys("abc", own), samples=8, recorded=True)
    done = {task: task.play() for case in study.cases for task in study.parts["shown"][case]}
    assert study.gather(done).data["runs"] == 3, "no draws: each as it is"
    drawn = study.parts["drawn"]
    found = study.gather(done | {t: t.play() for t in [*drawn["a"], drawn["b"][0]]})
    assert found.data["runs"] == 8
    left_out = [line for line in notes_of(found) if line.startswith("left out")]
    assert [line.endswith(": b, c") for line in left_out] == [True]


def test_a_peak_acceleration_scales_the_record_of_a_scene(folder):
    scaled = load_scene(folder / "pga.toml").excitation
    assert (scaled, scaled.peak, scaled.unscaled) == (
        Record.from_file(folder / "records" / "R01.csv", pga=0.5),
        pytest.approx(0.5, rel=1e-12),
        noise(1).unscaled,
    )


def test_a_scaled_record_moves_the_base_upward_as_much_more(folder, assess):
    """A record at 1.3 times its intensity does what the record and its vertical one times 1.3 do,
    but for the rows that the peak is read from."""
    t = 0.02 * np.arange(200)
    (folder / "pair").mkdir()
    for name, gain in (("S1_H", 3.0), ("S2_H", 4.0), ("S1_UP", 9.0), ("S2_UP", 9.0)):
        write_record(
            folder / "pair" / f"{name}.csv", (gain * np.sin((4.0 + gain) * t) * np.exp(-t)).tolist()
        )
    words = "cabinet.toml pair --read vertical=true"
    own = assess(f"{words} --levels pga:1:2:2")["tables"]["motions"][0]["own"]
    scaled = assess(f"{words} --levels pga:{own!r}:{1.3 * own!r}:2")["tables"]["ida"][1]
    ran = assess(f"{words} --read scale=1.3")["tables"]["runs"][0]
    assert (
        scaled["record"],
        scaled["direction"],
        ran["record"],
        scaled["peak_rotation_alpha"],
    ) == ("S1_H", 1, "S1_H", pytest.approx(ran["peak_rotation"], rel=1e-2))


def test_numbers_of_an_excitation_that_records_replace_are_not_drawn(assess, tmp_path, refused):
    words = "uncertain-pulse.toml records/R00.csv"
    assess(words)
    assert "--samples 64" not in (tmp_path / "out" / "summary.md").read_text("utf-8")
    assert "besides the excitation that the records replace" in refused(
        "assess", *words.split(), "--samples", "8"
    )
