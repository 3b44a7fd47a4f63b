"""An assessment against a loop of one's own, and what it says."""

import json
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from dask.distributed import LocalCluster

from rockcheck.commands.cli import main
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Event, Record, load_scene
from rockcheck.scenes.files import load_uncertain_scene
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy.motion import motion_of, spread, wall_speeds
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
    samples = np.sin(2.0 * math.pi * np.outer(t, tones) + phases) @ (1.0 / tones)
    samples *= np.minimum(t / 2.0, 1.0) * np.exp(-np.maximum(t - 5.0, 0.0))
    return Record.from_samples(samples * random.uniform(4.0, 12.0) / np.abs(samples).max(), 0.02)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The cabinet's file, and its records."""
    path = tmp_path_factory.mktemp("assess")
    (path / "cabinet.toml").write_text(CABINET, encoding="utf-8")
    uncertain = CABINET.replace("friction = 0.4", "friction = { value = 0.4, sd = 0.04 }")
    (path / "uncertain.toml").write_text(uncertain, encoding="utf-8")
    (path / "records").mkdir()
    for seed in range(COUNT):
        record = noise(seed)
        times = record.time_step * np.arange(len(record.unscaled))
        rows = zip(times.tolist(), record.unscaled, strict=True)
        text = "".join(f"{t!r},{a!r}\n" for t, a in rows)
        (path / "records" / f"R{seed:02d}.csv").write_text(
            f"time_s,acceleration_m_s2\n{text}", encoding="utf-8"
        )
    return path


@pytest.fixture
def assess(folder, tmp_path, monkeypatch, capsys):
    """Runs the command in the folder and returns what --json says."""
    monkeypatch.chdir(folder)

    def run(words: str):
        code = main([*f"assess {words} --json".split(), "--out", str(tmp_path / "out")])
        said = json.loads(capsys.readouterr().out)
        assert code == said["exit_code"] == (0 if said.get("converged", True) else 1)
        return said

    return run


@pytest.fixture(scope="module")
def loop(folder):
    """What a user would write: the histories by gap (inf: without the wall) and record."""
    scene, model = load_scene(folder / "cabinet.toml"), EventBasedModel(pivot="unilateral")
    found = {}
    for gap in (*GAPS, math.inf):
        walls = [] if math.isinf(gap) else [scene.walls[0].replace(gap=gap)]
        for path in sorted((folder / "records").glob("*.csv")):
            shaken = scene.replace(walls=walls, excitation=Record.from_file(path))
            found[gap, path.stem] = shaken, model.simulate(shaken)
    return found


def test_counts_motions_and_gaps_are_those_of_a_loop_of_ones_own(assess, loop):
    said = assess(f"cabinet.toml records --gaps {','.join(map(str, GAPS))}")
    at = {
        gap: {name: history for (g, name), (_, history) in loop.items() if g == gap}
        for gap in (*GAPS, math.inf)
    }
    outcomes = Counter(history.outcome for history in at[0.05].values())
    assert said["runs"] == COUNT
    assert said["outcomes"] == {name: outcomes[name] for name in said["outcomes"]}
    stand = {k: h.frame for k, h in at[0.05].items() if not h.outcome.startswith("overturned")}
    fallen = COUNT - len(stand)
    assert 0 < fallen < COUNT, "the records tell falling from standing"
    assert said["overturning"]["count"] == fallen
    assert said["overturning"]["probability"] == pytest.approx(fallen / COUNT)
    expected = {
        "peak_rotation": lambda f: np.max(np.abs(f.theta)) / math.atan(0.3),
        "slip": lambda f: np.max(np.abs(f.slip)),
        "top_displacement": lambda f: max(
            np.max(np.abs(f.x + d * (np.cos(f.theta) - 1.0) - np.sin(f.theta))) for d in (-0.3, 0.3)
        ),
    }
    for name, value_of in expected.items():
        one, values = said["quantities"][name], {k: value_of(f) for k, f in stand.items()}
        assert (one["of"], one["record"]) == (len(stand), max(values, key=values.get))
        assert one["median"] == pytest.approx(np.median(list(values.values())), rel=1e-9)
        assert one["largest"] == pytest.approx(max(values.values()), rel=1e-9)
    for row in said["gaps"]:
        runs = at[row["gap"]].values()
        fell = sum(history.outcome.startswith("overturned") for history in runs)
        struck = sum("wall impact" in set(history.events.kind) for history in runs)
        assert (row["runs"], row["overturned"], row["struck"]) == (COUNT, fell, struck)
    reach = [
        np.max(np.hypot(0.3, 1.0) * np.sin(math.atan(0.3) + np.abs(f.theta)) - 0.3 + f.x)
        for f in (history.frame for history in at[math.inf].values())
    ]
    assert said["clearance"] == pytest.approx(max(reach), rel=1e-9)
    fallen_at = [row["overturned"] for row in said["gaps"]]
    safe = [gap for k, gap in enumerate(GAPS) if not any(fallen_at[: k + 1])]
    assert said["none_overturns_up_to"] == max(safe, default=None)
    assert said["monotonic"] == (fallen_at == sorted(fallen_at))


