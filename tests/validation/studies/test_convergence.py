"""The convergence study: to which event-based model engines and CM tend, and its arithmetic."""

import csv
import json
import math
import re
from pathlib import Path

import pytest

from rockcheck.commands.cli import main
from rockcheck.reports.studies.convergence import write_convergence
from rockcheck.validation.bench import convergence
from rockcheck.validation.bench.convergence import (
    GAPS,
    PULSES,
    RESTITUTIONS,
    SCENES,
    SWEEPS,
    Convergence,
    StudyScene,
    SweepRun,
    evaluated,
    play,
    save,
    study_scene,
)
from rockcheck.validation.execute.models import not_installed

SOME = ("long 53 mm e 0.5", "short 3 mm e 0")
#: Who can play which of them here: Drake has no restitution, and is not installed everywhere.
PLAYED = [(name, sweep) for name in SOME for sweep in SWEEPS.values() if not not_installed(sweep.model) and sweep.plays(SCENES[name])]


@pytest.fixture(scope="module")
def study() -> Convergence:
    """Two scenes with the two coarser settings of each model."""
    plays = [play(name, sweep.model, value) for name, sweep in PLAYED for value in sweep.values[:2]]
    return evaluated([study_scene(name) for name in SOME], plays, quick=True)


@pytest.mark.parametrize(("scene", "model"), [(name, sweep.model) for name, sweep in PLAYED])
def test_errors_fall_against_the_unilateral_model_and_stall_against_the_papers(study: Convergence, model: str, scene: str) -> None:
    """A tenth of the step leaves at most a fifth of the numerical error, and nothing of the model-form difference less."""
    coarse, fine = study.line(model, scene)
    (case,) = (case for case in study.cases if case.scene == scene)
    assert coarse.step == pytest.approx(1e-3, rel=0.2)
    assert fine.step == pytest.approx(1e-4, rel=0.1)
    assert coarse.error("ebm-unilateral") > 5.0 * fine.error("ebm-unilateral")
    assert fine.error("ebm-unilateral") < 2e-4
    assert fine.error("ebm") == pytest.approx(case.model_form, rel=0.05)
    assert coarse.error("ebm") == pytest.approx(case.model_form, rel=0.15)
    assert case.model_form > 5e-3


def test_orders_are_first_or_better_against_one_and_none_against_the_other(study: Convergence) -> None:
    for model in study.models():
        assert study.order(model, "ebm-unilateral") > 0.7
        assert abs(study.order(model, "ebm")) < 0.1
    assert study.exceptions == ()


def test_who_has_no_restitution_plays_the_scenes_without_it() -> None:
    assert [name for name in SCENES if not SWEEPS["drake"].plays(SCENES[name])] == [name for name in SCENES if name.endswith("e 0.5")]
    assert all(SWEEPS["mujoco"].plays(scene) for scene in SCENES.values())


def test_every_pulse_hits_the_wall_and_leaves_the_unilateral_block_standing() -> None:
    assert len(SCENES) == len(PULSES) * len(GAPS) * len(RESTITUTIONS) == 18
    for name in SCENES:
        case = study_scene(name)
        assert not case.ends["ebm-unilateral"].startswith("overturned")
        assert case.model_form > 1e-3, "without a wall hit the two references are one model"
        assert 3.0 < case.horizon <= convergence.DURATION


def made(*errors: float, model: str = "mujoco", scene: str = SOME[0], other: float = 0.1) -> list[SweepRun]:
    """Runs with these errors against the unilateral model, steps falling tenfold from 1e-3."""
    return [SweepRun(scene, model, 10.0 ** -(3 + n), 10.0 ** -(3 + n), error, other) for n, error in enumerate(errors)]


CASES = [StudyScene(scene, 5.0, 0.1, {"ebm-unilateral": "at rest", "ebm": "at rest"}) for scene in SOME]


def test_levels_and_orders_of_known_errors() -> None:
    found = evaluated(CASES, [*made(1e-2, 1e-3, 1e-4), *made(4e-2, 4e-4, 4e-6, scene=SOME[1])])
    assert [level.median for level in found.levels if level.reference == "ebm-unilateral"] == pytest.approx([2.5e-2, 7e-4, 5.2e-5])
    assert [level.within for level in found.levels if level.reference == "ebm-unilateral"] == [0, 2, 2]
    assert found.order("mujoco", "ebm-unilateral", SOME[0]) == pytest.approx(1.0)
    assert found.order("mujoco", "ebm-unilateral", SOME[1]) == pytest.approx(2.0)
    assert found.order("mujoco", "ebm") == pytest.approx(0.0, abs=1e-12)
    assert math.isnan(found.order("cm", "ebm"))
    assert found.exceptions == ()


def test_what_does_not_converge_is_named_not_dropped() -> None:
    stalled, far, rounded = made(5e-4, 4e-4, 4e-4), made(1.0, 1e-1, 1e-2, scene=SOME[1]), made(1e-8, 1e-8, model="cm")
    found = evaluated(CASES, [*stalled, *far, *rounded])
    assert [line.partition(":")[0] for line in found.exceptions] == [f"{SOME[0]}, mujoco", f"{SOME[1]}, mujoco"]
    assert max(level.largest for level in found.levels if level.value == 1e-5) == pytest.approx(0.1)
    assert len(found.plays) == 8


def test_a_failed_run_is_infinitely_wrong_and_named(tmp_path: Path) -> None:
    failed = SweepRun(SOME[0], "pybullet", 1e-3, failure="it blew up <fast>")
    found = evaluated(CASES, [failed, *made(1e-2, 1e-3), *made(1e-2, 1e-3, scene=SOME[1])])
    (level,) = (level for level in found.levels if (level.model, level.reference) == ("pybullet", "ebm-unilateral"))
    assert (level.median, level.within, level.runs) == (math.inf, 0, 1)
    assert any("pybullet at time_step 0.001 failed: it blew up <fast>" in line for line in found.exceptions)
    save(found, tmp_path)
    page = write_convergence(found, tmp_path).read_text(encoding="utf-8")
    assert "it blew up &lt;fast&gt;" in page


def test_the_page_holds_every_table_and_asks_nothing_of_others(study: Convergence, tmp_path: Path) -> None:
    save(study, tmp_path)
    page = write_convergence(study, tmp_path).read_text(encoding="utf-8")
    assert json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["cases"][0]["scene"] == SOME[0]
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(study.plays) == 2 * len(PLAYED) >= 12
    assert float(rows[0]["against_ebm"]) == pytest.approx(study.plays[0].against_ebm, rel=1e-5)
    assert (tmp_path / "figures" / "error-over-step.svg").stat().st_size > 1000
    for name in re.findall(r'(?:src|href)="((?!data:|#|index)[^"]+)"', page):
        assert (tmp_path / name).exists(), name
    for word in (*SOME, "MuJoCo", "PyBullet", "CM", "EBM, unilateral"):
        assert word in page
    assert "nan" not in re.sub(r"<[^>]*>", "", page)
    assert "https://" not in page


def test_the_command_writes_the_page_and_prints_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(convergence, "QUICK", SOME[1:])
    monkeypatch.setattr(convergence, "SWEEPS", {"cm": SWEEPS["cm"]})
    assert main(["convergence", "--quick", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "order of cm" in printed
    assert (tmp_path / "index.html").exists()
    assert len((tmp_path / "runs.csv").read_text(encoding="utf-8").splitlines()) == 3
