"""The benchmark: orders of convergence and error levels of every model at two settings (never times), and its arithmetic."""

import json
import math
from pathlib import Path

import pytest

from rockcheck.commands.cli import main
from rockcheck.reports.studies.benchmark import write_benchmark
from rockcheck.reports.style import power_of_ten
from rockcheck.validation.bench import models as benchmark_models
from rockcheck.validation.bench.ebm import CASES, LEVEL, EbmSpeed, _times, batch_sizes
from rockcheck.validation.bench.models import (
    LINES,
    BenchmarkRun,
    Point,
    cost_at,
    error_at,
    evaluated,
    measure,
    order_of,
    planned,
    work_precision,
)
from rockcheck.validation.bench.scenes import FAMILIES, MEMBERS, prepared
from rockcheck.validation.bench.skipping import Saving, skipping
from rockcheck.validation.bench.study import Benchmark, save
from rockcheck.validation.bench.tables import markdown
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import not_installed

SOME = (1, 4, 7)


def order_and_errors(family: str, line: str, coarse: float, fine: float) -> tuple[float, float, float]:
    """Order between two settings and the median errors at them, alpha, of three members."""
    found = evaluated([measure(family, k, line, value, repeats=1) for k in SOME for value in (coarse, fine)], ())
    first, second = (point.rms for point in found.line(family, line))
    return math.log(first / second) / math.log(coarse / fine), first, second


@pytest.mark.parametrize(
    ("family", "line", "coarse", "fine", "order", "level"),
    [
        ("free", "ebm", 1e-6, 1e-10, 0.9, 1e-9),
        ("slip a", "ebm", 1e-6, 1e-10, 0.9, 2e-9),
        ("wall 53 mm e 0.5", "ebm-unilateral", 1e-6, 1e-10, 0.8, 2e-8),
        ("fig5a", "ebm-unilateral", 1e-4, 1e-10, 0.5, 1e-7),
        ("pulse a", "ebm-bouc-wen", 1e-4, 1e-5, 0.3, 2e-3),
        ("free", "cm", 1e-6, 1e-8, 0.9, 1e-6),
        ("slip a", "cm", 1e-6, 1e-8, 0.6, 2e-4),
        ("wall 53 mm e 0", "cm", 1e-5, 1e-7, 0.35, 1e-4),
        ("wall 53 mm e 0.5", "cm", 1e-6, 1e-8, 0.35, 5e-4),
        ("free", "mujoco", 1e-3, 1e-4, 0.4, 8e-4),
        ("slip a", "mujoco", 1e-3, 1e-4, 0.6, 1e-3),
        ("wall 53 mm e 0.5", "mujoco", 1e-2, 1e-4, 0.7, 2e-3),
        ("free", "pybullet", 1e-3, 1e-4, 0.4, 8e-4),
        ("slip a", "pybullet", 1e-3, 1e-4, 0.6, 1e-3),
        ("wall 53 mm e 0.5", "pybullet", 1e-2, 1e-4, 0.7, 2e-3),
    ],
)
def test_every_model_converges_to_its_limit(family: str, line: str, coarse: float, fine: float, order: float, level: float) -> None:
    found, _, error = order_and_errors(family, line, coarse, fine)
    assert found > order
    assert error < level


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize("family", ["pulse b", "slip b", "wall 3 mm e 0.5", "wall 53 mm e 0"])
def test_adaptive_engines_are_within_a_twenty_thousandth_of_alpha(engine: str, family: str) -> None:
    """At steps of at most 4 ms, which cost less than fixed ones of 1 ms."""
    samples = [measure(family, k, f"{engine} adaptive", 4e-3, repeats=1) for k in SOME]
    assert evaluated(samples, ()).points[0].rms < 5e-5
    assert all(sample.steps < 450 * sample.horizon for sample in samples)


def test_mujocos_default_contact_does_not_converge_beside_a_wall() -> None:
    """Its error has reached a tenth of alpha and stays there as the step falls."""
    order, _, error = order_and_errors("wall 53 mm e 0.5", "mujoco default", 1e-3, 2e-4)
    assert abs(order) < 0.3
    assert error > 0.02


@pytest.mark.parametrize("family", FAMILIES)
def test_members_stay_up_and_end_at_their_horizon(family: str) -> None:
    """A member that fell would be compared over its fall only; without wall the two limits are one model."""
    for k in range(MEMBERS):
        ready = prepared(family, k)
        assert 1.5 < ready.horizon <= 8.0
        assert ready.scene.duration == ready.horizon
        for reference in ready.references.values():
            assert not reference.outcome.startswith("overturned")
        assert (ready.model_form > 1e-3) if ready.scene.walls else (ready.model_form < 1e-12)