def test_the_speed_at_the_wall_is_that_of_the_outermost_corner_as_it_strikes(loop):
    """Against the same motion with a hundred times as many rows."""
    for scene, history in [loop[0.05, f"R{k:02d}"] for k in range(4)]:
        fine = EventBasedModel(pivot="unilateral").simulate(scene.replace(output_step=5e-5))
        if wall_speeds(fine, scene):
            speeds = [motion_of(one, scene).wall_speed for one in (history, fine)]
            assert speeds[0] == pytest.approx(speeds[1], rel=5e-3)


@pytest.mark.parametrize(("before", "speed"), [(None, 0.4), (0.15, 0.3)])
def test_the_speed_at_the_wall_is_carried_on_over_no_other_event(made, before, speed):
    """From rows 0.1 s apart to the event 0.1 s after the last, 0.1 m/s more a row; an event between
    the rows has changed the speed, so the last one stands."""
    events = [Event(t=t, kind=kind) for t, kind in ((before, "slip"), (0.3, "wall impact")) if t]
    leftward = np.array([0.1, 0.2, 0.3, -0.2])
    history = made([0.0] * 4, t=0.1 * np.arange(4), x_dot=-leftward, events=events)
    scene = load_scene("fig5a")
    assert {wall.side for wall in scene.walls} == {"left"}
    assert wall_speeds(history, scene) == pytest.approx([speed])


def test_hand_methods_stand_beside_the_simulation(assess, loop):
    said = assess("cabinet.toml records")["criteria"]
    runs = [loop[0.05, f"R{k:02d}"] for k in range(COUNT)]
    for criterion, row in zip(CRITERIA, said, strict=True):
        says = [criterion.says(scene, base_of(scene))[0] for scene, _ in runs]
        assert (row["of"], row["predicts"]) == (COUNT, sum(says))
        if criterion.event == "overturns":
            falls = [history.outcome.startswith("overturned") for _, history in runs]
            assert row["simulated"] == sum(falls)
            assert row["agrees"] == sum(a == b for a, b in zip(says, falls, strict=True))


def test_contributions_are_shares_and_the_largest_comes_first(assess):
    said = assess("uncertain.toml records --samples 8 --models ebm-unilateral,ebm")
    shares = [row["share"] for row in said["contributions"]]
    sources = {"records", "inputs", "numerical error", "model form", "impact law"}
    assert {row["source"] for row in said["contributions"]} == sources
    assert sum(shares) == pytest.approx(1.0)
    assert shares == sorted(shares, reverse=True)
    assert said["runs"] == 8 * COUNT
    assert said["overturning"]["low"] < said["overturning"]["probability"]


def test_draws_are_the_same_in_any_number_of_processes_and_are_read_back(
    assess, folder, tmp_path, told
):
    words = "uncertain.toml records --samples 4 --gaps 0.05,0.2"
    first = assess(words)
    made = first.pop("made")
    again = assess(f"{words} --jobs 1")
    assert again.pop("made")["jobs"] == 1 != made["jobs"] or made["jobs"] == 1
    assert again == first
    with LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0"
    ) as cluster:
        out = ["--out", str(tmp_path / "dask"), "--scheduler", cluster.scheduler_address]
        assert told("assess", *words.split(), *out)["gaps"] == first["gaps"]


def test_one_run_says_how_sure_it_is(assess):
    said = assess("uncertain.toml --samples 16")
    assert (said["runs"], said["converged"], said["inputs"]["samples"]) == (1, True, 16)
    assert {q["name"] for q in said["quantities"]} >= {"peak_rotation", "last_slip", "outcome"}
    assert said["numerical"]["quantities"] == said["quantities"]
    assert said["inputs"]["sensitivities"][0]["name"] == "floor.friction"
    assert said["motion"]["top_displacement"]["of"] == 1


def test_a_gap_on_a_side_without_a_wall_puts_one_there(assess):
    said = assess("cabinet.toml records/R00.csv --gaps left:0.01,0.5")
    assert [row["gap"] for row in said["gaps"]] == [0.01, 0.5]
    assert said["gaps"][0]["struck"] == 1


def test_a_gap_that_was_not_played_is_not_called_safe(folder):
    """As where Ctrl-C ended the runs, or all of them failed; nor is such a run called unsure."""
    own = load_uncertain_scene(folder / "cabinet.toml")
    study = Assessment(own=own, cases={"cabinet": own}, gaps=(0.05, 0.1), sides=("right",))
    found = study.gather({task: task.play() for task in study.parts["shown"]["cabinet"]})
    assert (found.data["gaps"], found.exit_code) == ([], 0)
    assert "overturn" not in found.answer.partition(".")[2]


def test_the_history_of_each_run_and_its_tables_are_written(assess, tmp_path, loop):
    assess("cabinet.toml records/R0*.csv --gaps 0.05")
    out = tmp_path / "out"
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "as CSV, in at most 2000 rows" in page
    for name in ("R00", "R09"):
        assert f'href="histories/{name}.csv"' in page
        theta, frame = (
            pd.read_csv(out / "histories" / f"{name}.csv").theta,
            loop[0.05, name][1].frame,
        )
        kept = frame.theta[:: -(-len(frame) // 2000)]
        assert theta.tolist() == pytest.approx(kept.tolist(), abs=1e-15)
    for table in ("outcomes", "quantities", "gaps", "contributions", "criteria", "runs"):
        assert (out / f"{table}.csv").is_file()
    assert (out / "summary.md").read_text(encoding="utf-8").startswith("# Assessment: cabinet")


def test_a_block_that_falls_has_no_numerical_error_and_the_page_says_whose_figures_are_meant(
    folder, assess, tmp_path
):
    """It falls with a finer tolerance, too, and counts as 1 alpha."""
    text = CABINET.replace("amplitude = 5.0", "amplitude = 15.0")
    (folder / "falls.toml").write_text(text, encoding="utf-8")
    said = assess("falls.toml")
    assert said["tables"]["outcomes"][0]["outcome"].startswith("overturned")
    sources = {row["source"]: row["sd"] for row in said["contributions"]}
    assert sources["numerical error"] == 0.0
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "of runs that stand" not in page  # none does, and the table would be empty
    assert "Of a block that falls only the speed at the wall is given." in page


def test_each_record_has_a_file_of_its_own(folder, assess, tmp_path):
    (folder / "alike").mkdir()
    for name, record in (("a b.csv", "R00.csv"), ("a-b.csv", "R01.csv")):
        (folder / "alike" / name).write_bytes((folder / "records" / record).read_bytes())
    assess("cabinet.toml alike")
    assert len(list((tmp_path / "out" / "histories").iterdir())) == 2


def test_an_engine_may_play_and_is_compared(assess):
    said = assess("cabinet.toml --models mujoco,ebm-unilateral --set time_step=4e-3")
    assert said["model"] == "mujoco"
    assert said["quantities"][0]["u_num"] != 0.0
    assert [row["model"] for row in said["tables"]["models"]] == ["ebm-unilateral"]


def test_of_a_run_that_is_not_converged_nothing_is_said_to_change_the_answer_most(
    folder, tmp_path, capsys
):
    words = "assess new.toml --models mujoco,ebm-unilateral --set time_step=1e-3 --json --out"
    assert main(["new", str(folder / "new.toml")]) == 0
    capsys.readouterr()
    assert main([*words.replace("new", str(folder / "new")).split(), str(tmp_path)]) == 1
    said = json.loads(capsys.readouterr().out)
    sure = next(row for row in said["tables"]["answers"] if row["question"].startswith("How sure"))
    assert sure["answer"] == "Not converged: no figure of it is sure."
    page = (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "numerical error (no run is converged)" in page


@pytest.mark.parametrize(
    "words", ["--models ebm", "--models ebm-unilateral,ebm", "records/R00.csv --models cm,ebm"]
)
def test_a_model_that_fails_ends_with_3(folder, tmp_path, words):
    """The paper's model knows no floor that bounces."""
    bouncy = CABINET.replace("friction = 0.4", "friction = 0.4\nrestitution = 0.5")
    (folder / "bouncy.toml").write_text(bouncy, encoding="utf-8")
    path, *records = [str(folder / one) for one in ("bouncy.toml", *words.split()[:-2])]
    asked = ["assess", path, *records, *words.split()[-2:], "-q"]
    assert main([*asked, "--out", str(tmp_path)]) == 3


def test_the_records_are_judged_by_what_the_suites_cover_and_not_what_they_replace(folder):
    own = load_uncertain_scene(folder / "cabinet.toml")
    record = noise(0)
    shaken = {
        name: replace(own, scene=own.scene.replace(excitation=record.scaled(most / record.peak)))
        for name, most in (("weak", 0.2), ("strong", 0.6))
    }
    found = Assessment(own=own, cases=shaken, recorded=True).gather({})
    notes = [line for block in found.blocks if isinstance(block, Text) for line in block.items]
    assert [one.endswith("(weak)") for one in notes if "peak acceleration" in one] == [True]
    assert len([one for one in notes if "cover: alpha is" in one]) == 1


def test_a_record_without_all_of_its_draws_is_not_pooled_with_draws(folder, monkeypatch):
    monkeypatch.setattr("rockcheck.validation.studies.population.runs.MOST_RUNS", 4)
    own = load_uncertain_scene(folder / "uncertain.toml")
    study = Assessment(own=own, cases=dict.fromkeys("abc", own), samples=8, recorded=True)
    done = {task: task.play() for case in study.cases for task in study.parts["shown"][case]}
    assert study.gather(done).data["runs"] == 3, "no draws: each as it is"
    drawn = study.parts["drawn"]
    found = study.gather(done | {t: t.play() for t in [*drawn["a"], drawn["b"][0]]})
    assert found.data["runs"] == 8
    notes = [line for block in found.blocks if isinstance(block, Text) for line in block.items]
    assert any(line.startswith("left out") and line.endswith(": b, c") for line in notes)


def test_a_scene_in_which_nothing_is_known_of_a_figure_has_none():
    assert spread([]) == {"median": None, "p16": None, "p84": None, "largest": None}


def test_a_peak_acceleration_scales_the_record_of_a_scene(folder):
    name = folder / "records" / "R01.csv"
    scaled = load_scene(write(folder, f'file = "{name}"\npga = 0.5')).excitation
    assert scaled.peak == pytest.approx(0.5, rel=1e-12)
    assert scaled.unscaled == Record.from_file(name).unscaled


@pytest.mark.parametrize(
    "more", ["pga = 0.5\nscale = 2.0", "pga = -1.0", "pga = 1e9", 'pga = "0.5 g"']
)
def test_a_peak_acceleration_that_cannot_be_is_named(folder, more, refused):
    path = write(folder, f'file = "{folder / "records" / "R01.csv"}"\n{more}')
    assert "excitation.pga" in refused("assess", str(path))


def write(folder, excitation):
    path = folder / "pga.toml"
    head = CABINET.partition("[excitation]")[0]
    path.write_text(f'{head}[excitation]\nkind = "record"\n{excitation}\n', encoding="utf-8")
    return path


def test_a_scaled_record_moves_the_base_upward_as_much_more(folder, assess):
    """A record at 1.3 times its intensity does what the record and its vertical one times 1.3 do,
    but for the rows that the peak is read from."""
    t = 0.02 * np.arange(200)
    (folder / "pair").mkdir()
    for name, gain in (("S1_H", 3.0), ("S2_H", 4.0), ("S1_UP", 9.0), ("S2_UP", 9.0)):
        text = "".join(f"{a!r}\n" for a in (gain * np.sin((4.0 + gain) * t) * np.exp(-t)).tolist())
        (folder / "pair" / f"{name}.csv").write_text(f"acceleration_m_s2\n{text}", encoding="utf-8")
    words = "cabinet.toml pair --read vertical=true --read time_step=0.02"
    [own, _] = [row["own"] for row in assess(f"{words} --levels pga:1:2:2")["tables"]["motions"]]
    scaled = assess(f"{words} --levels pga:{own!r}:{1.3 * own!r}:2")["tables"]["ida"][1]
    ran = assess(f"{words} --read scale=1.3")["tables"]["runs"][0]
    assert (scaled["record"], scaled["direction"], ran["record"]) == ("S1_H", 1, "S1_H")
    assert scaled["peak_rotation_alpha"] == pytest.approx(ran["peak_rotation"], rel=1e-2)


def test_numbers_of_an_excitation_that_records_replace_are_not_drawn(folder, tmp_path, refused):
    uncertain = CABINET.replace("amplitude = 5.0", "amplitude = { value = 5.0, sd = 0.1 }")
    (folder / "pulse.toml").write_text(uncertain, encoding="utf-8")
    words = ("assess", str(folder / "pulse.toml"), str(folder / "records" / "R00.csv"))
    assert "besides the excitation that the records replace" in refused(*words, "--samples", "8")
    assert main([*words, "-q", "--out", str(tmp_path / "out")]) == 0
    assert "--samples 64" not in (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("words", ["records/R00.csv", "--levels 1:2:3", ""])
def test_a_capacity_of_which_no_curve_is_asked_for_is_refused(folder, refused, words):
    given = [str(folder / one) if one.endswith("csv") else one for one in words.split()]
    said = refused("assess", str(folder / "cabinet.toml"), *given, "--capacity", "0.5")
    assert said == "rockcheck: --capacity: needs records and --levels"