def point(value: float, rms: float, cpu: float) -> Point:
    return Point("free", "mujoco", value, 10, 0, rms, rms, rms, rms, rms, 0.0, cpu, cpu, 0.0, 1.0)


def test_the_order_is_the_slope_between_rounding_and_nonsense() -> None:
    line = [point(1e-1, 0.9, 1.0), point(1e-2, 3e-2, 1.0), point(1e-3, 3e-4, 1.0), point(1e-4, 1e-14, 1.0)]
    assert order_of(line) == pytest.approx(2.0)
    assert math.isnan(order_of(line[:2]))


def test_the_cost_of_a_level_is_interpolated_between_logarithms() -> None:
    line = [point(1e-2, 1e-2, 1.0), point(1e-3, 1e-4, 16.0)]
    assert cost_at(line) == (pytest.approx(4.0), False)
    assert cost_at(line[1:]) == (16.0, True)
    assert math.isnan(cost_at(line[:1])[0])
    worse = point(1e-4, 1e-5, 3.0)
    assert cost_at([*line, worse]) == (3.0, False)


def test_the_error_of_adaptive_steps_is_told_at_the_cost_of_fixed_ones() -> None:
    line = [point(4e-3, 1e-2, 1.0), point(1e-3, 1e-4, 16.0)]
    assert error_at(line, 4.0) == pytest.approx(1e-3)
    assert math.isnan(error_at(line, 17.0))
    runs = [sample(k, 5e-3) for k in range(10)]
    for value, rms, cpu in ((2e-3, 1e-3, 0.15), (1e-3, 1e-5, 0.6)):
        runs += [BenchmarkRun("pulse a", k, "mujoco adaptive", value, 3.0, rms=rms * (1 + k % 3), cpu=cpu) for k in range(3)]
    everything = {row.line: row for row in evaluated(runs, ()).pooled if row.kind == "all" and row.value == 1e-3}
    assert everything["mujoco"].at_the_cost == pytest.approx(2e-4)
    assert everything["mujoco adaptive"].rms_worst == pytest.approx(3e-5)


def sample(member: int, rms: float, **change: object) -> BenchmarkRun:
    return BenchmarkRun("free", member, "mujoco", 1e-3, 3.0, rms=rms, cpu=0.3, wall=0.6, set_up=0.1, steps=3000, **change)  # type: ignore[arg-type]


def test_failed_runs_count_as_infinitely_wrong_and_are_listed() -> None:
    good = [sample(k, 1e-3 * (k + 1)) for k in range(4)]
    bad = [BenchmarkRun("free", k, "mujoco", 1e-3, 3.0, failure="it blew up") for k in range(4, 10)]
    found = evaluated([*good, *bad], [("free", 0, "mujoco", 1e-5)])
    (row,) = found.points
    assert (row.runs, row.failed, row.rms, row.rms_10) == (10, 6, math.inf, pytest.approx(1.5e-3))
    assert row.cpu == pytest.approx(0.1)
    assert any("6 runs of mujoco at time_step 0.001 failed" in line and "it blew up" in line for line in found.left_out)
    assert any("no time for 1 runs of mujoco at time_step 1e-05" in line for line in found.left_out)


def test_quantiles_are_those_of_the_sample() -> None:
    found = evaluated([sample(k, 1e-3 * (k + 1)) for k in range(10)], ())
    assert found.points[0].rms == pytest.approx(5.5e-3)
    assert (found.points[0].rms_10, found.points[0].rms_90) == (pytest.approx(1.5e-3), pytest.approx(9.5e-3))


def test_what_there_was_no_time_for_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    found = work_precision(quick=True, deadline=0.0)
    assert found.samples == ()
    for label, line in LINES.items():
        if not_installed(line.model):
            continue
        values = ", ".join(f"{value:g}" for value in line.quick)
        assert f"no time for {4 * MEMBERS * len(line.quick)} runs of {label} at {line.knob} {values}" in found.left_out


def test_the_dearest_runs_come_last_and_none_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every member of every family meets every setting once; an engine's 1e-4 s after all longer steps."""
    played: list[tuple[str, int, str, float]] = []

    def note(family: str, member: int, line: str, value: float) -> BenchmarkRun:
        played.append((family, member, line, value))
        return BenchmarkRun(family, member, line, value, 3.0, rms=1e-3, cpu=0.1)

    monkeypatch.setattr(benchmark_models, "measure", note)
    found = work_precision(quick=True)
    assert sorted(played) == sorted(planned(quick=True))
    assert {point.runs for point in found.points} == {MEMBERS}
    dear = [LINES[line].knob == "time_step" and value == 1e-4 for _, _, line, value in played]
    assert dear == sorted(dear)
    assert any(dear)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_batches_are_as_good_as_their_tolerance(case: object) -> None:
    """Errors fall with the tolerance, outcomes agree, none fails, and the cheapest good tolerance is found."""
    rows = _times(case, 6, [])  # type: ignore[arg-type]
    by_tolerance = {row.tolerance: row for row in rows}
    assert by_tolerance[1e-10].error_95 < 2e-8
    assert by_tolerance[1e-12].error_95 < 1e-9
    assert by_tolerance[1e-12].error_95 < 0.1 * max(by_tolerance[1e-6].error_95, 1e-12)
    assert all(row.failed == 0 for row in rows)
    assert all(row.wrong == 0 for row in rows if row.tolerance <= 1e-8)
    best = EbmSpeed(1e-8, tuple(rows), ()).at_level(case.name)  # type: ignore[attr-defined]
    assert best is not None
    assert best.error_95 <= LEVEL


def test_the_page_holds_every_table_and_asks_nothing_of_others(tmp_path: Path) -> None:
    samples = [
        measure(family, k, line, value, repeats=1)
        for family in ("free", "wall 53 mm e 0")
        for k in SOME
        for line, value in (("ebm", 1e-4), ("ebm", 1e-8), ("cm", 1e-5), ("cm", 1e-6), ("mujoco", 1e-2))
    ]
    failed = BenchmarkRun("free", 0, "pybullet", 1e-2, 3.0, failure="it blew up <fast>")
    found = Benchmark(
        suite="benchmark all",
        created="2026-01-01T00:00:00+00:00",
        quick=True,
        jobs=1,
        wall_seconds=1.0,
        versions=provenance.versions(),
        hardware=provenance.hardware(),
        ebm=EbmSpeed(1e-8, tuple(_times(CASES[0], 6, [])), (), batch_sizes((1, 20), jobs=3)),
        models=evaluated([*samples, failed], ()),
        savings=(Saving("cm", "wall", "ms", 2.0, 1.0),),
    )
    assert [(row.runs, row.threads) for row in found.ebm.sizes] == [(1, 1), (1, 3), (20, 1), (20, 3)]  # as many as were asked for
    save(found, tmp_path)
    page = write_benchmark(found, tmp_path).read_text(encoding="utf-8")
    assert json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["suite"] == "benchmark all"
    for name in ("runs", "work-precision", "orders-and-ratios", "batches", "batch-sizes", "savings"):
        assert len((tmp_path / f"{name}.csv").read_text(encoding="utf-8").splitlines()) > 1
    for name in ("ratios", "batches", "without-wall", "with-wall"):
        assert (tmp_path / "pages" / "figures" / f"{name}.svg").stat().st_size > 1000
        assert f"pages/figures/{name}.svg" in page
    assert "nan" not in page
    assert "it blew up &lt;fast&gt;" in page
    assert "https://" not in page
    assert "PyBullet" in page
    assert "packing included" in page
    assert "| 20 |" in markdown(found)


def test_axis_labels() -> None:
    assert [power_of_ten(10.0**k) for k in (-12, -1, 0, 3, 4)] == ["10⁻¹²", "0.1", "1", "1000", "10⁴"]


def test_an_unknown_part_is_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["benchmark", "modles"]) == 2
    assert "did you mean 'models'" in capsys.readouterr().err


@pytest.mark.slow
def test_nothing_that_is_skipped_changes_the_motion() -> None:
    """Every saving but those that a scene may need (a sliding pivot's cone, a strong pulse's slip)."""
    found = skipping(quick=True)
    needed = {"cone correction", "friction limit"}
    for saving in found:
        reference = 2e-2 if saving.thing in needed or saving.model == "pybullet" else 1e-5
        assert not saving.change > reference, saving
        assert saving.cost_with > 0.0 < saving.cost_without
    assert {"ebm", "cm", "mujoco", "pybullet"} <= {saving.model for saving in found}
